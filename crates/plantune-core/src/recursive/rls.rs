//! Recursive least squares with exponential forgetting.
//!
//! ```text
//! eps   = y - phi' theta
//! gain  = P phi / (lambda + phi' P phi)
//! theta <- theta + gain eps
//! P     <- (P - gain phi' P) / lambda
//! ```
//!
//! From `theta0` and `P0` this is, at every `t`, exactly the minimum of
//!
//! ```text
//! sum_k lambda^(t-k) (y(k) - phi(k)' theta)^2 + lambda^t (theta - theta0)' P0^-1 (theta - theta0)
//! ```
//!
//! Source 000, (2.2-15); source 001, (3.7-9). `P` is kept as `U D U'`, `U` unit upper triangular, and
//! updated without square roots in 1.5 n² steps (Bierman, Factorization Methods for Discrete Sequential
//! Estimation, 1977, chapter V): a full matrix loses its symmetry and then diverges, the factors cannot.

use crate::error::{Error, Result};

/// Where no data come, forgetting raises `D` by `1/lambda` a sample, and would overflow. Above this multiple
/// of the largest start value the rounding of `U' phi`, 1e-16 of it, would begin to count as information.
const MOST_FORGOTTEN: f64 = 1e12;

/// Largest `P0`: with the bound above, `phi' P phi` of any sensible `phi` stays a number.
const LARGEST_P0: f64 = 1e100;

/// An estimator on its way along a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Rls {
    lambda: f64,
    theta: Vec<f64>, // (n)
    U: Vec<f64>,     // above the diagonal, column by column: U01, U02, U12, U03, …
    D: Vec<f64>,     // (n)
    D_most: f64,
    f: Vec<f64>, // (n): U' phi
    b: Vec<f64>, // (n): P phi, once an update is over
}

impl Rls {
    /// `n` parameters, at zero, with the covariance `P0 I` in units of the noise variance.
    pub fn new(n: usize, lambda: f64, P0: f64) -> Result<Self> {
        if !(P0 > 0.0 && P0 <= LARGEST_P0) {
            return Err(Error::argument("P0", P0, "positive, and at most 1e100"));
        }
        if n == 0 {
            return Err(Error::argument("n", n, "at least 1"));
        }
        if !(lambda > 0.0 && lambda <= 1.0) {
            return Err(Error::argument("lam", lambda, "in (0, 1]"));
        }
        Ok(Rls {
            lambda,
            theta: vec![0.0; n],
            U: vec![0.0; n * (n - 1) / 2],
            D: vec![P0; n],
            D_most: MOST_FORGOTTEN * P0,
            f: vec![0.0; n],
            b: vec![0.0; n],
        })
    }

    /// Starts from these parameters instead of zero.
    pub fn starting_at(mut self, theta0: &[f64]) -> Result<Self> {
        if theta0.len() != self.theta.len() || theta0.iter().any(|x| !x.is_finite()) {
            return Err(Error::argument("theta0", format!("{theta0:?}"), &self.numbers()));
        }
        self.theta.copy_from_slice(theta0);
        Ok(self)
    }

    /// Starts from this covariance `(n, n)`, row-major, instead of `P0 I`.
    pub fn with_covariance(mut self, P0: &[f64]) -> Result<Self> {
        let n = self.theta.len();
        let wrong =
            |what: &str| Error::argument("P0", what, &format!("{n} by {n}, symmetric and positive definite"));
        if P0.len() != n * n {
            return Err(wrong("of another size"));
        }
        let largest = (0..n).map(|i| P0[i * n + i]).fold(0.0, f64::max);
        if !(largest > 0.0 && largest <= LARGEST_P0) {
            return Err(wrong("not positive, or above 1e100"));
        }
        if (0..n * n).any(|k| !((P0[k] - P0[k % n * n + k / n]).abs() <= 1e-9 * largest)) {
            return Err(wrong("not symmetric"));
        }
        // P = U D U' from the last column to the first: D_j = P_jj, U_ij = P_ij / D_j, P <- P - U_j D_j U_j'.
        let mut P = P0.to_vec();
        for j in (0..n).rev() {
            let D = P[j * n + j];
            if !(D > 0.0) {
                return Err(wrong("not positive definite"));
            }
            for i in 0..j {
                let U = P[i * n + j] / D;
                (0..=i).for_each(|k| P[k * n + i] -= U * P[k * n + j]);
                self.U[j * (j - 1) / 2 + i] = U;
            }
            self.D[j] = D;
        }
        self.D_most = MOST_FORGOTTEN * largest;
        Ok(self)
    }

