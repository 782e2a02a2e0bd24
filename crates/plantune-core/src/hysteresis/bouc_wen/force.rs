//! The force of Bouc and Wen over a displacement: rate independent, with exponential branches.
//!
//! ```text
//! y = O + k x + alpha zeta        d zeta / d x = 1 - |zeta|^nu (g sgn(zeta dx) + d)        zeta(-1) = x(-1) = 0
//! ```
//!
//! `z = alpha zeta` of the oscillator: `g = bg alpha^(nu-1)`, `d = bd alpha^(nu-1)`. Between samples x runs straight.

use super::{power, sign};
use crate::error::{Error, Result};
use crate::hysteresis::{Operator, copy_state};

/// Steps along x in units of the displacement over which zeta forgets.
const STEP: f64 = 0.05;

/// Steps to the point where zeta is zero.
const CROSSING: usize = 4;

/// Most steps per sample.
const MOST: usize = 10_000;

/// Stiffnesses, shape and offset.
#[derive(Clone, Debug, PartialEq)]
pub struct BoucWenForce {
    /// Stiffness beside the force with memory.
    pub k: f64,
    /// Stiffness of the force with memory at `zeta = 0`.
    pub alpha: f64,
    /// How much zeta loses of its growth, whichever way x runs.
    pub g: f64,
    /// The same, with the sign of the way.
    pub d: f64,
    /// How sharply it yields.
    pub nu: f64,
    /// What is added.
    pub offset: f64,
}

impl BoucWenForce {
    pub(in super::super) fn check(&self) -> Result<()> {
        let all =
            [("k", self.k), ("alpha", self.alpha), ("g", self.g), ("d", self.d), ("offset", self.offset)];
        if let Some((name, value)) = all.iter().find(|(_, value)| !value.is_finite()) {
            return Err(Error::argument(name, value, "finite"));
        }
        if !(self.nu > 0.0 && self.nu.is_finite()) {
            return Err(Error::argument("nu", self.nu, "positive and finite"));
        }
        Ok(())
    }

    pub(in super::super) fn start(&self) -> Force {
        let shape = Shape { g: self.g, d: self.d, nu: self.nu };
        Force { model: self.clone(), shape, x: 0.0, zeta: Zeta::default() }
    }
}

/// The force at work.
pub struct Force {
    model: BoucWenForce,
    shape: Shape,
    x: f64,
    zeta: Zeta,
}

impl Operator for Force {
    fn step(&mut self, x: f64) -> f64 {
        self.zeta.advance(&self.shape, x - self.x);
        self.x = x;
        self.model.offset + self.model.k * x + self.model.alpha * self.zeta.value()
    }

    /// x and zeta.
    fn state(&self) -> Vec<f64> {
        vec![self.x, self.zeta.value()]
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        let mut own = [0.0; 2];
        copy_state(&mut own, state)?;
        (self.x, self.zeta) = (own[0], Zeta([own[1], 0.0, 0.0, 0.0]));
        Ok(())
    }
}

/// What shapes a loop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) g: f64,
    pub(super) d: f64,
    pub(super) nu: f64,
}

/// zeta, and its slopes over g, d and nu, which cost little beside it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Zeta(pub(super) [f64; 4]);

impl Zeta {
    pub(super) fn value(&self) -> f64 {
        self.0[0]
    }

    /// Moves on by `dx`.
    pub(super) fn advance(&mut self, shape: &Shape, dx: f64) {
        let (way, mut left) = (sign(dx), dx.abs());
        let size = shape.g.abs() + shape.d.abs();
        // At this zeta the losses would eat all growth.
        let full = if size > 0.0 { size.powf(-1.0 / shape.nu) } else { f64::INFINITY };
        for count in 1.. {
            let beyond = power((self.value().abs() / full).max(1.0), shape.nu - 1.0);
            let longest = if count < MOST { STEP * full / (shape.nu * beyond) } else { f64::INFINITY };
            let before = *self;
            let mut h = left.min(longest);
            self.step(shape, way, h);
            if before.value() * self.value() < 0.0 {
                h = before.way_to_zero(shape, way, h, self.value());
                *self = before;
                self.step(shape, way, h);
                self.0[0] = 0.0;
            }
            left -= h;
            // Nothing changes any more, or nothing is left of it.
            if left <= 0.0 || self.value() == before.value() || !self.value().is_finite() {
                return;
            }
        }
    }

