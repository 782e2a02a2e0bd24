//! A periodic sum of cosines of one amplitude, scaled to a peak of 1.
//!
//! ```text
//! u(t) = c sum_k cos(2 pi k t / M + phi_k),   k = every line with  low <= 2 pi k / (M Ts) <= high
//! Schroeder   phi_j = -pi j (j - 1) / F   for the j-th of F lines: crest factor about 1.7
//! random      phi_j uniform:              crest factor 3 to 4
//! ```
//!
//! A low crest factor is much power at a given peak, and it is the peak that a plant allows.
//! Schroeder, IEEE Trans. Inf. Theory 16 (1970) 85-89.

use std::f64::consts::{PI, TAU};

use crate::error::{Error, Result};
use crate::linalg::Random;

/// How the phases of a multisine are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phases {
    /// Those that make the peak low.
    Schroeder,
    /// Drawn with this seed.
    Random(u64),
}

/// `n` rows of a multisine with a period of `period` rows and the lines of a band in rad/s.
pub fn multisine(n: usize, period: usize, band: (f64, f64), Ts: f64, phases: Phases) -> Result<Vec<f64>> {
    let lines = lines(period, band, Ts)?;
    let phases = drawn(lines.len(), phases);
    let table: Vec<f64> = (0..period).map(|t| (TAU * t as f64 / period as f64).cos()).collect();
    let sine: Vec<f64> = (0..period).map(|t| (TAU * t as f64 / period as f64).sin()).collect();
    let mut x = vec![0.0; period];
    for (k, phase) in lines.zip(phases) {
        let (s, c) = phase.sin_cos();
        for (t, x) in x.iter_mut().enumerate() {
            let at = (k * t) % period;
            *x += c * table[at] - s * sine[at];
        }
    }
    let peak = x.iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
    Ok((0..n).map(|t| x[t % period] / peak).collect())
}

/// The lines of a band, below the Nyquist frequency.
fn lines(period: usize, (low, high): (f64, f64), Ts: f64) -> Result<std::ops::Range<usize>> {
    if !(Ts > 0.0 && Ts.is_finite()) {
        return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
    }
    if !(low >= 0.0 && low < high && high <= PI / Ts * (1.0 + 1e-12)) {
        let needed = format!("0 <= low < high <= {} rad/s, the Nyquist frequency", PI / Ts);
        return Err(Error::argument("band", format!("({low}, {high})"), &needed));
    }
    let line = |w: f64| w * period as f64 * Ts / TAU;
    let first = ((line(low) * (1.0 - 1e-12)).ceil() as usize).max(1);
    let last = ((line(high) * (1.0 + 1e-12)).floor() as usize).min(period.saturating_sub(1) / 2);
    if first > last {
        let needed = format!("wider: the lines are {} rad/s apart", TAU / (period as f64 * Ts));
        return Err(Error::argument("band", format!("({low}, {high})"), &needed));
    }
    Ok(first..last + 1)
}

fn drawn(count: usize, phases: Phases) -> Vec<f64> {
    match phases {
        Phases::Schroeder => (1..=count).map(|j| -PI * (j * (j - 1)) as f64 / count as f64).collect(),
        Phases::Random(seed) => {
            let mut random = Random::new(seed);
            (0..count).map(|_| TAU * random.uniform()).collect()
        }
    }
}

/// `max |u| / rms(u)` about zero: 1 of a binary signal, 1.41 of a sine.
pub fn crest_factor(u: &[f64]) -> Result<f64> {
    let power = u.iter().map(|u| u * u).sum::<f64>() / u.len() as f64;
    let peak = u.iter().fold(0.0_f64, |peak, u| peak.max(u.abs()));
    if !(power > 0.0 && power.is_finite()) {
        return Err(Error::argument("u", "zero, empty or not finite", "a signal that moves"));
    }
    Ok(peak / power.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schroeder_phases_keep_the_peak_low() {
        let of = |phases| {
            let u = multisine(512, 512, (0.0, 1.0), 1.0, phases).expect("a multisine");
            crest_factor(&u).expect("a number")
        };
        assert!(of(Phases::Schroeder) < 1.8);
        assert!((0..20).all(|seed| of(Phases::Random(seed)) > 2.0));
    }

    #[test]
    fn a_band_without_a_line_is_refused() {
        assert!(multisine(100, 100, (0.01, 0.05), 1.0, Phases::Schroeder).is_err());
        assert!(multisine(100, 100, (0.01, 3.2), 1.0, Phases::Schroeder).is_err());
    }
}
