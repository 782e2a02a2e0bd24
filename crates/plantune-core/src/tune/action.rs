//! Whether a plant answers in the direction for which its loop is set up (X12).
//!
//! A controller that acts in reverse lowers its output when the measurement rises: right where `K > 0`. One that acts
//! directly raises it: right where `K < 0`. With the other sign feedback is positive, and no settings make it safe.

use crate::error::{Error, Result};
use crate::note::{Place, rounded};

/// How the controller of a loop acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Its output rises with the measurement.
    Direct,
    /// Its output falls as the measurement rises.
    Reverse,
}

impl Action {
    /// From its word.
    pub fn read(word: &str) -> Result<Self> {
        match word {
            "direct" => Ok(Action::Direct),
            "reverse" => Ok(Action::Reverse),
            _ => Err(Error::argument("action", format!("{word:?}"), "\"direct\" or \"reverse\"")),
        }
    }

    /// Sign of the process gain that it serves.
    fn sign(self) -> f64 {
        if self == Action::Direct { -1.0 } else { 1.0 }
    }

    /// Refuses a process gain of the other sign.
    pub fn check(self, K: f64) -> Result<()> {
        if K * self.sign() > 0.0 {
            return Ok(());
        }
        let (word, needs) =
            if self == Action::Direct { ("direct", "negative") } else { ("reverse", "positive") };
        let text = format!(
            "the loop acts in {word}, for which the process gain must be {needs}; it is K = {}",
            rounded(K)
        );
        Err(Error::new("X12", text).at(Place::column("K")).measured(K, 0.0).remedy(
            "look which signal is turned around before anything is tuned, or declare the other action",
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_action_serves_one_sign() {
        for (word, K, fine) in [("direct", -2.0, true), ("direct", 2.0, false), ("reverse", 2.0, true)] {
            assert_eq!(Action::read(word).expect("a word").check(K).is_ok(), fine, "{word} {K}");
        }
        assert_eq!(Action::Reverse.check(-2.0).expect_err("turned").code(), "X12");
        assert_eq!(Action::read("left").expect_err("no action").code(), "U01");
    }
}
