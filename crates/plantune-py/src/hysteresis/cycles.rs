//! Cycles of a periodic record, and how well they repeat.

use numpy::PyReadonlyArray1;
use plantune_core::hysteresis::{self, Cycles, Repeatability};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::values::Frozen;

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(hysteresis_cycles, m)?)?;
    m.add_function(wrap_pyfunction!(hysteresis_repeatability, m)?)
}

#[derive(IntoPyObject)]
struct CyclesOut {
    turns: Vec<usize>,
    whole: Vec<[usize; 3]>,
    before: usize,
    behind: usize,
    band: f64,
}

/// Turning points and whole cycles of an input (N,).
#[pyfunction]
#[pyo3(signature = (x, band=None))]
fn hysteresis_cycles(x: PyReadonlyArray1<'_, f64>, band: Option<f64>) -> Outcome<CyclesOut> {
    let Cycles { turns, whole, before, behind, band } =
        hysteresis::cycles(x.as_slice().map_err(PyErr::from)?, band)?;
    Ok(CyclesOut { turns, whole, before, behind, band })
}

#[derive(IntoPyObject)]
struct RepeatabilityOut {
    x: Frozen,
    up: Frozen,
    down: Frozen,
    cycles: usize,
    spread: [(f64, f64); 3],
}

/// Differences between the whole cycles of a record (N,).
#[pyfunction]
#[pyo3(signature = (x, y, band=None))]
fn hysteresis_repeatability(
    x: PyReadonlyArray1<'_, f64>,
    y: PyReadonlyArray1<'_, f64>,
    band: Option<f64>,
) -> Outcome<RepeatabilityOut> {
    let (x, y) = (x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let Repeatability { x, up, down, cycles, spread } = hysteresis::repeatability(x, y, band)?;
    Ok(RepeatabilityOut { x: Frozen(x), up: Frozen(up), down: Frozen(down), cycles, spread })
}
