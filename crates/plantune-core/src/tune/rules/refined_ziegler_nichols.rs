//! Refined Ziegler-Nichols PI settings.
//!
//! ```text
//! K_u = T / (K L),  T_u = 4 L                               source 001, (3.6-71), (3.6-72)
//! Kp = (5/6) K_u (12 + K_u K) / (15 + 14 K_u K)             source 001, table 3.6-1
//! Ti = (T_u / 5) (4/15 K_u K + 1)
//! ```
//!
//! C. C. Hang, K. J. Astrom and W. K. Ho, Refinements of the Ziegler-Nichols tuning formula, IEE Proc. D
//! 138 (1991). Ultimate gain and period are those of the source, taken from the model, not measured:
//! the true ultimate gain of the model is larger. A negative gain gives a negative `Kp`.

use super::check_delayed;
use crate::error::Result;
use crate::model::{Fopdt, Model, Pid};
use crate::tune::rule::{Found, Rule, Settings};

/// Settings; the plant must settle and have a dead time.
pub fn refined_ziegler_nichols(model: &Model) -> Result<Settings> {
    Rule::new("refined Ziegler-Nichols", &first).on(model, None)
}

fn first(&Fopdt { K, T, L }: &Fopdt) -> Found {
    check_delayed(L, "refined Ziegler-Nichols")?;
    let (K_u, T_u) = (T / (K * L), 4.0 * L);
    let Kp = 5.0 / 6.0 * K_u * (12.0 + K_u * K) / (15.0 + 14.0 * K_u * K);
    let Ti = T_u / 5.0 * (4.0 / 15.0 * K_u * K + 1.0);
    Ok((Pid::pi(Kp, Ti), f64::NAN))
}
