//! Whether the input moves enough to learn from.
//!
//! ```text
//! open:  var(u over the window) >= level^2                     a level given, or
//!        var(u over the window) >= 1e-4 of the largest seen    one hundredth of its amplitude
//! ```
//!
//! With forgetting, samples that say nothing about the input's effect do harm: the covariance winds up, and noise
//! on the output draws the poles to zero, bounds or not. While the input rests, an estimator keeps what it
//! has. What counts as motion is compared with what has been seen, so that units do not matter; the ripple that
//! feedback makes of noise is not motion. METHODS 1.3: a bounded covariance alone lets the parameters drift.
//!
//! The window is the half that is being filled and the full one before it, each centred on its first value, so that
//! a constant has the variance zero whatever its level, for ever, and nothing is subtracted again.

use crate::error::{Error, Result};

/// Share of the largest variance seen that counts as motion.
const MOTION: f64 = 1e-4;

/// Travel of an input, relative to its magnitude, that is ripple of its last digits (X01).
const RIPPLE: f64 = 1e-8;

/// The variance of an input over a window, and what it is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate {
    half: f64,    // samples
    level2: f64,  // variance given; 0: relative
    begun: bool,  // a first value was seen
    zero: f64,    // first value of the half being filled
    count: f64,   // its samples
    sum: f64,     // of u - zero
    squares: f64, // of its square
    before: f64,  // variance of the half before
    largest: f64, // variance seen
}

impl Gate {
    /// Over `window` samples; open above this standard deviation, or above the share of the largest seen.
    pub fn new(window: usize, level: Option<f64>) -> Result<Self> {
        if window < 2 {
            return Err(Error::argument("window", window, "at least 2 samples"));
        }
        if level.is_some_and(|level| !(level > 0.0 && level < 1e150)) {
            return Err(Error::argument("gate", level.unwrap_or(0.0), "a positive standard deviation of u"));
        }
        let half = window.div_ceil(2) as f64;
        let level2 = level.unwrap_or(0.0).powi(2);
        Ok(Gate {
            half,
            level2,
            begun: false,
            zero: 0.0,
            count: 0.0,
            sum: 0.0,
            squares: 0.0,
            before: 0.0,
            largest: 0.0,
        })
    }

    /// Takes in a value; whether there is motion.
    #[inline]
    pub fn look(&mut self, u: f64) -> bool {
        if self.count == 0.0 {
            self.zero = u;
        }
        if !self.begun {
            self.begun = true;
            self.largest = (RIPPLE * u).powi(2) / MOTION;
        }
        let x = u - self.zero;
        self.count += 1.0;
        self.sum += x;
        self.squares += x * x;
        let now = (self.squares * self.count - self.sum * self.sum) / (self.count * self.count);
        self.largest = self.largest.max(now);
        let most = now.max(self.before);
        if self.count == self.half {
            self.before = now.max(0.0);
            (self.count, self.sum, self.squares) = (0.0, 0.0, 0.0);
        }
        if self.level2 > 0.0 { most >= self.level2 } else { most > 0.0 && most >= MOTION * self.largest }
    }

    /// Begins again after a gap; what has been seen remains the measure.
    pub fn restart(&mut self) {
        (self.count, self.sum, self.squares, self.before) = (0.0, 0.0, 0.0, 0.0);
    }

    /// Walks over every number of the state.
    pub(super) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        let mut begun = f64::from(u8::from(self.begun));
        visit(&mut begun);
        self.begun = begun != 0.0;
        let Gate { zero, count, sum, squares, before, largest, .. } = self;
        [zero, count, sum, squares, before, largest].into_iter().for_each(visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn open(gate: &mut Gate, u: impl IntoIterator<Item = f64>) -> Vec<bool> {
        u.into_iter().map(|u| gate.look(u)).collect()
    }

    #[test]
    fn it_opens_with_a_step_and_closes_when_the_window_has_passed_it() {
        for scale in [1e-9, 1.0, 1e9] {
            let mut gate = Gate::new(20, None).expect("in range");
            assert!(!open(&mut gate, [5.0 * scale; 47]).contains(&true));
            let after = open(&mut gate, [6.0 * scale; 100]);
            let closed = after.iter().position(|open| !open).expect("it closes");
            assert!(after[0] && (10..=20).contains(&closed) && !after[closed..].contains(&true));
        }
    }

    #[test]
    fn ripple_of_the_last_digits_and_of_fed_back_noise_is_no_motion() {
        let ripple = white(400, 1).into_iter().map(|e| 100.0 + 1e-7 * e);
        assert!(!open(&mut Gate::new(20, None).expect("in range"), ripple).contains(&true));
        let mut gate = Gate::new(20, None).expect("in range");
        let test = (0..200).map(|k| if k / 7 % 2 == 0 { 1.0 } else { -1.0 });
        assert!(open(&mut gate, test)[1..].iter().filter(|open| !**open).count() < 10);
        let after = open(&mut gate, white(200, 2).into_iter().map(|e| 1.0 + 0.003 * e));
        assert!(!after[20..].contains(&true));
    }

    #[test]
    fn a_level_is_a_standard_deviation() {
        let mut gate = Gate::new(20, Some(0.9)).expect("in range");
        let square = |size: f64| (0..60).map(move |k| if k % 2 == 0 { size } else { -size });
        assert!(open(&mut gate, square(1.0))[20..].iter().all(|open| *open));
        assert!(!open(&mut gate, square(0.8))[20..].contains(&true));
        assert!(Gate::new(1, None).is_err() && Gate::new(9, Some(0.0)).is_err());
    }
}
