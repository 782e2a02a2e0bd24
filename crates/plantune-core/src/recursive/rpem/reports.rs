//! What an estimator of the family knows at any moment.

use super::super::forgetting::Forgetting;
use super::super::ud::Ud;
use super::{Rpem, Structure};
use crate::model::PolyModel;

impl Rpem {
    /// Orders and delay.
    pub fn structure(&self) -> Structure {
        self.structure
    }

    /// Coefficients `a b c d f`.
    pub fn theta(&self) -> &[f64] {
        &self.theta[..self.structure.coefficients()]
    }

    /// The constant `d`, on data less their first sample.
    pub fn constant(&self) -> f64 {
        if self.structure.offset { self.theta[self.theta.len() - 1] } else { 0.0 }
    }

    /// Covariance of the coefficients, then of the constant, in units of the noise variance.
    pub fn P(&self) -> &Ud {
        &self.P
    }

    /// How it forgets.
    pub fn forgetting(&self) -> &Forgetting {
        &self.forgetting
    }

    /// Standard deviations of the coefficients; infinite where nothing is known yet.
    pub fn sd(&self) -> Vec<f64> {
        (0..self.structure.coefficients()).map(|j| self.covariance(j, j).sqrt()).collect()
    }

    /// Standard deviation of the noise; infinite before anything was judged.
    pub fn noise_sd(&self) -> f64 {
        self.innovation.s2().sqrt()
    }

    /// `O` in `y = G u + O`, in the units of the signals, with its standard deviation; the drift of an integrator.
    pub fn offset(&self) -> (f64, f64) {
        if !self.structure.offset {
            return (0.0, 0.0);
        }
        let [u0, y0] = self.zero;
        let (O, gradient) = self.model(1.0).level(self.constant(), &[u0], y0);
        let n = gradient.len();
        let term = |ij: usize| match gradient[ij / n] * gradient[ij % n] {
            0.0 => 0.0,
            product => product * self.covariance(ij / n, ij % n),
        };
        (O, (0..n * n).map(term).sum::<f64>().max(0.0).sqrt())
    }

    /// The model at this moment.
    pub fn model(&self, Ts: f64) -> PolyModel {
        self.structure.model(&self.theta, Ts)
    }

    /// Steps of the offset that were seen.
    pub fn alarms(&self) -> usize {
        self.alarms as usize
    }

    /// Samples taken in, learnt or not.
    pub fn samples(&self) -> usize {
        self.samples as usize
    }

    /// Whether the last sample was learnt.
    pub fn learnt(&self) -> bool {
        self.learnt
    }

    fn covariance(&self, i: usize, j: usize) -> f64 {
        if i == j && self.P.factors().1[i] == 0.0 {
            return f64::INFINITY;
        }
        self.innovation.s2() * self.forgetting.spread() * self.P.at(i, j)
    }
}
