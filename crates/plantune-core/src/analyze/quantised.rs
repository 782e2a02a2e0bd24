//! An output read too coarsely for its response (M04).
//!
//! ```text
//! resolution = least step between two values taken,   amplitude = travel of the middle 98 % of the rows
//! ```
//!
//! Beyond a quarter of the amplitude, that is at five values or fewer, the errors of reading are no noise any
//! more: they follow the response. With one value there is none.

use crate::limits::Limits;
use crate::note::{Note, rounded};
use crate::record::Record;
use crate::stats::median;

/// Share of the travel below which two values are the same.
const SAME: f64 = 1e-9;

/// Share of the rows at each end of the travel that may be outliers.
const OUTLIERS: f64 = 0.01;

/// How an output is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Least step between two values; 0 where there is only one.
    pub step: f64,
    /// Travel without the outermost hundredth of the rows.
    pub amplitude: f64,
    /// Values taken, up to rounding.
    pub levels: usize,
}

/// Resolution of an output over the rows that count.
pub fn resolution(rec: &Record, output: usize) -> Resolution {
    let mut y: Vec<f64> =
        (0..rec.N()).filter(|&k| rec.is_valid(k, output)).map(|k| rec.y_at(k, output)).collect();
    y.sort_by(f64::total_cmp);
    let (Some(low), Some(high)) = (y.first(), y.last()) else {
        return Resolution { step: 0.0, amplitude: 0.0, levels: 0 };
    };
    let travel = high - low;
    let apart = |pair: &[f64]| (pair[1] - pair[0] > SAME * travel).then(|| pair[1] - pair[0]);
    let steps: Vec<f64> = y.windows(2).filter_map(apart).collect();
    let outer = (OUTLIERS * y.len() as f64) as usize;
    let middle = y[y.len() - 1 - outer] - y[outer];
    Resolution {
        step: steps.iter().copied().reduce(f64::min).unwrap_or(0.0),
        amplitude: if middle > 0.0 { middle } else { travel },
        levels: steps.len() + 1,
    }
}

/// Share of the distances between values that must be multiples of a step, and how far from a whole one.
const MULTIPLES: f64 = 0.98;
const OFF: f64 = 0.05;

/// The largest step of which the distances between neighbouring values are multiples; None if there is none.
///
/// The least distance of two values is tried, its half and its third, each sharpened by
/// `q <- sum gaps / sum round(gaps/q)`. Chance would make one distance in ten a multiple to a twentieth of a step.
pub fn step_of_reading(y: &[f64]) -> Option<f64> {
    let moves: Vec<f64> = y.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).collect();
    let (changes, rows) = (moves.len() + 1, y.len());
    let mut values = y.to_vec();
    values.sort_by(f64::total_cmp);
    values.dedup();
    // Hardly a value comes back, and hardly one is held: not read in steps.
    if values.len() < 3 || (2 * values.len() > changes && 20 * (rows - changes) < rows) {
        return None;
    }
    let size = values[0].abs().max(values[values.len() - 1].abs());
    let gaps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).filter(|gap| *gap > 1e-12 * size).collect();
    let (least, total) = (gaps.iter().copied().reduce(f64::min)?, gaps.iter().sum::<f64>());
    let usual = median(moves);
    for part in [1.0, 2.0, 3.0] {
        let mut q = least / part;
        if q < 1e-3 * usual {
            return None;
        }
        for _ in 0..5 {
            q = total / gaps.iter().map(|gap| (gap / q).round().max(1.0)).sum::<f64>();
        }
        let fits = gaps.iter().filter(|gap| (*gap / q - (*gap / q).round()).abs() < OFF).count();
        if fits as f64 >= MULTIPLES * gaps.len() as f64 {
            return Some(q);
        }
    }
    None
}

/// M04 of one output: a warning beyond the share M04 of its amplitude, an error where it has one value.
pub(super) fn quantised_note(rec: &Record, output: usize, limits: &Limits) -> Option<Note> {
    let found = resolution(rec, output);
    let place = rec.place(rec.nu + output, 0);
    let name = place.column.clone();
    if found.levels < 2 {
        return Some(
            Note::error("M04", format!("`{name}` takes one value, {}", rec.y_at(0, output)))
                .at(place)
                .count(rec.N())
                .measured(found.levels as f64, 2.0)
                .remedy("make larger steps of the input, or read the output more finely"),
        );
    }
    let share = found.step / found.amplitude;
    (share > limits.M04).then(|| {
        let text = format!(
            "`{name}` takes {} values, {} apart, over a response of {}: it is read too coarsely",
            found.levels,
            rounded(found.step),
            rounded(found.amplitude)
        );
        Note::warning("M04", text)
            .at(place)
            .count(found.levels)
            .measured(share, limits.M04)
            .remedy("make larger steps of the input, or read the output more finely")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(quantum: f64) -> (usize, Option<(&'static str, f64)>) {
        let u: Vec<f64> = (0..500).map(|k| f64::from(k / 50 % 2)).collect();
        let mut x = 0.0;
        let y: Vec<f64> = u
            .iter()
            .map(|u| {
                x += (u - x) / 10.0;
                (x / quantum).round() * quantum + 7.0
            })
            .collect();
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let note = quantised_note(&rec, 0, &Limits::default());
        (resolution(&rec, 0).levels, note.map(|n| (n.severity.as_str(), n.measured.unwrap_or(0.0))))
    }

    #[test]
    fn few_values_are_doubted_and_one_is_refused() {
        assert_eq!(of(0.1), (11, None));
        assert_eq!(of(0.2), (6, None));
        assert_eq!(of(0.5), (3, Some(("warning", 0.5))));
        assert_eq!(of(3.0), (1, Some(("error", 1.0))));
    }

    #[test]
    fn an_outlier_does_not_hide_the_steps() {
        let u: Vec<f64> = (0..500).map(|k| f64::from(k / 50 % 2)).collect();
        let mut y = u.clone();
        y[77] = 900.0;
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        assert!(quantised_note(&rec, 0, &Limits::default()).is_some());
    }
}
