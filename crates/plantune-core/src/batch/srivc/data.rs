//! The data of a refined instrumental variable fit, and its regressions at one dead time.
//!
//! ```text
//! y_f = -a_1 y_f' - … - a_n y_f^(n) + b_0 u_f + … + b_(nb-1) u_f^(nb-1) + O + free response
//! ```
//!
//! with `y_f = y / A`, `u_f = u(t - L) / A`. The instruments are the same columns with the simulated output in
//! place of `y`. With `R` of the QR of `[Z | Phi | y_f]`, `Z' Phi theta = Z' y_f` is `R_ZPhi theta = R_Zy`, so no
//! product of columns is ever formed.

use std::ops::Range;

use super::filter::Filter;
use crate::linalg::{Block, Segmented, Solution, Triangle, left_divide, residual_norm2, solve};
use crate::poly::{product, roots};
use crate::record::{Record, Scale};

/// Pivots below this share mean that the data do not tell parameters apart.
const RANK_TOLERANCE: f64 = 1e-13;

/// Centred and scaled columns, time in samples.
pub(super) struct Data {
    pub(super) n: usize,
    pub(super) nb: usize,
    pub(super) offset: bool,
    pub(super) u: Vec<f64>,
    pub(super) y: Vec<f64>,
    pub(super) u_scale: Scale,
    pub(super) y_scale: Scale,
    /// A segment, and rows in it at which y counts.
    pub(super) stretches: Vec<(Range<usize>, Range<usize>)>,
}

/// Rounds at one dead time: the most, and the relative change of `a` that ends them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rounds {
    pub(super) most: usize,
    pub(super) rest: f64,
}

/// A model at one dead time.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// `a_1 … a_n`.
    pub(super) a: Vec<f64>,
    /// `b_0 … b_(nb-1)`, then the offset.
    pub(super) b: Vec<f64>,
    /// Samples.
    pub(super) L: f64,
    /// Sum of squares of the simulation error.
    pub(super) rss: f64,
    /// Relative change of `a` in the last round.
    pub(super) moved: f64,
}

impl Data {
    pub(super) fn new(rec: &Record, n: usize, nb: usize, offset: bool) -> Self {
        let (u, y) = (rec.input(0), rec.output_held(0));
        let (u_scale, y_scale) = (Scale::of(&u, offset), Scale::of(&y, offset));
        let runs = rec.runs(0, 0, 0);
        let stretches = rec.segments().flat_map(|segment| {
            let inside: Vec<_> = runs.iter().filter(|run| segment.contains(&run.start)).cloned().collect();
            inside.into_iter().map(move |run| (segment.clone(), run))
        });
        Data {
            n,
            nb,
            offset,
            stretches: stretches.filter(|(_, run)| run.len() > n + 1).collect(),
            u: u.iter().map(|u| u_scale.apply(*u)).collect(),
            y: y.iter().map(|y| y_scale.apply(*y)).collect(),
            u_scale,
            y_scale,
        }
    }

    /// Columns that all stretches share beside `a`: b, and the constant.
    pub(super) fn linear(&self) -> usize {
        self.nb + usize::from(self.offset)
    }

    /// Rows left when the first `history` of each segment serve the delayed input.
    pub(super) fn used(&self, run: &(Range<usize>, Range<usize>), history: usize) -> Range<usize> {
        run.1.start.max(run.0.start + history).min(run.1.end)..run.1.end
    }

    /// Number of those rows.
    pub(super) fn rows(&self, history: usize) -> usize {
        self.stretches.iter().map(|run| self.used(run, history).len()).sum()
    }

    /// Rounds from `a` at one dead time, until `a` rests or the most are done.
    pub(super) fn at_delay(&self, L: f64, a: &[f64], rounds: Rounds, history: usize) -> Option<Point> {
        let (mut a, mut b, mut moved) = (a.to_vec(), None, f64::INFINITY);
        for _ in 0..rounds.most {
            let (new, numerator) = self.round(&a, b.as_deref(), L, history)?;
            let first = b.is_none();
            moved = new.iter().zip(&a).map(|(new, a)| ((new - a) / a).abs()).fold(0.0, f64::max);
            (a, b) = (new, Some(numerator));
            if moved < rounds.rest && !first {
                break;
            }
        }
        self.simulated(&a, L, history).map(|(b, rss)| Point { a, b, L, rss, moved })
    }

