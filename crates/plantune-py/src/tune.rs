//! Controller settings, margins and their bands.

use numpy::{Complex64, PyArray1, PyReadonlyArray1};
use plantune_core::Error;
use plantune_core::model::{Model, Pid};
use plantune_core::tune::{self, Bands, Costs, Delay, Estimate, ImcTarget, Overshoot, Settings, Step, Terms};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::model::{ModelIn, ModelOut, PidIn};
use crate::values::{Array, LimitsIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(check_tunable, m)?)?;
    m.add_function(wrap_pyfunction!(half_rule, m)?)?;
    m.add_function(wrap_pyfunction!(controllability_ratio, m)?)?;
    m.add_function(wrap_pyfunction!(precontrol, m)?)?;
    m.add_function(wrap_pyfunction!(imc, m)?)?;
    m.add_function(wrap_pyfunction!(imc_classic, m)?)?;
    m.add_function(wrap_pyfunction!(imc_costs, m)?)?;
    m.add_function(wrap_pyfunction!(imc_pi, m)?)?;
    m.add_function(wrap_pyfunction!(imc_pid, m)?)?;
    m.add_function(wrap_pyfunction!(simc, m)?)?;
    m.add_function(wrap_pyfunction!(ziegler_nichols, m)?)?;
    m.add_function(wrap_pyfunction!(refined_ziegler_nichols, m)?)?;
    m.add_function(wrap_pyfunction!(simc_plus, m)?)?;
    m.add_function(wrap_pyfunction!(amigo, m)?)?;
    m.add_function(wrap_pyfunction!(lambda, m)?)?;
    m.add_function(wrap_pyfunction!(cohen_coon, m)?)?;
    m.add_function(wrap_pyfunction!(chien_hrones_reswick, m)?)?;
    m.add_function(wrap_pyfunction!(tyreus_luyben, m)?)?;
    m.add_function(wrap_pyfunction!(margins, m)?)?;
    m.add_function(wrap_pyfunction!(margin_bands, m)?)?;
    m.add_function(wrap_pyfunction!(sensitivities, m)?)?;
    m.add_function(wrap_pyfunction!(phase_deg, m)?)?;
    m.add_function(wrap_pyfunction!(step_band, m)?)?;
    m.add_function(wrap_pyfunction!(bode_band, m)?)
}

/// Refuses a fit that must not be tuned on (X12, M09); gain and slowest time constant come with their deviations.
#[pyfunction]
fn check_tunable(K: (f64, f64), T: Option<(f64, f64)>, Ts: Option<f64>, limits: LimitsIn) -> Outcome<()> {
    let estimate = |(value, sd)| Estimate { value, sd };
    Ok(tune::check_tunable(estimate(K), T.map(estimate), Ts, &limits.into())?)
}

#[pyfunction]
fn half_rule(model: ModelIn, order: usize, tau_c: Option<f64>) -> Outcome<ModelOut> {
    Ok(Model::Process(tune::half_rule(&model.0, order, tau_c)?).into())
}

#[pyfunction]
fn controllability_ratio(model: ModelIn) -> Outcome<f64> {
    Ok(tune::controllability_ratio(&model.0)?)
}

#[pyfunction]
fn precontrol(model: ModelIn, r: f64, load: f64, ramp: f64) -> Outcome<f64> {
    Ok(tune::precontrol(&model.0, r, load, ramp)?)
}

/// The dict behind `plantune.tune.IMC(**d)` but what was asked for.
#[derive(IntoPyObject)]
struct ImcOut {
    invertible: ModelOut,
    non_invertible: ModelOut,
    filter: ModelOut,
    controller: ModelOut,
    classic: Option<ModelOut>,
    closed_loop: ModelOut,
    order: usize,
}

#[pyfunction]
fn imc(model: ModelIn, tau_c: f64, order: Option<usize>, delay: &str, mirror: bool) -> Outcome<ImcOut> {
    let delay = match delay {
        "exact" => Delay::Exact,
        "taylor" => Delay::Taylor,
        "pade" => Delay::Pade,
        other => {
            let needed = "\"exact\", \"taylor\" or \"pade\"";
            return Err(Error::argument("delay", format!("\"{other}\""), needed).into());
        }
    };
    let found = tune::imc(&model.0, tau_c, order, delay, mirror)?;
    let out = |G| Model::Transfer(G).into();
    Ok(ImcOut {
        invertible: out(found.invertible),
        non_invertible: out(found.non_invertible),
        filter: out(found.filter),
        controller: out(found.controller),
        classic: found.classic.map(out),
        closed_loop: out(found.closed_loop),
        order: found.order,
    })
}

