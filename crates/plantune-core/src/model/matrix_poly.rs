//! `A(q) y(t) = B(q) u(t - nk) + e(t)` of several outputs: the coefficients are matrices.
//!
//! ```text
//! y(t) + sum_j A_j y(t-j) = sum_j B_j u(t-nk-j) + e(t)     A_j (ny, ny), B_j (ny, nu), A_0 = I
//! G(z) = A(z)^-1 B(z) z^-nk                                nk one per input
//! ```
//!
//! The poles are the eigenvalues of the block companion matrix of `A`. Source 000, (2.1-7) to (2.1-9).

use super::StateSpace;
use crate::error::{Error, Result};
use crate::linalg::{Complex, Matrix, eigenvalues, left_divide};

/// Matrix polynomials in ascending powers of `q^-1`, every matrix row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct MatrixPoly {
    /// `A_0 = I … A_na`.
    pub A: Vec<Vec<f64>>, // (na+1) of (ny, ny)
    /// `B_0 … B_(nb-1)`, behind the delay.
    pub B: Vec<Vec<f64>>, // (nb) of (ny, nu)
    /// Delay per input, samples.
    pub nk: Vec<usize>, // (nu)
    /// Number of outputs.
    pub ny: usize,
    /// Sample time, s.
    pub Ts: f64,
}

impl MatrixPoly {
    /// Number of inputs.
    pub fn nu(&self) -> usize {
        self.nk.len()
    }

    /// Order of `A`.
    pub fn na(&self) -> usize {
        self.A.len() - 1
    }

    /// Rows until every lag of `A` and `B` lies in the record.
    pub fn history(&self) -> usize {
        let inputs = self.nk.iter().map(|nk| nk + self.B.len() - 1);
        inputs.chain([self.na()]).max().unwrap_or(0)
    }

    /// Refuses inputs that are not the model's.
    pub fn check_inputs(&self, nu: usize) -> Result<()> {
        if nu == self.nu() {
            return Ok(());
        }
        Err(Error::argument("u", format!("{nu} columns"), &format!("{} columns", self.nu())))
    }

    /// Output `(N, ny)` from rest for the input `(N, nu)`.
    pub fn simulate(&self, u: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; u.len() / self.nu() * self.ny];
        for k in 0..y.len() / self.ny {
            let next = self.next(&y, u, k);
            y[k * self.ny..][..self.ny].copy_from_slice(&next);
        }
        y
    }

    /// `y(k)` without its noise, from the rows before `k`; what lies before row 0 is zero.
    pub fn next(&self, y: &[f64], u: &[f64], k: usize) -> Vec<f64> {
        let (ny, nu) = (self.ny, self.nu());
        let mut next = vec![0.0; ny];
        for (j, A) in self.A.iter().enumerate().skip(1).take(k) {
            let past = &y[(k - j) * ny..][..ny];
            next.iter_mut().zip(A.chunks(ny)).for_each(|(y, a)| *y -= inner(a, past));
        }
        for (j, B) in self.B.iter().enumerate() {
            for (i, nk) in self.nk.iter().enumerate().filter(|(_, nk)| **nk + j <= k) {
                let u = u[(k - nk - j) * nu + i];
                next.iter_mut().enumerate().for_each(|(row, y)| *y += B[row * nu + i] * u);
            }
        }
        next
    }

    /// Responses `H_k (ny, ny)` of `A(q)^-1` to a unit impulse of each noise, `rows` of them.
    pub fn noise_impulses(&self, rows: usize) -> Vec<Vec<f64>> {
        let ny = self.ny;
        let mut H: Vec<Vec<f64>> = Vec::with_capacity(rows);
        for k in 0..rows {
            let mut next = vec![0.0; ny * ny];
            if k == 0 {
                (0..ny).for_each(|i| next[i * ny + i] = 1.0);
            }
            for (A, past) in self.A.iter().skip(1).zip(H.iter().rev()) {
                for (ij, entry) in next.iter_mut().enumerate() {
                    let (i, j) = (ij / ny, ij % ny);
                    *entry -= (0..ny).map(|l| A[i * ny + l] * past[l * ny + j]).sum::<f64>();
                }
            }
            H.push(next);
        }
        H
    }

    /// `G(e^(j w Ts))`, `(ny, nu)`.
    pub fn freqresp(&self, w: f64) -> Vec<Complex<f64>> {
        let at = |lag: usize| Complex::from_polar(1.0, -w * self.Ts * lag as f64);
        let A = sum(&self.A, |j, _| at(j));
        let nu = self.nu();
        let B = sum(&self.B, |j, entry| at(j + self.nk[entry % nu]));
        left_divide(&A, &B, self.ny).unwrap_or_else(|| vec![Complex::new(f64::INFINITY, 0.0); B.len()])
    }

    /// Poles in `z`.
    pub fn poles(&self) -> Vec<(f64, f64)> {
        let (ny, n) = (self.ny, self.ny * self.na());
        if n == 0 {
            return Vec::new();
        }
        let mut companion = vec![0.0; n * n];
        for (j, A) in self.A.iter().skip(1).enumerate() {
            for (entry, a) in A.iter().enumerate() {
                companion[entry / ny * n + j * ny + entry % ny] = -a;
            }
        }
        (ny..n).for_each(|i| companion[i * n + i - ny] = 1.0);
        eigenvalues(&companion, n)
    }

    /// By states, in observer form with `B_j` counted from lag 0:
    ///
    /// ```text
    /// x_j(t+1) = x_(j+1) - A_j y + B_j u,   y = x_1 + B_0 u + e
    /// ```
    pub fn state_space(&self) -> StateSpace {
        let (ny, nu) = (self.ny, self.nu());
        let blocks = self.history().max(1);
        let n = ny * blocks;
        let late = |j: usize, entry: usize| {
            let lag = j.checked_sub(self.nk[entry % nu]);
            lag.and_then(|lag| self.B.get(lag)).map_or(0.0, |B| B[entry])
        };
        let D = Matrix::from_fn(ny, nu, |i, j| late(0, i * nu + j));
        let lags = |row: usize, j: usize| self.A.get(row / ny + 1).map_or(0.0, |A| A[row % ny * ny + j]);
        let past = Matrix::from_fn(n, ny, lags);
        let inputs = Matrix::from_fn(n, nu, |row, j| late(row / ny + 1, row % ny * nu + j));
        let mut A = Matrix::from_fn(n, n, |i, j| f64::from(u8::from(j == i + ny)));
        A.view_mut((0, 0), (n, ny)).zip_apply(&past, |a, p| *a -= p);
        StateSpace { A, B: inputs - &past * &D, C: Matrix::identity(ny, n), D, K: -past, Ts: Some(self.Ts) }
    }

    /// `A(1)`, `(ny, ny)`.
    pub fn A1(&self) -> Vec<f64> {
        sum(&self.A, |_, _| 1.0)
    }

    /// `B(1)`, `(ny, nu)`.
    pub fn B1(&self) -> Vec<f64> {
        sum(&self.B, |_, _| 1.0)
    }

    /// `A(1)^-1 B(1)`, `(ny, nu)`; infinite with a pole at 1.
    pub fn dc_gain(&self) -> Vec<f64> {
        let B1 = self.B1();
        left_divide(&self.A1(), &B1, self.ny).unwrap_or_else(|| vec![f64::INFINITY; B1.len()])
    }
}