    /// One round: `a` and `b` by instruments, or by least squares where no `b` simulates them yet.
    fn round(&self, a: &[f64], b: Option<&[f64]>, L: f64, history: usize) -> Option<(Vec<f64>, Vec<f64>)> {
        let (n, linear) = (self.n, self.linear());
        let filter = Filter::new(a)?;
        let p = n + linear;
        let mut problem = Segmented::new(n, p + n);
        for stretch in &self.stretches {
            let (rows, from) = (self.used(stretch, history), stretch.1.start);
            let zy = filter.linear(&self.y[stretch.1.clone()]);
            let zu = filter.late(&self.u[stretch.0.clone()], L);
            let zx = b.map(|b| filter.linear(&self.answer(&zu, b)[from - stretch.0.start..]));
            let free = filter.free(rows.len());
            let instrument = zx.as_ref().unwrap_or(&zy);
            problem.push(triangle(2 * n + p + 1, rows.clone(), |k, row| {
                let (own, late) = ((n + 1) * (k - from), (n + 1) * (k - stretch.0.start));
                row.extend(&free[(k - rows.start) * n..][..n]);
                row.extend(instrument[own + 1..][..n].iter().map(|z| -z));
                row.extend(&zu[late..][..self.nb]);
                row.extend(self.offset.then_some(1.0));
                row.extend(zy[own + 1..][..n].iter().map(|z| -z));
                row.push(zy[own]);
            }));
        }
        let R = problem.common();
        let column = |j: usize| if j < n { p + j } else { j };
        let theta = equilibrated(p, |i, j| R.at(i, if j == p { p + n } else { column(j) }))?;
        Some((stable(&theta[..n])?, theta[n..n + self.nb].to_vec()))
    }

    /// `sum_k b_k u_f^(k)` of the rows of a segment.
    pub(super) fn answer(&self, zu: &[f64], b: &[f64]) -> Vec<f64> {
        zu.chunks(self.n + 1).map(|row| row.iter().zip(&b[..self.nb]).map(|(z, b)| z * b).sum()).collect()
    }

    /// `b, O` by least squares on the simulated output, and the sum of squares that they leave.
    pub(super) fn simulated(&self, a: &[f64], L: f64, history: usize) -> Option<(Vec<f64>, f64)> {
        let mut problem = Segmented::new(self.n, self.linear());
        let filter = Filter::new(a)?;
        for stretch in &self.stretches {
            let rows = self.used(stretch, history);
            let zu = filter.late(&self.u[stretch.0.clone()], L);
            let free = filter.free(rows.len());
            problem.push(triangle(self.n + self.linear() + 1, rows.clone(), |k, row| {
                row.extend(&free[(k - rows.start) * self.n..][..self.n]);
                row.extend(&zu[(self.n + 1) * (k - stretch.0.start)..][..self.nb]);
                row.extend(self.offset.then_some(1.0));
                row.push(self.y[k]);
            }));
        }
        let every: Vec<usize> = (0..self.linear()).collect();
        let solution = solve(problem.common(), &every, self.linear(), RANK_TOLERANCE).ok()?;
        (solution.rss.is_finite()).then_some((solution.theta, solution.rss))
    }

    /// Sum of squares that free responses and the constant leave.
    pub(super) fn without_input(&self, point: &Point, history: usize) -> f64 {
        let own: Vec<usize> = (self.n + self.nb..self.n + self.linear()).collect();
        let left = |R: Triangle| residual_norm2(&R, &own, R.n() - 1, RANK_TOLERANCE);
        self.gradient(point, history).map_or(f64::INFINITY, left)
    }

    /// Triangle of the derivatives of the simulated output to `a, b, O, L`, and of y; the free responses are
    /// projected out. The derivative to `a_k` is `-x^(k)/A`, the instrument itself, that to `L` is `-x'`.
    fn gradient(&self, point: &Point, history: usize) -> Option<Triangle> {
        let n = self.n;
        let filter = Filter::new(&point.a)?;
        let mut problem = Segmented::new(n, n + self.linear() + 1);
        for stretch in &self.stretches {
            let (rows, from) = (self.used(stretch, history), stretch.0.start);
            let zu = filter.late(&self.u[stretch.0.clone()], point.L);
            let zx = filter.linear(&self.answer(&zu, &point.b));
            let free = filter.free(rows.len());
            problem.push(triangle(2 * n + self.linear() + 2, rows.clone(), |k, row| {
                let at = (n + 1) * (k - from);
                row.extend(&free[(k - rows.start) * n..][..n]);
                row.extend(zx[at + 1..][..n].iter().map(|z| -z));
                row.extend(&zu[at..][..self.nb]);
                row.extend(self.offset.then_some(1.0));
                row.push(-zu[at + 1..][..self.nb].iter().zip(&point.b).map(|(z, b)| z * b).sum::<f64>());
                row.push(self.y[k]);
            }));
        }
        Some(problem.common().clone())
    }

