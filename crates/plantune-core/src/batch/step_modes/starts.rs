//! Where the search for k poles begins: the matrix pencil, repeated integrals, one lag more than the order below.
//!
//! None of them needs the level or the initial state. Over 300 records of the three lags 1.25, 3.25, 5.5 s at 0.1,
//! 1 and 5 % noise, at most one missed the least residual of all starts at order 3 or below.

use super::integrals::integrals;
use super::pencil::Pencil;
use super::search::{Data, Piece};
use crate::linalg::Complex;

/// Poles to start from, `k = 1, 2, …`.
pub(super) struct Starts<'d> {
    data: &'d Data,
    piece: &'d Piece,
    pencil: Pencil,
}

impl<'d> Starts<'d> {
    pub(super) fn new(data: &'d Data) -> Self {
        let piece = data.longest();
        Starts { data, piece, pencil: Pencil::new(&piece.t, &piece.y) }
    }

    /// Sets of k poles; `lower` are those of order k - 1.
    pub(super) fn of(&self, k: usize, lower: &[Complex<f64>]) -> Vec<Vec<Complex<f64>>> {
        let (t, y) = (&self.piece.t, &self.piece.y);
        let fastest = lower.iter().map(|p| p.norm()).fold(f64::NAN, f64::max);
        let rate = if fastest.is_nan() { 9.0 / t[t.len() - 1] } else { fastest };
        let added = lower.iter().copied().chain([Complex::new(-4.0 * rate, 0.0)]).collect();
        let found = [self.pencil.poles(k), integrals(t, y, k), Some(added)];
        found.into_iter().flatten().map(|poles| self.repaired(&poles)).collect()
    }

    /// Poles inside the reach: unstable ones reflected, rates cut to the range, half a pair taken as real.
    fn repaired(&self, poles: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let (fast, slow) = self.data.reach;
        let inside = |p: &Complex<f64>| {
            // A root at or below 0 in z has no logarithm that is real.
            if !(p.re.is_finite() && p.im.is_finite()) {
                return Complex::new(-fast, 0.0);
            }
            let size = p.norm();
            let re = if p.re == 0.0 { -1e-3 * size } else { -p.re.abs() };
            let p = Complex::new(re, p.im);
            if p.norm() == 0.0 { Complex::new(-slow, 0.0) } else { p * (size.clamp(slow, fast) / p.norm()) }
        };
        let all: Vec<Complex<f64>> = poles.iter().map(inside).collect();
        let whole =
            |p: &Complex<f64>| p.im == 0.0 || all.iter().any(|o| (p.conj() - o).norm() < 1e-9 * p.norm());
        all.iter().map(|p| if whole(p) { *p } else { Complex::new(-p.norm(), 0.0) }).collect()
    }
}
