//! Least squares that outliers do not move: Huber's weights, and for ARX the rows that a spike reaches.
//!
//! ```text
//! min sum rho(r_t / s),   w = min(1, c s/|r|),  c = 1.345,   s = 1.4826 median |r - median r|
//! Cov = s^2 kappa^2 mean(psi^2)/mean(psi')^2 (X'X)^-1,   psi(x) = max(-c, min(c, x)),  x = r/s
//! kappa = 1 + (n/N) (1 - mean psi')/mean psi'
//! ```
//!
//! A spike of y is an error at its own row and a *regressor* at the next `na`, where no weight of the error
//! helps. So the first row of each run of errors beyond 5 s is marked as missing, which drops every row that
//! uses it; then again, until nothing new stands out, and the rest is weighted. An output-error model has
//! no past outputs: there its rows are left out and it is fitted again.
//!
//! Huber 1981, 7.6 to 7.8 and (6.5); Hampel 1974 for s.

use super::arx::columns;
use super::fit::Fit;
use super::orders::{Orders, too_short};
use super::pem::{PemOptions, pem};
use super::poly_fit::Scaled;
use crate::error::Result;
use crate::limits::Limits;
use crate::linalg::{Triangle, solve};
use crate::note::Note;
use crate::record::Record;
use crate::regress::Regression;
use crate::sim::{Start, over_record};
use crate::stats::median;

/// Standard deviations beyond which an error loses weight; 95 % efficient on normal errors.
const C: f64 = 1.345;

/// Standard deviations beyond which a row is left out.
const FAR: f64 = 5.0;

/// Rounds of weighting, and of marking.
const ROUNDS: usize = 60;
const MARKINGS: usize = 20;

/// Largest relative change of a length that ends the rounds.
const STILL: f64 = 1e-10;

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
pub fn huber(rows: &[f64], n: usize) -> Option<Huber> {
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
            let root = (C * s / e.abs()).min(1.0).sqrt();
            to.iter_mut().zip(from).for_each(|(to, x)| *to = root * x);
        }
        let triangle = Triangle::of_rows(width, weighted.chunks_exact(width));
        theta = solve(&triangle, &every, n, 1e-12).ok()?.theta;
        let next = errors(rows, &theta);
        let moved = eps.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        eps = next;
        if moved <= STILL * s {
            break;
        }
    }
    let s = robust_sd(&eps);
    Some(Huber { variance: variance(&eps, s, n), theta, inverse_gram: plain.inverse_gram, s, eps })
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

/// ARX that spikes of the output do not move; a note D19 says how many were left out.
pub fn robust_arx(rec: &Record, orders: &Orders, offset: bool, limits: &Limits) -> Result<Fit> {
    orders.check(rec, offset, limits)?;
    let all = orders.n() + usize::from(offset);
    let mut valid: Vec<bool> = (0..rec.N()).map(|k| rec.is_valid(k, 0)).collect();
    let mut marked = 0;
    for _ in 0..MARKINGS {
        let kept = Record { valid: Some(&valid), ..rec.clone() };
        let regression = Regression::new(&kept, 0, columns(orders, offset));
        let (at, rows) = regression.rows();
        let Some(found) = huber(&rows, all) else {
            // As few rows, or as poor ones, as plain least squares refuses with its reason.
            return super::arx(&kept, orders, offset, limits).and(Err(too_short(at.len(), all)));
        };
        let far = firsts(&at, &found);
        if far.is_empty() || found.s == 0.0 {
            let mut fit = of_huber(&regression, &found, orders, rec, limits);
            fit.notes.extend(left_out(marked));
            return fit.finite();
        }
        marked += far.len();
        far.into_iter().for_each(|k| valid[k] = false);
    }
    let kept = Record { valid: Some(&valid), ..rec.clone() };
    let mut fit = super::arx(&kept, orders, offset, limits)?;
    fit.notes.extend(left_out(marked));
    Ok(fit)
}

/// The first row of each run of errors beyond [`FAR`].
fn firsts(at: &[usize], found: &Huber) -> Vec<usize> {
    let far = |p: usize| found.eps[p].abs() > FAR * found.s;
    let follows = |p: usize| p > 0 && at[p - 1] + 1 == at[p] && far(p - 1);
    (0..at.len()).filter(|&p| far(p) && !follows(p)).map(|p| at[p]).collect()
}

/// The fit in the record's units; its loss is the variance that the intervals rest on.
fn of_huber(regression: &Regression, found: &Huber, orders: &Orders, rec: &Record, limits: &Limits) -> Fit {
    let (N, all) = (found.eps.len(), found.theta.len());
    let scaled = Scaled {
        theta: &found.theta,
        inverse_gram: &found.inverse_gram,
        rss: found.variance * (N - all) as f64,
        N,
        states: 0,
        u: &regression.u,
        y: regression.y,
    };
    let mut fit = scaled.fit(orders, rec.Ts, limits);
    fit.names = orders.names(rec);
    fit.expected_digits = vec![15.0; orders.n()];
    fit.x0 = rec.segments().map(|_| Vec::new()).collect();
    fit
}

/// Prediction errors with the rows left out whose error is beyond 5 s, until the same rows are.
pub fn robust_pem(rec: &Record, orders: &Orders, options: PemOptions, limits: &Limits) -> Result<Fit> {
    let known: Vec<bool> = (0..rec.N()).map(|k| rec.is_valid(k, 0)).collect();
    let mut valid = known.clone();
    let mut fit = pem(rec, orders, options, limits)?;
    for _ in 0..MARKINGS {
        let start = if options.start == Start::Zero { Start::Zero } else { Start::Estimate };
        let kept = Record { valid: Some(&valid), ..rec.clone() };
        let run = over_record(&fit.model, &kept, Some(1), start, Some(fit.offset))?;
        let rows: Vec<usize> = (0..run.rows.len()).filter(|&p| known[run.rows[p]]).collect();
        let eps: Vec<f64> = rows.iter().map(|&p| rec.y_at(run.rows[p], 0) - run.yhat[p]).collect();
        let s = robust_sd(&eps);
        let mut next = known.clone();
        let far = rows.iter().zip(&eps).filter(|(_, e)| e.abs() > FAR * s && s > 0.0);
        far.for_each(|(&p, _)| next[run.rows[p]] = false);
        if next == valid {
            break;
        }
        valid = next;
        let kept = Record { valid: Some(&valid), ..rec.clone() };
        fit = pem(&kept, orders, options, limits)?;
    }
    let marked = known.iter().zip(&valid).filter(|(known, kept)| **known && !**kept).count();
    fit.notes.extend(left_out(marked));
    Ok(fit)
}

/// D19: how many rows were left out.
fn left_out(marked: usize) -> Option<Note> {
    (marked > 0).then(|| {
        Note::info("D19", format!("robust: {marked} outputs beyond {FAR} standard deviations are left out"))
            .count(marked)
    })
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
        let found = huber(&rows, 1).expect("full rank");
        let sum: f64 = found.eps.iter().map(|e| (e / found.s).clamp(-C, C)).sum();
        assert!(sum.abs() < 1e-6, "{sum}");
    }
}
