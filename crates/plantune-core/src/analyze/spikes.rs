//! Single samples of an output far off both neighbours (D19).
//!
//! ```text
//! sd = 1.4826 median |y(k) - (y(k-1) + y(k+1)) / 2|, at least the least step between two values
//! steep: min(|y(k) - y(k-1)|, |y(k) - y(k+1)|) > D19 sd, both differences of one sign
//! size = |y(k) - the line through the nearest rows on both sides that are not steep| / sd
//! ```
//!
//! A steep row is a spike where its size passes D19 as well, and the rows around it lie on a smooth curve
//! without it: the slopes between the two on its left, across it, and between the two on its right differ
//! by less than a third of it. So a step of the plant is none, nor a peak, nor the kick with which some
//! plants answer a step. What the input does from row to row is part of `sd`. Robust scale: Hampel 1974.

use std::ops::Range;

use crate::limits::Limits;
use crate::note::Note;
use crate::record::Record;
use crate::stats::median;

/// How much larger than the roughness of its surroundings a spike is.
const ISOLATED: f64 = 3.0;

/// Rows on each side among which the surroundings are sought, spikes left out.
const REACH: usize = 6;

/// Row numbers named in a note.
const NAMED: usize = 10;

/// One sample off both neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spike {
    /// Which output.
    pub output: usize,
    /// Row of the record.
    pub row: usize,
    /// How far off, in robust standard deviations.
    pub size: f64,
}

/// The spikes of every output, in the rows that count.
pub fn spikes(rec: &Record, limits: &Limits) -> Vec<Spike> {
    (0..rec.ny).flat_map(|output| of_output(rec, output, limits)).collect()
}

fn of_output(rec: &Record, output: usize, limits: &Limits) -> Vec<Spike> {
    let y = rec.output(output);
    let runs = rec.runs(0, 0, output);
    let sd = roughness(&y, &runs);
    let mut found = Vec::new();
    for run in runs {
        let steep: Vec<usize> = inner(&run).filter(|&k| out_and_back(&y, k) / sd > limits.D19).collect();
        found.extend(steep.iter().filter_map(|&row| {
            let (off, kink) = surroundings(&y, &run, &steep, row)?;
            let size = off / sd;
            (size > limits.D19 && off > ISOLATED * kink).then_some(Spike { output, row, size })
        }));
    }
    found
}

/// Rows with a neighbour on each side.
fn inner(run: &Range<usize>) -> Range<usize> {
    run.start + 1..run.end.saturating_sub(1)
}

/// Robust standard deviation of the second difference; infinite for an output of one value.
fn roughness(y: &[f64], runs: &[Range<usize>]) -> f64 {
    let bend = |k: usize| (y[k] - 0.5 * (y[k - 1] + y[k + 1])).abs();
    let bends: Vec<f64> = runs.iter().flat_map(|run| inner(run).map(bend)).collect();
    let steps = runs.iter().flat_map(|run| y[run.clone()].windows(2)).map(|w| (w[1] - w[0]).abs());
    let quantum = steps.filter(|&d| d > 0.0).fold(f64::INFINITY, f64::min);
    quantum.max(1.4826 * median(bends))
}

/// How far row `k` lies beyond the nearer of its neighbours, if it lies beyond both.
fn out_and_back(y: &[f64], k: usize) -> f64 {
    let (rise, fall) = (y[k] - y[k - 1], y[k] - y[k + 1]);
    if (rise > 0.0) == (fall > 0.0) { rise.abs().min(fall.abs()) } else { 0.0 }
}

