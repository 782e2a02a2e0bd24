//! A sampled PID, one sample at a time: backward Euler in two degrees of freedom.
//!
//! ```text
//! e = r - y,  P = Kp (b r - y),  w = c r - y
//! D <- (Tf D + Kp Td (w - w_before)) / (Tf + Ts)         the first order filter, Tf s + 1, on D
//! candidate I' = I + Ki Ts e,   v = P + I' + D + p,   u = v within reach
//! clamping          I = I' unless v is out of reach and Ki e drives it further out; else u = P + I + D + p
//! back-calculation  I = I' + Ts/Tt (u - v)
//! manual            u is given, I = u - P - D - p
//! ```
//!
//! The filter is the same as `D = Kp Td/(Tf+Ts) (w - x)`, `x <- x + Ts/(Tf+Ts) (w - x)`, with D as its
//! memory, so that new settings take it over as it is. With a filter on y, `y` stands everywhere for
//! `y_f`, `(1 + a + a^2/2) y_f = y + (a + a^2) y_f(k-1) - (a^2/2) y_f(k-2)` with `a = Tf/Ts`, and
//! `D = Kp Td (w - w_before) / Ts`.
//!
//! The integral is in units of u. When settings change, it takes the jump of P at the last sample, so that u
//! goes on from where it is; a gain schedule is such a change at every sample. What leaves the controller is
//! the sum with the pre-control `p`, and limits act on the sum: source 001, (3.4-46). Its (3.7-24) and (3.7-25)
//! as corrected are this law for PI.

use super::actuator::{Actuator, within};
use crate::error::{Error, Result};
use crate::model::{Filter, Pid};

/// What the integral does while u is out of reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AntiWindup {
    /// It goes on.
    None,
    /// It waits while it is driven further out.
    Clamping,
    /// It follows u within the time `Tt`, s; by default `sqrt(Ti Td)`, or `Ti` without D.
    BackCalculation {
        /// Tracking time, s.
        Tt: Option<f64>,
    },
}

impl AntiWindup {
    /// Tracking time of these settings, s; infinite without integral action.
    pub fn tracking(self, pid: &Pid) -> Option<f64> {
        let AntiWindup::BackCalculation { Tt } = self else { return None };
        let own = if pid.Td > 0.0 && pid.Ti().is_finite() { (pid.Ti() * pid.Td).sqrt() } else { pid.Ti() };
        Some(Tt.unwrap_or(own))
    }

    /// Refuses what is no time, or shorter than a sample.
    pub fn check(self, Ts: Option<f64>) -> Result<()> {
        match self {
            AntiWindup::BackCalculation { Tt: Some(Tt) } if !(Tt > 0.0 && Tt >= Ts.unwrap_or(0.0)) => {
                let needed =
                    Ts.map_or("positive".to_owned(), |Ts| format!("at least the sample time, {Ts} s"));
                Err(Error::argument("Tt", Tt, &needed))
            }
            _ => Ok(()),
        }
    }
}

/// A sampled controller and its memory.
///
/// ```
/// use plantune_core::model::Pid;
/// use plantune_core::sim::{Actuator, AntiWindup, SampledPid};
///
/// let pid = Pid { Ts: Some(0.1), ..Pid::pi(2.0, 1.0) };
/// let limits = Actuator { high: 2.5, ..Actuator::default() };
/// let mut controller = SampledPid::new(&pid, 0.1, limits, AntiWindup::Clamping, 0.0, 0.0);
/// assert!((controller.step(1.0, 0.0, 0.0) - 2.2).abs() < 1e-12);
/// assert_eq!(controller.step(1.0, -1.0, 0.0), 2.5); // the integral waits
/// assert!((controller.step(1.0, 1.0, 0.0) - 0.2).abs() < 1e-12);
/// ```
#[derive(Clone, Debug)]
pub struct SampledPid {
    law: Law,
    Ts: f64,
    actuator: Actuator,
    anti_windup: AntiWindup,
    I: f64,
    D: f64,
    /// Set point, filtered output and the one before it, at the last sample.
    r: f64,
    y: f64,
    y_before: f64,
    u: f64,
}

/// Settings as the law uses them.
#[derive(Clone, Copy, Debug)]
struct Law {
    Kp: f64,
    b: f64,
    c: f64,
    KiTs: f64,
    /// `D <- keep D + take (w - w_before)`; both 0 without D.
    keep: f64,
    take: f64,
    derivative: bool,
    /// Weights of `y, y_f(k-1), y_f(k-2)`.
    filter: Option<[f64; 3]>,
    /// `Ts/Tt`.
    track: f64,
}

