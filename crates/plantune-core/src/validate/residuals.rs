//! Residual analysis: what the one-step errors still know of their own past and of the input.
//!
//! ```text
//! r_e(k)  = sum e(t) e(t-k) / sum e(t)^2                       99 % band  2.58 / sqrt(N)
//! r_eu(k) = sum e(t) u(t-k) / sqrt(sum e^2 sum u^2)            99 % band  2.58 sqrt(sum_j r_e(j) r_u(j) / N)
//! Q = N (N + 2) sum_k r_e(k)^2 / (N - k),  chi-square with M degrees where e is white
//! ```
//!
//! Ljung and Box 1978 for Q. Source 001, 3.5.9; Ljung 1999, (16.48) and (16.66).

use crate::linalg::dot;
use crate::record::Record;
use crate::stats::{centred, chi2_tail, normal_quantile};

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
    /// Largest `|r_eu| / band` at lags from 1 on that chance gives in one record of a hundred, when the model
    /// was fitted on as many other rows and its own error doubles the variance.
    pub cross_limit: f64,
    /// p-value of all lags of the autocorrelation together.
    pub portmanteau: f64,
}

/// Correlations of the errors `e` on `rows` of the record, up to `most` lags.
pub fn residuals(rec: &Record, rows: &[usize], e: &[f64], most: usize) -> Residuals {
    let N = e.len();
    let most = most.min(N.saturating_sub(1) / 4);
    let z = normal_quantile(0.99);
    let e = centred(e.to_vec());
    let autocorr = correlation(&e, &e, most);
    let mut crosscorr = Vec::new();
    let mut cross_band = Vec::new();
    for i in 0..rec.nu {
        let u = centred(rows.iter().map(|&k| rec.u_at(k, i)).collect());
        let later = correlation(&e, &u, most);
        let earlier = correlation(&u, &e, most);
        crosscorr.push(earlier[1..].iter().rev().chain(&later).copied().collect());
        let own = correlation(&u, &u, most);
        let inflation = 1.0 + 2.0 * autocorr[1..].iter().zip(&own[1..]).map(|(a, b)| a * b).sum::<f64>();
        cross_band.push(z * (inflation.max(0.1) / N as f64).sqrt());
    }
    let M = most as i64;
    Residuals {
        portmanteau: portmanteau(&autocorr, N),
        lags: (0..=M).collect(),
        autocorr,
        band: z / (N as f64).sqrt(),
        cross_lags: (-M..=M).collect(),
        crosscorr,
        cross_band,
        cross_limit: (2.0f64).sqrt() * normal_quantile(1.0 - 0.01 / most.max(1) as f64) / z,
    }
}

/// p-value of "no lag of the autocorrelation is more than chance".
fn portmanteau(autocorr: &[f64], N: usize) -> f64 {
    let rows = N as f64;
    let lags = autocorr.iter().enumerate().skip(1);
    let Q = rows * (rows + 2.0) * lags.map(|(k, r)| r * r / (rows - k as f64)).sum::<f64>();
    chi2_tail(Q, (autocorr.len() - 1) as f64)
}

/// `sum a(t) b(t-k) / sqrt(sum a^2 sum b^2)` for `k = 0 ..= most`; zero where a signal stands still.
pub(super) fn correlation(a: &[f64], b: &[f64], most: usize) -> Vec<f64> {
    let size = dot(a, a).sqrt() * dot(b, b).sqrt();
    (0..=most).map(|k| if size > 0.0 { dot(&a[k..], &b[..b.len() - k]) / size } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn of(u: &[f64], e: &[f64], most: usize) -> Residuals {
        let rec = Record::uniform(u, 1, e, 1, 1.0).expect("fine");
        let rows: Vec<usize> = (0..e.len()).collect();
        residuals(&rec, &rows, e, most)
    }

    #[test]
    fn errors_that_follow_the_input_peak_at_a_positive_lag() {
        let first = white(500, 1);
        let later: Vec<f64> = (0..500).map(|k| if k < 3 { 0.0 } else { 0.5 * first[k - 3] }).collect();
        for (u, e, lag) in [(&first, &later, 3), (&later, &first, -3)] {
            let r = of(u, e, 10);
            let peak =
                (0..21).max_by(|&a, &b| r.crosscorr[0][a].total_cmp(&r.crosscorr[0][b])).expect("lags");
            assert_eq!((r.cross_lags[peak], r.cross_lags.len()), (lag, 21));
            assert!(r.crosscorr[0][peak] > 0.99);
        }
    }

    #[test]
    fn lag_zero_of_the_autocorrelation_is_one_whatever_the_level() {
        let e: Vec<f64> = white(300, 2).iter().map(|e| 1e3 + e).collect();
        let r = of(&white(300, 3), &e, 5);
        assert!((r.autocorr[0] - 1.0).abs() < 1e-14 && r.autocorr[1].abs() < r.band);
    }

    #[test]
    fn an_alternating_error_is_anticorrelated() {
        let e: Vec<f64> = (0..100).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let r = of(&white(100, 4), &e, 2);
        assert!((r.autocorr[1] + 0.99).abs() < 1e-12 && (r.autocorr[2] - 0.98).abs() < 1e-12);
    }

    /// White errors against white inputs, 1000 lags in all: about 1 % lie outside.
    #[test]
    fn the_bands_hold_about_99_percent() {
        let (mut outside, mut counted) = (0, 0);
        for seed in 0..50 {
            let r = of(&white(400, 2 * seed), &white(400, 2 * seed + 1), 10);
            outside += r.autocorr[1..].iter().filter(|r_e| r_e.abs() > r.band).count();
            outside += r.crosscorr[0].iter().filter(|r_eu| r_eu.abs() > r.cross_band[0]).count();
            counted += 10 + 21;
        }
        // Binomial, 1550 lags at 1 %: 15.5 +- 3.9, four standard deviations allowed.
        assert!((0..=31).contains(&outside), "{outside} of {counted}");
    }

    #[test]
    fn an_input_that_stands_still_correlates_with_nothing() {
        let r = of(&[2.0; 200], &white(200, 5), 5);
        assert!(r.crosscorr[0].iter().all(|r| *r == 0.0));
    }
}
