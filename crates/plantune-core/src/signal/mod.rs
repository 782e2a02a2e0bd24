//! Signals: test inputs, time stamps, resampling, filters, drawing.

mod butter;
mod detrend;
mod envelope;
mod prbs;
mod resample;
mod sos;

pub use butter::{Band, butter, prewarped, prototype};
pub use detrend::{means, without_levels};
pub use envelope::envelope;
pub use prbs::prbs;
pub use resample::{Resampled, resample, uniform_step};
pub use sos::{Filter, Section, Sos};
