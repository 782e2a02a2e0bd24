//! Whether an estimate is taken: within its limits, settled over a moving window, then its mean.
//!
//! ```text
//! low <= K, T, L <= high                    else the estimate is dropped, and the window begins anew
//! sd over the last W of each  <= spread     else it is dropped, and stays in the window
//! mean over the last W of each              is what is taken
//! ```
//!
//! `sd` divides by `W - 1`. Beginning anew is this side of the source: a window with a hole would call settled
//! what was settled before the hole. Source 001, 3.7.4 e and figure 3.7-5.

use super::reason::{Cause, Parameter, Reason};
use crate::error::{Error, Result};
use crate::model::Fopdt;

/// In the order of K, T, L.
const NAMES: [Parameter; 3] = [Parameter::K, Parameter::T, Parameter::L];

/// What an estimate is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Class {
    /// Taken: the mean over the window, and the standard deviations of K, T, L over it.
    Accepted(Fopdt, [f64; 3]),
    /// A parameter is beyond its limits, or no number.
    OutOfLimits(Reason),
    /// The window is not full yet.
    Filling(Reason),
    /// A parameter still moves: the one that is most beyond its limit.
    Unsettled(Reason),
}

impl Class {
    /// Why it is not taken.
    pub fn reason(&self) -> Option<Reason> {
        match *self {
            Class::Accepted(..) => None,
            Class::OutOfLimits(reason) | Class::Filling(reason) | Class::Unsettled(reason) => Some(reason),
        }
    }
}

/// The moving window of estimates.
///
/// ```
/// use plantune_core::adapt::{Class, Classifier};
/// use plantune_core::model::Fopdt;
///
/// let (low, high) = (Fopdt { K: -60.0, T: 0.01, L: 0.0 }, Fopdt { K: -0.6, T: 1.5, L: 0.5 });
/// let mut classifier = Classifier::new(low, high, [0.1, 0.01, 0.01], 2)?;
/// let estimate = Fopdt { K: -5.9, T: 0.15, L: 0.1 };
/// assert_eq!(classifier.step(&estimate).reason().expect("not full").code(), "A01");
/// assert_eq!(classifier.step(&estimate), Class::Accepted(estimate, [0.0; 3]));
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Classifier {
    low: [f64; 3],
    high: [f64; 3],
    spread: [f64; 3],
    window: Vec<[f64; 3]>, // the last W estimates, the oldest at `oldest`
    oldest: usize,
    filled: usize,
}

impl Classifier {
    /// Limits of K, T, L, the largest standard deviation of each, and the samples of the window, at least 2.
    pub fn new(low: Fopdt, high: Fopdt, spread: [f64; 3], W: usize) -> Result<Self> {
        let (low, high) = (vector(&low), vector(&high));
        for i in 0..3 {
            if !(low[i] < high[i]) {
                let needed = format!("below its upper limit, {}", high[i]);
                return Err(Error::argument("low", format!("{} for {}", low[i], NAMES[i]), &needed));
            }
            if !(spread[i] > 0.0) {
                return Err(Error::argument("spread", format!("{} for {}", spread[i], NAMES[i]), "positive"));
            }
        }
        if W < 2 {
            return Err(Error::argument("W", W, "at least 2 samples"));
        }
        Ok(Classifier { low, high, spread, window: vec![[0.0; 3]; W], oldest: 0, filled: 0 })
    }

    /// Takes an estimate and says what it is. Allocates nothing.
    pub fn step(&mut self, estimate: &Fopdt) -> Class {
        let x = vector(estimate);
        if let Some(reason) = self.out_of_limits(&x) {
            self.reset();
            return Class::OutOfLimits(reason);
        }
        let W = self.window.len();
        self.window[self.oldest] = x;
        self.oldest = (self.oldest + 1) % W;
        self.filled = W.min(self.filled + 1);
        if self.filled < W {
            return Class::Filling(Reason::new(Cause::WindowNotFull, self.filled as f64, W as f64));
        }
        let (mean, sd) = self.moments();
        match self.unsettled(&sd) {
            Some(reason) => Class::Unsettled(reason),
            None => Class::Accepted(Fopdt { K: mean[0], T: mean[1], L: mean[2] }, sd),
        }
    }

    /// Empties the window, as at a new operating point.
    pub fn reset(&mut self) {
        (self.oldest, self.filled) = (0, 0);
    }

    fn out_of_limits(&self, x: &[f64; 3]) -> Option<Reason> {
        let i = (0..3).find(|&i| !(self.low[i] <= x[i] && x[i] <= self.high[i]))?;
        let limit = if x[i] < self.low[i] { self.low[i] } else { self.high[i] };
        Some(Reason::new(Cause::OutOfLimits(NAMES[i]), x[i], limit))
    }

