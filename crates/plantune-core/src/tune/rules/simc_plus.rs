//! Improved SIMC, where the dead time may dominate.
//!
//! ```text
//! PI:   Kp = (T + L / 3) / (K (tau_c + L)),  Ti = min(T + L / 3, 4 (tau_c + L)),  tau_c = L by default
//! PID:  Kc (1 + 1 / (t_I s)) (1 + t_D s),    Kc = T / (K (tau_c + L)),            tau_c = L / 2 by default
//!       t_I = min(T, 4 (tau_c + L)),  t_D = L / 3
//!       Kp = Kc (1 + t_D / t_I),  Ti = t_I + t_D,  Td = t_I t_D / Ti,  Tf = Td / 10
//! integrating, K / s:  T / K becomes 1 / K, and T is longer than all else
//! ```
//!
//! PI: C. Grimholt and S. Skogestad, Optimal PI-control and verification of the SIMC tuning rule, IFAC
//! Conference on Advances in PID Control (2012). PID: the same, Optimal PI and PID control of first-order
//! plus delay processes and evaluation of the original and improved SIMC rules, J. Process Control 70
//! (2018). The default `tau_c = L / 2` of the PID we found in no second source; with it `Ms` stays below 1.8
//! for every dead time. The filter is ours. A negative gain gives a negative `Kp`.

use super::{Terms, cascade, tau_c_or};
use crate::error::Result;
use crate::model::{Fopdt, Model, Pid};
use crate::tune::rule::{Found, Integrating, Rule, Settings};

/// Settings and the closed-loop time constant, s; without a wish it follows the dead time.
pub fn simc_plus(model: &Model, tau_c: Option<f64>, terms: Terms) -> Result<Settings> {
    let share = if terms == Terms::Pi { 1.0 } else { 0.5 };
    let wish = |L| tau_c_or(tau_c, share, L, "SIMC+ without tau_c");
    let first = |&Fopdt { K, T, L }: &Fopdt| -> Found {
        let (tau_c, third) = (wish(L)?, L / 3.0);
        let closed = tau_c + L;
        let settings = match terms {
            Terms::Pi => Pid::pi((T + third) / (K * closed), (T + third).min(4.0 * closed)),
            Terms::Pid => cascade(T / (K * closed), T.min(4.0 * closed), third),
        };
        Ok((settings, tau_c))
    };
    let integrating = |&Integrating { K, L, .. }: &Integrating| -> Found {
        let (tau_c, third) = (wish(L)?, if terms == Terms::Pi { 0.0 } else { L / 3.0 });
        let closed = tau_c + L;
        Ok((cascade(1.0 / (K * closed), 4.0 * closed, third), tau_c))
    };
    Rule { integrating: Some(&integrating), ..Rule::new("SIMC+", &first) }.on(model, tau_c)
}
