//! Covariance of an estimate whose residuals are not white: the sandwich.
//!
//! ```text
//! P = J^-1 S J^-1,   J = psi' psi,   S = psi' R psi,   R(t, s) = r(t - s)
//! r from an autoregression of the residuals, of the order 1 .. 20 that BIC takes:
//! R = s^2 H H',  H = 1/A(q):   S = s^2 |H' psi|^2,  psi filtered backwards in time
//! ```
//!
//! That holds where `psi` is of the input alone (output errors). Where it holds past noise (`A`, `C` or `D`), the
//! products `g = psi eps` themselves are summed, `m` rows apart and less, with Bartlett's weights:
//!
//! ```text
//! S = sum_{|k| <= m} (1 - |k|/(m + 1)) sum_t g(t) g(t-k)'
//! ```
//!
//! Then the parameters themselves are off, and the interval is one around where they tend to.
//!
//! For output errors, sums over a fixed number of lags (Newey and West 1987) are too short for slow noise and too noisy for white.
//! Huber 1967; Newey and West 1987, `m` after Andrews 1991; Ljung 1999, (9.42); the autoregression after Berk 1974 and den Haan and Levin 1997.

use super::fit::standard_deviations;
use super::orders::Orders;
use super::scores::Scores;
use crate::error::{Error, Result};
use crate::linalg::{Triangle, residual_norm2, solve};
use crate::note::{Note, rounded};
use crate::poly::{is_stable, reflected};

/// Highest order of the autoregression, and rows that each order needs.
const HIGHEST: usize = 20;
const ROWS: usize = 10;

/// What is left of a column before the first row of a segment may be forgotten.
const NOTHING: f64 = 1e-12;

/// Most rows before it.
const MOST: usize = 100_000;

/// Pivots below this share mean rank deficiency.
const RANK_TOLERANCE: f64 = 1e-12;

/// A covariance, and how it came about.
#[derive(Clone, Debug)]
pub struct Sandwich {
    /// Covariance of `theta`, then of the offset; row-major.
    pub P: Vec<f64>, // (n, n)
    /// The same if the residuals were white, `s^2 J^-1`.
    pub plain: Vec<f64>, // (n, n)
    /// Order of the autoregression; absent where products were summed.
    pub order: Option<usize>,
    /// Factor by which each standard deviation grew.
    pub widening: Vec<f64>, // (n)
}

/// The covariance of a fit of these orders from its scores.
pub fn sandwich(scores: &Scores, orders: &Orders) -> Result<Sandwich> {
    sandwich_of(scores, orders.na + orders.nc + orders.nd == 0)
}

/// The same where it is known whether `psi` is of the input alone.
pub(super) fn sandwich_of(scores: &Scores, output_errors: bool) -> Result<Sandwich> {
    let (n, N) = (scores.n(), scores.eps.len());
    let bread = inverse_gram(scores)?;
    let (meat, order) = if output_errors {
        let (A, s2) = autoregression(scores)?;
        (filtered(scores, &A, s2), Some(A.len() - 1))
    } else {
        (summed(scores, scores.memory()), None)
    };
    let share = N as f64 / N.saturating_sub(n + scores.states) as f64;
    let product = |X: &[f64], Y: &[f64]| -> Vec<f64> {
        (0..n * n).map(|ij| (0..n).map(|k| X[ij / n * n + k] * Y[k * n + ij % n]).sum()).collect()
    };
    let mut P = product(&product(&bread, &meat), &bread);
    P.iter_mut().for_each(|p| *p *= share);
    let s2 = scores.variance();
    let plain: Vec<f64> = bread.iter().map(|x| s2 * x).collect();
    let both = standard_deviations(&P, n).into_iter().zip(standard_deviations(&plain, n));
    let widening = both.map(|(sd, plain)| sd / plain).collect();
    Ok(Sandwich { P, plain, order, widening })
}

