//! How far a model, or a loop, is off.

/// Sizes of an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// Rows.
    pub N: usize,
    /// Root mean square.
    pub rms: f64,
    /// Largest magnitude.
    pub worst: f64,
    /// Norm over the norm of the output.
    pub relative: f64,
}

impl Misfit {
    /// Of the errors `e` of an output `y`.
    pub fn of(y: &[f64], e: &[f64]) -> Self {
        let worst = e.iter().fold(0.0, |worst: f64, e| worst.max(e.abs()));
        Misfit { N: e.len(), rms: rms(e), worst, relative: rms(e) / rms(y) }
    }
}

/// Root mean square.
pub fn rms(e: &[f64]) -> f64 {
    (e.iter().map(|e| e * e).sum::<f64>() / e.len().max(1) as f64).sqrt()
}
