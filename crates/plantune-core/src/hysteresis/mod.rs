//! Hysteresis: models as values, the operators that run them sample by sample, and their inverses.
//!
//! A model holds parameters; [`Model::start`] gives the operator in its virgin state. `run` is `step` in a loop.

mod asymmetric;
mod bouc_wen;
mod cmac;
mod creep;
mod cycles;
mod dead_zones;
mod even;
mod feed_forward;
mod maxwell_slip;
mod misfit;
mod play;
mod play_identify;
mod play_learner;
mod play_states;
mod plays;
mod preisach;
mod series_slip;
mod slip_identify;
mod slip_learner;

pub use asymmetric::AsymmetricStack;
pub use bouc_wen::{
    BoucWen, BoucWenFit, BoucWenForce, BoucWenSettings, ForceFit, Hold, identify_bouc_wen, identify_force,
    initial_state, simulate as simulate_bouc_wen,
};
pub use cmac::{Cmac, CmacSettings};
pub use creep::{ChargeLeak, Creep, CreepFit, CreepSettings, identify_creep};
pub use cycles::{Cycles, Repeatability, cycles, repeatability};
pub use dead_zones::DeadZones;
pub use even::EvenStack;
pub use feed_forward::{TrackRun, Tracking, track};
pub use maxwell_slip::{
    LoopDirection, MaxwellFit, MaxwellSettings, MaxwellSlip, identify_maxwell, loop_direction,
};
pub use misfit::Misfit;
pub use play::PlayStack;
pub use play_identify::{Form, PlayFit, PlaySettings, identify_plays};
pub use play_learner::{PlayLearner, PlayLearnerSettings};
pub use preisach::{
    Forc, Preisach, PreisachFit, PreisachSettings, Start, everett_of_mu, forc, identify_preisach,
    mu_of_everett,
};
pub use series_slip::{Element, SeriesSlip};
pub use slip_identify::{LearntSlip, identify_slip};
pub use slip_learner::{SlipLearner, SlipSettings};

use crate::error::{Error, Result};
use crate::linalg::extent;
use asymmetric::Order;

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
    /// Weighted plays seen through a monotone curve.
    Asymmetric(AsymmetricStack),
    /// The same, curve first: what undoes it.
    AsymmetricInverse(AsymmetricStack),
    /// Weighted plays on the input and on its magnitude.
    Even(EvenStack),
    /// Elements in series, one group per direction.
    SeriesSlip(SeriesSlip),
    /// Weighted relays.
    Preisach(Preisach),
    /// What finds the input of weighted relays.
    PreisachInverse(Preisach),
    /// Plays and their creep.
    Creep(Creep),
    /// What finds the input of plays and their creep.
    CreepInverse(Creep),
    /// A charge and its leak.
    ChargeLeak(ChargeLeak),
    /// A mass on a spring, a damper and a force with memory.
    BoucWen(BoucWen),
    /// That force over a displacement.
    BoucWenForce(BoucWenForce),
    /// Springs whose blocks slip.
    MaxwellSlip(MaxwellSlip),
}

impl Model {
    /// Refuses parameters that are none.
    pub fn check(&self) -> Result<()> {
        match self {
            Model::PlayStack(m) => m.check(),
            Model::Asymmetric(m) | Model::AsymmetricInverse(m) => m.check(),
            Model::Even(m) => m.check(),
            Model::SeriesSlip(m) => m.check(),
            Model::Preisach(m) => m.check(),
            Model::PreisachInverse(m) => m.check().and_then(|()| m.check_inverse()),
            Model::Creep(m) => m.check(),
            Model::CreepInverse(m) => m.check().and_then(|()| m.check_inverse()),
            Model::ChargeLeak(m) => m.check(),
            Model::BoucWen(m) => m.check(),
            Model::BoucWenForce(m) => m.check(),
            Model::MaxwellSlip(m) => m.check(),
        }
    }

    /// The operator in its virgin state.
    pub fn start(&self) -> Result<Box<dyn Operator>> {
        self.check()?;
        Ok(match self {
            Model::PlayStack(m) => Box::new(m.start()),
            Model::Asymmetric(m) => Box::new(m.start(Order::PlaysFirst)),
            Model::AsymmetricInverse(m) => Box::new(m.start(Order::CurveFirst)),
            Model::Even(m) => Box::new(m.start()),
            Model::SeriesSlip(m) => Box::new(m.start()),
            Model::Preisach(m) => m.start(),
            Model::PreisachInverse(m) => m.start_inverse()?,
            Model::Creep(m) => m.start(),
            Model::CreepInverse(m) => m.start_inverse()?,
            Model::ChargeLeak(m) => m.start(),
            Model::BoucWen(m) => Box::new(m.start()?),
            Model::BoucWenForce(m) => Box::new(m.start()),
            Model::MaxwellSlip(m) => Box::new(m.plays().start()),
        })
    }

    /// Output over a record, from the virgin state.
    pub fn simulate(&self, x: &[f64]) -> Result<Vec<f64>> {
        Ok(self.start()?.run(x))
    }

    /// Output over a record, from the virgin state, its error in percent of the range of `y`, and the rms of that.
    pub fn against(&self, x: &[f64], y: &[f64]) -> Result<(Vec<f64>, Vec<f64>, f64)> {
        if x.len() != y.len() {
            return Err(Error::argument(
                "y",
                format!("{} rows", y.len()),
                &format!("{} rows, as x", x.len()),
            ));
        }
        let simulated = self.simulate(x)?;
        let (low, high) = extent(y);
        let percent = 100.0 / (high - low).max(f64::MIN_POSITIVE);
        let errors: Vec<f64> = simulated.iter().zip(y).map(|(own, y)| percent * (own - y)).collect();
        let rms = Misfit::of(y, &errors).rms;
        Ok((simulated, errors, rms))
    }

    /// The model whose output is this one's input.
    pub fn inverse(&self) -> Result<Model> {
        self.check()?;
        match self {
            Model::PlayStack(m) => Ok(Model::PlayStack(m.inverse()?)),
            Model::Asymmetric(m) => Ok(Model::AsymmetricInverse(m.inverse()?)),
            Model::AsymmetricInverse(m) => Ok(Model::Asymmetric(m.inverse()?)),
            Model::Even(m) => Err(m.inverse()),
            Model::SeriesSlip(m) => Ok(Model::SeriesSlip(m.inverse()?)),
            Model::Preisach(m) => m.check_inverse().map(|()| Model::PreisachInverse(m.clone())),
            Model::PreisachInverse(m) => Ok(Model::Preisach(m.clone())),
            Model::Creep(m) => m.check_inverse().map(|()| Model::CreepInverse(m.clone())),
            Model::CreepInverse(m) => Ok(Model::Creep(m.clone())),
            Model::ChargeLeak(_) => Err(Error::argument(
                "model",
                "a charge, which no current of the same sample moves",
                "one whose input acts at once; `leak(V)` is the current that holds a charge",
            )),
            Model::MaxwellSlip(m) => Ok(Model::PlayStack(m.inverse()?)),
            Model::BoucWen(_) | Model::BoucWenForce(_) => Err(Error::argument(
                "model",
                "of Bouc and Wen, which has no inverse in closed form",
                "one that has: a PlayStack, or a MaxwellSlip with a spring, of the same loops",
            )),
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
