//! Variable projection: what enters linearly is solved for, and the search is over `g, d, nu` of zeta alone.
//!
//! ```text
//! min over g, d, nu   min over c   | b - [A, F zeta(g, d, nu)] c |^2
//! ```
//!
//! `A` and `b` are given, zeta is driven by a given path, and F is a filter or nothing. The slopes of the projected
//! residual are those of zeta times its coefficient, projected likewise (Kaufman, BIT 15, 1975): what is left of the
//! triangle of `[A, F zeta | F dzeta | b]` without its first rows.

use super::force::{Shape, Zeta};
use super::output_error::NU;
use super::start::StateVariables;
use crate::linalg::{Block, Minimum, Residuals, Triangle, dot, minimise, solve};

/// Where searches begin: `g, d, nu`, in units of the largest displacement.
pub(super) const STARTS: [[f64; 3]; 4] =
    [[0.5, 0.0, 1.0], [0.5, -0.5, 1.0], [1.0, 0.5, 1.0], [2.0, 0.0, 2.0]];

/// Evaluations from each start, and from the best of them on.
const FEW: usize = 12;
const MANY: usize = 30;

/// Largest g and d that are searched.
const MOST: f64 = 20.0;

/// Longest step of the integrator along the path.
const STEP: f64 = 0.05;

/// Pivots below this share of the largest do not count.
const TOLERANCE: f64 = 1e-12;

/// Columns, right-hand side and the path.
pub(super) struct Projection {
    /// Rows `[A | b]`, one every `stride` points of the path, the first at point `skip`.
    pub(super) rows: Vec<Vec<f64>>,
    pub(super) path: Vec<f64>,
    pub(super) stride: usize,
    pub(super) skip: usize,
    pub(super) filter: Option<StateVariables>,
    /// Evaluations that a search may still spend. Where zeta passes zero at a sample the slopes jump, and near a
    /// minimum nothing comes of crossing these kinks one by one.
    pub(super) budget: usize,
    /// nu where it is known.
    pub(super) nu: Option<f64>,
}

impl Projection {
    /// The lowest of the minima from several starts: a few steps from each, the rest from the best.
    pub(super) fn search(&mut self) -> Option<Minimum> {
        let mut best: Option<Minimum> = None;
        for start in STARTS {
            let free = if self.nu.is_some() { &start[..2] } else { &start[..] };
            self.budget = FEW;
            let Some(found) = minimise(self, free.to_vec()) else { continue };
            if best.as_ref().is_none_or(|best| found.cost < best.cost) {
                best = Some(found);
            }
        }
        self.budget = MANY;
        minimise(self, best?.theta)
    }

    pub(super) fn shape(&self, theta: &[f64]) -> Shape {
        Shape { g: theta[0], d: theta[1], nu: self.nu.unwrap_or_else(|| theta[2]) }
    }

    /// Columns of A and the one of zeta.
    pub(super) fn linear(&self) -> usize {
        self.rows[0].len()
    }

    /// Triangle of `[A, F zeta | F dzeta/d(g, d, nu) | b]`.
    fn raw(&self, theta: &[f64]) -> Option<Triangle> {
        let shape = self.shape(theta);
        let slopes = theta.len();
        let linear = self.linear();
        let width = linear + slopes + 1;
        let (mut triangle, mut block) = (Triangle::new(width), Block::new(width));
        let mut row = vec![0.0; width];
        let mut zeta = Zeta::default();
        let mut filters = vec![self.filter.clone(); 1 + slopes];
        let mut rows = self.rows.iter();
        let mut before = self.path[0];
        for (t, &x) in self.path.iter().enumerate() {
            let last = zeta;
            let steps = ((x - before).abs() / STEP).ceil() as usize;
            zeta.advance_in(steps, &shape, x - before);
            before = x;
            for (j, filter) in filters.iter_mut().enumerate() {
                row[linear - 1 + j] = match filter {
                    Some(filter) => filter.step(last.0[j], zeta.0[j]),
                    None => zeta.0[j],
                };
            }
            if t < self.skip || !(t - self.skip).is_multiple_of(self.stride) {
                continue;
            }
            let Some(given) = rows.next() else { break };
            row[..linear - 1].copy_from_slice(&given[..linear - 1]);
            row[width - 1] = given[linear - 1];
            if !row.iter().all(|x| x.abs() < 1e100) {
                return None;
            }
            block.push(&row);
        }
        triangle.absorb(&mut block);
        Some(triangle)
    }

    /// Coefficients of A and zeta.
    pub(super) fn coefficients(&self, theta: &[f64]) -> Option<Vec<f64>> {
        let triangle = self.raw(theta)?;
        self.solved(&triangle)
    }

    fn solved(&self, triangle: &Triangle) -> Option<Vec<f64>> {
        let columns: Vec<usize> = (0..self.linear()).collect();
        solve(triangle, &columns, triangle.n() - 1, TOLERANCE).ok().map(|s| s.theta)
    }

    /// The coefficients, and the triangle of all slopes: `[A, F zeta | c F dzeta | b]`.
    pub(super) fn full(&self, theta: &[f64]) -> Option<(Vec<f64>, Triangle)> {
        let triangle = self.raw(theta)?;
        let c = self.solved(&triangle)?;
        let scaled = scaled(&triangle, self.linear(), c[self.linear() - 1]);
        Some((c, scaled))
    }
}

/// The triangle with the columns of slopes times a factor.
fn scaled(triangle: &Triangle, linear: usize, factor: f64) -> Triangle {
    let n = triangle.n();
    let scale = |j: usize| if (linear..n - 1).contains(&j) { factor } else { 1.0 };
    let rows: Vec<Vec<f64>> =
        (0..n).map(|i| triangle.row(i).iter().enumerate().map(|(j, x)| x * scale(j)).collect()).collect();
    Triangle::of_rows(n, rows.iter().map(Vec::as_slice))
}

impl Residuals for Projection {
    fn linearise(&mut self, theta: &[f64]) -> Option<Triangle> {
        self.budget = self.budget.checked_sub(1)?;
        let (_, triangle) = self.full(theta)?;
        Some(triangle.below(self.linear()))
    }

    fn project(&self, theta: &mut [f64]) {
        theta[..2].iter_mut().for_each(|x| *x = x.clamp(-MOST, MOST));
        if let Some(nu) = theta.get_mut(2) {
            *nu = nu.clamp(NU.0, NU.1);
        }
    }

    fn exact(&self) -> f64 {
        let b: Vec<f64> = self.rows.iter().filter_map(|row| row.last().copied()).collect();
        1e-24 * dot(&b, &b)
    }
}
