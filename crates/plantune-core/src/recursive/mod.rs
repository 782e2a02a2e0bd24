//! Estimators that learn one sample at a time.

mod rls;

pub use rls::Rls;
