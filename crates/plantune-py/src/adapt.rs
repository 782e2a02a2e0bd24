//! The auto-tuner across the border.

use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use plantune_core::Error;
use plantune_core::adapt::{
    BankScheme, Decision, DelayRule, GateLimits, PosteriorSettings, Prefilter, Rule, Sample, Scheme,
    Simulated, Tuner, TunerSettings, WindowSettings,
};
use plantune_core::model::{Fopdt, Pid};
use plantune_core::recursive::BankSettings;
use plantune_core::sim::Table;
use plantune_core::tune::ImcTarget;
use pyo3::prelude::*;

use crate::bank::is_rml;
use crate::error::Outcome;
use crate::model::{Gains, PidIn, gains_of};
use crate::note::NoteOut;
use crate::tune::answer;
use crate::values::{Array, Matrix, array, matrix};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<AutoTuner>()
}

/// A `plantune.adapt.Bank`, by attribute.
#[derive(FromPyObject)]
struct BankIn {
    lam: f64,
    lam0: f64,
    rho: f64,
    method: String,
    offset: bool,
    band: Option<(f64, f64)>,
    order: usize,
    steady: bool,
    opens: usize,
    delay: String,
    window: usize,
    hysteresis: usize,
}

impl BankIn {
    fn scheme(self, Ts: f64, nk: (usize, usize)) -> plantune_core::Result<BankScheme> {
        let delay = match self.delay.as_str() {
            "posterior" => DelayRule::Posterior(PosteriorSettings::default()),
            "counters" => DelayRule::Counters { W: self.window, hysteresis: self.hysteresis },
            other => {
                let needed = "\"posterior\" or \"counters\"";
                return Err(Error::argument("delay", format!("{other:?}"), needed));
            }
        };
        let bank = BankSettings {
            lambda: self.lam,
            lambda0: self.lam0,
            rho: self.rho,
            rml: is_rml(&self.method)?,
            ..BankSettings::default()
        };
        let (order, steady) = (self.order, self.steady);
        let prefilter = self.band.map(|band| Prefilter { order, band, steady });
        Ok(BankScheme { Ts, nk, bank, offset: self.offset, prefilter, delay, opens: self.opens })
    }
}

/// A `plantune.adapt.Settings`, by attribute.
#[derive(FromPyObject)]
struct SettingsIn {
    Ts: f64,
    nk: (usize, usize),
    controller: PidIn,
    imc: (String, f64),
    rule: String,
    writes: [bool; 3],
    answer: String,
    Ms: f64,
    rows: usize,
    every: usize,
    fraction: bool,
    bank: Option<BankIn>,
    K: (f64, f64),
    T: (f64, f64),
    L: (f64, f64),
    sd: [f64; 3],
    spread: [f64; 3],
    answered: f64,
    settled: usize,
    average: bool,
    merge_rate: f64,
    nominal: Option<FopdtIn>,
    worth: f64,
    max_change: f64,
    dwell: f64,
    gate_gain_margin: f64,
    gate_phase_margin: f64,
    saturation: f64,
    excitation: f64,
    stuck: usize,
    u_limits: (f64, f64),
    points: Option<(Vec<Vec<f64>>, Vec<f64>)>,
    target: f64,
    tables: Option<(TableIn, TableIn)>,
    simulated_plant: Option<FopdtIn>,
    simulated_offset: f64,
    simulated_controller: bool,
    u0: f64,
}

/// Axes and flat values of a `plantune.simulate.Table`.
type TableIn = (Vec<Vec<f64>>, Vec<f64>);

/// Axes, then flat values of the tables of Kp and of Ki.
type TablesOut = (Vec<Vec<f64>>, Vec<f64>, Vec<f64>);

/// `K, T, L` of a `plantune.models.ProcessModel` of first order.
#[derive(FromPyObject)]
struct FopdtIn {
    K: f64,
    T: f64,
    L: f64,
}

