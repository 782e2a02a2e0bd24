//! What a closed loop is asked to do, and what does not go together.

use super::actuator::Actuator;
use super::controller::AntiWindup;
use super::horizon::time_scale;
use super::schedule::Schedule;
use crate::error::{Error, Result};
use crate::model::{Model, Pid};

/// Most nodes of one continuous simulation.
const MOST_NODES: usize = 5_000_000;

/// What the loop is asked to do; all signals are constant over steps of `dt`.
#[derive(Clone, Debug)]
pub struct ClosedLoopSettings<'s> {
    /// Length of a step, s; the sample time of a sampled controller.
    pub dt: f64,
    /// Set point; the other signals are as long.
    pub r: &'s [f64],
    /// Disturbance at the plant input.
    pub d: Option<&'s [f64]>,
    /// Added to the plant output.
    pub dy: Option<&'s [f64]>,
    /// Added to what a sampled controller reads.
    pub noise: Option<&'s [f64]>,
    /// Pre-control, added to the controller output.
    pub p: Option<&'s [f64]>,
    /// Output in manual; NaN where the controller is in automatic.
    pub manual: Option<&'s [f64]>,
    /// `O` in `y = G u + O`.
    pub offset: f64,
    /// Input before time 0, at which the loop was in equilibrium.
    pub u0: f64,
    /// Limits, rate, dead band and step of u.
    pub actuator: Actuator,
    /// Step of the y that a sampled controller reads; 0 for none.
    pub y_step: f64,
    /// What the integral does at a limit.
    pub anti_windup: AntiWindup,
    /// Settings from a row on, ascending.
    pub settings: &'s [(usize, Pid)],
    /// Settings that change from row to row.
    pub schedule: Schedule<'s>,
    /// Nodes per time scale of a continuous loop; 1000 is exact to about 1e-6.
    pub fineness: f64,
}

impl<'s> ClosedLoopSettings<'s> {
    /// A set point, and nothing else.
    pub fn new(dt: f64, r: &'s [f64]) -> Self {
        ClosedLoopSettings {
            dt,
            r,
            d: None,
            dy: None,
            noise: None,
            p: None,
            manual: None,
            offset: 0.0,
            u0: 0.0,
            actuator: Actuator::default(),
            y_step: 0.0,
            anti_windup: AntiWindup::Clamping,
            settings: &[],
            schedule: Schedule::default(),
            fineness: 1000.0,
        }
    }

    /// A signal in a row; the last row goes on.
    #[inline(always)]
    pub fn of(&self, x: Option<&[f64]>, row: usize) -> f64 {
        x.map_or(0.0, |x| x[row.min(x.len() - 1)])
    }
}

/// Controller settings from row to row.
pub struct InForce<'a> {
    base: Pid,
    changes: &'a [(usize, Pid)],
    schedule: Schedule<'a>,
    scheduled: bool,
}

impl<'a> InForce<'a> {
    pub fn new(pid: &Pid, s: &'a ClosedLoopSettings) -> Self {
        InForce { base: *pid, changes: s.settings, schedule: s.schedule, scheduled: !s.schedule.is_empty() }
    }

    /// Those with which the loop was at rest.
    pub fn first(&mut self) -> Pid {
        self.change(0).unwrap_or(self.base)
    }

    /// New ones that begin with a row.
    #[inline(always)]
    pub fn change(&mut self, row: usize) -> Option<Pid> {
        let mut changed = self.scheduled;
        while let Some(((at, pid), rest)) = self.changes.split_first()
            && *at <= row
        {
            (self.base, self.changes, changed) = (*pid, rest, true);
        }
        if !changed {
            return None;
        }
        let last = self.schedule.rows().saturating_sub(1);
        Some(self.schedule.at(row.min(last), &self.base))
    }
}

/// Refuses what does not go together.
pub fn check(pid: &Pid, s: &ClosedLoopSettings) -> Result<()> {
    pid.check()?;
    let steps = s.r.len();
    if steps == 0 {
        return Err(Error::argument("r", "empty", "at least one set point"));
    }
    if !(s.dt > 0.0 && s.dt.is_finite()) {
        return Err(Error::argument("Ts", s.dt, "a positive number of seconds"));
    }
    let signals =
        [("r", Some(s.r)), ("d", s.d), ("dy", s.dy), ("noise", s.noise), ("p", s.p), ("manual", s.manual)];
    for (name, x) in signals {
        let Some(x) = x else { continue };
        if x.len() != steps {
            return Err(Error::argument(name, format!("{} long", x.len()), &format!("{steps} long, like r")));
        }
        let fine = |x: &f64| x.is_finite() || name == "manual" && x.is_nan();
        if !x.iter().fold(true, |all, x| all & fine(x)) {
            return Err(Error::argument(name, "not finite in some row", "finite"));
        }
    }
    for (name, x) in [("offset", s.offset), ("u0", s.u0)] {
        if !x.is_finite() {
            return Err(Error::argument(name, x, "finite"));
        }
    }
    s.actuator.check(s.u0)?;
    if !(s.y_step >= 0.0 && s.y_step.is_finite()) {
        return Err(Error::argument("y_step", s.y_step, "zero or positive"));
    }
    s.anti_windup.check(pid.Ts)?;
    let all = std::iter::once(pid).chain(s.settings.iter().map(|(_, pid)| pid));
    for (k, other) in all.enumerate() {
        other.check()?;
        s.schedule.check(steps, other)?;
        if other.Ts != pid.Ts {
            let came = format!("{:?} in settings {k}", other.Ts);
            return Err(Error::argument("Ts", came, &format!("{:?}, as the controller has", pid.Ts)));
        }
        let unfiltered = other.Td > 0.0 || s.schedule.Td.is_some();
        if pid.Ts.is_none() && unfiltered && other.Tf == 0.0 {
            let needed = "positive: an unfiltered derivative answers a step with an impulse";
            return Err(Error::argument("Tf", 0, needed));
        }
    }
    match pid.Ts {
        Some(Ts) if (Ts - s.dt).abs() > 1e-9 * Ts => {
            Err(Error::argument("Ts", s.dt, &format!("{Ts} s, the sample time of the controller")))
        }
        None if s.noise.is_some_and(|noise| noise.iter().any(|&n| n != 0.0)) => Err(Error::argument(
            "noise",
            "given",
            "absent: a continuous controller cannot read white noise; give pid a Ts",
        )),
        None if !s.actuator.follows() || s.y_step > 0.0 => Err(Error::argument(
            "dead_band, step, y_step",
            "given",
            "absent: a continuous controller has no sample at which to jump; give pid a Ts",
        )),
        _ => Ok(()),
    }
}

/// Nodes so close that the straight line costs about 1e-6 of the indices.
pub fn nodes_per_step(model: &Model, pid: &Pid, s: &ClosedLoopSettings) -> Result<usize> {
    let scale = time_scale(model, pid);
    let stride = (s.dt / (scale / s.fineness)).ceil().max(1.0);
    if stride * s.r.len() as f64 <= MOST_NODES as f64 {
        return Ok(stride as usize);
    }
    let needed = format!(
        "at most {:.3e} s in all: {MOST_NODES} nodes of the loop's own time scale, {scale:.3e} s",
        MOST_NODES as f64 * scale / s.fineness
    );
    Err(Error::argument("t_end", s.dt * s.r.len() as f64, &needed))
}
