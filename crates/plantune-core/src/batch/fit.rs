//! What every batch estimator returns, and the criteria computed from its loss.

use crate::error::{Error, Result};
use crate::model::{Model, PolyModel, ProcessModel};
use crate::note::Note;

/// How an iteration ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// No iteration was needed.
    Exact,
    /// The gradient test passed.
    Converged,
    /// Stopped before the gradient test passed.
    NotConverged,
}

impl Status {
    /// The word used in Python and in JSON.
    pub fn as_str(self) -> &'static str {
        match self {
            Status::Exact => "exact",
            Status::Converged => "converged",
            Status::NotConverged => "not converged",
        }
    }
}

/// A fitted model with its uncertainty.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The model.
    pub model: Model,
    /// Parameters.
    pub theta: Vec<f64>, // (n)
    /// Covariance of theta, then of the offset if it was estimated; row-major.
    pub P: Vec<f64>, // (m, m)
    /// One name per parameter.
    pub names: Vec<String>,
    /// `O` in `y = G u + O`; for integrating models the drift per sample.
    pub offset: f64,
    /// Rows at which the offset changes, and by how much.
    pub steps: Vec<OffsetStep>,
    /// Initial state of each segment at its first row with history.
    pub x0: Vec<Vec<f64>>,
    /// Rows used.
    pub N: usize,
    /// Mean squared one-step prediction error.
    pub loss: f64,
    /// How the estimation ended.
    pub status: Status,
    /// Decimal digits of each parameter that rounding leaves.
    pub expected_digits: Vec<f64>, // (n)
    /// Doubts.
    pub notes: Vec<Note>,
    /// 95 % intervals of those parameters whose uncertainty is not that of a normal law: name, low, high.
    pub intervals: Vec<(String, f64, f64)>,
    /// Process models of the inputs.
    pub plants: Vec<ProcessModel>,
    /// Their exact samples with the noise model, where several inputs or coloured noise were fitted.
    pub sampled: Option<PolyModel>,
}

/// A step of the offset: a load that came on, or the level of another experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffsetStep {
    /// First row of the new level.
    pub row: usize,
    /// How much the offset changes, in units of y.
    pub size: f64,
    /// Its standard deviation.
    pub sd: f64,
}

impl Fit {
    /// The fit, if all its numbers are (a parameter that is 0 by its structure has no deviation); units far from one can overflow their squares (N02).
    pub fn finite(self) -> Result<Self> {
        let sds = standard_deviations(&self.P, self.theta.len());
        let exact = self.loss == 0.0 || self.N == self.theta.len();
        let fine = self.theta.iter().chain(&self.P).chain([&self.loss, &self.offset]).all(|x| x.is_finite())
            && (exact || sds.iter().zip(&self.theta).all(|(sd, x)| *sd > 0.0 || *x == 0.0));
        if fine {
            return Ok(self);
        }
        Err(Error::new("N02", "the numbers of this record overflow or vanish when squared")
            .remedy("change the units so that inputs and outputs are nearer to one"))
    }

    /// The same with standard deviations and intervals `factor` times as wide.
    pub fn widened(mut self, factor: f64) -> Self {
        self.P = widened(&self.P, factor);
        for (name, low, high) in &mut self.intervals {
            if let Some(i) = self.names.iter().position(|own| own == name) {
                (*low, *high) = stretched((*low, *high), self.theta[i], factor);
            }
        }
        self
    }
}

/// `FPE, AIC, BIC` of a loss `V` over `N` rows with `d` parameters:
/// `V (1 + d/N)/(1 - d/N)`, `N ln V + 2 d`, `N ln V + d ln N`.
pub fn criteria(V: f64, N: usize, d: usize) -> (f64, f64, f64) {
    let (rows, d) = (N as f64, d as f64);
    let log_likelihood = rows * V.max(f64::MIN_POSITIVE).ln();
    (V * (1.0 + d / rows) / (1.0 - d / rows), log_likelihood + 2.0 * d, log_likelihood + d * rows.ln())
}

/// Square roots of the first `n` diagonal entries of the square, row-major `P`.
pub fn standard_deviations(P: &[f64], n: usize) -> Vec<f64> {
    let size = P.len().isqrt();
    (0..n).map(|i| P[i * size + i].sqrt()).collect()
}

/// Half width of a 95 % interval in standard deviations.
pub const WIDTH: f64 = 1.96;

/// The 95 % interval of a normal law.
pub fn normal_interval(x: f64, sd: f64) -> (f64, f64) {
    (x - WIDTH * sd, x + WIDTH * sd)
}

/// An interval around `x` with both ends `factor` times as far.
pub fn stretched((low, high): (f64, f64), x: f64, factor: f64) -> (f64, f64) {
    (x + factor * (low - x), x + factor * (high - x))
}

/// A covariance whose standard deviations are `factor` times as large.
pub fn widened(P: &[f64], factor: f64) -> Vec<f64> {
    P.iter().map(|p| p * factor * factor).collect()
}
