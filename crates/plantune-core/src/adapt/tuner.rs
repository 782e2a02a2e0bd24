//! The auto-tuner: one sample in, one decision out.
//!
//! ```text
//! read -> operating point -> identification -> classification -> mean -> merging -> retuning -> gate
//! ```
//!
//! Source 001, 3.7 and figures 3.7-1 to 3.7-5. No clock, no link: what the plant says comes in the [`Sample`], what is to
//! be written goes out in the [`Decision`], with the reasons for what is not done.

use super::classify::{Class, Classifier};
use super::gate::{Evidence, GateLimits, Watch, gate, step_towards};
use super::identify::{Identified, Identifier, Scheme};
use super::merge::Merge;
use super::operating_point::{Node, OperatingPoint};
use super::reason::{Cause, Parameter, Reason, Reasons};
use super::retune::{Over, Rule, over, plants};
use crate::error::{Error, Result};
use crate::model::{Fopdt, Pid};

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
}

/// How a tuner is set.
#[derive(Clone, Debug)]
pub struct TunerSettings {
    /// Identification.
    pub scheme: Scheme,
    /// The controller at work in the beginning.
    pub controller: Pid,
    /// Least and largest parameters of an accepted plant.
    pub limits: (Fopdt, Fopdt),
    /// Largest standard deviations of an accepted estimate: of K and T relative to them, of L to `T + L`.
    pub sd: [f64; 3],
    /// The same over the moving window of the last estimates.
    pub spread: [f64; 3],
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

/// What the tuner makes of a sample.
#[derive(Clone, Debug)]
pub struct Decision {
    /// Time of the sample, s.
    pub t: f64,
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
    controller: Pid,
    /// Samples since the settings changed.
    held: Option<usize>,
    merged: Option<Fopdt>,
    target: Option<Pid>,
    /// Samples of data behind the estimate.
    samples: usize,
    lost: bool,
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
        let points = settings.points.as_ref();
        Ok(Tuner {
            identifier: Identifier::new(&settings.scheme)?,
            classifier: Classifier::new(low, high, [f64::INFINITY; 3], settings.settled)?,
            merge: Merge::new(settings.merge_rate, settings.nominal)?,
            watch: Watch::new(rows, settings.u.0, settings.u.1)?,
            points: points.map(|(at, margins)| OperatingPoint::new(at, margins)).transpose()?,
            controller,
            held: None,
            merged: None,
            target: None,
            samples: 0,
            lost: false,
            settings,
        })
    }

    /// The last estimate of the plant.
    pub fn identified(&self) -> Option<Identified> {
        self.identifier.identified()
    }

    /// The next sample does not follow the last one.
    pub fn gap(&mut self) {
        self.lost = true;
    }

    /// Takes a sample and decides.
    pub fn step(&mut self, sample: &Sample) -> Decision {
        let mut decision = self.decision(sample.t);
        self.held = self.held.map(|samples| samples + 1);
        self.find_point(sample, &mut decision);
        let readable = sample.u.is_finite() && sample.y.is_finite();
        self.watch.step(sample.u, sample.y);
        let stuck = self.watch.still() > self.settings.gate.stuck;
        if !readable || stuck {
            self.lost = true;
        } else {
            if std::mem::take(&mut self.lost) {
                self.identifier.gap();
            }
            self.identify(sample, &mut decision);
        }
        decision.time_to_target = self.time_to_target();
        decision
    }

    fn decision(&self, t: f64) -> Decision {
        Decision {
            t,
            accepted: false,
            fitted: false,
            merged: self.merged,
            target: self.target,
            controller: self.controller,
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
        }
    }

    /// The plant is another one.
    fn forget(&mut self) {
        self.identifier.reset();
        self.classifier.reset();
        self.merge.reset();
        (self.merged, self.target, self.samples) = (None, None, 0);
    }

