//! How far a plant may depart from its model, as a change of gain and a change of dead time.
//!
//! ```text
//! border      the gain factors k at which the loop of  k G(s) e^(-d s)  ends to be stable, for each d
//! departure   of another model:  k = |G_i / G|,  d = -arg(G_i / G) / w   at the gain crossover w
//! ```
//!
//! At the crossover any departure is a gain and a delay, whatever parameters it came from, so that a cloud of
//! models and the border of stability can be drawn in one plane.

use super::margins::margins;
use super::stability::{Setting, bounds_of};
use crate::error::{Error, Result};
use crate::model::{Model, Pid, ProcessModel, TransferFunction};

/// The stable gain factors around 1, low and high, at each change of the dead time, s; NaN where there are
/// none.
pub fn border(model: &Model, pid: &Pid, changes: &[f64]) -> Result<Vec<(f64, f64)>> {
    // A gain that was well inside for one change is so for the next: the loop itself may lie on the border.
    let mut inside = 1.0;
    let mut of = |change: &f64| {
        let scaled = Pid { Kp: inside * pid.Kp, Ki: inside * pid.Ki, ..*pid };
        let (a, b) = bounds_of(&with_delay(model, *change)?, &scaled, Setting::Kp)?;
        let (low, high) = ((a / pid.Kp).min(b / pid.Kp), (a / pid.Kp).max(b / pid.Kp));
        if low.is_finite() && high.is_finite() {
            inside = 0.6 * low + 0.4 * high;
        }
        Ok((low, high))
    };
    changes.iter().map(&mut of).collect()
}

/// Gain factor and change of the dead time that each model is beside `model`, at the gain crossover.
pub fn departures(model: &Model, pid: &Pid, others: &[Model]) -> Result<Vec<(f64, f64)>> {
    let w = margins(model, pid)?.w_phase;
    if !w.is_finite() {
        return Err(Error::new("C07", "the loop has no gain crossover: its gain is below 1 everywhere")
            .remedy("there is nothing to compare at; take more gain"));
    }
    let G = model.freqresp(0, w);
    Ok(others
        .iter()
        .map(|other| {
            let ratio = other.freqresp(0, w) / G;
            (ratio.norm(), -ratio.arg() / w)
        })
        .collect())
}

/// The model with another dead time, not below zero; a polynomial one by whole samples.
fn with_delay(model: &Model, change: f64) -> Result<Model> {
    let later = |L: f64| (L + change).max(0.0);
    Ok(match model {
        Model::Process(m) => Model::Process(ProcessModel { L: later(m.L), ..m.clone() }),
        Model::Transfer(m) => Model::Transfer(TransferFunction { L: later(m.L), ..m.clone() }),
        Model::Poly(m) => {
            let mut m = m.clone();
            m.nk[0] = (m.nk[0] as f64 + change / m.Ts).round().max(0.0) as usize;
            Model::Poly(m)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Fopdt;
    use std::f64::consts::FRAC_PI_2;

    /// IMC-PI: `k e^(-(L + d) s) / (s (tau_c + L))` is stable up to `k = pi (tau_c + L) / (2 (L + d))`.
    #[test]
    fn the_border_of_imc_pi_is_a_hyperbola() {
        let (model, pid) = (Model::from(Fopdt { K: -2.0, T: 3.0, L: 1.0 }), Pid::pi(-3.0 / (2.0 * 1.9), 3.0));
        let changes = [-0.5, 0.0, 0.8];
        for (d, (low, high)) in changes.iter().zip(border(&model, &pid, &changes).expect("a border")) {
            assert!(low == 0.0 && (high / (FRAC_PI_2 * 1.9 / (1.0 + d)) - 1.0).abs() < 1e-9, "{d}: {high}");
        }
    }

    #[test]
    fn another_gain_and_delay_are_found_as_such() {
        let (model, pid) = (Model::from(Fopdt { K: -2.0, T: 3.0, L: 1.0 }), Pid::pi(-0.8, 3.0));
        let other = Model::from(Fopdt { K: -2.4, T: 3.0, L: 1.3 });
        let (k, d) = departures(&model, &pid, &[other]).expect("a crossover")[0];
        assert!((k - 1.2).abs() < 1e-12 && (d - 0.3).abs() < 1e-12, "{k} {d}");
    }
}
