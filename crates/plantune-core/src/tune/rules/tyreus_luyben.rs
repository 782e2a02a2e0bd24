//! Tyreus-Luyben settings from the exact ultimate gain and period of the model.
//!
//! ```text
//! w L + atan(w T) = pi,  K_u = sqrt(1 + (w T)^2) / K,  T_u = 2 pi / w
//! PI:   Kp = K_u / 3.2,  Ti = 2.2 T_u
//! PID:  Kp = K_u / 2.2,  Ti = 2.2 T_u,  Td = T_u / 6.3,  Tf = Td / 10
//! ```
//!
//! B. D. Tyreus and W. L. Luyben, Tuning PI controllers for integrator/dead time processes, Ind. Eng. Chem.
//! Res. 31 (1992): the PI gives an integrator with dead time a largest closed-loop gain of 2 dB. The PID is
//! that of the textbooks of Luyben; its filter is ours. A negative gain gives a negative `Kp`.

use std::f64::consts::PI;

use super::{Terms, check_delayed, pid};
use crate::error::Result;
use crate::model::{Fopdt, Pid};

/// Settings; the plant must have a dead time.
pub fn tyreus_luyben(model: &Fopdt, terms: Terms) -> Result<Pid> {
    check_delayed(model, "Tyreus-Luyben")?;
    let (K_u, T_u) = ultimate(model);
    Ok(match terms {
        Terms::Pi => Pid::pi(K_u / 3.2, 2.2 * T_u),
        Terms::Pid => pid(K_u / 2.2, 2.2 * T_u, T_u / 6.3),
    })
}

/// Gain and period at which the loop under a proportional controller oscillates for ever.
pub(in crate::tune) fn ultimate(model: &Fopdt) -> (f64, f64) {
    let Fopdt { K, T, L } = *model;
    // x = w L lies in [pi/2, pi] and is where x = pi - atan(x T / L); the right side changes by at most
    // 1/pi of what x does, so that each step gains half a digit.
    let x = (0..40).fold(PI, |x, _| PI - (x * T / L).atan());
    ((x * T / L).hypot(1.0) / K, 2.0 * PI * L / x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_phase_at_the_ultimate_period_is_half_a_turn() {
        for (T, L) in [(1.0, 1e-6), (1.0, 0.1), (3.0, 3.0), (0.2, 40.0), (1e-6, 1.0)] {
            let model = Fopdt { K: -2.0, T, L };
            let (K_u, T_u) = ultimate(&model);
            let G = model.freqresp(2.0 * PI / T_u);
            assert!((G * K_u + 1.0).norm() < 1e-9, "{T} {L}: {}", G * K_u);
        }
    }
}
