//! Which way a loop turns, with x to the right and y upwards: what it asks of a model.
//!
//! ```text
//! A = closed integral of y dx,   path from the first to the last crossing of a middle x_c
//! upper, lower = the shares of x > x_c and x < x_c
//! ```
//!
//! The path is closed in x, so that any curve without memory integrates to 0. Clockwise loops (A > 0: y higher
//! while x rises, as forces of friction are) want stops; counter-clockwise ones (y behind x, as piezos are) want
//! plays; where the two halves turn against each other, the loop is a butterfly and wants plays on |x| as well.
//! Source 002, figure 3.6: types A and B.

use crate::error::{Error, Result};
use crate::note::Place;
use crate::stats::median;

/// Mean half width of a loop that counts, as a share of the range of y.
const OPEN: f64 = 0.002;

/// How a loop turns.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopDirection {
    /// Area of all loops, y times x; clockwise positive.
    pub area: f64,
    /// Of it, what lies above the middle of x.
    pub upper: f64,
    /// And below.
    pub lower: f64,
    /// Mean half width of the loops, as a share of the range of y.
    pub width: f64,
    /// `clockwise`, `counter-clockwise`, `butterfly` or `none`.
    pub direction: &'static str,
}

/// How the loops of a record turn.
pub fn loop_direction(x: &[f64], y: &[f64]) -> Result<LoopDirection> {
    if x.len() != y.len() {
        return Err(Error::new("D09", format!("x has {} rows and y has {}", x.len(), y.len()))
            .remedy("pass rows of the same instants"));
    }
    let middle = median(x.to_vec());
    let crossings: Vec<usize> = (1..x.len()).filter(|&t| (x[t - 1] < middle) != (x[t] < middle)).collect();
    let (first, last) = match crossings[..] {
        [first, .., last] => (first, last),
        _ => {
            return Err(Error::new("X01", "x does not come back: there is no closed loop")
                .at(Place::column("x"))
                .measured(crossings.len() as f64, 2.0)
                .remedy("record one whole cycle of the input or more"));
        }
    };
    // y where x crosses the middle before row t.
    let at_middle = |t: usize| y[t - 1] + (y[t] - y[t - 1]) * (middle - x[t - 1]) / (x[t] - x[t - 1]);
    let (mut upper, mut lower, mut travel) = (0.0, 0.0, 0.0);
    let mut add = |from: (f64, f64), to: (f64, f64)| {
        let part = 0.5 * (from.1 + to.1) * (to.0 - from.0);
        *(if from.0 + to.0 >= 2.0 * middle { &mut upper } else { &mut lower }) += part;
        travel += (to.0 - from.0).abs();
    };
    for t in first..=last {
        let (from, to) = ((x[t - 1], y[t - 1]), (x[t], y[t]));
        let crosses = (from.0 < middle) != (to.0 < middle);
        if crosses {
            let between = (middle, at_middle(t));
            if t > first {
                add(from, between);
            }
            if t < last {
                add(between, to);
            }
        } else {
            add(from, to);
        }
    }
    Ok(judged(upper, lower, travel, y))
}

fn judged(upper: f64, lower: f64, travel: f64, y: &[f64]) -> LoopDirection {
    let (low, high) = crate::linalg::extent(y);
    let share = |area: f64| if travel > 0.0 && high > low { area / (travel * (high - low)) } else { 0.0 };
    let counts = |area: f64| share(area).abs() > OPEN / 2.0;
    let area = upper + lower;
    let direction = if upper * lower < 0.0 && counts(upper) && counts(lower) {
        "butterfly"
    } else if share(area).abs() <= OPEN {
        "none"
    } else if area > 0.0 {
        "clockwise"
    } else {
        "counter-clockwise"
    };
    LoopDirection { area, upper, lower, width: share(area).abs(), direction }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A circle of radius 1, run through n times: area pi each.
    #[test]
    fn a_circle_has_its_area() {
        let n = 5000;
        let at = |k: usize| 3.0 * 2.0 * std::f64::consts::PI * k as f64 / n as f64 + 0.3;
        let x: Vec<f64> = (0..=n).map(|k| at(k).sin()).collect();
        let y: Vec<f64> = (0..=n).map(|k| at(k).cos() + 0.5 * at(k).sin().powi(2)).collect();
        let found = loop_direction(&x, &y).expect("a loop");
        // From the first to the last crossing are two and a half circles.
        assert_eq!(found.direction, "clockwise");
        assert!((found.area - 2.5 * std::f64::consts::PI).abs() < 1e-4, "{found:?}");
        let back: Vec<f64> = y.iter().map(|y| -y).collect();
        assert_eq!(loop_direction(&x, &back).expect("a loop").direction, "counter-clockwise");
        let flat: Vec<f64> = x.iter().map(|x| x * x).collect();
        assert_eq!(loop_direction(&x, &flat).expect("a loop").direction, "none");
    }
}
