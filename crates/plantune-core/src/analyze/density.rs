//! Power spectral density of one signal, with its 95 % band.
//!
//! ```text
//! P(w) one-sided, units squared per rad/s;   sum P dw = mean square
//! band: nu P / chi2(nu; 2.5 %) to nu P / chi2(nu; 97.5 %),  nu = 2/ratio degrees of freedom
//! ```
//!
//! The periodogram takes a run whole, without a window; Welch's averages stretches of `n` rows, by default the
//! largest power of two up to an eighth of the rows. Parseval's identity is checked on the periodogram and its
//! relative error reported. Source 001, (3.5-9) to (3.5-14).

use std::f64::consts::TAU;
use std::ops::Range;

use super::column::{Column, short};
use crate::error::{Error, Result};
use crate::linalg::dot;
use crate::signal::{Stretched, Window, welch};
use crate::stats::chi2_quantile;

/// Share of the rows that a stretch takes at most by default.
const STRETCHES: usize = 8;

/// How a density is averaged.
#[derive(Clone, Copy, Debug)]
pub struct DensityOptions {
    /// Rows of a stretch, if given.
    pub n: Option<usize>,
    /// Share of a stretch that the next one repeats.
    pub overlap: f64,
    /// How a stretch fades in and out.
    pub window: Window,
}

impl Default for DensityOptions {
    fn default() -> Self {
        DensityOptions { n: None, overlap: 0.5, window: Window::Hann }
    }
}

impl DensityOptions {
    /// The stretches of Welch's way over runs of `rows` in all, of which the longest has `longest` (U01, X03).
    pub fn stretched(&self, n: usize, name: &str, longest: usize) -> Result<Stretched> {
        if !(0.0..=0.95).contains(&self.overlap) {
            return Err(Error::argument("overlap", self.overlap, "a share from 0 to 0.95"));
        }
        if n < 8 {
            return Err(Error::argument("n", n, "at least 8 rows"));
        }
        if n > longest {
            return Err(short(name, longest, n));
        }
        let step = (n as f64 * (1.0 - self.overlap)).round().max(1.0) as usize;
        Ok(Stretched { n, step, window: self.window })
    }
}

/// A density with its band.
#[derive(Clone, Debug)]
pub struct Density {
    /// Frequencies, rad/s.
    pub w: Vec<f64>,
    /// Density, squared units per rad/s.
    pub P: Vec<f64>,
    /// Lower end of its band.
    pub low: Vec<f64>,
    /// Upper end.
    pub high: Vec<f64>,
    /// Rows of a stretch.
    pub n: usize,
    /// Stretches averaged.
    pub averaged: usize,
    /// Degrees of freedom behind each ordinate.
    pub dof: f64,
}

/// The largest power of two up to an eighth of the rows that fits into the longest run.
pub fn usual_stretch(N: usize, longest: usize) -> usize {
    let most = (N / STRETCHES).min(longest).max(8);
    1 << most.ilog2()
}

/// Welch's density of a signal.
pub fn density(of: &Column, options: &DensityOptions) -> Result<Density> {
    let longest = of.runs.iter().map(Range::len).max().unwrap_or(0);
    let n = options.n.unwrap_or_else(|| usual_stretch(of.N(), longest));
    let way = options.stretched(n, &of.name, longest)?;
    averaged(of, &of.runs, way).ok_or_else(|| short(&of.name, longest, n))
}

/// The periodogram of the longest run, and by how much of the mean square Parseval's identity misses.
pub fn periodogram(of: &Column) -> Result<(Density, f64)> {
    let run = longest(&of.runs);
    let way = Stretched { n: run.len(), step: run.len(), window: Window::Rectangular };
    let found =
        averaged(of, std::slice::from_ref(&run), way).ok_or_else(|| short(&of.name, run.len(), 16))?;
    let x = &of.without_means()[run.clone()];
    let line = TAU / (run.len() as f64 * of.Ts);
    let (whole, square) = (found.P.iter().sum::<f64>() * line, dot(x, x) / run.len() as f64);
    Ok((found, if square > 0.0 { (whole / square - 1.0).abs() } else { 0.0 }))
}

/// The first of the longest runs.
pub fn longest(runs: &[Range<usize>]) -> Range<usize> {
    runs.iter().rev().max_by_key(|run| run.len()).cloned().unwrap_or(0..0)
}

fn averaged(of: &Column, runs: &[Range<usize>], way: Stretched) -> Option<Density> {
    let S = welch(&[of.without_means()], runs, way, of.Ts)?;
    let (P, dof) = (S.density(0), 2.0 / S.ratio);
    let scaled = |p: f64| -> Vec<f64> {
        let factor = dof / chi2_quantile(p, dof);
        P.iter().map(|P| P * factor).collect()
    };
    Some(Density { low: scaled(0.025), high: scaled(0.975), w: S.w, P, n: way.n, averaged: S.averaged, dof })
}
