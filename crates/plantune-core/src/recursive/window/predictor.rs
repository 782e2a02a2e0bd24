//! One-step prediction with the model of a window, and how sure it is.
//!
//! ```text
//! eps(t) = y(t) - a y(t-1) - b1 u(t-m-1) - b2 u(t-m-2) - d - c eps(t-1)
//! z = eps / (s sqrt(1 + psi' P psi)),   psi = phi - c psi(t-1)
//! ```
//!
//! `P` is the covariance of `a, b1, b2, d` in units of `s^2`: while the model is uncertain its errors may be
//! large. Ljung 1999, 3.2.

/// Share of the output's range below which an error is rounding.
const ROUNDING: f64 = 1e-9;

/// A model and the memory of its prediction.
#[derive(Clone, Debug)]
pub struct Predictor {
    /// `a, b1, b2, c, d` of the scaled signals.
    theta: [f64; 5],
    P: [f64; 16],
    s: f64,
    m: usize,
    /// Centre and factor of u, then of y.
    scale: [f64; 4],
    eps: f64,
    psi: [f64; 4],
}

impl Predictor {
    pub(super) fn new(theta: [f64; 5], P: [f64; 16], s2: f64, m: usize, scale: [f64; 4]) -> Self {
        Predictor { theta, P, s: s2.sqrt().max(ROUNDING), m, scale, eps: 0.0, psi: [0.0; 4] }
    }

    /// Rows of the past that a step needs.
    pub fn history(&self) -> usize {
        self.m + 2
    }

    /// The standardised error of `y`, given at least [`Predictor::history`] rows before it, oldest first.
    pub fn step(&mut self, u: &[f64], y_before: &[f64], y: f64) -> f64 {
        let [u0, su, y0, sy] = self.scale;
        let [a, b1, b2, c, d] = self.theta;
        let u = |ago: usize| (u[u.len() - ago] - u0) * su;
        let phi = [(y_before[y_before.len() - 1] - y0) * sy, u(self.m + 1), u(self.m + 2), 1.0];
        self.eps = (y - y0) * sy - a * phi[0] - b1 * phi[1] - b2 * phi[2] - d - c * self.eps;
        for (psi, phi) in self.psi.iter_mut().zip(phi) {
            *psi = phi - c * *psi;
        }
        let q: f64 = (0..16).map(|ij| self.P[ij] * self.psi[ij / 4] * self.psi[ij % 4]).sum();
        self.eps / (self.s * (1.0 + q.max(0.0)).sqrt())
    }

    /// Runs over the past, so that the memory is that of the rows' end.
    pub fn warm(&mut self, u: &[f64], y: &[f64]) {
        (self.eps, self.psi) = (0.0, [0.0; 4]);
        for t in self.history()..y.len() {
            self.step(&u[..t], &y[..t], y[t]);
        }
    }
}
