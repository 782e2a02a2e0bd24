//! Bouc-Wen: a mass on a spring, a damper and a force with memory; and that force over a displacement by itself.
//!
//! ```text
//! m y'' + c y' + k y + z = u                                              z' = alpha y' - |z|^nu (bg |y'| sgn z + bd y')
//! ```
//!
//! The literature writes `z' = alpha y' - beta (gamma |y'| |z|^(nu-1) z + delta y' |z|^nu)`. Of beta, gamma and
//! delta no data can tell more than the products `bg = beta gamma` and `bd = beta delta`, so these are the
//! parameters. `alpha` is the stiffness of the force where `z = 0`, beside `k`; the two differ only as far as `z`
//! leaves its straight line. While `|z|` grows its stiffness is `alpha - (bg + bd) |z|^nu`, while it falls
//! `alpha + (bg - bd) |z|^nu`: a force that yields has `bg + bd > 0`, one that hardens less than 0.
//!
//! Wen, J. Eng. Mech. Div. 102, 1976; Noël and Schoukens, Hysteretic benchmark with a dynamic nonlinearity, 2016.

mod force;
mod force_identify;
mod identify;
mod initial_state;
mod operator;
mod output_error;
mod projection;
mod spline;
mod start;
mod tangent;

pub use force::BoucWenForce;
pub use force_identify::{ForceFit, identify_force};
pub use identify::{BoucWenFit, BoucWenSettings, identify_bouc_wen};
pub use initial_state::initial_state;
pub use operator::simulate;
pub use spline::Hold;

use crate::error::{Error, Result};
use crate::linalg::Minimum;
use crate::note::Note;
use operator::Oscillator;

/// Radians per step of the integrator, of the stiffest oscillation.
const STEP: f64 = 0.1;

/// Fewest and most steps of the integrator per sample.
const STEPS: (usize, usize) = (4, 1000);

/// Standard deviations from the minimum at which a search may end.
const OFF: f64 = 0.1;

/// Share of nu beyond which its standard deviation leaves it open.
const OPEN: f64 = 0.25;

/// Parameters of the oscillator.
#[derive(Clone, Debug, PartialEq)]
pub struct BoucWen {
    /// Mass.
    pub m: f64,
    /// Damping.
    pub c: f64,
    /// Stiffness beside the force with memory.
    pub k: f64,
    /// Stiffness of the force with memory at `z = 0`.
    pub alpha: f64,
    /// `beta gamma`.
    pub bg: f64,
    /// `beta delta`.
    pub bd: f64,
    /// How sharply it yields.
    pub nu: f64,
    /// Sample time of a stream, s.
    pub Ts: Option<f64>,
}

impl BoucWen {
    pub(super) fn check(&self) -> Result<()> {
        let all = [("c", self.c), ("k", self.k), ("alpha", self.alpha), ("bg", self.bg), ("bd", self.bd)];
        if let Some((name, value)) = all.iter().find(|(_, value)| !value.is_finite()) {
            return Err(Error::argument(name, value, "finite"));
        }
        let positive = [("m", Some(self.m)), ("nu", Some(self.nu)), ("Ts", self.Ts)];
        for (name, value) in positive.iter().filter_map(|(name, value)| value.map(|v| (name, v))) {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::argument(name, value, "positive and finite"));
            }
        }
        Ok(())
    }

    /// A stream at rest, its force straight between samples.
    pub(super) fn start(&self) -> Result<Oscillator> {
        let Some(Ts) = self.Ts else {
            return Err(Error::argument("Ts", "not given", "the sample time of the stream, s"));
        };
        Ok(Oscillator::new(self.clone(), Ts))
    }

    /// Steps of the integrator per sample.
    pub fn steps(&self, Ts: f64) -> usize {
        let stiffest = ((self.k.abs() + self.alpha.abs()) / self.m).sqrt().max((self.c / self.m).abs());
        ((stiffest * Ts / STEP).ceil() as usize).clamp(STEPS.0, STEPS.1)
    }
}

/// What a search leaves in doubt: how far from its minimum it ended, and nu.
fn doubts(found: &Minimum, N: usize, nu: f64, sd_nu: f64) -> Vec<Note> {
    let mut notes = Vec::new();
    // The step to the minimum of the linearised problem, in standard deviations.
    let off = found.slope * (N as f64).sqrt();
    if !found.converged && off > OFF {
        notes.push(
            Note::warning("N05", format!("the search ended {off:.2} standard deviations from its minimum"))
                .measured(off, OFF)
                .remedy("pass nu=1, or more rows"),
        );
    }
    if sd_nu > OPEN * nu {
        notes.push(
            Note::warning("X02", format!("nu is {nu:.3} with a standard deviation of {sd_nu:.2}"))
                .measured(sd_nu, OPEN * nu)
                .remedy("pass nu=1, or record larger swings, in which the force yields"),
        );
    }
    notes
}

/// `|z|^nu`.
fn power(size: f64, nu: f64) -> f64 {
    if nu == 1.0 { size } else { size.powf(nu) }
}

/// Sign, 0 of 0.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}
