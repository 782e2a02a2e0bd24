//! Controller settings, margins and their bands.

use numpy::{Complex64, PyArray1, PyReadonlyArray1};
use plantune_core::model::{Delay, Filter, Model, Pid};
use plantune_core::tune::{
    self, Answer, Bands, Costs, Estimate, Fitted, ImcTarget, Overshoot, Robustness, Settings, Step, Terms,
    Wish,
};
use plantune_core::{Error, Limits};
use pyo3::prelude::*;

use crate::batch::{FitOut, fit_out};
use crate::error::Outcome;
use crate::model::{FilterIn, ModelIn, ModelOut, PidIn};
use crate::note::{NoteOut, notes};
use crate::values::{Array, LimitsIn, RecordIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(check_tunable, m)?)?;
    m.add_function(wrap_pyfunction!(check_action, m)?)?;
    m.add_function(wrap_pyfunction!(half_rule, m)?)?;
    m.add_function(wrap_pyfunction!(controllability_ratio, m)?)?;
    m.add_function(wrap_pyfunction!(precontrol, m)?)?;
    m.add_function(wrap_pyfunction!(imc, m)?)?;
    m.add_function(wrap_pyfunction!(imc_classic, m)?)?;
    m.add_function(wrap_pyfunction!(imc_costs, m)?)?;
    m.add_function(wrap_pyfunction!(tracking_cost, m)?)?;
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
    m.add_function(wrap_pyfunction!(relay, m)?)?;
    m.add_function(wrap_pyfunction!(margins, m)?)?;
    m.add_function(wrap_pyfunction!(margin_bands, m)?)?;
    m.add_function(wrap_pyfunction!(sensitivities, m)?)?;
    m.add_function(wrap_pyfunction!(loop_shape, m)?)?;
    m.add_function(wrap_pyfunction!(optimal, m)?)?;
    m.add_function(wrap_pyfunction!(optimal_over, m)?)?;
    m.add_function(wrap_pyfunction!(cloud, m)?)?;
    m.add_function(wrap_pyfunction!(robustness, m)?)?;
    m.add_function(wrap_pyfunction!(stability, m)?)?;
    m.add_function(wrap_pyfunction!(loop_transfers, m)?)?;
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

