//! Whether new controller settings may be written, and how far they go at once.
//!
//! ```text
//! C01  each of Kp, Ki changes by a factor of max_change at most: further on, both go the same part of the way
//!      now (wanted/now)^share
//! C02  each is a number, of the sign of the present one
//! A05  at least dwell (T + L) since the last change
//! C07  gain and phase margin over the uncertainty at least these
//! M03  u at its limits in this share of the window at most
//! X01  u moves, compared with the most that it moved
//! D18  y does not keep its value while u moves
//! ```
//!
//! METHODS 7 and the codes of the bad-input catalogue. [`Watch`] measures what the window shows, [`gate`] judges.

use super::reason::{Cause, Parameter, Reason, Reasons};
use crate::error::{Error, Result};
use crate::model::{Fopdt, Pid};

/// Share of its travel by which u must move for y to have to answer, as in `analyze`.
const MOVE: f64 = 0.1;

/// Largest factor that is told from a gain that vanishes.
const FARTHEST: f64 = 1e9;

/// What the gate allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GateLimits {
    /// Largest factor by which Kp or Ki changes per step, above 1.
    pub max_change: f64,
    /// Least time between changes, in units of `T + L`.
    pub dwell: f64,
    /// Least gain margin over the uncertainty, a factor.
    pub gain_margin: f64,
    /// Least phase margin over the uncertainty, degrees.
    pub phase_margin: f64,
    /// Largest share of the window that u may be at a limit.
    pub saturation: f64,
    /// Least travel of u within the window, as a share of its largest.
    pub excitation: f64,
    /// Most samples that y may keep its value while u moves.
    pub stuck: usize,
}

impl Default for GateLimits {
    fn default() -> Self {
        GateLimits {
            max_change: 2.0,
            dwell: 5.0,
            gain_margin: 2.0,
            phase_margin: 45.0,
            saturation: 0.05,
            excitation: 0.02,
            stuck: 50,
        }
    }
}

impl GateLimits {
    /// Refuses limits that are none.
    pub fn check(&self) -> Result<()> {
        if !(self.max_change > 1.0) {
            return Err(Error::argument("max_change", self.max_change, "a factor above 1"));
        }
        for (name, x) in [
            ("dwell", self.dwell),
            ("gain_margin", self.gain_margin),
            ("phase_margin", self.phase_margin),
            ("saturation", self.saturation),
            ("excitation", self.excitation),
        ] {
            if !(x >= 0.0) {
                return Err(Error::argument(name, x, "zero or positive"));
            }
        }
        Ok(())
    }
}

/// What is known when a change is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// Time since the last change, s; infinite before the first.
    pub since_change: f64,
    /// Least gain margin over the uncertainty, a factor.
    pub gain_margin: f64,
    /// Least phase margin over the uncertainty, degrees.
    pub phase_margin: f64,
    /// Share of the window that u is at a limit.
    pub saturated: f64,
    /// Travel of u within the window, and the largest travel it ever had.
    pub travel: f64,
    /// The largest travel of u.
    pub largest_travel: f64,
    /// Samples for which y has kept its value after u moved.
    pub still: usize,
}

/// The answer of the gate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gated {
    /// What to write: the target, or a part of the way to it; none where a reason forbids it.
    pub controller: Option<Pid>,
    /// Why not, or not at once.
    pub reasons: Reasons,
}

