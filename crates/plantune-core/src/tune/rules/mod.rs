//! Tuning rules, one per file.

mod imc;

pub use imc::{ImcTarget, imc_pi};