impl SettingsIn {
    fn core(self) -> plantune_core::Result<TunerSettings> {
        let (Ts, nk) = (self.Ts, self.nk);
        let scheme = match self.bank {
            Some(bank) => Scheme::Bank(bank.scheme(Ts, nk)?),
            None => Scheme::Window(WindowSettings {
                Ts,
                nk,
                fraction: self.fraction,
                rows: self.rows,
                every: self.every,
            }),
        };
        let (name, value) = self.imc;
        let imc = match name.as_str() {
            "gain_margin" => ImcTarget::GainMargin(value),
            "phase_margin" => ImcTarget::PhaseMargin(value),
            _ => ImcTarget::TauC(value),
        };
        let answer = answer(&self.answer)?;
        let rule = match self.rule.as_str() {
            "imc" => Rule::Imc(imc),
            "posterior" => Rule::Posterior { Ms: self.Ms, answer },
            other => return Err(Error::argument("rule", format!("{other:?}"), "\"imc\" or \"posterior\"")),
        };
        Ok(TunerSettings {
            scheme,
            controller: self.controller.into(),
            tables: match self.tables {
                Some((Kp, Ki)) => Some((Table::new(Kp.0, Kp.1)?, Table::new(Ki.0, Ki.1)?)),
                None => None,
            },
            simulated: Simulated {
                plant: self
                    .simulated_plant
                    .map(|FopdtIn { K, T, L }| (Fopdt { K, T, L }, self.simulated_offset)),
                controller: self.simulated_controller,
                u0: self.u0,
            },
            limits: (
                Fopdt { K: self.K.0, T: self.T.0, L: self.L.0 },
                Fopdt { K: self.K.1, T: self.T.1, L: self.L.1 },
            ),
            sd: self.sd,
            spread: self.spread,
            answered: self.answered,
            settled: self.settled,
            average: self.average,
            merge_rate: self.merge_rate,
            nominal: self.nominal.map(|FopdtIn { K, T, L }| Fopdt { K, T, L }),
            rule,
            writes: self.writes,
            worth: self.worth,
            Ms: self.Ms,
            gate: GateLimits {
                max_change: self.max_change,
                dwell: self.dwell,
                gain_margin: self.gate_gain_margin,
                phase_margin: self.gate_phase_margin,
                saturation: self.saturation,
                excitation: self.excitation,
                stuck: self.stuck,
            },
            u: self.u_limits,
            points: self.points,
            target: self.target,
        })
    }
}

/// `K, T, L`.
type Plant = (f64, f64, f64);

fn plant(model: Fopdt) -> Plant {
    (model.K, model.T, model.L)
}

/// `Kp, Ki`, to the last bit as `plantune.models.PID` has them.
fn two((Kp, Ti, _, _, pure): Gains) -> [f64; 2] {
    [Kp, pure.unwrap_or(Pid::pi(Kp, Ti).Ki)]
}

/// What `plantune.adapt.Decision` is made of.
#[derive(IntoPyObject)]
struct DecisionOut {
    t: f64,
    u: f64,
    y: f64,
    accepted: bool,
    fitted: bool,
    model: Option<Plant>,
    offset: f64,
    sd: [f64; 4],
    delays: Vec<f64>,
    merged: Option<Plant>,
    target: Option<Gains>,
    controller: Gains,
    retuned: bool,
    node: Option<Vec<usize>>,
    new_point: bool,
    alarm: bool,
    changed: bool,
    time_to_target: f64,
    over: Option<(f64, f64, f64)>,
    reasons: Vec<NoteOut>,
}

/// What `plantune.adapt.AdaptLog` is made of.
#[derive(IntoPyObject)]
struct LogOut<'py> {
    model: Matrix<'py>,
    sd: Matrix<'py>,
    offset: Array<'py>,
    delays: Matrix<'py>,
    merged: Matrix<'py>,
    target: Matrix<'py>,
    controller: Matrix<'py>,
    node: Vec<Option<Vec<usize>>>,
    time_to_target: Array<'py>,
    flags: Matrix<'py, bool>,
    reasons: Vec<(usize, Vec<NoteOut>)>,
    u: Array<'py>,
    y: Array<'py>,
}

/// The auto-tuner of one loop: one sample in, one decision out.
///
/// Behind `plantune.adapt.AutoTuner`, which makes its decisions values.
#[pyclass(module = "plantune._core")]
#[derive(Clone)]
struct AutoTuner {
    tuner: Tuner,
    candidates: usize,
}

#[pymethods]
impl AutoTuner {
    #[new]
    fn new(settings: SettingsIn) -> Outcome<Self> {
        let candidates = settings.nk.1.saturating_sub(settings.nk.0) + 1;
        Ok(AutoTuner { tuner: Tuner::new(settings.core()?)?, candidates })
    }

    fn step(
        &mut self,
        t: f64,
        r: f64,
        u: f64,
        y: f64,
        aux: Vec<f64>,
        controller: Option<PidIn>,
    ) -> DecisionOut {
        let controller = controller.map(Pid::from);
        let decision = self.tuner.step(&Sample { t, r, u, y, aux: &aux, controller });
        self.out(&decision)
    }

    /// Axes and flat values of the tables of Kp and Ki.
    fn tables(&self) -> Option<TablesOut> {
        let [Kp, Ki] = self.tuner.tables()?;
        Some((Kp.axes().to_vec(), Kp.values().to_vec(), Ki.values().to_vec()))
    }

    /// Another tuner that has seen the same.
    fn copy(&self) -> Self {
        self.clone()
    }