impl Sandwich {
    /// V12: how much wider the intervals became.
    pub fn note(&self) -> Note {
        let least = self.widening.iter().copied().fold(f64::INFINITY, f64::min);
        let most = self.widening.iter().copied().fold(0.0, f64::max);
        let holds = match self.order {
            Some(order) => format!("residuals that are an autoregression of order {order}"),
            None => "residuals that are not white".to_owned(),
        };
        let text = format!(
            "standard deviations hold for {holds}: {least:.2} to {most:.2} times those for white ones"
        );
        let note = Note::info("V12", text).measured(rounded(most), 1.0);
        if most > 1.2 { note.remedy("a noise model is better still: bj or armax") } else { note }
    }
}

/// `(psi' psi)^-1`.
fn inverse_gram(scores: &Scores) -> Result<Vec<f64>> {
    let n = scores.n();
    let rows: Vec<Vec<f64>> =
        scores.eps.iter().enumerate().map(|(t, &e)| [scores.psi(t), &[e]].concat()).collect();
    let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
    let every: Vec<usize> = (0..n).collect();
    match solve(&triangle, &every, n, RANK_TOLERANCE) {
        Ok(solution) => Ok(solution.inverse_gram),
        Err(refusal) => Err(Error::new("X10", "the parameters cannot be told apart on this record")
            .measured(refusal.ratio, RANK_TOLERANCE)
            .remedy("give the record of the fit, or ask for lower orders")),
    }
}

/// The autoregression of the residuals and the variance of what drives it.
pub(super) fn autoregression(scores: &Scores) -> Result<(Vec<f64>, f64)> {
    let N = scores.eps.len();
    let mut highest = HIGHEST.min(N / ROWS);
    let rows_of = |highest: usize| -> Vec<Vec<f64>> {
        let of_segment = |s: &std::ops::Range<usize>| {
            let e = &scores.eps[s.clone()];
            (highest..e.len())
                .map(|t| (0..=highest).map(|k| e[t - (k + 1) % (highest + 1)]).collect())
                .collect()
        };
        scores.segments.iter().flat_map(|s| -> Vec<Vec<f64>> { of_segment(s) }).collect()
    };
    let mut rows = rows_of(highest);
    while highest > 1 && rows.len() < 2 * ROWS.max(highest) {
        highest -= 1;
        rows = rows_of(highest);
    }
    if highest == 0 || rows.len() < 2 * ROWS {
        return Err(Error::new("X03", format!("{N} residuals are too few for an autoregression"))
            .count(N)
            .remedy("record longer"));
    }
    let triangle = Triangle::of_rows(highest + 1, rows.iter().map(Vec::as_slice));
    let used = rows.len() as f64;
    let variance = |p: usize| {
        let columns: Vec<usize> = (0..p).collect();
        residual_norm2(&triangle, &columns, highest, RANK_TOLERANCE) / used
    };
    let bic = |p: usize| used * variance(p).max(f64::MIN_POSITIVE).ln() + p as f64 * used.ln();
    let order = (1..=highest).min_by(|&p, &q| bic(p).total_cmp(&bic(q))).unwrap_or(1);
    let columns: Vec<usize> = (0..order).collect();
    let c = solve(&triangle, &columns, highest, RANK_TOLERANCE).map_or(vec![0.0; order], |s| s.theta);
    let A: Vec<f64> = std::iter::once(1.0).chain(c.iter().map(|c| -c)).collect();
    Ok((if is_stable(&A) { A } else { reflected(&A) }, variance(order)))
}

/// `S` from the products of rows up to `m` apart.
fn summed(scores: &Scores, m: usize) -> Vec<f64> {
    let n = scores.n();
    let g: Vec<f64> = scores
        .psi
        .chunks_exact(n)
        .zip(&scores.eps)
        .flat_map(|(psi, e)| psi.iter().map(move |p| p * e))
        .collect();
    let mut S = vec![0.0; n * n];
    for s in &scores.segments {
        for k in 0..=m.min(s.len() - 1) {
            let weight = 1.0 - k as f64 / (m + 1) as f64;
            for t in s.start + k..s.end {
                let (now, then) = (&g[t * n..][..n], &g[(t - k) * n..][..n]);
                for (ij, S) in S.iter_mut().enumerate() {
                    let (i, j) = (ij / n, ij % n);
                    let back = if k == 0 { 0.0 } else { now[j] * then[i] };
                    *S += weight * (now[i] * then[j] + back);
                }
            }
        }
    }
    S
}

