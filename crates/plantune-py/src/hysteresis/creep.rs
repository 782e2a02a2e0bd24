//! Creep: plays that go on, and a charge that leaks.

use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use plantune_core::hysteresis::{ChargeLeak, Creep, CreepSettings, identify_creep};
use pyo3::prelude::*;

use super::identified::IdentifiedOut;
use crate::error::Outcome;
use crate::values::Frozen;

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(creep_identify, m)?)?;
    m.add_function(wrap_pyfunction!(leak_current, m)?)?;
    m.add_function(wrap_pyfunction!(leak_resistance, m)?)
}

#[derive(FromPyObject)]
pub struct CreepIn<'py> {
    r: Vec<f64>,
    w: Vec<f64>,
    tau: Vec<f64>,
    c: PyReadonlyArray2<'py, f64>,
    Ts: f64,
    offset: f64,
}

impl CreepIn<'_> {
    pub fn core(self) -> Outcome<Creep> {
        let c = self.c.as_slice().map_err(PyErr::from)?.to_vec();
        Ok(Creep { r: self.r, w: self.w, tau: self.tau, c, Ts: self.Ts, offset: self.offset })
    }
}

/// Fields of `Creep`, and of its inverse; `c` is flat.
#[derive(IntoPyObject)]
pub struct CreepOut {
    r: Frozen,
    w: Frozen,
    tau: Frozen,
    c: Frozen,
    Ts: f64,
    offset: f64,
}

impl From<Creep> for CreepOut {
    fn from(m: Creep) -> Self {
        CreepOut {
            r: Frozen(m.r),
            w: Frozen(m.w),
            tau: Frozen(m.tau),
            c: Frozen(m.c),
            Ts: m.Ts,
            offset: m.offset,
        }
    }
}

/// Fields of `ChargeLeak`.
#[derive(IntoPyObject)]
pub struct ChargeLeakOut {
    C: f64,
    R: f64,
    a: f64,
    G: f64,
    Ts: f64,
}

impl From<ChargeLeak> for ChargeLeakOut {
    fn from(m: ChargeLeak) -> Self {
        ChargeLeakOut { C: m.C, R: m.R, a: m.a, G: m.G, Ts: m.Ts }
    }
}

#[derive(FromPyObject)]
pub struct ChargeLeakIn {
    C: f64,
    R: f64,
    a: f64,
    G: f64,
    Ts: f64,
}

impl From<ChargeLeakIn> for ChargeLeak {
    fn from(m: ChargeLeakIn) -> Self {
        ChargeLeak { C: m.C, R: m.R, a: m.a, G: m.G, Ts: m.Ts }
    }
}

/// Fields of a fitted model, and how it was found.
#[pyfunction]
#[pyo3(signature = (x, y, Ts, n, r, tau, offset))]
#[allow(clippy::too_many_arguments)] // the settings, by name
fn creep_identify<'py>(
    py: Python<'py>,
    x: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
    Ts: f64,
    n: usize,
    r: Option<Vec<f64>>,
    tau: Option<Vec<f64>>,
    offset: bool,
) -> Outcome<(CreepOut, IdentifiedOut)> {
    let settings = CreepSettings { r, n, tau, Ts, offset };
    let (x, y) = (x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let fit = py.detach(|| identify_creep(x, y, &settings))?;
    let how = IdentifiedOut::of(y, &fit.errors, fit.sd, fit.tried);
    Ok((fit.model.into(), how))
}

/// Current through the leak at a voltage.
#[pyfunction]
fn leak_current(model: ChargeLeakIn, V: f64) -> f64 {
    ChargeLeak::from(model).leak(V)
}

/// Leak resistance at a leak current.
#[pyfunction]
fn leak_resistance(model: ChargeLeakIn, i: f64) -> f64 {
    ChargeLeak::from(model).resistance(i)
}
