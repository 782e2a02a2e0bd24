//! Output error: the parameters whose simulated displacement is nearest to the measured one.
//!
//! ```text
//! min over theta:   sum (y(t) - yhat(t, theta))^2        by Levenberg and Marquardt on the slopes of the oscillator
//! ```

use super::BoucWen;
use super::spline::{Between, Hold};
use super::tangent::{COLUMNS, Tangent};
use crate::linalg::{Block, Residuals, Triangle, dot};

/// Range of nu that is searched.
pub(super) const NU: (f64, f64) = (0.3, 5.0);

/// The record, and which of the ten columns `m c k alpha bg bd nu y0 v0 z0` are free.
pub(super) struct OutputError<'d> {
    pub(super) u: Between<'d>,
    pub(super) y: &'d [f64],
    pub(super) Ts: f64,
    pub(super) steps: usize,
    /// All ten; those not free stay.
    pub(super) theta: [f64; COLUMNS],
    pub(super) free: Vec<usize>,
}

impl<'d> OutputError<'d> {
    pub(super) fn new(u: &'d [f64], y: &'d [f64], Ts: f64, model: &BoucWen, x0: [f64; 3]) -> Self {
        let [y0, v0, z0] = x0;
        let m = model;
        OutputError {
            u: Between::new(u, Hold::Spline),
            y,
            Ts,
            steps: m.steps(Ts),
            theta: [m.m, m.c, m.k, m.alpha, m.bg, m.bd, m.nu, y0, v0, z0],
            free: Vec::new(),
        }
    }

    /// All ten, the free ones as given.
    pub(super) fn filled(&self, free: &[f64]) -> [f64; COLUMNS] {
        let mut theta = self.theta;
        self.free.iter().zip(free).for_each(|(&j, x)| theta[j] = *x);
        theta
    }

    /// What the free ones are now.
    pub(super) fn begin(&self) -> Vec<f64> {
        self.free.iter().map(|&j| self.theta[j]).collect()
    }
}

/// Parameters and initial state out of the ten.
pub(super) fn parted(theta: &[f64; COLUMNS]) -> (BoucWen, [f64; 3]) {
    let [m, c, k, alpha, bg, bd, nu, y0, v0, z0] = *theta;
    (BoucWen { m, c, k, alpha, bg, bd, nu, Ts: None }, [y0, v0, z0])
}

impl Residuals for OutputError<'_> {
    fn linearise(&mut self, free: &[f64]) -> Option<Triangle> {
        let (model, x0) = parted(&self.filled(free));
        let width = self.free.len() + 1;
        let (mut triangle, mut block) = (Triangle::new(width), Block::new(width));
        let mut row = vec![0.0; width];
        let mut points = vec![0.0; 2 * self.steps + 1];
        let mut tangent = Tangent::new(x0);
        for (t, y) in self.y.iter().enumerate() {
            if t > 0 {
                self.u.fill(t - 1, &mut points);
                tangent.over_sample(&model, &points, self.Ts);
            }
            row.iter_mut().zip(&self.free).for_each(|(x, &j)| *x = tangent.dy(j));
            row[width - 1] = y - tangent.y();
            if !row.iter().all(|x| x.abs() < 1e100) {
                return None;
            }
            block.push(&row);
        }
        triangle.absorb(&mut block);
        Some(triangle)
    }

    fn project(&self, free: &mut [f64]) {
        for (x, &j) in free.iter_mut().zip(&self.free) {
            match j {
                0 => *x = x.max(1e-2 * self.theta[0]),
                6 => *x = x.clamp(NU.0, NU.1),
                _ => {}
            }
        }
    }

    fn exact(&self) -> f64 {
        1e-24 * dot(self.y, self.y)
    }
}
