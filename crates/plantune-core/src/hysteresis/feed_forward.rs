//! A plant with hysteresis made to follow: inverse ahead, controller behind, and a memory that learns.
//!
//! ```text
//! u(t) = u_ff(r(t)) + u_cmac(r(t)) + u_pid(r(t-1) - y(t-1))        source 002, figures 5.1 and 3.3
//! y(t) = H[u](t), or what linear dynamics make of it by the end of the sample
//! ```
//!
//! `y(t)` is the answer to `u(t)`, so the error that is known when `u(t)` is due is that of the sample before, *both*
//! its signals: with `r(t) - y(t-1)` the controller would fight a feed-forward that is right. The memory learns the
//! whole of u, so that the controller's share is what is still to be learnt.

use super::cmac::Cmac;
use super::misfit::rms;
use super::{Model, Operator};
use crate::error::{Error, Result};
use crate::model::{Model as LinearModel, Pid};
use crate::note::Note;
use crate::sim::{Actuator, AntiWindup, SampledPid, SampledPlant};

/// Signals beyond so many ranges of the reference have run away.
const AWAY: f64 = 1e6;

/// What follows what.
pub struct Tracking<'a> {
    /// The plant, in its virgin state.
    pub plant: &'a Model,
    /// Linear dynamics behind it.
    pub dynamics: Option<&'a LinearModel>,
    /// Feed-forward.
    pub inverse: Option<&'a Model>,
    /// Feedback.
    pub pid: Option<&'a Pid>,
    /// What learns.
    pub cmac: Option<&'a mut Cmac>,
    /// Sample time, s.
    pub Ts: f64,
    /// Limits of u.
    pub limits: (f64, f64),
    /// Added to what the controller reads, one value per row.
    pub noise: &'a [f64],
}

/// Signals and errors.
#[derive(Clone, Debug)]
pub struct TrackRun {
    /// Output without noise.
    pub y: Vec<f64>,
    /// Input.
    pub u: Vec<f64>,
    /// Share of u that did not wait for an error: inverse and memory.
    pub ahead: Vec<f64>,
    /// `r - y`: root mean square of each pass, of all, largest magnitude.
    pub pass_rms: Vec<f64>,
    /// Of all rows.
    pub rms: f64,
    /// Largest magnitude.
    pub worst: f64,
    /// `rms` over the range of r.
    pub relative: f64,
    /// What is in doubt.
    pub notes: Vec<Note>,
}

/// Lets the plant follow `r`, so many rows a pass.
pub fn track(r: &[f64], pass: usize, mut loop_: Tracking) -> Result<TrackRun> {
    check(r, pass, &loop_)?;
    let (low, high) = r.iter().fold((f64::INFINITY, -f64::INFINITY), |(l, h), r| (l.min(*r), h.max(*r)));
    let mut plant = Plant::new(&loop_)?;
    let mut inverse = loop_.inverse.map(Model::start).transpose()?;
    let actuator = Actuator { low: loop_.limits.0, high: loop_.limits.1, ..Actuator::default() };
    let mut pid =
        loop_.pid.map(|pid| SampledPid::new(pid, loop_.Ts, actuator, AntiWindup::Clamping, r[0], 0.0));
    let (mut u, mut y, mut ahead) = (Vec::new(), Vec::new(), Vec::new());
    let mut notes = doubts(&loop_);
    for (t, &now) in r.iter().enumerate() {
        let mut known = inverse.as_mut().map_or(0.0, |inverse| inverse.step(now));
        if let Some(cmac) = &mut loop_.cmac {
            known += cmac.recall(now);
        }
        let input = match &mut pid {
            Some(pid) if t > 0 => pid.step(r[t - 1], y[t - 1] + loop_.noise[t - 1], known),
            _ => known.clamp(loop_.limits.0, loop_.limits.1),
        };
        if let Some(cmac) = &mut loop_.cmac {
            cmac.learn(input);
        }
        let output = plant.step(input);
        u.push(input);
        y.push(output);
        ahead.push(known);
        if !((output - now).abs() <= AWAY * (high - low)) {
            notes.push(runaway(t, loop_.Ts));
            break;
        }
    }
    let e: Vec<f64> = r.iter().zip(&y).map(|(r, y)| r - y).collect();
    let all = rms(&e);
    Ok(TrackRun {
        pass_rms: e.chunks(pass).map(rms).collect(),
        rms: all,
        worst: e.iter().fold(0.0, |worst: f64, e| worst.max(e.abs())),
        relative: all / (high - low),
        y,
        u,
        ahead,
        notes,
    })
}

fn check(r: &[f64], pass: usize, loop_: &Tracking) -> Result<()> {
    if !(loop_.Ts > 0.0 && loop_.Ts.is_finite()) {
        return Err(Error::argument("Ts", loop_.Ts, "positive, in seconds"));
    }
    if r.is_empty() || r.iter().all(|x| *x == r[0]) {
        return Err(Error::argument("r", "one value throughout", "a reference that moves"));
    }
    if pass == 0 {
        return Err(Error::argument("passes", "more than rows", "at least one row a pass"));
    }
    if loop_.noise.len() < r.len() {
        return Err(Error::argument("noise", format!("of {} rows", loop_.noise.len()), "as long as `r`"));
    }
    let (low, high) = loop_.limits;
    if !(low < high && low <= 0.0 && 0.0 <= high) {
        return Err(Error::argument("limits", format!("({low}, {high})"), "ascending, with 0 between them"));
    }
    if let (Some(cmac), Some(pid)) = (&loop_.cmac, loop_.pid) {
        let settings = cmac.settings();
        if pid.Ki != 0.0 && settings.beta >= 1.0 && settings.dead_zone == 0.0 {
            let needed =
                "below 1, or `dead_zone` positive, beside integral action: both would run away together";
            return Err(Error::argument("beta", settings.beta, needed));
        }
    }
    Ok(())
}

/// A memory beside an integral.
fn doubts(loop_: &Tracking) -> Vec<Note> {
    match (&loop_.cmac, loop_.pid) {
        (Some(cmac), Some(pid)) if pid.Ki != 0.0 && cmac.settings().dead_zone == 0.0 => {
            let text =
                "the memory learns the integral's share again and again, and may run away after many passes";
            vec![Note::warning("M02", text).remedy("a controller without integral action, or `dead_zone`")]
        }
        _ => Vec::new(),
    }
}

fn runaway(t: usize, Ts: f64) -> Note {
    Note::warning("M02", format!("the loop runs away: its signals end at {:.6} s", t as f64 * Ts))
        .remedy("smaller gains, smaller `beta`, or a `dead_zone`")
}

/// Hysteresis, and what is behind it.
struct Plant {
    hysteresis: Box<dyn Operator>,
    dynamics: Option<SampledPlant>,
}

impl Plant {
    fn new(loop_: &Tracking) -> Result<Self> {
        let behind = |model| SampledPlant::new(model, loop_.Ts, 0.0, 0.0);
        Ok(Plant { hysteresis: loop_.plant.start()?, dynamics: loop_.dynamics.map(behind).transpose()? })
    }

    fn step(&mut self, u: f64) -> f64 {
        let v = self.hysteresis.step(u);
        self.dynamics.as_mut().map_or(v, |plant| plant.step(v))
    }
}