    /// Learns one sample and returns the prior prediction error `eps = y - phi' theta`.
    ///
    /// Allocates nothing. On error the state is unchanged.
    pub fn update(&mut self, phi: &[f64], y: f64) -> Result<f64> {
        let eps = self.ahead(phi, y)?;
        let (mut alpha, mut inverse) = (self.lambda, 1.0 / self.lambda);
        let mut column = 0;
        for j in 0..self.D.len() {
            let (f, g) = (self.f[j], self.D[j] * self.f[j]);
            let (before, slope) = (alpha, -f * inverse);
            alpha += f * g;
            inverse = 1.0 / alpha;
            self.D[j] = (self.D[j] * (before * inverse) / self.lambda).min(self.D_most);
            for (U, b) in self.U[column..column + j].iter_mut().zip(&mut self.b) {
                let old = *U;
                *U += *b * slope;
                *b += old * g;
            }
            self.b[j] = g;
            column += j;
        }
        for (theta, b) in self.theta.iter_mut().zip(&self.b) {
            *theta += b * inverse * eps;
        }
        Ok(eps)
    }

    /// `update` for each row of `phi`, `(N, n)` row-major; returns every prior error. A row that is refused
    /// leaves those before it learnt.
    pub fn run(&mut self, phi: &[f64], y: &[f64]) -> Result<Vec<f64>> {
        let n = self.theta.len();
        if phi.len() != n * y.len() {
            let came = format!("{} numbers for {} rows of y", phi.len(), y.len());
            return Err(Error::argument("phi", came, &format!("{n} a row")));
        }
        phi.chunks_exact(n).zip(y).map(|(phi, y)| self.update(phi, *y)).collect()
    }

    /// Parameters `(n)`.
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Covariance of the parameters in units of the noise variance, `(n, n)`, exactly symmetric.
    pub fn P(&self) -> Vec<f64> {
        let n = self.theta.len();
        let at = |i: usize, k: usize| if i == k { 1.0 } else { self.U[k * (k - 1) / 2 + i] };
        let mut P = vec![0.0; n * n];
        for j in 0..n {
            for i in 0..=j {
                let sum: f64 = (j..n).map(|k| at(i, k) * self.D[k] * at(j, k)).sum();
                (P[i * n + j], P[j * n + i]) = (sum, sum);
            }
        }
        P
    }

    /// Forgetting factor.
    pub fn lambda(&self) -> f64 {
        self.lambda
    }

    /// `U` above the diagonal, column by column; `D`; and the most that `D` may become.
    pub fn factors(&self) -> (&[f64], &[f64], f64) {
        (&self.U, &self.D, self.D_most)
    }

    /// Goes on from where another of the same `n` stood.
    pub fn resume(&mut self, theta: Vec<f64>, U: Vec<f64>, D: Vec<f64>, D_most: f64) -> Result<()> {
        let sizes = (theta.len(), U.len(), D.len());
        if sizes != (self.theta.len(), self.U.len(), self.D.len()) {
            return Err(Error::argument("state", format!("of sizes {sizes:?}"), "of this estimator"));
        }
        (self.theta, self.U, self.D, self.D_most) = (theta, U, D, D_most);
        Ok(())
    }

    /// `eps`, and `f = U' phi` for the update; refuses what must not get in.
    fn ahead(&mut self, phi: &[f64], y: f64) -> Result<f64> {
        if phi.len() != self.theta.len() || phi.iter().any(|x| !x.is_finite()) {
            return Err(Error::argument("phi", format!("{phi:?}"), &self.numbers()));
        }
        if !y.is_finite() {
            return Err(Error::argument("y", y, "a finite number"));
        }
        let mut column = 0;
        let (mut eps, mut alpha) = (y, self.lambda);
        for (j, x) in phi.iter().enumerate() {
            let above = self.U[column..column + j].iter().zip(phi);
            let f = x + above.map(|(U, phi)| U * phi).sum::<f64>();
            alpha += f * f * self.D[j];
            eps -= x * self.theta[j];
            self.f[j] = f;
            column += j;
        }
        if eps.is_finite() && alpha.is_finite() {
            return Ok(eps);
        }
        Err(Error::new("N02", "the numbers of this sample overflow when squared")
            .remedy("scale the signals to a range near 1"))
    }

