//! Creep: what follows slowly after plays have moved.
//!
//! ```text
//! z_i(t)      = max(x(t) - r_i, min(x(t) + r_i, z_i(t-1)))            plays, source 002, chapter 3 and METHODS 4
//! s_ki(t+1)   = s_ki(t) + (1 - e^(-Ts/tau_k)) (z_i(t) - s_ki(t))      tau_k s' = z - s with z held, exact
//! y(t)        = O + sum w_i z_i(t) + sum c_ki s_ki(t)
//! ```
//!
//! After a step of z the output goes on by `c (1 - e^(-t/tau))`; a row of time constants evenly spaced in log t makes
//! the creep that is seen, about a straight line over log t. Kuhnen and Janocha, IMechE J. Systems Control Eng. 212,
//! 1998. The sum over plays and time constants together is linear in all weights, so that one convex fit finds them
//! ([`identify_creep`]); a product `c_k w_i` is not.
//!
//! The creep of this sample was decided before it. So the inverse takes it off the output, and what is left is the
//! output of plays, whose inverse is exact.

mod charge;
mod identify;

pub use charge::ChargeLeak;
pub use identify::{CreepFit, CreepSettings, identify_creep};

use super::{Operator, PlayStack, copy_state};
use crate::error::{Error, Result};

/// Plays, and the creep of each.
#[derive(Clone, Debug, PartialEq)]
pub struct Creep {
    /// Half widths, ascending from 0 on.
    pub r: Vec<f64>, // (n)
    /// Weights of the plays.
    pub w: Vec<f64>, // (n)
    /// Time constants, s.
    pub tau: Vec<f64>, // (K)
    /// Weights of the creep of play `i` with `tau_k`, (K, n) row-major.
    pub c: Vec<f64>,
    /// Sample time, s.
    pub Ts: f64,
    /// `O`.
    pub offset: f64,
}

impl Creep {
    fn plays(&self) -> PlayStack {
        PlayStack::virgin(self.r.clone(), self.w.clone(), 0.0)
    }

    pub(super) fn check(&self) -> Result<()> {
        PlayStack { offset: self.offset, ..self.plays() }.check()?;
        check_Ts(self.Ts)?;
        if let Some(tau) = self.tau.iter().find(|tau| !(**tau > 0.0 && tau.is_finite())) {
            return Err(Error::argument("tau", tau, "positive, in seconds"));
        }
        let (K, n) = (self.tau.len(), self.r.len());
        if self.c.len() != K * n || self.c.iter().any(|c| !c.is_finite()) {
            let needed = format!("{K} by {n}, a row per `tau` and a column per `r`, finite");
            return Err(Error::argument("c", format!("of {} numbers", self.c.len()), &needed));
        }
        Ok(())
    }

    pub(super) fn start(&self) -> Box<dyn Operator> {
        Box::new(Creeping::new(self))
    }

    pub(super) fn start_inverse(&self) -> Result<Box<dyn Operator>> {
        Ok(Box::new(Uncreeping {
            plays: Box::new(self.plays().inverse()?.start()),
            creep: Creeping::new(self),
        }))
    }

    pub(super) fn check_inverse(&self) -> Result<()> {
        self.plays().inverse().map(|_| ())
    }
}

/// Refuses what is no sample time.
fn check_Ts(Ts: f64) -> Result<()> {
    if Ts > 0.0 && Ts.is_finite() {
        return Ok(());
    }
    Err(Error::argument("Ts", Ts, "positive, in seconds"))
}

/// Plays and creep at work.
pub(super) struct Creeping {
    model: Creep,
    gain: Vec<f64>,  // (K), 1 - e^(-Ts/tau)
    state: Vec<f64>, // z (n), then s (K, n)
}

impl Creeping {
    fn new(model: &Creep) -> Self {
        let n = model.r.len();
        let gain = model.tau.iter().map(|tau| -(-model.Ts / tau).exp_m1()).collect();
        Creeping { gain, state: vec![0.0; n * (model.tau.len() + 1)], model: model.clone() }
    }

    /// What of this sample's output the past has decided.
    fn ahead(&self) -> f64 {
        let s = &self.state[self.model.r.len()..];
        self.model.offset + self.model.c.iter().zip(s).map(|(c, s)| c * s).sum::<f64>()
    }

    /// Moves the plays to `x` and returns the sum of them.
    fn play(&mut self, x: f64) -> f64 {
        let plays = self.state.iter_mut().zip(&self.model.r).zip(&self.model.w);
        plays.fold(0.0, |y, ((z, r), w)| {
            *z = (x - r).max((x + r).min(*z));
            y + w * *z
        })
    }

    /// Lets time go on by a sample.
    fn creep(&mut self) {
        let (z, s) = self.state.split_at_mut(self.model.r.len());
        for (s, gain) in s.chunks_exact_mut(z.len()).zip(&self.gain) {
            s.iter_mut().zip(&*z).for_each(|(s, z)| *s += gain * (z - *s));
        }
    }
}

impl Operator for Creeping {
    fn step(&mut self, x: f64) -> f64 {
        let y = self.ahead() + self.play(x);
        self.creep();
        y
    }

    fn state(&self) -> Vec<f64> {
        self.state.clone()
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        copy_state(&mut self.state, state)
    }
}

/// The inverse at work: plays undone, creep repeated.
struct Uncreeping {
    plays: Box<dyn Operator>,
    creep: Creeping,
}

impl Operator for Uncreeping {
    fn step(&mut self, y: f64) -> f64 {
        let x = self.plays.step(y - self.creep.ahead());
        self.creep.play(x);
        self.creep.creep();
        x
    }

    fn state(&self) -> Vec<f64> {
        [self.creep.state(), self.plays.state()].concat()
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        let own = self.creep.state.len();
        if state.len() < own {
            return copy_state(&mut self.creep.state, state);
        }
        self.plays.resume(&state[own..])?;
        self.creep.resume(&state[..own])
    }
}
