//! PID in two-degree-of-freedom standard form:
//!
//! ```text
//! u = Kp [ b r - y + (1/Ti) ∫(r - y) dt + Td d/dt (c r - y) / (Tf s + 1) ]
//! ```
//!
//! With the filter on y instead, `y` stands for `F y`, `F(s) = 1 / (1 + Tf s + (Tf s)^2 / 2)`, everywhere,
//! and D has no filter of its own. A sampled controller is backward Euler: `s = (1 - z^-1) / Ts`.

use super::TransferFunction;
use crate::error::{Error, Result};
use crate::linalg::Complex;
use crate::poly::product;

/// Where the controller filters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// First order on the derivative.
    D1,
    /// Second order on the measured output.
    Y2,
}

/// Controller settings; `Ti` may be infinite, `Ts` is absent for a continuous controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pid {
    /// Proportional gain, u/y.
    pub Kp: f64,
    /// Integral gain `Kp / Ti`, u/(y s); a pure integral controller has it without `Kp`.
    pub Ki: f64,
    /// Derivative time, s.
    pub Td: f64,
    /// Filter time, s.
    pub Tf: f64,
    /// Set-point weight on P.
    pub b: f64,
    /// Set-point weight on D.
    pub c: f64,
    /// Where it filters.
    pub filter: Filter,
    /// Sample time, s.
    pub Ts: Option<f64>,
}

/// Numerators of unit gains of P, I and D over a common denominator, descending powers of s.
pub struct Terms {
    /// Of the proportional term.
    pub p: Vec<f64>,
    /// Of the integral term.
    pub i: Vec<f64>,
    /// Of the derivative.
    pub d: Vec<f64>,
    /// Of all three, the pole at 0 included.
    pub den: Vec<f64>,
    /// Denominator of the filter that y passes, and the set point does not.
    pub on_y: Vec<f64>,
}

/// `sum_k gain_k p_k`, aligned at their constant terms, without leading zeros.
pub fn weighted<const N: usize>(terms: [(f64, &Vec<f64>); N]) -> Vec<f64> {
    let longest = terms.iter().map(|(_, p)| p.len()).max().unwrap_or(0);
    let mut sum = vec![0.0; longest];
    for (gain, p) in terms {
        let from = longest - p.len();
        sum[from..].iter_mut().zip(p).for_each(|(s, c)| *s += gain * c);
    }
    let first = sum.iter().position(|&c| c != 0.0).unwrap_or(longest.saturating_sub(1));
    sum.split_off(first)
}

/// `Ts^n p(s)` at `s = (1 - q^-1) / Ts`, ascending in `q^-1`; `p` of degree `n` at most.
pub fn backward_euler(p: &[f64], Ts: f64, n: usize) -> Vec<f64> {
    let mut power = vec![1.0];
    let mut sum = vec![0.0; n + 1];
    for (k, c) in p.iter().rev().enumerate() {
        let scale = c * Ts.powi((n - k) as i32);
        sum.iter_mut().zip(&power).for_each(|(s, x)| *s += scale * x);
        power = product(&power, &[1.0, -1.0]);
    }
    sum
}

impl Pid {
    /// PI on the error.
    pub fn pi(Kp: f64, Ti: f64) -> Self {
        Pid { Kp, Ki: Kp / Ti, Td: 0.0, Tf: 0.0, b: 1.0, c: 0.0, filter: Filter::D1, Ts: None }
    }

    /// Integral time, s.
    pub fn Ti(&self) -> f64 {
        if self.Ki == 0.0 { f64::INFINITY } else { self.Kp / self.Ki }
    }

    /// Derivative gain `Kp Td`, u s/y.
    pub fn Kd(&self) -> f64 {
        self.Kp * self.Td
    }

    /// From `-y` to `u` at `w` rad/s.
    pub fn freqresp(&self, w: f64) -> Complex<f64> {
        let s = match self.Ts {
            None => Complex::new(0.0, w),
            Some(Ts) => (Complex::new(1.0, 0.0) - Complex::from_polar(1.0, -w * Ts)) / Ts,
        };
        // Without integral action nothing is infinite at 0.
        let pi = if self.Ki == 0.0 { Complex::new(self.Kp, 0.0) } else { s.inv() * self.Ki + self.Kp };
        match self.filter {
            Filter::D1 => pi + s * self.Kd() / (s * self.Tf + 1.0),
            Filter::Y2 => (pi + s * self.Kd()) / (s * self.Tf * (s * self.Tf * 0.5 + 1.0) + 1.0),
        }
    }

