//! A look at the data before a model.

mod delay;

pub use delay::{DelayScan, delay_scan};
