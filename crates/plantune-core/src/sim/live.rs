//! A first-order plant and its loop, one sample at a time, whose parameters and settings may change at any.
//!
//! ```text
//! y(k) = K e^(-L s) / (T s + 1) u + O, read at sample k with noise n(k)
//! u(k) = C(r(k), y(k) + n(k)), within reach, acts from sample k on
//! ```
//!
//! [`super::VaryingPlant`] is this plant under parameters known beforehand, and [`super::closed_loop`] this
//! loop under signals known beforehand: the same numbers.

use super::actuator::{Actuator, quantised};
use super::arc::{Decay, Shape};
use super::controller::{AntiWindup, SampledPid};
use super::indices::Watch;
use super::plant::delay_of;
use crate::error::{Error, Result};
use crate::model::{Fopdt, Fraction, Pid, check_fopdt};

/// A first-order plant that can be changed while it runs.
///
/// ```
/// use plantune_core::model::Fopdt;
/// use plantune_core::sim::LivePlant;
///
/// let mut plant = LivePlant::new(&Fopdt { K: 2.0, T: 1.0, L: 0.1 }, 20.0, 0.5, 0.1, 0.0)?;
/// assert_eq!((plant.step(1.0), plant.step(1.0) > 20.1), (20.0, true));
/// plant.set(&Fopdt { K: 3.0, T: 1.0, L: 0.3 }, 50.0)?;
/// assert!(plant.step(1.0) > 50.0);
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LivePlant {
    model: Fopdt,
    offset: f64,
    x: f64,
    /// The last inputs, as many as the longest delay needs; the newest at `newest`.
    past: Vec<f64>,
    newest: usize,
    Ts: f64,
}

impl LivePlant {
    /// At rest at the input `u0`; its dead time may later grow to `longest`, s.
    pub fn new(model: &Fopdt, offset: f64, longest: f64, Ts: f64, u0: f64) -> Result<Self> {
        if !(Ts > 0.0 && Ts.is_finite()) {
            return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
        }
        check_fopdt(model)?;
        for (name, x) in [("offset", offset), ("u0", u0)] {
            if !x.is_finite() {
                return Err(Error::argument(name, x, "finite"));
            }
        }
        let past = vec![u0; delay_of(longest.max(model.L), Ts)?.m + 2];
        Ok(LivePlant { model: *model, offset, x: model.K * u0, past, newest: 0, Ts })
    }

    /// Goes on under other parameters and with another offset.
    pub fn set(&mut self, model: &Fopdt, offset: f64) -> Result<()> {
        check_fopdt(model)?;
        if !offset.is_finite() {
            return Err(Error::argument("offset", offset, "finite"));
        }
        if Fraction::of(model.L, self.Ts).m + 2 > self.past.len() {
            let longest = (self.past.len() - 2) as f64 * self.Ts;
            return Err(Error::argument("L", model.L, &format!("below {:.4} s", longest + self.Ts)));
        }
        (self.model, self.offset) = (*model, offset);
        Ok(())
    }

    /// The parameters and the offset now.
    pub fn parameters(&self) -> (Fopdt, f64) {
        (self.model, self.offset)
    }

    /// Begins anew at rest at the input `u0`.
    pub fn rest(&mut self, u0: f64) -> f64 {
        self.past.fill(u0);
        self.x = self.model.K * u0;
        self.output()
    }

    /// Takes as offset what makes the output of this sample `y`.
    pub fn agree(&mut self, y: f64) {
        self.offset = y - self.x;
    }

    /// Goes on from the output `y`, with the offset it has.
    pub fn move_to(&mut self, y: f64) {
        self.x = y - self.offset;
    }

    /// Output at this sample.
    pub fn output(&self) -> f64 {
        self.x + self.offset
    }

    /// Holds the input at `v` for a sample and returns the output at the next one. Allocates nothing.
    pub fn step(&mut self, v: f64) -> f64 {
        self.run(v, &mut ());
        self.output()
    }

