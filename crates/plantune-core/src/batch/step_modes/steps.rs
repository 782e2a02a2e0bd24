//! Where a record steps, where it was at rest before, and from which row on the response counts.
//!
//! A step is a move of the input between two stretches over which it is held. A response counts from its
//! *onset*, the first of three rows together outside the band in which y was at rest,
//!
//! ```text
//! y_0 ± max(4 sd, 1.5 steps of resolution),
//! ```
//!
//! all on one side: by then the delay is over, and since the initial state is free it needs no parameter. Noise makes
//! the onset late; where the delay that was found allows it, an earlier row is tried.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::extent;
use crate::note::{Note, Place, rounded};
use crate::record::Record;

/// Share of the input's travel that counts as a move, and that it may stray while it is held.
const MOVE: f64 = 0.1;

/// Most steps of a record of step responses.
const MOST_STEPS: usize = 12;

/// Most rows of a response that are looked at one by one.
const MOST_ROWS: usize = 10_000;

/// Rows together outside of the band.
const RUN: usize = 3;

/// Fewest rows at rest that tell a band.
const LEAST_REST: usize = 3;

/// Share of the output's travel that it may drift before a step and still be at rest.
const DRIFT: f64 = 0.05;

/// Fewest rows of a response.
const LEAST_ROWS: usize = 8;

/// Rows after a change of the input, or from the start of a segment.
#[derive(Clone, Debug)]
pub(super) struct Response {
    /// Rows that count.
    pub(super) rows: Range<usize>,
    /// Level of the input there.
    pub(super) u: f64,
}

/// The responses of a record.
#[derive(Debug)]
pub(super) struct Steps {
    pub(super) responses: Vec<Response>,
    /// First row with the new input, of the first response; None for a record that starts on its step.
    pub(super) row: Option<usize>,
    /// What is known of the level before it.
    pub(super) rest: Option<Rest>,
    /// Rows left out after each step.
    skip: usize,
}

/// y before a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    /// Mean.
    pub(super) y: f64,
    /// Its standard deviation, correlation included.
    pub(super) sd: f64,
    /// Half width of the band.
    band: f64,
    /// Move of the input at the step.
    pub(super) du: f64,
}

impl Steps {
    /// The responses, from the first row that has clearly left its rest on.
    pub(super) fn of(rec: &Record, y: &[f64], step_at: Option<f64>, limits: &Limits) -> Result<Self> {
        let mut steps = match step_at {
            Some(time) => Steps::one_at(rec, time)?,
            None => Steps::all(rec, y, limits)?,
        };
        steps.find_rest(rec, y);
        if let (Some(rest), Some(row)) = (&steps.rest, steps.row) {
            let end = steps.responses[0].rows.end;
            let onset = onset(y, row, end, rest).ok_or_else(|| stays(rec, row, rest))?;
            steps.skip = onset - row;
        }
        let skip = steps.skip;
        steps.responses.iter_mut().for_each(|r| r.rows.start = (r.rows.start + skip).min(r.rows.end));
        let long = steps.responses.iter().map(|r| r.rows.len()).max().unwrap_or(0);
        steps.responses.retain(|r| r.rows.len() >= LEAST_ROWS);
        if steps.responses.is_empty() {
            return Err(Error::new("X03", format!("{long} rows of response"))
                .count(long)
                .measured(long as f64, LEAST_ROWS as f64)
                .remedy("record longer after the step, or sample faster"));
        }
        Ok(steps)
    }

    /// The one step that the caller names.
    fn one_at(rec: &Record, time: f64) -> Result<Self> {
        let row = (0..rec.N()).find(|&k| rec.time(k) >= time - 1e-9 * rec.Ts).unwrap_or(rec.N());
        let inside = time >= rec.time(0) - rec.Ts && row < rec.N();
        let Some(segment) = rec.segments().find(|s| inside && s.contains(&row)) else {
            let needed = format!("a time from {} to {} s", rec.time(0), rec.time(rec.N() - 1));
            return Err(Error::argument("step_at", time, &needed));
        };
        let u = rec.input(0);
        let (low, high) = extent(&u);
        let held = |k: &usize| (u[*k] - u[*k - 1]).abs() <= MOVE * (high - low);
        let moved = (row + 1..segment.end).find(|k| !held(k)).unwrap_or(segment.end);
        // An input that never stands still is taken at the caller's word.
        let end = if moved - row >= LEAST_ROWS { moved } else { segment.end };
        let level = u[row..end].iter().sum::<f64>() / (end - row) as f64;
        Ok(Steps {
            responses: vec![Response { rows: row..end, u: level }],
            row: Some(row),
            rest: None,
            skip: 0,
        })
    }

