//! A longer step: low-pass both ways, then fewer rows.
//!
//! Every signal passes the same Butterworth low-pass, order 8, cut-off 0.8 of the new Nyquist frequency,
//! forward and backward: no delay, so steps stay at their times and `rows` stay true. An output is then read
//! at the new rows. An input is the mean over the step that it acts for: read at the start of that step,
//! and held, it would act half a step late, less half an old one, and the dead time would come out shorter
//! by as much.

use std::f64::consts::PI;
use std::ops::Range;

use super::butter::{Band, butter};
use super::prefilter::{Marks, by_column, held, longest};
use super::sos::{Filter, Sos, rows_until};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::record::Record;

const ORDER: usize = 8;

/// Cut-off as a share of the new Nyquist frequency.
const CUTOFF: f64 = 0.8;

/// Longest new step, in old ones: the filter could not go lower.
const MOST_RATIO: f64 = 2e4;

/// A record's signals at a longer step, row-major.
#[derive(Clone, Debug)]
pub struct Decimated {
    /// Inputs.
    pub u: Vec<f64>,
    /// Outputs.
    pub y: Vec<f64>,
    /// Further signals.
    pub further: Vec<f64>,
    /// Which outputs count.
    pub valid: Vec<bool>,
    /// First row of each segment.
    pub starts: Vec<usize>,
    /// For each row the row of the record at or before it.
    pub rows: Vec<usize>,
    /// For each row the time after that row, in seconds.
    pub after: Vec<f64>,
    /// Segments too short for the filter.
    pub left_out: usize,
    /// What the filter remembers, on the record's own rows.
    pub marks: Marks,
}

/// Brings a record and `further (N, held.len())` signals to the step `Ts`; `held` ones act like inputs.
///
/// A segment in which no row is free of an unknown past and future is left out.
pub fn decimate(
    rec: &Record,
    further: &[f64],
    held_further: &[bool],
    Ts: f64,
    limits: &Limits,
) -> Result<Decimated> {
    let ratio = Ts / rec.Ts;
    if !(1.0..=MOST_RATIO).contains(&ratio) {
        let needed = format!("from {} to {} seconds", rec.Ts, MOST_RATIO * rec.Ts);
        return Err(Error::argument("Ts", Ts, &needed));
    }
    let sos = butter(ORDER, Band::Low(CUTOFF * PI / Ts), rec.Ts)?;
    let all: Vec<_> = rec.segments().collect();
    let memory = both_ways(&sos, longest(&all));
    let needed = (2 * rows_until(&memory, limits.F02)).max(ratio.ceil() as usize);
    let segments: Vec<_> = all.iter().filter(|s| s.len() > needed).cloned().collect();
    if segments.is_empty() {
        return Err(too_short(all.len(), longest(&all), needed, Ts));
    }
    let marks = Marks::new(rec, &segments, &memory, true, limits)?;
    let smooth = |x: &[f64], width| by_column(x, width, &segments, |x| zero_phase(&sos, x));
    let (u, y) = (smooth(rec.u, rec.nu)?, smooth(&held(rec, &all), rec.ny)?);
    let further = smooth(further, held_further.len())?;

    let (mut new, mut starts): (Vec<Step>, Vec<usize>) = (Vec::new(), Vec::new());
    for segment in &segments {
        starts.push(new.len());
        new.extend(steps(segment, ratio));
    }
    let width = held_further.len();
    let further = |step: &Step, i: usize| {
        if held_further[i] { step.mean(&further, width, i) } else { step.read(&further, width, i) }
    };
    Ok(Decimated {
        u: each(&new, rec.nu, |step, i| step.mean(&u, rec.nu, i)),
        y: each(&new, rec.ny, |step, i| step.read(&y, rec.ny, i)),
        further: each(&new, width, further),
        valid: each(&new, rec.ny, |step, i| step.counts(&marks.valid, rec.ny, i)),
        starts,
        rows: new.iter().map(|step| step.row).collect(),
        after: new.iter().map(|step| step.share * rec.Ts).collect(),
        left_out: all.len() - segments.len(),
        marks,
    })
}

/// A value of each column at each step, row-major.
fn each<T>(steps: &[Step], width: usize, value: impl Fn(&Step, usize) -> T) -> Vec<T> {
    steps.iter().flat_map(|step| (0..width).map(|i| value(step, i)).collect::<Vec<T>>()).collect()
}

/// Bound of what the filter remembers when it runs both ways: the way back spreads what the way forth left.
fn both_ways(sos: &Sos, n: usize) -> Vec<f64> {
    let spread = sos.largest_output();
    sos.memory(n).iter().map(|m| m * spread).collect()
}

/// Forward and backward, each way from equilibrium.
fn zero_phase(sos: &Sos, x: &mut [f64]) -> Result<()> {
    Filter::new(sos).run(x)?;
    x.reverse();
    Filter::new(sos).run(x)?;
    x.reverse();
    Ok(())
}

fn too_short(segments: usize, longest: usize, needed: usize, Ts: f64) -> Error {
    Error::new(
        "D04",
        format!("none of {segments} segments is long enough for the filter to a step of {Ts} s"),
    )
    .count(segments)
    .measured(longest as f64, needed as f64 + 1.0)
    .remedy("choose a shorter step or give a longer contiguous part")
}

/// One new step: it begins `share` of an old step after `row`, and lasts `ratio` old steps.
struct Step {
    row: usize,
    share: f64,
    ratio: f64,
}

/// Positions closer than this to a row, in old steps, are that row: a ratio is whole but for rounding.
const ON_A_ROW: f64 = 1e-7;

/// The whole new steps that a segment holds.
fn steps(segment: &Range<usize>, ratio: f64) -> impl Iterator<Item = Step> {
    let (start, n) = (segment.start, ((segment.len() as f64 + ON_A_ROW) / ratio) as usize);
    (0..n).map(move |j| {
        let at = j as f64 * ratio;
        let at = if (at - at.round()).abs() < ON_A_ROW { at.round() } else { at };
        Step { row: start + at as usize, share: at.fract(), ratio }
    })
}

impl Step {
    /// The value at the beginning, between two rows interpolated.
    fn read(&self, x: &[f64], width: usize, i: usize) -> f64 {
        let here = x[self.row * width + i];
        if self.share == 0.0 { here } else { here + self.share * (x[(self.row + 1) * width + i] - here) }
    }

    fn counts(&self, valid: &[bool], width: usize, i: usize) -> bool {
        valid[self.row * width + i] && (self.share == 0.0 || valid[(self.row + 1) * width + i])
    }

    /// The mean over the step of a signal that is held from row to row.
    fn mean(&self, x: &[f64], width: usize, i: usize) -> f64 {
        let end = self.share + self.ratio;
        let rows = (end - 2.0 * ON_A_ROW).ceil() as usize;
        let (sum, weights) = (0..rows).fold((0.0, 0.0), |(sum, weights), k| {
            let weight = (k as f64 + 1.0).min(end) - (k as f64).max(self.share);
            (sum + weight * x[(self.row + k) * width + i], weights + weight)
        });
        sum / weights
    }
}
