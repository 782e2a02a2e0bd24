//! What was found against what the engineer expects: units mixed up cannot be known, but they show (N03).
//!
//! ```text
//! departs = |x| / high  or  low / |x|,   low <= |x| <= high the magnitudes expected
//! ```
//!
//! A column should come near the ends of its own range, so that `low` is `high` there. A valve in parts of one instead
//! of percent departs by 100, minutes for seconds by 60, Pa for bar by 100 000.

use crate::limits::Limits;
use crate::note::{Note, Place, rounded};

/// A name, what was found of it, and the range in which it was expected.
#[derive(Clone, Debug)]
pub struct Expected {
    /// Of a parameter or a column.
    pub name: String,
    /// Value found; of a column its largest magnitude, with its sign.
    pub found: f64,
    /// Lowest value expected.
    pub low: f64,
    /// Highest value expected.
    pub high: f64,
    /// Whether it is a column and the range that of its instrument, most of which a signal uses.
    pub spans: bool,
}

/// N03 of each that lies farther outside than by the factor N03, or has another sign.
pub fn expected(all: &[Expected], limits: &Limits) -> Vec<Note> {
    all.iter().filter_map(|one| note(one, limits)).collect()
}

fn note(Expected { name, found, low, high, spans }: &Expected, limits: &Limits) -> Option<Note> {
    let (least, most) = magnitudes(*low, *high);
    let least = if *spans { most } else { least };
    let factor = (found.abs() / most).max(least / found.abs());
    let turned = !spans && low * high > 0.0 && found * low < 0.0;
    let range = format!("{} to {}", rounded(*low), rounded(*high));
    if factor > limits.N03 {
        let text = format!(
            "{name} is {}, expected {range}: off by a factor of {}; are the units the same?",
            rounded(*found),
            rounded(factor)
        );
        return Some(warning(text, name).measured(factor, limits.N03).remedy(
            "compare the units of the columns and of time with those of the loop: 0-1 and percent, minutes and seconds",
        ));
    }
    turned.then(|| {
        let text = format!("{name} is {}, expected {range}: it has another sign", rounded(*found));
        warning(text, name).remedy("look for a signal that is turned around, or an action set the other way")
    })
}

fn warning(text: String, name: &str) -> Note {
    Note::warning("N03", text).at(Place::column(name))
}

/// Smallest and largest magnitude of a range; a range about zero has no smallest.
fn magnitudes(low: f64, high: f64) -> (f64, f64) {
    let (a, b) = (low.abs(), high.abs());
    (if low * high > 0.0 { a.min(b) } else { 0.0 }, a.max(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(found: f64, low: f64, high: f64) -> Option<Option<f64>> {
        let one = Expected { name: "K".into(), found, low, high, spans: false };
        note(&one, &Limits::default()).map(|n| n.measured)
    }

    #[test]
    fn a_valve_in_parts_of_one_is_no_percent() {
        let of = |found| Expected { name: "u".into(), found, low: 0.0, high: 100.0, spans: true };
        let found = |x| note(&of(x), &Limits::default()).and_then(|n| n.measured);
        assert_eq!((found(0.8), found(60.0)), (Some(125.0), None));
    }

    #[test]
    fn units_mixed_up_show() {
        assert_eq!(said(2.0, 1.0, 3.0), None);
        assert_eq!(said(149.0, 1.0, 3.0), None);
        assert_eq!(said(200.0, 1.0, 2.0), Some(Some(100.0)));
        assert_eq!(said(0.01, 1.0, 3.0), Some(Some(100.0)));
        assert_eq!(said(-2.0, 1.0, 3.0), Some(None));
        assert_eq!(said(-2.0, -3.0, 3.0), None);
        assert_eq!(said(1e-9, -3.0, 3.0), None);
    }
}
