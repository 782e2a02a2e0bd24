//! The auto-tuner: one sample in, one decision out.
//!
//! ```text
//! read -> operating point -> identification -> classification -> mean -> merging -> retuning -> gate
//! ```
//!
//! Source 001, 3.7 and figures 3.7-1 to 3.7-5. No clock, no link: what the plant says comes in the [`Sample`], what is to
//! be written goes out in the [`Decision`], with the reasons for what is not done.

use super::classify::{Class, Classifier};
use super::fill::{Fill, Filled};
use super::gate::{Evidence, GateLimits, Watch, gate, step_towards};
use super::identify::{Identified, Identifier, Scheme};
use super::merge::Merge;
use super::operating_point::{Node, OperatingPoint};
use super::reason::{Cause, Parameter, Reason, Reasons};
use super::retune::{Over, Rule, over, plants};
use super::scheduled::Scheduled;
use crate::error::{Error, Result};
use crate::model::{Fopdt, Pid};
use crate::sim::{Actuator, LiveSettings, Table};

/// By how much Ms may exceed its limit: a rule that just keeps it meets other draws of the plant in the gate.
const SLACK: f64 = 0.02;

/// Least margin, as a factor and in degrees, that is asked for; below, none is.
const NO_MARGIN: f64 = 1e-6;

/// Power of time with which information grows. Over 100 engine loops the time from twice the deviation to the one
/// aimed at is then right within a factor of 1.5 in 84 % and 1.02 times too long in the median; with 1, 72 % and 1.2.
const GROWTH: f64 = 1.1;

/// Relative standard deviation from which on K and T are told apart.
const TOLD_APART: f64 = 0.5;

/// What is read at one time; what is missing is NaN.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'s> {
    /// Time, s.
    pub t: f64,
    /// Set point.
    pub r: f64,
    /// Input applied from now on.
    pub u: f64,
    /// Output read now.
    pub y: f64,
    /// Signals that tell the operating point.
    pub aux: &'s [f64],
    /// Settings at work, where they are read.
    pub controller: Option<Pid>,
}

/// How a tuner is set.
#[derive(Clone, Debug)]
pub struct TunerSettings {
    /// Identification.
    pub scheme: Scheme,
    /// The controller at work in the beginning.
    pub controller: Pid,
    /// Tables of its `Kp` and `Ki` over the operating-point signals.
    pub tables: Option<(Table, Table)>,
    /// What is simulated where it is not read.
    pub simulated: Simulated,
    /// Least and largest parameters of an accepted plant.
    pub limits: (Fopdt, Fopdt),
    /// Largest standard deviations of an accepted estimate: of K and T relative to them, of L to `T + L`.
    pub sd: [f64; 3],
    /// The same over the moving window of the last estimates.
    pub spread: [f64; 3],
    /// Least time since u first moved in the window, in units of `T + L`.
    pub answered: f64,
    /// Estimates in the moving window.
    pub settled: usize,
    /// Whether their mean is taken, or the last of them.
    pub average: bool,
    /// Rate of merging, in (0, 1].
    pub merge_rate: f64,
    /// Nominal plant to merge with.
    pub nominal: Option<Fopdt>,
    /// How settings follow from a plant.
    pub rule: Rule,
    /// Whether Kp, Ti and Td may be written; what may not stays as it is, and the loop is judged with it.
    pub writes: [bool; 3],
    /// Least relative change of a gain that is worth writing.
    pub worth: f64,
    /// Largest 95 % quantile of Ms over the uncertainty.
    pub Ms: f64,
    /// Limits of the gate.
    pub gate: GateLimits,
    /// Limits of the actuator.
    pub u: (f64, f64),
    /// Break points and margins of the operating-point signals.
    pub points: Option<(Vec<Vec<f64>>, Vec<f64>)>,
    /// Relative standard deviation aimed at, for the time to target.
    pub target: f64,
}

/// What is simulated where it is not read: source 001, 3.7.2 and 3.7.6.
#[derive(Clone, Copy, Debug, Default)]
pub struct Simulated {
    /// `y = G u + O`, instead of y.
    pub plant: Option<(Fopdt, f64)>,
    /// The controller, instead of u.
    pub controller: bool,
    /// First input, at which the plant is at rest.
    pub u0: f64,
}