    /// The same, watched.
    pub(super) fn run(&mut self, v: f64, watch: &mut impl Watch) {
        self.newest = (self.newest + 1) % self.past.len();
        self.past[self.newest] = v;
        let Fraction { m, f } = Fraction::of(self.model.L, self.Ts);
        let (older, newer) = (self.ago(m + 1), self.ago(m));
        self.piece(f, older, watch);
        self.piece(self.Ts - f, newer, watch);
    }

    /// New parameters that are known to be sound, and to fit.
    pub(super) fn set_model(&mut self, model: Fopdt) {
        self.model = model;
    }

    /// A new offset that is known to be finite.
    pub(super) fn set_offset(&mut self, offset: f64) {
        self.offset = offset;
    }

    /// `x`, and the inputs that still act, the oldest first.
    pub fn state(&self) -> (f64, Vec<f64>) {
        let past = (1..=self.past.len()).map(|k| self.past[(self.newest + k) % self.past.len()]);
        (self.x, past.collect())
    }

    /// Goes on from what [`LivePlant::state`] gave.
    pub fn resume(&mut self, x: f64, past: Vec<f64>) -> Result<()> {
        if past.len() != self.past.len() || !x.is_finite() || past.iter().any(|u| !u.is_finite()) {
            return Err(Error::argument("state", format!("{} inputs", past.len()), "of this plant"));
        }
        (self.newest, self.x, self.past) = (past.len() - 1, x, past);
        Ok(())
    }

    /// The input of `samples` ago.
    fn ago(&self, samples: usize) -> f64 {
        self.past[(self.newest + self.past.len() - samples) % self.past.len()]
    }

    /// Moves `t` seconds under the input `v`.
    fn piece(&mut self, t: f64, v: f64, watch: &mut impl Watch) {
        if t > 0.0 {
            let (goal, begin, steps) = (self.model.K * v, self.x, t / self.model.T);
            self.x = goal + (begin - goal) * (-steps).exp();
            watch.arc(t, Decay::new(begin + self.offset, self.x + self.offset, Shape::of(steps)));
        }
    }
}

/// What a loop is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiveSettings {
    /// Sample time, s.
    pub Ts: f64,
    /// Longest dead time that the plant may get, s.
    pub longest: f64,
    /// Input at which it begins at rest.
    pub u0: f64,
    /// Limits, rate, dead band and step of u.
    pub actuator: Actuator,
    /// Step of the y that the controller reads; 0 for none.
    pub y_step: f64,
    /// What the integral does at a limit.
    pub anti_windup: AntiWindup,
}

impl LiveSettings {
    /// At rest at the input 0, without limits.
    pub fn new(Ts: f64) -> Self {
        LiveSettings {
            Ts,
            longest: 0.0,
            u0: 0.0,
            actuator: Actuator::default(),
            y_step: 0.0,
            anti_windup: AntiWindup::Clamping,
        }
    }
}

/// Such a plant under a sampled PID.
///
/// ```
/// use plantune_core::model::{Fopdt, Pid};
/// use plantune_core::sim::{LiveLoop, LiveSettings};
///
/// let plant = Fopdt { K: 2.0, T: 1.0, L: 0.1 };
/// let mut live = LiveLoop::new(&plant, 0.0, &Pid::pi(0.5, 1.0), LiveSettings::new(0.1))?;
/// for _ in 0..200 {
///     live.step(3.0, 0.0)?;
/// }
/// live.set(&Pid::pi(1.0, 1.0))?; // without a bump
/// let (u, y) = live.step(3.0, 0.0)?;
/// assert!((u - 1.5).abs() < 1e-6 && (y - 3.0).abs() < 1e-6);
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct LiveLoop {
    plant: LivePlant,
    pid: Pid,
    settings: LiveSettings,
    controller: SampledPid,
    /// Position of the actuator since the last sample; none before the first.
    position: Option<f64>,
}

