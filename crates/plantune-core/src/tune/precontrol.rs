//! Steady-state feed-forward: the input that holds a plant where it shall be.
//!
//! ```text
//! settling:     p = r / K - d         d the known load at the input          (3.4-49) to (3.4-53)
//! integrating:  p = ramp / K - d      whatever r is; ramp its slope, 1/s
//! ```
//!
//! With it the integral of the controller ends where it began. Source 001, 3.4.8; an offset of the model is
//! taken from r, the drift of an integrating one from the ramp, before.

use crate::error::{Error, Result};
use crate::model::Model;

/// The input for the set point `r`, or for its slope `ramp` where the plant integrates.
pub fn precontrol(model: &Model, r: f64, load: f64, ramp: f64) -> Result<f64> {
    model.check()?;
    for (name, value) in [("r", r), ("load", load), ("ramp", ramp)] {
        if !value.is_finite() {
            return Err(Error::argument(name, value, "finite"));
        }
    }
    let K = model.dc_gain()[0];
    if K.is_finite() && K != 0.0 {
        if ramp != 0.0 {
            return Err(Error::argument(
                "ramp",
                ramp,
                "0: only an integrating plant follows one on a steady input",
            ));
        }
        return Ok(r / K - load);
    }
    match model.transfer() {
        Some(G) if K.is_infinite() => {
            // With one pole at 0: lim s G(s).
            let rate = G.num.last().copied().unwrap_or(0.0) / G.den[G.den.len() - 2];
            if rate.is_finite() && rate != 0.0 {
                return Ok(ramp / rate - load);
            }
            Err(Error::new("M01", "the plant has two integrators: no steady input holds it")
                .remedy("give the input of the inner loop"))
        }
        None if K.is_infinite() && ramp == 0.0 => Ok(-load),
        _ => Err(Error::new("M12", format!("the static gain is {K}: no input holds a set point"))
            .remedy("use a ProcessModel or TransferFunction with a static gain, or an integrating one")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Fopdt, ProcessModel};

    #[test]
    fn the_input_follows_from_the_gain_or_the_slope() {
        let settles = Fopdt { K: -5.0, T: 2.0, L: 1.0 }.into();
        assert_eq!(precontrol(&settles, 10.0, 0.5, 0.0), Ok(-2.5));
        assert_eq!(precontrol(&settles, 10.0, 0.5, 1.0).expect_err("a refusal").code(), "U01");
        let tank =
            ProcessModel { K: 0.25, T: vec![3.0], L: 1.0, Tz: 0.0, zeta: None, integrating: true }.into();
        assert_eq!(precontrol(&tank, 10.0, 0.5, 0.0), Ok(-0.5));
        assert_eq!(precontrol(&tank, 10.0, 0.5, 2.0), Ok(7.5));
    }
}