/// What the tuner makes of a sample.
#[derive(Clone, Debug)]
pub struct Decision {
    /// Time of the sample, s.
    pub t: f64,
    /// Input from now on and output, read or simulated; NaN where neither.
    pub u: f64,
    /// Output.
    pub y: f64,
    /// Whether an estimate was taken at this sample.
    pub accepted: bool,
    /// Whether there is a new estimate.
    pub fitted: bool,
    /// Merged parameters, from which the settings follow; absent before the first acceptance.
    pub merged: Option<Fopdt>,
    /// What the rule asks for; absent before the first acceptance.
    pub target: Option<Pid>,
    /// Settings to be at work from now on.
    pub controller: Pid,
    /// Whether they changed at this sample.
    pub retuned: bool,
    /// The operating point.
    pub node: Option<Node>,
    /// Whether it begins here.
    pub new_point: bool,
    /// Whether the errors raised an alarm.
    pub alarm: bool,
    /// Whether the plant was found to be another one.
    pub changed: bool,
    /// Expected time until K and T are as sure as aimed at, s; 0 once they are, infinite where never.
    pub time_to_target: f64,
    /// Margins over the uncertainty of the settings that were judged, if any were.
    pub over: Option<Over>,
    /// Why an estimate was not taken, or settings not changed.
    pub reasons: Reasons,
}

/// The auto-tuner of one loop.
#[derive(Clone, Debug)]
pub struct Tuner {
    settings: TunerSettings,
    identifier: Identifier,
    classifier: Classifier,
    merge: Merge,
    watch: Watch,
    points: Option<OperatingPoint>,
    fill: Option<Fill>,
    controller: Scheduled,
    /// Samples since the settings changed.
    held: Option<usize>,
    merged: Option<Fopdt>,
    target: Option<Pid>,
    /// Samples since K and T could be told apart.
    samples: usize,
    lost: bool,
    /// Time of the last sample, s.
    last: Option<f64>,
}

impl TunerSettings {
    fn fill(&self, pid: &Pid) -> Result<Option<Fill>> {
        let Simulated { plant, controller, u0 } = self.simulated;
        if plant.is_none() && !controller {
            return Ok(None);
        }
        let (low, high) = self.u;
        let actuator = Actuator { low, high, ..Actuator::default() };
        let longest = plant.map_or(0.0, |(model, _)| model.L);
        let live = LiveSettings { longest, u0, actuator, ..LiveSettings::new(self.scheme.Ts()) };
        Fill::new(plant, controller.then_some(*pid), live).map(Some)
    }
}

impl Tuner {
    /// With empty windows.
    pub fn new(settings: TunerSettings) -> Result<Self> {
        let (Ts, rows) = (settings.scheme.Ts(), settings.scheme.rows());
        settings.gate.check()?;
        let (low, high) = settings.limits;
        let controller = Pid { Ts: Some(settings.controller.Ts.unwrap_or(Ts)), ..settings.controller };
        if !(settings.target > 0.0) {
            return Err(Error::argument("target", settings.target, "positive"));
        }
        if settings.writes != [true; 3] && controller.Kp == 0.0 {
            return Err(Error::argument("write", "a part", "all settings of a controller without Kp"));
        }
        if !(settings.answered >= 0.0) {
            return Err(Error::argument("answered", settings.answered, "zero or positive"));
        }
        let points = settings.points.as_ref();
        Ok(Tuner {
            identifier: Identifier::new(&settings.scheme)?,
            classifier: Classifier::new(low, high, [f64::INFINITY; 3], settings.settled)?,
            merge: Merge::new(settings.merge_rate, settings.nominal)?,
            watch: Watch::new(rows, settings.u.0, settings.u.1)?,
            points: points.map(|(at, margins)| OperatingPoint::new(at, margins)).transpose()?,
            fill: settings.fill(&controller)?,
            controller: Scheduled::new(&controller, settings.tables.clone())?,
            held: None,
            merged: None,
            target: None,
            samples: 0,
            lost: false,
            last: None,
            settings,
        })
    }