/// How far row `k` lies off the calm rows around it, and the largest change of slope of these; none where
/// too few of them are left to tell.
fn surroundings(y: &[f64], run: &Range<usize>, steep: &[usize], k: usize) -> Option<(f64, f64)> {
    let calm = |j: &usize| steep.binary_search(j).is_err();
    let before: Vec<usize> = (run.start.max(k.saturating_sub(REACH))..k).rev().filter(calm).take(2).collect();
    let after: Vec<usize> = (k + 1..run.end.min(k + 1 + REACH)).filter(calm).take(2).collect();
    let slope = |i: usize, j: usize| (y[j] - y[i]) / (j as f64 - i as f64);
    let (&left, &right) = (before.first()?, after.first()?);
    let across = slope(left, right);
    let off = (y[k] - y[left] - across * (k - left) as f64).abs();
    let sides = [&before, &after].into_iter().filter(|side| side.len() == 2);
    let kink = sides.map(|side| (slope(side[0], side[1]) - across).abs()).reduce(f64::max)?;
    Some((off, kink))
}

/// D19 of each output that has spikes.
pub fn spikes_notes(rec: &Record, spikes: &[Spike], limits: &Limits) -> Vec<Note> {
    (0..rec.ny).filter_map(|output| note(rec, output, spikes, limits)).collect()
}

/// How many, at which rows, how large.
fn note(rec: &Record, output: usize, spikes: &[Spike], limits: &Limits) -> Option<Note> {
    let own: Vec<&Spike> = spikes.iter().filter(|s| s.output == output).collect();
    let first = own.first()?;
    let place = |s: &Spike| rec.place(rec.nu + output, s.row);
    let named = own.iter().take(NAMED).filter_map(|s| place(s).row).map(|row| row.to_string());
    let more = if own.len() > NAMED { ", …" } else { "" };
    let most = own.iter().map(|s| s.size).fold(0.0, f64::max);
    let text = format!(
        "`{}` has {} single-sample spike{} of up to {most:.0} sd at row {}{more}",
        place(first).column,
        own.len(),
        if own.len() == 1 { "" } else { "s" },
        named.collect::<Vec<String>>().join(", ")
    );
    let note = Note::warning("D19", text).at(place(first)).count(own.len());
    Some(note.measured(most, limits.D19).remedy("leave these values out: prep.despike(rec)"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn rows(y: &[f64]) -> Vec<usize> {
        let u = vec![0.0; y.len()];
        let rec = Record::uniform(&u, 1, y, 1, 1.0).expect("fine");
        spikes(&rec, &Limits::default()).iter().map(|s| s.row).collect()
    }

    #[test]
    fn spikes_are_found_next_to_each_other_and_at_the_ends() {
        let mut y = white(400, 3);
        for k in [1, 100, 102, 398] {
            y[k] += 60.0;
        }
        y[200] -= 60.0;
        assert_eq!(rows(&y), [1, 100, 102, 200, 398]);
    }

    #[test]
    fn steps_peaks_and_kicks_are_none() {
        let noise = white(400, 4);
        let at = |k: usize, wave: fn(f64) -> f64| 0.01 * noise[k] + wave(k as f64 - 200.0);
        let step = |t: f64| if t < 0.0 { 0.0 } else { 5.0 };
        let peak = |t: f64| 5.0 * (-t * t / 4.0).exp();
        let kick = |t: f64| if t < 0.0 { 0.0 } else { 5.0 * (1.0 - 1.6 * (-t / 2.0).exp()) };
        for wave in [step as fn(f64) -> f64, peak, kick] {
            let y: Vec<f64> = (0..400).map(|k| at(k, wave)).collect();
            assert_eq!(rows(&y), []);
        }
    }

    #[test]
    fn one_count_of_a_coarse_converter_is_none() {
        let y: Vec<f64> = (0..400).map(|k| if k % 37 == 0 { 0.2 } else { 0.0 }).collect();
        assert_eq!(rows(&y), []);
        assert_eq!(rows(&[1.0; 60]), []);
    }

    #[test]
    fn values_that_do_not_count_are_not_looked_at() {
        let (u, mut y) = (vec![0.0; 400], white(400, 5));
        (y[100], y[250]) = (60.0, 60.0);
        let mut rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let valid: Vec<bool> = (0..400).map(|k| k != 100).collect();
        rec.valid = Some(&valid);
        let found = spikes(&rec, &Limits::default());
        assert_eq!(found.iter().map(|s| s.row).collect::<Vec<_>>(), [250]);
    }
}