impl LiveLoop {
    /// In equilibrium at the input `u0`.
    pub fn new(plant: &Fopdt, offset: f64, pid: &Pid, settings: LiveSettings) -> Result<Self> {
        let settings = LiveSettings { longest: settings.longest.max(plant.L), ..settings };
        let LiveSettings { Ts, longest, u0, actuator, y_step, anti_windup } = settings;
        let plant = LivePlant::new(plant, offset, longest, Ts, u0)?;
        check_controller(pid, Ts)?;
        actuator.check(u0)?;
        anti_windup.check(Some(Ts))?;
        if !(y_step >= 0.0 && y_step.is_finite()) {
            return Err(Error::argument("y_step", y_step, "zero or positive"));
        }
        let y0 = quantised(plant.output(), y_step);
        let controller = SampledPid::new(pid, Ts, actuator, anti_windup, y0, u0);
        Ok(LiveLoop { plant, pid: *pid, settings, controller, position: None })
    }

    /// Goes to the next sample and returns the controller output `u` from there on, and the `y` read there.
    ///
    /// The first call reads the sample at which the loop is in equilibrium. Allocates nothing.
    pub fn step(&mut self, r: f64, noise: f64) -> Result<(f64, f64)> {
        self.advance(r, noise, None)
    }

    /// The same in manual: the output is `u` within reach, and automatic goes on from there.
    pub fn hold(&mut self, r: f64, noise: f64, u: f64) -> Result<(f64, f64)> {
        self.advance(r, noise, Some(u))
    }

    fn advance(&mut self, r: f64, noise: f64, manual: Option<f64>) -> Result<(f64, f64)> {
        for (name, x) in [("r", r), ("noise", noise), ("u", manual.unwrap_or(0.0))] {
            if !x.is_finite() {
                return Err(Error::argument(name, x, "finite"));
            }
        }
        if let Some(position) = self.position {
            self.plant.step(position);
        }
        let y = quantised(self.plant.output() + noise, self.settings.y_step);
        let wanted = match manual {
            Some(u) => self.controller.hold(r, y, 0.0, u),
            None => self.controller.step(r, y, 0.0),
        };
        let before = self.position.unwrap_or(self.settings.u0);
        let (u, position) = self.settings.actuator.position(wanted, before);
        self.position = Some(position);
        Ok((u, y))
    }

    /// Other controller settings, from the next sample on, without a bump.
    pub fn set(&mut self, pid: &Pid) -> Result<()> {
        check_controller(pid, self.settings.Ts)?;
        self.controller.set(pid);
        self.pid = *pid;
        Ok(())
    }

    /// Other parameters of the plant: they bring it to the next sample.
    pub fn set_plant(&mut self, plant: &Fopdt, offset: f64) -> Result<()> {
        self.plant.set(plant, offset)
    }

    /// The controller settings at work.
    pub fn pid(&self) -> &Pid {
        &self.pid
    }

    /// The plant.
    pub fn plant(&self) -> &LivePlant {
        &self.plant
    }

    /// What it was made with.
    pub fn settings(&self) -> &LiveSettings {
        &self.settings
    }

    /// All that goes on from sample to sample.
    pub fn state(&self) -> LiveState {
        let (x, past) = self.plant.state();
        LiveState { x, past, controller: self.controller.state(), position: self.position }
    }

    /// Goes on from such a state; plant and controller settings are those of this loop.
    pub fn resume(&mut self, state: LiveState) -> Result<()> {
        if state.controller.iter().chain(&state.position).any(|x| !x.is_finite()) {
            return Err(Error::argument("state", "not finite", "of this loop"));
        }
        self.plant.resume(state.x, state.past)?;
        self.controller.resume(state.controller);
        self.position = state.position;
        Ok(())
    }
}

/// The memory of a loop.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveState {
    /// Of the plant.
    pub x: f64,
    /// Inputs that still act, the oldest first.
    pub past: Vec<f64>,
    /// Of the controller.
    pub controller: [f64; 6],
    /// Of the actuator, if there was a sample.
    pub position: Option<f64>,
}

