//! Estimators that learn one sample at a time.

mod bank;
mod rls;

pub use bank::{Bank, BankSettings};
pub use rls::Rls;
