//! Whether a model holds on data: fit, criteria, residuals.

mod residuals;
mod verdict;

pub use residuals::{Residuals, residuals};
pub use verdict::{CheckOptions, Verdict, check};
