//! Series (interacting) form, with the filter behind the lead: primed letters are those of the series form.
//!
//! ```text
//! Kp' (Ti' s + 1)(Td' s + 1) / (Ti' s (Tf s + 1)) = Kp (1 + 1/(Ti s) + Td s / (Tf s + 1))
//!
//! Ti' + Td' = Ti + Tf,   Ti' Td' = Ti (Td + Tf),   Kp' / Ti' = Kp / Ti
//! Ti = Ti' + Td' - Tf,   Td = (Ti' - Tf)(Td' - Tf) / Ti
//! ```
//!
//! `Ti'` and `Td'` are the roots of `x^2 - (Ti + Tf) x + Ti (Td + Tf)`: real where `(Ti - Tf)^2 >= 4 Ti Td`,
//! which is `Ti >= 4 Td` without a filter. `Ti'` is taken as the greater one.
//!
//! Otherwise the zeros of the controller are complex, and with `T^2 = Ti (Td + Tf)`, `rho = 2 T / (Ti + Tf) > 1`
//!
//! ```text
//! nearest:   Ti' = Td' = T,   Kp' / Ti' = (1 - delta) Kp / Ti,   delta = (rho - 1) / (rho + 1)
//! ```
//!
//! deviates from it by `delta`, relative, at every frequency. No series controller of this filter stays below
//! that: the difference of two would be a quadratic with as many zeros to the right as the all-pass
//! `N(-s) / N(s)` of the deviation, hence with signs + - +, which two real zeros exclude.

use super::{Settings, d_filter};
use crate::error::{Error, Result};
use crate::model::Pid;
use crate::note::rounded;

/// The series controller that comes nearest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Its settings.
    pub settings: Settings,
    /// Largest relative deviation of its frequency response, over all frequencies.
    pub deviation: f64,
}

/// Rounding that a double zero may have suffered, relative to `(Ti + Tf)^2`.
const DOUBLE_ZERO: f64 = 1e-12;

/// Settings in seconds, exact or nearest; for a controller with a proportional gain.
pub fn of_pid(pid: &Pid) -> std::result::Result<Settings, Nearest> {
    let (Ti, Td, Tf) = (pid.Ti(), pid.Td, d_filter(pid));
    if Td == 0.0 {
        // Nothing is filtered on D; in series the filter would stand before P and I as well.
        return Ok([pid.Kp, Ti, 0.0, pid.Tf - Tf]);
    }
    if Ti.is_infinite() {
        return Ok([pid.Kp, Ti, Td + Tf, pid.Tf]);
    }
    let (sum, product) = (Ti + Tf, Ti * (Td + Tf));
    let discriminant = (Ti - Tf) * (Ti - Tf) - 4.0 * Ti * Td;
    if discriminant < -DOUBLE_ZERO * sum * sum {
        let T = product.sqrt();
        let rho = 2.0 * T / sum;
        let deviation = (rho - 1.0) / (rho + 1.0);
        let Ki = (1.0 - deviation) * pid.Ki;
        return Err(Nearest { settings: [Ki * T, T, T, pid.Tf], deviation });
    }
    let greater = 0.5 * (sum + discriminant.max(0.0).sqrt());
    Ok([pid.Ki * greater, greater, product / greater, pid.Tf])
}

/// Says by how much the zeros miss the real axis, and what comes nearest, in the units of its settings.
pub fn refusal(pid: &Pid, nearest: &Nearest) -> Error {
    let (Ti, Td, Tf) = (pid.Ti(), pid.Td, d_filter(pid));
    let [Kp, Ti_near, Td_near, Tf_near] = nearest.settings.map(rounded);
    let (condition, measured) = if Tf > 0.0 {
        ("(Ti - Tf)^2 >= 4 Ti Td", (Ti - Tf) * (Ti - Tf) / (Ti * Td))
    } else {
        ("Ti >= 4 Td", Ti / Td)
    };
    let text = format!(
        "no series form: it needs {condition}; nearest Kp = {Kp}, Ti = {Ti_near}, Td = {Td_near}, \
         Tf = {Tf_near}, off by {:.1} % at every frequency",
        100.0 * nearest.deviation
    );
    Error::new("U01", text)
        .measured(measured, 4.0)
        .remedy("take the nearest (`.result`), less Td, or a form without interaction")
}