/// Judges a change from the `present` controller to the `target`, tuned on `model`.
///
/// The margins in the evidence are those of what would be written: [`step_towards`] gives it beforehand.
///
/// ```
/// use plantune_core::adapt::{Evidence, GateLimits, gate};
/// use plantune_core::model::{Fopdt, Pid};
///
/// let plant = Fopdt { K: -5.939, T: 0.1491, L: 0.1 };
/// let (present, target) = (Pid::pi(-0.018, 0.0532), Pid::pi(-0.1315, 0.1491));
/// let evidence = Evidence {
///     since_change: f64::INFINITY, gain_margin: 3.0, phase_margin: 60.0,
///     saturated: 0.0, travel: 10.0, largest_travel: 10.0, still: 0,
/// };
/// let gated = gate(&present, &target, &plant, &evidence, &GateLimits::default());
/// assert_eq!(gated.controller.expect("allowed").Kp, -0.036); // twice, and the rest later
/// assert_eq!(gated.reasons[0].code(), "C01");
/// ```
pub fn gate(present: &Pid, target: &Pid, model: &Fopdt, evidence: &Evidence, limits: &GateLimits) -> Gated {
    let (step, mut reasons) = step_towards(present, target, limits.max_change);
    let mut refuse = |cause, measured, limit| reasons.push(Reason::new(cause, measured, limit));
    let dwell = limits.dwell * (model.T + model.L);
    if !(evidence.since_change >= dwell) {
        refuse(Cause::Dwell, evidence.since_change, dwell);
    }
    if !(evidence.gain_margin >= limits.gain_margin) {
        refuse(Cause::GainMargin, evidence.gain_margin, limits.gain_margin);
    }
    if !(evidence.phase_margin >= limits.phase_margin) {
        refuse(Cause::PhaseMargin, evidence.phase_margin, limits.phase_margin);
    }
    if !(evidence.saturated <= limits.saturation) {
        refuse(Cause::Saturated, evidence.saturated, limits.saturation);
    }
    let least = limits.excitation * evidence.largest_travel;
    if !(evidence.travel >= least && evidence.travel > 0.0) {
        refuse(Cause::NotExcited, evidence.travel, least);
    }
    if evidence.still > limits.stuck {
        refuse(Cause::Stuck, evidence.still as f64, limits.stuck as f64);
    }
    Gated { controller: (!reasons.refuse()).then_some(step), reasons }
}

/// The target, or how far a change by the factor `most` at most goes towards it, with the reasons C01 and C02.
///
/// A gain that is absent from the present controller comes in with the integral time of the target.
pub fn step_towards(present: &Pid, target: &Pid, most: f64) -> (Pid, Reasons) {
    let mut reasons = Reasons::default();
    let nothing = target.Kp == 0.0 && target.Ki == 0.0;
    for (name, now, wanted) in
        [(Parameter::Kp, present.Kp, target.Kp), (Parameter::Ki, present.Ki, target.Ki)]
    {
        let factor = wanted / now;
        if !wanted.is_finite() || nothing || now * wanted < 0.0 {
            reasons.push(Reason::new(Cause::Sign(name), wanted, now));
        } else if now != 0.0 && !(1.0 / most..=most).contains(&factor) {
            reasons.push(Reason::new(Cause::LargeChange(name), factor.max(1.0 / factor), most));
        }
    }
    // Both go the same share of the way, so that Ti goes with them.
    let way = |now: f64, wanted: f64| {
        if now == 0.0 { 0.0 } else { (wanted / now).clamp(1.0 / FARTHEST, FARTHEST).ln() }
    };
    let (Kp_way, Ki_way) = (way(present.Kp, target.Kp), way(present.Ki, target.Ki));
    let share = (most.ln() / Kp_way.abs().max(Ki_way.abs())).min(1.0);
    let towards = |now: f64, wanted: f64, way: f64| {
        if share == 1.0 { wanted } else { now * (share * way).exp() }
    };
    let (Kp, Ki) = match (present.Kp != 0.0, present.Ki != 0.0) {
        (true, true) => (towards(present.Kp, target.Kp, Kp_way), towards(present.Ki, target.Ki, Ki_way)),
        (true, false) => {
            let Kp = towards(present.Kp, target.Kp, Kp_way);
            (Kp, Kp / target.Ti())
        }
        (false, true) => {
            let Ki = towards(present.Ki, target.Ki, Ki_way);
            (if target.Ki == 0.0 { 0.0 } else { Ki * target.Ti() }, Ki)
        }
        (false, false) => (target.Kp, target.Ki),
    };
    (Pid { Kp, Ki, ..*target }, reasons)
}

/// What the last samples show of u and y.
///
/// ```
/// use plantune_core::adapt::Watch;
///
/// let mut watch = Watch::new(4, 0.0, 10.0)?;
/// for (u, y) in [(2.0, 1.0), (10.0, 1.0), (10.0, 1.0), (5.0, 1.0)] {
///     watch.step(u, y);
/// }
/// assert_eq!((watch.saturated(), watch.travel(), watch.still()), (0.5, 8.0, 3));
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Watch {
    low: f64,
    high: f64,
    window: Vec<f64>, // the last W values of u, the oldest at `oldest` once it is full
    oldest: usize,
    filled: usize,
    /// Extent of u since the beginning.
    least: f64,
    most: f64,
    /// The value y keeps, the u at which it began to, and for how long it has kept it after u moved.
    y: f64,
    u: f64,
    still: usize,
}

