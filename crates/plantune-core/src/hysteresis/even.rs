//! Butterfly loops: plays on the input beside plays on its magnitude.
//!
//! ```text
//! y = O + sum w_i play(x; r_i) + sum v_j play(|x|; s_j)        w, v of either sign
//! ```
//!
//! A branch of such a loop falls and rises, so that two inputs give one output, and no inverse exists.

use super::Operator;
use super::play::PlayStack;
use super::plays::Plays;
use crate::error::{Error, Result};

/// Plays on both.
#[derive(Clone, Debug, PartialEq)]
pub struct EvenStack {
    /// On x, with the offset.
    pub plays: PlayStack,
    /// On |x|, without one.
    pub even: PlayStack,
}

impl EvenStack {
    pub(super) fn check(&self) -> Result<()> {
        self.plays.check()?;
        self.even.check()
    }

    pub(super) fn start(&self) -> Butterfly {
        Butterfly { plays: self.plays.start(), even: self.even.start() }
    }

    /// Why there is none.
    pub(super) fn inverse(&self) -> Error {
        Error::argument(
            "model",
            "plays on x and on |x|",
            "monotone to have an inverse: on a butterfly loop two inputs give one output. `PlayStack.identify` \
             without `even` over the part of the range that is used",
        )
    }
}

/// Both at work.
pub(super) struct Butterfly {
    plays: Plays,
    even: Plays,
}

impl Operator for Butterfly {
    fn step(&mut self, x: f64) -> f64 {
        self.plays.step(x) + self.even.step(x.abs())
    }

    fn run(&mut self, x: &[f64]) -> Vec<f64> {
        let magnitude: Vec<f64> = x.iter().map(|x| x.abs()).collect();
        let even = self.even.run(&magnitude);
        self.plays.run(x).iter().zip(even).map(|(y, even)| y + even).collect()
    }

    fn state(&self) -> Vec<f64> {
        [self.plays.state(), self.even.state()].concat()
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        let n = self.plays.state().len();
        let needed = n + self.even.state().len();
        if state.len() != needed {
            return Err(Error::argument("state", format!("{} numbers", state.len()), &format!("{needed}")));
        }
        self.plays.resume(&state[..n])?;
        self.even.resume(&state[n..])
    }
}
