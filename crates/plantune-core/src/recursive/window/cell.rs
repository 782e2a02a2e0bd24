//! The search in one cell of the delay: `L = m Ts + f`, `0 <= f < Ts`, the whole samples `m` given.
//!
//! ```text
//! eps(t) = y(t) - a y(t-1) - b1 u(t-m-1) - b2 u(t-m-2) - d - c eps(t-1)
//! psi(t) = phi(t) - c psi(t-1),   phi = [y(t-1), u(t-m-1), u(t-m-2), eps(t-1), 1]
//! ```
//!
//! `d` and the error before the first row belong to each stretch; that error is one of those whose squares are
//! summed. A cell holds a plant where `b1` and `b2` have one sign ([`crate::model::Fopdt`]); where they differ,
//! the minimum lies on its edge, `f = 0`, and `b2` is left out.
//!
//! The noise on y is white, `c = -a`, unless the rows speak against it; then `c` is free, but no less than `-a`,
//! which would be noise without low frequencies. Without that bound `c` ends at -1 in every fourth short record,
//! where a free level can take the noise away with it, and the level seems known far too well.

use std::ops::Range;

use crate::linalg::{Block, Minimum, Residuals, Triangle, minimise, residual_norm2};

/// Largest root of `C`.
const MOST_C: f64 = 0.98;

/// Mean squared error, of an output of about one, that is rounding.
pub(super) const EXACT: f64 = 1e-25;

/// Fall of the squared errors, in variances, at which c is free: two standard deviations.
const COLOURED: f64 = 4.0;

/// Parts of the rows whose sums are compared.
const BLOCKS: usize = 12;

/// Columns that belong to a stretch: `d` and the error before it.
pub(super) const OWN: usize = 2;

/// Columns of a, b1, b2 and c.
pub(super) const SHARED: usize = 4;

/// Centred and scaled signals, and the stretches of rows whose errors count.
pub(super) struct Rows {
    pub(super) u: Vec<f64>,
    pub(super) y: Vec<f64>,
    /// Whether the error of a row counts.
    pub(super) counts: Vec<bool>,
    pub(super) stretches: Vec<Range<usize>>,
    /// Bounds of `a`.
    pub(super) a: (f64, f64),
}

impl Rows {
    /// Squared errors in the sum.
    pub(super) fn N(&self) -> usize {
        let rows: usize = self.stretches.iter().map(|s| s.clone().filter(|&t| self.counts[t]).count()).sum();
        rows + self.stretches.len()
    }
}

/// Which of the coefficients are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Free {
    /// `b2`; otherwise it is 0.
    pub(super) b2: bool,
    /// `c`; otherwise it is `-a`.
    pub(super) c: bool,
}

/// The minimum of a cell.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// `a, b1, b2, c`, then `d` and the error before each stretch.
    pub(super) theta: Vec<f64>,
    pub(super) free: Free,
    pub(super) cost: f64,
}

impl Found {
    /// Number of parameters searched.
    pub(super) fn parameters(&self) -> usize {
        self.theta.len() - usize::from(!self.free.b2) - usize::from(!self.free.c)
    }
}

/// The best plant of the cell, from the coefficients of the last fit; `inside` allows a fraction of a sample.
pub(super) fn search(rows: &Rows, m: usize, start: [f64; SHARED], inside: bool) -> Option<Found> {
    let best = |b2: bool| {
        let white = descend(rows, m, start, Free { b2, c: false })?;
        let mut last = [0.0; SHARED];
        last.copy_from_slice(&white.theta[..SHARED]);
        let coloured = is_coloured(rows, m, &white).then(|| descend(rows, m, last, Free { b2, c: true }));
        let sound = |found: &Found| found.theta[3] > -found.theta[0] && found.cost < white.cost;
        Some(coloured.flatten().filter(sound).unwrap_or(white))
    };
    let held = |found: &Found| found.theta[1] * found.theta[2] >= 0.0;
    if inside { best(true).filter(held).or_else(|| best(false)) } else { best(false) }
}

fn descend(rows: &Rows, m: usize, start: [f64; SHARED], free: Free) -> Option<Found> {
    let mut cell = Cell::new(rows, m, free);
    let [a, b1, b2, c] = start;
    let mut theta = vec![a];
    theta.extend(if free.b2 { vec![b1, b2] } else { vec![b1 + b2] });
    theta.extend(free.c.then_some(c));
    theta.resize(cell.n(), 0.0);
    let Minimum { theta, cost, .. } = minimise(&mut cell, theta)?;
    Some(Found { theta: cell.all(&theta), free, cost })
}

/// Whether a free c would lower the squared errors by more than chance.
fn is_coloured(rows: &Rows, m: usize, white: &Found) -> bool {
    let all = Free { b2: true, c: true };
    let Some(triangle) = linearised(rows, m, &white.theta, all) else { return false };
    let columns = |own: usize| (0..own).chain(SHARED..white.theta.len()).collect::<Vec<_>>();
    let b = if white.free.b2 { 3 } else { 2 };
    let mut with = columns(b);
    with.push(3);
    let left = residual_norm2(&triangle, &with, white.theta.len(), 1e-9);
    let s2 = left / (rows.N() - with.len()).max(1) as f64;
    white.cost > EXACT * rows.N() as f64 && white.cost - left > COLOURED * s2
}

