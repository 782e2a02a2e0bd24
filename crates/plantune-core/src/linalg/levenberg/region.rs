//! The region where the linear model is trusted: `|D delta| <= radius`, D the largest lengths that the columns had.
//!
//! ```text
//! min |eps - psi delta|  with  |D delta| = radius:   (psi'psi + p D^2) delta = psi'eps
//! psi D^-1 = U S V':   D delta = V z,   z_i = s_i (U'eps)_i / (s_i^2 + p),   1/|z(p)| = 1/radius by Newton
//! ```
//!
//! With the largest lengths a column that dies on a plateau does not let its parameter run away.
//!
//! Moré 1978; Hebden 1973.

use super::Minimum;
use crate::linalg::eigen::Singular;

/// The first radius in units of `|D theta|`; 1 and 10 solve all of NIST's problems, 0.1 and 100 do not.
const FIRST: f64 = 10.0;

/// Part of the promise below which the region shrinks, and above which it grows.
const POOR: f64 = 0.25;
const GOOD: f64 = 0.75;

/// Length of a column against the largest it had, below which it has died: its parameter is not identifiable there.
const DEAD: f64 = 1e-10;

/// A radius this small in units of `|D theta|` holds no step that changes anything.
const NO_STEP: f64 = 1e-15;

pub(super) struct Region {
    radius: f64,
    d: Vec<f64>,
}

impl Region {
    /// The first one.
    pub(super) fn around(start: &Minimum) -> Self {
        let mut region = Region { radius: 0.0, d: vec![0.0; start.theta.len()] };
        region.see(start);
        let size = region.length(&start.theta);
        region.radius = FIRST * if size > 0.0 { size } else { start.cost.sqrt() };
        region
    }

    /// Takes the lengths of the columns at a new point into account.
    pub(super) fn see(&mut self, point: &Minimum) {
        self.d.iter_mut().zip(point.lengths()).for_each(|(d, length)| *d = d.max(length));
    }

    /// `|D delta|`
    fn length(&self, step: &[f64]) -> f64 {
        step.iter().zip(&self.d).map(|(x, d)| (x * d).powi(2)).sum::<f64>().sqrt()
    }

    pub(super) fn holds(&self, step: &[f64]) -> bool {
        self.length(step) <= self.radius
    }

    /// The best step of the linear model on the edge of the region.
    pub(super) fn edge(&self, point: &Minimum) -> Vec<f64> {
        let scale: Vec<f64> = self.d.iter().map(|&d| if d > 0.0 { d } else { 1.0 }).collect();
        let svd = Singular::of(&point.triangle, &scale);
        let (s, c) = (&svd.values, &svd.rhs);
        let mut p = 0.0;
        let mut z = Vec::new();
        for _ in 0..30 {
            z = s.iter().zip(c).map(|(s, c)| if *s > 0.0 { s * c / (s * s + p) } else { 0.0 }).collect();
            let length2: f64 = z.iter().map(|z: &f64| z * z).sum();
            let over = length2.sqrt() / self.radius - 1.0;
            if over.abs() < 0.01 || over < 0.0 {
                break;
            }
            let slope: f64 = z.iter().zip(s).filter(|(_, s)| **s > 0.0).map(|(z, s)| z * z / (s * s + p)).sum();
            p += over * length2 / slope;
        }
        svd.right(&z).iter().zip(&scale).map(|(x, d)| x / d).collect()
    }

    /// Learns which part of the promised decrease a step kept.
    pub(super) fn learn(&mut self, step: &[f64], kept: f64) {
        let length = self.length(step);
        if kept < POOR {
            self.radius = self.radius.min(0.5 * length);
        } else if kept > GOOD {
            self.radius = self.radius.max(2.0 * length);
        }
    }

    /// Shrinks after a step that led up, or out of what is finite.
    pub(super) fn shrink(&mut self, step: &[f64], finite: bool) {
        self.radius = self.radius.min(self.length(step)) * if finite { 0.25 } else { 0.1 };
    }

    pub(super) fn is_nothing(&self, theta: &[f64]) -> bool {
        self.radius <= NO_STEP * self.length(theta)
    }

    /// Whether a parameter has lost its say.
    pub(super) fn has_died(&self, point: &Minimum) -> bool {
        point.lengths().iter().zip(&self.d).any(|(length, d)| *length <= DEAD * d)
    }
}