impl Law {
    fn new(pid: &Pid, Ts: f64, anti_windup: AntiWindup) -> Self {
        let (keep, take) = match pid.filter {
            Filter::D1 => (pid.Tf / (pid.Tf + Ts), pid.Kd() / (pid.Tf + Ts)),
            Filter::Y2 => (0.0, pid.Kd() / Ts),
        };
        let filter = (pid.filter == Filter::Y2).then(|| {
            let a = pid.Tf / Ts;
            let lead = 1.0 + a + 0.5 * a * a;
            [1.0 / lead, (a + a * a) / lead, -0.5 * a * a / lead]
        });
        let track = anti_windup.tracking(pid).map_or(0.0, |Tt| (Ts / Tt).min(1.0));
        let derivative = pid.Td > 0.0 || pid.filter == Filter::D1 && keep > 0.0;
        Law { Kp: pid.Kp, b: pid.b, c: pid.c, KiTs: pid.Ki * Ts, keep, take, derivative, filter, track }
    }

    fn P(&self, r: f64, y: f64) -> f64 {
        self.Kp * (self.b * r - y)
    }
}

impl SampledPid {
    /// At rest with the output `u0`, reading `y0`, which is the set point.
    pub fn new(pid: &Pid, Ts: f64, actuator: Actuator, anti_windup: AntiWindup, y0: f64, u0: f64) -> Self {
        let law = Law::new(pid, Ts, anti_windup);
        let I = u0 - law.P(y0, y0);
        SampledPid { law, Ts, actuator, anti_windup, I, D: 0.0, r: y0, y: y0, y_before: y0, u: u0 }
    }

    /// Goes on with other settings, without a bump.
    pub fn set(&mut self, pid: &Pid) {
        let law = Law::new(pid, self.Ts, self.anti_windup);
        self.I += self.law.P(self.r, self.y) - law.P(self.r, self.y);
        self.law = law;
    }

    /// Controller output for set point `r`, reading `y`; `p` is added to it. Allocates nothing.
    #[inline(always)]
    pub fn step(&mut self, r: f64, y: f64, p: f64) -> f64 {
        let rest = self.read(r, y) + p;
        let push = self.law.KiTs * (r - self.y);
        let candidate = self.I + push;
        let v = rest + candidate;
        let reach = self.actuator.reach(self.u, self.Ts);
        self.u = within(v, reach);
        if self.u == v {
            self.I = candidate;
        } else {
            self.saturated(rest, push, v, reach);
        }
        self.u
    }

    /// In manual: the output is `u` within reach, and automatic goes on from there.
    pub fn hold(&mut self, r: f64, y: f64, p: f64, u: f64) -> f64 {
        let rest = self.read(r, y) + p;
        self.u = within(u, self.actuator.reach(self.u, self.Ts));
        self.I = self.u - rest;
        self.u
    }

    /// Integral and derivative, in units of u.
    pub fn memory(&self) -> (f64, f64) {
        (self.I, self.D)
    }

    /// All that it remembers: integral, derivative, set point, filtered output and the one before, output.
    pub fn state(&self) -> [f64; 6] {
        [self.I, self.D, self.r, self.y, self.y_before, self.u]
    }

    /// Goes on from what [`SampledPid::state`] gave.
    pub fn resume(&mut self, state: [f64; 6]) {
        [self.I, self.D, self.r, self.y, self.y_before, self.u] = state;
    }

    /// `P + D`.
    #[inline(always)]
    fn read(&mut self, r: f64, y: f64) -> f64 {
        let law = &self.law;
        let y = match law.filter {
            Some([now, once, twice]) => now * y + once * self.y + twice * self.y_before,
            None => y,
        };
        if law.derivative {
            let moved = (law.c * r - y) - (law.c * self.r - self.y);
            self.D = law.keep * self.D + law.take * moved;
        } else {
            self.D = 0.0;
        }
        let P = law.P(r, y);
        (self.r, self.y_before, self.y) = (r, self.y, y);
        P + self.D
    }

    fn saturated(&mut self, rest: f64, push: f64, v: f64, reach: (f64, f64)) {
        let further = v > reach.1 && push > 0.0 || v < reach.0 && push < 0.0;
        match self.anti_windup {
            AntiWindup::Clamping if further => self.u = within(rest + self.I, reach),
            AntiWindup::BackCalculation { .. } => self.I += push + self.law.track * (self.u - v),
            AntiWindup::None | AntiWindup::Clamping => self.I += push,
        }
    }
}
