//! A periodic record cut into cycles, and how well they repeat: the measure of any model of the loop.
//!
//! ```text
//! turning point   an extreme of x from which x has come back by more than the band
//! whole cycle     from one lowest turning point to the next, both before the record's ends
//! at a level      d = y of one cycle - y of another, rising and falling apart
//! repeatability   largest |d|, and rms of d over levels and pairs: rms^2 = mean of 2 s^2, s^2 the variance over cycles
//! ```
//!
//! Source 002, 2.4 and figure 2.10: no two loops of its stage are the same, and 4.5 judges its model by that.

use crate::error::{Error, Result};

/// Band as a share of the input's range.
const BAND: f64 = 0.05;

/// Levels of the common grid.
const LEVELS: usize = 200;

/// Where the input turns, and the whole cycles between.
#[derive(Clone, Debug, PartialEq)]
pub struct Cycles {
    /// Rows of the turning points.
    pub turns: Vec<usize>,
    /// Rows of lowest, highest and next lowest point of each whole cycle.
    pub whole: Vec<[usize; 3]>,
    /// Rows before the first whole cycle; all, if there is none.
    pub before: usize,
    /// First row behind the last whole cycle.
    pub behind: usize,
    /// How far the input must come back to have turned.
    pub band: f64,
}

/// Cycles of an input; `band` is 5 % of its range unless given.
///
/// The ends of the record are turning points where the input is at its lowest or highest, to 5 % of its range.
pub fn cycles(x: &[f64], band: Option<f64>) -> Result<Cycles> {
    if let Some(k) = x.iter().position(|x| !x.is_finite()) {
        return Err(Error::argument("x", format!("{} in row {k}", x[k]), "finite"));
    }
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let range = (high - low).max(0.0);
    let band = band.unwrap_or(BAND * range);
    if !(band >= 0.0 && band.is_finite()) {
        return Err(Error::argument("band", band, "0 or positive, and finite"));
    }
    if range <= band {
        return Err(Error::new("X01", "the input does not move by more than the band")
            .measured(range, band)
            .remedy("record cycles of the input, or take a smaller band"));
    }
    let near = band.max(BAND * range);
    let turns = complete(x, turning_points(x, band), (low, high), near);
    let whole: Vec<[usize; 3]> = turns
        .windows(3)
        .filter(|t| x[t[1]] > x[t[0]] && x[t[1]] > x[t[2]])
        .map(|t| [t[0], t[1], t[2]])
        .collect();
    let before = whole.first().map_or(x.len(), |c| c[0]);
    let behind = whole.last().map_or(x.len(), |c| c[2] + 1);
    Ok(Cycles { turns, whole, before, behind, band })
}

/// Extremes in turn, both ends of the record among them.
pub(super) fn turning_points(x: &[f64], band: f64) -> Vec<usize> {
    let (mut points, mut way, mut best) = (vec![0], 0.0, 0);
    for t in 0..x.len() {
        if way == 0.0 {
            if (x[t] - x[0]).abs() > band {
                (way, best) = ((x[t] - x[0]).signum(), t);
            }
        } else if (x[t] - x[best]) * way >= 0.0 {
            best = t;
        } else if (x[best] - x[t]) * way > band {
            points.push(best);
            (way, best) = (-way, t);
        }
    }
    points.push(best);
    points
}

/// Without the ends, where they are no turning points.
fn complete(x: &[f64], mut points: Vec<usize>, (low, high): (f64, f64), near: f64) -> Vec<usize> {
    let arrived = |end: usize, other: usize| {
        if x[end] < x[other] { x[end] <= low + near } else { x[end] >= high - near }
    };
    let n = points.len();
    let (first, last) = (arrived(points[0], points[1]), arrived(points[n - 1], points[n - 2]));
    if !last {
        points.pop();
    }
    if !first {
        points.remove(0);
    }
    points
}

/// How well the cycles of a loop repeat.
#[derive(Clone, Debug)]
pub struct Repeatability {
    /// Levels of the input, which every cycle passes.
    pub x: Vec<f64>,
    /// Outputs of each cycle on its way up, `(cycles, levels)`.
    pub up: Vec<f64>,
    /// And on its way down.
    pub down: Vec<f64>,
    /// Cycles compared.
    pub cycles: usize,
    /// Largest difference of two cycles, and rms of all: rising, falling, both.
    pub spread: [(f64, f64); 3],
}

/// Differences between the whole cycles of a record, over the levels of the input that all of them pass.
pub fn repeatability(x: &[f64], y: &[f64], band: Option<f64>) -> Result<Repeatability> {
    if x.len() != y.len() {
        let text = format!("x has {} samples, y has {}", x.len(), y.len());
        return Err(Error::new("D09", text).remedy("give one y per x"));
    }
    let whole = cycles(x, band)?.whole;
    if whole.len() < 2 {
        return Err(Error::new("X03", format!("{} whole cycles, two are needed to compare", whole.len()))
            .count(whole.len())
            .measured(whole.len() as f64, 2.0)
            .remedy("record at least two cycles, from the lowest input to the lowest"));
    }
    let low = whole.iter().map(|c| x[c[0]].max(x[c[2]])).fold(f64::NEG_INFINITY, f64::max);
    let high = whole.iter().map(|c| x[c[1]]).fold(f64::INFINITY, f64::min);
    let grid: Vec<f64> = (0..LEVELS).map(|i| low + (high - low) * i as f64 / (LEVELS - 1) as f64).collect();
    let up: Vec<f64> =
        whole.iter().flat_map(|c| over_levels((c[0]..=c[1]).map(|t| (x[t], y[t])), &grid)).collect();
    let down: Vec<f64> =
        whole.iter().flat_map(|c| over_levels((c[1]..=c[2]).rev().map(|t| (x[t], y[t])), &grid)).collect();
    let (rising, falling) = (spread(&up, LEVELS), spread(&down, LEVELS));
    let both = (rising.0.max(falling.0), ((rising.1.powi(2) + falling.1.powi(2)) / 2.0).sqrt());
    Ok(Repeatability { x: grid, up, down, cycles: whole.len(), spread: [rising, falling, both] })
}

/// A branch, given from its lowest input on, on ascending levels; its input made monotone first.
fn over_levels(branch: impl Iterator<Item = (f64, f64)>, levels: &[f64]) -> Vec<f64> {
    let mut samples = branch.peekable();
    let mut before = samples.next().unwrap_or((0.0, 0.0));
    let mut out = Vec::with_capacity(levels.len());
    for &level in levels {
        while let Some(next) = samples.next_if(|next| next.0 <= level) {
            before = (before.0.max(next.0), next.1);
        }
        out.push(match samples.peek() {
            Some(next) if level > before.0 => {
                before.1 + (next.1 - before.1) * (level - before.0) / (next.0 - before.0)
            }
            _ => before.1,
        });
    }
    out
}

/// Largest and rms difference of any two rows of `(cycles, levels)`.
fn spread(branches: &[f64], levels: usize) -> (f64, f64) {
    let n = branches.len() / levels;
    let (mut largest, mut sum) = (0.0_f64, 0.0);
    for level in 0..levels {
        let there = || branches.iter().skip(level).step_by(levels);
        let mean = there().sum::<f64>() / n as f64;
        let (low, high) =
            there().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(*y), h.max(*y)));
        largest = largest.max(high - low);
        sum += 2.0 * there().map(|y| (y - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
    }
    (largest, (sum / levels as f64).sqrt())
}
