//! The parts of the auto-tuner: source 001, 3.7.
//!
//! Each is a small value with a `step`, allocates nothing once it is made, and knows no clock and no link.

pub mod alarm;
pub mod classify;
pub mod delay;
pub mod fill;
pub mod gain_table;
pub mod gate;
pub mod identify;
pub mod merge;
pub mod operating_point;
pub mod reason;
pub mod retune;
pub mod scheduled;
pub mod tuner;
pub mod window;

pub use alarm::Alarm;
pub use classify::{Class, Classifier};
pub use delay::{Counters, DelayChoice, Posterior, PosteriorSettings};
pub use fill::{Fill, Filled};
pub use gain_table::GainTable;
pub use gate::{Evidence, GateLimits, Gated, Watch, gate, step_towards};
pub use identify::{BankScheme, DelayRule, Identified, Identifier, News, Prefilter, Scheme, WindowSettings};
pub use merge::Merge;
pub use operating_point::{Change, Node, OperatingPoint};
pub use reason::{Cause, Parameter, Reason, Reasons};
pub use retune::{Over, Rule, over, plants};
pub use scheduled::Scheduled;
pub use tuner::{Decision, Sample, Simulated, Tuner, TunerSettings};
