//! Signals: test inputs, time stamps, resampling, drawing.

mod detrend;
mod envelope;
mod prbs;
mod resample;

pub use detrend::{means, without_levels};
pub use envelope::envelope;
pub use prbs::prbs;
pub use resample::{Resampled, Steps, resample, steps, uniform_step};
