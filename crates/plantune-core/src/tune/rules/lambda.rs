//! Lambda settings for first order plus dead time: the closed loop has the wished time constant.
//!
//! ```text
//! PI:   Kp = T / (K (tau_c + L)),                  Ti = T
//! PID:  Kp = (T + L / 2) / (K (tau_c + L / 2)),    Ti = T + L / 2
//!       Td = T L / (2 T + L),  Tf = Td / 10,       tau_c = 3 T unless wished otherwise
//! ```
//!
//! PI: E. B. Dahlin, Designing and tuning digital controllers, Instruments and Control Systems 41 (1968),
//! and IMC-PI by another name. PID: D. E. Rivera, M. Morari and S. Skogestad, Internal model control: PID
//! controller design, Ind. Eng. Chem. Process Des. Dev. 25 (1986), from the dead time as `(1 - L s / 2) /
//! (1 + L s / 2)`, for `tau_c` above `0.8 L`; its filter is ours. A negative gain gives a negative `Kp`.

use super::{ImcTarget, Terms, check_tau_c, imc_pi, pid};
use crate::error::Result;
use crate::model::{Fopdt, Pid, check_fopdt};

/// Settings and the closed-loop time constant, s; without a wish it is three times that of the plant.
pub fn lambda(model: &Fopdt, tau_c: Option<f64>, terms: Terms) -> Result<(Pid, f64)> {
    check_fopdt(model)?;
    let Fopdt { K, T, L } = *model;
    let tau_c = check_tau_c(tau_c.unwrap_or(3.0 * T), L)?;
    match terms {
        Terms::Pi => imc_pi(model, ImcTarget::TauC(tau_c)),
        Terms::Pid => {
            let Ti = T + 0.5 * L;
            Ok((pid(Ti / (K * (tau_c + 0.5 * L)), Ti, 0.5 * L * (T / Ti)), tau_c))
        }
    }
}
