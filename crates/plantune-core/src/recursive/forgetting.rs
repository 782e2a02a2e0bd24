//! What an estimator makes of its past: how `P` goes on after a sample, and how much of it is noise.
//!
//! With `q = psi' P psi` and the innovation `eps`, `L` the gain in `theta <- theta + L eps`:
//!
//! ```text
//! exponential   L = P psi/(lambda + q),  P <- (P - L psi' P)/lambda,
//!               lambda(t) = lambda_inf - (lambda_inf - lambda_0) rho^t
//! directional   L = P psi/(1 + q),       P <- P - P psi psi' P/(1/g + q),  g = lambda - (1 - lambda)/q
//! variable      L = P psi/(1 + q),       P <- (P - L psi' P)/lambda,
//!               lambda = 1 - eps^2/((1 + q) s^2 N0) in [0.9, 1],  N0 = 1/(1 - lam)
//! Kalman        L = P psi/(R2 + q),      P <- P - L psi' P + R1
//! ```
//!
//! Source 001, (3.7-7) to (3.7-11): the first with one `lambda` (`R2 = lambda`, and the division by `lambda` that
//! (3.7-11) leaves out), the last with `R1 = 0` and `R2 = 1` for `lambda = 1`, and with `R1 = 0, R2 = lambda` as
//! printed, which does not forget. Directional: Kulhavý, Kybernetika 23, 1987: only what the sample brings anew
//! is forgotten of the old. Variable: Fortescue, Kershenbaum and Ydstie, Automatica 17, 1981: a large error
//! shortens the memory. The growing factor: Ljung and Söderström 1983, 5.6.
//!
//! Covariance. Weighted with `w_k`, `theta` has `R^-1 Q R^-1 s^2`, `R = sum w psi psi'`, `Q = sum w^2 psi psi'`.
//! Of a stationary `psi` both are multiples of the same matrix, so that `Cov theta = s^2 P S2/S1` with the sums
//! `S1` of the weights and `S2` of their squares: `P` without forgetting, `P/(1 + lambda)` once one has long been
//! forgetting, and what is right in between. A sample's own innovation has `s^2 (1 + q S2/S1)`.

use super::innovation::Judged;
use super::room::Room;
use super::ud::Ud;
use crate::error::{Error, Result};

/// Least factor of variable forgetting.
const LEAST: f64 = 0.9;

/// Gap between the factors of a growing one that counts.
const GROWN: f64 = 1e-17;

/// A way to forget, and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Forgetting {
    scheme: Scheme,
    gap: f64,        // lambda_inf - lambda(t)
    lambda: f64,     // of the next sample
    per_lambda: f64, // 1 / lambda
    weights: f64,    // S1
    squares: f64,    // S2
}

/// Which of the schemes, with its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum Scheme {
    /// By the same factor in all directions.
    Exponential {
        /// Factor in the end.
        lambda: f64,
        /// Factor of the first sample.
        start: f64,
        /// Share of the gap between them that a sample leaves.
        rho: f64,
    },
    /// In the direction of the regressor only.
    Directional {
        /// Factor.
        lambda: f64,
    },
    /// As much as the errors ask for.
    Variable {
        /// Factor while the errors are those of the noise.
        lambda: f64,
    },
    /// A random walk of the parameters.
    Kalman {
        /// Variance of each parameter's step, in units of `R2`'s.
        R1: Vec<f64>,
        /// Variance of the noise.
        R2: f64,
    },
}

impl Scheme {
    /// One factor for ever.
    pub fn constant(lambda: f64) -> Self {
        Scheme::Exponential { lambda, start: lambda, rho: 0.0 }
    }

    /// The factor in the end; 1 of the Kalman filter.
    pub fn lambda(&self) -> f64 {
        match self {
            Scheme::Exponential { lambda, .. }
            | Scheme::Directional { lambda }
            | Scheme::Variable { lambda } => *lambda,
            Scheme::Kalman { .. } => 1.0,
        }
    }

    /// Whether information is lost for good.
    pub fn forgets(&self) -> bool {
        match self {
            Scheme::Kalman { R1, .. } => R1.iter().any(|r| *r > 0.0),
            other => other.lambda() < 1.0,
        }
    }

