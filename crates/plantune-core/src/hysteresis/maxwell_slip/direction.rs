//! Which way a loop turns, with x to the right and y upwards: what it asks of a model.
//!
//! ```text
//! A = closed integral of y dx,   path from the first to the last row where x passes a level
//! upper, lower = the shares above and below the median of x
//! ```
//!
//! The path is closed in x, so that any curve without memory integrates to 0. Of the levels at which the record
//! begins and ends, and the median, the one with the longest path counts; where the ends nearly meet, all of it, and
//! a chord. Clockwise loops (A > 0: y higher while x
//! rises, as forces of friction are) want stops; counter-clockwise ones (y behind x, as piezos are) want plays; where
//! the two halves turn against each other, the loop is a butterfly and wants plays on |x| as well.
//! Source 002, figure 3.6: types A and B.

use crate::error::{Error, Result};
use crate::linalg::extent;
use crate::note::Place;
use crate::stats::median;

/// Mean half width of a loop that counts, as a share of the range of y.
const OPEN: f64 = 0.002;

/// Share of the range of x within which the ends of a record meet.
const NEAR: f64 = 0.05;

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
    let (Some(&begin), Some(&end)) = (x.first(), x.last()) else {
        return Err(Error::argument("x", "empty", "one whole cycle or more"));
    };
    let middle = median(x.to_vec());
    let between = [begin, end, middle].into_iter().filter_map(|level| closed(x, y, level));
    let paths = between.chain(whole(x, y)).filter(|path| travel(path) > 0.0);
    let longest = paths.max_by(|a, b| travel(a).total_cmp(&travel(b))).ok_or_else(|| {
        Error::new("X01", "x does not come back: there is no closed loop")
            .at(Place::column("x"))
            .remedy("record one whole cycle of the input or more")
    })?;
    let (mut upper, mut lower) = (0.0, 0.0);
    let mut add = |from: Point, to: Point| {
        let part = 0.5 * (from.1 + to.1) * (to.0 - from.0);
        *(if from.0 + to.0 >= 2.0 * middle { &mut upper } else { &mut lower }) += part;
    };
    for points in longest.windows(2) {
        let (from, to) = (points[0], points[1]);
        if (from.0 - middle) * (to.0 - middle) < 0.0 {
            let between = at_level(from, to, middle);
            add(from, between);
            add(between, to);
        } else {
            add(from, to);
        }
    }
    Ok(judged(upper, lower, travel(&longest), y))
}

type Point = (f64, f64);

/// From the first to the last passage of a level; none where there is only one.
fn closed(x: &[f64], y: &[f64], level: f64) -> Option<Vec<Point>> {
    let passes = |t: &usize| x[t - 1] != x[*t] && (x[t - 1] - level) * (x[*t] - level) <= 0.0;
    let mut passages = (1..x.len()).filter(passes);
    let (first, last) = (passages.next()?, passages.next_back()?);
    let passage = |t: usize| at_level((x[t - 1], y[t - 1]), (x[t], y[t]), level);
    let rows = (first..last).map(|t| (x[t], y[t]));
    Some([passage(first)].into_iter().chain(rows).chain([passage(last)]).collect())
}

/// The record as it is, closed by a chord; none where its ends are far apart.
fn whole(x: &[f64], y: &[f64]) -> Option<Vec<Point>> {
    let (low, high) = extent(x);
    let rows = || x.iter().copied().zip(y.iter().copied());
    let near = (x[x.len() - 1] - x[0]).abs() <= NEAR * (high - low);
    near.then(|| rows().chain(rows().take(1)).collect())
}

/// Where the chord passes a level of x.
fn at_level(from: Point, to: Point, level: f64) -> Point {
    (level, from.1 + (to.1 - from.1) * (level - from.0) / (to.0 - from.0))
}

fn travel(path: &[Point]) -> f64 {
    path.windows(2).map(|p| (p[1].0 - p[0].0).abs()).sum()
}

fn judged(upper: f64, lower: f64, travel: f64, y: &[f64]) -> LoopDirection {
    let (low, high) = extent(y);
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
        // From the level of the beginning back to it are three circles, to rounding of the last row.
        assert_eq!(found.direction, "clockwise");
        assert!((found.area - 3.0 * std::f64::consts::PI).abs() < 1e-4, "{found:?}");
        let back: Vec<f64> = y.iter().map(|y| -y).collect();
        assert_eq!(loop_direction(&x, &back).expect("a loop").direction, "counter-clockwise");
        let flat: Vec<f64> = x.iter().map(|x| x * x).collect();
        assert_eq!(loop_direction(&x, &flat).expect("a loop").direction, "none");
    }
}
