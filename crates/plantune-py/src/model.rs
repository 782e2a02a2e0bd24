//! Models: values in and out, and what a model is asked.

use numpy::{Complex64, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::Error;
use plantune_core::model::{
    self, Filter, Fopdt, Model, Pid, PolyModel, ProcessModel, StateSpace, TransferFunction,
};
use pyo3::prelude::*;

use crate::error::{Outcome, Raise};
use crate::matrix::{MatrixPolyOut, StateSpaceIn, StateSpaceOut};
use crate::values::{Array, Frozen, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(simulate, m)?)?;
    m.add_function(wrap_pyfunction!(freqresp, m)?)?;
    m.add_function(wrap_pyfunction!(step_response, m)?)?;
    m.add_function(wrap_pyfunction!(poles, m)?)?;
    m.add_function(wrap_pyfunction!(zeros, m)?)?;
    m.add_function(wrap_pyfunction!(pulse_transfer, m)?)?;
    m.add_function(wrap_pyfunction!(dc_gain, m)?)?;
    m.add_function(wrap_pyfunction!(resonance, m)?)?;
    m.add_function(wrap_pyfunction!(gains, m)?)?;
    m.add_function(wrap_pyfunction!(horizon, m)?)?;
    m.add_function(wrap_pyfunction!(pid_transfer, m)?)?;
    m.add_function(wrap_pyfunction!(c2d, m)?)?;
    m.add_function(wrap_pyfunction!(transfer, m)?)?;
    m.add_function(wrap_pyfunction!(d2c, m)?)
}

/// Any model value of `plantune.models`, by attribute.
pub struct ModelIn(pub Model);

#[derive(FromPyObject)]
struct PolyIn {
    A: Vec<f64>,
    B: Vec<Vec<f64>>,
    C: Vec<f64>,
    D: Vec<f64>,
    F: Vec<Vec<f64>>,
    nk: Vec<usize>,
    Ts: f64,
}

#[derive(FromPyObject)]
struct ProcessIn {
    K: f64,
    T: Times,
    L: f64,
    Tz: f64,
    zeta: Option<f64>,
    integrating: bool,
}

/// One time constant, or several.
#[derive(FromPyObject, IntoPyObject)]
enum Times {
    One(f64),
    Several(Vec<f64>),
}

#[derive(FromPyObject)]
struct TransferIn {
    num: Vec<f64>,
    den: Vec<f64>,
    L: f64,
}

impl<'py> FromPyObject<'_, 'py> for ModelIn {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let kind: String =
            value.getattr("kind").and_then(|k| k.extract()).map_err(|_| not_a_model(&value))?;
        Ok(ModelIn(match kind.as_str() {
            "poly" => {
                let PolyIn { A, B, C, D, F, nk, Ts } = value.getattr("core")?.extract()?;
                Model::Poly(PolyModel { A, B, C, D, F, nk, Ts })
            }
            "process" => {
                let ProcessIn { K, T, L, Tz, zeta, integrating } = value.extract()?;
                let T = match T {
                    Times::One(T) => vec![T],
                    Times::Several(T) => T,
                };
                Model::Process(ProcessModel { K, T, L, Tz, zeta, integrating })
            }
            "transfer" => {
                let TransferIn { num, den, L } = value.getattr("core")?.extract()?;
                Model::Transfer(TransferFunction { num, den, L })
            }
            // What asks for one output gets the same model as polynomials.
            "state_space" => {
                let model = StateSpace::from(value.extract::<StateSpaceIn>()?);
                Model::Poly(model.polynomial().map_err(Raise::from)?)
            }
            "terms" => {
                let came = "a TermModel, which is not linear in its signals";
                let needed = "a linear model: this asks for poles or a frequency response";
                return Err(Raise::from(Error::argument("model", came, needed)).into());
            }
            _ => return Err(not_a_model(&value)),
        }))
    }
}

fn not_a_model(value: &Borrowed<'_, '_, PyAny>) -> PyErr {
    let class = value.get_type().to_string();
    Raise::from(Error::argument("model", class, "a model of plantune.models, or a Fit")).into()
}

