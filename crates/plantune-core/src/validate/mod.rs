//! Whether a model holds on data: fit, criteria, residuals.

mod feedback;
mod judge;
mod matrix_verdict;
mod memory;
mod plausibility;
mod residuals;
mod verdict;

pub use feedback::{Estimated, Feedback};
pub use judge::{Delay, Rival, Scores, judge};
pub use matrix_verdict::check_output;
pub use plausibility::plausible;
pub use residuals::{Residuals, residuals};
pub use verdict::{CheckOptions, Verdict, check, check_terms};
