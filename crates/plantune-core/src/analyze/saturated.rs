//! An input that lies at a limit of its actuator (M03).
//!
//! Where the limits are known, a row is saturated if the input is at or beyond one of them. Where they are
//! not, an end of the input's travel is taken for a limit if the input lies on it in more than the share M03
//! of the rows, and `OFTEN` times as often as on any value in between, where it spends at least the share
//! `BETWEEN` of the rows. A test signal of few levels dwells on all of them alike and has no such end; nor has
//! one that merely passes from one level to the other. A stretch with which a segment begins or ends does not
//! count: it may be the rest before a test, or the end of one.

use std::ops::Range;

use crate::limits::Limits;
use crate::linalg::extent;
use crate::note::{Note, Place, Severity};
use crate::record::Record;

/// How many times as often as on any other value an input lies on its limit.
const OFTEN: usize = 5;

/// Share of the rows at which an input is free to move, if its ends are limits.
const BETWEEN: f64 = 0.2;

/// Ranges of rows that a note lists.
const LISTED: usize = 5;

/// Lowest and highest value that an actuator reaches; infinite where it is not known.
pub type Ends = (f64, f64);

/// Rows on which an input lies at or beyond a limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Saturated {
    /// Which input.
    pub input: usize,
    /// The limit.
    pub at: f64,
    /// Rows of the record.
    pub rows: Range<usize>,
}

/// The limits that the inputs seem to have.
pub fn guessed_ends(rec: &Record, limits: &Limits) -> Vec<Ends> {
    (0..rec.nu).map(|i| guessed(rec, &rec.input(i), limits)).collect()
}

fn guessed(rec: &Record, u: &[f64], limits: &Limits) -> Ends {
    let (low, high) = extent(u);
    let mut between: Vec<f64> = u.iter().copied().filter(|&x| x != low && x != high).collect();
    if (between.len() as f64) < BETWEEN * u.len() as f64 {
        return (f64::NEG_INFINITY, f64::INFINITY);
    }
    between.sort_by(f64::total_cmp);
    let most = between.chunk_by(|a, b| a == b).map(<[f64]>::len).max().unwrap_or(0);
    let is_limit = |end: f64| {
        let count = rows_inside(rec, u, end);
        count > OFTEN * most && count as f64 > limits.M03 * u.len() as f64
    };
    (if is_limit(low) { low } else { f64::NEG_INFINITY }, if is_limit(high) { high } else { f64::INFINITY })
}

/// Rows at a value, without those with which a segment begins or ends.
fn rows_inside(rec: &Record, u: &[f64], value: f64) -> usize {
    let count = |segment: Range<usize>| {
        let own = &u[segment];
        let first = own.iter().position(|&x| x != value)?;
        let last = own.iter().rposition(|&x| x != value)?;
        Some(own[first..last].iter().filter(|&&x| x == value).count())
    };
    rec.segments().filter_map(count).sum()
}

/// Whether the input goes straight from one end to the other wherever it moves, as a trapezoid does: then it may be
/// meant to dwell there, and no record is refused for it.
fn only_ramps(rec: &Record, input: usize, found: &[&Saturated]) -> bool {
    let inside = found.windows(2).filter(|pair| {
        rec.segments().any(|s| s.contains(&pair[0].rows.start) && s.contains(&pair[1].rows.start))
    });
    inside.map(|pair| pair[0].rows.end - 1..pair[1].rows.start + 1).all(|rows| {
        let u: Vec<f64> = rows.map(|k| rec.u_at(k, input)).collect();
        u.is_sorted() || u.iter().rev().is_sorted()
    })
}

/// The stretches on which inputs lie at or beyond their limits, input by input.
pub fn saturated(rec: &Record, ends: &[Ends]) -> Vec<Saturated> {
    let of_input = |i: usize| {
        let (u, (low, high)) = (rec.input(i), ends[i]);
        let side = move |x: f64| if x <= low { -1 } else { i32::from(x >= high) };
        let at = move |side: i32| if side < 0 { low } else { high };
        let mut found = Vec::new();
        for segment in rec.segments() {
            let mut start = segment.start;
            for run in u[segment].chunk_by(|a, b| side(*a) == side(*b)) {
                if side(run[0]) != 0 {
                    found.push(Saturated { input: i, at: at(side(run[0])), rows: start..start + run.len() });
                }
                start += run.len();
            }
        }
        found
    };
    (0..rec.nu).flat_map(of_input).collect()
}

