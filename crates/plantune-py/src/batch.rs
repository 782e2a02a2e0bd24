//! Batch estimators.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::batch::{
    self, Code, Fit, MatrixFit, OffsetOf, Orders, PemOptions, ProcessOptions, SrivcOptions, SubspaceFit,
    criteria, standard_deviations,
};
use plantune_core::model::Model;
use plantune_core::sim::Start;
use plantune_core::{Error, Limits, Record};
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
    m.add_function(wrap_pyfunction!(order_choice, m)?)?;
    m.add_function(wrap_pyfunction!(process, m)?)?;
    m.add_function(wrap_pyfunction!(srivc, m)?)?;
    m.add_function(wrap_pyfunction!(iv4, m)?)?;
    m.add_function(wrap_pyfunction!(normal_interval, m)?)?;
    m.add_function(wrap_pyfunction!(stretched, m)?)?;
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
    steps: Vec<(usize, f64, f64)>,
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
    intervals: Vec<(String, f64, f64)>,
    plants: Vec<ModelOut>,
    sampled: Option<ModelOut>,
    singular_values: Option<Array<'py>>,
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
        steps: fit.steps.iter().map(|s| (s.row, s.size, s.sd)).collect(),
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
        intervals: fit.intervals,
        plants: fit.plants.into_iter().map(|plant| Model::Process(plant).into()).collect(),
        sampled: fit.sampled.map(|model| Model::Poly(model).into()),
        singular_values: None,
    })
}

/// The same of several outputs.
pub fn matrix_fit_out<'py>(py: Python<'py>, fit: MatrixFit, rows: Vec<[i64; 2]>) -> PyResult<FitOut<'py>> {
    let n = fit.theta.len();
    let (fpe, aic, bic) = criteria(fit.V, fit.N, n);
    Ok(FitOut {
        sd: array(py, standard_deviations(&fit.P, n)),
        theta: array(py, fit.theta),
        P: square(py, fit.P)?,
        names: fit.names,
        offset: array(py, fit.offset),
        steps: Vec::new(),
        x0: PyArray1::from_vec(py, Vec::new()).reshape([fit.segments, 0])?,
        N: fit.N,
        loss: fit.loss,
        fpe,
        aic,
        bic,
        status: "exact",
        expected_digits: array(py, fit.expected_digits),
        notes: notes(&fit.notes),
        model: Some(ModelOut::Matrix(fit.model.into())),
        rows: matrix(py, rows.concat(), 2)?,
        intervals: Vec::new(),
        plants: Vec::new(),
        sampled: None,
        singular_values: None,
    })
}

/// The same of a model by states, which has no parameters of its own.
pub fn states_fit_out<'py>(py: Python<'py>, fit: SubspaceFit, rows: Vec<[i64; 2]>) -> PyResult<FitOut<'py>> {
    let (fpe, aic, bic) = criteria(fit.V, fit.N, fit.parameters);
    let segments = fit.x0.len();
    Ok(FitOut {
        theta: array(py, Vec::new()),
        P: matrix(py, Vec::new(), 0)?,
        sd: array(py, Vec::new()),
        names: Vec::new(),
        offset: array(py, fit.offset),
        x0: PyArray1::from_vec(py, fit.x0.concat()).reshape([segments, fit.model.n()])?,
        N: fit.N,
        loss: fit.loss,
        fpe,
        aic,
        bic,
        status: fit.status.as_str(),
        expected_digits: array(py, Vec::new()),
        notes: notes(&fit.notes),
        model: Some(ModelOut::States(fit.model.into())),
        rows: matrix(py, rows.concat(), 2)?,
        intervals: Vec::new(),
        plants: Vec::new(),
        sampled: None,
        steps: Vec::new(),
        singular_values: Some(array(py, fit.singular_values)),
    })
}

fn square(py: Python<'_>, P: Vec<f64>) -> PyResult<Matrix<'_>> {
    let width = P.len().isqrt();
    matrix(py, P, width)
}

/// Runs an estimator without the interpreter lock.
pub fn run<'py>(
    py: Python<'py>,
    rec: &RecordIn<'_>,
    limits: LimitsIn,
    estimate: impl Fn(&Record, &Limits) -> plantune_core::Result<Fit> + Send + Sync,
) -> Outcome<FitOut<'py>> {
    let limits: Limits = limits.into();
    run_on(py, &rec.view(&limits)?, &limits, estimate)
}

/// The same on a record whose stamps may lie anywhere.
fn run_on<'py>(
    py: Python<'py>,
    record: &Record,
    limits: &Limits,
    estimate: impl Fn(&Record, &Limits) -> plantune_core::Result<Fit> + Send + Sync,
) -> Outcome<FitOut<'py>> {
    let fit = py.detach(|| estimate(record, limits))?;
    Ok(fit_out(py, fit, record.row_ranges())?)
}

/// Orders of the polynomial family, by attribute.
#[derive(FromPyObject)]
pub struct OrdersIn {
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
    robust: bool,
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let orders = Orders::from(orders);
    run(py, &rec, limits, |record, limits| {
        let estimate = |record: &Record| batch::arx(record, &orders, offset, limits);
        if robust { batch::robust(record, offset, Start::Estimate, estimate) } else { estimate(record) }
    })
}

