//! The noise of a signal: how large, how distributed, how coloured, how steady, how finely read.
//!
//! ```text
//! mean = sum y/N,  rms = sqrt(sum y^2/N),  var = sum (y - mean)^2/N         (3.5-3) to (3.5-5)
//! snr = 10 log10(rms^2/var) dB                                              (3.5-6)
//! R(l) = sum x(n) x(n-l)/sum x(n)^2,  x = y - mean                          (3.5-7) to (3.5-9)
//! ```
//!
//! With several runs (segments, or invalid rows between) deviations are from the mean of each run: its level belongs
//! to the operating point, not to the noise. Parts whose variance differs ask for a noise model that is estimated
//! with the plant, which is why source 001, 3.5.2, chooses ARMAX.

mod advice;
mod colour;
mod histogram;
mod parts;

pub use self::colour::Colour;
pub use self::histogram::Histogram;
pub use self::parts::{Comparison, Part};

use super::column::Column;
use super::density::{Density, DensityOptions, density, periodogram};
use super::quantised::step_of_reading;
use crate::error::Result;
use crate::excitation::check_input_motion;
use crate::limits::Limits;
use crate::note::Note;
use crate::record::Record;

/// What may be set.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoiseOptions {
    /// Parts to compare; the runs themselves if there are several, else two halves, when absent.
    pub parts: Option<usize>,
    /// Longest lag of the autocorrelation; a quarter of the longest run, at most 100, when absent.
    pub lags: Option<usize>,
    /// Stretches of Welch's density.
    pub density: DensityOptions,
}

/// Level and power of a signal.
#[derive(Clone, Copy, Debug)]
pub struct Moments {
    /// Rows.
    pub N: usize,
    /// Mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// Variance, by N.
    pub var: f64,
    /// Signal to noise, dB.
    pub snr: f64,
}

impl Moments {
    /// Of a signal; the variance from the deviations, so that a large level costs no digits.
    pub fn of(y: &[f64]) -> Self {
        let N = y.len() as f64;
        let mean = y.iter().sum::<f64>() / N;
        let var = y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / N;
        let square = y.iter().map(|y| y * y).sum::<f64>() / N;
        Moments { N: y.len(), mean, rms: square.sqrt(), var, snr: 10.0 * (square / var).log10() }
    }
}

/// Everything that is said of the noise of one signal.
#[derive(Clone, Debug)]
pub struct Noise {
    /// Level and power over all rows.
    pub moments: Moments,
    /// Distribution.
    pub histogram: Histogram,
    /// Autocorrelation.
    pub colour: Colour,
    /// Density of the longest run, unsmoothed.
    pub periodogram: Density,
    /// Welch's density.
    pub density: Density,
    /// Relative error of Parseval's identity.
    pub parseval: f64,
    /// Step in which the signal is read, if one is found.
    pub quantum: Option<f64>,
    /// Parts and whether they differ.
    pub comparison: Comparison,
    /// What follows.
    pub advice: Vec<String>,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Analyses signal `column` of the record, inputs counting before outputs.
pub fn noise(rec: &Record, column: usize, options: &NoiseOptions, limits: &Limits) -> Result<Noise> {
    let of = Column::of(rec, column)?;
    let (values, deviations) = (of.counted(), of.without_means());
    let quantum = step_of_reading(&values);
    let (periodogram, parseval) = periodogram(&of)?;
    let mut found = Noise {
        moments: Moments::of(&values),
        histogram: histogram::histogram(&values, quantum),
        colour: colour::colour(&deviations, &of.runs, options.lags)?,
        density: density(&of, &options.density)?,
        periodogram,
        parseval,
        quantum,
        comparison: parts::compare(&of, options.parts)?,
        advice: Vec::new(),
        notes: Vec::new(),
    };
    let moving = column >= rec.nu && check_input_motion(rec, limits).is_ok();
    found.notes = advice::notes(&found, rec, column, moving);
    found.advice = advice::advice(&found, moving);
    Ok(found)
}
