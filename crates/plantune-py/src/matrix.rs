//! Models of several outputs.

use numpy::{Complex64, PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::batch::{self, MatrixFit};
use plantune_core::linalg::Matrix as Dense;
use plantune_core::model::{MatrixPoly, Several, StateSpace, entries};
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

/// A model of several outputs of `plantune.models`, by attribute.
pub struct SeveralIn(pub Several);

#[derive(FromPyObject)]
struct MatrixPolyIn {
    A: Vec<Vec<f64>>,
    B: Vec<Vec<f64>>,
    nk: Vec<usize>,
    ny: usize,
    Ts: f64,
}

/// `plantune.models.StateSpace`.
#[derive(FromPyObject)]
pub struct StateSpaceIn<'py> {
    A: PyReadonlyArray2<'py, f64>,
    B: PyReadonlyArray2<'py, f64>,
    C: PyReadonlyArray2<'py, f64>,
    D: PyReadonlyArray2<'py, f64>,
    K: PyReadonlyArray2<'py, f64>,
    Ts: Option<f64>,
}

impl From<StateSpaceIn<'_>> for StateSpace {
    fn from(StateSpaceIn { A, B, C, D, K, Ts }: StateSpaceIn<'_>) -> Self {
        let dense = |M: PyReadonlyArray2<'_, f64>| {
            let M = M.as_array();
            Dense::from_fn(M.nrows(), M.ncols(), |i, j| M[[i, j]])
        };
        StateSpace { A: dense(A), B: dense(B), C: dense(C), D: dense(D), K: dense(K), Ts }
    }
}

impl<'py> FromPyObject<'_, 'py> for SeveralIn {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let kind: String = value.getattr("kind")?.extract()?;
        Ok(SeveralIn(if kind == "state_space" {
            StateSpace::from(value.extract::<StateSpaceIn>()?).into()
        } else {
            let MatrixPolyIn { A, B, nk, ny, Ts } = value.getattr("core")?.extract()?;
            MatrixPoly { A, B, nk, ny, Ts }.into()
        }))
    }
}

/// The dict from which Python builds a `StateSpace`; matrices row-major.
#[derive(IntoPyObject)]
pub struct StateSpaceOut {
    A: Frozen,
    B: Frozen,
    C: Frozen,
    D: Frozen,
    K: Frozen,
    n: usize,
    ny: usize,
    nu: usize,
    Ts: Option<f64>,
}

impl From<StateSpace> for StateSpaceOut {
    fn from(model: StateSpace) -> Self {
        let (n, ny, nu) = (model.n(), model.ny(), model.nu());
        let StateSpace { A, B, C, D, K, Ts } = model;
        let flat = |M: Dense| Frozen(entries(&M).collect());
        StateSpaceOut { A: flat(A), B: flat(B), C: flat(C), D: flat(D), K: flat(K), n, ny, nu, Ts }
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
    model: SeveralIn,
    u: PyReadonlyArray2<'py, f64>,
    Ts: Option<f64>,
) -> Outcome<Matrix<'py>> {
    let model = match Ts {
        Some(Ts) => model.0.at_sample_time(Ts)?,
        None => model.0,
    };
    model.check_inputs(u.shape()[1])?;
    let u = u.as_slice().map_err(PyErr::from)?;
    let y = py.detach(|| model.simulate(u));
    Ok(matrix(py, y, model.ny())?)
}

/// Rows, and output there `(rows, ny)`.
#[pyfunction]
fn matrix_over_record<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: SeveralIn,
    horizon: Option<usize>,
    offset: Vec<f64>,
    limits: LimitsIn,
) -> Outcome<(Vec<usize>, Vec<Array<'py>>)> {
    let limits: Limits = limits.into();
    let (record, model) = (rec.view(&limits)?, model.0);
    let run = || sim::matrix_over_record(&model, &record, horizon, sim::Start::Estimate, Some(&offset));
    let runs = py.detach(run)?;
    let rows = runs.first().map_or_else(Vec::new, |run| run.rows.clone());
    Ok((rows, runs.into_iter().map(|run| array(py, run.yhat)).collect()))
}

#[pyfunction]
fn matrix_check<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: SeveralIn,
    output: usize,
    options: (String, Option<Vec<f64>>, usize),
    limits: LimitsIn,
) -> Outcome<VerdictOut<'py>> {
    let limits: Limits = limits.into();
    let (record, model) = (rec.view(&limits)?, model.0);
    let (x0, offset, lags) = &options;
    let options = (start(x0)?, offset.as_deref(), *lags);
    checked(py, py.detach(|| validate::check_output(&model, &record, output, options, &limits)))
}

/// `(w, ny nu)`, row-major.
#[pyfunction]
fn matrix_freqresp(py: Python<'_>, model: SeveralIn, w: Vec<f64>) -> Bound<'_, PyArray1<Complex64>> {
    let model = model.0;
    PyArray1::from_iter(py, w.into_iter().flat_map(|w| model.freqresp(w)))
}

#[pyfunction]
fn matrix_poles(py: Python<'_>, model: SeveralIn) -> Bound<'_, PyArray1<Complex64>> {
    let poles = model.0.poles();
    PyArray1::from_iter(py, poles.into_iter().map(|(re, im)| Complex64::new(re, im)))
}

#[pyfunction]
fn matrix_dc_gain(py: Python<'_>, model: SeveralIn) -> PyResult<Matrix<'_>> {
    let model = model.0;
    matrix(py, model.dc_gain(), model.nu())
}

/// Any model of several outputs by states.
#[pyfunction]
fn matrix_state_space(model: SeveralIn) -> StateSpaceOut {
    model.0.state_space().into()
}
