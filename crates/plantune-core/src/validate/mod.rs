//! Whether a model holds on data: fit, criteria, residuals.

mod closed_loop;
mod expected;
mod feedback;
mod frequency;
mod judge;
mod line;
mod matrix_verdict;
mod memory;
mod noisy_regressors;
mod plausibility;
mod residuals;
mod time_varying;
mod verdict;

pub use closed_loop::p_of_feedback;
pub use expected::{Expected, expected};
pub use feedback::{Estimated, Feedback};
pub use frequency::{FrequencyVerdict, frequency};
pub use judge::{Delay, Rival, Scores, judge};
pub use matrix_verdict::check_output;
pub use noisy_regressors::noisy_regressors;
pub use plausibility::plausible;
pub use residuals::{Residuals, residuals};
pub use time_varying::{TimeVarying, time_varying};
pub use verdict::{CheckOptions, Verdict, check, check_terms};
