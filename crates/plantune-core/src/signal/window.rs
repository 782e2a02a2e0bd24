//! Windows in time, periodic: `w(t)`, `t = 0 … n - 1`, of which `n` more would follow in the same way.
//!
//! ```text
//! Hann     1/2 - 1/2 cos(2 pi t/n)
//! Hamming  0.54 - 0.46 cos(2 pi t/n)
//! rectangular  1
//! ```
//!
//! Harris 1978.

use std::f64::consts::TAU;

use crate::error::{Error, Result};

/// How a stretch of samples fades in and out before it is transformed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Window {
    /// Zero at the ends; leakage falls off fast.
    Hann,
    /// Its nearest side lobes are lower, the far ones are not.
    Hamming,
    /// None: for whole periods of a periodic signal.
    Rectangular,
}

impl Window {
    /// By its name (U01).
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "hann" => Ok(Window::Hann),
            "hamming" => Ok(Window::Hamming),
            "rectangular" => Ok(Window::Rectangular),
            _ => Err(Error::argument(
                "window",
                format!("{name:?}"),
                "\"hann\", \"hamming\" or \"rectangular\"",
            )),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Window::Hann => "Hann",
            Window::Hamming => "Hamming",
            Window::Rectangular => "rectangular",
        }
    }

    /// Its `n` weights.
    pub fn weights(self, n: usize) -> Vec<f64> {
        let wave = |mean: f64| move |t: usize| mean - (1.0 - mean) * (TAU * t as f64 / n as f64).cos();
        match self {
            Window::Hann => (0..n).map(wave(0.5)).collect(),
            Window::Hamming => (0..n).map(wave(0.54)).collect(),
            Window::Rectangular => vec![1.0; n],
        }
    }
}