    /// Measured and simulated output of each stretch, on the rows that count.
    pub(super) fn answers(&self, point: &Point, history: usize) -> Vec<(Vec<f64>, Vec<f64>)> {
        let Some(filter) = Filter::new(&point.a) else { return Vec::new() };
        let one = |stretch: &(Range<usize>, Range<usize>)| {
            let (rows, from) = (self.used(stretch, history), stretch.0.start);
            let x = self.answer(&filter.late(&self.u[stretch.0.clone()], point.L), &point.b);
            (self.y[rows.clone()].to_vec(), x[rows.start - from..rows.end - from].to_vec())
        };
        self.stretches.iter().map(one).collect()
    }

    /// `(J'J)^-1` of `a, b, O, L`, and the step of Gauss and Newton in `a` and `L`.
    pub(super) fn information(&self, point: &Point, history: usize) -> Option<Solution> {
        let R = self.gradient(point, history)?;
        let every: Vec<usize> = (0..R.n() - 1).collect();
        solve(&R, &every, R.n() - 1, RANK_TOLERANCE).ok()
    }
}

/// Triangle of rows that `fill` appends.
fn triangle(width: usize, rows: Range<usize>, fill: impl Fn(usize, &mut Vec<f64>)) -> Triangle {
    let (mut triangle, mut block) = (Triangle::new(width), Block::new(width));
    let mut row = Vec::with_capacity(width);
    for k in rows {
        row.clear();
        fill(k, &mut row);
        block.push(&row);
    }
    triangle.absorb(&mut block);
    triangle
}

/// Solution of `sum_j m(i, j) x_j = m(i, p)`, its columns and rows brought to one size first.
fn equilibrated(p: usize, m: impl Fn(usize, usize) -> f64) -> Option<Vec<f64>> {
    let columns: Vec<f64> = (0..p).map(|j| (0..p).map(|i| m(i, j).abs()).fold(0.0, f64::max)).collect();
    let size = |i: usize| (0..p).map(|j| (m(i, j) / columns[j]).abs()).fold(0.0, f64::max);
    let rows: Vec<f64> = (0..p).map(size).collect();
    let A: Vec<f64> = (0..p * p).map(|ij| m(ij / p, ij % p) / columns[ij % p] / rows[ij / p]).collect();
    let b: Vec<f64> = (0..p).map(|i| m(i, p) / rows[i]).collect();
    let x = left_divide(&A, &b, p)?;
    let x: Vec<f64> = x.iter().zip(&columns).map(|(x, c)| x / c).collect();
    x.iter().all(|x| x.is_finite()).then_some(x)
}

/// `a_1 … a_n` with the roots of `A(s)` that lie in the right half-plane reflected.
fn stable(a: &[f64]) -> Option<Vec<f64>> {
    let descending: Vec<f64> = a.iter().rev().copied().chain([1.0]).collect();
    let mut A = vec![1.0];
    for (re, im) in roots(&descending) {
        let re = -re.abs();
        if im == 0.0 {
            A = product(&A, &[1.0, -re]);
        } else if im > 0.0 {
            A = product(&A, &[1.0, -2.0 * re, re * re + im * im]);
        }
    }
    let last = A[A.len() - 1];
    A.pop();
    A.reverse();
    let a: Vec<f64> = A.iter().map(|c| c / last).collect();
    (a.len() == descending.len() - 1 && a.iter().all(|c| c.is_finite() && *c > 0.0)).then_some(a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poles_on_the_right_are_reflected() {
        // (s - 1)(s + 2) / -2
        let a = stable(&[-0.5, -0.5]).expect("stable");
        assert!((a[0] - 1.5).abs() < 1e-14 && (a[1] - 0.5).abs() < 1e-14);
    }
}
