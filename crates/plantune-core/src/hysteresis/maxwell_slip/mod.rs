//! Maxwell slip: springs in parallel, each pulling a block that slips at its own force.
//!
//! ```text
//! F_i = k_i (x - x_bi)                                      |k_i (x - x_bi)| < f_i
//! F_i = f_i sgn(x'),  x_bi = x - (f_i / k_i) sgn(x')        beyond
//! y   = O + spring x + sum F_i                              source 002, (7a) and (7b)
//! ```
//!
//! `F_i` is `k_i` times a stop, which is `x` less a play of half width `r_i = f_i / k_i`. So the whole is a stack of
//! plays, and its inverse another one:
//!
//! ```text
//! y = O + K x - sum k_i z_i,   K = spring + sum k_i          w_0 = K at r = 0, w_i = -k_i at r_i
//! ```
//!
//! The partial sums of these weights fall from K to the spring. With a spring none vanishes and the inverse exists;
//! all blocks slipping, a stack without one goes on at constant force, and no force tells where.

mod direction;
mod identify;

pub use direction::{LoopDirection, loop_direction};
pub use identify::{MaxwellFit, MaxwellSettings, identify_maxwell};

use super::PlayStack;
use crate::error::{Error, Result};

/// Springs and slipping forces.
#[derive(Clone, Debug, PartialEq)]
pub struct MaxwellSlip {
    /// Stiffness of each element.
    pub k: Vec<f64>,
    /// Force at which its block slips.
    pub f: Vec<f64>,
    /// Stiffness of a spring without a block.
    pub spring: f64,
    /// What is added.
    pub offset: f64,
}

impl MaxwellSlip {
    pub(super) fn check(&self) -> Result<()> {
        if self.k.len() != self.f.len() {
            let came = format!("{} forces for {} springs", self.f.len(), self.k.len());
            return Err(Error::argument("f", came, "as many as `k`"));
        }
        for (name, values) in [("k", &self.k), ("f", &self.f)] {
            if let Some(value) = values.iter().find(|value| !(**value > 0.0 && value.is_finite())) {
                return Err(Error::argument(name, value, "positive and finite throughout"));
            }
        }
        if !(self.spring >= 0.0 && self.spring.is_finite()) {
            return Err(Error::argument("spring", self.spring, "0 or positive, and finite"));
        }
        if !self.offset.is_finite() {
            return Err(Error::argument("offset", self.offset, "finite"));
        }
        Ok(())
    }

    /// The same as a stack of plays.
    pub(super) fn plays(&self) -> PlayStack {
        let mut elements: Vec<(f64, f64)> = self.k.iter().zip(&self.f).map(|(k, f)| (f / k, *k)).collect();
        elements.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut r, mut w) = (vec![0.0], vec![self.spring + self.k.iter().sum::<f64>()]);
        for (own, k) in elements {
            if own > r[r.len() - 1] {
                r.push(own);
                w.push(-k);
            } else if let Some(w) = w.last_mut() {
                *w -= k;
            }
        }
        PlayStack::virgin(r, w, self.offset)
    }

    /// The stack of plays that finds x.
    pub(super) fn inverse(&self) -> Result<PlayStack> {
        if self.spring <= 0.0 {
            return Err(Error::argument("spring", self.spring, "positive, or no inverse exists")
                .remedy("where all blocks slip the force stays the same: fit a spring beside them"));
        }
        self.plays().inverse()
    }
}
