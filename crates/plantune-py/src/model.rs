//! Models: values in and out, and what a model is asked.

use numpy::{Complex64, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::Error;
use plantune_core::model::{self, Model, Pid, PolyModel, ProcessModel};
use pyo3::prelude::*;

use crate::error::{Outcome, Raise};
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
    m.add_function(wrap_pyfunction!(c2d, m)?)?;
    m.add_function(wrap_pyfunction!(lags, m)?)?;
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
    T: f64,
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
                let ProcessIn { K, T, L } = value.extract()?;
                Model::Process(ProcessModel { K, T, L })
            }
            _ => return Err(not_a_model(&value)),
        }))
    }
}

fn not_a_model(value: &Borrowed<'_, '_, PyAny>) -> PyErr {
    let class = value.get_type().to_string();
    Raise::from(Error::argument("model", class, "a model of plantune.models, or a Fit")).into()
}

/// The process model that closed loops and tuning rules are for.
pub fn plant(model: ModelIn) -> Outcome<ProcessModel> {
    match model.0 {
        Model::Process(plant) => Ok(plant),
        Model::Poly(_) => {
            Err(Error::argument("model", "a PolyModel", "a ProcessModel (d2c converts first-order ones)")
                .into())
        }
    }
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
    Ts: Option<f64>,
    pure_Ki: Option<f64>,
}

impl From<PidIn> for Pid {
    fn from(p: PidIn) -> Self {
        let pi = Pid::pi(p.Kp, p.Ti);
        Pid { Ki: p.pure_Ki.unwrap_or(pi.Ki), Td: p.Td, Tf: p.Tf, b: p.b, c: p.c, Ts: p.Ts, ..pi }
    }
}

/// `Ki, Kd` of a controller.
#[pyfunction]
fn gains(pid: PidIn) -> (f64, f64) {
    let pid = Pid::from(pid);
    (pid.Ki, pid.Kd())
}

/// A model as the dict from which Python builds its value.
#[derive(IntoPyObject)]
pub enum ModelOut {
    Poly(PolyOut),
    Process(ProcessOut),
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
    T: f64,
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
            Model::Process(ProcessModel { K, T, L }) => ModelOut::Process(ProcessOut { K, T, L }),
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
) -> Outcome<Array<'py>> {
    let (nu, u) = (u.shape()[1], u.as_slice().map_err(PyErr::from)?);
    let y = py.detach(|| model.0.simulate(u, nu, Ts, x0))?;
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
        Model::Process(_) => {
            Err(Error::argument("model", "a ProcessModel", "a PolyModel; c2d gives one").into())
        }
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
    match &model.0 {
        Model::Process(m) => Ok(Model::Poly(model::c2d(m, Ts)?).into()),
        Model::Poly(_) => Err(Error::argument("model", "a PolyModel", "a ProcessModel").into()),
    }
}

/// The sampled form of lags in series.
#[pyfunction]
fn lags(K: f64, T: Vec<f64>, Ts: f64) -> Outcome<ModelOut> {
    Ok(Model::Poly(model::lags(K, &T, Ts)?).into())
}

#[pyfunction]
fn d2c(model: ModelIn) -> Outcome<ModelOut> {
    match &model.0 {
        Model::Poly(m) => Ok(Model::Process(model::d2c(m)?).into()),
        Model::Process(_) => Err(Error::argument("model", "a ProcessModel", "a PolyModel").into()),
    }
}