/// The triangle at `a, b1, b2, c` and what belongs to the stretches, with columns of those that are free.
pub(super) fn linearised(rows: &Rows, m: usize, theta: &[f64], free: Free) -> Option<Triangle> {
    Cell::new(rows, m, free).linearise(&searched(theta, free))
}

fn searched(theta: &[f64], free: Free) -> Vec<f64> {
    let is_searched = |j: usize| (free.b2 || j != 2) && (free.c || j != 3);
    theta.iter().enumerate().filter(|&(j, _)| is_searched(j)).map(|(_, x)| *x).collect()
}

/// `S`, the covariance of `sum psi eps` as the sums over [`BLOCKS`] equal parts of the rows scatter; (n, n) row-major.
pub(super) fn scatter(rows: &Rows, m: usize, theta: &[f64], free: Free) -> Vec<f64> {
    let cell = Cell::new(rows, m, free);
    let (n, N) = (cell.n(), rows.N());
    let mut sums = vec![0.0; BLOCKS * n];
    let mut k = 0;
    cell.each_row(&searched(theta, free), |row| {
        let sum = &mut sums[(k * BLOCKS / N).min(BLOCKS - 1) * n..][..n];
        sum.iter_mut().zip(row).for_each(|(sum, psi)| *sum += psi * row[n]);
        k += 1;
    });
    let mean: Vec<f64> =
        (0..n).map(|j| (0..BLOCKS).map(|b| sums[b * n + j]).sum::<f64>() / BLOCKS as f64).collect();
    let off = |b: usize, j: usize| sums[b * n + j] - mean[j];
    let share = BLOCKS as f64 / (BLOCKS - 1) as f64;
    (0..n * n).map(|ij| share * (0..BLOCKS).map(|b| off(b, ij / n) * off(b, ij % n)).sum::<f64>()).collect()
}

/// One delay, and which coefficients are searched.
struct Cell<'r> {
    rows: &'r Rows,
    m: usize,
    free: Free,
}

impl<'r> Cell<'r> {
    fn new(rows: &'r Rows, m: usize, free: Free) -> Self {
        Cell { rows, m, free }
    }

    fn n(&self) -> usize {
        2 + usize::from(self.free.b2) + usize::from(self.free.c) + OWN * self.rows.stretches.len()
    }

    /// All coefficients from those that are searched.
    fn all(&self, theta: &[f64]) -> Vec<f64> {
        let (a, b1) = (theta[0], theta[1]);
        let b2 = if self.free.b2 { theta[2] } else { 0.0 };
        let shared = self.n() - OWN * self.rows.stretches.len();
        let c = if self.free.c { theta[shared - 1] } else { -a };
        [&[a, b1, b2, c], &theta[shared..]].concat()
    }
}

impl Cell<'_> {
    /// Visits the rows `psi, eps` that count.
    fn each_row(&self, theta: &[f64], mut visit: impl FnMut(&[f64])) {
        let n = self.n();
        let all = self.all(theta);
        let (a, b1, b2, c) = (all[0], all[1], all[2], all[3]);
        let Rows { u, y, counts, stretches, .. } = self.rows;
        let Free { b2: fraction, c: coloured } = self.free;
        let shared = n - OWN * stretches.len();
        let mut row = vec![0.0; n + 1];
        for (s, stretch) in stretches.iter().enumerate() {
            let own = shared + OWN * s;
            let (d, mut eps) = (all[SHARED + OWN * s], all[SHARED + OWN * s + 1]);
            let mut psi = [0.0; SHARED];
            row.fill(0.0);
            (row[own + 1], row[n]) = (-1.0, eps); // the error before: its own derivative is 1
            visit(&row);
            for t in stretch.clone() {
                let last = eps;
                let phi = [y[t - 1], u[t - self.m - 1], if fraction { u[t - self.m - 2] } else { 0.0 }, last];
                eps = y[t] - a * phi[0] - b1 * phi[1] - b2 * phi[2] - d - c * last;
                for (psi, phi) in psi.iter_mut().zip(phi) {
                    *psi = phi - c * *psi;
                }
                row[0] = if coloured { psi[0] } else { psi[0] - psi[3] };
                row[1] = psi[1];
                if fraction {
                    row[2] = psi[2];
                }
                if coloured {
                    row[shared - 1] = psi[3];
                }
                row[own] = 1.0 - c * row[own];
                row[own + 1] *= -c;
                row[n] = eps;
                if counts[t] {
                    visit(&row);
                }
            }
        }
    }
}

impl Residuals for Cell<'_> {
    fn linearise(&mut self, theta: &[f64]) -> Option<Triangle> {
        let n = self.n();
        let mut block = Block::new(n + 1);
        self.each_row(theta, |row| block.push(row));
        let mut triangle = Triangle::new(n + 1);
        triangle.absorb(&mut block);
        (0..=n).all(|i| triangle.at(i, n).is_finite()).then_some(triangle)
    }

    fn project(&self, theta: &mut [f64]) {
        theta[0] = theta[0].clamp(self.rows.a.0, self.rows.a.1);
        if self.free.c {
            let shared = self.n() - OWN * self.rows.stretches.len();
            theta[shared - 1] = theta[shared - 1].clamp(-MOST_C, MOST_C);
        }
    }

    fn exact(&self) -> f64 {
        EXACT * self.rows.N() as f64
    }
}
