//! Tyreus-Luyben settings from the exact ultimate gain and period of the model.
//!
//! ```text
//! PI:   Kp = K_u / 3.2,  Ti = 2.2 T_u
//! PID:  Kp = K_u / 2.2,  Ti = 2.2 T_u,  Td = T_u / 6.3,  Tf = Td / 10
//! first order:  w L + atan(w T) = pi,  K_u = sqrt(1 + (w T)^2) / K,  T_u = 2 pi / w
//! any other:    K_u = 1 / |G(j w)| at the largest one where G / K turns to -180 degrees
//! ```
//!
//! B. D. Tyreus and W. L. Luyben, Tuning PI controllers for integrator/dead time processes, Ind. Eng. Chem.
//! Res. 31 (1992): the PI gives an integrator with dead time, where `K_u = pi / (2 K L)` and `T_u = 4 L`, a
//! largest closed-loop gain of 2 dB. The PID is that of the textbooks of Luyben; its filter is ours. A
//! negative gain gives a negative `Kp`. Serves plants of any order as they are, by their ultimate point.

use std::f64::consts::PI;

use super::{Terms, check_delayed, pid};
use crate::error::{Error, Result};
use crate::model::{Fopdt, Model, Pid};
use crate::tune::half_rule::Factors;
use crate::tune::open_loop::{OpenLoop, crosses_negative_axis, root};
use crate::tune::rule::Settings;

/// Settings; the plant must have an ultimate gain, as every one with a dead time has.
pub fn tyreus_luyben(model: &Model, terms: Terms) -> Result<Settings> {
    let plant = Factors::of(model)?;
    let (K_u, T_u) = match model.first_order() {
        Some(plant) => {
            check_delayed(plant.L, "Tyreus-Luyben")?;
            ultimate(&plant)
        }
        None => ultimate_of_any(model, plant.K.signum())?,
    };
    let pid = match terms {
        Terms::Pi => Pid::pi(K_u / 3.2, 2.2 * T_u),
        Terms::Pid => pid(K_u / 2.2, 2.2 * T_u, T_u / 6.3),
    };
    let plant = (plant.zeros.len() < 2).then(|| plant.process());
    Ok(Settings { pid, tau_c: f64::NAN, plant, reduced: false })
}

/// Gain and period at which the loop under a proportional controller oscillates for ever.
pub(in crate::tune) fn ultimate(model: &Fopdt) -> (f64, f64) {
    let Fopdt { K, T, L } = *model;
    // x = w L lies in [pi/2, pi] and is where x = pi - atan(x T / L); the right side changes by at most
    // 1/pi of what x does, so that each step gains half a digit.
    let x = (0..40).fold(PI, |x, _| PI - (x * T / L).atan());
    ((x * T / L).hypot(1.0) / K, 2.0 * PI * L / x)
}

fn ultimate_of_any(model: &Model, sign: f64) -> Result<(f64, f64)> {
    let open = OpenLoop::new(model, &Pid { Ki: 0.0, ..Pid::pi(sign, 1.0) })?;
    let grid = open.grid();
    let turned = grid.windows(2).filter(|w| crosses_negative_axis(open.at(w[0]), open.at(w[1])));
    let point = |w: &[f64]| {
        let w = root(w[0], w[1], |w| open.at(w).im);
        (open.at(w), w)
    };
    // The least gain at which the loop stands at -1.
    let crossings = turned.map(point).filter(|(L, _)| L.re < 0.0);
    match crossings.max_by(|(a, _), (b, _)| a.norm().total_cmp(&b.norm())) {
        Some((L, w)) => Ok((sign / L.norm(), 2.0 * PI / w)),
        None => {
            Err(Error::new("M12", "Tyreus-Luyben needs an ultimate gain: no gain makes this plant oscillate")
                .remedy("use imc_pi or simc with tau_c, the wished closed-loop time constant in seconds"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::ProcessModel;

    #[test]
    fn the_phase_at_the_ultimate_period_is_half_a_turn() {
        for (T, L) in [(1.0, 1e-6), (1.0, 0.1), (3.0, 3.0), (0.2, 40.0), (1e-6, 1.0)] {
            let model = Fopdt { K: -2.0, T, L };
            let (K_u, T_u) = ultimate(&model);
            let G = model.freqresp(2.0 * PI / T_u);
            assert!((G * K_u + 1.0).norm() < 1e-9, "{T} {L}: {}", G * K_u);
        }
    }

    /// `1 / (s + 1)^3` oscillates at `sqrt(3)` under a gain of 8; an integrator at `pi / 2L`.
    #[test]
    fn the_ultimate_point_of_other_plants_is_the_known_one() {
        let of = |K: f64, T: Vec<f64>, L, integrating| {
            let model = ProcessModel { K, T, L, Tz: 0.0, zeta: None, integrating };
            ultimate_of_any(&model.into(), K.signum()).expect("a point")
        };
        for ((K_u, T_u), K, T) in [
            (of(-0.5, vec![1.0; 3], 0.0, false), -16.0, 2.0 * PI / 3f64.sqrt()),
            (of(0.5, vec![], 2.0, true), PI / 2.0, 8.0),
        ] {
            assert!((K_u / K - 1.0).abs() < 1e-9 && (T_u / T - 1.0).abs() < 1e-9, "{K_u} {T_u}");
        }
    }
}
