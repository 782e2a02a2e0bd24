//! Generalised binary noise: a binary signal that changes at random times.
//!
//! ```text
//! every `least` rows the sign changes with probability  p = least / hold
//! mean switching time = hold rows,   r(l) = (1 - 2 p)^|l|   for a lag of l clock periods
//! ```
//!
//! At `hold = 2 least` it is white at its clock; longer ones put their power at low frequencies without the
//! period of a PRBS. Tulleken, Automatica 26 (1990) 37-49.

use crate::error::{Error, Result};
use crate::linalg::Random;

/// `n` rows of -1 and +1 that stay for `hold` rows in the mean, and for `least` at least.
pub fn gbn(n: usize, hold: f64, least: usize, seed: u64) -> Result<Vec<f64>> {
    if least == 0 {
        return Err(Error::argument("least", 0, "at least 1 row"));
    }
    if !(hold > least as f64 && hold.is_finite()) {
        return Err(Error::argument("hold", hold, "more rows than `least`"));
    }
    let mut random = Random::new(seed);
    let mut value = random.sign();
    let mut out = Vec::with_capacity(n);
    while out.len() < n {
        out.extend(std::iter::repeat_n(value, least.min(n - out.len())));
        if random.uniform() < least as f64 / hold {
            value = -value;
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stay_for_the_least_time_and_for_the_mean_time_in_the_mean() {
        let x = gbn(60_000, 12.0, 3, 5).expect("a sequence");
        let stays: Vec<usize> = x.chunk_by(|a, b| a == b).map(<[f64]>::len).collect();
        let inner = &stays[..stays.len() - 1];
        assert!(inner.iter().all(|rows| rows % 3 == 0));
        let mean = inner.iter().sum::<usize>() as f64 / inner.len() as f64;
        assert!((mean - 12.0).abs() < 0.5, "{mean}"); // three standard deviations of the mean
    }
}
