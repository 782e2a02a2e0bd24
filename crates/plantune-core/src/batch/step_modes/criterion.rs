//! Criterion (15) of source 003 at one order and one lag.
//!
//! ```text
//! X*(n) = sum_j d_j y(n - j m),  sum_j d_j = 1,  j = 0 ... J       min over d, K of  sum_n (K - X*(n))^2
//! ```
//!
//! With `a` for the running sums of `d - [1, 0, ...]` it is linear, and differences of y keep the digits:
//!
//! ```text
//! y(n) = K + sum_j a_j [y(n - (j+1) m) - y(n - j m)],  j = 0 ... J-1
//! ```
//!
//! Roots of `d` are `e^(p m Ts)`. Rows that reach back before the first sample, or to one that does not count, are
//! left out, so the initial state is free.
//! This is linear prediction of a constant and exponentials (Prony); noise on y is on both sides of it and moves the
//! roots towards zero, as more noise would: [`Criterion::with_noise`] says how far. [`Criterion::shaken`] says how far
//! they scatter.

use crate::linalg::{Block, Complex, Triangle, solve};
use crate::poly;

/// Pivots below this share of the largest are rounding.
const RANK_TOLERANCE: f64 = 1e-15;

/// The rows of the problem as a triangle.
pub(super) struct Criterion {
    /// Order J.
    pub(super) order: usize,
    /// Samples m between the values of one row.
    pub(super) lag: usize,
    triangle: Triangle, // differences, 1, y
    known: bool,
    rows: usize,
}

impl Criterion {
    /// Fewest samples for as many rows as unknowns.
    pub(super) fn least(order: usize, lag: usize) -> usize {
        order.saturating_mul(lag).saturating_add(order + 2)
    }

    /// Of samples whose level is taken off where it is `known`; not a number where one does not count.
    pub(super) fn new(y: &[f64], order: usize, lag: usize, known: bool) -> Self {
        let (mut triangle, mut block) = (Triangle::new(order + 2), Block::new(order + 2));
        let (mut row, mut rows) = (vec![1.0; order + 2], 0);
        for n in order * lag..y.len() {
            let at = |j: usize| y[n - j * lag];
            (0..order).for_each(|j| row[j] = at(j + 1) - at(j));
            row[order + 1] = y[n];
            if row.iter().all(|x| x.is_finite()) {
                block.push(&row);
                rows += 1;
            }
        }
        triangle.absorb(&mut block);
        Criterion { order, lag, triangle, known, rows }
    }

    /// Whether there are as many rows as unknowns.
    pub(super) fn is_determined(&self) -> bool {
        self.rows >= self.order + 2
    }

    /// The same with the squares that white noise of this variance adds to every column once more.
    pub(super) fn with_noise(&self, variance: f64) -> Self {
        let (J, size) = (self.order, (self.rows as f64 * variance).sqrt());
        // What sample n - i m adds to each column.
        let added = |i: usize| -> Vec<f64> {
            let difference = |j: usize| f64::from(u8::from(i == j + 1)) - f64::from(u8::from(i == j));
            let columns = (0..J).map(difference).chain([0.0, f64::from(u8::from(i == 0))]);
            columns.map(|x| size * x).collect()
        };
        let own = (0..J + 2).map(|i| self.triangle.row(i).to_vec());
        let rows: Vec<Vec<f64>> = own.chain((0..=J).map(added)).collect();
        let triangle = Triangle::of_rows(J + 2, rows.iter().map(Vec::as_slice));
        Criterion { triangle, ..*self }
    }

    /// The same with `size` more of y in row `i` of the triangle: over all rows, what white errors of that size do.
    pub(super) fn shaken(&self, i: usize, size: f64) -> Self {
        let mut rows: Vec<Vec<f64>> = (0..self.order + 2).map(|k| self.triangle.row(k).to_vec()).collect();
        rows[i][self.order + 1] += size;
        let triangle = Triangle::of_rows(self.order + 2, rows.iter().map(Vec::as_slice));
        Criterion { triangle, ..*self }
    }

    /// Unknowns: the differences, and the level where it is free.
    pub(super) fn unknowns(&self) -> usize {
        self.order + usize::from(!self.known)
    }

    /// `d` at the minimum.
    pub(super) fn coefficients(&self) -> Option<Vec<f64>> {
        let J = self.order;
        let columns: Vec<usize> = (0..self.unknowns()).collect();
        let a = solve(&self.triangle, &columns, J + 1, RANK_TOLERANCE).ok()?.theta;
        let sum = |j: usize| if j < J { a[j] } else { 0.0 };
        Some((0..=J).map(|j| if j == 0 { 1.0 + sum(0) } else { sum(j) - sum(j - 1) }).collect())
    }

    /// The poles at this sample time; None where the roots are not those of a step response that settles.
    pub(super) fn poles(&self, Ts: f64) -> Option<Vec<Complex<f64>>> {
        let roots = poly::roots(&self.coefficients()?);
        let settles = |&(re, im): &(f64, f64)| re.hypot(im) < 1.0 && (im != 0.0 || re > 0.0);
        if roots.len() < self.order || !roots.iter().all(settles) {
            return None;
        }
        Some(roots.iter().map(|&(re, im)| Complex::new(re, im).ln() / (self.lag as f64 * Ts)).collect())
    }
}
