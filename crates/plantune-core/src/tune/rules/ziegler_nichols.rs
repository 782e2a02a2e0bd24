//! Ziegler-Nichols settings from the reaction rate and the dead time of a step response.
//!
//! ```text
//! PI:   Kp = 0.9 / (R L),  Ti = 3 L                         source 001, table 3.6-1
//! PID:  Kp = 1.2 / (R L),  Ti = 2 L,  Td = L / 2,  Tf = Td / 10
//! R = K / T, of an integrating plant K
//! ```
//!
//! J. G. Ziegler and N. B. Nichols, Optimum settings for automatic controllers, Trans. ASME 64 (1942). The
//! derivative filter is not theirs. A negative gain gives a negative `Kp`.

use super::{check_delayed, pid};
use crate::error::Result;
use crate::model::{Fopdt, Model, Pid};
use crate::tune::rule::{Found, Integrating, Rule, Settings};

/// Which terms the controller has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terms {
    /// Proportional and integral.
    Pi,
    /// With a filtered derivative.
    Pid,
}

/// Settings; the plant must have a dead time.
pub fn ziegler_nichols(model: &Model, terms: Terms) -> Result<Settings> {
    Rule {
        integrating: Some(&|&Integrating { K, L, .. }| from_rate(K, L, terms)),
        ..Rule::new("Ziegler-Nichols", &|&Fopdt { K, T, L }| from_rate(K / T, L, terms))
    }
    .on(model, None)
}

fn from_rate(R: f64, L: f64, terms: Terms) -> Found {
    check_delayed(L, "Ziegler-Nichols")?;
    let settings = match terms {
        Terms::Pi => Pid::pi(0.9 / (R * L), 3.0 * L),
        Terms::Pid => pid(1.2 / (R * L), 2.0 * L, 0.5 * L),
    };
    Ok((settings, f64::NAN))
}