/// `sum_j P_j factor(j, entry)`, entry by entry.
fn sum<T: std::ops::Mul<f64, Output = T> + std::iter::Sum>(
    P: &[Vec<f64>],
    factor: impl Fn(usize, usize) -> T,
) -> Vec<T> {
    let entry = |entry: usize| P.iter().enumerate().map(|(j, p)| factor(j, entry) * p[entry]).sum();
    (0..P[0].len()).map(entry).collect()
}

/// Of a few entries; shorter than what pays for vector instructions.
fn inner(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn model() -> MatrixPoly {
        MatrixPoly {
            A: vec![vec![1.0, 0.0, 0.0, 1.0], vec![-0.8, 0.1, 0.2, -0.5], vec![0.1, 0.0, 0.05, 0.1]],
            B: vec![vec![0.5, 0.2, 1.0, -0.3, 0.0, 0.7], vec![0.1, 0.0, -0.4, 0.2, 0.3, 0.0]],
            nk: vec![1, 0, 2],
            ny: 2,
            Ts: 0.1,
        }
    }

    #[test]
    fn a_simulation_solves_the_difference_equation() {
        let (m, u) = (model(), white(90, 1));
        let y = m.simulate(&u);
        for k in 4..30 {
            for i in 0..2 {
                let left: f64 =
                    (0..3).map(|j| (0..2).map(|l| m.A[j][2 * i + l] * y[2 * (k - j) + l]).sum::<f64>()).sum();
                let right: f64 = (0..2)
                    .map(|j| (0..3).map(|l| m.B[j][3 * i + l] * u[3 * (k - j - m.nk[l]) + l]).sum::<f64>())
                    .sum();
                assert!((left - right).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn frequency_response_is_the_sum_of_the_impulse_response() {
        let m = model();
        let mut u = vec![0.0; 3 * 400];
        u[1] = 1.0;
        let g = m.simulate(&u);
        for w in [0.0, 3.0, 25.0] {
            for i in 0..2 {
                let sum: Complex<f64> =
                    (0..400).map(|k| Complex::from_polar(g[2 * k + i], -w * m.Ts * k as f64)).sum();
                assert!((m.freqresp(w)[3 * i + 1] - sum).norm() < 1e-12, "{w} rad/s");
            }
        }
        assert!((m.freqresp(0.0)[4].re - m.dc_gain()[4]).abs() < 1e-14);
    }

    #[test]
    fn the_state_space_is_the_same_system() {
        let (m, u) = (model(), white(90, 5));
        let (y, ss) = (m.simulate(&u), m.state_space());
        let again = ss.simulate(&u, &vec![0.0; ss.n()]);
        assert!(y.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    /// `det A(z)` vanishes at a pole.
    #[test]
    fn poles_make_the_denominator_singular() {
        let m = model();
        assert_eq!(m.poles().len(), 4);
        for (re, im) in m.poles() {
            let w = Complex::new(re, im).inv();
            let a = |ij: usize| m.A.iter().rev().fold(Complex::new(0.0, 0.0), |sum, A| sum * w + A[ij]);
            assert!((a(0) * a(3) - a(1) * a(2)).norm() < 1e-10 * w.norm().powi(4).max(1.0));
        }
    }

    #[test]
    fn noise_passes_through_the_inverse_of_a() {
        let m = model();
        let H = m.noise_impulses(20);
        let silent = vec![0.0; 60];
        let mut y = vec![0.0, 1.0];
        for k in 1..20 {
            let next = m.next(&y, &silent, k);
            y.extend(next);
        }
        assert!((0..20).all(|k| (H[k][1] - y[2 * k]).abs() + (H[k][3] - y[2 * k + 1]).abs() < 1e-15));
    }
}