/// M03 of one input: a warning beyond the share M03 of the rows, an error beyond the share `M03_most`.
pub(super) fn saturated_note(
    rec: &Record,
    input: usize,
    found: &[Saturated],
    limits: &Limits,
) -> Option<Note> {
    let own: Vec<&Saturated> = found.iter().filter(|s| s.input == input).collect();
    let count: usize = own.iter().map(|s| s.rows.len()).sum();
    let share = count as f64 / rec.N() as f64;
    if share <= limits.M03 {
        return None;
    }
    let place = rec.place(input, own[0].rows.start);
    let text = format!(
        "`{}` lies at a limit, {}, in {count} of {} rows: {}",
        place.column,
        levels(&own),
        rec.N(),
        listed(rec, &own)
    );
    let mut note = said(text, place, count, share, limits);
    if note.severity == Severity::Error && only_ramps(rec, input, &own) {
        note.severity = Severity::Warning;
    }
    Some(note)
}

/// The note that such a share of rows deserves.
pub(super) fn said(text: String, place: Place, count: usize, share: f64, limits: &Limits) -> Note {
    if share > limits.M03_most {
        return Note::error("M03", text)
            .at(place)
            .count(count)
            .measured(share, limits.M03_most)
            .remedy("record again with smaller moves of the input");
    }
    Note::warning("M03", text)
        .at(place)
        .count(count)
        .measured(share, limits.M03)
        .remedy("if the actuator does not follow there, leave these rows out: u_limits=(low, high)")
}

/// The limits met, as in `0 and 100`.
fn levels(own: &[&Saturated]) -> String {
    let mut at: Vec<f64> = own.iter().map(|s| s.at).collect();
    at.sort_by(f64::total_cmp);
    at.dedup();
    at.iter().map(f64::to_string).collect::<Vec<_>>().join(" and ")
}

/// The first ranges of rows, as in the file.
pub(super) fn listed(rec: &Record, own: &[&Saturated]) -> String {
    let row = |k: usize| rec.place(0, k).row.unwrap_or(k);
    let range = |s: &&Saturated| format!("{}-{}", row(s.rows.start), row(s.rows.end - 1));
    let shown: Vec<String> = own.iter().take(LISTED).map(range).collect();
    let more = own.len().saturating_sub(LISTED);
    let tail = if more > 0 { format!(" and {more} more stretches") } else { String::new() };
    shown.join(", ") + &tail
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn found(u: &[f64]) -> Vec<Saturated> {
        let rec = Record::uniform(u, 1, u, 1, 1.0).expect("fine");
        saturated(&rec, &guessed_ends(&rec, &Limits::default()))
    }

    #[test]
    fn a_clipped_wave_lies_at_its_limits() {
        let u: Vec<f64> = (0..400).map(|k| (1.5 * (0.03 * f64::from(k)).sin()).clamp(-1.0, 1.0)).collect();
        let stretches = found(&u);
        assert_eq!(stretches.len(), 4);
        assert!(stretches.iter().all(|s| u[s.rows.clone()].iter().all(|&x| x == s.at)));
    }

    #[test]
    fn test_signals_and_waves_are_left_in_peace() {
        let prbs: Vec<f64> = (0..400).map(|k| f64::from(k * k / 7 % 2)).collect();
        let stairs: Vec<f64> = (0..400).map(|k| f64::from(k / 40 % 5)).collect();
        let wave: Vec<f64> = (0..400).map(|k| (100.0 * (0.03 * f64::from(k)).sin()).round()).collect();
        let slow_step: Vec<f64> = (0..400).map(|k| f64::from(k.clamp(195, 205))).collect();
        let rest = [vec![0.0; 300], stairs.iter().map(|x| x + 1.0).collect()].concat();
        for u in [prbs, stairs, wave, slow_step, rest] {
            assert_eq!(found(&u), []);
        }
    }

    #[test]
    fn a_trapezoid_is_doubted_and_not_refused() {
        let trapezoid: Vec<f64> =
            (0..400).map(|k: i32| f64::from((k % 100 - 50).abs()).clamp(22.0, 34.0)).collect();
        let rough: Vec<f64> = white(400, 1).iter().map(|x| x.clamp(-0.6, 0.6)).collect();
        for (u, severity) in [(trapezoid, Severity::Warning), (rough, Severity::Error)] {
            let rec = Record::uniform(&u, 1, &u, 1, 1.0).expect("fine");
            let stretches = found(&u);
            let note = saturated_note(&rec, 0, &stretches, &Limits::default()).expect("a note");
            assert!(note.measured > Some(0.5));
            assert_eq!(note.severity, severity);
        }
    }

    #[test]
    fn known_limits_hold_beyond_them_as_well() {
        let u: Vec<f64> = (0..100).map(f64::from).collect();
        let rec = Record::uniform(&u, 1, &u, 1, 1.0).expect("fine");
        let rows: Vec<_> = saturated(&rec, &[(9.5, 80.0)]).into_iter().map(|s| (s.at, s.rows)).collect();
        assert_eq!(rows, [(9.5, 0..10), (80.0, 80..100)]);
    }
}
