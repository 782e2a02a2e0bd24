//! Frequency responses across the border.

use numpy::{Complex64, PyArray1, PyReadonlyArray1, PyReadonlyArray3, PyUntypedArrayMethods};
use plantune_core::batch::{self, Code, Structure};
use plantune_core::model::{self, FrequencyResponse};
use plantune_core::validate;
use pyo3::prelude::*;

use crate::batch::{FitOut, fit_out};
use crate::error::Outcome;
use crate::model::ModelIn;
use crate::note::{NoteOut, notes};
use crate::values::{Array, Matrix, array, matrix};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(check_frequency_response, m)?)?;
    m.add_function(wrap_pyfunction!(disc_factor, m)?)?;
    m.add_function(wrap_pyfunction!(frequency_bode, m)?)?;
    m.add_function(wrap_pyfunction!(frequency_seen, m)?)?;
    m.add_function(wrap_pyfunction!(frequency_fit, m)?)?;
    m.add_function(wrap_pyfunction!(frequency_verdict, m)?)
}

/// A `plantune.models.FrequencyResponse`, by attribute.
#[derive(FromPyObject)]
pub struct FrequencyIn<'py> {
    w: PyReadonlyArray1<'py, f64>,
    G: PyReadonlyArray3<'py, Complex64>,
    radius: Option<PyReadonlyArray3<'py, f64>>,
    Ts: Option<f64>,
    share: f64,
}

impl FrequencyIn<'_> {
    /// The core's value, checked.
    pub fn value(&self) -> Outcome<FrequencyResponse> {
        let radius = self.radius.as_ref().map(|r| r.as_slice().map(<[f64]>::to_vec));
        let value = FrequencyResponse {
            w: self.w.as_slice().map_err(PyErr::from)?.to_vec(),
            G: self.G.as_slice().map_err(PyErr::from)?.to_vec(),
            radius: radius.transpose().map_err(PyErr::from)?,
            ny: self.G.shape()[1],
            nu: self.G.shape()[2],
            Ts: self.Ts,
        };
        Ok(value.checked()?)
    }
}

/// Refuses what is no frequency response.
#[pyfunction]
fn check_frequency_response(response: FrequencyIn<'_>) -> Outcome<()> {
    response.value().map(|_| ())
}

/// Radius of the 95 % disc in standard deviations.
#[pyfunction]
fn disc_factor() -> f64 {
    model::disc()
}

/// Magnitude with low and high, phase in degrees with low and high.
#[pyfunction]
fn frequency_bode<'py>(
    py: Python<'py>,
    response: FrequencyIn<'_>,
    output: usize,
    input: usize,
    keep: Vec<bool>,
) -> Outcome<(Vec<Array<'py>>, Vec<Array<'py>>)> {
    let bode = response.value()?.bode(output, input, &keep);
    let arrays = |of: [Vec<f64>; 3]| of.into_iter().map(|x| array(py, x)).collect();
    Ok((arrays(bode.magnitude), arrays(bode.phase)))
}

/// What data with this sample time show of a model.
#[pyfunction]
fn frequency_seen<'py>(
    py: Python<'py>,
    model: ModelIn,
    input: usize,
    Ts: Option<f64>,
    w: PyReadonlyArray1<'_, f64>,
) -> Outcome<Bound<'py, PyArray1<Complex64>>> {
    model.0.check()?;
    let w = w.as_slice().map_err(PyErr::from)?;
    Ok(PyArray1::from_vec(py, model::seen(&model.0, input, Ts, w)))
}

/// A process model by its code, or a ratio of polynomials by `nb, nf, nk, delay`.
#[derive(FromPyObject)]
pub enum StructureIn {
    Process(String),
    Rational(usize, usize, usize, bool),
}

/// Fits a structure to output over input.
#[pyfunction]
fn frequency_fit<'py>(
    py: Python<'py>,
    response: FrequencyIn<'_>,
    output: usize,
    input: usize,
    structure: StructureIn,
) -> Outcome<FitOut<'py>> {
    let structure = match structure {
        StructureIn::Process(code) => Structure::Process(Code::read(&code)?),
        StructureIn::Rational(nb, nf, nk, delay) => Structure::Rational { nb, nf, nk, delay },
    };
    let (data, share) = (response.value()?, response.share);
    let fit = py.detach(|| batch::frequency(&data, output, input, structure, share))?;
    Ok(fit_out(py, fit, Vec::new())?)
}

/// The dict behind `plantune.validate.FrequencyVerdict`.
#[derive(IntoPyObject)]
struct FrequencyVerdictOut<'py> {
    distance: Matrix<'py>,
    inside: usize,
    part: f64,
    limit: f64,
    worst: (f64, usize, f64),
    passed: bool,
    notes: Vec<NoteOut>,
}

/// How far a model lies from the points.
#[pyfunction]
fn frequency_verdict<'py>(
    py: Python<'py>,
    response: FrequencyIn<'_>,
    model: ModelIn,
) -> Outcome<FrequencyVerdictOut<'py>> {
    let data = response.value()?;
    let found = validate::frequency(&data, &model.0, response.share)?;
    Ok(FrequencyVerdictOut {
        distance: matrix(py, found.distance, data.nu)?,
        inside: found.inside,
        part: found.part,
        limit: found.limit,
        worst: found.worst,
        passed: found.passed,
        notes: notes(&found.notes),
    })
}
