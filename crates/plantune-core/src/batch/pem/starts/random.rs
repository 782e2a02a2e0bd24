//! Starts drawn at random: stable `C`, `D` and `F`; the errors are linear in the rest.
//!
//! A root is real and in (-0.5, 0.98), or one of a pair of modulus 0.2 to 0.98 at any angle. The seed is given, so
//! that the same record always gives the same fit.

use super::super::predictor::Predictor;
use crate::linalg::Random;
use crate::poly::product;

/// `theta` with zeros for what follows by least squares.
pub(super) fn random(predictor: &Predictor, seed: u64) -> Vec<f64> {
    let orders = predictor.orders();
    let mut draws = Random::new(seed);
    let mut model = orders.model(&vec![0.0; orders.n()], 1.0);
    model.C = monic(orders.nc, &mut draws);
    model.D = monic(orders.nd, &mut draws);
    model.F = orders.nf.iter().map(|&nf| monic(nf, &mut draws)).collect();
    model.theta()
}

fn monic(n: usize, draws: &mut Random) -> Vec<f64> {
    let mut p = vec![1.0];
    let mut between = |low: f64, high: f64| low + (high - low) * draws.uniform();
    while p.len() <= n {
        if p.len() < n && between(0.0, 1.0) < 0.5 {
            let (r, w) = (between(0.2, 0.98), between(0.0, std::f64::consts::PI));
            p = product(&p, &[1.0, -2.0 * r * w.cos(), r * r]);
        } else {
            p = product(&p, &[1.0, -between(-0.5, 0.98)]);
        }
    }
    p
}