    fn numbers(&self) -> String {
        format!("{} finite numbers", self.theta.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    /// `n` parameters, each row of `phi` and the output it gives with some noise.
    fn record(n: usize, rows: usize) -> (Vec<f64>, Vec<f64>) {
        let (phi, e) = (white(n * rows, 7), white(rows, 8));
        let y = phi.chunks(n).zip(&e).map(|(p, e)| p.iter().sum::<f64>() + 0.1 * e).collect();
        (phi, y)
    }

    /// The textbook recursion on the whole matrix, fine for a few samples.
    fn textbook(phi: &[f64], y: &[f64], lambda: f64, theta: &mut [f64], P: &mut [f64]) {
        let n = theta.len();
        for (phi, y) in phi.chunks(n).zip(y) {
            let Pphi: Vec<f64> =
                P.chunks(n).map(|row| row.iter().zip(phi).map(|(p, x)| p * x).sum()).collect();
            let alpha = lambda + Pphi.iter().zip(phi).map(|(p, x)| p * x).sum::<f64>();
            let eps = y - theta.iter().zip(phi).map(|(t, x)| t * x).sum::<f64>();
            (0..n).for_each(|i| theta[i] += Pphi[i] / alpha * eps);
            (0..n * n).for_each(|k| P[k] = (P[k] - Pphi[k / n] * Pphi[k % n] / alpha) / lambda);
        }
    }

    #[test]
    fn the_factors_follow_the_textbook() {
        let (n, P0) = (3, [2.0, 0.5, -0.2, 0.5, 1.0, 0.1, -0.2, 0.1, 4.0]);
        let (phi, y) = record(n, 40);
        let (mut theta, mut P) = (vec![0.3, -1.0, 2.0], P0.to_vec());
        let start =
            Rls::new(n, 0.97, 1.0).and_then(|r| r.with_covariance(&P0)).and_then(|r| r.starting_at(&theta));
        let mut rls = start.expect("a sound start");
        for (ours, given) in rls.P().iter().zip(&P0) {
            assert!((ours - given).abs() < 1e-15);
        }
        rls.run(&phi, &y).expect("sound rows");
        textbook(&phi, &y, 0.97, &mut theta, &mut P);
        let ours = [rls.theta().to_vec(), rls.P()].concat();
        for (ours, theirs) in ours.iter().zip([theta, P].concat()) {
            assert!((ours - theirs).abs() < 1e-12, "{ours} {theirs}");
        }
    }

    /// One direction never moves: forgetting lifts its variance to the bound, and no further.
    #[test]
    fn what_is_never_seen_stays_bounded() {
        let mut rls = Rls::new(2, 0.9, 1.0).expect("a sound start");
        for _ in 0..20_000 {
            rls.update(&[1.0, 1.0], 3.0).expect("a sound row");
        }
        assert!(rls.P().iter().all(|p| p.is_finite()) && rls.P()[0] <= 2.0 * MOST_FORGOTTEN);
        assert!((rls.theta()[0] + rls.theta()[1] - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_refused_sample_changes_nothing() {
        let (phi, y) = record(2, 10);
        let mut rls = Rls::new(2, 0.99, 1e6).expect("a sound start");
        rls.run(&phi, &y).expect("sound rows");
        let before = (rls.theta().to_vec(), rls.P());
        for (phi, y) in
            [(&[1.0][..], 0.0), (&[1.0, f64::NAN], 0.0), (&[1.0, 2.0], f64::INFINITY), (&[1e200, 0.0], 0.0)]
        {
            assert!(rls.update(phi, y).is_err());
        }
        assert_eq!(before, (rls.theta().to_vec(), rls.P()));
    }
}
