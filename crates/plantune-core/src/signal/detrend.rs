//! Removing levels and lines.

use crate::linalg::{extent, sum};
use crate::record::Record;

/// Mean of each column of the row-major `x (N, width)`, over the rows that count.
pub fn means(x: &[f64], width: usize, counts: impl Fn(usize, usize) -> bool) -> Vec<f64> {
    (0..width)
        .map(|i| {
            let column = x.iter().skip(i).step_by(width).enumerate().filter(|(k, _)| counts(*k, i));
            let (sum, n) = column.fold((0.0, 0usize), |(sum, n), (_, v)| (sum + v, n + 1));
            sum / n as f64
        })
        .collect()
}

/// `x` without the given level of each column.
pub fn without_levels(x: &[f64], levels: &[f64]) -> Vec<f64> {
    x.chunks_exact(levels.len()).flat_map(|row| row.iter().zip(levels).map(|(v, l)| v - l)).collect()
}

/// A straight line, `level + slope (t - middle)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Value at `middle`: the mean over the rows that count.
    pub level: f64,
    /// Change per second.
    pub slope: f64,
    /// Mean time of the rows that count, s.
    pub middle: f64,
}

/// The line of least squares through each column of `x (N, width)` over the times `t`, rows that count.
pub fn lines(x: &[f64], width: usize, t: &[f64], counts: impl Fn(usize, usize) -> bool) -> Vec<Line> {
    let levels = means(x, width, &counts);
    let line = |(i, &level): (usize, &f64)| {
        let rows = || (0..t.len()).filter(|&k| counts(k, i));
        let middle = rows().map(|k| t[k]).sum::<f64>() / rows().count() as f64;
        let (xt, tt) = rows().fold((0.0, 0.0), |(xt, tt), k| {
            let s = t[k] - middle;
            (xt + s * (x[k * width + i] - level), tt + s * s)
        });
        Line { level, slope: if tt > 0.0 { xt / tt } else { 0.0 }, middle }
    };
    levels.iter().enumerate().map(line).collect()
}

/// `x` without the given line of each column.
pub fn without_lines(x: &[f64], t: &[f64], lines: &[Line]) -> Vec<f64> {
    let rows = x.chunks_exact(lines.len()).zip(t);
    rows.flat_map(|(row, t)| row.iter().zip(lines).map(move |(v, l)| v - l.level - l.slope * (t - l.middle)))
        .collect()
}

/// A signal without its steps: `x(k) - sum of the sizes of those at or before row k`.
pub fn without_steps(x: &[f64], at: &[usize], sizes: &[f64]) -> Vec<f64> {
    let level =
        |k: usize| -> f64 { at.iter().zip(sizes).filter(|(row, _)| **row <= k).map(|(_, h)| h).sum() };
    x.iter().enumerate().map(|(k, x)| x - level(k)).collect()
}

/// Mean of a column, as a share of its travel, up to which its level counts as removed.
const LEVEL: f64 = 1e-9;

/// Whether no input and no output has a level left: the record's own means were removed from it.
pub fn has_no_level(rec: &Record) -> bool {
    let gone = |x: &[f64]| {
        let (low, high) = extent(x);
        (sum(x) / x.len() as f64).abs() <= LEVEL * (high - low)
    };
    (0..rec.nu).all(|i| gone(&rec.input(i))) && (0..rec.ny).all(|i| gone(&rec.output(i)))
}
