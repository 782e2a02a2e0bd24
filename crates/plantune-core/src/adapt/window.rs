//! Sums over a moving window that lose no digits.
//!
//! Adding the new value and taking the old one off leaves the rounding of the largest value ever seen in the
//! sum. Here nothing is ever taken off: the window is the younger part of a full block, kept as sums from each
//! place to its end, and the elder part of the block that is being filled, kept as one running sum.

/// Sums of several signals, each over its last `W` values.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowSums {
    signals: usize,
    W: usize,
    /// Values of the block being filled up to `filled`, behind it the sums to the end of the block before.
    block: Vec<f64>, // (W, signals) row-major
    filled: usize,
    running: Vec<f64>, // (signals)
}

impl WindowSums {
    /// Of so many signals, over `W` samples, at least 1; the window begins full of zeros.
    pub fn new(signals: usize, W: usize) -> Self {
        WindowSums { signals, W, block: vec![0.0; W * signals], filled: 0, running: vec![0.0; signals] }
    }

    /// Begins the next sample; its values follow by [`WindowSums::add`].
    pub fn advance(&mut self) {
        if self.filled == self.W {
            let n = self.signals;
            for k in (n..self.block.len()).rev() {
                self.block[k - n] += self.block[k];
            }
            self.running.fill(0.0);
            self.filled = 0;
        }
        self.filled += 1;
    }

    /// Sets the value of a signal at this sample, once, and returns its sum over the window.
    pub fn add(&mut self, signal: usize, x: f64) -> f64 {
        let older = self.filled * self.signals + signal;
        self.block[older - self.signals] = x;
        self.running[signal] += x;
        self.running[signal] + self.block.get(older).copied().unwrap_or(0.0)
    }

    /// Full of zeros again.
    pub fn clear(&mut self) {
        self.block.fill(0.0);
        self.running.fill(0.0);
        self.filled = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    #[test]
    fn sums_are_those_of_the_last_values() {
        for W in [1, 2, 5, 8] {
            let x = white(60, 3);
            let mut sums = WindowSums::new(2, W);
            for k in 0..x.len() {
                sums.advance();
                let first = sums.add(0, x[k]);
                assert_eq!(sums.add(1, 1.0), (k + 1).min(W) as f64);
                let direct: f64 = x[(k + 1).saturating_sub(W)..=k].iter().sum();
                assert!((first - direct).abs() < 1e-13, "{W} {k}");
            }
        }
    }

    #[test]
    fn a_large_value_leaves_nothing_behind() {
        let mut sums = WindowSums::new(1, 4);
        for x in [1.0, 1e20, 1.0, 1.0, 1.0] {
            sums.advance();
            sums.add(0, x);
        }
        sums.advance();
        assert_eq!(sums.add(0, 1e-9), 3.0 + 1e-9);
    }
}