/// `C / (1 - C G)` of an IMC controller on its model.
#[pyfunction]
fn imc_classic<'py>(
    py: Python<'py>,
    controller: ModelIn,
    model: ModelIn,
    w: PyReadonlyArray1<'py, f64>,
) -> Outcome<ComplexArray<'py>> {
    let Model::Transfer(C) = controller.0 else {
        return Err(Error::argument("controller", "another model", "a TransferFunction").into());
    };
    let at = |&w: &f64| tune::classic_freqresp(&C, &model.0, w);
    Ok(PyArray1::from_iter(py, w.as_slice().map_err(PyErr::from)?.iter().map(at)))
}

/// `ise, iae, itae` of the loop "ideal" or "pi".
#[pyfunction]
fn imc_costs(L: f64, tau_c: f64, loop_: &str) -> Outcome<(f64, f64, f64)> {
    let Costs { ise, iae, itae } = match loop_ {
        "ideal" => tune::ideal_costs(L, tau_c)?,
        "pi" => tune::pi_costs(L, tau_c)?,
        other => return Err(Error::argument("loop", format!("\"{other}\""), "\"ideal\" or \"pi\"").into()),
    };
    Ok((ise, iae, itae))
}

/// Settings of the standard form, the closed-loop time constant aimed at, NaN for none, what the rule was computed
/// on, and whether that is less than the model given.
#[derive(IntoPyObject)]
struct SettingsOut {
    Kp: f64,
    Ti: f64,
    Td: f64,
    Tf: f64,
    tau_c: f64,
    plant: Option<ModelOut>,
    reduced: bool,
}

impl From<Settings> for SettingsOut {
    fn from(Settings { pid, tau_c, plant, reduced }: Settings) -> Self {
        let plant = plant.map(|model| Model::Process(model).into());
        SettingsOut { Kp: pid.Kp, Ti: pid.Ti(), Td: pid.Td, Tf: pid.Tf, tau_c, plant, reduced }
    }
}

fn terms(controller: &str) -> Outcome<Terms> {
    match controller {
        "PI" => Ok(Terms::Pi),
        "PID" => Ok(Terms::Pid),
        other => Err(Error::argument("controller", format!("\"{other}\""), "\"PI\" or \"PID\"").into()),
    }
}

fn target(name: &str, value: f64) -> ImcTarget {
    match name {
        "gain_margin" => ImcTarget::GainMargin(value),
        "phase_margin" => ImcTarget::PhaseMargin(value),
        _ => ImcTarget::TauC(value),
    }
}

#[pyfunction]
fn imc_pi(model: ModelIn, wish: &str, value: f64) -> Outcome<SettingsOut> {
    Ok(tune::imc_pi(&model.0, target(wish, value))?.into())
}

#[pyfunction]
fn imc_pid(model: ModelIn, wish: &str, value: f64, N: Option<f64>) -> Outcome<SettingsOut> {
    Ok(tune::imc_pid(&model.0, target(wish, value), N)?.into())
}

#[pyfunction]
fn simc(model: ModelIn, tau_c: Option<f64>, controller: &str) -> Outcome<SettingsOut> {
    Ok(tune::simc(&model.0, tau_c, terms(controller)?)?.into())
}

#[pyfunction]
fn ziegler_nichols(model: ModelIn, controller: &str) -> Outcome<SettingsOut> {
    Ok(tune::ziegler_nichols(&model.0, terms(controller)?)?.into())
}

#[pyfunction]
fn refined_ziegler_nichols(model: ModelIn) -> Outcome<SettingsOut> {
    Ok(tune::refined_ziegler_nichols(&model.0)?.into())
}

#[pyfunction]
fn simc_plus(model: ModelIn, tau_c: Option<f64>, controller: &str) -> Outcome<SettingsOut> {
    Ok(tune::simc_plus(&model.0, tau_c, terms(controller)?)?.into())
}

#[pyfunction]
fn amigo(model: ModelIn, controller: &str) -> Outcome<SettingsOut> {
    Ok(tune::amigo(&model.0, terms(controller)?)?.into())
}

#[pyfunction]
#[pyo3(name = "lambda_")]
fn lambda(model: ModelIn, tau_c: Option<f64>, controller: &str) -> Outcome<SettingsOut> {
    Ok(tune::lambda(&model.0, tau_c, terms(controller)?)?.into())
}

#[pyfunction]
fn cohen_coon(model: ModelIn, controller: &str) -> Outcome<SettingsOut> {
    Ok(tune::cohen_coon(&model.0, terms(controller)?)?.into())
}

