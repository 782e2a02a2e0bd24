//! SIMC-PI for first order plus dead time.
//!
//! ```text
//! Kp = T / (K (tau_c + L)),  Ti = min(T, 4 (tau_c + L)),  tau_c = L unless wished otherwise
//! ```
//!
//! The gain of IMC-PI; the shorter integral time lets a slow plant recover from a load.
//! S. Skogestad, Simple analytic rules for model reduction and PID controller tuning, J. Process
//! Control 13 (2003). A negative gain gives a negative `Kp`.

use super::{check_delayed, check_tau_c};
use crate::error::Result;
use crate::model::{Fopdt, Pid, check_fopdt};

/// Settings and the closed-loop time constant, s; without a wish it is the dead time.
pub fn simc(model: &Fopdt, tau_c: Option<f64>) -> Result<(Pid, f64)> {
    check_fopdt(model)?;
    let Fopdt { K, T, L } = *model;
    let tau_c = match tau_c {
        Some(wish) => check_tau_c(wish, L)?,
        None => {
            check_delayed(model, "SIMC with tau_c = L")?;
            L
        }
    };
    Ok((Pid::pi(T / (K * (tau_c + L)), T.min(4.0 * (tau_c + L))), tau_c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_of_eight_delays_is_where_the_integral_time_turns() {
        for (T, Ti) in [(7.0, 7.0), (8.0, 8.0), (9.0, 8.0)] {
            let (pid, tau_c) = simc(&Fopdt { K: -2.0, T, L: 1.0 }, None).expect("settings");
            assert_eq!((pid.Kp, pid.Ti(), tau_c), (-T / 4.0, Ti, 1.0));
        }
    }

    #[test]
    fn what_no_gain_gives_is_refused() {
        let plant = Fopdt { K: 2.0, T: 5.0, L: 0.0 };
        let code = |tau_c| simc(&plant, tau_c).expect_err("a refusal").code();
        assert_eq!(code(None), "M12");
        for tau_c in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(code(Some(tau_c)), "U01", "{tau_c}");
        }
        let (pid, _) = simc(&plant, Some(0.5)).expect("settings");
        assert_eq!((pid.Kp, pid.Ti()), (5.0, 2.0));
    }
}
