//! Regression that outliers do not move, by Huber's weights; [`super::robust`] weighs whole estimators.
//!
//! ```text
//! min sum rho(r_t / s),   w = min(1, c s/|r|),  c = 1.345,   s = 1.4826 median |r - median r|
//! Cov = s^2 kappa^2 mean(psi^2)/mean(psi')^2 (X'X)^-1,   psi(x) = max(-c, min(c, x)),  x = r/s
//! kappa = 1 + (n/N) (1 - mean psi')/mean psi'
//! ```
//!
//! Huber 1981, 7.6 to 7.8 and (6.5); Hampel 1974 for s.

use crate::linalg::{Triangle, solve};
use crate::stats::median;

/// Standard deviations beyond which an error loses weight; 95 % efficient on normal errors.
pub(super) const C: f64 = 1.345;

const ROUNDS: usize = 60;

/// A regression under Huber's weights.
#[derive(Clone, Debug)]
pub struct Huber {
    /// Parameters.
    pub theta: Vec<f64>, // (n)
    /// `(X'X)^-1`, row-major.
    pub inverse_gram: Vec<f64>, // (n, n)
    /// Variance that goes with it: the covariance of theta is their product.
    pub variance: f64,
    /// Robust standard deviation of the errors.
    pub s: f64,
    /// Errors.
    pub eps: Vec<f64>, // (N)
}

/// Huber's estimate from rows `[x | y]`, row-major of width `n + 1`; None without full rank.
///
/// Rounds end where no error changes by more than `still` of their deviation.
pub fn huber(rows: &[f64], n: usize, still: f64) -> Option<Huber> {
    let width = n + 1;
    let N = rows.len() / width;
    if N <= n {
        return None;
    }
    let every: Vec<usize> = (0..n).collect();
    let plain = solve(&Triangle::of_rows(width, rows.chunks_exact(width)), &every, n, 1e-10).ok()?;
    let mut theta = plain.theta;
    let mut eps = errors(rows, &theta);
    let mut weighted = vec![0.0; rows.len()];
    for _ in 0..ROUNDS {
        let s = robust_sd(&eps);
        if s == 0.0 {
            break; // more than half of the errors are equal
        }
        for ((to, from), e) in weighted.chunks_exact_mut(width).zip(rows.chunks_exact(width)).zip(&eps) {
            let root = weight(*e, s).sqrt();
            to.iter_mut().zip(from).for_each(|(to, x)| *to = root * x);
        }
        let triangle = Triangle::of_rows(width, weighted.chunks_exact(width));
        theta = solve(&triangle, &every, n, 1e-12).ok()?.theta;
        let next = errors(rows, &theta);
        let moved = eps.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        eps = next;
        if moved <= still * s {
            break;
        }
    }
    let s = robust_sd(&eps);
    Some(Huber { variance: variance(&eps, s, n), theta, inverse_gram: plain.inverse_gram, s, eps })
}

/// `min(1, c s/|r|)`.
pub(super) fn weight(r: f64, s: f64) -> f64 {
    if r.abs() <= C * s { 1.0 } else { C * s / r.abs() }
}

/// `y - x theta` of each row.
fn errors(rows: &[f64], theta: &[f64]) -> Vec<f64> {
    let n = theta.len();
    let error = |row: &[f64]| row[n] - row.iter().zip(theta).map(|(x, t)| x * t).sum::<f64>();
    rows.chunks_exact(n + 1).map(error).collect()
}

/// `1.4826 median |r - median r|`.
fn robust_sd(r: &[f64]) -> f64 {
    let middle = median(r.to_vec());
    1.4826 * median(r.iter().map(|r| (r - middle).abs()).collect())
}

/// `s^2 kappa^2 sum psi^2 / (N - n) / mean(psi')^2`.
fn variance(eps: &[f64], s: f64, n: usize) -> f64 {
    let (N, n) = (eps.len() as f64, n as f64);
    let inside = eps.iter().filter(|e| e.abs() <= C * s).count() as f64 / N;
    let square: f64 = eps.iter().map(|e| e.clamp(-C * s, C * s).powi(2)).sum::<f64>() / (N - n);
    let kappa = 1.0 + n / N * (1.0 - inside) / inside;
    kappa * kappa * square / (inside * inside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    /// The mean under Huber's weights solves `sum psi((y - m)/s) = 0`.
    #[test]
    fn the_estimating_equation_holds() {
        let mut y = white(200, 1);
        (y[3], y[77], y[150]) = (40.0, 60.0, -30.0);
        let rows: Vec<f64> = y.iter().flat_map(|y| [1.0, *y]).collect();
        let found = huber(&rows, 1, 1e-10).expect("full rank");
        let sum: f64 = found.eps.iter().map(|e| (e / found.s).clamp(-C, C)).sum();
        assert!(sum.abs() < 1e-6, "{sum}");
    }
}
