//! Models of several outputs.

use numpy::{Complex64, PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::batch::{self, MatrixFit};
use plantune_core::model::MatrixPoly;
use plantune_core::{Limits, sim, validate};
use pyo3::prelude::*;

use crate::batch::{FitOut, matrix_fit_out};
use crate::error::Outcome;
use crate::sim::start;
use crate::validate::{VerdictOut, checked};
use crate::values::{Array, Frozen, LimitsIn, Matrix, RecordIn, array, matrix};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(matrix_arx, m)?)?;
    m.add_function(wrap_pyfunction!(matrix_simulate, m)?)?;
    m.add_function(wrap_pyfunction!(matrix_over_record, m)?)?;
    m.add_function(wrap_pyfunction!(matrix_check, m)?)?;
    m.add_function(wrap_pyfunction!(matrix_freqresp, m)?)?;
    m.add_function(wrap_pyfunction!(matrix_poles, m)?)?;
    m.add_function(wrap_pyfunction!(matrix_dc_gain, m)?)?;
    m.add_function(wrap_pyfunction!(matrix_state_space, m)?)
}

/// A `plantune.models.MatrixPolyModel`, by attribute; each matrix row-major.
#[derive(FromPyObject)]
struct MatrixPolyIn {
    A: Vec<Vec<f64>>,
    B: Vec<Vec<f64>>,
    nk: Vec<usize>,
    ny: usize,
    Ts: f64,
}

/// The same by its attribute `core`.
#[derive(FromPyObject)]
struct MatrixModelIn {
    core: MatrixPolyIn,
}

impl From<MatrixModelIn> for MatrixPoly {
    fn from(MatrixModelIn { core: MatrixPolyIn { A, B, nk, ny, Ts } }: MatrixModelIn) -> Self {
        MatrixPoly { A, B, nk, ny, Ts }
    }
}

/// The dict from which Python builds the model.
#[derive(IntoPyObject)]
pub struct MatrixPolyOut {
    A: Frozen,
    B: Frozen,
    nk: Vec<usize>,
    ny: usize,
    Ts: f64,
}

impl From<MatrixPoly> for MatrixPolyOut {
    fn from(MatrixPoly { A, B, nk, ny, Ts }: MatrixPoly) -> Self {
        MatrixPolyOut { A: Frozen(A.concat()), B: Frozen(B.concat()), nk, ny, Ts }
    }
}

#[pyfunction]
fn matrix_arx<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    na: usize,
    nb: usize,
    nk: Vec<usize>,
    offset: bool,
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let fit: MatrixFit = py.detach(|| batch::matrix_arx(&record, na, nb, &nk, offset, &limits))?;
    Ok(matrix_fit_out(py, fit, record.row_ranges())?)
}

#[pyfunction]
fn matrix_simulate<'py>(
    py: Python<'py>,
    model: MatrixModelIn,
    u: PyReadonlyArray2<'py, f64>,
) -> Outcome<Matrix<'py>> {
    let model = MatrixPoly::from(model);
    model.check_inputs(u.shape()[1])?;
    let u = u.as_slice().map_err(PyErr::from)?;
    let y = py.detach(|| model.simulate(u));
    Ok(matrix(py, y, model.ny)?)
}

/// Rows, and output there `(rows, ny)`.
#[pyfunction]
fn matrix_over_record<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: MatrixModelIn,
    horizon: Option<usize>,
    offset: Vec<f64>,
    limits: LimitsIn,
) -> Outcome<(Vec<usize>, Vec<Array<'py>>)> {
    let limits: Limits = limits.into();
    let (record, model) = (rec.view(&limits)?, MatrixPoly::from(model));
    let run = || sim::matrix_over_record(&model, &record, horizon, sim::Start::Estimate, Some(&offset));
    let runs = py.detach(run)?;
    let rows = runs.first().map_or_else(Vec::new, |run| run.rows.clone());
    Ok((rows, runs.into_iter().map(|run| array(py, run.yhat)).collect()))
}

#[pyfunction]
fn matrix_check<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: MatrixModelIn,
    output: usize,
    options: (String, Option<Vec<f64>>, usize),
    limits: LimitsIn,
) -> Outcome<VerdictOut<'py>> {
    let limits: Limits = limits.into();
    let (record, model) = (rec.view(&limits)?, MatrixPoly::from(model));
    let (x0, offset, lags) = &options;
    let options = (start(x0)?, offset.as_deref(), *lags);
    checked(py, py.detach(|| validate::check_output(&model, &record, output, options, &limits)))
}

/// `(w, ny nu)`, row-major.
#[pyfunction]
fn matrix_freqresp(py: Python<'_>, model: MatrixModelIn, w: Vec<f64>) -> Bound<'_, PyArray1<Complex64>> {
    let model = MatrixPoly::from(model);
    PyArray1::from_iter(py, w.into_iter().flat_map(|w| model.freqresp(w)))
}

#[pyfunction]
fn matrix_poles(py: Python<'_>, model: MatrixModelIn) -> Bound<'_, PyArray1<Complex64>> {
    let poles = MatrixPoly::from(model).poles();
    PyArray1::from_iter(py, poles.into_iter().map(|(re, im)| Complex64::new(re, im)))
}

#[pyfunction]
fn matrix_dc_gain(py: Python<'_>, model: MatrixModelIn) -> PyResult<Matrix<'_>> {
    let model = MatrixPoly::from(model);
    matrix(py, model.dc_gain(), model.nu())
}

/// `F G H D` of `x(t+1) = F x + G u`, `y = H x + D u`.
#[pyfunction]
fn matrix_state_space(
    py: Python<'_>,
    model: MatrixModelIn,
) -> PyResult<(Matrix<'_>, Matrix<'_>, Matrix<'_>, Matrix<'_>)> {
    let model = MatrixPoly::from(model);
    let (ss, nu) = (model.state_space(), model.nu());
    Ok((matrix(py, ss.F, ss.n)?, matrix(py, ss.G, nu)?, matrix(py, ss.H, ss.n)?, matrix(py, ss.D, nu)?))
}