#[pyfunction]
fn chien_hrones_reswick(
    model: ModelIn,
    step: &str,
    overshoot: f64,
    controller: &str,
) -> Outcome<SettingsOut> {
    let step = match step {
        "load" => Step::Load,
        "set_point" => Step::SetPoint,
        other => {
            let needed = "\"load\" or \"set_point\"";
            return Err(Error::argument("step", format!("\"{other}\""), needed).into());
        }
    };
    let overshoot = match overshoot {
        0.0 => Overshoot::Zero,
        20.0 => Overshoot::Twenty,
        other => return Err(Error::argument("overshoot", other, "0 or 20, in percent").into()),
    };
    Ok(tune::chien_hrones_reswick(&model.0, step, overshoot, terms(controller)?)?.into())
}

#[pyfunction]
fn tyreus_luyben(model: ModelIn, controller: &str) -> Outcome<SettingsOut> {
    Ok(tune::tyreus_luyben(&model.0, terms(controller)?)?.into())
}

/// The dict behind `plantune.tune.Margins(**d)`.
#[derive(IntoPyObject)]
struct MarginsOut {
    stable: bool,
    gain: f64,
    gain_db: f64,
    w_gain: f64,
    phase_deg: f64,
    w_phase: f64,
    delay: f64,
    Ms: f64,
    Mt: f64,
    noise_gain: f64,
}

#[pyfunction]
fn margins(model: ModelIn, pid: PidIn) -> Outcome<MarginsOut> {
    let m = tune::margins(&model.0, &pid.into())?;
    Ok(MarginsOut {
        stable: m.stable,
        gain: m.gain,
        gain_db: m.gain_db,
        w_gain: m.w_gain,
        phase_deg: m.phase_deg,
        w_phase: m.w_phase,
        delay: m.delay,
        Ms: m.Ms,
        Mt: m.Mt,
        noise_gain: m.noise_gain,
    })
}

/// Intervals of `gain phase_deg delay Ms Mt`.
#[pyfunction]
fn margin_bands(
    py: Python<'_>,
    model: ModelIn,
    P: PyReadonlyArray1<'_, f64>,
    pid: PidIn,
) -> Outcome<[(f64, f64); 5]> {
    let (P, pid): (_, Pid) = (P.as_slice().map_err(PyErr::from)?, pid.into());
    Ok(py.detach(|| tune::margin_bands(&model.0, P, &pid))?)
}

type ComplexArray<'py> = Bound<'py, PyArray1<Complex64>>;

/// `L, S, T, CS` at the given frequencies.
#[pyfunction]
fn sensitivities<'py>(
    py: Python<'py>,
    model: ModelIn,
    pid: PidIn,
    w: PyReadonlyArray1<'py, f64>,
) -> Outcome<[ComplexArray<'py>; 4]> {
    let s = tune::sensitivities(&model.0, &pid.into(), w.as_slice().map_err(PyErr::from)?)?;
    Ok([s.L, s.S, s.T, s.CS].map(|x| PyArray1::from_vec(py, x)))
}

#[pyfunction]
fn phase_deg<'py>(
    py: Python<'py>,
    model: ModelIn,
    input: usize,
    w: PyReadonlyArray1<'py, f64>,
) -> Outcome<Array<'py>> {
    Ok(array(py, tune::phase_deg(&model.0, input, w.as_slice().map_err(PyErr::from)?)))
}

/// Lower and upper curve.
type BandOut<'py> = (Array<'py>, Array<'py>);

fn band(py: Python<'_>, band: Bands) -> BandOut<'_> {
    (array(py, band.low), array(py, band.high))
}

#[pyfunction]
fn step_band<'py>(
    py: Python<'py>,
    model: ModelIn,
    P: PyReadonlyArray1<'py, f64>,
    input: usize,
    t: PyReadonlyArray1<'py, f64>,
) -> Outcome<BandOut<'py>> {
    let (P, t) = (P.as_slice().map_err(PyErr::from)?, t.as_slice().map_err(PyErr::from)?);
    Ok(band(py, py.detach(|| tune::step_band(&model.0, P, input, t))?))
}

/// Bands of magnitude and of phase.
#[pyfunction]
fn bode_band<'py>(
    py: Python<'py>,
    model: ModelIn,
    P: PyReadonlyArray1<'py, f64>,
    input: usize,
    w: PyReadonlyArray1<'py, f64>,
) -> Outcome<(BandOut<'py>, BandOut<'py>)> {
    let (P, w) = (P.as_slice().map_err(PyErr::from)?, w.as_slice().map_err(PyErr::from)?);
    let (magnitude, phase) = py.detach(|| tune::bode_band(&model.0, P, input, w))?;
    Ok((band(py, magnitude), band(py, phase)))
}
