//! Near which break points the plant runs.
//!
//! ```text
//! limits of break point b with the margin m     b - m <= x <= b + m
//! ```
//!
//! Every signal keeps its break point while the limits of that one hold; else it takes the break point whose
//! limits hold, the nearest where several do. Margins wide enough to overlap thus make a hysteresis. A signal
//! between all limits has no break point, and the plant then is at no operating point.
//! Source 001, 3.7.3 and figure 3.7-2.

use crate::error::{Error, Result};

/// Most signals of an operating point.
pub const MOST: usize = 3;

/// A break point of each signal, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    index: [usize; MOST],
    signals: usize,
}

impl Node {
    /// One number per signal.
    pub fn as_slice(&self) -> &[usize] {
        &self.index[..self.signals]
    }
}

/// Where the plant is after a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The operating point, if it is at one.
    pub node: Option<Node>,
    /// Whether it begins with this sample.
    pub new: bool,
}

/// Follows the operating point from sample to sample.
///
/// ```
/// use plantune_core::adapt::OperatingPoint;
///
/// let mut point = OperatingPoint::new(&[vec![0.0, 10.0]], &[6.0])?;
/// assert!(point.step(&[5.5]).new);
/// let change = point.step(&[4.5]); // nearer to 0, but still within the limits of 10
/// assert_eq!(change.node.expect("at one").as_slice(), [1]);
/// assert!(!change.new);
/// assert_eq!(point.step(&[-7.0]).node, None);
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct OperatingPoint {
    signals: Vec<Limits>,
    /// The break point of each signal at the last sample.
    last: [Option<usize>; MOST],
}

/// Break points of one signal with their limits.
#[derive(Clone, Debug, PartialEq)]
struct Limits {
    at: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl OperatingPoint {
    /// Break points of each of one to three signals, ascending, and the margin of each signal.
    pub fn new(break_points: &[Vec<f64>], margins: &[f64]) -> Result<Self> {
        let signals = break_points.len();
        if signals == 0 || signals > MOST {
            return Err(Error::argument("break_points", format!("of {signals} signals"), "of one to three"));
        }
        if margins.len() != signals {
            let needed = format!("one per signal, {signals}");
            return Err(Error::argument("margins", format!("{} numbers", margins.len()), &needed));
        }
        let limits = break_points.iter().zip(margins).map(|(at, &margin)| Limits::new(at, margin));
        Ok(OperatingPoint { signals: limits.collect::<Result<_>>()?, last: [None; MOST] })
    }

    /// Takes the signals of a sample; one that is missing or NaN has no break point. Allocates nothing.
    pub fn step(&mut self, signals: &[f64]) -> Change {
        let before = self.node();
        for (i, limits) in self.signals.iter().enumerate() {
            let x = signals.get(i).copied().unwrap_or(f64::NAN);
            self.last[i] = self.last[i].filter(|&k| limits.hold(k, x)).or_else(|| limits.nearest(x));
        }
        let node = self.node();
        Change { node, new: node.is_some() && node != before }
    }

    /// The operating point at the last sample.
    pub fn node(&self) -> Option<Node> {
        let signals = self.signals.len();
        let mut index = [0; MOST];
        for (index, last) in index.iter_mut().zip(&self.last[..signals]) {
            *index = (*last)?;
        }
        Some(Node { index, signals })
    }
}

impl Limits {
    fn new(at: &[f64], margin: f64) -> Result<Self> {
        let ascending = at.windows(2).all(|pair| pair[0] < pair[1]);
        if at.is_empty() || !ascending || at.iter().any(|x| !x.is_finite()) {
            let needed = "finite and ascending, without repeats";
            return Err(Error::argument("break_points", format!("{at:?}"), needed));
        }
        if !(margin > 0.0) {
            return Err(Error::argument("margins", margin, "positive, in units of the signal"));
        }
        let shifted = |by: f64| at.iter().map(|x| x + by).collect();
        Ok(Limits { at: at.to_vec(), low: shifted(-margin), high: shifted(margin) })
    }

    fn hold(&self, k: usize, x: f64) -> bool {
        self.low[k] <= x && x <= self.high[k]
    }

    fn nearest(&self, x: f64) -> Option<usize> {
        let off = |k: usize| (self.at[k] - x).abs();
        (0..self.at.len()).filter(|&k| self.hold(k, x)).min_by(|&i, &k| off(i).total_cmp(&off(k)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(point: &mut OperatingPoint, signal: &[f64]) -> Vec<(Option<usize>, bool)> {
        let one = |x: &f64| {
            let change = point.step(&[*x]);
            (change.node.map(|node| node.as_slice()[0]), change.new)
        };
        signal.iter().map(one).collect()
    }

    #[test]
    fn overlapping_limits_make_a_hysteresis() {
        let mut point = OperatingPoint::new(&[vec![0.0, 10.0, 20.0]], &[7.0]).expect("sound");
        let found = path(&mut point, &[0.0, 6.0, 7.0, 7.1, 4.0, 3.0, 2.9, 20.0]);
        let expected = [
            (Some(0), true),
            (Some(0), false),
            (Some(0), false),
            (Some(1), true),
            (Some(1), false),
            (Some(1), false),
            (Some(0), true),
            (Some(2), true),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn between_limits_there_is_none_and_coming_back_begins_anew() {
        let mut point = OperatingPoint::new(&[vec![0.0, 10.0]], &[2.0]).expect("sound");
        let found = path(&mut point, &[1.0, 5.0, 1.0, f64::NAN, 9.0]);
        let expected = [(Some(0), true), (None, false), (Some(0), true), (None, false), (Some(1), true)];
        assert_eq!(found, expected);
    }

    /// Where a signal stays with its own break point, another one moving does not send it to its nearest.
    #[test]
    fn each_signal_has_its_own_hysteresis() {
        let mut point = OperatingPoint::new(&[vec![0.0, 1.0], vec![0.0, 10.0]], &[0.4, 7.0]).expect("sound");
        assert!(point.step(&[0.0, 0.0]).new);
        let change = point.step(&[1.0, 6.0]);
        assert!(change.new);
        assert_eq!(change.node.expect("at one").as_slice(), [1, 0]);
        assert_eq!(point.step(&[1.0]).node, None);
    }

    #[test]
    fn what_is_no_operating_point_is_refused() {
        for (break_points, margins) in [
            (vec![], vec![]),
            (vec![vec![0.0]; 4], vec![1.0; 4]),
            (vec![vec![0.0]], vec![1.0, 1.0]),
            (vec![vec![1.0, 0.0]], vec![1.0]),
            (vec![vec![]], vec![1.0]),
            (vec![vec![0.0]], vec![0.0]),
            (vec![vec![f64::NAN]], vec![1.0]),
        ] {
            assert_eq!(OperatingPoint::new(&break_points, &margins).expect_err("refused").code(), "U01");
        }
    }
}
