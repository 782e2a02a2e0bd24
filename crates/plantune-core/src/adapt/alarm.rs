//! Alarms on prediction errors: a level that jumped, or a plant that is another one.
//!
//! ```text
//! level    g+ <- max(0, g+ + z - 0.75),  g- <- max(0, g- - z - 0.75),  alarm at 8
//! size     h  <- max(0, h + min(z^2, 25) - 3),                        alarm at 40
//! ```
//!
//! `z` is the error in its standard deviations, cut at 6, so that one outlier is no alarm. The change began where the
//! sum last left zero, or at a sample that alone says more than all before it. Page 1954; METHODS 1.4.

/// What `z` is cut at.
const MOST: f64 = 6.0;

const DRIFT: f64 = 0.75;
const LEVEL: f64 = 8.0;

/// What a sample adds at least to be a beginning of its own.
const STEP: f64 = 4.0;

const SIZE_DRIFT: f64 = 3.0;
const SIZE: f64 = 40.0;

/// Cumulative sums of one signal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alarm {
    up: Sum,
    down: Sum,
    size: Sum,
}

/// A sum that starts anew at zero, and for how many samples it has been above.
#[derive(Clone, Debug, Default, PartialEq)]
struct Sum {
    value: f64,
    samples: usize,
}

impl Sum {
    fn add(&mut self, x: f64) {
        let begins = self.value == 0.0 || x > STEP.max(self.value);
        self.value = (self.value + x).max(0.0);
        self.samples = if begins { 1 } else { self.samples + 1 };
    }
}

impl Alarm {
    /// Takes an error; on alarm the samples since the change began, this one included, and all begins anew.
    pub fn step(&mut self, z: f64) -> Option<usize> {
        let z = z.clamp(-MOST, MOST);
        self.up.add(z - DRIFT);
        self.down.add(-z - DRIFT);
        self.size.add((z * z).min(25.0) - SIZE_DRIFT);
        let sums = [(&self.up, LEVEL), (&self.down, LEVEL), (&self.size, SIZE)];
        let ago = sums.iter().filter(|(sum, limit)| sum.value > *limit).map(|(sum, _)| sum.samples).min();
        if ago.is_some() {
            self.reset();
        }
        ago
    }

    /// Begins anew.
    pub fn reset(&mut self) {
        *self = Alarm::default();
    }
}