    /// The last estimate of the plant.
    pub fn identified(&self) -> Option<Identified> {
        self.identifier.identified()
    }

    /// The tables of `Kp` and `Ki`, if there are any.
    pub fn tables(&self) -> Option<[&Table; 2]> {
        self.controller.tables()
    }

    /// The next sample does not follow the last one.
    pub fn gap(&mut self) {
        self.lost = true;
    }

    /// Takes a sample and decides.
    pub fn step(&mut self, sample: &Sample) -> Decision {
        self.controller.at(sample.aux);
        if let Some(pid) = &sample.controller {
            self.controller.read(pid);
        }
        self.lost |= self.last.is_some_and(|last| !follows(last, sample.t, self.settings.scheme.Ts()));
        self.last = Some(sample.t);
        let mut decision = self.decision(sample);
        self.held = self.held.map(|samples| samples + 1);
        self.find_point(sample, &mut decision);
        let (u, y) = (decision.u, decision.y);
        let readable = u.is_finite() && y.is_finite();
        self.watch.step(u, y);
        let (still, most) = (self.watch.still(), self.settings.gate.stuck);
        if !readable || still > most {
            self.lost = true;
            decision.reasons.push(if readable {
                Reason::new(Cause::Stuck, still as f64, most as f64)
            } else {
                Reason::of(Cause::NotRead)
            });
        } else {
            if std::mem::take(&mut self.lost) {
                self.identifier.gap();
            }
            self.identify(&mut decision);
        }
        decision.time_to_target = self.time_to_target();
        decision
    }

    /// Nothing decided yet.
    fn decision(&mut self, sample: &Sample) -> Decision {
        let Sample { t, r, u, y, .. } = *sample;
        let read = Filled { r: Some(r), u, y };
        let pid = self.controller.now();
        let Filled { u, y, .. } = match &mut self.fill {
            // A missing signal that is not simulated stays missing.
            Some(fill) => {
                fill.set_controller(&pid).and_then(|()| fill.step(Some(r), Some(u), Some(y))).unwrap_or(read)
            }
            None => read,
        };
        Decision {
            t,
            u,
            y,
            accepted: false,
            fitted: false,
            merged: self.merged,
            target: self.target,
            controller: pid,
            retuned: false,
            node: None,
            new_point: false,
            alarm: false,
            changed: false,
            time_to_target: f64::INFINITY,
            over: None,
            reasons: Reasons::default(),
        }
    }

    fn find_point(&mut self, sample: &Sample, decision: &mut Decision) {
        let Some(points) = &mut self.points else { return };
        let change = points.step(sample.aux);
        (decision.node, decision.new_point) = (change.node, change.new);
        if change.new {
            self.forget();
            (decision.merged, decision.target) = (None, None);
        }
    }

    /// The plant is another one.
    fn forget(&mut self) {
        self.identifier.reset();
        self.classifier.reset();
        self.merge.reset();
        (self.merged, self.target, self.samples) = (None, None, 0);
    }

    fn identify(&mut self, decision: &mut Decision) {
        let news = self.identifier.step(decision.u, decision.y);
        self.samples = (self.samples + 1).min(self.settings.scheme.rows());
        (decision.fitted, decision.alarm, decision.changed) = (news.fitted, news.alarm, news.changed);
        if news.alarm {
            self.classifier.reset();
        }
        if news.changed {
            self.merge.reset();
            self.samples = 0;
        }
        if news.fitted {
            if self.identifier.identified().is_none_or(|estimate| !(worst(&estimate) < TOLD_APART)) {
                self.samples = 0;
            }
            self.judge(decision);
        }
    }

    /// Classification, mean, merging, retuning.
    fn judge(&mut self, decision: &mut Decision) {
        let Some(estimate) = self.identifier.identified() else { return };
        if let Some(reason) = self.uncertain(&estimate) {
            self.classifier.reset();
            decision.reasons.push(reason);
            return;
        }
        match self.classifier.step(&estimate.model) {
            Class::Accepted(mean, sd) => match self.unsettled(&mean, sd).or_else(|| self.unanswered(&mean)) {
                None if self.settings.average => self.accept(&mean, &estimate, decision),
                None => self.accept(&estimate.model, &estimate, decision),
                Some(reason) => decision.reasons.push(reason),
            },
            class => {
                if let Some(reason) = class.reason() {
                    decision.reasons.push(reason);
                }
            }
        }
    }

