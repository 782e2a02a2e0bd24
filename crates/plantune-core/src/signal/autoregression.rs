//! An autoregression of a signal, and signals passed through it.
//!
//! ```text
//! A(q) x(t) = e(t),  A = 1 + a1 q^-1 + … + ap q^-p
//! R(k) = sum x(t) x(t-k) / N:   the equations of Yule and Walker, by the recursion of Levinson
//! AIC  = N ln s2_p + 2 p
//! ```
//!
//! Source 001, 3.5.4 (pre-whitening); Box and Jenkins 1970, 3.2 and 11.2; Akaike 1974.

use std::ops::Range;

use crate::linalg::dot;

/// Share of the variance that an autoregression may leave; below it only rounding is predicted.
const EXACT: f64 = 1e-9;

/// `A` of the order with the least AIC, up to `most`, of a signal without mean on stretches of its rows.
pub fn autoregression(x: &[f64], stretches: &[Range<usize>], most: usize) -> Vec<f64> {
    let N: usize = stretches.iter().map(ExactSizeIterator::len).sum();
    let covariance = |k: usize| -> f64 {
        let long = stretches.iter().filter(|s| s.len() > k);
        long.map(|s| dot(&x[s.start + k..s.end], &x[s.start..s.end - k])).sum::<f64>() / N as f64
    };
    let R: Vec<f64> = (0..=most.min(N.saturating_sub(1))).map(covariance).collect();
    least_aic(&R, N)
}

/// The same from covariances `R(0), R(1), …` over `N` rows.
fn least_aic(R: &[f64], N: usize) -> Vec<f64> {
    let (mut A, mut s2) = (vec![1.0], R[0]);
    let mut best = (N as f64 * s2.ln(), A.clone());
    for p in 1..R.len() {
        let reflection = -A.iter().enumerate().map(|(j, a)| a * R[p - j]).sum::<f64>() / s2;
        s2 *= 1.0 - reflection * reflection;
        if !(s2 > EXACT * R[0]) {
            break;
        }
        A.push(0.0);
        let last = A.clone();
        A.iter_mut().zip(last.iter().rev()).for_each(|(a, b)| *a += reflection * b);
        let aic = N as f64 * s2.ln() + 2.0 * p as f64;
        if aic < best.0 {
            best = (aic, A.clone());
        }
    }
    best.1
}

/// `A(q) (x - x(0))` on each segment; the first rows of one, whose past is not known, hold the first that is.
pub fn through(A: &[f64], x: &[f64], segments: impl Iterator<Item = Range<usize>>) -> Vec<f64> {
    let past = A.len() - 1;
    let zero = x.first().copied().unwrap_or(0.0);
    let mut out = vec![0.0; x.len()];
    for s in segments {
        for t in (s.start + past).min(s.end)..s.end {
            out[t] = A.iter().enumerate().map(|(j, a)| a * (x[t - j] - zero)).sum();
        }
        let first = out[(s.start + past).min(s.end - 1)];
        out[s.start..(s.start + past).min(s.end)].fill(first);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    /// `x(t) = 1.5 x(t-1) - 0.8 x(t-2) + e(t)`, in two stretches.
    #[test]
    fn a_known_autoregression_is_found_and_undone() {
        let e = white(20_000, 3);
        let mut x = e.clone();
        for t in 2..x.len() {
            x[t] += 1.5 * x[t - 1] - 0.8 * x[t - 2];
        }
        let stretches = [0..9_000, 9_000..20_000];
        let A = autoregression(&x, &stretches, 2);
        for (a, truth) in A.iter().zip([1.0, -1.5, 0.8]) {
            assert!((a - truth).abs() < 0.02, "{A:?}");
        }
        let back = through(&[1.0, -1.5, 0.8], &x, stretches.into_iter());
        let level = 0.3 * x[0]; // what is left of the first value, which was taken away
        assert!((back[100] - (e[100] - level)).abs() < 1e-12);
        assert!((back[9_000] - back[9_002]).abs() < 1e-15);
        assert!((back[10_000] - (e[10_000] - level)).abs() < 1e-12);
    }

    #[test]
    fn white_noise_needs_no_order_and_a_standstill_has_none() {
        let A = autoregression(&white(5_000, 4), &[0..2_000, 2_000..5_000], 0);
        assert_eq!(A, [1.0]);
        assert_eq!(autoregression(&[0.0; 50], &[0..20, 20..50], 5), [1.0]);
    }
}
