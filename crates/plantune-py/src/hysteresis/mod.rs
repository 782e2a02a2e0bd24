//! Hysteresis: models in and out by attribute, operators at work as a compiled class.

mod bouc_wen;
mod cmac;
mod creep;
mod cycles;
mod identified;
mod maxwell_slip;
mod play_learner;
mod plays;
mod preisach;
mod slip;
mod stream;
mod track;

use numpy::PyReadonlyArray1;
use plantune_core::Error;
use plantune_core::hysteresis::Model;
use pyo3::prelude::*;

use crate::error::{Outcome, Raise};
use crate::values::{Array, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<stream::Stream>()?;
    cycles::register(m)?;
    slip::register(m)?;
    bouc_wen::register(m)?;
    maxwell_slip::register(m)?;
    m.add_class::<cmac::Cmac>()?;
    m.add_class::<play_learner::PlayLearner>()?;
    for register in [plays::register, preisach::register, creep::register, track::register] {
        register(m)?;
    }
    m.add_function(wrap_pyfunction!(hysteresis_check, m)?)?;
    m.add_function(wrap_pyfunction!(hysteresis_simulate, m)?)?;
    m.add_function(wrap_pyfunction!(hysteresis_against, m)?)?;
    m.add_function(wrap_pyfunction!(hysteresis_inverse, m)?)
}

/// Any hysteresis model of `plantune.models`, by attribute.
pub struct HysteresisIn(pub Model);

impl<'py> FromPyObject<'_, 'py> for HysteresisIn {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let kind: String =
            value.getattr("kind").and_then(|k| k.extract()).map_err(|_| not_a_model(&value))?;
        Ok(HysteresisIn(match kind.as_str() {
            "play_stack" => Model::PlayStack(value.extract::<plays::PlayStackIn>()?.into()),
            "asymmetric_stack" => Model::Asymmetric(value.extract::<plays::AsymmetricIn>()?.into()),
            "asymmetric_inverse" => Model::AsymmetricInverse(value.extract::<plays::AsymmetricIn>()?.into()),
            "even_stack" => Model::Even(value.extract::<plays::EvenIn>()?.into()),
            "series_slip" => Model::SeriesSlip(slip::read(&value)?),
            "preisach" => Model::Preisach(value.extract::<preisach::PreisachIn>()?.core()?),
            "preisach_inverse" => Model::PreisachInverse(value.extract::<preisach::PreisachIn>()?.core()?),
            "creep" => Model::Creep(value.extract::<creep::CreepIn>()?.core()?),
            "creep_inverse" => Model::CreepInverse(value.extract::<creep::CreepIn>()?.core()?),
            "bouc_wen" => Model::BoucWen(value.extract::<bouc_wen::BoucWenIn>()?.into()),
            "bouc_wen_force" => Model::BoucWenForce(value.extract::<bouc_wen::BoucWenForceIn>()?.into()),
            "maxwell_slip" => Model::MaxwellSlip(value.extract::<maxwell_slip::MaxwellSlipIn>()?.into()),
            "charge_leak" => Model::ChargeLeak(value.extract::<creep::ChargeLeakIn>()?.into()),
            _ => return Err(not_a_model(&value)),
        }))
    }
}

fn not_a_model(value: &Borrowed<'_, '_, PyAny>) -> PyErr {
    let class = value.get_type().to_string();
    Raise::from(Error::argument("model", class, "a model of plantune.hysteresis")).into()
}

/// A model as the dict from which Python builds its value.
#[derive(IntoPyObject)]
pub enum HysteresisOut {
    PlayStack(plays::PlayStackOut),
    Asymmetric(plays::AsymmetricOut),
    Even(plays::EvenOut),
    SeriesSlip { up: Vec<(f64, f64, f64)>, down: Vec<(f64, f64, f64)> },
    Preisach(preisach::PreisachOut),
    Creep(creep::CreepOut),
    ChargeLeak(creep::ChargeLeakOut),
    BoucWen(bouc_wen::BoucWenOut),
    BoucWenForce(bouc_wen::BoucWenForceOut),
    MaxwellSlip(maxwell_slip::MaxwellSlipOut),
}

impl From<Model> for HysteresisOut {
    fn from(model: Model) -> Self {
        match model {
            Model::PlayStack(m) => HysteresisOut::PlayStack(m.into()),
            Model::Asymmetric(m) | Model::AsymmetricInverse(m) => HysteresisOut::Asymmetric(m.into()),
            Model::Even(m) => HysteresisOut::Even(m.into()),
            Model::SeriesSlip(m) => {
                HysteresisOut::SeriesSlip { up: slip::rows(&m.up), down: slip::rows(&m.down) }
            }
            Model::Preisach(m) | Model::PreisachInverse(m) => HysteresisOut::Preisach(m.into()),
            Model::Creep(m) | Model::CreepInverse(m) => HysteresisOut::Creep(m.into()),
            Model::ChargeLeak(m) => HysteresisOut::ChargeLeak(m.into()),
            Model::BoucWen(m) => HysteresisOut::BoucWen(m.into()),
            Model::BoucWenForce(m) => HysteresisOut::BoucWenForce(m.into()),
            Model::MaxwellSlip(m) => HysteresisOut::MaxwellSlip(m.into()),
        }
    }
}

/// Refuses parameters that are none.
#[pyfunction]
fn hysteresis_check(model: HysteresisIn) -> Outcome<()> {
    Ok(model.0.check()?)
}

/// Output over a record, from the virgin state.
#[pyfunction]
fn hysteresis_simulate<'py>(
    py: Python<'py>,
    model: HysteresisIn,
    x: PyReadonlyArray1<'py, f64>,
) -> Outcome<Array<'py>> {
    let x = x.as_slice().map_err(PyErr::from)?;
    let y = py.detach(|| model.0.simulate(x))?;
    Ok(array(py, y))
}

/// Output over a record, its error in percent of the range of `y`, and the rms of that.
#[pyfunction]
fn hysteresis_against<'py>(
    py: Python<'py>,
    model: HysteresisIn,
    x: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
) -> Outcome<(Array<'py>, Array<'py>, f64)> {
    let (x, y) = (x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let (simulated, errors, rms) = py.detach(|| model.0.against(x, y))?;
    Ok((array(py, simulated), array(py, errors), rms))
}

/// Fields of the inverse.
#[pyfunction]
fn hysteresis_inverse(model: HysteresisIn) -> Outcome<HysteresisOut> {
    Ok(model.0.inverse()?.into())
}
