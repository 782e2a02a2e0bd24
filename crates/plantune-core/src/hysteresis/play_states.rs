//! Plays before they are weighed: what identification and learning regress on.

/// Half widths, and where each play stands; from the virgin state.
#[derive(Clone, Debug)]
pub(super) struct States {
    pub(super) r: Vec<f64>,
    pub(super) z: Vec<f64>,
}

impl States {
    pub(super) fn new(r: Vec<f64>) -> Self {
        States { z: vec![0.0; r.len()], r }
    }

    /// Where they stand after the input `x`.
    pub(super) fn step(&mut self, x: f64) -> &[f64] {
        for (z, r) in self.z.iter_mut().zip(&self.r) {
            *z = (x - r).max((x + r).min(*z));
        }
        &self.z
    }
}
