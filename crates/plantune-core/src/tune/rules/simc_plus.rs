//! Improved SIMC for first order plus dead time, where the dead time may dominate.
//!
//! ```text
//! PI:   Kp = (T + L / 3) / (K (tau_c + L)),  Ti = min(T + L / 3, 4 (tau_c + L)),  tau_c = L by default
//! PID:  Kc (1 + 1 / (t_I s)) (1 + t_D s),    Kc = T / (K (tau_c + L)),            tau_c = L / 2 by default
//!       t_I = min(T, 4 (tau_c + L)),  t_D = L / 3
//!       Kp = Kc (1 + t_D / t_I),  Ti = t_I + t_D,  Td = t_I t_D / Ti,  Tf = Td / 10
//! ```
//!
//! PI: C. Grimholt and S. Skogestad, Optimal PI-control and verification of the SIMC tuning rule, IFAC
//! Conference on Advances in PID Control (2012). PID: the same, Optimal PI and PID control of first-order
//! plus delay processes and evaluation of the original and improved SIMC rules, J. Process Control 70
//! (2018). The filter is ours. A negative gain gives a negative `Kp`.

use super::{Terms, check_delayed, check_tau_c, pid};
use crate::error::Result;
use crate::model::{Fopdt, Pid, check_fopdt};

/// Settings and the closed-loop time constant, s; without a wish it follows the dead time.
pub fn simc_plus(model: &Fopdt, tau_c: Option<f64>, terms: Terms) -> Result<(Pid, f64)> {
    check_fopdt(model)?;
    let Fopdt { K, T, L } = *model;
    let tau_c = match tau_c {
        Some(wish) => check_tau_c(wish, L)?,
        None => {
            check_delayed(model, "SIMC+ without tau_c")?;
            if terms == Terms::Pi { L } else { 0.5 * L }
        }
    };
    let (closed, third) = (tau_c + L, L / 3.0);
    Ok(match terms {
        Terms::Pi => (Pid::pi((T + third) / (K * closed), (T + third).min(4.0 * closed)), tau_c),
        Terms::Pid => {
            let t_I = T.min(4.0 * closed);
            let Ti = t_I + third;
            (pid(T / (K * closed) * (Ti / t_I), Ti, third * (t_I / Ti)), tau_c)
        }
    })
}
