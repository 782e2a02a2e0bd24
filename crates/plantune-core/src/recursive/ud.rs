//! A covariance kept as `P = U D U'`, `U` unit upper triangular, `D` diagonal, and what happens to it.
//!
//! ```text
//! f = U' psi,  q = psi' P psi = sum_j D_j f_j^2
//! P <- (P - g P psi psi' P / (1 + g q)) / lambda        Bierman 1977, chapter V
//! P <- P + c x x'                                       Agee and Turner 1972
//! ```
//!
//! With `g = 1/lambda` the second line forgets by `lambda`; other `g` are other ways to forget. Neither needs
//! a square root: 1.5 n² steps each. A full matrix loses its symmetry and then diverges, the factors cannot.
//! The divisions of an update do not wait for one another: `beta_j = 1 + g q_j` of the partial sums `q_j` first,
//! their inverses side by side, then the chain of products.

use super::room::Room;
use crate::error::{Error, Result};
use crate::linalg::Triangle;

/// Where no data come, forgetting raises `D` by `1/lambda` a sample, and would overflow. Above this multiple
/// of the largest start value the rounding of `U' psi`, 1e-16 of it, would begin to count as information.
const MOST_FORGOTTEN: f64 = 1e12;

/// Largest start value: with the bound above, `psi' P psi` of any sensible `psi` stays a number.
pub(super) const LARGEST: f64 = 1e100;

/// `P` by its factors.
#[derive(Clone, Debug)]
pub struct Ud {
    U: Vec<f64>,    // above the diagonal, column by column: U01, U02, U12, U03, …
    D: Vec<f64>,    // (n)
    most: Vec<f64>, // (n) that `D` may become
    most_allowed: f64,
    x: Vec<f64>, // (n) what is left of `x` while it is added
}

impl Ud {
    /// `P0 I`, `n` by `n`.
    pub fn identity(n: usize, P0: f64) -> Result<Self> {
        if !(P0 > 0.0 && P0 <= LARGEST) {
            return Err(Error::argument("P0", P0, "positive, and at most 1e100"));
        }
        Ok(Ud::diagonal(vec![P0; n]))
    }

    /// A diagonal; what is zero on it is not in play.
    pub(super) fn diagonal(D: Vec<f64>) -> Self {
        let n = D.len();
        let largest = D.iter().copied().fold(0.0, f64::max);
        Ud {
            U: vec![0.0; n * n.saturating_sub(1) / 2],
            D,
            most: vec![MOST_FORGOTTEN * largest; n],
            most_allowed: f64::INFINITY,
            x: vec![0.0; n],
        }
    }

    /// The factors of `P`, `(n, n)` row-major.
    pub fn of_matrix(n: usize, P: &[f64]) -> Result<Self> {
        let wrong =
            |what: &str| Error::argument("P0", what, &format!("{n} by {n}, symmetric and positive definite"));
        if P.len() != n * n {
            return Err(wrong("of another size"));
        }
        let largest = (0..n).map(|i| P[i * n + i]).fold(0.0, f64::max);
        if !(largest > 0.0 && largest <= LARGEST) {
            return Err(wrong("not positive, or above 1e100"));
        }
        if (0..n * n).any(|k| !((P[k] - P[k % n * n + k / n]).abs() <= 1e-9 * largest)) {
            return Err(wrong("not symmetric"));
        }
        // From the last column to the first: D_j = P_jj, U_ij = P_ij / D_j, P <- P - U_j D_j U_j'.
        let mut P = P.to_vec();
        let mut ud = Ud::diagonal(vec![largest; n]);
        for j in (0..n).rev() {
            let D = P[j * n + j];
            if !(D > 0.0) {
                return Err(wrong("not positive definite"));
            }
            for i in 0..j {
                let U = P[i * n + j] / D;
                (0..=i).for_each(|k| P[k * n + i] -= U * P[k * n + j]);
                ud.U[j * (j - 1) / 2 + i] = U;
            }
            ud.D[j] = D;
        }
        Ok(ud)
    }

    /// With the same bound, `(R' R)^-1` of the first `n` columns of a triangle without zeros on its diagonal: `R^-1`
    /// is `U sqrt(D)`, so that nothing is squared and nothing lost.
    pub(super) fn replaced(&self, R: &Triangle) -> Self {
        let n = self.n();
        let mut ud = Ud::diagonal((0..n).map(|j| R.at(j, j).powi(-2)).collect());
        for j in 0..n {
            let column = j * j.saturating_sub(1) / 2;
            for i in (0..j).rev() {
                let below: f64 = (i + 1..j).map(|k| R.at(i, k) * ud.U[column + k]).sum();
                ud.U[column + i] = -(below + R.at(i, j)) / R.at(i, i);
            }
        }
        ud.bound(self.most_allowed);
        ud
    }