    /// Every stretch over which the input is held, the one before the first step left out where y rests.
    fn all(rec: &Record, y: &[f64], limits: &Limits) -> Result<Self> {
        let u = rec.input(0);
        let (low, high) = extent(&u);
        let travel = high - low;
        if travel <= limits.X01 * low.abs().max(high.abs()) {
            let responses = rec.segments().map(|rows| Response { rows, u: u[0] }).collect();
            return Ok(Steps { responses, row: None, rest: None, skip: 0 });
        }
        let (mut responses, mut row, mut count) = (Vec::new(), None, 0);
        for segment in rec.segments() {
            let moved = |k: &usize| (u[*k] - u[*k - 1]).abs() > MOVE * travel;
            let bounds: Vec<usize> = (segment.start + 1..segment.end).filter(moved).collect();
            count += bounds.len();
            let starts = std::iter::once(segment.start).chain(bounds.iter().copied());
            for (i, start) in starts.enumerate() {
                let rows = start..bounds.get(i).copied().unwrap_or(segment.end);
                let (low, high) = extent(&u[rows.clone()]);
                if rows.len() >= LEAST_ROWS && high - low > MOVE * travel {
                    return Err(no_step(rec, &u));
                }
                let resting = i == 0 && !bounds.is_empty() && at_rest(y, &segment, rows.end);
                if i == 1 && row.is_none() && responses.is_empty() {
                    row = Some(start);
                }
                if !resting && (i > 0 || rows.len() >= LEAST_ROWS) {
                    let level = u[rows.clone()].iter().sum::<f64>() / rows.len() as f64;
                    responses.push(Response { rows, u: level });
                }
            }
        }
        if count == 0 || count > MOST_STEPS {
            return Err(no_step(rec, &u));
        }
        Ok(Steps { responses, row, rest: None, skip: 0 })
    }

    /// What y was before the first step, if it rested there.
    fn find_rest(&mut self, rec: &Record, y: &[f64]) {
        let Some(row) = self.row else { return };
        let Some(segment) = rec.segments().find(|s| s.contains(&row)) else { return };
        let u = rec.input(0);
        let (low, high) = extent(&u);
        let first = (segment.start..row)
            .rev()
            .find(|&k| (u[k] - u[row - 1]).abs() > MOVE * (high - low))
            .map_or(segment.start, |k| k + 1);
        if row - first < LEAST_REST || !at_rest(y, &(first..self.responses[0].rows.end), row) {
            return;
        }
        let before = u[first..row].iter().sum::<f64>() / (row - first) as f64;
        self.rest = Some(Rest::of(y, first..row, self.responses[0].u - before));
    }

    /// The same from an earlier row on, `delay` seconds after each step; None where that is no earlier.
    pub(super) fn earlier(&self, rec: &Record, delay: f64) -> Option<Self> {
        let row = self.row?;
        let time = rec.time(row) + delay;
        let skip = (row..row + self.skip).find(|&k| rec.time(k) >= time)? - row;
        let mut responses = self.responses.clone();
        responses.iter_mut().for_each(|r| r.rows.start -= self.skip - skip);
        Some(Steps { responses, skip, ..*self })
    }

    /// Rows that are averaged into one: modes are slow beside a ten thousandth of the record, and their block means
    /// decay as they do.
    pub(super) fn each(&self) -> usize {
        let longest = self.responses.iter().map(|r| r.rows.len()).max().unwrap_or(0);
        longest.div_ceil(MOST_ROWS).max(1)
    }