impl Watch {
    /// Over `W` samples, with the limits of u; infinite where it has none.
    pub fn new(W: usize, low: f64, high: f64) -> Result<Self> {
        if W == 0 {
            return Err(Error::argument("W", W, "at least 1 sample"));
        }
        if !(low < high) {
            return Err(Error::argument("low", low, &format!("less than high, {high}")));
        }
        let (least, most) = (f64::INFINITY, f64::NEG_INFINITY);
        let nan = f64::NAN;
        Ok(Watch {
            low,
            high,
            window: vec![0.0; W],
            oldest: 0,
            filled: 0,
            least,
            most,
            y: nan,
            u: nan,
            still: 0,
        })
    }

    /// Takes a sample; numbers that are not finite are left out. Allocates nothing.
    pub fn step(&mut self, u: f64, y: f64) {
        if !(u.is_finite() && y.is_finite()) {
            return;
        }
        self.window[self.oldest] = u;
        self.oldest = (self.oldest + 1) % self.window.len();
        self.filled = self.window.len().min(self.filled + 1);
        (self.least, self.most) = (self.least.min(u), self.most.max(u));
        if y != self.y {
            (self.y, self.u, self.still) = (y, u, 0);
        } else if self.still > 0 || (u - self.u).abs() > MOVE * self.largest_travel() {
            self.still += 1;
        }
    }

    /// Share of the window that u is at a limit.
    pub fn saturated(&self) -> f64 {
        let at = self.seen().iter().filter(|&&u| u <= self.low || u >= self.high).count();
        at as f64 / self.filled.max(1) as f64
    }

    /// Travel of u within the window.
    pub fn travel(&self) -> f64 {
        let ends = |(low, high): (f64, f64), &u: &f64| (low.min(u), high.max(u));
        let (low, high) = self.seen().iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
        (high - low).max(0.0)
    }

    /// The largest travel of u since the beginning.
    pub fn largest_travel(&self) -> f64 {
        (self.most - self.least).max(0.0)
    }

    /// Samples for which y has kept its value after u moved.
    pub fn still(&self) -> usize {
        self.still
    }

    /// Samples since u first moved, among the last `n`: by a tenth of its travel then.
    pub fn since_move(&self, n: usize) -> usize {
        let n = n.min(self.filled);
        let of_last = |k: usize| self.window[(self.oldest + self.window.len() - n + k) % self.window.len()];
        let ends = |(low, high): (f64, f64), u: f64| (low.min(u), high.max(u));
        let (low, high) = (0..n).map(of_last).fold((f64::INFINITY, f64::NEG_INFINITY), ends);
        let moved = (0..n).find(|&k| (of_last(k) - of_last(0)).abs() > MOVE * (high - low));
        moved.map_or(0, |k| n - k)
    }

    fn seen(&self) -> &[f64] {
        &self.window[..self.filled]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANT: Fopdt = Fopdt { K: 2.0, T: 1.0, L: 0.5 };

    fn fine() -> Evidence {
        Evidence {
            since_change: 7.5,
            gain_margin: 3.0,
            phase_margin: 60.0,
            saturated: 0.0,
            travel: 1.0,
            largest_travel: 2.0,
            still: 0,
        }
    }

    fn codes(present: &Pid, target: &Pid, evidence: &Evidence) -> Vec<&'static str> {
        let gated = gate(present, target, &PLANT, evidence, &GateLimits::default());
        assert_eq!(gated.controller.is_none(), gated.reasons.refuse());
        gated.reasons.iter().map(Reason::code).collect()
    }

