//! Identification on line, two ways behind one door.
//!
//! [`WindowIdentifier`] fits the last rows by maximum likelihood, every so many samples: the default.
//! [`BankIdentifier`] asks a bank of recursions at every sample, as source 001 does.

mod bank;
mod window;

pub use bank::{BankIdentifier, BankScheme, DelayRule, Prefilter};
pub use window::{WindowIdentifier, WindowSettings};

use crate::error::Result;
use crate::model::Fopdt;
use crate::recursive::Mode;

/// What is known of the plant.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The most probable plant.
    pub model: Fopdt,
    /// Covariance of `K, T, L, O`; row-major.
    pub P: [f64; 16],
    /// `O` in `y = G u + O`.
    pub offset: f64,
    /// Whether the delay lies beyond the range.
    pub outside: bool,
    /// Plants that are possible, with their probabilities.
    pub modes: Vec<Mode>,
    /// Probability of each delay of the range, whole samples.
    pub delays: Vec<f64>,
}

impl Identified {
    /// Standard deviations of `K, T, L, O`.
    pub fn sd(&self) -> [f64; 4] {
        [0, 5, 10, 15].map(|ii| self.P[ii].sqrt())
    }
}

/// What a sample brought.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct News {
    /// A new estimate.
    pub fitted: bool,
    /// Errors too large for the model.
    pub alarm: bool,
    /// The plant is another one: the rows before are forgotten.
    pub changed: bool,
}

/// How the plant is identified.
#[derive(Clone, Debug)]
pub enum Scheme {
    /// By windowed maximum likelihood.
    Window(WindowSettings),
    /// By a bank of recursions.
    Bank(BankScheme),
}

impl Scheme {
    /// Sample time, s.
    pub fn Ts(&self) -> f64 {
        match self {
            Scheme::Window(settings) => settings.Ts,
            Scheme::Bank(settings) => settings.Ts,
        }
    }

    /// Rows that an estimate remembers.
    pub fn rows(&self) -> usize {
        match self {
            Scheme::Window(settings) => settings.rows,
            Scheme::Bank(settings) => settings.memory(),
        }
    }
}

/// Either of them.
#[derive(Clone, Debug)]
pub enum Identifier {
    /// By windowed maximum likelihood.
    Window(Box<WindowIdentifier>),
    /// By a bank of recursions.
    Bank(Box<BankIdentifier>),
}

impl Identifier {
    /// Knowing nothing yet.
    pub fn new(scheme: &Scheme) -> Result<Self> {
        Ok(match scheme {
            Scheme::Window(settings) => Identifier::Window(Box::new(WindowIdentifier::new(*settings)?)),
            Scheme::Bank(settings) => Identifier::Bank(Box::new(BankIdentifier::new(settings)?)),
        })
    }

    /// Takes `u`, which acts from now on, and `y`, which is read now.
    pub fn step(&mut self, u: f64, y: f64) -> News {
        match self {
            Identifier::Window(window) => window.step(u, y),
            Identifier::Bank(bank) => bank.step(u, y),
        }
    }

    /// The last estimate.
    pub fn identified(&self) -> Option<Identified> {
        match self {
            Identifier::Window(window) => window.identified(),
            Identifier::Bank(bank) => bank.identified(),
        }
    }

    /// Rows that are fitted; all that there were, for a bank.
    pub fn rows(&self) -> usize {
        match self {
            Identifier::Window(window) => window.rows(),
            Identifier::Bank(_) => usize::MAX,
        }
    }

    /// Whether an alarm waits for its judgement.
    pub fn is_judging(&self) -> bool {
        matches!(self, Identifier::Window(window) if window.is_judging())
    }

    /// Forgets everything: the plant is another one.
    pub fn reset(&mut self) {
        match self {
            Identifier::Window(window) => window.reset(),
            Identifier::Bank(bank) => bank.reset(),
        }
    }

    /// The next sample does not follow the last one.
    pub fn gap(&mut self) {
        match self {
            Identifier::Window(window) => window.gap(),
            Identifier::Bank(bank) => bank.gap(),
        }
    }
}
