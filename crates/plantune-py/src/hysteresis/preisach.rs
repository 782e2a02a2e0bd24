//! The Preisach model: its tables, its identification, and reversal curves.

use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use plantune_core::Error;
use plantune_core::hysteresis::{
    Preisach, PreisachSettings, Start, everett_of_mu, forc, identify_preisach, mu_of_everett,
};
use pyo3::prelude::*;

use super::identified::IdentifiedOut;
use crate::error::Outcome;
use crate::values::{Frozen, Matrix, matrix};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(preisach_everett, m)?)?;
    m.add_function(wrap_pyfunction!(preisach_mu, m)?)?;
    m.add_function(wrap_pyfunction!(preisach_identify, m)?)?;
    m.add_function(wrap_pyfunction!(hysteresis_forc, m)?)
}

#[derive(FromPyObject)]
pub struct PreisachIn<'py> {
    levels: Vec<f64>,
    mu: PyReadonlyArray2<'py, f64>,
    offset: f64,
    start: String,
}

impl PreisachIn<'_> {
    pub fn core(self) -> Outcome<Preisach> {
        let mu = self.mu.as_slice().map_err(PyErr::from)?.to_vec();
        let start = start_of(&self.start)?;
        Ok(Preisach { levels: self.levels, mu, offset: self.offset, start })
    }
}

fn start_of(name: &str) -> Outcome<Start> {
    match name {
        "virgin" => Ok(Start::Virgin),
        "negative" => Ok(Start::Negative),
        other => Err(Error::argument("start", format!("{other:?}"), "\"virgin\" or \"negative\"").into()),
    }
}

/// Fields of `Preisach`, and of its inverse; `mu` is flat.
#[derive(IntoPyObject)]
pub struct PreisachOut {
    levels: Frozen,
    mu: Frozen,
    offset: f64,
    start: &'static str,
}

impl From<Preisach> for PreisachOut {
    fn from(m: Preisach) -> Self {
        let start = if m.start == Start::Virgin { "virgin" } else { "negative" };
        PreisachOut { levels: Frozen(m.levels), mu: Frozen(m.mu), offset: m.offset, start }
    }
}

/// Side of a square table.
fn side(table: &PyReadonlyArray2<'_, f64>, name: &str) -> Outcome<usize> {
    let shape = table.as_array().dim();
    if shape.0 != shape.1 || shape.0 == 0 {
        return Err(Error::argument(name, format!("of shape {shape:?}"), "square").into());
    }
    Ok(shape.0)
}

/// Everett table of weights.
#[pyfunction]
fn preisach_everett<'py>(py: Python<'py>, mu: PyReadonlyArray2<'py, f64>) -> Outcome<Matrix<'py>> {
    let n = side(&mu, "mu")?;
    Ok(matrix(py, everett_of_mu(n, mu.as_slice().map_err(PyErr::from)?), n + 1)?)
}

/// Weights of an Everett table.
#[pyfunction]
fn preisach_mu<'py>(py: Python<'py>, everett: PyReadonlyArray2<'py, f64>) -> Outcome<Matrix<'py>> {
    let n = side(&everett, "everett")? - 1;
    if n == 0 {
        return Err(Error::argument("everett", "of shape (1, 1)", "of two levels or more").into());
    }
    Ok(matrix(py, mu_of_everett(n, everett.as_slice().map_err(PyErr::from)?), n)?)
}

/// Fields of a fitted model, and how it was found.
#[pyfunction]
#[pyo3(signature = (x, y, levels, counts, ridge, smooth, start, offset))]
#[allow(clippy::too_many_arguments)] // the settings, by name
fn preisach_identify<'py>(
    py: Python<'py>,
    x: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
    levels: Option<Vec<f64>>,
    counts: Vec<usize>,
    ridge: f64,
    smooth: f64,
    start: &str,
    offset: bool,
) -> Outcome<(PreisachOut, IdentifiedOut)> {
    let settings = PreisachSettings { levels, counts, ridge, smooth, start: start_of(start)?, offset };
    let (x, y) = (x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let fit = py.detach(|| identify_preisach(x, y, &settings))?;
    let how = IdentifiedOut::of(y, &fit.errors, fit.sd, fit.tried);
    Ok((fit.model.into(), how))
}

/// Fields of `Forc`, tables flat.
#[derive(IntoPyObject)]
struct ForcOut {
    levels: Frozen,
    everett: Frozen,
    mu: Frozen,
    offset: f64,
    rising: bool,
    curves: Vec<(usize, usize)>,
}

/// Reversal curves of a record.
#[pyfunction]
fn hysteresis_forc(x: PyReadonlyArray1<'_, f64>, y: PyReadonlyArray1<'_, f64>) -> Outcome<ForcOut> {
    let f = forc(x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?)?;
    Ok(ForcOut {
        levels: Frozen(f.levels),
        everett: Frozen(f.everett),
        mu: Frozen(f.mu),
        offset: f.offset,
        rising: f.rising,
        curves: f.curves,
    })
}
