//! Transfer functions in s with a dead time, `G(s) = num(s) / den(s) e^(-L s)`.
//!
//! Coefficients in descending powers of s. Sampling behind a zero-order hold is exact, the fraction of
//! the delay included; see [`super::Realisation`].

use std::f64::consts::PI;

use super::Realisation;
use crate::error::{Error, Result};
use crate::linalg::Complex;
use crate::poly::{product, roots};

/// `num(s) / den(s) e^(-L s)`.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    /// Numerator, descending powers.
    pub num: Vec<f64>,
    /// Denominator, descending powers, at least as long as the numerator.
    pub den: Vec<f64>,
    /// Dead time, s.
    pub L: f64,
}

impl TransferFunction {
    /// `G(s)` at any complex `s`.
    pub fn at(&self, s: Complex<f64>) -> Complex<f64> {
        (-s * self.L).exp() * horner(&self.num, s) / horner(&self.den, s)
    }

    /// `G(j w)`.
    pub fn freqresp(&self, w: f64) -> Complex<f64> {
        let s = Complex::new(0.0, w);
        Complex::from_polar(1.0, -w * self.L) * horner(&self.num, s) / horner(&self.den, s)
    }

    /// `a_1 … a_n, b_0 …, L` in ascending powers; the constant of `den` stays.
    pub fn theta(&self) -> Vec<f64> {
        let den = self.den[..self.den.len() - 1].iter().rev();
        den.chain(self.num.iter().rev()).chain([&self.L]).copied().collect()
    }

    /// The same degrees with other coefficients.
    pub fn with_theta(&self, theta: &[f64]) -> Self {
        let (n, nb) = (self.den.len() - 1, self.num.len());
        let den = theta[..n].iter().rev().chain(&self.den[n..]).copied().collect();
        TransferFunction { num: theta[n..n + nb].iter().rev().copied().collect(), den, L: theta[n + nb] }
    }

    /// Poles, 1/s.
    pub fn poles(&self) -> Vec<(f64, f64)> {
        all_roots(&self.den)
    }

    /// Zeros, 1/s.
    pub fn zeros(&self) -> Vec<(f64, f64)> {
        all_roots(&self.num)
    }

    /// `G(0)`; infinite with a pole there.
    pub fn dc_gain(&self) -> f64 {
        let constant = |p: &[f64]| p.last().copied().unwrap_or(0.0);
        let (b, a) = (constant(&self.num), constant(&self.den));
        if a == 0.0 {
            f64::INFINITY.copysign(self.num.iter().rev().find(|&&c| c != 0.0).map_or(1.0, |c| *c))
        } else {
            b / a
        }
    }

    /// Times another one.
    pub fn times(&self, other: &Self) -> Self {
        TransferFunction {
            num: product(&self.num, &other.num),
            den: product(&self.den, &other.den),
            L: self.L + other.L,
        }
    }

    /// Response at the times `t >= 0`, ascending or not, to a unit step at time 0.
    pub fn step_response(&self, t: &[f64]) -> Vec<f64> {
        let plant = Realisation::of(self);
        t.iter().map(|&t| if t < self.L { 0.0 } else { plant.step(t - self.L) }).collect()
    }

    /// Phase of `G(j w)` in degrees without jumps, from where the gain puts it at low frequencies: 0 or -180,
    /// and -90 for each pole at 0.
    pub fn phase_deg(&self, w: f64) -> f64 {
        // (j w - r) / (-r) starts at 0 and stays in one half-plane.
        let turn = |(re, im): (f64, f64)| {
            if re == 0.0 && im == 0.0 {
                return 0.5 * PI;
            }
            let side = if re > 0.0 { -1.0 } else { 1.0 };
            (side * (w - im)).atan2(-side * re) - (-side * im).atan2(-side * re)
        };
        let sum = |roots: Vec<(f64, f64)>| roots.into_iter().map(turn).sum::<f64>();
        let low = |p: &[f64]| p.iter().rev().find(|&&c| c != 0.0).copied().unwrap_or(1.0);
        let sign = if low(&self.num) * low(&self.den) < 0.0 { -PI } else { 0.0 };
        (sign + sum(self.zeros()) - sum(self.poles()) - w * self.L).to_degrees()
    }

    /// Refuses what is no proper transfer function (M12).
    pub fn check(&self) -> Result<()> {
        let refuse = |text: String| {
            Err(Error::new("M12", text)
                .remedy("give num and den in descending powers of s, den the longer one"))
        };
        if self.num.iter().chain(&self.den).any(|c| !c.is_finite()) || self.num.iter().all(|&c| c == 0.0) {
            return refuse(format!("num {:?} or den {:?} is not finite, or num is zero", self.num, self.den));
        }
        if self.den.first().is_none_or(|&a| a == 0.0) || degree(&self.num) > degree(&self.den) {
            return refuse(
                "the numerator has a higher power of s than the denominator: no plant has".to_owned(),
            );
        }
        if !(self.L >= 0.0 && self.L.is_finite()) {
            return refuse(format!("`L` is {}, must be zero or positive", self.L));
        }
        Ok(())
    }
}

/// `p(s)`, descending powers.
pub fn horner(p: &[f64], s: Complex<f64>) -> Complex<f64> {
    p.iter().fold(Complex::new(0.0, 0.0), |sum, &c| sum * s + c)
}

fn degree(p: &[f64]) -> usize {
    p.iter().position(|&c| c != 0.0).map_or(0, |first| p.len() - 1 - first)
}

/// Every root, those at 0 as well.
fn all_roots(p: &[f64]) -> Vec<(f64, f64)> {
    let at_zero = p.iter().rev().take_while(|&&c| c == 0.0).count().min(p.len().saturating_sub(1));
    roots(p).into_iter().chain(std::iter::repeat_n((0.0, 0.0), at_zero)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `1 / (s + 1)^3` answers a step by `1 - e^-t (1 + t + t^2/2)`.
    #[test]
    fn equal_poles_are_no_special_case() {
        let G = TransferFunction { num: vec![1.0], den: vec![1.0, 3.0, 3.0, 1.0], L: 0.5 };
        for (t, y) in [0.0, 0.4, 0.5, 1.7, 30.0].iter().zip(G.step_response(&[0.0, 0.4, 0.5, 1.7, 30.0])) {
            let x: f64 = (t - 0.5f64).max(0.0);
            assert!((y - (1.0 - (-x).exp() * (1.0 + x + x * x / 2.0))).abs() < 1e-13, "{t}: {y}");
        }
    }

    #[test]
    fn an_integrator_has_its_pole_at_zero() {
        let G = TransferFunction { num: vec![-2.0], den: vec![5.0, 1.0, 0.0], L: 0.0 };
        let mut poles = G.poles();
        poles.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert!((poles[0].0 + 0.2).abs() < 1e-15 && poles[1] == (0.0, 0.0));
        assert_eq!(G.dc_gain(), f64::NEG_INFINITY);
    }
}