    /// Bounds all of `D`, so that nothing is known less than this.
    pub fn bound(&mut self, most: f64) {
        self.most_allowed = most;
        self.most.iter_mut().for_each(|bound| *bound = bound.min(most));
        self.D.iter_mut().for_each(|D| *D = D.min(most));
    }

    /// Brings parameter `j`, which is not in play, into it; nothing is known less of it later.
    pub(super) fn open(&mut self, j: usize, D: f64, most: f64) {
        self.D[j] = D.min(self.most_allowed);
        self.most[j] = most.min(self.most_allowed);
    }

    /// `q = psi' P psi` of the `psi` in the room, and what [`Ud::update`] needs of it.
    ///
    /// `n` is the size, again: where the caller knows it all loops unroll, the inner ones as well, for which they
    /// must not end at `j`. Sums begin with -0.0, to which the first term is added without a step.
    #[inline(always)]
    pub fn weigh(&self, n: usize, room: &mut Room<'_>) -> f64 {
        let (U, D, psi) = (&self.U[..n * (n - 1) / 2], &self.D[..n], &room.psi[..n]);
        let (f, q) = (&mut room.f[..n], &mut room.q[..n]);
        let (mut sum, mut column) = (-0.0, 0);
        for j in 0..n {
            let mut x = -0.0;
            for i in 0..n {
                if i < j {
                    x += U[column + i] * psi[i];
                }
            }
            x += psi[j];
            sum += x * x * D[j];
            (f[j], q[j]) = (x, sum);
            column += j;
        }
        sum
    }

    /// `P <- (P - g P psi psi' P / (1 + g q)) / lambda` for the `psi` weighed last; `per_lambda = 1/lambda`.
    ///
    /// Leaves `P psi` of before in `room.b` and returns `1 / (1 + g q)`, which must be positive.
    #[inline(always)]
    pub fn update(&mut self, n: usize, room: &mut Room<'_>, g: f64, per_lambda: f64) -> f64 {
        let (U, D, most) = (&mut self.U[..n * (n - 1) / 2], &mut self.D[..n], &self.most[..n]);
        let (f, q) = (&room.f[..n], &room.q[..n]);
        let (b, inverse) = (&mut room.b[..n], &mut room.inverse[..n]);
        for j in 0..n {
            inverse[j] = 1.0 / (1.0 + g * q[j]);
        }
        let (mut before, mut slope, mut column) = (1.0, -g, 0);
        for j in 0..n {
            let gain = D[j] * f[j];
            let rest = D[j] * (before * inverse[j]) * per_lambda;
            D[j] = if rest < most[j] { rest } else { most[j] };
            let turn = f[j] * slope;
            for i in 0..n {
                if i < j {
                    let old = U[column + i];
                    U[column + i] = old + b[i] * turn;
                    b[i] += old * gain;
                }
            }
            b[j] = gain;
            before = 1.0 + g * q[j];
            slope = -g * inverse[j];
            column += j;
        }
        inverse[n - 1]
    }

    /// `P <- P + c x x'` with `c >= 0`.
    pub fn add(&mut self, c: f64, x: &[f64]) {
        self.x.copy_from_slice(x);
        self.add_x(c, x.len());
    }

    /// Adds `c >= 0` to the variance of parameter `j` alone.
    pub fn add_to(&mut self, j: usize, c: f64) {
        self.x[..j].fill(0.0);
        self.x[j] = 1.0;
        self.add_x(c, j + 1);
    }

    /// `P <- P + c x x'` of an `x` of which the first `n` entries may differ from zero.
    fn add_x(&mut self, mut c: f64, n: usize) {
        for j in (0..n).rev() {
            let s = self.x[j];
            let D = self.D[j] + c * s * s;
            if !(D > 0.0) {
                continue; // neither known nor added to
            }
            let beta = c * s / D;
            let column = j * j.saturating_sub(1) / 2;
            for (U, x) in self.U[column..column + j].iter_mut().zip(&mut self.x) {
                *x -= s * *U;
                *U += beta * *x;
            }
            c *= self.D[j] / D;
            self.D[j] = D;
        }
    }

    /// Size.
    pub fn n(&self) -> usize {
        self.D.len()
    }

    /// `U` above the diagonal, column by column, and `D`.
    pub fn factors(&self) -> (&[f64], &[f64]) {
        (&self.U, &self.D)
    }

    /// The most that each `D` may become.
    pub fn most(&self) -> &[f64] {
        &self.most
    }