    /// The next sample does not follow the last one.
    fn gap(&mut self) {
        self.tuner.gap();
    }

    /// `step` for each row, with a gap before every row of `starts` but the first.
    #[allow(clippy::too_many_arguments)]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
        r: PyReadonlyArray1<'py, f64>,
        u: PyReadonlyArray1<'py, f64>,
        y: PyReadonlyArray1<'py, f64>,
        aux: PyReadonlyArray2<'py, f64>,
        starts: Vec<usize>,
    ) -> Outcome<LogOut<'py>> {
        let columns = [&t, &r, &u, &y].map(|x| x.as_array().to_vec());
        let [t, r, u, y] = columns;
        let rows: Vec<Vec<f64>> = aux.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
        let mut log = Log::default();
        py.detach(|| {
            for k in 0..t.len() {
                let aux = rows.get(k).map_or(&[][..], Vec::as_slice);
                if k > 0 && starts.contains(&k) {
                    self.tuner.gap();
                }
                let (t, r, u, y) = (t[k], r[k], u[k], y[k]);
                let decision = self.tuner.step(&Sample { t, r, u, y, aux, controller: None });
                log.push(k, self, &decision);
            }
        });
        Ok(log.out(py, self.candidates)?)
    }
}

impl AutoTuner {
    fn out(&self, d: &Decision) -> DecisionOut {
        let found = self.tuner.identified();
        DecisionOut {
            t: d.t,
            u: d.u,
            y: d.y,
            accepted: d.accepted,
            fitted: d.fitted,
            model: found.as_ref().map(|f| plant(f.model)),
            offset: found.as_ref().map_or(f64::NAN, |f| f.offset),
            sd: found.as_ref().map_or([f64::NAN; 4], |f| f.sd()),
            delays: found.map_or(vec![f64::NAN; self.candidates], |f| f.delays),
            merged: d.merged.map(plant),
            target: d.target.as_ref().map(gains_of),
            controller: gains_of(&d.controller),
            retuned: d.retuned,
            node: d.node.map(|node| node.as_slice().to_vec()),
            new_point: d.new_point,
            alarm: d.alarm,
            changed: d.changed,
            time_to_target: d.time_to_target,
            over: d.over.map(|o| (o.Ms, o.gain_margin, o.phase_margin)),
            reasons: d.reasons.iter().map(|reason| NoteOut::from(&reason.note())).collect(),
        }
    }
}

/// Columns of a log, row after row.
#[derive(Default)]
struct Log {
    model: Vec<f64>,
    sd: Vec<f64>,
    offset: Vec<f64>,
    delays: Vec<f64>,
    merged: Vec<f64>,
    target: Vec<f64>,
    controller: Vec<f64>,
    node: Vec<Option<Vec<usize>>>,
    time_to_target: Vec<f64>,
    flags: Vec<bool>,
    reasons: Vec<(usize, Vec<NoteOut>)>,
    u: Vec<f64>,
    y: Vec<f64>,
}

impl Log {
    fn push(&mut self, row: usize, tuner: &AutoTuner, decision: &Decision) {
        let DecisionOut {
            u,
            y,
            accepted,
            fitted,
            model,
            offset,
            sd,
            delays,
            merged,
            target,
            controller,
            retuned,
            node,
            new_point,
            alarm,
            changed,
            time_to_target,
            reasons,
            ..
        } = tuner.out(decision);
        let three = |plant: Option<Plant>| plant.map_or([f64::NAN; 3], |(K, T, L)| [K, T, L]);
        self.u.push(u);
        self.y.push(y);
        self.model.extend(three(model));
        self.sd.extend(sd);
        self.offset.push(offset);
        self.delays.extend(delays);
        self.merged.extend(three(merged));
        self.target.extend(target.map_or([f64::NAN; 2], two));
        self.controller.extend(two(controller));
        self.node.push(node);
        self.time_to_target.push(time_to_target);
        self.flags.extend([accepted, fitted, retuned, new_point, alarm, changed]);
        if !reasons.is_empty() {
            self.reasons.push((row, reasons));
        }
    }

    fn out(self, py: Python<'_>, candidates: usize) -> PyResult<LogOut<'_>> {
        Ok(LogOut {
            model: matrix(py, self.model, 3)?,
            sd: matrix(py, self.sd, 4)?,
            offset: array(py, self.offset),
            delays: matrix(py, self.delays, candidates)?,
            merged: matrix(py, self.merged, 3)?,
            target: matrix(py, self.target, 2)?,
            controller: matrix(py, self.controller, 2)?,
            node: self.node,
            time_to_target: array(py, self.time_to_target),
            flags: matrix(py, self.flags, 6)?,
            reasons: self.reasons,
            u: array(py, self.u),
            y: array(py, self.y),
        })
    }
}
