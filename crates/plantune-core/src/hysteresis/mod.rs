//! Hysteresis: models as values, the operators that run them sample by sample, and their inverses.
//!
//! A model holds parameters; [`Model::start`] gives the operator in its virgin state. `run` is `step` in a loop.

mod cycles;
mod play;
mod series_slip;
mod slip_identify;
mod slip_learner;

pub use cycles::{Cycles, Repeatability, cycles, repeatability};
pub use play::PlayStack;
pub use series_slip::{Element, SeriesSlip};
pub use slip_identify::{LearntSlip, identify_slip};
pub use slip_learner::{SlipLearner, SlipSettings};

use crate::error::{Error, Result};

/// What remembers: one sample in, one out.
pub trait Operator: Send + Sync {
    /// Output at the input `x`.
    fn step(&mut self, x: f64) -> f64;

    /// Outputs over a record: `step` in a loop, or the same to the last bit.
    fn run(&mut self, x: &[f64]) -> Vec<f64> {
        x.iter().map(|&x| self.step(x)).collect()
    }

    /// All that it remembers.
    fn state(&self) -> Vec<f64>;

    /// Goes on from there.
    fn resume(&mut self, state: &[f64]) -> Result<()>;
}

/// A model of one input and one output.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// Weighted plays.
    PlayStack(PlayStack),
    /// Elements in series, one group per direction.
    SeriesSlip(SeriesSlip),
}

impl Model {
    /// Refuses parameters that are none.
    pub fn check(&self) -> Result<()> {
        match self {
            Model::PlayStack(m) => m.check(),
            Model::SeriesSlip(m) => m.check(),
        }
    }

    /// The operator in its virgin state.
    pub fn start(&self) -> Result<Box<dyn Operator>> {
        self.check()?;
        Ok(match self {
            Model::PlayStack(m) => Box::new(m.start()),
            Model::SeriesSlip(m) => Box::new(m.start()),
        })
    }

    /// Output over a record, from the virgin state.
    pub fn simulate(&self, x: &[f64]) -> Result<Vec<f64>> {
        Ok(self.start()?.run(x))
    }

    /// The model whose output is this one's input.
    pub fn inverse(&self) -> Result<Model> {
        self.check()?;
        match self {
            Model::PlayStack(m) => Ok(Model::PlayStack(m.inverse()?)),
            Model::SeriesSlip(m) => Ok(Model::SeriesSlip(m.inverse()?)),
        }
    }
}

/// Copies a remembered state of the right length.
fn copy_state(own: &mut [f64], state: &[f64]) -> Result<()> {
    if own.len() != state.len() {
        return Err(Error::argument("state", format!("{} numbers", state.len()), &format!("{}", own.len())));
    }
    own.copy_from_slice(state);
    Ok(())
}