    /// Why the estimate is not sure enough.
    fn uncertain(&self, estimate: &Identified) -> Option<Reason> {
        if self.identifier.is_judging() {
            return Some(Reason::of(Cause::Judging));
        }
        if estimate.outside {
            return Some(Reason::new(Cause::DelayOutside, estimate.model.L, estimate.model.L));
        }
        let [K, T, L, _] = estimate.sd();
        beyond(&estimate.model, [K, T, L], self.settings.sd, Cause::Uncertain)
    }

    /// Why the answer has not come to its end. Of less the gain is extrapolated: a drift looks like another gain, and a
    /// slow mode is not seen at all.
    fn unanswered(&self, plant: &Fopdt) -> Option<Reason> {
        let since = self.seconds_of(Some(self.watch.since_move(self.identifier.rows())));
        let least = self.settings.answered * (plant.T + plant.L);
        (since < least).then_some(Reason::new(Cause::Unanswered, since, least))
    }

    /// Why the last estimates are too far apart.
    fn unsettled(&self, mean: &Fopdt, sd: [f64; 3]) -> Option<Reason> {
        beyond(mean, sd, self.settings.spread, Cause::Unsettled)
    }

    fn accept(&mut self, model: &Fopdt, estimate: &Identified, decision: &mut Decision) {
        decision.accepted = true;
        let merged = self.merge.step(model);
        self.merged = Some(merged);
        decision.merged = self.merged;
        if self.settings.rule.is_dear() && self.target.is_some() && self.is_dwelling(&merged) {
            return; // the gate would not let it through
        }
        let target = match self.settings.rule.on(&merged, &estimate.modes, &self.controller.present()) {
            Ok(target) => target,
            Err(_) => return decision.reasons.push(Reason::of(Cause::NoSettings)),
        };
        self.target = Some(target);
        decision.target = self.target;
        self.retune(&merged, estimate, &target, decision);
    }

    /// Towards the target, if it is worth it and the gate lets it through.
    fn retune(&mut self, merged: &Fopdt, estimate: &Identified, target: &Pid, decision: &mut Decision) {
        let present = self.controller.present();
        let target = &writable(&present, target, self.settings.writes);
        if !is_worth(&present, target, self.settings.worth) {
            return;
        }
        let limits = self.settings.gate;
        let all = self.evidence();
        // What costs nothing to know first.
        let first = Evidence { saturated: 0.0, ..all };
        decision.reasons = gate(&present, target, merged, &first, &limits).reasons;
        if decision.reasons.refuse() {
            return;
        }
        let (step, _) = step_towards(&present, target, limits.max_change);
        let margins = match self.over(estimate, &present, &step) {
            Ok(over) => over,
            Err(_) => return decision.reasons.push(Reason::of(Cause::NoSettings)),
        };
        decision.over = margins;
        // A part of the way out of a bad loop may still be outside the margins, and such a loop drives u to its
        // limits: both are no reason to stay in it.
        if !margins.is_some_and(|over| over.worse < 1.0) {
            let (gain_margin, phase_margin) =
                margins.map_or((f64::INFINITY, f64::INFINITY), |over| (over.gain_margin, over.phase_margin));
            let evidence = Evidence { gain_margin, phase_margin, ..all };
            decision.reasons = gate(&present, target, merged, &evidence, &limits).reasons;
            let Ms = margins.map_or(0.0, |over| over.Ms);
            if !(Ms <= (1.0 + SLACK) * self.settings.Ms) {
                decision.reasons.push(Reason::new(Cause::Sensitivity, Ms, self.settings.Ms));
            }
        }
        if decision.reasons.refuse() {
            return;
        }
        match self.controller.set(&step) {
            Ok(()) => {
                self.held = Some(0);
                (decision.controller, decision.retuned) = (step, true);
            }
            Err(_) => decision.reasons.push(Reason::of(Cause::NoOperatingPoint)),
        }
    }

