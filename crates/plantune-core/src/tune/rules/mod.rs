//! Tuning rules, one per file; each says which plants it serves.

mod amigo;
mod chien_hrones_reswick;
mod cohen_coon;
mod imc_pi;
mod imc_pid;
mod lambda;
mod refined_ziegler_nichols;
mod simc;
mod simc_plus;
mod tyreus_luyben;
mod ziegler_nichols;

pub use amigo::amigo;
pub use chien_hrones_reswick::{Overshoot, Step, chien_hrones_reswick};
pub use cohen_coon::cohen_coon;
pub use imc_pi::{ImcTarget, imc_pi};
pub use imc_pid::imc_pid;
pub use lambda::lambda;
pub use refined_ziegler_nichols::refined_ziegler_nichols;
pub use simc::simc;
pub use simc_plus::simc_plus;
pub use tyreus_luyben::tyreus_luyben;
pub(super) use tyreus_luyben::ultimate;
pub use ziegler_nichols::{Terms, ziegler_nichols};

use crate::error::{Error, Result};
use crate::model::Pid;

/// A PID whose filter is a tenth of its derivative time, where the rule has none: without one the derivative
/// answers a step with an impulse.
fn pid(Kp: f64, Ti: f64, Td: f64) -> Pid {
    Pid { Td, Tf: 0.1 * Td, ..Pid::pi(Kp, Ti) }
}

/// The standard form of `Kc (1 + 1 / (t_I s)) (1 + t_D s)`, exactly.
fn cascade(Kc: f64, t_I: f64, t_D: f64) -> Pid {
    let Ti = t_I + t_D;
    pid(Kc * (Ti / t_I), Ti, t_D * (t_I / Ti))
}

/// Refuses a dead time of zero, which a rule would divide by.
fn check_delayed(L: f64, rule: &str) -> Result<()> {
    if L > 0.0 {
        return Ok(());
    }
    Err(Error::new("M12", format!("{rule} needs a dead time: without one its gain is infinite"))
        .measured(L, 0.0)
        .remedy("use imc_pi or simc with tau_c, the wished closed-loop time constant in seconds"))
}

/// Refuses a closed-loop time constant that no gain can give.
fn check_tau_c(tau_c: f64, L: f64) -> Result<f64> {
    if tau_c >= 0.0 && tau_c + L > 0.0 && tau_c.is_finite() {
        return Ok(tau_c);
    }
    Err(Error::argument("tau_c", tau_c, "zero or positive, with tau_c + L > 0"))
}

/// The wish, or a share of the dead time without one.
fn tau_c_or(wish: Option<f64>, share: f64, L: f64, rule: &str) -> Result<f64> {
    match wish {
        Some(tau_c) => check_tau_c(tau_c, L),
        None => check_delayed(L, rule).map(|()| share * L),
    }
}
