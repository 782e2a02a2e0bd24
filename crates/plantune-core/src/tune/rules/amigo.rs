//! AMIGO settings for first order plus dead time.
//!
//! ```text
//! PI:   Kp = (0.15 + (0.35 - L T / (L + T)^2) T / L) / K
//!       Ti = 0.35 L + 13 L T^2 / (T^2 + 12 L T + 7 L^2)
//! PID:  Kp = (0.2 + 0.45 T / L) / K
//!       Ti = L (0.4 L + 0.8 T) / (L + 0.1 T),  Td = 0.5 L T / (0.3 L + T),  Tf = Td / 10
//! ```
//!
//! K. J. Astrom and T. Hagglund, Revisiting the Ziegler-Nichols step response method for PID control, J.
//! Process Control 14 (2004), and Advanced PID Control (ISA, 2006), chapter 7. Fitted to a batch of plants
//! tuned for the largest integral gain with `Ms` and `Mt` of 1.4; serves every dead time but none. The
//! filter is ours. A negative gain gives a negative `Kp`.

use super::{Terms, check_delayed, pid};
use crate::error::Result;
use crate::model::{Fopdt, Pid};

/// Settings; the plant must have a dead time.
pub fn amigo(model: &Fopdt, terms: Terms) -> Result<Pid> {
    check_delayed(model, "AMIGO")?;
    let Fopdt { K, T, L } = *model;
    let slow = T / L;
    Ok(match terms {
        Terms::Pi => {
            let share = T / (L + T) * (L / (L + T));
            let Ti = L * (0.35 + 13.0 * slow / (slow + 12.0 + 7.0 / slow));
            Pid::pi((0.15 + (0.35 - share) * slow) / K, Ti)
        }
        Terms::Pid => pid(
            (0.2 + 0.45 * slow) / K,
            L * (0.4 + 0.8 * slow) / (1.0 + 0.1 * slow),
            0.5 * L / (0.3 / slow + 1.0),
        ),
    })
}
