//! A sine whose frequency sweeps from `w1` to `w2` rad/s over the record, `T = n Ts`.
//!
//! ```text
//! linear       phase = w1 t + (w2 - w1) t^2 / (2 T)                the same time for every rad/s
//! logarithmic  phase = w1 T / ln(w2/w1) ((w2/w1)^(t/T) - 1)        the same time for every decade
//! ```

use std::f64::consts::PI;

use crate::error::{Error, Result};

/// How the frequency goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sweep {
    /// The same time for every rad/s.
    Linear,
    /// The same time for every decade.
    Logarithmic,
}

/// `n` rows of a sine between -1 and 1 that sweeps over a band, in rad/s, up or down.
pub fn chirp(n: usize, Ts: f64, (w1, w2): (f64, f64), sweep: Sweep) -> Result<Vec<f64>> {
    if !(Ts > 0.0 && Ts.is_finite()) {
        return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
    }
    let inside = |w: f64| w > 0.0 && w <= PI / Ts;
    if !(inside(w1) && inside(w2)) {
        let needed = format!("two frequencies above 0, up to the Nyquist frequency {} rad/s", PI / Ts);
        return Err(Error::argument("band", format!("({w1}, {w2})"), &needed));
    }
    let T = n as f64 * Ts;
    let octaves = (w2 / w1).ln();
    let phase = |t: f64| match sweep {
        Sweep::Logarithmic if octaves != 0.0 => w1 * T / octaves * (octaves * t / T).exp_m1(),
        _ => w1 * t + (w2 - w1) * t * t / (2.0 * T),
    };
    Ok((0..n).map(|k| phase(k as f64 * Ts).sin()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole cycles from the zero crossings: a logarithmic sweep spends half its time on either decade.
    #[test]
    fn a_logarithmic_sweep_spends_the_same_time_on_every_decade() {
        let x = chirp(20_000, 0.01, (0.5, 50.0), Sweep::Logarithmic).expect("a chirp");
        let crossings = |rows: std::ops::Range<usize>| rows.filter(|&k| x[k] * x[k - 1] < 0.0).count();
        let (slow, fast) = (crossings(2..10_000), crossings(10_000..20_000));
        let ratio = fast as f64 / slow as f64;
        assert!((9.0..11.5).contains(&ratio), "{slow} {fast}");
    }

    #[test]
    fn frequencies_beyond_nyquist_are_refused() {
        assert!(chirp(100, 1.0, (0.1, 3.2), Sweep::Linear).is_err());
        assert!(chirp(100, 1.0, (0.0, 1.0), Sweep::Linear).is_err());
    }
}
