//! PID in two-degree-of-freedom standard form:
//!
//! ```text
//! u = Kp [ b r - y + (1/Ti) ∫(r - y) dt + Td d/dt (c r - y) / (Tf s + 1) ]
//! ```
//!
//! A sampled controller uses backward Euler for the integral and the filtered derivative.

use crate::error::{Error, Result};
use crate::linalg::Complex;

/// Controller settings; `Ti` may be infinite, `Ts` is absent for a continuous controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pid {
    /// Proportional gain, u/y.
    pub Kp: f64,
    /// Integral gain `Kp / Ti`, u/(y s); a pure integral controller has it without `Kp`.
    pub Ki: f64,
    /// Derivative time, s.
    pub Td: f64,
    /// Derivative filter time, s.
    pub Tf: f64,
    /// Set-point weight on P.
    pub b: f64,
    /// Set-point weight on D.
    pub c: f64,
    /// Sample time, s.
    pub Ts: Option<f64>,
}

impl Pid {
    /// PI on the error.
    pub fn pi(Kp: f64, Ti: f64) -> Self {
        Pid { Kp, Ki: Kp / Ti, Td: 0.0, Tf: 0.0, b: 1.0, c: 0.0, Ts: None }
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
        let one = Complex::new(1.0, 0.0);
        match self.Ts {
            None => {
                let s = Complex::new(0.0, w);
                one * self.Kp + self.Ki / s + s * self.Kp * self.Td / (s * self.Tf + 1.0)
            }
            Some(Ts) => {
                let z = Complex::from_polar(1.0, w * Ts);
                let difference = (one - z.inv()) / Ts;
                one * self.Kp
                    + self.Ki / difference
                    + difference * self.Kp * self.Td / (difference * self.Tf + 1.0)
            }
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
        if self.Ts.is_some_and(|Ts| !(Ts > 0.0)) {
            return Err(Error::argument("Ts", format!("{:?}", self.Ts), "positive or None"));
        }
        Ok(())
    }
}
