//! Rows at which a signal does not tell what the plant does, left out: saturated (M03) and stuck (D18).
//!
//! What is left is cut into runs, each a segment of its own, so that no estimator reaches over a hole. A row
//! of which only the next outputs are wrong is not kept for its own output: few are lost by that.

use std::ops::Range;

use super::saturated::{Ends, Saturated, guessed_ends, listed, said, saturated};
use super::stuck::{Stretch, stuck};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::note::{Note, Place};
use crate::record::Record;

/// What is known of the actuators.
#[derive(Clone, Debug)]
pub enum Actuators {
    /// Nothing: no row is taken as saturated.
    Unknown,
    /// To be guessed from the record.
    Guessed,
    /// The limits of each input.
    Known(Vec<Ends>),
}

/// What is left, and what was cut.
#[derive(Clone, Debug, Default)]
pub struct Excluded {
    /// Runs of rows that are left.
    pub kept: Vec<Range<usize>>,
    /// One line a reason, for the record's log.
    pub log: Vec<String>,
    /// D18 where stuck rows are cut, M03 where more than its share is saturated.
    pub notes: Vec<Note>,
}

/// The record without its saturated and, where asked, its stuck rows.
pub fn exclude(rec: &Record, actuators: &Actuators, stuck: bool, limits: &Limits) -> Result<Excluded> {
    let mut out = Excluded::default();
    let mut lost = vec![false; rec.N()];
    if stuck {
        cut_stuck(rec, &mut lost, &mut out, limits)?;
    }
    let ends = match actuators {
        Actuators::Unknown => Vec::new(),
        Actuators::Guessed => guessed_ends(rec, limits),
        Actuators::Known(ends) => checked(rec, ends)?.to_vec(),
    };
    if !ends.is_empty() {
        cut_saturated(rec, &ends, &mut lost, &mut out, limits)?;
    }
    out.kept = runs_left(rec, &lost);
    if out.kept.iter().map(Range::len).sum::<usize>() < 2 {
        return Err(Error::new("D04", "no two rows are left of the record")
            .remedy("record again with smaller moves of the input and sound sensors"));
    }
    Ok(out)
}

fn checked<'e>(rec: &Record, ends: &'e [Ends]) -> Result<&'e [Ends]> {
    if ends.len() != rec.nu {
        return Err(Error::argument("u_limits", format!("{} pairs", ends.len()), "one pair per input"));
    }
    match ends.iter().find(|(low, high)| low.is_nan() || high.is_nan() || low >= high) {
        Some((low, high)) => Err(Error::argument("u_limits", format!("({low}, {high})"), "ascending")),
        None => Ok(ends),
    }
}

fn cut_stuck(rec: &Record, lost: &mut [bool], out: &mut Excluded, limits: &Limits) -> Result<()> {
    let found = stuck(rec, limits);
    let Some(first) = found.first() else { return Ok(()) };
    mark(lost, found.iter().map(|s| &s.rows));
    let count = lost.iter().filter(|&&l| l).count();
    let share = count as f64 / rec.N() as f64;
    let what =
        format!("{} stuck", names(found.iter().map(|s: &Stretch| rec.names[rec.nu + s.output].clone())));
    let text = format!("{what} in {count} of {} rows", rec.N());
    let place = rec.place(rec.nu + first.output, first.rows.start);
    if share > limits.M03_most {
        return Err(too_many("D18", text, place, count, share, limits));
    }
    out.log.push(format!("excluded {count} of {} rows: {what}", rec.N()));
    out.notes.push(
        Note::warning("D18", format!("{text}: they are left out"))
            .at(place)
            .count(count)
            .measured(share, 0.0)
            .remedy("look after the sensor or its link"),
    );
    Ok(())
}

fn cut_saturated(
    rec: &Record,
    ends: &[Ends],
    lost: &mut [bool],
    out: &mut Excluded,
    limits: &Limits,
) -> Result<()> {
    let found = saturated(rec, ends);
    let Some(first) = found.first() else { return Ok(()) };
    let mut own = vec![false; rec.N()];
    mark(&mut own, found.iter().map(|s| &s.rows));
    let count = own.iter().filter(|&&l| l).count();
    let share = count as f64 / rec.N() as f64;
    let what = format!("{} at a limit", names(found.iter().map(|s| rec.input_name(s.input).to_owned())));
    let text = format!("{what} in {count} of {} rows", rec.N());
    let place = rec.place(first.input, first.rows.start);
    if share > limits.M03_most {
        return Err(too_many("M03", text, place, count, share, limits));
    }
    lost.iter_mut().zip(own).for_each(|(lost, own)| *lost |= own);
    out.log.push(format!("excluded {count} of {} rows: {what}", rec.N()));
    if share > limits.M03 {
        let ranges = listed(rec, &found.iter().collect::<Vec<&Saturated>>());
        let text = format!("{text}: they are left out ({ranges})");
        let note = said(text, place, count, share, limits);
        out.notes.push(note.remedy("record with smaller moves, and log where the actuator really is"));
    }
    Ok(())
}

fn too_many(
    code: &'static str,
    text: String,
    place: Place,
    count: usize,
    share: f64,
    limits: &Limits,
) -> Error {
    Error::new(code, text)
        .at(place)
        .count(count)
        .measured(share, limits.M03_most)
        .remedy("record again, with smaller moves of the input and sound sensors")
}

fn mark<'r>(lost: &mut [bool], rows: impl Iterator<Item = &'r Range<usize>>) {
    rows.for_each(|rows| lost[rows.clone()].fill(true));
}

/// Each name once.
fn names(all: impl Iterator<Item = String>) -> String {
    let mut once: Vec<String> = Vec::new();
    for name in all {
        if !once.contains(&name) {
            once.push(name);
        }
    }
    once.join(", ")
}

/// The runs of rows left, each within its segment.
fn runs_left(rec: &Record, lost: &[bool]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for segment in rec.segments() {
        let first = runs.len();
        for k in segment.filter(|&k| !lost[k]) {
            match runs[first..].last_mut() {
                Some(run) if run.end == k => run.end = k + 1,
                _ => runs.push(k..k + 1),
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_stay_within_their_segments() {
        let u: Vec<f64> = [0.0, 1.0, 5.0, 2.0, 1.0, 2.0, 5.0, 0.0].to_vec();
        let rec = Record { starts: vec![0, 5], ..Record::uniform(&u, 1, &u, 1, 1.0).expect("fine") };
        let known = Actuators::Known(vec![(-1.0, 5.0)]);
        let out = exclude(&rec, &known, true, &Limits::default()).expect("six rows");
        assert_eq!(out.kept, [0..2, 3..5, 5..6, 7..8]);
        assert_eq!((out.log.len(), out.notes[0].code, out.notes[0].count), (1, "M03", Some(2)));
        let none = exclude(&rec, &Actuators::Unknown, true, &Limits::default()).expect("all");
        assert_eq!((none.kept, none.log.len()), (vec![0..5, 5..8], 0));
    }
}
