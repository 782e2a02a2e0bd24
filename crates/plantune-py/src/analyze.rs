//! Looks at a record.

use plantune_core::Limits;
use plantune_core::analyze::delay_scan;
use plantune_core::excitation::check_input_motion;
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::values::{Array, LimitsIn, NoteOut, RecordIn, array, notes};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(input_moves, m)?)?;
    m.add_function(wrap_pyfunction!(delay, m)?)
}

/// The dict behind `plantune.analyze.DelayScan(**d)`.
#[derive(IntoPyObject)]
struct DelayOut<'py> {
    nk: usize,
    order: usize,
    candidates: Vec<usize>,
    loss: Array<'py>,
    orders: Vec<usize>,
    runner_up: usize,
    N: usize,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn delay<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    input: usize,
    nk: (usize, usize),
    limits: LimitsIn,
) -> Outcome<DelayOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let scan = py.detach(|| delay_scan(&record, input, nk, &limits))?;
    Ok(DelayOut {
        nk: scan.nk,
        order: scan.order,
        candidates: scan.candidates,
        loss: array(py, scan.loss),
        orders: scan.orders,
        runner_up: scan.runner_up,
        N: scan.N,
        notes: notes(&scan.notes),
    })
}

/// Whether every input moves (X01).
#[pyfunction]
fn input_moves(rec: RecordIn<'_>, limits: LimitsIn) -> Outcome<bool> {
    let limits: Limits = limits.into();
    Ok(check_input_motion(&rec.view(&limits)?, &limits).is_ok())
}
