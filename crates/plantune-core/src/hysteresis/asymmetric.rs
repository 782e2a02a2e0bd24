//! Loops that are not symmetric: a stack of plays seen through a monotone curve (modified Prandtl-Ishlinskii).
//!
//! ```text
//! y = S(H[x])      x = H'[S'(y)]
//! ```
//!
//! H the stack of `play.rs`, S the dead zones of `dead_zones.rs`, the strokes their exact inverses. Kuhnen, European
//! Journal of Control 9, 2003; METHODS 4.

use super::Operator;
use super::dead_zones::{Curve, DeadZones};
use super::play::PlayStack;
use super::plays::Plays;
use crate::error::{Error, Result};

/// Plays and a curve; which of them comes first says the kind of [`super::Model`].
#[derive(Clone, Debug, PartialEq)]
pub struct AsymmetricStack {
    /// H, without an offset: the curve has one.
    pub plays: PlayStack,
    /// S.
    pub zones: DeadZones,
}

impl AsymmetricStack {
    pub(super) fn check(&self) -> Result<()> {
        self.plays.check()?;
        self.zones.check()?;
        if self.plays.offset != 0.0 {
            return Err(Error::argument("offset", self.plays.offset, "the curve's, not the plays'"));
        }
        Ok(())
    }

    /// Plays first, or the curve.
    pub(super) fn start(&self, order: Order) -> Seen {
        Seen { plays: self.plays.start(), curve: self.zones.curve(), order }
    }

    /// The inverse, whose parts act in the other order.
    pub(super) fn inverse(&self) -> Result<AsymmetricStack> {
        Ok(AsymmetricStack { plays: self.plays.inverse()?, zones: self.zones.inverse() })
    }
}

/// Which part acts first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    PlaysFirst,
    CurveFirst,
}

/// Plays seen through a curve, at work.
pub(super) struct Seen {
    plays: Plays,
    curve: Curve,
    order: Order,
}

impl Operator for Seen {
    fn step(&mut self, x: f64) -> f64 {
        match self.order {
            Order::PlaysFirst => self.curve.at(self.plays.step(x)),
            Order::CurveFirst => self.plays.step(self.curve.at(x)),
        }
    }

    fn run(&mut self, x: &[f64]) -> Vec<f64> {
        let curve = |x: &[f64]| -> Vec<f64> { x.iter().map(|x| self.curve.at(*x)).collect() };
        match self.order {
            Order::PlaysFirst => curve(&self.plays.run(x)),
            Order::CurveFirst => self.plays.run(&curve(x)),
        }
    }

    fn state(&self) -> Vec<f64> {
        self.plays.state()
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        self.plays.resume(state)
    }
}
