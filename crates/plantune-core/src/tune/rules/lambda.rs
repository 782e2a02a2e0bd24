//! Lambda settings: the closed loop has the wished time constant.
//!
//! ```text
//! one lag, tau_c = 3 T unless wished otherwise:
//! PI:   Kp = T / (K (tau_c + L)),                  Ti = T
//! PID:  Kp = (T + L / 2) / (K (tau_c + L / 2)),    Ti = T + L / 2,  Td = T L / (2 T + L)
//! two lags, tau_c = 3 T1:
//! PID:  Kp = (T1 + T2) / (K (tau_c + L)),          Ti = T1 + T2,    Td = T1 T2 / Ti
//! integrating, tau_c = 3 L:
//! PI:   Kp = Ti / (K (tau_c + L)^2),               Ti = 2 tau_c + L
//! PID:  Kp = Ti / (K (tau_c + L)^2),               Ti = 2 tau_c + L + T,  Td = (2 tau_c + L) T / Ti
//! PID without a lag:  Kp = Ti / (K (tau_c + L / 2)^2),  Ti = 2 tau_c + L,  Td = (tau_c L + L^2 / 4) / Ti
//! every PID: Tf = Td / 10
//! ```
//!
//! PI: E. B. Dahlin, Designing and tuning digital controllers, Instruments and Control Systems 41 (1968),
//! and IMC-PI by another name. PID: D. E. Rivera, M. Morari and S. Skogestad, Internal model control: PID
//! controller design, Ind. Eng. Chem. Process Des. Dev. 25 (1986), from the dead time as `(1 - L s / 2) /
//! (1 + L s / 2)`, which two independent public copies have; their range, `tau_c` above `0.8 L`, is in none that
//! we found. Integrating: I.-L. Chien and P. S. Fruehauf, Consider IMC tuning
//! to improve controller performance, Chem. Eng. Prog. 86 (1990), which are the IMC controllers of the two
//! approximations of the dead time. A load is arrested within `tau_c`, of which practice takes `3 L` at least. The
//! filter is ours. A negative gain gives a negative `Kp`.

use super::{Terms, cascade, check_tau_c, pid};
use crate::error::Result;
use crate::model::{Fopdt, Model, Pid};
use crate::tune::rule::{Found, Integrating, Rule, Second, Settings};

/// Settings and the closed-loop time constant, s; without a wish it is three times the slowest time.
pub fn lambda(model: &Model, tau_c: Option<f64>, terms: Terms) -> Result<Settings> {
    let with_derivative = terms == Terms::Pid;
    let first = |&Fopdt { K, T, L }: &Fopdt| -> Found {
        let tau_c = check_tau_c(tau_c.unwrap_or(3.0 * T), L)?;
        let settings = if with_derivative {
            let Ti = T + 0.5 * L;
            pid(Ti / (K * (tau_c + 0.5 * L)), Ti, 0.5 * L * (T / Ti))
        } else {
            Pid::pi(T / (K * (tau_c + L)), T)
        };
        Ok((settings, tau_c))
    };
    let second = |plant: &Second| -> Found {
        let (T1, T2) = plant.times();
        let tau_c = check_tau_c(tau_c.unwrap_or(3.0 * T1), plant.L)?;
        Ok((cascade(T1 / (plant.K * (tau_c + plant.L)), T1, T2), tau_c))
    };
    let integrating = |&Integrating { K, T, L }: &Integrating| -> Found {
        let tau_c = check_tau_c(tau_c.unwrap_or(3.0 * L), L)?;
        let (t_I, closed) = (2.0 * tau_c + L, tau_c + L);
        let settings = if with_derivative && T == 0.0 {
            let half = tau_c + 0.5 * L;
            pid(t_I / (K * half * half), t_I, (tau_c * L + 0.25 * L * L) / t_I)
        } else {
            cascade(t_I / (K * closed * closed), t_I, T)
        };
        Ok((settings, tau_c))
    };
    Rule {
        second: if with_derivative { Some(&second) } else { None },
        integrating: Some(&integrating),
        lagging: with_derivative,
        ..Rule::new("lambda tuning", &first)
    }
    .on(model, tau_c)
}
