//! `B` and `D` from projected states, and the covariances of the noise: the combined method of SLICOT IB01BD.
//!
//! ```text
//! X(i) = G^+ Z(i),  Z(i) = Yf / [Up Yp Uf]          X(i+1) = G1^+ Z(i+1), one row on;  G1 = G without the last
//! [X(i+1); y(i)] = [A; C] X(i) + K(B, D) Uf + noise           A, C known: least squares of B, D, weighted by Uf
//! K(B, D) = [[B, G1^+ H-] - A G^+ H;  [D, 0] - C G^+ H],   H the block Toeplitz matrix of D, C B, C A B, …
//! [Q S; S' R] = the mean products of the errors of [X(i+1); y(i)] on [X(i); Uf]
//! ```
//!
//! `K` is linear in `B` and `D`: block column `k` is `N_k [D; B]`. In the coordinates of `L` nothing but small
//! matrices is left. Van Overschee and De Moor 1996, 4.3 and 4.4; SLICOT IB01BD, METH = 'C'.

use super::data::Factor;
use super::observability::Observability;
use crate::linalg::{Matrix, kalman_gain, least_squares, pseudo_inverse};

/// Projected states, in the coordinates of `L`.
pub struct Projected {
    /// `X(i)`.
    X: Matrix,
    /// `[X(i+1); y(i)]`.
    next: Matrix,
    /// `Uf`.
    Uf: Matrix,
    /// `G^+`.
    full: Matrix,
    /// `G1^+`.
    short: Matrix,
}

/// Smallest share of the output's power that counts as noise.
const NOISE_FREE: f64 = 1e-20;

impl Projected {
    /// On the rows of `Yf` and one row on.
    pub fn of(factor: &Factor, states: &Observability) -> Self {
        let (a, b, l, all) = (factor.future(), factor.known(), factor.l, factor.all());
        let n = states.A.nrows();
        let G = &states.G;
        let full = pseudo_inverse(G, 1e-14);
        let short = pseudo_inverse(&G.rows(0, G.nrows() - l).into_owned(), 1e-14);
        // Q's first b coordinates are those of [Uf; Up; Yp], and l more come with the first row of Yf.
        let width = b + l;
        let mut X = Matrix::zeros(n, width);
        X.columns_mut(0, b).copy_from(&(&full * factor.block(b..all, 0..b)));
        let mut next = Matrix::zeros(n + l, width);
        next.rows_mut(0, n).copy_from(&(&short * factor.block(b + l..all, 0..width)));
        next.rows_mut(n, l).copy_from(&factor.block(b..b + l, 0..width));
        Projected { X, next, Uf: factor.block(0..a, 0..width), full, short }
    }

    /// `B` and `D`; `D` is zero where there is no direct term.
    pub fn inputs(&self, states: &Observability, m: usize, direct: bool) -> (Matrix, Matrix) {
        let (n, l) = (states.A.nrows(), states.C.nrows());
        let a = self.Uf.nrows();
        let mut AC = Matrix::zeros(n + l, n);
        AC.rows_mut(0, n).copy_from(&states.A);
        AC.rows_mut(n, l).copy_from(&states.C);
        let target = (&self.next - &AC * &self.X).columns(0, a).into_owned();
        let Uf = self.Uf.columns(0, a).into_owned();
        let N = self.weights(states, &AC);
        // vec of sum_k N_k [D; B] Uf_k: column (row r of [D; B], input j).
        let from = if direct { 0 } else { l };
        let unknowns: Vec<(usize, usize)> = (from..l + n).flat_map(|r| (0..m).map(move |j| (r, j))).collect();
        let mut F = Matrix::zeros((n + l) * a, unknowns.len());
        for (column, (r, j)) in unknowns.iter().enumerate() {
            let mut effect = Matrix::zeros(n + l, a);
            for (k, N) in N.iter().enumerate() {
                effect.ger(1.0, &N.column(*r), &Uf.row(k * m + j).transpose(), 1.0);
            }
            F.column_mut(column).copy_from_slice(effect.as_slice());
        }
        let found = least_squares(&F, &Matrix::from_column_slice(F.nrows(), 1, target.as_slice()), 1e-12);
        let mut DB = Matrix::zeros(l + n, m);
        unknowns.iter().zip(found.iter()).for_each(|(&(r, j), x)| DB[(r, j)] = *x);
        (DB.rows(l, n).into_owned(), DB.rows(0, l).into_owned())
    }

    /// `N_k (n + ny, ny + n)` of each block column.
    fn weights(&self, states: &Observability, AC: &Matrix) -> Vec<Matrix> {
        let (n, l, s) = (states.A.nrows(), states.C.nrows(), states.G.nrows() / states.C.nrows());
        let back = AC * &self.full; // (n + ny, s ny)
        let G = |i: usize| states.G.rows(i * l, l);
        let weight = |k: usize| {
            let mut N = Matrix::zeros(n + l, l + n);
            // -[A; C] G^+ H: D on the diagonal of H, C A^(i-k-1) B below it.
            let mut D = -back.columns(k * l, l).into_owned();
            let mut B = Matrix::zeros(n + l, n);
            (k + 1..s).for_each(|i| B -= back.columns(i * l, l) * G(i - k - 1));
            if k == 0 {
                (0..l).for_each(|i| D[(n + i, i)] += 1.0);
                (0..n).for_each(|i| B[(i, i)] += 1.0);
            } else {
                let mut top = D.rows_mut(0, n);
                top += self.short.columns((k - 1) * l, l);
                let mut top = B.rows_mut(0, n);
                (k..s - 1).for_each(|i| top += self.short.columns(i * l, l) * G(i - k));
            }
            N.columns_mut(0, l).copy_from(&D);
            N.columns_mut(l, n).copy_from(&B);
            N
        };
        (0..s).map(weight).collect()
    }

    /// The Kalman gain; none where nothing is left to call noise, or the Riccati equation has no solution.
    pub fn gain(&self, A: &Matrix, C: &Matrix) -> Option<Matrix> {
        let (n, l) = (A.nrows(), C.nrows());
        let a = self.Uf.nrows();
        let mut known = Matrix::zeros(n + a, self.X.ncols());
        known.rows_mut(0, n).copy_from(&self.X);
        known.rows_mut(n, a).copy_from(&self.Uf);
        let theta = least_squares(&known.transpose(), &self.next.transpose(), 1e-12);
        let errors = &self.next - theta.transpose() * known;
        let power = self.next.rows(n, l).norm_squared();
        let products = &errors * errors.transpose() / self.next.ncols() as f64;
        let R = products.view((n, n), (l, l)).into_owned();
        if R.trace() <= NOISE_FREE * power {
            return None;
        }
        let Q = products.view((0, 0), (n, n)).into_owned();
        let S = products.view((0, n), (n, l)).into_owned();
        kalman_gain(A, C, &Q, &R, &S).map(|(_, K)| K)
    }
}
