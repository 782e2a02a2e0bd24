//! Residual analysis: what the one-step errors still know of their own past and of the input.
//!
//! ```text
//! r_e(k)  = sum e(t) e(t-k) / sum e(t)^2                       99 % band  2.58 / sqrt(N)
//! r_eu(k) = sum e(t) u(t-k) / sqrt(sum e^2 sum u^2)            99 % band  2.58 sqrt(sum_j r_e(j) r_u(j) / N)
//! ```
//!
//! Source 001, 3.5.9; Ljung 1999, (16.48) and (16.66).

use crate::linalg::dot;
use crate::record::Record;
use crate::stats::normal_quantile;

/// Correlations with their 99 % bands.
#[derive(Clone, Debug)]
pub struct Residuals {
    /// `0 ..= M`.
    pub lags: Vec<i64>,
    /// Normalised autocorrelation.
    pub autocorr: Vec<f64>,
    /// Half width of its band.
    pub band: f64,
    /// `-M ..= M`; a residual that follows the input has its peak at a lag >= 0.
    pub cross_lags: Vec<i64>,
    /// Cross-correlation with each input.
    pub crosscorr: Vec<Vec<f64>>,
    /// Half width of the band for each input.
    pub cross_band: Vec<f64>,
}

/// Correlations of the errors `e` on `rows` of the record, up to `most` lags.
pub fn residuals(rec: &Record, rows: &[usize], e: &[f64], most: usize) -> Residuals {
    let N = e.len();
    let most = most.min(N.saturating_sub(1) / 4);
    let z = normal_quantile(0.99);
    let e = centred(e.iter().copied());
    let autocorr = correlation(&e, &e, most);
    let mut crosscorr = Vec::new();
    let mut cross_band = Vec::new();
    for i in 0..rec.nu {
        let u = centred(rows.iter().map(|&k| rec.u_at(k, i)));
        let later = correlation(&e, &u, most);
        let earlier = correlation(&u, &e, most);
        crosscorr.push(earlier[1..].iter().rev().chain(&later).copied().collect());
        let own = correlation(&u, &u, most);
        let inflation = 1.0 + 2.0 * autocorr[1..].iter().zip(&own[1..]).map(|(a, b)| a * b).sum::<f64>();
        cross_band.push(z * (inflation.max(0.1) / N as f64).sqrt());
    }
    let M = most as i64;
    Residuals {
        lags: (0..=M).collect(),
        autocorr,
        band: z / (N as f64).sqrt(),
        cross_lags: (-M..=M).collect(),
        crosscorr,
        cross_band,
    }
}

fn centred(x: impl Iterator<Item = f64>) -> Vec<f64> {
    let x: Vec<f64> = x.collect();
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    x.into_iter().map(|v| v - mean).collect()
}

/// `sum a(t) b(t-k) / sqrt(sum a^2 sum b^2)` for `k = 0 ..= most`; zero where a signal stands still.
pub(super) fn correlation(a: &[f64], b: &[f64], most: usize) -> Vec<f64> {
    let size = (dot(a, a) * dot(b, b)).sqrt();
    (0..=most).map(|k| if size > 0.0 { dot(&a[k..], &b[..b.len() - k]) / size } else { 0.0 }).collect()
}
