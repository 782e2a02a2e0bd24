//! The resonance of a model: of its poorly damped pole pairs the one that rings most.
//!
//! ```text
//! s = ln(z) / Ts  of a sampled pole,   w = |s|,   zeta = -Re s / |s|,   resonant where zeta < 1/sqrt(2)
//! amplitude of the ringing after an impulse, close to a poorly damped pole  2 |G(i w)| zeta w
//! ```
//!
//! Poles that noise has put into a polynomial model lie close to zeros: their peak is low or thin.

use std::f64::consts::FRAC_1_SQRT_2;

use super::Model;
use crate::linalg::Complex;

/// A pair of complex poles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Natural frequency, rad/s.
    pub w: f64,
    /// Damping; negative for an unstable pair.
    pub zeta: f64,
}

/// The resonance seen from input `i`; absent where every pole is well damped.
pub fn resonance(model: &Model, i: usize) -> Option<Mode> {
    let amplitude = |mode: &Mode| 2.0 * model.freqresp(i, mode.w).norm() * mode.zeta.abs() * mode.w;
    modes(model)
        .into_iter()
        .filter(|mode| mode.zeta < FRAC_1_SQRT_2)
        .max_by(|a, b| amplitude(a).total_cmp(&amplitude(b)))
}

/// One mode per pair of complex poles.
fn modes(model: &Model) -> Vec<Mode> {
    let pairs = model.poles().into_iter().filter(|&(_, im)| im > 0.0);
    pairs
        .map(|(re, im)| {
            let s = match model {
                Model::Poly(m) => Complex::new(re, im).ln() / m.Ts,
                _ => Complex::new(re, im),
            };
            Mode { w: s.norm(), zeta: -s.re / s.norm() }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Fopdt, PolyModel};

    /// `1 / (s^2 + 2 zeta w s + w^2)` has its sampled poles at `exp(s Ts)`.
    fn sampled(w: f64, zeta: f64, Ts: f64) -> Vec<f64> {
        let (radius, angle) = ((-zeta * w * Ts).exp(), w * Ts * (1.0 - zeta * zeta).sqrt());
        vec![1.0, -2.0 * radius * angle.cos(), radius * radius]
    }

    #[test]
    fn frequency_and_damping_are_those_of_the_continuous_poles() {
        for (w, zeta) in [(1.0, 0.2), (7.0, 0.03), (3.0, 0.6)] {
            let model = Model::Poly(PolyModel::arx(sampled(w, zeta, 0.1), vec![vec![1.0]], vec![1], 0.1));
            let mode = resonance(&model, 0).expect("a resonance");
            assert!((mode.w / w - 1.0).abs() < 1e-9 && (mode.zeta - zeta).abs() < 1e-9, "{mode:?}");
        }
    }

    #[test]
    fn of_two_pairs_the_one_that_rings_more_counts() {
        let A = crate::poly::product(&sampled(2.0, 0.05, 0.1), &sampled(9.0, 0.02, 0.1));
        // Zeros beside the second pair take its gain away.
        let model = Model::Poly(PolyModel::arx(A, vec![sampled(9.01, 0.02, 0.1)], vec![1], 0.1));
        assert!((resonance(&model, 0).expect("a resonance").w - 2.0).abs() < 1e-6);
    }

    #[test]
    fn well_damped_plants_have_none() {
        let well = PolyModel::arx(sampled(1.0, 0.8, 0.1), vec![vec![1.0]], vec![1], 0.1);
        assert_eq!(resonance(&Model::Poly(well), 0), None);
        assert_eq!(resonance(&Model::from(Fopdt { K: 1.0, T: 2.0, L: 0.5 }), 0), None);
    }
}
