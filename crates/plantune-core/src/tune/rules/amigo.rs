//! AMIGO settings for first order plus dead time, and for an integrator with dead time.
//!
//! ```text
//! PI:   Kp = (0.15 + (0.35 - L T / (L + T)^2) T / L) / K
//!       Ti = 0.35 L + 13 L T^2 / (T^2 + 12 L T + 7 L^2)
//! PID:  Kp = (0.2 + 0.45 T / L) / K
//!       Ti = L (0.4 L + 0.8 T) / (L + 0.1 T),  Td = 0.5 L T / (0.3 L + T),  Tf = Td / 10
//! integrating:
//! PI:   Kp = 0.35 / (K L),  Ti = 13.35 L
//! PID:  Kp = 0.45 / (K L),  Ti = 8 L,  Td = L / 2,  Tf = Td / 10
//! ```
//!
//! K. J. Astrom and T. Hagglund, Revisiting the Ziegler-Nichols step response method for PID control, J.
//! Process Control 14 (2004), and Advanced PID Control (ISA, 2006), chapter 7. Fitted to a batch of plants
//! tuned for the largest integral gain with `Ms` and `Mt` of 1.4; serves every dead time but none. The rule
//! for the integrator is the limit of the other for a long `T`, where the source prints 13.4. The filter is
//! ours. A negative gain gives a negative `Kp`.

use super::{Terms, check_delayed, pid};
use crate::error::Result;
use crate::model::{Fopdt, Model, Pid};
use crate::tune::rule::{Found, Integrating, Rule, Settings};

/// Settings; the plant must have a dead time.
pub fn amigo(model: &Model, terms: Terms) -> Result<Settings> {
    Rule {
        integrating: Some(&|plant| integrating(plant, terms)),
        ..Rule::new("AMIGO", &|plant| first(plant, terms))
    }
    .on(model, None)
}

fn first(&Fopdt { K, T, L }: &Fopdt, terms: Terms) -> Found {
    check_delayed(L, "AMIGO")?;
    let slow = T / L;
    let settings = match terms {
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
    };
    Ok((settings, f64::NAN))
}

fn integrating(&Integrating { K, L, .. }: &Integrating, terms: Terms) -> Found {
    check_delayed(L, "AMIGO")?;
    let settings = match terms {
        Terms::Pi => Pid::pi(0.35 / (K * L), 13.35 * L),
        Terms::Pid => pid(0.45 / (K * L), 8.0 * L, 0.5 * L),
    };
    Ok((settings, f64::NAN))
}
