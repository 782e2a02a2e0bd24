//! Signals: test inputs, time stamps, resampling, filters, correlation, drawing.

mod butter;
mod correlate;
mod decimate;
mod detrend;
mod drive;
mod envelope;
mod offset_steps;
mod prbs;
mod prefilter;
mod resample;
mod smooth;
mod sos;
mod stretches;

pub use butter::{Band, butter, prewarped, prototype};
pub use correlate::correlate;
pub use decimate::{Decimated, decimate};
pub use detrend::{Line, has_no_level, lines, means, without_levels, without_lines, without_steps};
pub use drive::drive;
pub use envelope::envelope;
pub use offset_steps::{OffsetSteps, level_steps, offset_steps};
pub use prbs::prbs;
pub use prefilter::{Filtered, Marks, prefilter};
pub use resample::{Resampled, Steps, resample, steps, uniform_step};
pub use smooth::{Smoothed, smooth};
pub use sos::{Filter, Section, Sos};
pub use stretches::{Stretches, stretches};