#[pyfunction]
fn pem<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    orders: OrdersIn,
    offset: bool,
    x0: &str,
    robust: bool,
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let orders = Orders::from(orders);
    let options = PemOptions { offset, start: start(x0)? };
    run(py, &rec, limits, |record, limits| {
        let estimate = |record: &Record| batch::pem(record, &orders, options, limits);
        if robust { batch::robust(record, offset, options.start, estimate) } else { estimate(record) }
    })
}

/// The dict behind `plantune.estimate.OrderTable(**d)`.
#[derive(IntoPyObject)]
struct OrderChoiceOut {
    rows: Vec<TriedOut>,
    best: usize,
    runner_up: Option<usize>,
    N: usize,
    notes: Vec<NoteOut>,
}

/// The dict behind `plantune.estimate.OrderRow(**d)`.
#[derive(IntoPyObject)]
struct TriedOut {
    na: usize,
    nb: Vec<usize>,
    nc: usize,
    nd: usize,
    nf: Vec<usize>,
    nk: Vec<usize>,
    d: usize,
    loss: f64,
    fpe: f64,
    aic: f64,
    bic: f64,
    fresh: Option<f64>,
    converged: bool,
}

impl From<batch::TriedOrders> for TriedOut {
    fn from(t: batch::TriedOrders) -> Self {
        let Orders { na, nb, nc, nd, nf, nk } = t.orders;
        let batch::TriedOrders { d, loss, fpe, aic, bic, fresh, converged, .. } = t;
        TriedOut { na, nb, nc, nd, nf, nk, d, loss, fpe, aic, bic, fresh, converged }
    }
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
fn order_choice(
    py: Python<'_>,
    rec: RecordIn<'_>,
    candidates: Vec<OrdersIn>,
    fresh: Option<RecordIn<'_>>,
    offset: bool,
    limits: LimitsIn,
) -> Outcome<OrderChoiceOut> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let fresh = fresh.as_ref().map(|fresh| fresh.view(&limits)).transpose()?;
    let candidates: Vec<Orders> = candidates.into_iter().map(Orders::from).collect();
    let found = py.detach(|| batch::choose_orders(&record, &candidates, fresh.as_ref(), offset, &limits))?;
    Ok(OrderChoiceOut {
        best: found.best,
        runner_up: found.runner_up,
        N: found.N,
        notes: notes(&found.notes),
        rows: found.rows.into_iter().map(TriedOut::from).collect(),
    })
}

/// Orders of a noise model, or a word for them.
#[derive(FromPyObject)]
enum NoiseIn {
    Orders((usize, usize)),
    Named(String),
}

impl NoiseIn {
    fn orders(&self, codes: &[Code]) -> plantune_core::Result<(usize, usize)> {
        match self {
            NoiseIn::Orders(orders) => Ok(*orders),
            NoiseIn::Named(name) if name == "white" => Ok((0, 0)),
            NoiseIn::Named(name) if name == "arma" => Ok(Code::arma(codes)),
            NoiseIn::Named(name) => {
                Err(Error::argument("noise", format!("{name:?}"), "\"white\", \"arma\" or a pair (nc, nd)"))
            }
        }
    }
}

#[pyfunction]
#[allow(clippy::too_many_arguments)]
fn process<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    codes: Vec<String>,
    noise: NoiseIn,
    offset: OffsetIn,
    L: Option<(f64, f64)>,
    robust: bool,
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let codes = codes.iter().map(|code| Code::read(code)).collect::<plantune_core::Result<Vec<Code>>>()?;
    let noise = noise.orders(&codes)?;
    let (offset, offset_of) = offset.read()?;
    let options = ProcessOptions { offset, offset_of, L, noise };
    let estimate = if robust { batch::robust_process } else { batch::process };
    let limits: Limits = limits.into();
    let record = rec.view_of_any_stamps(&limits)?;
    run_on(py, &record, &limits, |record, limits| estimate(record, &codes, &options, limits))
}

/// `True`, `False`, or for which rows the offset is the same.
#[derive(FromPyObject)]
enum OffsetIn {
    Whether(bool),
    Of(String),
}

impl OffsetIn {
    fn read(&self) -> plantune_core::Result<(bool, OffsetOf)> {
        match self {
            OffsetIn::Whether(offset) => Ok((*offset, OffsetOf::All)),
            OffsetIn::Of(of) => match of.as_str() {
                "steps" => Ok((true, OffsetOf::Steps)),
                "each" => Ok((true, OffsetOf::Segments)),
                _ => Err(Error::argument("offset", format!("{of:?}"), "True, False, \"steps\" or \"each\"")),
            },
        }
    }
}

#[pyfunction]
fn srivc<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    orders: (usize, usize),
    offset: bool,
    L: Option<(f64, f64)>,
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let options = SrivcOptions { n: orders.0, nb: orders.1, offset, L };
    run(py, &rec, limits, |record, limits| batch::srivc(record, &options, limits))
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
        steps: Vec::new(),
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
        intervals: Vec::new(),
        plants: Vec::new(),
        sampled: None,
        singular_values: None,
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

/// The 95 % interval of a normal law.
#[pyfunction]
fn normal_interval(x: f64, sd: f64) -> (f64, f64) {
    batch::normal_interval(x, sd)
}

/// An interval around `x` with both ends `factor` times as far.
#[pyfunction]
fn stretched(interval: (f64, f64), x: f64, factor: f64) -> (f64, f64) {
    batch::stretched(interval, x, factor)
}
