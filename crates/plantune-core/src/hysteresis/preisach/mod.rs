//! The discrete Preisach model: a weight for every cell of the half plane of relays.
//!
//! ```text
//! y = O + sum over S+ of mu - sum over S- of mu            S: alpha >= beta
//! relay: up once x >= alpha, down once x <= beta, else as before
//! ```
//!
//! Within a cell the weight is spread evenly, so that the output has no steps: [`everett`]. Beyond the outermost levels
//! the output is saturated. Source 002, (2) to (4) as corrected.

mod everett;
mod forc;
mod identify;
mod operator;
mod virgin;

pub use everett::{everett_of_mu, mu_of_everett};
pub use forc::{Forc, forc};
pub use identify::{PreisachFit, PreisachSettings, identify_preisach};

use super::Operator;
use crate::error::{Error, Result};
use operator::{Relays, Seeking};

/// Where the relays stand before the first sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Up where `alpha + beta < 0`: demagnetised, as plays at 0.
    Virgin,
    /// All down.
    Negative,
}

/// Levels, weights of the cells between them, offset, and the state before the first sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Preisach {
    /// Ascending, n + 1 of them.
    pub levels: Vec<f64>,
    /// Weights, (n, n) row-major: row `i` of alpha in `[L_i, L_(i+1)]`, column `j <= i` of beta.
    pub mu: Vec<f64>,
    /// `O`: the output halfway between both saturations.
    pub offset: f64,
    /// Before the first sample.
    pub start: Start,
}

impl Preisach {
    pub(super) fn check(&self) -> Result<()> {
        check_levels(&self.levels)?;
        let n = self.levels.len() - 1;
        if self.mu.len() != n * n {
            let needed = format!("{n} by {n}, a row and a column per cell of `levels`");
            return Err(Error::argument("mu", format!("of {} numbers", self.mu.len()), &needed));
        }
        if self.mu.iter().chain([&self.offset]).any(|m| !m.is_finite()) {
            return Err(Error::argument("mu", "not finite", "finite, as `offset`"));
        }
        if (0..n).any(|i| self.mu[i * n + i + 1..(i + 1) * n].iter().any(|m| *m != 0.0)) {
            return Err(Error::argument("mu", "not 0 above the diagonal", "0 where alpha < beta"));
        }
        Ok(())
    }

    pub(super) fn start(&self) -> Box<dyn Operator> {
        Box::new(Relays::new(self))
    }

    /// The operator that finds the input of an output.
    pub(super) fn start_inverse(&self) -> Result<Box<dyn Operator>> {
        self.check_inverse()?;
        Ok(Box::new(Seeking(Relays::new(self))))
    }

    pub(super) fn check_inverse(&self) -> Result<()> {
        let most = self.mu.iter().fold(0.0_f64, |most, m| most.max(m.abs()));
        let least = self.mu.iter().fold(f64::INFINITY, |least, m| least.min(*m));
        if least < -ROUNDING * most || most == 0.0 {
            let needed = "nowhere negative and not 0 throughout, or no inverse exists";
            return Err(Error::argument("mu", format!("{least:.4} in a cell"), needed));
        }
        Ok(())
    }
}

/// Negative weights below this share of the largest are rounding.
const ROUNDING: f64 = 1e-9;

/// Levels ascend.
pub fn check_levels(levels: &[f64]) -> Result<()> {
    if levels.len() < 2 || levels.iter().any(|l| !l.is_finite()) || levels.windows(2).any(|l| l[0] >= l[1]) {
        return Err(Error::argument("levels", format!("{levels:?}"), "two or more, finite, ascending"));
    }
    Ok(())
}
