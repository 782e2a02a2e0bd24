//! Ziegler-Nichols settings from the step response of first order plus dead time.
//!
//! ```text
//! PI:   Kp = 0.9 T / (K L),  Ti = 3 L                       source 001, table 3.6-1
//! PID:  Kp = 1.2 T / (K L),  Ti = 2 L,  Td = L / 2,  Tf = Td / 10
//! ```
//!
//! J. G. Ziegler and N. B. Nichols, Optimum settings for automatic controllers, Trans. ASME 64 (1942),
//! with the reaction rate `K / T`. The derivative filter is not theirs. A negative gain gives a negative `Kp`.

use super::{check_delayed, pid};
use crate::error::Result;
use crate::model::{Fopdt, Pid};

/// Which terms the controller has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terms {
    /// Proportional and integral.
    Pi,
    /// With a filtered derivative.
    Pid,
}

/// Settings; the plant must have a dead time.
pub fn ziegler_nichols(model: &Fopdt, terms: Terms) -> Result<Pid> {
    check_delayed(model, "Ziegler-Nichols")?;
    let Fopdt { K, T, L } = *model;
    Ok(match terms {
        Terms::Pi => Pid::pi(0.9 * T / (K * L), 3.0 * L),
        Terms::Pid => pid(1.2 * T / (K * L), 2.0 * L, 0.5 * L),
    })
}