    fn unsettled(&self, sd: &[f64; 3]) -> Option<Reason> {
        let beyond = |i: usize| sd[i] / self.spread[i];
        let worst = (0..3).max_by(|&i, &k| beyond(i).total_cmp(&beyond(k)))?;
        let reason = || Reason::new(Cause::Unsettled(NAMES[worst]), sd[worst], self.spread[worst]);
        (!(beyond(worst) <= 1.0)).then(reason)
    }

    /// Mean and standard deviation over the window, about its first value so that no digits are lost.
    fn moments(&self) -> ([f64; 3], [f64; 3]) {
        let (W, about) = (self.window.len() as f64, self.window[0]);
        let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
        for x in &self.window {
            for i in 0..3 {
                let d = x[i] - about[i];
                sum[i] += d;
                squares[i] += d * d;
            }
        }
        let mean = [0, 1, 2].map(|i| about[i] + sum[i] / W);
        let sd = [0, 1, 2].map(|i| ((squares[i] - sum[i] * sum[i] / W).max(0.0) / (W - 1.0)).sqrt());
        (mean, sd)
    }
}

fn vector(model: &Fopdt) -> [f64; 3] {
    [model.K, model.T, model.L]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    const LOW: Fopdt = Fopdt { K: -60.0, T: 0.01, L: 0.0 };
    const HIGH: Fopdt = Fopdt { K: -0.6, T: 1.5, L: 0.5 };

    fn of(x: f64) -> Fopdt {
        Fopdt { K: -6.0 + x, T: 0.15 + 0.01 * x, L: 0.1 + 0.01 * x }
    }

    #[test]
    fn moments_are_those_of_the_last_estimates() {
        let mut classifier = Classifier::new(LOW, HIGH, [1e3; 3], 10).expect("sound");
        let x = white(35, 4);
        for (k, &now) in x.iter().enumerate() {
            let class = classifier.step(&of(0.3 * now));
            if k < 9 {
                assert!(
                    matches!(class, Class::Filling(r) if r.measured == (k + 1) as f64 && r.limit == 10.0)
                );
                continue;
            }
            let last: Vec<f64> = x[k - 9..=k].iter().map(|x| 0.3 * x).collect();
            let mean = last.iter().sum::<f64>() / 10.0;
            let sd = (last.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 9.0).sqrt();
            let Class::Accepted(model, sds) = class else { unreachable!("{class:?}") };
            assert!((model.K - of(mean).K).abs() < 1e-13 && (model.L - of(mean).L).abs() < 1e-14);
            assert!((sds[0] - sd).abs() < 1e-12 && (sds[1] - 0.01 * sd).abs() < 1e-13);
        }
    }

    #[test]
    fn an_estimate_beyond_its_limits_is_dropped_and_the_window_begins_anew() {
        let mut classifier = Classifier::new(LOW, HIGH, [1.0; 3], 3).expect("sound");
        let good = of(0.0);
        (0..3).for_each(|_| {
            classifier.step(&good);
        });
        assert!(matches!(classifier.step(&good), Class::Accepted(..)));
        for (bad, parameter, limit) in [
            (Fopdt { K: -61.0, ..good }, Parameter::K, -60.0),
            (Fopdt { T: 1.6, ..good }, Parameter::T, 1.5),
            (Fopdt { L: -0.1, ..good }, Parameter::L, 0.0),
            (Fopdt { K: f64::NAN, ..good }, Parameter::K, -0.6),
        ] {
            let Class::OutOfLimits(reason) = classifier.step(&bad) else { unreachable!("{bad:?}") };
            assert_eq!((reason.cause, reason.limit), (Cause::OutOfLimits(parameter), limit));
            assert!(matches!(classifier.step(&good), Class::Filling(r) if r.measured == 1.0));
        }
    }

    #[test]
    fn what_moves_most_beyond_its_limit_is_named() {
        let mut classifier = Classifier::new(LOW, HIGH, [0.5, 0.001, 0.1], 2).expect("sound");
        classifier.step(&of(0.0));
        let Class::Unsettled(reason) = classifier.step(&of(1.0)) else { unreachable!("accepted") };
        assert_eq!(reason.cause, Cause::Unsettled(Parameter::T));
        assert!((reason.measured - 0.01 / 2f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn what_is_no_window_is_refused() {
        for (low, high, spread, W) in
            [(HIGH, LOW, [1.0; 3], 5), (LOW, HIGH, [0.0; 3], 5), (LOW, HIGH, [1.0; 3], 1)]
        {
            assert_eq!(Classifier::new(low, high, spread, W).expect_err("refused").code(), "U01");
        }
    }
}
