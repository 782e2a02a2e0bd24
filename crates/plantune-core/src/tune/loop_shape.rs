//! The controller that puts gain crossover and phase margin where they are wished.
//!
//! ```text
//! C(j w_c) G(j w_c) = e^(j (phi_M - pi))
//! theta = phi_M - pi - arg G(j w_c),  |theta| < pi:   the angle that the controller must have
//! PI    Kp = cos theta / |G|,  Ki = -w_c sin theta / |G|,   for theta from -90 deg to 0
//! PID   Td = Ti / 4, Tf = Td / 10:  the shortest Ti of that angle,  Kp from the gain
//! ```
//!
//! K. J. Astrom and T. Hagglund, PID Controllers (ISA, 1995), chapter 4. The margins found are those of
//! the first crossover only if there is one; [`super::margins`] looks at all.

use std::f64::consts::PI;

use super::open_loop::root;
use super::rules::Terms;
use crate::error::{Error, Result};
use crate::linalg::Complex;
use crate::model::{Model, Pid};
use crate::note::rounded;

/// `Td / Ti` and `Tf / Td` of the PID.
const DERIVATIVE: f64 = 0.25;
const FILTER: f64 = 0.1;

/// Settings for a crossover at `w_c` rad/s and a phase margin in degrees; `Ts` of a sampled controller.
pub fn loop_shape(model: &Model, w_c: f64, phase_margin: f64, terms: Terms, Ts: Option<f64>) -> Result<Pid> {
    model.check()?;
    let highest = Ts.map_or(f64::INFINITY, |Ts| PI / Ts);
    if !(w_c > 0.0 && w_c < highest) {
        let needed = match Ts {
            Some(_) => format!("between 0 and the Nyquist frequency, {highest:.4} rad/s"),
            None => "positive".to_owned(),
        };
        return Err(Error::argument("w_c", w_c, &needed));
    }
    if !(phase_margin > 0.0 && phase_margin < 180.0) {
        return Err(Error::argument("phase_margin", phase_margin, "between 0 and 180 degrees"));
    }
    let G = plant_at(model, w_c, Ts)?;
    let unit = unit(terms, Ts);
    // A negative gain is the controller's sign, not half a turn of phase.
    let sign = if low_frequency_gain(model) < 0.0 { -1.0 } else { 1.0 };
    let theta = wrapped(phase_margin.to_radians() - PI - (G * sign).arg());
    let angle = |ln_Ti: f64| unit(ln_Ti.exp()).freqresp(w_c).arg();
    let least = (1e-6 / w_c).ln();
    // The filter takes the lead back in the end: from there on the angle falls.
    let rising = (0..=700).map(|k| least + 0.05 * f64::from(k));
    let most = rising.max_by(|&a, &b| angle(a).total_cmp(&angle(b))).unwrap_or(least);
    let (low, high) = (angle(least), angle(most));
    if !(theta > low && theta < high) {
        return Err(out_of_reach(phase_margin, w_c, theta, (low, high), terms));
    }
    let Ti = root(least, most, |ln_Ti| angle(ln_Ti) - theta).exp();
    let shape = unit(Ti);
    let Kp = sign / (shape.freqresp(w_c) * G).norm();
    Ok(Pid { Kp, Ki: shape.Ki * Kp, ..shape })
}

/// The controller of unit gain by its integral time.
fn unit(terms: Terms, Ts: Option<f64>) -> impl Fn(f64) -> Pid {
    move |Ti| match terms {
        Terms::Pi => Pid { Ts, ..Pid::pi(1.0, Ti) },
        Terms::Pid => {
            let Td = DERIVATIVE * Ti;
            Pid { Td, Tf: FILTER * Td, Ts, ..Pid::pi(1.0, Ti) }
        }
    }
}

fn plant_at(model: &Model, w: f64, Ts: Option<f64>) -> Result<Complex<f64>> {
    match (model, Ts) {
        (Model::Poly(_), None) => {
            Err(Error::argument("Ts", "absent", "that of the PolyModel, the controller's sample time"))
        }
        (Model::Poly(_), Some(Ts)) => model.check_Ts(Ts).map(|()| model.freqresp(0, w)),
        (_, Some(Ts)) => Ok(Model::Poly(crate::model::c2d(model, Ts)?).freqresp(0, w)),
        (_, None) => Ok(model.freqresp(0, w)),
    }
}

/// Whose sign is that of the process.
fn low_frequency_gain(model: &Model) -> f64 {
    model.dc_gain()[0]
}

/// An angle within half a turn.
fn wrapped(angle: f64) -> f64 {
    angle - 2.0 * PI * (angle / (2.0 * PI)).round()
}

fn out_of_reach(wish: f64, w_c: f64, theta: f64, (low, high): (f64, f64), terms: Terms) -> Error {
    let name = if terms == Terms::Pi { "PI" } else { "PID" };
    let reach = |edge: f64| wish + (edge - theta).to_degrees();
    let (least, most) = (reach(low), reach(high));
    let limit = if theta >= high { most } else { least };
    let remedy = match (theta >= high, terms) {
        (true, Terms::Pi) => "lower w_c, or ask for controller=\"PID\"",
        (true, Terms::Pid) => "lower w_c",
        (false, _) => "raise w_c, or ask for more phase margin",
    };
    Error::new(
        "M12",
        format!(
            "no {name} gives {} degrees at {} rad/s: there it reaches from {} to {} degrees",
            rounded(wish),
            rounded(w_c),
            rounded(least),
            rounded(most),
        ),
    )
    .measured(wish, limit)
    .remedy(remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::ProcessModel;

    fn three_lags() -> Model {
        let T = vec![1.0, 1.0, 1.0];
        Model::Process(ProcessModel { K: 1.0, T, L: 0.0, Tz: 0.0, zeta: None, integrating: false })
    }

    /// The published designs `1.14, 0.454` and `2.83, 0.0495` for `1/(s + 1)^3`.
    #[test]
    fn published_designs_are_met() {
        for (w_c, phase, Kp, Ki) in [(0.5205, 60.0, 1.14, 0.454), (1.0, 43.997, 2.83, 0.0495)] {
            let pid = loop_shape(&three_lags(), w_c, phase, Terms::Pi, None).expect("settings");
            assert!((pid.Kp - Kp).abs() < 0.005 && (pid.Ki / Ki - 1.0).abs() < 2e-3, "{pid:?}");
        }
        let error = loop_shape(&three_lags(), 1.0, 60.0, Terms::Pi, None).expect_err("out of reach");
        assert_eq!(error.code(), "M12");
        assert!((error.note().limit.unwrap_or(0.0) - 45.0).abs() < 1e-3, "{error}");
        assert!(loop_shape(&three_lags(), 1.0, 60.0, Terms::Pid, None).is_ok());
    }
}