    fn check(&self, n: usize) -> Result<()> {
        let factor = |name: &str, x: f64| {
            if x > 0.0 && x <= 1.0 { Ok(()) } else { Err(Error::argument(name, x, "in (0, 1]")) }
        };
        factor("lam", self.lambda())?;
        match self {
            Scheme::Exponential { start, rho, .. } => {
                factor("lam0", *start)?;
                if *rho >= 0.0 && *rho < 1.0 { Ok(()) } else { Err(Error::argument("rho", rho, "in [0, 1)")) }
            }
            Scheme::Kalman { R1, R2 } => {
                if !(*R2 > 0.0 && R2.is_finite()) {
                    return Err(Error::argument("R2", R2, "a positive number"));
                }
                if R1.len() != n || R1.iter().any(|r| !(*r >= 0.0 && r.is_finite())) {
                    let needed = format!("a number, or {n} of them, none negative");
                    return Err(Error::argument("R1", format!("{R1:?}"), &needed));
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

impl Forgetting {
    /// At its first sample, for `n` parameters.
    pub fn new(scheme: Scheme, n: usize) -> Result<Self> {
        scheme.check(n)?;
        let (lambda, gap) = match &scheme {
            Scheme::Exponential { lambda, start, .. } => (*start, lambda - start),
            other => (other.lambda(), 0.0),
        };
        Ok(Forgetting { scheme, gap, lambda, per_lambda: 1.0 / lambda, weights: 0.0, squares: 0.0 })
    }

    /// The settings.
    pub fn scheme(&self) -> &Scheme {
        &self.scheme
    }

    /// The factor of the next sample; of variable forgetting, of the last.
    pub fn lambda(&self) -> f64 {
        self.lambda
    }

    /// `c` of `Cov theta = c s^2 P`.
    #[inline(always)]
    pub fn spread(&self) -> f64 {
        match self.scheme {
            Scheme::Kalman { R2, .. } => 1.0 / R2,
            Scheme::Directional { .. } => 1.0,
            _ if self.weights > 0.0 => self.squares / self.weights,
            _ => 1.0,
        }
    }

    /// Takes in so many rows of weight 1, which a batch has learnt.
    pub(super) fn begin(&mut self, rows: f64) {
        (self.weights, self.squares) = (rows, rows);
    }

    /// Brings `P` past the sample weighed last, of this `q` and innovation.
    ///
    /// Returns what `P psi` of before, in `room.b`, has to be multiplied with to be the step of `theta`.
    #[inline(always)]
    pub fn learn(&mut self, n: usize, P: &mut Ud, room: &mut Room<'_>, q: f64, judged: Judged) -> f64 {
        let Judged { eps, surprise, .. } = judged;
        // P <- (P - g P psi psi' P / (1 + g q)) / lambda, and L = gain P psi / (1 + g q).
        let (g, per_lambda, gain) = match &self.scheme {
            Scheme::Exponential { .. } => (self.per_lambda, self.per_lambda, self.per_lambda),
            Scheme::Variable { lambda } => {
                self.lambda = (1.0 - surprise * (1.0 - lambda)).clamp(LEAST.min(*lambda), 1.0);
                (1.0, 1.0 / self.lambda, 1.0)
            }
            Scheme::Directional { lambda } => {
                (if q > 0.0 { lambda - (1.0 - lambda) / q } else { 0.0 }, 1.0, *lambda)
            }
            Scheme::Kalman { R2, .. } => (1.0 / R2, 1.0, 1.0 / R2),
        };
        let scale = P.update(n, room, g, per_lambda) * (gain * eps);
        self.go_on(P);
        scale
    }

    /// What is left to do once `P` is past the sample.
    #[inline(always)]
    fn go_on(&mut self, P: &mut Ud) {
        let lambda = self.lambda;
        match &self.scheme {
            Scheme::Exponential { lambda: end, rho, .. } => {
                self.weights = lambda * self.weights + 1.0;
                self.squares = lambda * lambda * self.squares + 1.0;
                if self.gap != 0.0 {
                    self.gap = if self.gap.abs() > GROWN { self.gap * rho } else { 0.0 };
                    self.lambda = end - self.gap;
                    self.per_lambda = 1.0 / self.lambda;
                }
            }
            Scheme::Variable { .. } => {
                self.weights = lambda * (self.weights + 1.0);
                self.squares = lambda * lambda * (self.squares + 1.0);
            }
            Scheme::Directional { .. } => {}
            Scheme::Kalman { R1, .. } => {
                for (j, R1) in R1.iter().enumerate().filter(|(_, R1)| **R1 > 0.0) {
                    P.add_to(j, *R1);
                }
            }
        }
    }

    /// Walks over every number of the state.
    pub(super) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        let Forgetting { gap, lambda, per_lambda, weights, squares, .. } = self;
        [gap, lambda, per_lambda, weights, squares].into_iter().for_each(visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::room::VECTORS;

    /// `S2/S1` of explicit weights, for a factor that grows.
    #[test]
    fn the_spread_is_that_of_the_weights() {
        let scheme = Scheme::Exponential { lambda: 0.99, start: 0.9, rho: 0.8 };
        let mut forgetting = Forgetting::new(scheme, 1).expect("in range");
        let (mut P, mut weights) = (Ud::identity(1, 1.0).expect("positive"), Vec::new());
        for t in 0..60 {
            let lambda = 0.99 - 0.09 * 0.8f64.powi(t);
            assert!((forgetting.lambda() - lambda).abs() < 1e-15);
            weights.iter_mut().for_each(|w| *w *= lambda);
            weights.push(1.0);
            let mut all = [1.0; VECTORS];
            let room = &mut Room::of(1, &mut all);
            let q = P.weigh(1, room);
            let judged = Judged::of(0.0);
            forgetting.learn(1, &mut P, room, q, judged);
            let (S1, S2) = (weights.iter().sum::<f64>(), weights.iter().map(|w| w * w).sum::<f64>());
            assert!((forgetting.spread() - S2 / S1).abs() < 1e-14);
        }
        assert!((forgetting.spread() - 1.0 / 1.99).abs() > 0.1); // 60 of the 100 samples that it will remember
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let kalman = |R1: Vec<f64>, R2| Scheme::Kalman { R1, R2 };
        for scheme in [
            Scheme::constant(0.0),
            Scheme::constant(1.1),
            Scheme::Exponential { lambda: 1.0, start: f64::NAN, rho: 0.9 },
            Scheme::Exponential { lambda: 1.0, start: 0.9, rho: 1.0 },
            Scheme::Directional { lambda: f64::INFINITY },
            Scheme::Variable { lambda: -0.5 },
            kalman(vec![0.0], 1.0),
            kalman(vec![0.0, -1.0], 1.0),
            kalman(vec![0.0, 0.0], 0.0),
        ] {
            assert!(Forgetting::new(scheme.clone(), 2).is_err(), "{scheme:?}");
        }
    }
}
