//! Smoothing over three rows: `(x(t-1) + 2 x(t) + x(t+1)) / 4`.
//!
//! Gain `cos^2(w Ts / 2)`, no phase; white noise keeps 0.375 of its variance. Source 000, (2.3-2).

use std::ops::Range;

use crate::error::{Error, Result};
use crate::record::Record;

/// A record's signals at the rows that have a row before and after them, row-major.
#[derive(Clone, Debug)]
pub struct Smoothed {
    /// Inputs.
    pub u: Vec<f64>,
    /// Outputs.
    pub y: Vec<f64>,
    /// Reference, if there is one.
    pub r: Option<Vec<f64>>,
    /// Outputs that count, as their neighbours do.
    pub valid: Vec<bool>,
    /// Rows of the record, one range per segment left.
    pub rows: Vec<Range<usize>>,
}

/// Smooths the outputs, and with `both` the inputs and the reference `r (N, ny)`.
pub fn smooth(rec: &Record, r: Option<&[f64]>, both: bool) -> Result<Smoothed> {
    let inner = |s: Range<usize>| (s.len() > 2).then(|| s.start + 1..s.end - 1);
    let rows: Vec<_> = rec.segments().filter_map(inner).collect();
    if rows.is_empty() {
        let longest = rec.segments().map(|s| s.len()).max().unwrap_or(0);
        return Err(Error::new("D04", "no segment has a row with one before and one after it")
            .count(rec.starts.len())
            .measured(longest as f64, 3.0)
            .remedy("give a record with a contiguous part of three rows or more"));
    }
    let other = if both { three } else { one };
    Ok(Smoothed {
        u: over(rec.u, rec.nu, &rows, other),
        y: over(rec.y, rec.ny, &rows, three),
        r: r.map(|r| over(r, rec.ny, &rows, other)),
        valid: valid(rec, &rows),
        rows,
    })
}

fn over(x: &[f64], width: usize, rows: &[Range<usize>], at: fn(&[f64], usize, usize) -> f64) -> Vec<f64> {
    rows.iter().flat_map(|r| (r.start * width..r.end * width).map(|i| at(x, width, i))).collect()
}

fn three(x: &[f64], width: usize, i: usize) -> f64 {
    x[i] / 2.0 + (x[i - width] + x[i + width]) / 4.0
}

fn one(x: &[f64], _: usize, i: usize) -> f64 {
    x[i]
}

fn valid(rec: &Record, rows: &[Range<usize>]) -> Vec<bool> {
    let counts = |k: usize, i: usize| (k - 1..=k + 1).all(|j| rec.is_valid(j, i));
    rows.iter()
        .cloned()
        .flatten()
        .flat_map(|k| (0..rec.ny).map(move |i| (k, i)))
        .map(|(k, i)| counts(k, i))
        .collect()
}
