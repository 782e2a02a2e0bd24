//! Batch estimators.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::batch::{self, Fit, Orders, PemOptions, ProcessOptions, criteria, standard_deviations};
use plantune_core::{Limits, Record};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::model::ModelOut;
use crate::note::{NoteOut, notes};
use crate::sim::start;
use crate::values::{Array, LimitsIn, Matrix, RecordIn, array, matrix};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(least_squares, m)?)?;
    m.add_function(wrap_pyfunction!(arx, m)?)?;
    m.add_function(wrap_pyfunction!(pem, m)?)?;
    m.add_function(wrap_pyfunction!(iv4, m)?)?;
    m.add_function(wrap_pyfunction!(p1d, m)?)?;
    m.add_function(wrap_pyfunction!(widened, m)?)
}

/// The dict behind `plantune.Fit(**d)`.
#[derive(IntoPyObject)]
pub struct FitOut<'py> {
    model: Option<ModelOut>,
    theta: Array<'py>,
    P: Matrix<'py>,
    sd: Array<'py>,
    names: Vec<String>,
    offset: Array<'py>,
    x0: Matrix<'py>,
    N: usize,
    loss: f64,
    fpe: f64,
    aic: f64,
    bic: f64,
    status: &'static str,
    expected_digits: Array<'py>,
    notes: Vec<NoteOut>,
    rows: Matrix<'py, i64>,
}

pub fn fit_out<'py>(py: Python<'py>, fit: Fit, rows: Vec<[i64; 2]>) -> PyResult<FitOut<'py>> {
    let (fpe, aic, bic) = criteria(fit.loss, fit.N, fit.theta.len());
    let segments = fit.x0.len();
    Ok(FitOut {
        sd: array(py, standard_deviations(&fit.P, fit.theta.len())),
        theta: array(py, fit.theta),
        P: square(py, fit.P)?,
        names: fit.names,
        offset: array(py, vec![fit.offset]),
        x0: PyArray1::from_vec(py, fit.x0.concat())
            .reshape([segments, fit.x0.first().map_or(0, Vec::len)])?,
        N: fit.N,
        loss: fit.loss,
        fpe,
        aic,
        bic,
        status: fit.status.as_str(),
        expected_digits: array(py, fit.expected_digits),
        notes: notes(&fit.notes),
        model: Some(fit.model.into()),
        rows: matrix(py, rows.concat(), 2)?,
    })
}

fn square(py: Python<'_>, P: Vec<f64>) -> PyResult<Matrix<'_>> {
    let width = P.len().isqrt();
    matrix(py, P, width)
}

/// Runs an estimator without the interpreter lock.
fn run<'py>(
    py: Python<'py>,
    rec: &RecordIn<'_>,
    limits: LimitsIn,
    estimate: impl Fn(&Record, &Limits) -> plantune_core::Result<Fit> + Send + Sync,
) -> Outcome<FitOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let fit = py.detach(|| estimate(&record, &limits))?;
    Ok(fit_out(py, fit, record.row_ranges())?)
}

/// Orders of the polynomial family, by attribute.
#[derive(FromPyObject)]
struct OrdersIn {
    na: usize,
    nb: Vec<usize>,
    nc: usize,
    nd: usize,
    nf: Vec<usize>,
    nk: Vec<usize>,
}

impl From<OrdersIn> for Orders {
    fn from(OrdersIn { na, nb, nc, nd, nf, nk }: OrdersIn) -> Self {
        Orders { na, nb, nc, nd, nf, nk }
    }
}

#[pyfunction]
fn arx<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    orders: OrdersIn,
    offset: bool,
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let orders = Orders::from(orders);
    run(py, &rec, limits, |record, limits| batch::arx(record, &orders, offset, limits))
}

#[pyfunction]
fn pem<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    orders: OrdersIn,
    offset: bool,
    x0: &str,
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let orders = Orders::from(orders);
    let options = PemOptions { offset, start: start(x0)? };
    run(py, &rec, limits, |record, limits| batch::pem(record, &orders, options, limits))
}

#[pyfunction]
fn iv4<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    orders: OrdersIn,
    offset: bool,
    rounds: usize,
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let orders = Orders::from(orders);
    run(py, &rec, limits, |record, limits| batch::iv4(record, &orders, offset, rounds, limits))
}

#[pyfunction]
fn p1d<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    offset: bool,
    L: Option<(f64, f64)>,
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let options = ProcessOptions { offset, L };
    run(py, &rec, limits, |record, limits| batch::p1d(record, &options, limits))
}

#[pyfunction]
fn least_squares<'py>(
    py: Python<'py>,
    phi: PyReadonlyArray2<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
) -> Outcome<FitOut<'py>> {
    let n = phi.shape()[1];
    let (phi, y) = (phi.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let fit = py.detach(|| batch::least_squares(phi, n, y))?;
    let (fpe, aic, bic) = criteria(fit.loss, fit.N, n);
    Ok(FitOut {
        model: None,
        theta: array(py, fit.theta),
        sd: array(py, standard_deviations(&fit.P, n)),
        P: square(py, fit.P)?,
        names: (1..=n).map(|j| format!("theta{j}")).collect(),
        offset: array(py, Vec::new()),
        x0: matrix(py, Vec::new(), 0)?,
        N: fit.N,
        loss: fit.loss,
        fpe,
        aic,
        bic,
        status: "exact",
        expected_digits: array(py, fit.expected_digits),
        notes: Vec::new(),
        rows: matrix(py, Vec::new(), 2)?,
    })
}

/// Covariance and standard deviations of the first `n` parameters, `factor` times as wide.
#[pyfunction]
fn widened<'py>(
    py: Python<'py>,
    P: PyReadonlyArray1<'py, f64>,
    n: usize,
    factor: f64,
) -> Outcome<(Array<'py>, Array<'py>)> {
    let P = batch::widened(P.as_slice().map_err(PyErr::from)?, factor);
    let sd = standard_deviations(&P, n);
    Ok((array(py, P), array(py, sd)))
}