    fn identify(&mut self, sample: &Sample, decision: &mut Decision) {
        let news = self.identifier.step(sample.u, sample.y);
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
            Class::Accepted(mean, sd) => match self.spread(&mean, &sd) {
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
            return Some(Reason::new(Cause::Judging, 0.0, 0.0));
        }
        let sd = estimate.sd();
        let Fopdt { K, T, L } = estimate.model;
        let relative = [sd[0] / K.abs(), sd[1] / T, sd[2] / (T + L)];
        let parameters = [Parameter::K, Parameter::T, Parameter::L];
        let limits = self.settings.sd;
        let worst = (0..3).find(|&i| !(relative[i] <= limits[i]))?;
        Some(Reason::new(Cause::Uncertain(parameters[worst]), relative[worst], limits[worst]))
    }

    fn spread(&self, mean: &Fopdt, sd: &[f64; 3]) -> Option<Reason> {
        let relative = [sd[0] / mean.K.abs(), sd[1] / mean.T, sd[2] / (mean.T + mean.L)];
        let parameters = [Parameter::K, Parameter::T, Parameter::L];
        let limits = self.settings.spread;
        let worst = (0..3).find(|&i| !(relative[i] <= limits[i]))?;
        Some(Reason::new(Cause::Unsettled(parameters[worst]), relative[worst], limits[worst]))
    }

    fn accept(&mut self, model: &Fopdt, estimate: &Identified, decision: &mut Decision) {
        decision.accepted = true;
        let merged = self.merge.step(model);
        self.merged = Some(merged);
        decision.merged = self.merged;
        let target = match self.settings.rule.on(&merged, &estimate.modes, &self.controller) {
            Ok(target) => target,
            Err(_) => return decision.reasons.push(Reason::new(Cause::NoSettings, 0.0, 0.0)),
        };
        self.target = Some(target);
        decision.target = self.target;
        self.retune(&merged, estimate, &target, decision);
    }

    /// Towards the target, if it is worth it and the gate lets it through.
    fn retune(&mut self, merged: &Fopdt, estimate: &Identified, target: &Pid, decision: &mut Decision) {
        let present = self.controller;
        let moved = |now: f64, wanted: f64| (wanted / now - 1.0).abs();
        let most = moved(present.Kp, target.Kp).max(moved(present.Ki, target.Ki));
        if most < self.settings.worth {
            return;
        }
        let Ts = self.settings.scheme.Ts();
        let since_change = self.held.map_or(f64::INFINITY, |samples| samples as f64 * Ts);
        let mut evidence = Evidence {
            since_change,
            gain_margin: f64::INFINITY,
            phase_margin: f64::INFINITY,
            saturated: self.watch.saturated(),
            travel: self.watch.travel(),
            largest_travel: self.watch.largest_travel(),
            still: self.watch.still(),
        };
        let gate_limits = self.settings.gate;
        let first = gate(&present, target, merged, &evidence, &gate_limits);
        if first.reasons.refuse() {
            decision.reasons = first.reasons;
            return;
        }
        let (step, _) = step_towards(&present, target, gate_limits.max_change);
        let Ok(over) = over(&plants(&estimate.modes), &present, &step) else {
            return decision.reasons.push(Reason::new(Cause::NoSettings, 0.0, 0.0));
        };
        decision.over = Some(over);
        // A part of the way out of a bad loop may still be outside the margins.
        let better = over.worse < 1.0;
        if !better {
            (evidence.gain_margin, evidence.phase_margin) = (over.gain_margin, over.phase_margin);
        }
        let gated = gate(&present, target, merged, &evidence, &gate_limits);
        decision.reasons = gated.reasons;
        if !better && !(over.Ms <= self.settings.Ms) {
            decision.reasons.push(Reason::new(Cause::Sensitivity, over.Ms, self.settings.Ms));
        }
        if decision.reasons.refuse() {
            return;
        }
        self.controller = step;
        self.held = Some(0);
        (decision.controller, decision.retuned) = (step, true);
    }

    /// Information grows with the rows: `var(t) = var t_now / t`.
    fn time_to_target(&self) -> f64 {
        let Some(estimate) = self.identifier.identified() else { return f64::INFINITY };
        let sd = estimate.sd();
        let worst = (sd[0] / estimate.model.K.abs()).max(sd[1] / estimate.model.T);
        let t = self.samples as f64 * self.settings.scheme.Ts();
        (t * ((worst / self.settings.target).powi(2) - 1.0)).max(0.0)
    }
}
