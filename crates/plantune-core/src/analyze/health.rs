//! What is wrong with a record before any model: outputs that stand still, spikes, sentinels (D18, D19),
//! inputs at a limit (M03), outputs read too coarsely (M04), outputs compressed by a historian (D15).

use super::compression::compression_note;
use super::quantised::quantised_note;
use super::saturated::{Saturated, guessed_ends, saturated, saturated_note};
use super::sentinels::{Sentinel, sentinels, sentinels_note};
use super::spikes::{Spike, spikes, spikes_notes};
use super::stuck::{Stretch, stuck, stuck_note};
use crate::limits::Limits;
use crate::note::Note;
use crate::record::Record;

/// What was found; a note of severity error means that the record must not be fitted.
#[derive(Clone, Debug)]
pub struct Health {
    /// Stretches on which an output stands still while an input moves.
    pub stuck: Vec<Stretch>,
    /// Single samples of outputs far off both neighbours.
    pub spikes: Vec<Spike>,
    /// Numbers that stand for a missing value.
    pub sentinels: Vec<Sentinel>,
    /// Stretches on which an input seems to lie at a limit of its actuator.
    pub saturated: Vec<Saturated>,
    /// The same in words.
    pub notes: Vec<Note>,
}

/// Looks at every signal of a record.
pub fn health(rec: &Record, limits: &Limits) -> Health {
    let sentinels = sentinels(rec);
    let coded = |s: &Spike| {
        let y = rec.y_at(s.row, s.output);
        sentinels.iter().any(|code| code.column == rec.nu + s.output && code.value == y)
    };
    let spikes: Vec<Spike> = spikes(rec, limits).into_iter().filter(|s| !coded(s)).collect();
    let stuck = stuck(rec, limits);
    let is_stuck = |i: usize| stuck.iter().any(|s| s.output == i);
    let saturated = saturated(rec, &guessed_ends(rec, limits));
    let notes = sentinels
        .iter()
        .map(|s| sentinels_note(rec, s))
        .chain((0..rec.ny).flat_map(|i| stuck_note(rec, i, &stuck, limits)))
        .chain(spikes_notes(rec, &spikes, limits))
        .chain((0..rec.nu).filter_map(|i| saturated_note(rec, i, &saturated, limits)))
        .chain((0..rec.ny).filter(|&i| !is_stuck(i)).filter_map(|i| quantised_note(rec, i, limits)))
        .chain((0..rec.ny).filter(|&i| !is_stuck(i)).filter_map(|i| compression_note(rec, i, true)))
        .collect();
    Health { stuck, spikes, sentinels, saturated, notes }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentinel_is_not_called_a_spike_as_well() {
        let u: Vec<f64> = (0..200).map(|k| f64::from(k / 7 % 2)).collect();
        let mut y: Vec<f64> = (0..200).map(|k| (0.3 * f64::from(k)).sin()).collect();
        (y[50], y[90]) = (-9999.0, 40.0);
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let found = health(&rec, &Limits::default());
        let rows: Vec<usize> = found.spikes.iter().map(|s| s.row).collect();
        assert_eq!((rows, found.sentinels.len(), found.notes.len()), (vec![90], 1, 2));
    }
}
