//! A continuous PID from node to node, `h` seconds apart, on a plant output that is a straight line in between.
//!
//! ```text
//! u = Kp (b r - y) + I + D + p,   I' = Ki (r - y),   Tf D' + D = Kp Td (c r - y)'
//! u(k+1) = open - slope y(k+1) - area int y,   known before y(k+1) is
//! with a filter on y:  y_f + Tf y_f' + (Tf^2/2) y_f'' = y in place of y,   D = -Kp Td y_f'
//! ```
//!
//! With the plant's own answer, see [`super::ramped`], that is one linear equation for `u(k+1)`. Limits,
//! anti-windup, manual and new settings are those of [`super::controller`], at the nodes.

use super::actuator::{Actuator, within};
use super::controller::AntiWindup;
use super::ramped::Affine;
use crate::model::{Filter, Pid};

/// A continuous controller and its memory.
pub struct ContinuousPid {
    pid: Pid,
    h: f64,
    actuator: Actuator,
    anti_windup: AntiWindup,
    I: f64,
    D: f64,
    r: f64,
    p: f64,
    /// Output just after the last node.
    y: f64,
    filter: Option<Smooth>,
    u: f64,
    /// `u - v` just after the last node: how far u is held back.
    held_back: f64,
}

/// Filtered output and its slope.
#[derive(Clone, Copy, Debug)]
struct Smooth {
    y: f64,
    slope: f64,
}

/// `u = open - slope y - area int y`.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    pub open: f64,
    pub slope: f64,
    pub area: f64,
}

impl Answer {
    /// `u` where `y` and its integral are affine in it.
    pub fn solved(&self, y: Affine, area: Affine) -> f64 {
        (self.open - self.slope * y.free - self.area * area.free)
            / (1.0 + self.slope * y.gain + self.area * area.gain)
    }
}

impl ContinuousPid {
    /// At rest with the output `u0`, reading `y0`, which is the set point.
    pub fn new(pid: &Pid, h: f64, actuator: Actuator, anti_windup: AntiWindup, y0: f64, u0: f64) -> Self {
        let I = u0 - pid.Kp * (pid.b - 1.0) * y0;
        let filter = smooths(pid).then_some(Smooth { y: y0, slope: 0.0 });
        ContinuousPid {
            pid: *pid,
            h,
            actuator,
            anti_windup,
            I,
            D: 0.0,
            r: y0,
            p: 0.0,
            y: y0,
            filter,
            u: u0,
            held_back: 0.0,
        }
    }

    /// Goes on with other settings, without a bump.
    pub fn set(&mut self, pid: &Pid) {
        let before = self.rest(self.seen());
        self.filter = smooths(pid).then_some(self.filter.unwrap_or(Smooth { y: self.y, slope: 0.0 }));
        self.pid = *pid;
        if self.filter.is_some() || pid.Tf == 0.0 {
            self.D = 0.0;
        }
        self.I += before - self.rest(self.seen());
    }

    /// Output just after this node, from which on `r` and `p` hold.
    pub fn now(&self, r: f64, p: f64) -> Answer {
        let pid = &self.pid;
        if let Some(y) = self.filter {
            return Answer {
                open: pid.Kp * (pid.b * r - y.y) + self.D_of(y) + self.I + p,
                slope: 0.0,
                area: 0.0,
            };
        }
        let jump = self.jump_gain();
        let open = pid.Kp * pid.b * r + self.I + self.D + jump * (pid.c * (r - self.r) + self.y) + p;
        Answer { open, slope: pid.Kp + jump, area: 0.0 }
    }

    /// Takes `r` and `p`, and the output `y` just after this node.
    pub fn begin(&mut self, r: f64, p: f64, y: f64, u: f64) {
        self.D += self.jump_gain() * (self.pid.c * (r - self.r) - (y - self.y));
        (self.r, self.p, self.y, self.u) = (r, p, y, u);
        self.held_back = u - (self.rest(self.seen()) + self.p + self.I);
    }

    /// Output at the next node, not minding limits.
    pub fn ahead(&self) -> Answer {
        let (pid, h) = (&self.pid, self.h);
        let fixed = pid.Kp * pid.b * self.r + self.I + pid.Ki * h * self.r + self.p + self.carried();
        let Some(smooth) = self.filter else {
            let (keep, take) = self.decay();
            let open = fixed + keep * self.D + take * self.y;
            return Answer { open, slope: pid.Kp + take, area: pid.Ki };
        };
        // y_f and its slope are linear in y(k+1).
        let (none, unit) = (self.smoothed(0.0), self.smoothed(1.0));
        let area = |end: Smooth| 0.5 * h * (smooth.y + end.y) + h * h / 12.0 * (smooth.slope - end.slope);
        let out = |end: Smooth| pid.Kp * end.y + pid.Ki * area(end) + pid.Kd() * end.slope;
        Answer { open: fixed - out(none), slope: out(unit) - out(none), area: 0.0 }
    }