    #[test]
    fn every_reason_has_its_code() {
        let pid = Pid::pi(1.0, 1.0);
        assert!(codes(&pid, &pid, &fine()).is_empty());
        for (evidence, code) in [
            (Evidence { since_change: 7.4, ..fine() }, "A05"),
            (Evidence { gain_margin: 1.9, ..fine() }, "C07"),
            (Evidence { gain_margin: f64::NAN, ..fine() }, "C07"),
            (Evidence { phase_margin: 44.0, ..fine() }, "C07"),
            (Evidence { saturated: 0.06, ..fine() }, "M03"),
            (Evidence { travel: 0.03, ..fine() }, "X01"),
            (Evidence { travel: 0.0, largest_travel: 0.0, ..fine() }, "X01"),
            (Evidence { still: 51, ..fine() }, "D18"),
        ] {
            assert_eq!(codes(&pid, &pid, &evidence), [code]);
        }
        for Kp in [-1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(codes(&pid, &Pid { Kp, ..pid }, &fine()), ["C02"]);
        }
        assert_eq!(codes(&pid, &Pid { Kp: 0.0, Ki: 0.0, ..pid }, &fine()), ["C02", "C02"]);
        assert_eq!(codes(&pid, &Pid::pi(3.0, 1.0), &fine()), ["C01", "C01"]);
    }

    /// Stepping on and on arrives at the target, never faster than allowed, through gains in between.
    #[test]
    fn steps_arrive() {
        for (from, to) in [
            (Pid::pi(-0.018, 0.0532), Pid::pi(-0.1315, 0.1491)),
            (Pid::pi(-0.1315, 0.1491), Pid::pi(-0.018, 0.0532)),
            (Pid { Kp: 0.0, Ki: 1.0, ..Pid::pi(1.0, 1.0) }, Pid::pi(9.0, 3.0)),
            (Pid { Ki: 0.0, ..Pid::pi(1.0, 1.0) }, Pid::pi(9.0, 3.0)),
            (Pid { Kp: 0.0, Ki: 0.0, ..Pid::pi(1.0, 1.0) }, Pid::pi(9.0, 3.0)),
        ] {
            let mut pid = from;
            for _ in 0..4 {
                let (next, reasons) = step_towards(&pid, &to, 2.0);
                assert!(!reasons.refuse());
                for (now, then) in [(pid.Kp, next.Kp), (pid.Ki, next.Ki)] {
                    assert!(now == 0.0 || (0.5..=2.0).contains(&(then / now)));
                }
                assert_eq!(reasons.is_empty(), next == to);
                pid = next;
            }
            assert!((pid.Kp - to.Kp).abs() < 1e-15 && (pid.Ki - to.Ki).abs() < 1e-15, "{pid:?} {to:?}");
        }
    }

    #[test]
    fn the_watch_sees_limits_travel_and_a_stuck_sensor() {
        let mut watch = Watch::new(10, -1.0, 1.0).expect("sound");
        for k in 0..100 {
            watch.step(f64::from(k / 5 % 2), f64::from(k));
        }
        assert_eq!(
            (watch.saturated(), watch.travel(), watch.largest_travel(), watch.still()),
            (0.5, 1.0, 1.0, 0)
        );
        // The value is kept from the last sample on; u moves at once and stays.
        for _ in 0..20 {
            watch.step(0.2, 99.0);
        }
        assert_eq!((watch.saturated(), watch.travel(), watch.still()), (0.0, 0.0, 20));
        assert_eq!((watch.since_move(10), watch.since_move(0)), (0, 0));
        (0..4).for_each(|_| watch.step(0.5, 99.0));
        assert_eq!((watch.since_move(10), watch.since_move(3)), (4, 0));
        watch.step(f64::NAN, 99.0);
        watch.step(0.2, 99.5);
        assert_eq!(watch.still(), 0);
        (0..20).for_each(|_| watch.step(0.2, 99.5));
        assert_eq!(watch.still(), 0, "at rest is not stuck");
    }

    #[test]
    fn limits_that_are_none_are_refused() {
        assert!(GateLimits::default().check().is_ok());
        for limits in [
            GateLimits { max_change: 1.0, ..GateLimits::default() },
            GateLimits { dwell: -1.0, ..GateLimits::default() },
            GateLimits { saturation: f64::NAN, ..GateLimits::default() },
        ] {
            assert_eq!(limits.check().expect_err("refused").code(), "U01");
        }
        assert_eq!(Watch::new(0, 0.0, 1.0).expect_err("empty").code(), "U01");
        assert_eq!(Watch::new(5, 1.0, 1.0).expect_err("no room").code(), "U01");
    }
}