    /// Of a continuous controller numerator and denominator.
    pub fn transfer(&self) -> TransferFunction {
        let Terms { p, i, d, den, .. } = self.terms();
        let num = weighted([(self.Kp, &p), (self.Ki, &i), (self.Kd(), &d)]);
        self.proper(num, den)
    }

    /// From the set point to `u`: with the weights `b` and `c`, over the denominator of [`Pid::transfer`].
    pub fn set_point_transfer(&self) -> TransferFunction {
        let Terms { p, i, d, den, on_y } = self.terms();
        let num = weighted([(self.b * self.Kp, &p), (self.Ki, &i), (self.c * self.Kd(), &d)]);
        self.proper(product(&num, &on_y), den)
    }

    /// The terms of a continuous controller over one denominator.
    pub fn terms(&self) -> Terms {
        let (Tf, one, s) = (self.Tf, vec![1.0], [1.0, 0.0]);
        match self.filter {
            Filter::D1 => {
                let filter = if Tf > 0.0 && self.Kd() != 0.0 { vec![Tf, 1.0] } else { one.clone() };
                let p = product(&filter, &s);
                Terms { den: p.clone(), p, i: filter, d: vec![1.0, 0.0, 0.0], on_y: one }
            }
            Filter::Y2 => {
                let filter = if Tf > 0.0 { vec![0.5 * Tf * Tf, Tf, 1.0] } else { one.clone() };
                Terms {
                    den: product(&filter, &s),
                    p: s.to_vec(),
                    i: one,
                    d: vec![1.0, 0.0, 0.0],
                    on_y: filter,
                }
            }
        }
    }

    /// Without the pole at 0 that a controller of no integral action has not.
    fn proper(&self, num: Vec<f64>, den: Vec<f64>) -> TransferFunction {
        let cut = |p: Vec<f64>| if self.Ki == 0.0 && p.len() > 1 { p[..p.len() - 1].to_vec() } else { p };
        TransferFunction { num: cut(num), den: cut(den), L: 0.0 }
    }

    /// Of a sampled controller numerator and denominator in `q^-1`: `s = (1 - q^-1) / Ts`.
    pub fn pulse_transfer(&self, Ts: f64) -> (Vec<f64>, Vec<f64>) {
        let C = self.transfer();
        let n = C.num.len().max(C.den.len()) - 1;
        (backward_euler(&C.num, Ts, n), backward_euler(&C.den, Ts, n))
    }

    /// `|C|` where the frequency grows beyond all bounds; infinite for an unfiltered derivative.
    pub fn gain_beyond(&self) -> f64 {
        match (self.filter, self.Tf > 0.0, self.Kd() == 0.0) {
            (Filter::Y2, true, _) => 0.0,
            (_, _, true) => self.Kp.abs(),
            (_, false, _) => f64::INFINITY,
            (Filter::D1, true, _) => (self.Kp + self.Kd() / self.Tf).abs(),
        }
    }

    /// Refuses settings that are not numbers or not a controller.
    pub fn check(&self) -> Result<()> {
        let finite = [self.Kp, self.Ki, self.Td, self.Tf, self.b, self.c].iter().all(|x| x.is_finite());
        if !finite {
            return Err(Error::argument("pid", format!("{self:?}"), "finite"));
        }
        if self.Td < 0.0 || self.Tf < 0.0 || self.Ki * self.Kp < 0.0 {
            return Err(Error::argument("pid", format!("{self:?}"), "of one sign, with Td, Tf >= 0"));
        }
        if self.filter == Filter::Y2 && self.c != 0.0 && self.Td > 0.0 {
            return Err(Error::argument("c", self.c, "0 with a filter on y: nothing filters the set point"));
        }
        if self.Ts.is_some_and(|Ts| !(Ts > 0.0)) {
            return Err(Error::argument("Ts", format!("{:?}", self.Ts), "positive or None"));
        }
        Ok(())
    }
}
