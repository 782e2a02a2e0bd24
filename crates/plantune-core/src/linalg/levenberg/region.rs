//! The region where the linear model is trusted: `|D delta| <= radius`, D the largest lengths that the columns had.
//!
//! ```text
//! min |eps - psi delta|  with  |D delta| = radius:   (psi'psi + p D^2) delta = psi'eps
//! psi D^-1 = U S V':   D delta = V z,   z_i = s_i (U'eps)_i / (s_i^2 + p),   1/|z(p)| = 1/radius by Newton
//! ```
//!
//! With the largest lengths a column that dies on a plateau does not let its parameter run away: with those of the
//! moment three of NIST's 54 searches fail.
//!
//! Moré 1978; Hebden 1973.

use super::Minimum;
use crate::linalg::dot;
use crate::linalg::eigen::Singular;

/// The first radius in units of `|D theta|`.
const FIRST: f64 = 1.0;

/// Part of the promise below which the region shrinks, and above which it grows.
const POOR: f64 = 0.25;
const GOOD: f64 = 0.75;

/// Length of a column against the largest it had, below which it has died: its parameter is not identifiable there.
const DEAD: f64 = 1e-10;

/// A radius this small in units of `|D theta|` holds no step that changes anything.
const NO_STEP: f64 = 1e-15;

/// Steps of Newton for p, which meet the radius to [`CLOSE`] after two or three.
const ROUNDS: usize = 30;
const CLOSE: f64 = 0.01;

/// Radius and scales.
pub(super) struct Region {
    radius: f64,
    d: Vec<f64>, // (n)
}

impl Region {
    /// The first one.
    pub(super) fn around(start: &Minimum) -> Self {
        let d = start.lengths();
        let length = length(&start.theta, &d);
        Region { radius: FIRST * if length > 0.0 { length } else { start.cost.sqrt() }, d }
    }

    /// Takes the columns of a new point into account.
    pub(super) fn see(&mut self, point: &Minimum) {
        self.d.iter_mut().zip(point.lengths()).for_each(|(d, length)| *d = d.max(length));
    }

    /// Length of a step in radii.
    pub(super) fn size(&self, step: &[f64]) -> f64 {
        length(step, &self.d) / self.radius
    }

    /// Whether a step stays inside.
    pub(super) fn holds(&self, step: &[f64]) -> bool {
        self.size(step) <= 1.0
    }

    /// The best step of the linear model on the edge.
    pub(super) fn edge(&self, point: &Minimum) -> Vec<f64> {
        let scale: Vec<f64> = self.d.iter().map(|&d| if d > 0.0 { d } else { 1.0 }).collect();
        let svd = Singular::of(&point.triangle, &scale);
        let at = |p: f64| move |(s, c): (&f64, &f64)| if *s > 0.0 { s * c / (s * s + p) } else { 0.0 };
        let mut p = 0.0;
        let mut z: Vec<f64> = svd.values.iter().zip(&svd.rhs).map(at(p)).collect();
        for _ in 0..ROUNDS {
            let length2 = dot(&z, &z);
            let over = length2.sqrt() / self.radius - 1.0;
            if over <= CLOSE {
                break;
            }
            let share = |(z, s): (&f64, &f64)| if *z == 0.0 { 0.0 } else { z * z / (s * s + p) };
            p += over * length2 / z.iter().zip(&svd.values).map(share).sum::<f64>();
            z = svd.values.iter().zip(&svd.rhs).map(at(p)).collect();
        }
        svd.right(&z).iter().zip(&scale).map(|(x, d)| x / d).collect()
    }

    /// Learns which part of the promised decrease a step kept.
    pub(super) fn learn(&mut self, step: &[f64], kept: f64) {
        let size = self.size(step);
        if kept < POOR {
            self.radius *= (0.5 * size).min(1.0);
        } else if kept > GOOD {
            self.radius *= (2.0 * size).max(1.0);
        }
    }

    /// Shrinks after a step that led up, or out of what is finite.
    pub(super) fn shrink(&mut self, step: &[f64], finite: bool) {
        self.radius *= self.size(step).min(1.0) * if finite { 0.25 } else { 0.1 };
    }

    /// Whether no step inside changes anything.
    pub(super) fn is_nothing(&self, point: &Minimum) -> bool {
        self.radius <= NO_STEP * length(&point.theta, &self.d)
    }

    /// Whether a parameter has no say any more.
    pub(super) fn has_died(&self, point: &Minimum) -> bool {
        point.lengths().iter().zip(&self.d).any(|(length, d)| *length <= DEAD * d)
    }
}

/// `|D x|`
fn length(x: &[f64], d: &[f64]) -> f64 {
    x.iter().zip(d).map(|(x, d)| (x * d).powi(2)).sum::<f64>().sqrt()
}
