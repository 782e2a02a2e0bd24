//! The charge of a piezo actuator and its leak, driven by a current.
//!
//! ```text
//! i_t = i_c + i_l,  q' = i_c,  V = q/C,  y = G q                       source 002, 3.2 and (6)
//! i_l = V/X(i_l),   X(i) = R / sqrt((a i)^2 + 1)                       (5): R = 21 Gohm, a = 3.4e7 1/A
//!     = V / sqrt(R^2 - (a V)^2),   |V| < R/a
//! ```
//!
//! The current is held over a sample. Around the charge at its start the leak is a straight line of slope `g`, and
//! then `q <- q + (1 - e^(-g h))/g (i_t - i_l)` is exact after `h`; what the curve adds to the line, `rho`, decays at
//! the same rate and is summed by Simpson's rule. With `a = 0` the leak is a resistor, and `rho` is 0.

use super::super::{Operator, copy_state};
use super::check_Ts;
use crate::error::{Error, Result};

/// Nearest that the voltage comes to `R/a`, where the leak takes any current.
const NEAREST: f64 = 1.0 - 1e-9;

/// Capacitance, leak, and the output of a charge.
#[derive(Clone, Debug, PartialEq)]
pub struct ChargeLeak {
    /// Capacitance, F.
    pub C: f64,
    /// Leak resistance without current, ohm.
    pub R: f64,
    /// How the leak opens with its current, 1/A; 0 for a resistor.
    pub a: f64,
    /// Output per charge, y/(A s).
    pub G: f64,
    /// Sample time, s.
    pub Ts: f64,
}

impl ChargeLeak {
    pub(in super::super) fn check(&self) -> Result<()> {
        check_Ts(self.Ts)?;
        for (name, value) in [("C", self.C), ("R", self.R)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::argument(name, value, "positive"));
            }
        }
        if !(self.a >= 0.0 && self.a.is_finite()) {
            return Err(Error::argument("a", self.a, "0 or positive, in 1/A"));
        }
        if !(self.G != 0.0 && self.G.is_finite()) {
            return Err(Error::argument("G", self.G, "finite, and not 0"));
        }
        Ok(())
    }

    pub(in super::super) fn start(&self) -> Box<dyn Operator> {
        Box::new(Charge { model: self.clone(), q: [0.0] })
    }

    /// `X`, ohm, at the leak current `i`, A. Source 002, (5).
    pub fn resistance(&self, i: f64) -> f64 {
        self.R / (self.a * i).hypot(1.0)
    }

    /// Current through the leak, A, at `V`; it holds the charge where it is. Infinite from `R/a` on.
    pub fn leak(&self, V: f64) -> f64 {
        let rest = (self.R - self.a * V) * (self.R + self.a * V);
        if rest > 0.0 { V / rest.sqrt() } else { f64::INFINITY.copysign(V) }
    }

    /// Charge after a sample of the current `i`.
    fn after(&self, q: f64, i: f64) -> f64 {
        let (h, leak) = (self.Ts, self.leak_of(q));
        let V = self.within(q);
        let rest = (self.R - self.a * V) * (self.R + self.a * V);
        // d i_l/d q = R^2 / rest^(3/2) / C
        let g = self.R / rest * (self.R / rest.sqrt()) / self.C;
        let along = |h: f64| q - (-g * h).exp_m1() / g * (i - leak);
        let rho = |p: f64| self.leak_of(p) - leak - g * (p - q);
        let (half, whole) = (along(0.5 * h), along(h));
        whole - h / 6.0 * (4.0 * rho(half) * (-0.5 * g * h).exp() + rho(whole))
    }

    fn leak_of(&self, q: f64) -> f64 {
        self.leak(self.within(q))
    }

    /// Voltage of a charge, short of where the leak takes any current.
    fn within(&self, q: f64) -> f64 {
        let most = if self.a > 0.0 { NEAREST * self.R / self.a } else { f64::INFINITY };
        (q / self.C).clamp(-most, most)
    }
}

/// The charge at work; the output is that before the current of the sample has acted.
struct Charge {
    model: ChargeLeak,
    q: [f64; 1],
}

impl Operator for Charge {
    fn step(&mut self, i: f64) -> f64 {
        let y = self.model.G * self.q[0];
        self.q[0] = self.model.after(self.q[0], i);
        y
    }

    fn state(&self) -> Vec<f64> {
        self.q.to_vec()
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        copy_state(&mut self.q, state)
    }
}