    /// `P_ij`.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        let last = i.max(j);
        (last..self.n()).map(|k| self.u(i, k) * self.D[k] * self.u(j, k)).sum()
    }

    /// `P`, `(n, n)`, exactly symmetric.
    pub fn matrix(&self) -> Vec<f64> {
        let n = self.n();
        (0..n * n).map(|k| self.at((k / n).min(k % n), (k / n).max(k % n))).collect()
    }

    /// `P^-1 x` for a `P` in which all is in play.
    pub(super) fn solve(&self, x: &[f64]) -> Vec<f64> {
        let n = self.n();
        let mut z = x.to_vec();
        for j in (0..n).rev() {
            (0..j).for_each(|i| z[i] -= self.u(i, j) * z[j]);
        }
        z.iter_mut().zip(&self.D).for_each(|(z, D)| *z /= D);
        for j in 0..n {
            z[j] -= (0..j).map(|i| self.u(i, j) * z[i]).sum::<f64>();
        }
        z
    }

    fn u(&self, i: usize, j: usize) -> f64 {
        if i == j { 1.0 } else { self.U[j * (j - 1) / 2 + i] }
    }

    /// Walks over every number of the state, to save it or to restore it.
    pub(super) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        [&mut self.U, &mut self.D, &mut self.most].into_iter().flatten().for_each(visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::recursive::room::VECTORS;

    /// A covariance of size `n` with its matrix.
    fn some(n: usize, seed: u64) -> (Ud, Vec<f64>) {
        let half = white(n * n, seed);
        let entry = |i: usize, j: usize| (0..n).map(|k| half[i * n + k] * half[j * n + k]).sum::<f64>();
        let P: Vec<f64> =
            (0..n * n).map(|k| entry(k / n, k % n) + if k % n == k / n { 0.1 } else { 0.0 }).collect();
        (Ud::of_matrix(n, &P).expect("positive definite"), P)
    }

    fn close(a: &[f64], b: &[f64], tolerance: f64) {
        let size = b.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= tolerance * size, "{a} {b}");
        }
    }

    fn times(P: &[f64], x: &[f64]) -> Vec<f64> {
        P.chunks(x.len()).map(|row| row.iter().zip(x).map(|(p, x)| p * x).sum()).collect()
    }

    #[test]
    fn an_update_is_the_formula_on_the_whole_matrix() {
        for n in 1..9 {
            for g in [1.0, 1.0 / 0.9, 0.3, -0.01] {
                let ((mut ud, P), psi) = (some(n, 7), white(n, 8));
                close(&ud.matrix(), &P, 1e-14);
                let Ppsi = times(&P, &psi);
                let q: f64 = Ppsi.iter().zip(&psi).map(|(p, x)| p * x).sum();
                let mut all = vec![0.0; VECTORS * n];
                let room = &mut Room::of(n, &mut all);
                room.psi.copy_from_slice(&psi);
                assert!((ud.weigh(n, room) / q - 1.0).abs() < 1e-12);
                let left = ud.update(n, room, g, 1.25);
                assert!((left * (1.0 + g * q) - 1.0).abs() < 1e-11);
                close(room.b, &Ppsi, 1e-12);
                let after: Vec<f64> = (0..n * n)
                    .map(|k| (P[k] - g * Ppsi[k / n] * Ppsi[k % n] / (1.0 + g * q)) * 1.25)
                    .collect();
                close(&ud.matrix(), &after, 1e-11);
            }
        }
    }

    #[test]
    fn variance_is_added_along_any_direction() {
        for n in 1..6 {
            let ((mut ud, P), x) = (some(n, 3), white(n, 4));
            ud.add(2.5, &x);
            let mut after: Vec<f64> = (0..n * n).map(|k| P[k] + 2.5 * x[k / n] * x[k % n]).collect();
            close(&ud.matrix(), &after, 1e-14);
            ud.add_to(n / 2, 3.0);
            after[n / 2 * n + n / 2] += 3.0;
            close(&ud.matrix(), &after, 1e-14);
        }
    }

    #[test]
    fn it_solves_what_it_is_the_factor_of() {
        let ((ud, P), x) = (some(5, 1), white(5, 2));
        close(&times(&P, &ud.solve(&x)), &x, 1e-11);
    }

    #[test]
    fn a_triangle_gives_the_factors_of_its_inverse_gram() {
        let rows = white(40, 5);
        let R = Triangle::of_rows(4, rows.chunks(4));
        let gram = |i: usize, j: usize| rows.chunks(4).map(|r| r[i] * r[j]).sum::<f64>();
        let ud = Ud::diagonal(vec![1.0; 4]).replaced(&R);
        let P = ud.matrix();
        for i in 0..4 {
            for j in 0..4 {
                let one = (0..4).map(|k| P[i * 4 + k] * gram(k, j)).sum::<f64>();
                assert!((one - if i == j { 1.0 } else { 0.0 }).abs() < 1e-12);
            }
        }
    }
}