    /// How far from here, before `h`, it passes zero, where its slope has a kink: by the rule of false position.
    fn way_to_zero(&self, shape: &Shape, way: f64, h: f64, end: f64) -> f64 {
        let (mut from, mut to) = ((0.0, self.value()), (h, end));
        let mut at = h;
        for _ in 0..CROSSING {
            at = from.0 - from.1 * (to.0 - from.0) / (to.1 - from.1);
            let mut there = *self;
            there.step(shape, way, at);
            let zeta = there.value();
            if zeta == 0.0 {
                break;
            }
            *(if zeta * self.value() > 0.0 { &mut from } else { &mut to }) = (at, zeta);
        }
        at
    }

    /// Moves on by `dx` in so many steps, whatever the shape: a smooth function of it.
    pub(super) fn advance_in(&mut self, steps: usize, shape: &Shape, dx: f64) {
        let h = dx.abs() / steps as f64;
        (0..steps).for_each(|_| self.step(shape, sign(dx), h));
    }

    fn step(&mut self, shape: &Shape, way: f64, h: f64) {
        let along = |k: &[f64; 4], h: f64| std::array::from_fn(|i| self.0[i] + h * k[i]);
        let k1 = slope(shape, way, &self.0);
        let k2 = slope(shape, way, &along(&k1, h / 2.0));
        let k3 = slope(shape, way, &along(&k2, h / 2.0));
        let k4 = slope(shape, way, &along(&k3, h));
        self.0 = std::array::from_fn(|i| self.0[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
}

/// `d / d|x|`.
fn slope(p: &Shape, way: f64, &[zeta, dg, dd, dnu]: &[f64; 4]) -> [f64; 4] {
    let (size, side) = (zeta.abs(), sign(zeta));
    let lost = power(size, p.nu);
    let drag = p.g * side + p.d * way;
    let B = if size > 0.0 { -p.nu * lost / size * side * drag } else { 0.0 };
    let ln = if size > 0.0 { size.ln() } else { 0.0 };
    [way - lost * drag, B * dg - lost * side, B * dd - lost * way, B * dnu - lost * ln * drag]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_result() {
        let path = |p: Shape| {
            let mut zeta = Zeta::default();
            (1..400).for_each(|t| zeta.advance(&p, 0.3 * (t as f64 * 0.05).cos()));
            zeta
        };
        let p = Shape { g: 0.7, d: 0.2, nu: 1.4 };
        let at = path(p);
        let moved =
            [Shape { g: p.g + 1e-6, ..p }, Shape { d: p.d + 1e-6, ..p }, Shape { nu: p.nu + 1e-6, ..p }];
        for (i, moved) in moved.into_iter().enumerate() {
            let slope = (path(moved).value() - at.value()) / 1e-6;
            assert!((slope - at.0[i + 1]).abs() < 1e-4 * (1.0 + slope.abs()), "{i} {slope} {:?}", at.0);
        }
    }

    /// nu = 1, x rising from rest: zeta = (1 - exp(-(g + d) x)) / (g + d).
    #[test]
    fn a_virgin_branch_is_an_exponential() {
        let p = Shape { g: 1.5, d: 0.5, nu: 1.0 };
        for x in [0.01, 0.3, 2.0, 1e6] {
            let mut zeta = Zeta::default();
            zeta.advance(&p, x);
            let exact = (1.0 - (-2.0 * x).exp()) / 2.0;
            assert!((zeta.value() - exact).abs() < 1e-6, "{x} {} {exact}", zeta.value());
        }
    }
}
