//! Alarms on prediction errors: a level that jumped, or a plant that is another one.
//!
//! ```text
//! level    the mean of z: cumulative sums either way ([`crate::recursive::Cusum`])
//! size     its variance:  h <- max(0, h + min(z^2, 25) - 3),  alarm at 40
//! ```
//!
//! A plant of another gain under an input about its mean makes the errors larger without a level.

use crate::recursive::{Cusum, Sum};

/// What `z^2` is cut at.
const MOST: f64 = 25.0;

/// What `z^2` may be without adding to the sum.
const DRIFT: f64 = 3.0;

/// The sum that raises the alarm.
const ALARM: f64 = 40.0;

/// Cumulative sums of one signal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alarm {
    level: Cusum,
    size: Sum,
}

impl Alarm {
    /// Takes an error in its standard deviations; on alarm the samples since the change began, this one included,
    /// and all begins again.
    pub fn step(&mut self, z: f64) -> Option<usize> {
        self.size.add((z * z).min(MOST) - DRIFT);
        let level = self.level.step(z);
        let size = (self.size.value > ALARM).then_some(self.size.samples);
        let ago = level.or(size)?;
        self.reset();
        Some(ago as usize)
    }

    /// Begins again.
    pub fn reset(&mut self) {
        *self = Alarm::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn alarms(z: &[f64]) -> Vec<(usize, usize)> {
        let mut alarm = Alarm::default();
        z.iter().enumerate().filter_map(|(k, z)| alarm.step(*z).map(|ago| (k, ago))).collect()
    }

    #[test]
    fn a_level_is_seen_at_its_second_sample_and_dated() {
        let mut z = white(400, 2);
        z[200..].iter_mut().for_each(|z| *z += 20.0);
        assert_eq!(alarms(&z)[0], (201, 2));
    }

    #[test]
    fn errors_of_both_signs_are_seen_by_their_size() {
        let z: Vec<f64> = (0..60).map(|k| if k < 40 { 0.3 } else { [4.0, -4.0][k % 2] }).collect();
        let first = alarms(&z)[0];
        assert!((43..46).contains(&first.0) && first.0 + 1 - first.1 == 40, "{first:?}");
    }

    #[test]
    fn noise_alone_is_seldom_an_alarm() {
        let count = alarms(&white(1_000_000, 5)).len();
        assert!((2..80).contains(&count), "{count}");
    }
}
