//! Bouc-Wen: oscillator and force, simulated and fitted.

use numpy::PyReadonlyArray1;
use plantune_core::Error;
use plantune_core::hysteresis::{
    BoucWen, BoucWenForce, BoucWenSettings, Hold, Model, identify_bouc_wen, identify_force, initial_state,
    simulate_bouc_wen,
};
use pyo3::prelude::*;

use super::identified::IdentifiedOut;
use super::{HysteresisIn, not_a_model};
use crate::error::Outcome;
use crate::note::{NoteOut, notes};
use crate::values::{Array, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(bouc_wen_simulate, m)?)?;
    m.add_function(wrap_pyfunction!(bouc_wen_identify, m)?)?;
    m.add_function(wrap_pyfunction!(bouc_wen_initial_state, m)?)?;
    m.add_function(wrap_pyfunction!(bouc_wen_force_identify, m)?)
}

#[derive(FromPyObject)]
pub struct BoucWenIn {
    m: f64,
    c: f64,
    k: f64,
    alpha: f64,
    bg: f64,
    bd: f64,
    nu: f64,
    Ts: Option<f64>,
}

impl From<BoucWenIn> for BoucWen {
    fn from(BoucWenIn { m, c, k, alpha, bg, bd, nu, Ts }: BoucWenIn) -> Self {
        BoucWen { m, c, k, alpha, bg, bd, nu, Ts }
    }
}

/// Fields of `BoucWen`.
#[derive(IntoPyObject)]
pub struct BoucWenOut {
    m: f64,
    c: f64,
    k: f64,
    alpha: f64,
    bg: f64,
    bd: f64,
    nu: f64,
    Ts: Option<f64>,
}

impl From<BoucWen> for BoucWenOut {
    fn from(BoucWen { m, c, k, alpha, bg, bd, nu, Ts }: BoucWen) -> Self {
        BoucWenOut { m, c, k, alpha, bg, bd, nu, Ts }
    }
}

#[derive(FromPyObject)]
pub struct BoucWenForceIn {
    k: f64,
    alpha: f64,
    g: f64,
    d: f64,
    nu: f64,
    offset: f64,
}

impl From<BoucWenForceIn> for BoucWenForce {
    fn from(BoucWenForceIn { k, alpha, g, d, nu, offset }: BoucWenForceIn) -> Self {
        BoucWenForce { k, alpha, g, d, nu, offset }
    }
}

/// Fields of `BoucWenForce`.
#[derive(IntoPyObject)]
pub struct BoucWenForceOut {
    k: f64,
    alpha: f64,
    g: f64,
    d: f64,
    nu: f64,
    offset: f64,
}

impl From<BoucWenForce> for BoucWenForceOut {
    fn from(BoucWenForce { k, alpha, g, d, nu, offset }: BoucWenForce) -> Self {
        BoucWenForceOut { k, alpha, g, d, nu, offset }
    }
}

fn oscillator(model: &Bound<'_, PyAny>) -> PyResult<BoucWen> {
    match model.extract()? {
        HysteresisIn(Model::BoucWen(oscillator)) => Ok(oscillator),
        HysteresisIn(_) => Err(not_a_model(&model.as_borrowed())),
    }
}

fn hold_of(hold: &str) -> Outcome<Hold> {
    match hold {
        "spline" => Ok(Hold::Spline),
        "line" => Ok(Hold::Line),
        "zoh" => Ok(Hold::Zero),
        other => Err(Error::argument("hold", format!("{other:?}"), "\"spline\", \"line\" or \"zoh\"").into()),
    }
}

/// Output over a record of forces.
#[pyfunction]
fn bouc_wen_simulate<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    u: PyReadonlyArray1<'py, f64>,
    Ts: f64,
    x0: (f64, f64, f64),
    hold: &str,
    substeps: Option<usize>,
) -> Outcome<Array<'py>> {
    let (model, u, hold) = (oscillator(model)?, u.as_slice().map_err(PyErr::from)?, hold_of(hold)?);
    let y = py.detach(|| simulate_bouc_wen(&model, u, Ts, x0.into(), hold, substeps))?;
    Ok(array(py, y))
}

/// Displacement, speed and force at the first row.
#[pyfunction]
fn bouc_wen_initial_state<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    u: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
    Ts: f64,
) -> Outcome<(f64, f64, f64)> {
    let model = oscillator(model)?;
    let (u, y) = (u.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    Ok(py.detach(|| initial_state(&model, u, y, Ts))?.into())
}

/// Fields of a fitted model, how it was found, its notes, and its first state.
type Fitted = (BoucWenOut, IdentifiedOut, Vec<NoteOut>, (f64, f64, f64));

#[pyfunction]
#[pyo3(signature = (u, y, Ts, nu, at_rest, start_only))]
fn bouc_wen_identify<'py>(
    py: Python<'py>,
    u: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
    Ts: f64,
    nu: Option<f64>,
    at_rest: bool,
    start_only: bool,
) -> Outcome<Fitted> {
    let settings = BoucWenSettings { Ts, nu, at_rest, start_only };
    let (u, y) = (u.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let fit = py.detach(|| identify_bouc_wen(u, y, &settings))?;
    let how = IdentifiedOut::of(y, &fit.errors, fit.sd, Vec::new());
    Ok((fit.model.into(), how, notes(&fit.notes), fit.x0.into()))
}

/// Fields of a fitted force, how it was found, and its notes.
#[pyfunction]
#[pyo3(signature = (x, y, nu))]
fn bouc_wen_force_identify<'py>(
    py: Python<'py>,
    x: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
    nu: Option<f64>,
) -> Outcome<(BoucWenForceOut, IdentifiedOut, Vec<NoteOut>)> {
    let (x, y) = (x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let fit = py.detach(|| identify_force(x, y, nu))?;
    let how = IdentifiedOut::of(y, &fit.errors, fit.sd, Vec::new());
    Ok((fit.model.into(), how, notes(&fit.notes)))
}
