//! SIMC settings, PI and PID, for plants that settle and plants that integrate.
//!
//! ```text
//! Kc (1 + 1 / (t_I s)) (1 + t_D s),  tau_c = L unless wished otherwise
//! one lag T:        Kc = T / (K (tau_c + L)),   t_I = min(T, 4 (tau_c + L)),   t_D = 0
//! two, T1 >= T2:    Kc = T1 / (K (tau_c + L)),  t_I = min(T1, 4 (tau_c + L)),  t_D = T2
//! integrating:      Kc = 1 / (K (tau_c + L)),   t_I = 4 (tau_c + L),           t_D = T, the lag's
//! standard form:    Kp = Kc (1 + t_D / t_I),  Ti = t_I + t_D,  Td = t_I t_D / Ti
//!                   Tf = min(Td, (tau_c + L) / 2) / 10
//! ```
//!
//! A PI is for one lag or an integrator alone; other plants are reduced to that. A PID on one lag is a PI. The
//! gain of IMC; the shorter integral time lets a slow plant recover from a load. S. Skogestad, Simple
//! analytic rules for model reduction and PID controller tuning, J. Process Control 13 (2003). The filter is
//! ours: a tenth of a `t_D` far longer than the dead time would cost the margin. A negative gain gives a
//! negative `Kp`.

use super::{Terms, cascade, tau_c_or};
use crate::error::Result;
use crate::model::{Fopdt, Model, Pid};
use crate::tune::rule::{Integrating, Rule, Second, Settings};

/// Settings and the closed-loop time constant, s; without a wish it is the dead time.
pub fn simc(model: &Model, tau_c: Option<f64>, terms: Terms) -> Result<Settings> {
    let lags = |K: f64, (T1, T2): (f64, f64), L: f64| {
        let tau_c = wish(tau_c, L)?;
        Ok((series(T1 / K, T1, T2, tau_c + L), tau_c))
    };
    let with_derivative = terms == Terms::Pid;
    let second = |plant: &Second| lags(plant.K, plant.times(), plant.L);
    Rule {
        second: if with_derivative { Some(&second) } else { None },
        integrating: Some(&|&Integrating { K, T, L }| {
            let tau_c = wish(tau_c, L)?;
            Ok((series(1.0 / K, f64::INFINITY, T, tau_c + L), tau_c))
        }),
        lagging: with_derivative,
        ..Rule::new("SIMC", &|&Fopdt { K, T, L }| lags(K, (T, 0.0), L))
    }
    .on(model, tau_c)
}

/// `slowness` is `T1 / K`, and `1 / K` of an integrating plant.
fn series(slowness: f64, T1: f64, t_D: f64, closed: f64) -> Pid {
    let pid = cascade(slowness / closed, T1.min(4.0 * closed), t_D);
    Pid { Tf: pid.Tf.min(0.05 * closed), ..pid }
}

fn wish(tau_c: Option<f64>, L: f64) -> Result<f64> {
    tau_c_or(tau_c, 1.0, L, "SIMC with tau_c = L")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_of_eight_delays_is_where_the_integral_time_turns() {
        for (T, Ti) in [(7.0, 7.0), (8.0, 8.0), (9.0, 8.0)] {
            let model = Fopdt { K: -2.0, T, L: 1.0 }.into();
            let Settings { pid, tau_c, reduced, .. } = simc(&model, None, Terms::Pi).expect("settings");
            assert_eq!((pid.Kp, pid.Ti(), tau_c, reduced), (-T / 4.0, Ti, 1.0, false));
        }
    }

    #[test]
    fn what_no_gain_gives_is_refused() {
        let plant = Fopdt { K: 2.0, T: 5.0, L: 0.0 }.into();
        let code = |tau_c| simc(&plant, tau_c, Terms::Pi).expect_err("a refusal").code();
        assert_eq!(code(None), "M12");
        for tau_c in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(code(Some(tau_c)), "U01", "{tau_c}");
        }
        let pid = simc(&plant, Some(0.5), Terms::Pi).expect("settings").pid;
        assert_eq!((pid.Kp, pid.Ti()), (5.0, 2.0));
    }
}
