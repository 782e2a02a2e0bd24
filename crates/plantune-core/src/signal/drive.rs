//! Periodic test inputs between -1 and 1 that a motor drive can be given, by row.
//!
//! With `p = k / period`:
//!
//! ```text
//! square     1 in the first half of a period, -1 in the second
//! staircase  1/4, 2/4, 3/4, 1, 3/4, 2/4, 1/4, 0 in turn, an eighth of a period each
//! trapezoid  up in an eighth, held for three, down through 0 in two, held for three, back in one
//! chirp      sin(2 pi p (1 + k (top - 1) / 2 n)), from 1 / period up to top / period cycles a row
//! ```

use crate::error::{Error, Result};

/// How many times as fast a chirp ends as it begins.
const TOP: f64 = 100.0;

/// `n` rows of the input of this name.
pub fn drive(kind: &str, n: usize, period: usize) -> Result<Vec<f64>> {
    if period < 8 {
        return Err(Error::argument("period", period, "at least 8 rows"));
    }
    let value = match kind {
        "square" => square,
        "staircase" => staircase,
        "trapezoid" => trapezoid,
        "chirp" => chirp,
        _ => {
            return Err(Error::argument(
                "kind",
                kind,
                "\"square\", \"staircase\", \"trapezoid\" or \"chirp\"",
            ));
        }
    };
    Ok((0..n).map(|k| value(k as f64 / period as f64, k as f64 / n as f64)).collect())
}

fn square(p: f64, _: f64) -> f64 {
    if p.fract() < 0.5 { 1.0 } else { -1.0 }
}

fn staircase(p: f64, _: f64) -> f64 {
    let tread = (8.0 * p.fract()).floor();
    1.0 - (tread - 3.0).abs() / 4.0
}

fn trapezoid(p: f64, _: f64) -> f64 {
    // A triangle of twice the height, cut off.
    let triangle = 1.0 - ((p + 0.75).fract() - 0.5).abs() * 4.0;
    (-2.0 * triangle).clamp(-1.0, 1.0)
}

fn chirp(p: f64, share: f64) -> f64 {
    (std::f64::consts::TAU * p * (1.0 + share * (TOP - 1.0) / 2.0)).sin()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(kind: &str, n: usize, period: usize) -> Vec<f64> {
        drive(kind, n, period).expect("an input")
    }

    #[test]
    fn each_begins_as_it_says() {
        assert_eq!(of("square", 9, 8), [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, 1.0]);
        assert_eq!(of("staircase", 9, 8), [0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0, 0.25]);
        assert_eq!(of("trapezoid", 9, 8), [0.0, 1.0, 1.0, 1.0, 0.0, -1.0, -1.0, -1.0, 0.0]);
    }

    /// Zero crossings lie ever closer; there are two a cycle.
    #[test]
    fn a_chirp_sweeps_from_one_to_the_top() {
        let n = 4000;
        let x = of("chirp", n, 2000);
        let crossings = |rows: std::ops::Range<usize>| rows.filter(|&k| x[k] * x[k - 1] < 0.0).count();
        // From 1 to 1 + 99/16 cycles per 2000 rows in the first sixteenth, up to 100 in the last.
        assert!((0..=1).contains(&crossings(1..251)), "{}", crossings(1..251));
        assert!((23..=25).contains(&crossings(n - 250..n)), "{}", crossings(n - 250..n));
    }

    #[test]
    fn unknown_names_and_short_periods_are_refused() {
        assert!(drive("saw", 10, 8).is_err() && drive("square", 10, 7).is_err());
    }
}
