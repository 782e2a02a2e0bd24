//! Cumulative sums that wait for a change of the mean.
//!
//! ```text
//! g+ <- max(0, g+ + z - 0.75),   g- <- max(0, g- - z - 0.75),   alarm where one exceeds 8
//! ```
//!
//! `z` is an error in its standard deviations, cut at 6: a single outlier takes a sum to 5.25 and raises no alarm,
//! a step that stays does so at its second sample. The change began where the sum last left zero, or at a sample
//! that alone says more than all before it. Page 1954; METHODS 1.4.

use super::greater;

/// Standard deviations at which an error is cut.
pub const CLIP: f64 = 6.0;

/// What a sample may deviate without adding to a sum.
const DRIFT: f64 = 0.75;

/// The sum that raises the alarm.
const ALARM: f64 = 8.0;

/// What a sample adds at least to be a beginning of its own.
const BEGINNING: f64 = 4.0;

/// A sum that is never below zero, and how many samples ago it began.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sum {
    /// The sum.
    pub value: f64,
    /// Samples since it began, the last one included; a number like the others of a state.
    pub samples: f64,
}

impl Sum {
    /// Adds what a sample says.
    #[inline(always)]
    pub fn add(&mut self, x: f64) {
        let begins = (self.value == 0.0) | (x > greater(BEGINNING, self.value));
        self.value = greater(self.value + x, 0.0);
        self.samples = if begins { 1.0 } else { self.samples + 1.0 };
    }

    /// Walks over every number of the state.
    pub(super) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        visit(&mut self.value);
        visit(&mut self.samples);
    }
}

/// Sums either way.
///
/// ```
/// use plantune_core::recursive::Cusum;
///
/// let mut cusum = Cusum::default();
/// let outlier = [9.0, 0.1, -0.3, 0.2, -0.1, 0.4, -0.2, -0.6, 0.0];
/// assert!(outlier.iter().all(|z| cusum.step(*z).is_none()));
/// assert_eq!([9.0, 8.0].map(|z| cusum.step(z)), [None, Some(2.0)]); // a step
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cusum {
    up: Sum,
    down: Sum,
}

impl Cusum {
    /// Whether an error of this square raises no alarm, whatever its sign and the rounding. Needs no root, and is
    /// true of nearly all.
    #[inline(always)]
    pub(super) fn bears(&self, z2: f64) -> bool {
        let most = ALARM + DRIFT - 1e-9 - greater(self.up.value, self.down.value);
        z2 < most * most
    }

    /// Takes an error in its standard deviations; on alarm, how many samples ago the change began, this one
    /// included, and both sums begin again.
    #[inline(always)]
    pub fn step(&mut self, z: f64) -> Option<f64> {
        let z = z.clamp(-CLIP, CLIP);
        self.up.add(z - DRIFT);
        self.down.add(-z - DRIFT);
        if greater(self.up.value, self.down.value) <= ALARM {
            return None;
        }
        let samples = if self.up.value > ALARM { self.up.samples } else { self.down.samples };
        *self = Cusum::default();
        Some(samples)
    }

    /// Walks over every number of the state.
    pub(super) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        self.up.numbers(visit);
        self.down.numbers(visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    #[test]
    fn what_it_bears_raises_no_alarm() {
        let (mut cusum, mut borne, mut alarms) = (Cusum::default(), 0, 0);
        for z in white(100_000, 6).iter().map(|e| 1.5 * e) {
            let bears = cusum.bears(z * z);
            let alarm = cusum.step(z).is_some();
            assert!(!(bears && alarm), "{z}");
            borne += usize::from(bears);
            alarms += usize::from(alarm);
        }
        assert!(borne > 97_000 && alarms > 100 && borne + alarms < 100_000, "{borne} {alarms}");
    }
}
