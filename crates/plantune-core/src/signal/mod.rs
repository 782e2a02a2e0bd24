//! Signals: test inputs, time stamps, resampling, filters, drawing.

mod butter;
mod decimate;
mod detrend;
mod envelope;
mod prbs;
mod prefilter;
mod resample;
mod smooth;
mod sos;
mod stretches;

pub use butter::{Band, butter, prewarped, prototype};
pub use decimate::{Decimated, decimate};
pub use detrend::{has_no_level, means, without_levels};
pub use envelope::envelope;
pub use prbs::prbs;
pub use prefilter::{Filtered, Marks, prefilter};
pub use resample::{Resampled, Steps, resample, steps, uniform_step};
pub use smooth::{Smoothed, smooth};
pub use sos::{Filter, Section, Sos};
pub use stretches::{Stretches, stretches};
