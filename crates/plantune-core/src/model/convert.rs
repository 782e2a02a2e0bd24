//! Exact conversion between a process model and its sampled form, fractional delay included.
//!
//! Forth as in [`super::process`]; back, from `a, b1, b2`:
//!
//! ```text
//! T = -Ts / ln a,   K = (b1 + b2) / (1 - a),   f = Ts + T ln(1 - b1/K),   L = (nk - 1) Ts + f
//! ```
//!
//! valid for `0 <= b1/K <= 1 - a`.

use super::{Fopdt, Model, PolyModel, sampled};
use crate::error::{Error, Result};

/// A continuous model behind a zero-order hold.
pub fn c2d(model: &Model, Ts: f64) -> Result<PolyModel> {
    if !(Ts > 0.0 && Ts.is_finite()) {
        return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
    }
    model.check()?;
    match (model.first_order(), model.transfer()) {
        (Some(plant), _) => Ok(plant.held(Ts)),
        (None, Some(G)) => Ok(sampled(&G, Ts)),
        (None, None) => Err(Error::argument("model", "a PolyModel", "a ProcessModel or TransferFunction")),
    }
}

/// The process model that a first-order polynomial model samples.
pub fn d2c(model: &PolyModel) -> Result<Fopdt> {
    let denominator = match (model.A.len(), model.F.first().map(Vec::len), model.B.len()) {
        (2, Some(1), 1) => &model.A,
        (1, Some(2), 1) => &model.F[0],
        _ => {
            return Err(Error::new("U01", "d2c converts first-order models of one input")
                .remedy("fit a process model to the record instead: estimate.process(rec, \"P1D\")"));
        }
    };
    let (a, b) = (-denominator[1], &model.B[0]);
    if !(a > 0.0 && a < 1.0) {
        let what = if a <= 0.0 {
            "at or below 0: no process alternates in sign like this"
        } else {
            "on or outside the unit circle"
        };
        return Err(Error::new("M12", format!("the pole {a:.6} lies {what}"))
            .measured(a, if a <= 0.0 { 0.0 } else { 1.0 })
            .remedy("check the sample time and the data; a noisy record calls for estimate.process"));
    }
    if b.len() > 2 || model.nk[0] == 0 {
        return Err(Error::new(
            "U01",
            "a sampled first-order plant has nk >= 1 and at most two b coefficients",
        )
        .measured(b.len() as f64, 2.0)
        .remedy("fit with nb <= 2 and nk >= 1"));
    }
    let (b1, b2) = (b[0], b.get(1).copied().unwrap_or(0.0));
    let K = (b1 + b2) / (1.0 - a);
    let share = b1 / K;
    let slack = 1e-9 * (1.0 - a);
    if !(share >= -slack && share <= 1.0 - a + slack) {
        return Err(Error::new(
            "M12",
            format!("b1 = {b1:.6} and b2 = {b2:.6} differ in sign: no delay in [0, Ts) gives them"),
        )
        .measured(share, 1.0 - a)
        .remedy("fit with another nk, or with estimate.process"));
    }
    let T = -model.Ts / a.ln();
    let f = (model.Ts + T * (-share).ln_1p()).clamp(0.0, model.Ts);
    let f = if f < 1e-12 * model.Ts { 0.0 } else { f };
    Ok(Fopdt { K, T, L: (model.nk[0] - 1) as f64 * model.Ts + f })
}

/// Refuses a process model that is none (M12).
pub fn check_fopdt(model: &Fopdt) -> Result<()> {
    let Fopdt { K, T, L } = *model;
    for (name, value, fine, needed) in [
        ("K", K, K != 0.0, "finite and not zero"),
        ("T", T, T > 0.0, "positive"),
        ("L", L, L >= 0.0, "zero or positive"),
    ] {
        if !(value.is_finite() && fine) {
            return Err(Error::new("M12", format!("`{name}` is {value}, must be {needed}"))
                .remedy("a process model needs K != 0, T > 0 and L >= 0"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        for L in [0.0, 0.004, 0.1, 0.1199] {
            let model = Fopdt { K: -5.939, T: 0.1491, L };
            let back = c2d(&model.into(), 0.02).and_then(|sampled| d2c(&sampled)).expect("a process");
            assert!((back.K - model.K).abs() < 1e-12 && (back.T - model.T).abs() < 1e-12);
            assert!((back.L - L).abs() < 1e-12, "{} {L}", back.L);
        }
    }
}
