//! An output that stands still although an input moves (D18).
//!
//! A stretch of equal values counts as stuck where it goes on for more than `max(50, D18 N)` rows *after*
//! an input has moved within it, by more than a tenth of its travel. So none of these is stuck: an output
//! at rest before a step (the input does not move, or only just before the end), a settled one (the input
//! moved before the stretch), a slow one of few levels that takes its time to answer. Where stuck rows
//! leave no more than the share D18 of the record, nothing is left to fit.

use std::ops::Range;

use crate::limits::Limits;
use crate::linalg::extent;
use crate::note::{Note, Severity};
use crate::record::Record;

/// Rows that an output may always take to answer.
const LEAST: f64 = 50.0;

/// Share of its travel by which an input must move.
const MOVE: f64 = 0.1;

/// Rows on which an output keeps one value while an input moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Which output.
    pub output: usize,
    /// Rows of the record.
    pub rows: Range<usize>,
    /// Which input moves.
    pub input: usize,
}

/// The stuck stretches of every output.
pub fn stuck(rec: &Record, limits: &Limits) -> Vec<Stretch> {
    (0..rec.ny).flat_map(|output| of_output(rec, output, limits)).collect()
}

fn of_output(rec: &Record, output: usize, limits: &Limits) -> Vec<Stretch> {
    let y = rec.output(output);
    let least = least(rec, limits);
    let long = |rows: &Range<usize>| rows.len() as f64 > least;
    let stretches = rec.runs(0, 0, output).into_iter().flat_map(|run| equal_values(&y, run));
    stretches
        .filter(long)
        .filter_map(|rows| {
            let input =
                (0..rec.nu).find(|&i| first_move(rec, i, &rows).is_some_and(|k| long(&(k..rows.end))));
            input.map(|input| Stretch { output, rows, input })
        })
        .collect()
}

/// Rows that an output may keep its value after a move.
fn least(rec: &Record, limits: &Limits) -> f64 {
    LEAST.max(limits.D18 * rec.N() as f64)
}

/// A run cut wherever the value changes.
fn equal_values(y: &[f64], run: Range<usize>) -> Vec<Range<usize>> {
    let mut start = run.start;
    y[run]
        .chunk_by(|a, b| a == b)
        .map(|chunk| {
            let rows = start..start + chunk.len();
            start = rows.end;
            rows
        })
        .collect()
}

/// The first of these rows at which input `i` has left its value at their start.
fn first_move(rec: &Record, i: usize, rows: &Range<usize>) -> Option<usize> {
    let u = rec.input(i);
    let (low, high) = extent(&u);
    rows.clone().find(|&k| (u[k] - u[rows.start]).abs() > MOVE * (high - low))
}

/// D18 of one output: a warning per stretch, or one error where hardly anything else is left.
pub(super) fn stuck_note(rec: &Record, output: usize, stuck: &[Stretch], limits: &Limits) -> Vec<Note> {
    let own: Vec<&Stretch> = stuck.iter().filter(|s| s.output == output).collect();
    let counting = (0..rec.N()).filter(|&k| rec.is_valid(k, output)).count();
    let lost: usize = own.iter().map(|s| s.rows.len()).sum();
    if lost as f64 >= (1.0 - limits.D18) * counting as f64 && lost > 0 {
        let text =
            |stays: &str, moves: &str| format!("{stays} in {lost} of {counting} rows while {moves} moves");
        return vec![
            note(rec, own[0], Severity::Error, text, lost, limits)
                .remedy("look after the sensor or its link, and record again"),
        ];
    }
    own.iter().map(|s| warning(rec, s, limits)).collect()
}

fn warning(rec: &Record, s: &Stretch, limits: &Limits) -> Note {
    let row = |k: usize| rec.place(rec.nu + s.output, k).row.unwrap_or(k);
    let (first, last) = (row(s.rows.start), row(s.rows.end - 1));
    let text = |stays: &str, moves: &str| format!("{stays} from row {first} to {last} while {moves} moves");
    note(rec, s, Severity::Warning, text, s.rows.len(), limits)
        .remedy("leave these rows out, as the main job does: prep.exclude(rec)")
}

fn note(
    rec: &Record,
    s: &Stretch,
    severity: Severity,
    text: impl Fn(&str, &str) -> String,
    count: usize,
    limits: &Limits,
) -> Note {
    let place = rec.place(rec.nu + s.output, s.rows.start);
    let stays = format!("`{}` stays at {}", place.column, rec.y_at(s.rows.start, s.output));
    Note::new("D18", severity, text(&stays, rec.input_name(s.input)))
        .at(place)
        .count(count)
        .measured(count as f64, least(rec, limits))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(u: &[f64], y: &[f64]) -> Vec<(usize, usize)> {
        let rec = Record::uniform(u, 1, y, 1, 1.0).expect("fine");
        stuck(&rec, &Limits::default()).iter().map(|s| (s.rows.start, s.rows.end)).collect()
    }

    /// A first-order answer with a time constant of 20 rows, in steps of `quantum`.
    fn answer(u: &[f64], quantum: f64) -> Vec<f64> {
        let mut x = u[0];
        let lag = |&u: &f64| {
            x += (u - x) / 20.0;
            (x / quantum).round() * quantum
        };
        u.iter().map(lag).collect()
    }

    fn step(at: usize) -> Vec<f64> {
        (0..1000).map(|k| f64::from(u8::from(k >= at))).collect()
    }

    #[test]
    fn an_output_at_rest_before_a_step_or_settled_after_it_is_not_stuck() {
        for at in [100, 500, 900] {
            for quantum in [0.5, 0.1, 1e-3] {
                assert_eq!(found(&step(at), &answer(&step(at), quantum)), [], "{at} {quantum}");
            }
        }
    }

    #[test]
    fn a_held_value_is_stuck_from_its_first_row_on() {
        let u: Vec<f64> = (0..1000).map(|k| f64::from(k / 30 % 2)).collect();
        let mut y = answer(&u, 1e-3);
        let held = y[400];
        y[400..690].fill(held);
        assert_eq!(found(&u, &y), [(400, 690)]);
        y[400..580].copy_from_slice(&answer(&u, 1e-3)[400..580]);
        assert_eq!(found(&u, &y), [], "110 rows of 1000 are too few");
    }

    #[test]
    fn an_output_that_misses_a_whole_step_is_stuck() {
        let y: Vec<f64> = answer(&step(100), 1e-3).iter().map(|y| y.min(0.6)).collect();
        let u: Vec<f64> = (0..1000).map(|k| f64::from(u8::from((100..600).contains(&k)))).collect();
        assert_eq!(found(&u, &y).len(), 1);
    }
}
