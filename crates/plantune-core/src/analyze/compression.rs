//! An output that a historian has thinned out, and filled again on its old grid (D15).
//!
//! A historian keeps a value when it leaves the last one by more than a limit (exception), or when a straight line
//! from the last kept one no longer serves (swinging door, Bristol 1990). Read back, long stretches then stand still
//! or lie on straight lines to the last digit, which measured noise never does:
//!
//! ```text
//! line   more than 0.15 of the rows lie between two neighbours on one slope, |d2 y| <= 1e-6 median |d2 y|
//! hold   more than 0.10 of the rows repeat the one before, in stretches that a real move began;
//!        of an output whose values come back: more than 0.30, and yet most moves jump past the next value
//! ```
//!
//! An output read in steps repeats and is in line as well, so these are looked for first ([`step_of_reading`]). What stands
//! still at the start, or has settled to the last digit as a simulated plant does, was begun by no move. Dynamics
//! faster than the stretches are lost, and with them T and L: METHODS 8, pitfall 7. Inputs are not looked at: a
//! controller's output rests and ramps of its own.

use super::quantised::step_of_reading;
use crate::note::{Note, Severity};
use crate::record::Record;
use crate::stats::median;

/// Share of rows in exact line on a slope; swinging doors leave 0.38 and more, noise 0.009 at most.
const IN_LINE: f64 = 0.15;

/// Share of exact repeats; exceptions leave 0.24 and more.
const REPEATED: f64 = 0.10;

/// The same of an output that is read in steps, or whose values come back.
const REPEATED_LEVELS: f64 = 0.30;

/// Values for each move below which they come back, as those of a converter that is not linear do.
const COMES_BACK: f64 = 0.9;

/// Second differences below this share of their median are none.
const NONE: f64 = 1e-6;

/// Moves below this share of their median are the last of a settling.
const REAL_MOVE: f64 = 1e-3;

/// Moves, or held stretches, below which an output stands still: the business of D18.
const LEAST_MOVES: usize = 10;

/// How the record was filled again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refilled {
    /// By straight lines.
    Line,
    /// By the last value.
    Hold,
}

impl Refilled {
    /// The word used in Python and in JSON.
    pub fn as_str(self) -> &'static str {
        match self {
            Refilled::Line => "line",
            Refilled::Hold => "hold",
        }
    }
}

/// What was measured of an output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compression {
    /// Share of rows that repeat the one before, after a real move.
    pub repeated: f64,
    /// Share of rows in exact line with their neighbours, on a slope.
    pub in_line: f64,
    /// Step in which it is read.
    pub step: Option<f64>,
    /// How it was filled again; None where it was not compressed.
    pub refilled: Option<Refilled>,
}

/// Looks at an output over the rows that count.
pub fn compression(rec: &Record, output: usize) -> Compression {
    let y = rec.output(output);
    let runs: Vec<&[f64]> = rec.runs(0, 0, output).into_iter().map(|run| &y[run]).collect();
    let kept = runs.concat();
    let size = kept.iter().fold(0.0_f64, |size, y| size.max(y.abs()));
    let tiny = 64.0 * f64::EPSILON * size;
    let moves: Vec<f64> = differences(&runs).filter(|d| *d > tiny).collect();
    if moves.len() < LEAST_MOVES {
        return Compression { repeated: 0.0, in_line: 0.0, step: None, refilled: None };
    }
    let usual = median(moves.clone());
    let pairs: usize = runs.iter().map(|run| run.len() - 1).sum();
    let held: Vec<(usize, usize)> = runs.iter().map(|run| repeats(run, REAL_MOVE * usual)).collect();
    let (rows, stretches) = held.iter().fold((0, 0), |(a, b), (c, d)| (a + c, b + d));
    let repeated = if stretches < LEAST_MOVES { 0.0 } else { rows as f64 / pairs as f64 };
    let in_line = lines(&runs, tiny) as f64 / pairs as f64;
    let step = step_of_reading(&kept);
    let levels = levels(&kept);
    let comes_back = step.is_some() || (levels.len() as f64) < COMES_BACK * moves.len() as f64;
    let refilled = match step {
        None if in_line > IN_LINE => Some(Refilled::Line),
        _ if !comes_back && repeated > REPEATED => Some(Refilled::Hold),
        _ if comes_back && repeated > REPEATED_LEVELS && 2 * jumps(&runs, &levels) > moves.len() => {
            Some(Refilled::Hold)
        }
        _ => None,
    };
    Compression { repeated, in_line, step, refilled }
}

/// The values that there are, in order.
fn levels(y: &[f64]) -> Vec<f64> {
    let mut levels = y.to_vec();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

/// Moves past the next level.
fn jumps(runs: &[&[f64]], levels: &[f64]) -> usize {
    let place = |y: f64| levels.partition_point(|level| *level < y);
    let past = |w: &&[f64]| place(w[1]).abs_diff(place(w[0])) > 1;
    runs.iter().map(|run| run.windows(2).filter(past).count()).sum()
}

fn differences<'a>(runs: &'a [&[f64]]) -> impl Iterator<Item = f64> + 'a {
    runs.iter().flat_map(|run| run.windows(2).map(|w| (w[1] - w[0]).abs()))
}