/// `S = s^2 |H' psi|^2`; what the columns would have been before a segment counts as well.
fn filtered(scores: &Scores, A: &[f64], s2: f64) -> Vec<f64> {
    let n = scores.n();
    let mut S = vec![0.0; n * n];
    for s in &scores.segments {
        let mut later: Vec<Vec<f64>> = vec![vec![0.0; n]; A.len() - 1]; // v(t+1), v(t+2), …
        let largest = |v: &[f64]| v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let mut size = 0.0f64;
        for back in 0..s.len() + MOST {
            let psi = back
                .checked_sub(s.len())
                .map_or_else(|| scores.psi(s.end - 1 - back).to_vec(), |_| vec![0.0; n]);
            let v: Vec<f64> = (0..n)
                .map(|j| psi[j] - A[1..].iter().zip(&later).map(|(a, v)| a * v[j]).sum::<f64>())
                .collect();
            for (ij, S) in S.iter_mut().enumerate() {
                *S += s2 * v[ij / n] * v[ij % n];
            }
            size = size.max(largest(&v));
            later.rotate_right(1);
            later[0] = v;
            if back >= s.len() && later.iter().all(|v| largest(v) <= NOTHING * size) {
                break;
            }
        }
    }
    S
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{dot, white};
    use crate::poly::{divide, impulse};

    fn of(psi: Vec<f64>, eps: Vec<f64>) -> Scores {
        let N = eps.len();
        Scores { psi, eps, rows: (0..N).collect(), segments: std::iter::once(0..N).collect(), states: 0 }
    }

    /// `psi' R psi` by the sum over all pairs of rows.
    #[test]
    fn the_filtered_columns_give_the_double_sum() {
        let (N, n) = (60, 2);
        let scores = of(white(N * n, 1), white(N, 2));
        let A = [1.0, -0.9, 0.3];
        let S = filtered(&scores, &A, 2.0);
        let h = impulse(&[1.0], &A, 400);
        let r = |k: usize| 2.0 * dot(&h[k..], &h[..400 - k]);
        for (ij, S) in S.iter().enumerate() {
            let pair = |t: usize, s: usize| scores.psi(t)[ij / n] * r(t.abs_diff(s)) * scores.psi(s)[ij % n];
            let sum: f64 = (0..N).map(|t| (0..N).map(|s| pair(t, s)).sum::<f64>()).sum();
            assert!((S - sum).abs() < 1e-9 * S.abs().max(1.0), "{ij}: {S} {sum}");
        }
    }

    #[test]
    fn an_autoregression_is_found_with_its_order() {
        let mut e = white(4000, 3);
        divide(&[1.0, -1.2, 0.5], &mut e);
        let (A, s2) = autoregression(&of(white(4000, 4), e)).expect("rows");
        assert_eq!(A.len(), 3);
        assert!((A[1] + 1.2).abs() < 0.05 && (A[2] - 0.5).abs() < 0.05 && (s2 - 1.0).abs() < 0.1);
    }

    /// The mean of an autoregression has the variance `s^2 / (1 - a)^2 / N`.
    #[test]
    fn a_mean_of_slow_noise_is_as_unsure_as_it_is() {
        let mut e = white(20_000, 5);
        divide(&[1.0, -0.8], &mut e);
        let found =
            sandwich(&of(vec![1.0; 20_000], e), &Orders::oe(vec![1], vec![0], vec![0])).expect("rows");
        assert!((found.P[0] * 20_000.0 / 25.0 - 1.0).abs() < 0.1, "{}", found.P[0]);
        assert!((found.widening[0] - 3.0).abs() < 0.2, "sqrt((1 + a)/(1 - a)): {:?}", found.widening);
        assert!(found.note().text.contains("order 1"));
    }
}
