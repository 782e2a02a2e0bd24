//! The period of an input, in rows.
//!
//! ```text
//! D(p) = sum (u(t) - u(t-p))^2 / (2 sum (u - mean)^2 over the same rows)
//! ```
//!
//! The first `p` with `D(p) < 0.01` behind one with `D > 0.5`: the input has gone away and come back. A delay and one
//! that is a period longer give the same regressors, so that no record of such an input tells them apart.

use std::ops::Range;

use crate::record::Record;
use crate::stats::centred;

/// `D` at which an input has gone away, and at which it has come back.
const AWAY: f64 = 0.5;
const BACK: f64 = 0.01;

/// The shortest period of an input up to `most` rows, if it has one; a whole period must repeat.
pub(super) fn period(rec: &Record, input: usize, most: usize) -> Option<usize> {
    let u = centred(rec.input(input).to_vec());
    let segments: Vec<Range<usize>> = rec.segments().collect();
    let longest = segments.iter().map(Range::len).max()?;
    let away = (1..=most).find(|&p| distance(&u, &segments, p) > AWAY)?;
    (away + 1..=most).find(|&p| 2 * p < longest && distance(&u, &segments, p) < BACK)
}

fn distance(u: &[f64], segments: &[Range<usize>], p: usize) -> f64 {
    let (mut apart, mut size) = (0.0, 0.0);
    for segment in segments.iter().filter(|s| s.len() > p) {
        for t in segment.start + p..segment.end {
            apart += (u[t] - u[t - p]).powi(2);
            size += u[t] * u[t] + u[t - p] * u[t - p];
        }
    }
    if size > 0.0 { apart / size } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn of(u: &[f64], most: usize) -> Option<usize> {
        period(&Record::uniform(u, 1, u, 1, 1.0).expect("fine"), 0, most)
    }

    #[test]
    fn waves_and_squares_have_one_and_noise_and_steps_have_none() {
        let square: Vec<f64> = (0..400).map(|k| f64::from(k / 5 % 2)).collect();
        let wave: Vec<f64> = (0..400).map(|k| (std::f64::consts::TAU * f64::from(k) / 8.0).sin()).collect();
        let step: Vec<f64> = (0..400).map(|k| f64::from(u8::from(k > 90))).collect();
        assert_eq!(of(&square, 30), Some(10));
        assert_eq!(of(&wave, 30), Some(8));
        assert_eq!(of(&square, 9), None);
        assert_eq!((of(&step, 100), of(&white(400, 1), 100)), (None, None));
    }
}
