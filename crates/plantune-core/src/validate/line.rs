//! The line that stands out of the spectrum of errors: a periodic disturbance, or a resonance (M08).
//!
//! ```text
//! I_j = |sum_t e(t) e^(-j w_j t)|^2,   g = max_j I_j / sum_j I_j,   P(g > x) = n (1 - x)^(n - 1) of white errors
//! ```
//!
//! Fisher's test of the largest of `n` ordinates. Of a line between two of them the neighbours hold their part, so three
//! are taken together for its share, and their mean for its frequency. Errors that drift are largest at low frequencies:
//! a line or a resonance must stand out from those. Fisher 1929; Brockwell and Davis 1991, 10.2.

use std::f64::consts::TAU;

use crate::signal::Fourier;
use crate::stats::centred;

/// Chance above which the largest ordinate says nothing.
const CHANCE: f64 = 1e-6;

/// Least share of the errors that one frequency must hold to be named.
const SHARE: f64 = 0.1;

/// Least number of its periods in the record, for there to be lower ordinates enough.
const PERIODS: usize = 8;

/// How many times as high as the ordinates of the lower frequencies it must be.
const HIGHER: f64 = 6.0;

/// One frequency among errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Frequency, rad per row.
    pub w: f64,
    /// Share of the variance that it holds.
    pub share: f64,
}

/// The line in errors on ascending `rows`, if there is one; rows between that are missing count as zero.
pub fn line(rows: &[usize], e: &[f64]) -> Option<Line> {
    let (first, last) = (*rows.first()?, *rows.last()?);
    let mut padded = vec![0.0; last - first + 1];
    for (row, e) in rows.iter().zip(centred(e.to_vec())) {
        padded[row - first] = e;
    }
    let N = padded.len();
    let spectrum = Fourier::new(N).of(&mut padded);
    let I: Vec<f64> = spectrum[1..].iter().map(|c| c.norm_sqr()).collect();
    let (n, total) = (I.len(), I.iter().sum::<f64>());
    let top = (0..n).max_by(|&a, &b| I[a].total_cmp(&I[b]))?;
    let chance = n as f64 * (1.0 - I[top] / total).powf(n as f64 - 1.0);
    let around = top.saturating_sub(1)..(top + 2).min(n);
    let own: f64 = I[around.clone()].iter().sum();
    let at: f64 = around.map(|j| (j + 1) as f64 * I[j]).sum::<f64>() / own;
    if top < PERIODS {
        return None;
    }
    let lower = &I[..top / 2];
    let stands_out = own / 3.0 > HIGHER * lower.iter().sum::<f64>() / lower.len() as f64;
    (stands_out && chance < CHANCE && own > SHARE * total)
        .then_some(Line { w: TAU * at / N as f64, share: own / total })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    #[test]
    fn a_wave_in_noise_is_found_and_noise_alone_is_not() {
        let noise = white(1000, 3);
        let rows: Vec<usize> = (0..1000).collect();
        assert_eq!(line(&rows, &noise), None);
        for w in [0.1, 0.77, 2.5] {
            let e: Vec<f64> = noise.iter().enumerate().map(|(k, e)| e + (w * k as f64).sin()).collect();
            let found = line(&rows, &e).expect("a line");
            assert!((found.w - w).abs() < 0.004, "{} {w}", found.w);
            assert!((found.share - 1.0 / 3.0).abs() < 0.06, "{}", found.share);
        }
    }

    #[test]
    fn errors_that_drift_have_no_line() {
        for (seed, c) in (0..40).map(|k| (k, 0.98 - 0.1 * (k % 4) as f64)) {
            let mut e = white(500, seed);
            crate::poly::divide(&[1.0, -c], &mut e);
            let rows: Vec<usize> = (0..500).collect();
            assert_eq!(line(&rows, &e), None, "{seed} {c}");
        }
    }

    #[test]
    fn a_resonance_is_found() {
        let (w, zeta) = (0.5f64, 0.05f64);
        let mut e = white(1000, 8);
        let size = (-zeta * w).exp();
        crate::poly::divide(&[1.0, -2.0 * size * w.cos(), size * size], &mut e);
        let found = line(&(0..1000).collect::<Vec<_>>(), &e).expect("a line");
        assert!((found.w / w - 1.0).abs() < 0.05, "{}", found.w);
    }
}