fn check_controller(pid: &Pid, Ts: f64) -> Result<()> {
    pid.check()?;
    match pid.Ts {
        Some(own) if (own - Ts).abs() > 1e-9 * Ts => {
            Err(Error::argument("Ts", own, &format!("{Ts} s, the sample time of the loop")))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::sim::{ClosedLoopSettings, LoopPlant, Varying, closed_loop_into};

    /// Against the loop under signals and parameters known beforehand: the same numbers.
    #[test]
    fn a_live_loop_is_the_closed_loop() {
        let N = 400;
        let of = |f: fn(usize) -> f64| (0..N).map(f).collect::<Vec<f64>>();
        let (K, T) = (of(|k| if k < 150 { -5.939 } else { -9.0 }), of(|k| 0.15 + 1e-4 * k as f64));
        let (L, offset) = (of(|k| if k < 250 { 0.1 } else { 0.147 }), of(|k| 583.0 - 0.1 * k as f64));
        let varying = Varying { K: &K, T: &T, L: &L, offset: &offset };
        let r = of(|k| 400.0 + 50.0 * f64::from(k as u8 / 20 % 2));
        let (noise, Ts, u0) = (white(N, 6), 0.02, 30.0);
        let (pid, next) = (Pid::pi(-0.018, 0.0532), Pid::pi(-0.13, 0.149));
        let [pid, next] = [pid, next].map(|pid| Pid { Ts: Some(Ts), ..pid });
        let actuator = Actuator { low: 20.0, high: 45.0, rate: 100.0, dead_band: 0.01, step: 0.0 };
        let known = ClosedLoopSettings {
            noise: Some(&noise),
            settings: &[(200, next)],
            u0,
            actuator,
            y_step: 0.01,
            ..ClosedLoopSettings::new(Ts, &r)
        };
        let (mut y_known, mut u_known) = (vec![0.0; N + 1], vec![0.0; N + 1]);
        closed_loop_into(LoopPlant::Varying(&varying), &pid, &known, &mut y_known, &mut u_known)
            .expect("a loop");
        let made = LiveSettings { u0, actuator, y_step: 0.01, longest: 0.2, ..LiveSettings::new(Ts) };
        let (plant, O) = varying.at(0);
        let mut live = LiveLoop::new(&plant, O, &pid, made).expect("a loop");
        for k in 0..N {
            let (plant, O) = varying.at(k);
            live.set_plant(&plant, O).expect("sound");
            if k == 200 {
                live.set(&next).expect("sound");
            }
            if k == 300 {
                let made = *live.settings();
                let mut other = LiveLoop::new(&plant, O, &next, made).expect("a loop");
                other.resume(live.state()).expect("its state");
                live = other;
            }
            let (u, y) = live.step(r[k], noise[k]).expect("sound");
            assert_eq!((u, y), (u_known[k], quantised(y_known[k] + noise[k], 0.01)), "{k}");
        }
    }

    #[test]
    fn what_is_no_loop_is_refused() {
        let (plant, pid) = (Fopdt { K: 1.0, T: 1.0, L: 0.25 }, Pid::pi(1.0, 1.0));
        let made = LiveSettings::new(0.1);
        let refused = |plant: &Fopdt, pid: &Pid, made| {
            LiveLoop::new(plant, 0.0, pid, made).expect_err("refused").code()
        };
        assert_eq!(refused(&Fopdt { T: -1.0, ..plant }, &pid, made), "M12");
        assert_eq!(refused(&plant, &Pid { Ts: Some(0.2), ..pid }, made), "U01");
        assert_eq!(refused(&plant, &pid, LiveSettings { Ts: 0.0, ..made }), "U01");
        assert_eq!(refused(&plant, &pid, LiveSettings { u0: f64::NAN, ..made }), "U01");
        let mut live = LiveLoop::new(&plant, 0.0, &pid, made).expect("a loop");
        assert!(live.set_plant(&Fopdt { L: 0.29, ..plant }, 0.0).is_ok());
        assert_eq!(live.set_plant(&Fopdt { L: 0.3, ..plant }, 0.0).expect_err("too long").code(), "U01");
        assert_eq!(live.hold(1.0, 0.0, 7.0).expect("in manual").0, 7.0);
        assert!((live.step(1.0, 0.0).expect("from there").0 - 7.0).abs() < 0.2);
        assert_eq!(live.step(f64::NAN, 0.0).expect_err("no set point").code(), "U01");
    }
}
