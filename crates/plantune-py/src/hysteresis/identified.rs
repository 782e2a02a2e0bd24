//! How a model was found.

use plantune_core::hysteresis::Misfit;
use pyo3::prelude::*;

use crate::values::Frozen;

/// Fields of `Identified`, but for names and notes.
#[derive(IntoPyObject)]
pub struct IdentifiedOut {
    N: usize,
    rms: f64,
    worst: f64,
    relative: f64,
    sd: Frozen,
    tried: Vec<(usize, f64)>,
}

impl IdentifiedOut {
    /// From the errors over all rows.
    pub fn of(y: &[f64], errors: &[f64], sd: Vec<f64>, tried: Vec<(usize, f64)>) -> Self {
        let Misfit { N, rms, worst, relative } = Misfit::of(y, errors);
        IdentifiedOut { N, rms, worst, relative, sd: Frozen(sd), tried }
    }
}
