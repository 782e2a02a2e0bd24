//! Controller settings, margins and their bands.

use numpy::{Complex64, PyArray1, PyReadonlyArray1};
use plantune_core::model::{Model, Pid};
use plantune_core::tune::{self, Bands, Estimate, ImcTarget, Overshoot, Step, Terms};
use plantune_core::{Error, Limits};
use pyo3::prelude::*;

use crate::batch::{FitOut, fit_out};
use crate::error::Outcome;
use crate::model::{ModelIn, ModelOut, PidIn, plant};
use crate::note::{NoteOut, notes};
use crate::values::{Array, LimitsIn, RecordIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(check_tunable, m)?)?;
    m.add_function(wrap_pyfunction!(imc_pi, m)?)?;
    m.add_function(wrap_pyfunction!(simc, m)?)?;
    m.add_function(wrap_pyfunction!(ziegler_nichols, m)?)?;
    m.add_function(wrap_pyfunction!(refined_ziegler_nichols, m)?)?;
    m.add_function(wrap_pyfunction!(simc_plus, m)?)?;
    m.add_function(wrap_pyfunction!(amigo, m)?)?;
    m.add_function(wrap_pyfunction!(lambda, m)?)?;
    m.add_function(wrap_pyfunction!(cohen_coon, m)?)?;
    m.add_function(wrap_pyfunction!(chien_hrones_reswick, m)?)?;
    m.add_function(wrap_pyfunction!(tyreus_luyben, m)?)?;
    m.add_function(wrap_pyfunction!(relay, m)?)?;
    m.add_function(wrap_pyfunction!(margins, m)?)?;
    m.add_function(wrap_pyfunction!(margin_bands, m)?)?;
    m.add_function(wrap_pyfunction!(sensitivities, m)?)?;
    m.add_function(wrap_pyfunction!(phase_deg, m)?)?;
    m.add_function(wrap_pyfunction!(step_band, m)?)?;
    m.add_function(wrap_pyfunction!(bode_band, m)?)
}

/// Refuses a fit that must not be tuned on (X12, M09); gain and time constant come with their deviations.
#[pyfunction]
fn check_tunable(K: (f64, f64), T: (f64, f64), Ts: Option<f64>, limits: LimitsIn) -> Outcome<()> {
    let estimate = |(value, sd)| Estimate { value, sd };
    Ok(tune::check_tunable(estimate(K), estimate(T), Ts, &limits.into())?)
}

/// Settings of the standard form, and the closed-loop time constant aimed at; NaN for none.
#[derive(IntoPyObject)]
struct SettingsOut {
    Kp: f64,
    Ti: f64,
    Td: f64,
    Tf: f64,
    tau_c: f64,
}

impl From<(Pid, f64)> for SettingsOut {
    fn from((pid, tau_c): (Pid, f64)) -> Self {
        SettingsOut { Kp: pid.Kp, Ti: pid.Ti(), Td: pid.Td, Tf: pid.Tf, tau_c }
    }
}

fn terms(controller: &str) -> Outcome<Terms> {
    match controller {
        "PI" => Ok(Terms::Pi),
        "PID" => Ok(Terms::Pid),
        other => Err(Error::argument("controller", format!("\"{other}\""), "\"PI\" or \"PID\"").into()),
    }
}

#[pyfunction]
fn imc_pi(model: ModelIn, target: &str, value: f64) -> Outcome<SettingsOut> {
    let target = match target {
        "gain_margin" => ImcTarget::GainMargin(value),
        "phase_margin" => ImcTarget::PhaseMargin(value),
        _ => ImcTarget::TauC(value),
    };
    Ok(tune::imc_pi(&plant(model)?, target)?.into())
}

#[pyfunction]
fn simc(model: ModelIn, tau_c: Option<f64>) -> Outcome<SettingsOut> {
    Ok(tune::simc(&plant(model)?, tau_c)?.into())
}

#[pyfunction]
fn ziegler_nichols(model: ModelIn, controller: &str) -> Outcome<SettingsOut> {
    Ok((tune::ziegler_nichols(&plant(model)?, terms(controller)?)?, f64::NAN).into())
}

#[pyfunction]
fn refined_ziegler_nichols(model: ModelIn) -> Outcome<SettingsOut> {
    Ok((tune::refined_ziegler_nichols(&plant(model)?)?, f64::NAN).into())
}

#[pyfunction]
fn simc_plus(model: ModelIn, tau_c: Option<f64>, controller: &str) -> Outcome<SettingsOut> {
    Ok(tune::simc_plus(&plant(model)?, tau_c, terms(controller)?)?.into())
}

#[pyfunction]
fn amigo(model: ModelIn, controller: &str) -> Outcome<SettingsOut> {
    Ok((tune::amigo(&plant(model)?, terms(controller)?)?, f64::NAN).into())
}

#[pyfunction]
#[pyo3(name = "lambda_")]
fn lambda(model: ModelIn, tau_c: Option<f64>, controller: &str) -> Outcome<SettingsOut> {
    Ok(tune::lambda(&plant(model)?, tau_c, terms(controller)?)?.into())
}

#[pyfunction]
fn cohen_coon(model: ModelIn, controller: &str) -> Outcome<SettingsOut> {
    Ok((tune::cohen_coon(&plant(model)?, terms(controller)?)?, f64::NAN).into())
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
    let settings = tune::chien_hrones_reswick(&plant(model)?, step, overshoot, terms(controller)?)?;
    Ok((settings, f64::NAN).into())
}

#[pyfunction]
fn tyreus_luyben(model: ModelIn, controller: &str) -> Outcome<SettingsOut> {
    Ok((tune::tyreus_luyben(&plant(model)?, terms(controller)?)?, f64::NAN).into())
}

/// The dict behind `plantune.tune.RelayTest(**d)`.
#[derive(IntoPyObject)]
struct RelayOut<'py> {
    model: ModelOut,
    sd: Array<'py>,
    offset: f64,
    known: &'static str,
    fit: Option<FitOut<'py>>,
    Ku: f64,
    Tu: f64,
    t_on: f64,
    t_off: f64,
    periods: usize,
    rows: (usize, usize),
    yhat: Array<'py>,
    thresholds: (f64, f64),
    levels: (f64, f64),
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn relay<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    rest: Option<(f64, f64)>,
    limits: LimitsIn,
) -> Outcome<RelayOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let test = py.detach(|| tune::relay(&record, rest, &limits))?;
    Ok(RelayOut {
        model: Model::Process(test.model).into(),
        sd: array(py, test.sd.to_vec()),
        offset: test.offset,
        known: test.known.as_str(),
        fit: test.fit.map(|fit| fit_out(py, fit, record.row_ranges())).transpose()?,
        Ku: test.ultimate.0,
        Tu: test.ultimate.1,
        t_on: test.t_on,
        t_off: test.t_off,
        periods: test.periods,
        rows: (test.rows.start, test.rows.end),
        yhat: array(py, test.yhat),
        thresholds: test.thresholds,
        levels: test.levels,
        notes: notes(&test.notes),
    })
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
