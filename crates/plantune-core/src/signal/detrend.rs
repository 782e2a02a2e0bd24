//! Removing levels.

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