/// Refuses a process gain whose sign the declared action of the loop does not serve (X12).
#[pyfunction]
fn check_action(action: &str, K: f64) -> Outcome<()> {
    Ok(tune::Action::read(action)?.check(K)?)
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
    let found = tune::imc(&model.0, tau_c, order, dead_time(delay)?, mirror)?;
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
fn tracking_cost(
    nominal: PyReadonlyArray1<'_, f64>,
    y: PyReadonlyArray1<'_, f64>,
    Ts: f64,
    T_J: f64,
) -> Outcome<f64> {
    let (nominal, y) = (nominal.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    Ok(tune::tracking_cost(nominal, y, Ts, T_J)?)
}

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
        model: Model::from(test.model).into(),
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

/// A fit as the cloud of its models needs it: model, covariance, rows, loss.
type FitIn<'py> = (ModelIn, PyReadonlyArray1<'py, f64>, usize, f64, Option<f64>);

fn fitted(fits: Vec<FitIn<'_>>) -> Outcome<Vec<Fitted>> {
    fits.into_iter()
        .map(|(model, P, N, loss, Ts)| {
            let P = P.as_slice().map_err(PyErr::from)?.to_vec();
            Ok(Fitted { model: model.0, P, N, loss, Ts })
        })
        .collect()
}

/// Intervals of `gain phase_deg delay Ms Mt`.
#[pyfunction]
fn margin_bands(py: Python<'_>, fits: Vec<FitIn<'_>>, pid: PidIn) -> Outcome<[(f64, f64); 5]> {
    let (fits, pid) = (fitted(fits)?, pid.into());
    Ok(py.detach(|| tune::margin_bands(&fits, &pid))?)
}

/// The dict behind `plantune.models.PID(**d)`.
#[derive(IntoPyObject)]
struct PidOut {
    Kp: f64,
    Ti: f64,
    Td: f64,
    Tf: f64,
    filter: &'static str,
    Ts: Option<f64>,
}

impl From<Pid> for PidOut {
    fn from(pid: Pid) -> Self {
        let filter = if pid.filter == Filter::Y2 { "y2" } else { "d1" };
        PidOut { Kp: pid.Kp, Ti: pid.Ti(), Td: pid.Td, Tf: pid.Tf, filter, Ts: pid.Ts }
    }
}

#[pyfunction]
fn loop_shape(
    model: ModelIn,
    w_c: f64,
    phase_margin: f64,
    controller: &str,
    Ts: Option<f64>,
) -> Outcome<PidOut> {
    Ok(tune::loop_shape(&model.0, w_c, phase_margin, terms(controller)?, Ts)?.into())
}

/// `plantune.tune.optimal.Wish`, by attribute.
#[derive(FromPyObject)]
struct WishIn {
    Ms: f64,
    Mt: f64,
    noise_gain: f64,
    answer: String,
    controller: String,
    filter: FilterIn,
    Ts: Option<f64>,
    share: f64,
}

impl WishIn {
    fn core(self) -> Outcome<Wish> {
        let answer = answer(&self.answer)?;
        let WishIn { Ms, Mt, noise_gain, controller, filter, Ts, share, .. } = self;
        let limits = Robustness { Ms, Mt, noise_gain };
        Ok(Wish { limits, answer, terms: terms(&controller)?, filter: filter.0, Ts, share })
    }
}

/// What is answered well, by its word.
pub fn answer(word: &str) -> plantune_core::Result<Answer> {
    match word {
        "load" => Ok(Answer::Load),
        "set_point" => Ok(Answer::SetPoint),
        "both" => Ok(Answer::Both),
        other => {
            let needed = "\"load\", \"set_point\" or \"both\"";
            Err(Error::argument("answer", format!("{other:?}"), needed))
        }
    }
}

/// Settings, and their cost, on a model.
#[pyfunction]
fn optimal(py: Python<'_>, model: ModelIn, wish: WishIn) -> Outcome<(PidOut, f64)> {
    let wish = wish.core()?;
    let found = py.detach(|| tune::optimise(&[model.0], &wish))?;
    Ok((found.pid.into(), found.cost))
}

/// Settings over the fits, their cost, the share of the integral gain on the best model alone that they keep,
/// and the seconds of record that would bring it to `dear`.
#[pyfunction]
fn optimal_over(
    py: Python<'_>,
    fits: Vec<FitIn<'_>>,
    wish: WishIn,
    dear: f64,
) -> Outcome<(PidOut, f64, f64, Option<f64>)> {
    let (fits, wish) = (fitted(fits)?, wish.core()?);
    let found = py.detach(|| tune::posterior(&fits, &wish, dear))?;
    let seconds = found.more.and_then(|more| tune::seconds(&fits, more));
    Ok((found.set.pid.into(), found.set.cost, found.kept(), seconds))
}

/// Stable gain factors at each change of the dead time, then gain and delay of each drawn model beside the plant.
#[pyfunction]
#[allow(clippy::type_complexity)] // two lists of pairs
fn robustness(
    py: Python<'_>,
    model: ModelIn,
    pid: PidIn,
    changes: Vec<f64>,
    fits: Vec<FitIn<'_>>,
    count: usize,
) -> Outcome<(Vec<(f64, f64)>, Vec<(f64, f64)>)> {
    let (fits, pid) = (fitted(fits)?, pid.into());
    Ok(py.detach(|| {
        let others = if fits.is_empty() { Vec::new() } else { tune::cloud(&fits, count)?.split_off(1) };
        Ok::<_, Error>((tune::border(&model.0, &pid, &changes)?, tune::departures(&model.0, &pid, &others)?))
    })?)
}

/// The models that the fits leave open, the most probable first.
#[pyfunction]
fn cloud(fits: Vec<FitIn<'_>>, count: usize) -> Outcome<Vec<ModelOut>> {
    Ok(tune::cloud(&fitted(fits)?, count)?.into_iter().map(ModelOut::from).collect())
}

type ComplexArray<'py> = Bound<'py, PyArray1<Complex64>>;

/// `L, S, T, CS` at the given frequencies.
#[pyfunction]
fn sensitivities<'py>(
    py: Python<'py>,
    model: ModelIn,
    pid: PidIn,
    w: PyReadonlyArray1<'py, f64>,
    delay: &str,
) -> Outcome<[ComplexArray<'py>; 4]> {
    let w = w.as_slice().map_err(PyErr::from)?;
    let s = tune::sensitivities(&model.0, &pid.into(), w, dead_time(delay)?)?;
    Ok([s.L, s.S, s.T, s.CS].map(|x| PyArray1::from_vec(py, x)))
}

fn dead_time(delay: &str) -> Outcome<Delay> {
    match delay {
        "exact" => Ok(Delay::Exact),
        "pade" => Ok(Delay::Pade),
        "taylor" => Ok(Delay::Taylor),
        other => {
            let needed = "\"exact\", \"pade\" or \"taylor\"";
            Err(Error::argument("delay", format!("\"{other}\""), needed).into())
        }
    }
}

/// Whether the loop is stable, and the stable intervals of `Kp, Ki, Ti, Kd`.
#[pyfunction]
fn stability(py: Python<'_>, model: ModelIn, pid: PidIn, delay: &str) -> Outcome<(bool, [(f64, f64); 4])> {
    let (pid, delay) = (pid.into(), dead_time(delay)?);
    let found = py.detach(|| tune::stability(&model.0, &pid, delay))?;
    let [Kp, Ki, Kd] = found.bounds;
    Ok((found.stable, [Kp, Ki, found.Ti, Kd]))
}

/// `y_r, u_r, e_r, y_p, y_d, u_d`.
#[pyfunction]
fn loop_transfers(model: ModelIn, pid: PidIn, delay: &str) -> Outcome<[ModelOut; 6]> {
    let all = tune::closed_loop_transfers(&model.0, &pid.into(), dead_time(delay)?)?;
    Ok([all.y_r, all.u_r, all.e_r, all.y_p, all.y_d, all.u_d].map(|G| Model::Transfer(G).into()))
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
