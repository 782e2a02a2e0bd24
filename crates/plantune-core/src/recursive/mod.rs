//! Estimators that learn one sample at a time.

mod rls;
mod window;

pub use rls::Rls;
pub use window::{Estimate, Mode, Predictor, Window};