    /// What is not known of the time before the step.
    pub(super) fn start(&self, rec: &Record) -> Option<Note> {
        let Some(row) = self.row else {
            let text =
                "the record starts on its step: gain and initial state are not separable, the level is given";
            return Some(Note::info("X01", text).remedy("record some rows at rest before the step"));
        };
        let text = "y is not at rest before the step: its delay counts as part of the modes";
        let note = Note::warning("X07", text).at(rec.place(1, row));
        self.rest.is_none().then(|| note.remedy("record at least three rows at rest before the step"))
    }

    /// The first response alone.
    pub(super) fn first(&self) -> Self {
        Steps { responses: self.responses[..1].to_vec(), ..*self }
    }

    /// Whether K times the move of the input can be told from the level.
    pub(super) fn levels(&self) -> usize {
        let first = self.responses[0].u;
        if self.responses.iter().any(|r| r.u != first) { 2 } else { 1 }
    }
}

impl Rest {
    fn of(y: &[f64], rows: Range<usize>, du: f64) -> Self {
        let before = &y[rows];
        let n = before.len() as f64;
        let mean = before.iter().sum::<f64>() / n;
        let square: f64 = before.iter().map(|y| (y - mean).powi(2)).sum();
        let product: f64 = before.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
        let r = if square > 0.0 { (product / square).clamp(0.0, 0.99) } else { 0.0 };
        let (spread, step) = ((square / n).sqrt(), resolution(y));
        let sd = spread.max(step / 12f64.sqrt()) / n.sqrt() * ((1.0 + r) / (1.0 - r)).sqrt();
        Rest { y: mean, sd, band: (4.0 * spread).max(1.5 * step), du }
    }
}

/// The least distance between two values that occur.
fn resolution(y: &[f64]) -> f64 {
    let mut levels = y.to_vec();
    levels.sort_by(f64::total_cmp);
    let step = levels.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    if step.is_finite() { step } else { 0.0 }
}

/// Whether y has not gone anywhere before `row`, measured against its travel over `rows`.
fn at_rest(y: &[f64], rows: &Range<usize>, row: usize) -> bool {
    let (low, high) = extent(&y[rows.clone()]);
    let third = (row - rows.start).div_ceil(3);
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let drift = mean(&y[row - third..row]) - mean(&y[rows.start..rows.start + third]);
    // Half the squares of the moves from row to row: the variance of white noise, whatever the drift.
    let before = &y[rows.start..row];
    let moves = before.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>();
    let sd = (moves / (2 * before.len()) as f64 * 2.0 / third as f64).sqrt();
    drift.abs() <= (DRIFT * (high - low)).max(4.0 * sd)
}

/// The first row after the step of `RUN` together outside the band, on one side.
fn onset(y: &[f64], row: usize, end: usize, rest: &Rest) -> Option<usize> {
    let out = |sign: f64| {
        let outside = move |k: usize| sign * (y[k] - rest.y) > rest.band;
        (row + 1..end.saturating_sub(RUN)).find(|&n| (n..n + RUN).all(outside))
    };
    out(1.0).into_iter().chain(out(-1.0)).min()
}

/// X04: the input stepped, and y did not move.
fn stays(rec: &Record, row: usize, rest: &Rest) -> Error {
    let name = &rec.names[1];
    let text = format!("no response: {name} stays within {:.3e} of its level before the step", rest.band);
    Error::new("X04", text)
        .at(rec.place(1, row))
        .measured(rest.band, 0.0)
        .remedy("make a larger step, or check that these two columns belong together")
}

/// X01: an input that moves, but never from one level to another.
fn no_step(rec: &Record, u: &[f64]) -> Error {
    let (low, high) = extent(u);
    let mut values = u.to_vec();
    values.sort_by(f64::total_cmp);
    values.dedup();
    let largest = u.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max) / (high - low);
    let (name, count) = (rec.input_name(0), values.len());
    let text = format!(
        "no step response: {name} takes {count} values over {} rows, its largest move is {} % of its travel",
        rec.N(),
        rounded(100.0 * largest),
    );
    Error::new("X01", text)
        .at(Place::column(name))
        .count(count)
        .measured(largest, MOVE)
        .remedy("use estimate.arx, armax or process; or name the row of a step with step_at=")
}
