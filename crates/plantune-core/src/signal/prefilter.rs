//! One filter over every signal of a record, and which outputs do not yet know better than its start.
//!
//! `u`, `y` and `r` pass the same filter, so `y = G u` stays true of what leaves it, but for what the
//! filter remembers: an unknown past, for which it takes the first value of a segment, and holes in `y`,
//! over which it holds the last value. Rows that remember more than [`FORGOTTEN`] are marked.

use std::ops::Range;

use super::sos::{Filter, Sos, rows_until};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::note::Note;
use crate::record::Record;

/// Memory at which a row counts again, per unit of the signal's travel.
const FORGOTTEN: f64 = 1e-6;

/// Most of a segment that is marked for its unknown past (and future).
const MOST_MARKED: f64 = 0.1;

/// A record's signals behind a filter; shapes are those of the record.
#[derive(Clone, Debug)]
pub struct Filtered {
    /// Inputs.
    pub u: Vec<f64>,
    /// Outputs.
    pub y: Vec<f64>,
    /// Reference, if there is one.
    pub r: Option<Vec<f64>>,
    /// Which outputs count.
    pub marks: Marks,
}

/// Passes `u`, `y` and `r` through the filter, segment by segment.
pub fn prefilter(rec: &Record, r: Option<&[f64]>, sos: &Sos, limits: &Limits) -> Result<Filtered> {
    let segments: Vec<_> = rec.segments().collect();
    let memory = sos.memory(longest(&segments));
    let marks = Marks::new(rec, &segments, &memory, false, limits)?;
    let through = |x: &[f64], width| by_column(x, width, &segments, |x| Filter::new(sos).run(x));
    Ok(Filtered {
        u: through(rec.u, rec.nu)?,
        y: through(&held(rec, &segments), rec.ny)?,
        r: r.map(|r| through(r, rec.ny)).transpose()?,
        marks,
    })
}

/// Rows of the longest segment.
pub fn longest(segments: &[Range<usize>]) -> usize {
    segments.iter().map(Range::len).max().unwrap_or(0)
}

/// `f` over each column of each segment of the row-major `x (N, width)`; other rows stay.
pub fn by_column(
    x: &[f64],
    width: usize,
    segments: &[Range<usize>],
    f: impl Fn(&mut [f64]) -> Result<()>,
) -> Result<Vec<f64>> {
    let mut out = x.to_vec();
    for segment in segments {
        for i in 0..width {
            let mut column: Vec<f64> = segment.clone().map(|k| x[k * width + i]).collect();
            f(&mut column)?;
            for (k, v) in segment.clone().zip(column) {
                out[k * width + i] = v;
            }
        }
    }
    Ok(out)
}

/// Outputs with the last counting value of the segment, or the first, where they do not count.
pub fn held(rec: &Record, segments: &[Range<usize>]) -> Vec<f64> {
    let mut y = rec.y.to_vec();
    if rec.valid.is_none() {
        return y;
    }
    for segment in segments {
        for i in 0..rec.ny {
            let Some(first) = segment.clone().find(|&k| rec.is_valid(k, i)) else { continue };
            let mut last = rec.y_at(first, i);
            for k in segment.clone() {
                if rec.is_valid(k, i) {
                    last = rec.y_at(k, i);
                }
                y[k * rec.ny + i] = last;
            }
        }
    }
    y
}

/// Which outputs count behind a filter.
#[derive(Clone, Debug)]
pub struct Marks {
    /// `(N, ny)`.
    pub valid: Vec<bool>,
    /// Outputs that counted and no longer do.
    pub count: usize,
    /// The most that is left, over all segments, of an unknown past of unit size.
    pub left: f64,
    /// Doubts.
    pub notes: Vec<Note>,
}

impl Marks {
    /// Marks what a filter of this memory remembers; one that runs `both_ways` has an unknown future too.
    pub fn new(
        rec: &Record,
        segments: &[Range<usize>],
        memory: &[f64],
        both_ways: bool,
        limits: &Limits,
    ) -> Result<Self> {
        let reach = rows_until(memory, FORGOTTEN);
        let mut marks = Marks { valid: vec![true; rec.y.len()], count: 0, left: 0.0, notes: Vec::new() };
        let mut doubtful = Vec::new();
        for segment in segments {
            let most = MOST_MARKED / if both_ways { 2.0 } else { 1.0 } * segment.len() as f64;
            let unknown = reach.min(most as usize);
            let left = memory[unknown.min(memory.len() - 1)];
            marks.left = marks.left.max(left);
            if left > limits.F02 {
                doubtful.push(segment.start);
            }
            for i in 0..rec.ny {
                marks.mark(rec, i, segment.clone(), unknown, reach);
                if both_ways {
                    marks.mark(rec, i, segment.clone().rev(), unknown, reach);
                }
            }
        }
        if let Some(&first) = doubtful.first() {
            marks.notes.push(still_remembers(rec, marks.left, first, doubtful.len(), limits));
        }
        let counted = (0..rec.N()).flat_map(|k| (0..rec.ny).map(move |i| (k, i)));
        marks.count = counted.filter(|&(k, i)| rec.is_valid(k, i) && !marks.valid[k * rec.ny + i]).count();
        marks.check_lost(rec, limits)?;
        Ok(marks)
    }

    /// Marks the first `unknown` rows on the way, the holes, and `reach` rows after each hole.
    fn mark(
        &mut self,
        rec: &Record,
        i: usize,
        rows: impl Iterator<Item = usize>,
        unknown: usize,
        reach: usize,
    ) {
        let mut since_hole = usize::MAX;
        for (n, k) in rows.enumerate() {
            since_hole = if rec.is_valid(k, i) { since_hole.saturating_add(1) } else { 0 };
            if n < unknown || since_hole <= reach {
                self.valid[k * rec.ny + i] = false;
            }
        }
    }

    /// D07: a filter with a long memory turns a few holes into a lost record.
    fn check_lost(&self, rec: &Record, limits: &Limits) -> Result<()> {
        for i in 0..rec.ny {
            let column = || (0..rec.N()).map(|k| (k, self.valid[k * rec.ny + i]));
            let lost = column().filter(|(_, valid)| !valid).count();
            let share = lost as f64 / rec.N() as f64;
            let Some(hole) = (0..rec.N()).find(|&k| !rec.is_valid(k, i)) else { continue };
            if share > limits.D07 {
                let holes = (0..rec.N()).filter(|&k| !rec.is_valid(k, i)).count();
                let place = rec.place(rec.nu + i, hole);
                let text = format!(
                    "`{}` does not count in {holes} rows, and the filter remembers them in {lost} of {}",
                    place.column,
                    rec.N()
                );
                return Err(Error::new("D07", text)
                    .at(place)
                    .count(lost)
                    .measured(share, limits.D07)
                    .remedy("cut the record into segments at the holes, or use a filter of a wider band"));
            }
        }
        Ok(())
    }
}

fn still_remembers(rec: &Record, left: f64, first: usize, count: usize, limits: &Limits) -> Note {
    let text = format!(
        "the filter still remembers up to {:.2} % of what an unknown start changed, \
         after a tenth of a segment was marked",
        100.0 * left
    );
    Note::warning("F02", text)
        .at(rec.place(rec.nu, first))
        .count(count)
        .measured(left, limits.F02)
        .remedy("use longer segments, a wider band or a lower order, or an estimator with an offset instead")
}
