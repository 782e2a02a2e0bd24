//! Autocorrelation of a signal, and how many of its rows are independent.
//!
//! ```text
//! R(l) = sum x(n) x(n-l) / sum x(n)^2           within the runs              (3.5-8)
//! white: |R(l)| < 1.96/sqrt(N) for 95 % of the lags
//! Q = N (N + 2) sum_l R(l)^2/(N - l), chi-square of m degrees, m = min(20, N/5)
//! N_mean = N/(1 + 2 sum R(l)),  N_var = N/(1 + 2 sum R(l)^2),  up to the first lag inside 2/sqrt(N)
//! ```
//!
//! The last two are the rows of white noise whose mean, or variance, would be known as well. Box and Jenkins 1970;
//! Ljung and Box 1978; source 001, 3.5.2 c.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::signal::correlate;
use crate::stats::{chi2_tail, normal_quantile};

/// Longest lag by default.
const LAGS: usize = 100;

/// Lags of the test for whiteness.
const TESTED: usize = 20;

/// How a signal hangs together in time.
#[derive(Clone, Debug)]
pub struct Colour {
    /// `R(0) …`.
    pub R: Vec<f64>,
    /// Half width of the 95 % band of white noise.
    pub band: f64,
    /// Lags beyond the first that lie inside it, as a share.
    pub inside: f64,
    /// p-value of whiteness.
    pub white: f64,
    /// Independent rows of which the mean is as sure.
    pub N_mean: f64,
    /// Independent rows of which the variance is as sure.
    pub N_var: f64,
    /// First lag at which `R` is below `1/e`.
    pub memory: usize,
}

/// Of deviations `x`, over the runs.
pub fn colour(x: &[f64], runs: &[Range<usize>], lags: Option<usize>) -> Result<Colour> {
    let longest = runs.iter().map(Range::len).max().unwrap_or(0);
    if let Some(lags) = lags.filter(|lags| !(1..longest).contains(lags)) {
        return Err(Error::argument("lags", lags, &format!("from 1 to {}", longest.saturating_sub(1))));
    }
    let N = runs.iter().map(Range::len).sum::<usize>();
    let all = autocorrelation(x, runs, longest / 4);
    let most = lags.unwrap_or((longest / 4).min(LAGS));
    let R = if most < all.len() { all[..=most].to_vec() } else { autocorrelation(x, runs, most) };
    let band = normal_quantile(0.95) / (N as f64).sqrt();
    let tested = TESTED.min(N / 5).min(all.len() - 1);
    let Q = |l: usize| all[l] * all[l] / (N - l) as f64;
    let Q = N as f64 * (N + 2) as f64 * (1..=tested).map(Q).sum::<f64>();
    Ok(Colour {
        inside: R[1..].iter().filter(|r| r.abs() < band).count() as f64 / most as f64,
        white: chi2_tail(Q, tested as f64),
        N_mean: independent(&all, N, 1),
        N_var: independent(&all, N, 2),
        memory: all.iter().position(|r| *r < (-1.0f64).exp()).unwrap_or(all.len()),
        R,
        band,
    })
}

/// `R(0 ..= most)` of deviations over the runs.
fn autocorrelation(x: &[f64], runs: &[Range<usize>], most: usize) -> Vec<f64> {
    let mut R = vec![0.0; most + 1];
    for run in runs {
        let x = &x[run.clone()];
        R.iter_mut().zip(correlate(x, x)).for_each(|(R, r)| *R += r);
    }
    let power = R[0];
    R.iter_mut().for_each(|r| *r /= power);
    R
}

/// `N/(1 + 2 sum R(l)^power)`, the sum up to where `R` first lies inside its band.
fn independent(R: &[f64], N: usize, power: i32) -> f64 {
    let band = 2.0 / (N as f64).sqrt();
    let sum: f64 = R[1..].iter().take_while(|r| r.abs() >= band).map(|r| r.powi(power)).sum();
    N as f64 / (1.0 + 2.0 * sum).max(1.0)
}