/// The first order plus dead time that many tuning rules are for.
pub fn plant(model: ModelIn) -> Outcome<Fopdt> {
    model.0.first_order().ok_or_else(|| {
        let what = match model.0 {
            Model::Poly(_) => "a PolyModel",
            _ => "no first order plus dead time",
        };
        Error::argument("model", what, "a ProcessModel of first order (d2c converts first-order PolyModels)")
            .into()
    })
}

/// `plantune.models.PID`, by attribute.
#[derive(FromPyObject)]
pub struct PidIn {
    Kp: f64,
    Ti: f64,
    Td: f64,
    Tf: f64,
    b: f64,
    c: f64,
    filter: FilterIn,
    Ts: Option<f64>,
    pure_Ki: Option<f64>,
}

/// `"d1"` or `"y2"`.
pub struct FilterIn(pub Filter);

impl<'py> FromPyObject<'_, 'py> for FilterIn {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        match value.extract::<&str>()? {
            "d1" => Ok(FilterIn(Filter::D1)),
            "y2" => Ok(FilterIn(Filter::Y2)),
            other => {
                let needed = "\"d1\" or \"y2\"";
                Err(Raise::from(Error::argument("filter", format!("\"{other}\""), needed)).into())
            }
        }
    }
}

impl From<PidIn> for Pid {
    fn from(p: PidIn) -> Self {
        let pi = Pid::pi(p.Kp, p.Ti);
        Pid {
            Ki: p.pure_Ki.unwrap_or(pi.Ki),
            Td: p.Td,
            Tf: p.Tf,
            b: p.b,
            c: p.c,
            filter: p.filter.0,
            Ts: p.Ts,
            ..pi
        }
    }
}

/// `Kp, Ti, Td, Tf`, and `Ki` where there is no `Kp`: how `plantune.models.PID` has them.
pub type Gains = (f64, f64, f64, f64, Option<f64>);

pub fn gains_of(pid: &Pid) -> Gains {
    let pure = pid.Kp == 0.0 && pid.Ki != 0.0;
    let Ti = if pure { f64::INFINITY } else { pid.Ti() };
    (pid.Kp, Ti, pid.Td, pid.Tf, pure.then_some(pid.Ki))
}

/// `Ki, Kd` of a controller.
#[pyfunction]
fn gains(pid: PidIn) -> (f64, f64) {
    let pid = Pid::from(pid);
    (pid.Ki, pid.Kd())
}

/// Seconds until a step response is seen whole.
#[pyfunction]
fn horizon(model: ModelIn) -> Outcome<f64> {
    model.0.check()?;
    Ok(model::horizon(&model.0))
}

/// Numerator and denominator of a controller from the error, in descending powers of s, or of z if it is sampled.
#[pyfunction]
fn pid_transfer(pid: PidIn) -> (Vec<f64>, Vec<f64>) {
    let pid = Pid::from(pid);
    match pid.Ts {
        Some(Ts) => pid.pulse_transfer(Ts),
        None => {
            let C = pid.transfer();
            (C.num, C.den)
        }
    }
}

/// A model as the dict from which Python builds its value.
#[derive(IntoPyObject)]
pub enum ModelOut {
    Poly(PolyOut),
    Process(ProcessOut),
    Transfer(TransferOut),
    Matrix(MatrixPolyOut),
    States(StateSpaceOut),
}

#[derive(IntoPyObject)]
pub struct PolyOut {
    A: Frozen,
    B: Vec<Frozen>,
    C: Frozen,
    D: Frozen,
    F: Vec<Frozen>,
    nk: Vec<usize>,
    Ts: f64,
}

#[derive(IntoPyObject)]
pub struct ProcessOut {
    K: f64,
    T: Times,
    L: f64,
    Tz: f64,
    zeta: Option<f64>,
    integrating: bool,
}

#[derive(IntoPyObject)]
pub struct TransferOut {
    num: Frozen,
    den: Frozen,
    L: f64,
}