/// Rows that repeat the one before, in stretches that a move longer than `real` began; and how many stretches.
fn repeats(y: &[f64], real: f64) -> (usize, usize) {
    let (mut began, mut fresh) = (false, false);
    let (mut count, mut stretches) = (0, 0);
    for w in y.windows(2) {
        let d = (w[1] - w[0]).abs();
        if d > 0.0 {
            (began, fresh) = (d > real, true);
        } else if began {
            count += 1;
            stretches += usize::from(fresh);
            fresh = false;
        }
    }
    (count, stretches)
}

/// Rows in exact line with both neighbours, on a slope.
fn lines(runs: &[&[f64]], tiny: f64) -> usize {
    let bend = |w: &[f64]| ((w[2] - w[1]) - (w[1] - w[0])).abs();
    let triples = || runs.iter().flat_map(|run| run.windows(3));
    let bends: Vec<f64> = triples().map(bend).filter(|d| *d > tiny).collect();
    if bends.is_empty() {
        return 0; // one line is no history
    }
    let none = tiny.max(NONE * median(bends));
    triples().filter(|w| bend(w) <= none && (w[2] - w[1]).abs() > tiny).count()
}

/// Every output, and the same in words; `keep` takes compressed ones with a warning.
pub fn compressed_outputs(rec: &Record, keep: bool) -> (Vec<Compression>, Vec<Note>) {
    let found = (0..rec.ny).map(|i| compression(rec, i)).collect();
    (found, (0..rec.ny).filter_map(|i| compression_note(rec, i, keep)).collect())
}

/// D15 of one output: an error, or a warning where the caller keeps it as it is.
pub(super) fn compression_note(rec: &Record, output: usize, keep: bool) -> Option<Note> {
    let found = compression(rec, output);
    let refilled = found.refilled?;
    let place = rec.place(rec.nu + output, 0);
    let name = place.column.clone();
    let (share, limit, what) = match (refilled, found.step) {
        (Refilled::Line, _) => (found.in_line, IN_LINE, "lie in exact line with their neighbours"),
        (Refilled::Hold, None) => (found.repeated, REPEATED, "repeat the value before"),
        (Refilled::Hold, Some(_)) => (
            found.repeated,
            REPEATED_LEVELS,
            "repeat the value before, and then jump by several steps of reading",
        ),
    };
    let text = format!("`{name}` was compressed by a historian: {:.0} % of its rows {what}", 100.0 * share);
    let (severity, remedy) = if keep {
        (Severity::Warning, "T and L follow the compression: export raw values to trust them")
    } else {
        (Severity::Error, "export raw values; compressed=\"keep\" takes it as it is, with a note")
    };
    let rows = (share * rec.N() as f64).round() as usize;
    Some(Note::new("D15", severity, text).at(place).count(rows).measured(share, limit).remedy(remedy))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    /// A slow signal: an autoregression about 50.
    fn slow(seed: u64) -> Vec<f64> {
        let mut x = 0.0;
        let lag = |e: &f64| {
            x = 0.95 * x + 0.31 * e;
            50.0 + x
        };
        white(1500, seed).iter().map(lag).collect()
    }

    fn of(y: &[f64]) -> Option<Refilled> {
        let u = vec![0.0; y.len()];
        compression(&Record::uniform(&u, 1, y, 1, 1.0).expect("fine"), 0).refilled
    }

    /// The value that left the last kept one by more than `limit`, held.
    fn held(y: &[f64], limit: f64) -> Vec<f64> {
        let mut kept = y[0];
        let hold = |&y: &f64| {
            if (y - kept).abs() > limit {
                kept = y;
            }
            kept
        };
        y.iter().map(hold).collect()
    }

    #[test]
    fn exceptions_are_seen_and_noise_and_reading_are_not() {
        for seed in 0..10 {
            let y = slow(seed);
            assert_eq!(of(&y), None);
            assert_eq!(of(&held(&y, 0.3)), Some(Refilled::Hold));
            for q in [0.01, 0.1, 0.5] {
                let read = |y: &f64| (y / q).round() * q;
                assert_eq!(of(&y.iter().map(read).collect::<Vec<_>>()), None, "{q}");
            }
        }
    }

    /// Every fifth value, and straight lines between.
    #[test]
    fn straight_lines_are_seen() {
        let y = slow(3);
        let line = |k: usize| {
            let (a, b) = (k / 5 * 5, (k / 5 * 5 + 5).min(y.len() - 1));
            if a == b { y[a] } else { y[a] + (y[b] - y[a]) * (k - a) as f64 / (b - a) as f64 }
        };
        assert_eq!(of(&(0..1500).map(line).collect::<Vec<_>>()), Some(Refilled::Line));
    }

    #[test]
    fn a_simulated_plant_at_rest_and_settled_is_not_compressed() {
        let mut x = 20.0;
        let lag = |k: usize| {
            x += (if k < 300 || (k / 150).is_multiple_of(2) { 20.0 } else { 25.0 } - x) / 3.0;
            x
        };
        assert_eq!(of(&(0..3000).map(lag).collect::<Vec<_>>()), None);
    }
}