    /// Whether the last change is too recent.
    fn is_dwelling(&self, plant: &Fopdt) -> bool {
        self.seconds_of(self.held) < self.dwell(plant)
    }

    /// Least time between changes, s.
    fn dwell(&self, plant: &Fopdt) -> f64 {
        self.settings.gate.dwell * (plant.T + plant.L)
    }

    /// Time since something that may never have been, s.
    fn seconds_of(&self, since: Option<usize>) -> f64 {
        since.map_or(f64::INFINITY, |samples| samples as f64 * self.settings.scheme.Ts())
    }

    /// What a step does over the plants that are possible; None where no margin is asked for.
    fn over(&self, estimate: &Identified, present: &Pid, step: &Pid) -> Result<Option<Over>> {
        let gate = &self.settings.gate;
        if self.settings.Ms.is_infinite() && gate.gain_margin.max(gate.phase_margin) <= NO_MARGIN {
            return Ok(None);
        }
        over(&plants(&estimate.modes), present, step).map(Some)
    }

    /// What the gate has to know, but for the margins.
    fn evidence(&self) -> Evidence {
        Evidence {
            since_change: self.seconds_of(self.held),
            gain_margin: f64::INFINITY,
            phase_margin: f64::INFINITY,
            saturated: self.watch.saturated(),
            travel: self.watch.travel(),
            largest_travel: self.watch.largest_travel(),
            still: self.watch.still(),
        }
    }

    /// Information grows with the rows, `1/var(t) ~ t^1.1`, as long as the window holds them.
    ///
    /// Time counts from where K and T could be told apart: what came before taught nothing of either alone. It grows
    /// a little faster than the rows, for delay and state become known meanwhile.
    fn time_to_target(&self) -> f64 {
        let Some(estimate) = self.identifier.identified() else { return f64::INFINITY };
        let seconds = |samples: usize| samples as f64 * self.settings.scheme.Ts();
        let (t, held) = (seconds(self.samples), seconds(self.settings.scheme.rows()));
        let more = t * ((worst(&estimate) / self.settings.target).powf(2.0 / GROWTH) - 1.0);
        match more {
            _ if self.samples == 0 || more > held - t => f64::INFINITY,
            _ => more.max(0.0),
        }
    }
}

/// Whether a sample is the next one: half a sample time is jitter, more is a gap.
fn follows(last: f64, t: f64, Ts: f64) -> bool {
    (t - last - Ts).abs() <= 0.5 * Ts
}

/// The larger of the relative standard deviations of K and T.
fn worst(estimate: &Identified) -> f64 {
    let sd = estimate.sd();
    (sd[0] / estimate.model.K.abs()).max(sd[1] / estimate.model.T)
}

/// The first of K, T, L whose standard deviation is beyond its limit: relative to K and T, and to `T + L`.
fn beyond(
    model: &Fopdt,
    sd: [f64; 3],
    limits: [f64; 3],
    cause: impl Fn(Parameter) -> Cause,
) -> Option<Reason> {
    let Fopdt { K, T, L } = *model;
    let relative = [sd[0] / K.abs(), sd[1] / T, sd[2] / (T + L)];
    let worst = (0..3).find(|&i| !(relative[i] <= limits[i]))?;
    let parameter = [Parameter::K, Parameter::T, Parameter::L][worst];
    Some(Reason::new(cause(parameter), relative[worst], limits[worst]))
}

/// The target as far as it may be written, beside what stays.
fn writable(present: &Pid, target: &Pid, [Kp, Ti, Td]: [bool; 3]) -> Pid {
    if Kp && Ti && Td {
        return *target;
    }
    let gain = if Kp { target.Kp } else { present.Kp };
    let derivative = if Td { target } else { present };
    Pid {
        Kp: gain,
        Ki: gain / if Ti { target.Ti() } else { present.Ti() },
        Td: derivative.Td,
        Tf: derivative.Tf,
        ..*target
    }
}

/// Whether a gain changes by enough to be written.
fn is_worth(present: &Pid, target: &Pid, least: f64) -> bool {
    let moved = |now: f64, wanted: f64| (wanted / now - 1.0).abs();
    !(moved(present.Kp, target.Kp).max(moved(present.Ki, target.Ki)) < least)
}
