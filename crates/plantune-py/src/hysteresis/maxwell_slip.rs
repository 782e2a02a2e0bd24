//! Maxwell slip, and which way a loop turns.

use numpy::PyReadonlyArray1;
use plantune_core::hysteresis::{
    LoopDirection, MaxwellSettings, MaxwellSlip, identify_maxwell, loop_direction,
};
use pyo3::prelude::*;

use super::identified::IdentifiedOut;
use crate::error::Outcome;
use crate::values::Frozen;

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(maxwell_identify, m)?)?;
    m.add_function(wrap_pyfunction!(hysteresis_direction, m)?)
}

#[derive(FromPyObject)]
pub struct MaxwellSlipIn {
    k: Vec<f64>,
    f: Vec<f64>,
    spring: f64,
    offset: f64,
}

impl From<MaxwellSlipIn> for MaxwellSlip {
    fn from(MaxwellSlipIn { k, f, spring, offset }: MaxwellSlipIn) -> Self {
        MaxwellSlip { k, f, spring, offset }
    }
}

/// Fields of `MaxwellSlip`.
#[derive(IntoPyObject)]
pub struct MaxwellSlipOut {
    k: Frozen,
    f: Frozen,
    spring: f64,
    offset: f64,
}

impl From<MaxwellSlip> for MaxwellSlipOut {
    fn from(MaxwellSlip { k, f, spring, offset }: MaxwellSlip) -> Self {
        MaxwellSlipOut { k: Frozen(k), f: Frozen(f), spring, offset }
    }
}

/// Fields of a fitted model, and how it was found.
#[pyfunction]
#[pyo3(signature = (x, y, n, r, offset))]
fn maxwell_identify<'py>(
    py: Python<'py>,
    x: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
    n: Option<usize>,
    r: Option<Vec<f64>>,
    offset: bool,
) -> Outcome<(MaxwellSlipOut, IdentifiedOut)> {
    let settings = MaxwellSettings { n, r, offset };
    let (x, y) = (x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let fit = py.detach(|| identify_maxwell(x, y, &settings))?;
    let how = IdentifiedOut::of(y, &fit.errors, fit.sd, fit.tried);
    Ok((fit.model.into(), how))
}

/// Fields of `LoopDirection`.
#[derive(IntoPyObject)]
struct DirectionOut {
    area: f64,
    upper: f64,
    lower: f64,
    width: f64,
    direction: &'static str,
}

/// Which way the loops of a record turn.
#[pyfunction]
fn hysteresis_direction(x: PyReadonlyArray1<'_, f64>, y: PyReadonlyArray1<'_, f64>) -> Outcome<DirectionOut> {
    let (x, y) = (x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let LoopDirection { area, upper, lower, width, direction } = loop_direction(x, y)?;
    Ok(DirectionOut { area, upper, lower, width, direction })
}
