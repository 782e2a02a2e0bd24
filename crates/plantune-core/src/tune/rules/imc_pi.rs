//! IMC-PI for first order plus dead time.
//!
//! ```text
//! Kp = T / (K (tau_c + L)),  Ti = T                         (3.6-18), (3.6-19)
//! loop: e^(-L s) / (s (tau_c + L))                          (3.6-31)
//! tau_c = (2 A_M / pi - 1) L                                (3.6-41), gain margin A_M
//! tau_c = (1 / (pi/2 - phi_M) - 1) L                        (3.6-43), phase margin phi_M
//! ```
//!
//! Source 001, 3.6.5 and 3.6.6; `tau_c` is its `T_F`. Serves one lag; other plants that settle are reduced to
//! that. A negative gain gives a negative `Kp`.

use std::f64::consts::{FRAC_PI_2, PI};

use super::check_tau_c;
use crate::error::{Error, Result};
use crate::model::{Fopdt, Model, Pid};
use crate::tune::rule::{Rule, Settings};

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

impl ImcTarget {
    /// As arguments name it.
    pub fn name(self) -> &'static str {
        match self {
            ImcTarget::GainMargin(_) => "gain_margin",
            ImcTarget::PhaseMargin(_) => "phase_margin",
            ImcTarget::TauC(_) => "tau_c",
        }
    }

    /// What is wished.
    pub fn value(self) -> f64 {
        let (ImcTarget::GainMargin(value) | ImcTarget::PhaseMargin(value) | ImcTarget::TauC(value)) = self;
        value
    }

    pub(super) fn no_delay(self) -> Error {
        let name = self.name();
        Error::new("M12", format!("a plant without delay reaches any `{name}`: it does not fix the settings"))
            .remedy("give tau_c, the wished closed-loop time constant in seconds")
    }
}

/// Settings and the closed-loop time constant `tau_c`, s.
pub fn imc_pi(model: &Model, target: ImcTarget) -> Result<Settings> {
    let wish = if let ImcTarget::TauC(tau_c) = target { Some(tau_c) } else { None };
    Rule::new("IMC-PI", &|&Fopdt { K, T, L }| {
        let tau_c = tau_c(L, target)?;
        Ok((Pid::pi(T / (K * (tau_c + L)), T), tau_c))
    })
    .on(model, wish)
}

fn tau_c(L: f64, target: ImcTarget) -> Result<f64> {
    match target {
        ImcTarget::GainMargin(A) if A > FRAC_PI_2 && A.is_finite() => {
            if L > 0.0 {
                Ok((2.0 * A / PI - 1.0) * L)
            } else {
                Err(target.no_delay())
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
            if L > 0.0 { Ok((1.0 / rest - 1.0) * L) } else { Err(target.no_delay()) }
        }
        ImcTarget::TauC(tau) => check_tau_c(tau, L),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANT: Fopdt = Fopdt { K: -5.939, T: 0.1491, L: 0.1 };

    fn tuned(model: Fopdt, target: ImcTarget) -> (Pid, f64) {
        let Settings { pid, tau_c, .. } = imc_pi(&model.into(), target).expect("settings");
        (pid, tau_c)
    }

    /// `A_M = pi (tau_c + L) / (2 L)` and `phi_M = pi/2 - L / (tau_c + L)`, (3.6-35) and (3.6-38).
    #[test]
    fn the_margin_asked_for_is_the_margin_of_tau_c() {
        let L = PLANT.L;
        for A in [1.6, 3.0, 8.0] {
            let (_, tau_c) = tuned(PLANT, ImcTarget::GainMargin(A));
            assert!((PI * (tau_c + L) / (2.0 * L) - A).abs() < 1e-12);
        }
        for degrees in [33.0, 60.0, 85.0f64] {
            let (_, tau_c) = tuned(PLANT, ImcTarget::PhaseMargin(degrees));
            assert!((FRAC_PI_2 - L / (tau_c + L) - degrees.to_radians()).abs() < 1e-12);
        }
    }

    #[test]
    fn three_and_sixty_degrees_are_the_same_loop() {
        let (by_gain, by_phase) =
            (tuned(PLANT, ImcTarget::GainMargin(3.0)), tuned(PLANT, ImcTarget::PhaseMargin(60.0)));
        assert!((by_gain.1 - by_phase.1).abs() < 1e-15);
        assert!((by_gain.0.Kp + 0.131_450_58).abs() < 1e-6, "{}", by_gain.0.Kp);
    }

    #[test]
    fn units_of_gain_and_time_go_through() {
        let target = ImcTarget::GainMargin(2.5);
        let (pid, tau_c) = tuned(PLANT, target);
        let (twice, _) = tuned(Fopdt { K: 2.0 * PLANT.K, ..PLANT }, target);
        assert_eq!((twice.Kp, twice.Ti()), (pid.Kp / 2.0, pid.Ti()));
        let (slow, slow_tau) = tuned(Fopdt { K: PLANT.K, T: 4.0 * PLANT.T, L: 4.0 * PLANT.L }, target);
        assert!((slow.Kp / pid.Kp - 1.0).abs() < 1e-14 && (slow_tau / tau_c - 4.0).abs() < 1e-14);
    }

    #[test]
    fn wishes_out_of_reach_are_refused() {
        let code = |model: Fopdt, target| imc_pi(&model.into(), target).expect_err("a refusal").code();
        for A in [FRAC_PI_2, 0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(code(PLANT, ImcTarget::GainMargin(A)), "U01", "{A}");
        }
        for degrees in [32.7, 90.0, f64::NAN] {
            assert_eq!(code(PLANT, ImcTarget::PhaseMargin(degrees)), "U01", "{degrees}");
        }
        let no_delay = Fopdt { L: 0.0, ..PLANT };
        assert_eq!(code(no_delay, ImcTarget::GainMargin(3.0)), "M12");
        assert_eq!(code(no_delay, ImcTarget::TauC(0.0)), "U01");
    }
}