    /// Reaches the next node at the output `y`, its integral from this one being `area`.
    pub fn run(&mut self, y: f64, area: f64) -> f64 {
        let h = self.h;
        let area = match self.filter {
            None => {
                let (keep, take) = self.decay();
                self.D = keep * self.D - take * (y - self.y);
                area
            }
            Some(begin) => {
                let end = self.smoothed(y);
                self.filter = Some(end);
                0.5 * h * (begin.y + end.y) + h * h / 12.0 * (begin.slope - end.slope)
            }
        };
        self.y = y;
        let rest = self.rest(self.seen()) + self.p;
        let push = self.pid.Ki * (self.r * h - area);
        let candidate = self.I + push + self.carried();
        let v = rest + candidate;
        let reach = self.actuator.reach(self.u, h);
        self.u = within(v, reach);
        let further = v > reach.1 && push > 0.0 || v < reach.0 && push < 0.0;
        match self.anti_windup {
            AntiWindup::Clamping if self.u != v && further => self.u = within(rest + self.I, reach),
            AntiWindup::BackCalculation { .. } => {
                // I = candidate + share (u - rest - I)
                let share = self.share();
                self.I = candidate + share / (1.0 + share) * (self.u - v);
            }
            _ => self.I = candidate,
        }
        self.u
    }

    /// Half an interval in tracking times; `Tt I' = u - v` is integrated by the trapezoidal rule.
    fn share(&self) -> f64 {
        self.anti_windup.tracking(&self.pid).map_or(0.0, |Tt| 0.5 * self.h / Tt)
    }

    /// What the integral takes over the next interval of how far u is held back at its beginning.
    fn carried(&self) -> f64 {
        if self.held_back == 0.0 { 0.0 } else { self.share() * self.held_back }
    }

    /// After [`ContinuousPid::begin`] or [`ContinuousPid::run`] in manual: automatic goes on from `u`.
    pub fn hold(&mut self, u: f64) {
        (self.u, self.held_back) = (u, 0.0);
        self.I = u - self.rest(self.seen()) - self.p;
    }

    /// Where u may go within `t` seconds.
    pub fn reach(&self, t: f64) -> (f64, f64) {
        self.actuator.reach(self.u, t)
    }

    /// `P + D`.
    fn rest(&self, y: f64) -> f64 {
        let D = self.filter.map_or(self.D, |smooth| self.D_of(smooth));
        self.pid.Kp * (self.pid.b * self.r - y) + D
    }

    fn seen(&self) -> f64 {
        self.filter.map_or(self.y, |smooth| smooth.y)
    }

    fn D_of(&self, smooth: Smooth) -> f64 {
        -self.pid.Kd() * smooth.slope
    }

    /// What D takes of a jump of `c r - y`.
    fn jump_gain(&self) -> f64 {
        if self.filter.is_none() && self.pid.Tf > 0.0 { self.pid.Kd() / self.pid.Tf } else { 0.0 }
    }

    /// `D(k+1) = keep D - take (y(k+1) - y)`.
    fn decay(&self) -> (f64, f64) {
        if self.pid.Tf == 0.0 {
            return (0.0, 0.0);
        }
        let steps = self.h / self.pid.Tf;
        ((-steps).exp(), -(-steps).exp_m1() * self.pid.Kd() / self.h)
    }

    /// `y_f` at the next node: along a line it runs parallel, `Tf` behind; the rest dies out as `e^(-1 +- j)`.
    fn smoothed(&self, y: f64) -> Smooth {
        let (Tf, now) = (self.pid.Tf, self.filter.unwrap_or(Smooth { y, slope: 0.0 }));
        let steps = self.h / Tf;
        let ((sin, cos), e) = (steps.sin_cos(), (-steps).exp());
        let rise = (y - self.y) * (Tf / self.h);
        let (off, slope_off) = (now.y - (self.y - rise), now.slope * Tf - rise);
        Smooth {
            y: y - rise + e * ((cos + sin) * off + sin * slope_off),
            slope: (rise + e * ((cos - sin) * slope_off - 2.0 * sin * off)) / Tf,
        }
    }
}

/// Whether the settings filter y.
fn smooths(pid: &Pid) -> bool {
    pid.filter == Filter::Y2 && pid.Tf > 0.0
}
