//! IMC-PI for first order plus dead time.
//!
//! ```text
//! Kp = T / (K (tau_c + L)),  Ti = T                         (3.6-18), (3.6-19)
//! loop: e^(-L s) / (s (tau_c + L))                          (3.6-31)
//! tau_c = (2 A_M / pi - 1) L                                (3.6-41), gain margin A_M
//! tau_c = (1 / (pi/2 - phi_M) - 1) L                        (3.6-43), phase margin phi_M
//! ```
//!
//! Source 001, 3.6.5 and 3.6.6; `tau_c` is its `T_F`. A negative gain gives a negative `Kp`.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::error::{Error, Result};
use crate::model::{Pid, ProcessModel, check_process};

/// What fixes the closed-loop time constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImcTarget {
    /// As a factor, above `pi / 2`.
    GainMargin(f64),
    /// In degrees, from 32.704 to below 90.
    PhaseMargin(f64),
    /// Closed-loop time constant, s.
    TauC(f64),
}

/// Settings and the closed-loop time constant `tau_c`, s.
pub fn imc_pi(model: &ProcessModel, target: ImcTarget) -> Result<(Pid, f64)> {
    check_process(model)?;
    let ProcessModel { K, T, L } = *model;
    let tau_c = tau_c(L, target)?;
    Ok((Pid::pi(T / (K * (tau_c + L)), T), tau_c))
}

fn tau_c(L: f64, target: ImcTarget) -> Result<f64> {
    let no_delay = |name: &str| {
        Error::new("M12", format!("a plant without delay reaches any `{name}`: it does not fix the settings"))
            .remedy("give tau_c, the wished closed-loop time constant in seconds")
    };
    match target {
        ImcTarget::GainMargin(A) if A > FRAC_PI_2 && A.is_finite() => {
            if L > 0.0 {
                Ok((2.0 * A / PI - 1.0) * L)
            } else {
                Err(no_delay("gain_margin"))
            }
        }
        ImcTarget::GainMargin(A) => {
            Err(Error::argument("gain_margin", A, "a factor above pi/2 = 1.5708 (3 is 9.54 dB)"))
        }
        ImcTarget::PhaseMargin(degrees) => {
            let rest = FRAC_PI_2 - degrees.to_radians();
            if !(rest > 0.0 && rest < 1.0) {
                return Err(Error::argument("phase_margin", degrees, "between 32.704 and 90 degrees"));
            }
            if L > 0.0 { Ok((1.0 / rest - 1.0) * L) } else { Err(no_delay("phase_margin")) }
        }
        ImcTarget::TauC(tau) if tau >= 0.0 && tau + L > 0.0 && tau.is_finite() => Ok(tau),
        ImcTarget::TauC(tau) => Err(Error::argument("tau_c", tau, "zero or positive, with tau_c + L > 0")),
    }
}