/// The controller that series settings in seconds make.
pub fn to_pid([gain, Ti_series, Td_series, filter]: Settings, rest: &Pid) -> Result<Pid> {
    let Tf = d_filter(&Pid { Tf: filter, ..*rest });
    let pid = |Kp, Ki, Td| Pid { Kp, Ki, Td, Tf: filter, ..*rest };
    // A lead that equals its lag but for rounding is none.
    let lead = |T: f64| if (T - Tf).abs() <= DOUBLE_ZERO * Tf { 0.0 } else { T - Tf };
    let (of_I, of_D) = (lead(Ti_series), lead(Td_series));
    if Ti_series.is_infinite() {
        return if of_D < 0.0 { Err(a_lag(Td_series, Tf)) } else { Ok(pid(gain, 0.0, of_D)) };
    }
    let Ti = of_I + Td_series;
    if of_I * of_D < 0.0 || !(Ti > 0.0) {
        return Err(a_lag(Td_series, Tf));
    }
    let Ki = gain / Ti_series;
    Ok(pid(Ki * Ti, Ki, of_I * of_D / Ti))
}

fn a_lag(Td: f64, Tf: f64) -> Error {
    Error::new("U01", format!("`Tf` is {Tf}, must be at most Td = {Td}: in series form the two make a lag"))
        .measured(Tf, Td)
        .remedy("Tf below Td, or Tf = 0 where Td = 0")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::Complex;

    fn pid(Ti: f64, Td: f64, Tf: f64) -> Pid {
        Pid { Td, Tf, ..Pid::pi(-3.0, Ti) }
    }

    fn freqresp([Kp, Ti, Td, Tf]: Settings, w: f64) -> Complex<f64> {
        let s = Complex::new(0.0, w);
        (s * Ti + 1.0) * (s * Td + 1.0) * Kp / (s * Ti * (s * Tf + 1.0))
    }

    #[test]
    fn the_nearest_is_off_by_the_same_at_every_frequency() {
        for (Ti, Td, Tf) in [(2.0, 1.0, 0.0), (2.0, 1.0, 0.3), (1.0, 4.0, 2.5)] {
            let pid = pid(Ti, Td, Tf);
            let nearest = of_pid(&pid).expect_err("none");
            for w in [1e-3, 0.1, 0.7, 1.0, 30.0, 1e4] {
                let off = (freqresp(nearest.settings, w) / pid.freqresp(w) - 1.0).norm();
                assert!((off - nearest.deviation).abs() < 1e-12, "{off} {nearest:?}");
            }
        }
    }

    #[test]
    fn a_double_zero_is_real_still() {
        let Ti = 0.3_f64;
        assert!(of_pid(&pid(Ti, Ti / 4.0 * (1.0 + 1e-15), 0.0)).is_ok());
        let [_, Ti_series, Td_series, _] = of_pid(&pid(4.0, 1.0, 0.0)).expect("settings");
        assert_eq!((Ti_series, Td_series), (2.0, 2.0));
    }

    #[test]
    fn a_filter_longer_than_both_leads_is_a_controller_too() {
        let pid = pid(1.0, 0.5, 9.0);
        let found = of_pid(&pid).expect("settings");
        assert!(found[1] < 9.0 && found[2] < 9.0);
        let back = to_pid(found, &pid).expect("a controller");
        for w in [1e-2, 1.0, 1e2] {
            assert!((back.freqresp(w) / pid.freqresp(w) - 1.0).norm() < 1e-13);
        }
    }
}