impl From<Model> for ModelOut {
    fn from(model: Model) -> Self {
        match model {
            Model::Poly(PolyModel { A, B, C, D, F, nk, Ts }) => {
                let each = |p: Vec<Vec<f64>>| p.into_iter().map(Frozen).collect();
                let (A, C, D) = (Frozen(A), Frozen(C), Frozen(D));
                ModelOut::Poly(PolyOut { A, B: each(B), C, D, F: each(F), nk, Ts })
            }
            Model::Process(ProcessModel { K, T, L, Tz, zeta, integrating }) => {
                let T = if let [T] = T[..] { Times::One(T) } else { Times::Several(T) };
                ModelOut::Process(ProcessOut { K, T, L, Tz, zeta, integrating })
            }
            Model::Transfer(TransferFunction { num, den, L }) => {
                ModelOut::Transfer(TransferOut { num: Frozen(num), den: Frozen(den), L })
            }
        }
    }
}

#[pyfunction]
fn simulate<'py>(
    py: Python<'py>,
    model: ModelIn,
    u: PyReadonlyArray2<'py, f64>,
    Ts: f64,
    x0: f64,
    offset: f64,
) -> Outcome<Array<'py>> {
    let (nu, u) = (u.shape()[1], u.as_slice().map_err(PyErr::from)?);
    let y = py.detach(|| model.0.simulate_with(u, nu, Ts, x0, offset))?;
    Ok(array(py, y))
}

#[pyfunction]
fn freqresp<'py>(
    py: Python<'py>,
    model: ModelIn,
    input: usize,
    w: PyReadonlyArray1<'py, f64>,
) -> Bound<'py, PyArray1<Complex64>> {
    PyArray1::from_iter(py, w.as_array().iter().map(|&w| model.0.freqresp(input, w)))
}

#[pyfunction]
fn step_response<'py>(
    py: Python<'py>,
    model: ModelIn,
    input: usize,
    t: PyReadonlyArray1<'py, f64>,
) -> Outcome<Array<'py>> {
    Ok(array(py, model.0.step_response(input, t.as_slice().map_err(PyErr::from)?)))
}

#[pyfunction]
fn poles(py: Python<'_>, model: ModelIn) -> Bound<'_, PyArray1<Complex64>> {
    PyArray1::from_iter(py, model.0.poles().into_iter().map(|(re, im)| Complex64::new(re, im)))
}

#[pyfunction]
fn zeros(py: Python<'_>, model: ModelIn, input: usize) -> Bound<'_, PyArray1<Complex64>> {
    PyArray1::from_iter(py, model.0.zeros(input).into_iter().map(|(re, im)| Complex64::new(re, im)))
}

/// Numerator and denominator in descending powers of z.
#[pyfunction]
fn pulse_transfer(model: ModelIn, input: usize) -> Outcome<(Vec<f64>, Vec<f64>)> {
    match &model.0 {
        Model::Poly(m) => Ok(m.pulse_transfer(input)),
        _ => Err(Error::argument("model", "a ProcessModel", "a PolyModel; c2d gives one").into()),
    }
}

#[pyfunction]
fn dc_gain(model: ModelIn) -> Vec<f64> {
    model.0.dc_gain()
}

/// Frequency and damping of the resonance, if there is one.
#[pyfunction]
fn resonance(model: ModelIn, input: usize) -> Option<(f64, f64)> {
    model::resonance(&model.0, input).map(|mode| (mode.w, mode.zeta))
}

#[pyfunction]
fn c2d(model: ModelIn, Ts: f64) -> Outcome<ModelOut> {
    Ok(Model::Poly(model::c2d(&model.0, Ts)?).into())
}

#[pyfunction]
fn d2c(model: ModelIn) -> Outcome<ModelOut> {
    match &model.0 {
        Model::Poly(m) => Ok(Model::from(model::d2c(m)?).into()),
        _ => Err(Error::argument("model", "a continuous model", "a PolyModel").into()),
    }
}

/// A process model as numerator, denominator and dead time.
#[pyfunction]
fn transfer(model: ModelIn) -> Outcome<ModelOut> {
    model.0.check()?;
    match model.0.transfer() {
        Some(G) => Ok(Model::Transfer(G.into_owned()).into()),
        None => Err(Error::argument("model", "a PolyModel", "a ProcessModel or TransferFunction").into()),
    }
}
