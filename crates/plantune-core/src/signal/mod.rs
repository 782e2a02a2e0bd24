//! Signals: test inputs, time stamps, resampling, filters, correlation, spectra, drawing.

mod butter;
mod correlate;
mod decimate;
mod detrend;
mod drive;
mod envelope;
mod fft;
mod prbs;
mod prefilter;
mod resample;
mod smooth;
mod sos;
mod spectra;
mod stretches;
mod window;

pub use butter::{Band, butter, prewarped, prototype};
pub use correlate::correlate;
pub use decimate::{Decimated, decimate};
pub use detrend::{has_no_level, means, without_levels};
pub use drive::drive;
pub use envelope::envelope;
pub use fft::Fourier;
pub use prbs::prbs;
pub use prefilter::{Filtered, Marks, prefilter};
pub use resample::{Resampled, Steps, resample, steps, uniform_step};
pub use smooth::{Smoothed, smooth};
pub use sos::{Filter, Section, Sos};
pub use spectra::{Spectra, Stretched, blackman_tukey, smoothed, welch};
pub use stretches::{Stretches, stretches};
pub use window::Window;
