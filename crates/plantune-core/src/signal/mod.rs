//! Signals: test inputs, time stamps, resampling, filters, correlation, drawing.

mod autoregression;
mod butter;
mod chirp;
mod correlate;
mod decimate;
mod detrend;
mod drive;
mod envelope;
mod gbn;
mod multisine;
mod prbs;
mod prefilter;
mod resample;
mod smooth;
mod sos;
mod staircase;
mod stretches;

pub use autoregression::{autoregression, through};
pub use butter::{Band, butter, prewarped, prototype};
pub use chirp::{Sweep, chirp};
pub use correlate::correlate;
pub use decimate::{Decimated, decimate};
pub use detrend::{has_no_level, means, without_levels};
pub use drive::drive;
pub use envelope::envelope;
pub use gbn::gbn;
pub use multisine::{Phases, crest_factor, multisine};
pub use prbs::{prbs, register_bits};
pub use prefilter::{Filtered, Marks, prefilter};
pub use resample::{Resampled, Steps, resample, steps, uniform_step};
pub use smooth::{Smoothed, smooth};
pub use sos::{Filter, Section, Sos};
pub use staircase::staircase;
pub use stretches::{Stretches, stretches};
