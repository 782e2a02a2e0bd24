//! Where a plant is steady, and where it moves.
//!
//! A row is steady if every input, and the reference, has stayed within a tolerance since
//! `T_id = 5 T_max + L_max` before it: what moved earlier has settled and arrived. Stretches shorter than
//! `T_id` are too short to identify from, and too short for a noise analysis. Source 001, (3.5-1), (3.5-2).

use std::collections::VecDeque;
use std::ops::Range;

use crate::error::{Error, Result};
use crate::linalg::extent;
use crate::record::Record;

/// Stretches of a record.
#[derive(Clone, Debug)]
pub struct Stretches {
    /// The rows of each.
    pub kept: Vec<Range<usize>>,
    /// How many were too short.
    pub dropped: usize,
    /// Rows in these.
    pub dropped_rows: usize,
    /// Rows that a stretch needs: source 001, (3.5-2).
    pub needed: usize,
}

/// The stretches that are steady, or those that are not.
///
/// `tolerance` is a share of each signal's travel in the whole record, `r` the reference `(N, ny)`.
pub fn stretches(
    rec: &Record,
    r: Option<&[f64]>,
    T_max: f64,
    L_max: f64,
    tolerance: f64,
    steady: bool,
) -> Result<Stretches> {
    let needed = rows_needed(rec, T_max, L_max, tolerance)?;
    let mut is_steady = vec![true; rec.N()];
    let inputs = (0..rec.nu).map(|i| (rec.u, rec.nu, i));
    let references = (0..rec.ny).filter_map(|i| r.map(|r| (r, rec.ny, i)));
    for (x, width, i) in inputs.chain(references) {
        let column: Vec<f64> = x.iter().skip(i).step_by(width).copied().collect();
        let (low, high) = extent(&column);
        for segment in rec.segments() {
            rest(&column, segment, needed, tolerance * (high - low), &mut is_steady);
        }
    }
    let found: Vec<Range<usize>> = rec.segments().flat_map(|s| runs(&is_steady, s, steady)).collect();
    let (kept, short): (Vec<_>, Vec<_>) = found.into_iter().partition(|run| run.len() >= needed);
    if kept.is_empty() {
        let longest = short.iter().map(Range::len).max().unwrap_or(0);
        return Err(nothing_left(rec, steady, longest, needed));
    }
    let dropped_rows = short.iter().map(Range::len).sum();
    Ok(Stretches { kept, dropped: short.len(), dropped_rows, needed })
}

/// `(5 T_max + L_max) / Ts`, rounded up.
fn rows_needed(rec: &Record, T_max: f64, L_max: f64, tolerance: f64) -> Result<usize> {
    if !(T_max > 0.0 && T_max.is_finite()) {
        return Err(Error::argument("T_max", T_max, "a positive number of seconds"));
    }
    if !(L_max >= 0.0 && L_max.is_finite()) {
        return Err(Error::argument("L_max", L_max, "zero or a positive number of seconds"));
    }
    if !(0.0..1.0).contains(&tolerance) {
        return Err(Error::argument("tolerance", tolerance, "at least 0 and below 1"));
    }
    Ok(((5.0 * T_max + L_max) / rec.Ts * (1.0 - 1e-12)).ceil() as usize)
}

/// Clears the rows of a segment at which `x` has moved by more than `most` within the `needed` rows before,
/// and those that have no such past.
fn rest(x: &[f64], segment: Range<usize>, needed: usize, most: f64, is_steady: &mut [bool]) {
    // Rows that may yet be the least or the greatest of the window, the present extreme in front.
    let (mut least, mut greatest) = (VecDeque::new(), VecDeque::new());
    for k in segment.clone() {
        while least.back().is_some_and(|&j: &usize| x[j] >= x[k]) {
            least.pop_back();
        }
        while greatest.back().is_some_and(|&j: &usize| x[j] <= x[k]) {
            greatest.pop_back();
        }
        least.push_back(k);
        greatest.push_back(k);
        for window in [&mut least, &mut greatest] {
            while window.front().is_some_and(|&j| j + needed < k) {
                window.pop_front();
            }
        }
        let travel = greatest.front().map_or(0.0, |&j| x[j]) - least.front().map_or(0.0, |&j| x[j]);
        if k - segment.start < needed || travel > most {
            is_steady[k] = false;
        }
    }
}

/// Runs of rows of a segment at which `is` has this value.
fn runs(is: &[bool], segment: Range<usize>, value: bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for k in segment.filter(|&k| is[k] == value) {
        match runs.last_mut() {
            Some(run) if run.end == k => run.end = k + 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

fn nothing_left(rec: &Record, steady: bool, longest: usize, needed: usize) -> Error {
    let kind = if steady { "steady" } else { "moving" };
    let text = format!(
        "no {kind} stretch has {needed} rows ({:.6} s): the longest has {longest} ({:.6} s)",
        needed as f64 * rec.Ts,
        longest as f64 * rec.Ts
    );
    Error::new("D04", text).count(longest).measured(longest as f64, needed as f64).remedy(if steady {
        "record longer at rest, or allow a larger `tolerance` where the controller passes on noise"
    } else {
        "record longer while the set point or the input moves"
    })
}
