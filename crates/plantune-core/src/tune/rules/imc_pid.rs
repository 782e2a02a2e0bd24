//! IMC-PID for first and second order plus dead time, an inverse response included.
//!
//! ```text
//! first order, the dead time as (1 - L s/2)/(1 + L s/2):
//!   Kp = (2 T + L)/(K (2 tau_c + L)),  Ti = T + L/2,  Td = T L/(2 T + L)          (3.6-22) to (3.6-24)
//!   atan(2/x) + x = pi,  x = w L,  A_M = x (2 tau_c/L + 1)/sqrt(x^2 + 4)            (3.6-48), (3.6-50)
//!   phi_M = pi - atan(2 z) - 1/z,  z = sqrt(tau_c^2 + tau_c L)/L                    (3.6-53)
//! second order, (q s^2 + p s + 1) cancelled, the zero to the right kept, b = max(-Tz, 0), a = tau_c + L + b:
//!   Kp = p/(K a),  Ti = p,  Td = q/p;  loop (1 - b s) e^(-L s)/(a s)
//!   atan(b w) + w L = pi/2,   A_M = a w/sqrt(1 + (b w)^2)
//!   phi_M = pi/2 - atan(b w) - w L,  w = 1/sqrt(a^2 - b^2)
//! a zero to the left is cancelled by the filter, Tf = Tz:
//!   Kp = (p - Tz)/(K a),  Ti = p - Tz,  Td = q/Ti - Tz
//! ```
//!
//! Source 001, 3.6.5 and 3.6.6; `tau_c` is its `T_F`. Second order: D. E. Rivera, M. Morari and S.
//! Skogestad, Internal model control: PID controller design, Ind. Eng. Chem. Process Des. Dev. 25 (1986), and
//! I.-L. Chien and P. S. Fruehauf, Consider IMC tuning to improve controller performance, Chem. Eng. Prog. 86
//! (1990). As in the sources nothing else filters D; with `Tf = Td / N` on wish, `tau_c` is searched for until
//! the loop with the filter has the margin. A negative gain gives a negative `Kp`.

use std::f64::consts::{FRAC_PI_2, PI};

use super::{ImcTarget, check_tau_c};
use crate::error::{Error, Result};
use crate::model::{Fopdt, Model, Pid};
use crate::tune::margins::margins;
use crate::tune::open_loop::root;
use crate::tune::rule::{Found, Rule, Second, Settings};

/// Settings and the closed-loop time constant, s; `N` is how much faster than D its filter is, none without.
pub fn imc_pid(model: &Model, target: ImcTarget, N: Option<f64>) -> Result<Settings> {
    if let Some(N) = N.filter(|N| !(*N > 0.0 && N.is_finite())) {
        return Err(Error::argument("N", N, "positive, or absent for no filter"));
    }
    let wish = if let ImcTarget::TauC(tau_c) = target { Some(tau_c) } else { None };
    Rule {
        second: Some(&|plant| filtered(&plant.transfer().into(), target, N, |target| second(plant, target))),
        knows: &|plant| is_cancelled(plant),
        ..Rule::new("IMC-PID", &|plant| filtered(&(*plant).into(), target, N, |target| first(plant, target)))
    }
    .on(model, wish)
}

/// The settings with a filter, `tau_c` such that the loop with it has the margin.
fn filtered(
    plant: &Model,
    target: ImcTarget,
    N: Option<f64>,
    settings: impl Fn(ImcTarget) -> Found,
) -> Found {
    let (bare, tau_c) = settings(target)?;
    let Some(N) = N.filter(|_| bare.Tf == 0.0) else { return Ok((bare, tau_c)) };
    let with_filter = |tau_c: f64| {
        settings(ImcTarget::TauC(tau_c)).map(|(pid, tau_c)| (Pid { Tf: pid.Td / N, ..pid }, tau_c))
    };
    if matches!(target, ImcTarget::TauC(_)) {
        return with_filter(tau_c);
    }
    let missing = |tau_c: f64| {
        let found = with_filter(tau_c).and_then(|(pid, _)| margins(plant, &pid));
        found.map_or(f64::NAN, |m| match target {
            ImcTarget::PhaseMargin(degrees) => m.phase_deg - degrees,
            _ => m.gain - target.value(),
        })
    };
    // The filter costs margin, but where the dead time is far longer than the lag.
    let most = 10.0 * (tau_c + plant.transfer().map_or(0.0, |G| G.L));
    let (low, high) = if missing(tau_c) > 0.0 { (0.5 * tau_c, tau_c) } else { (tau_c, most) };
    with_filter(root(low, high, missing))
}

fn first(&Fopdt { K, T, L }: &Fopdt, target: ImcTarget) -> Found {
    let tau_c = match target {
        ImcTarget::TauC(tau_c) => check_tau_c(tau_c, L)?,
        ImcTarget::GainMargin(_) | ImcTarget::PhaseMargin(_) if L == 0.0 => return Err(target.no_delay()),
        ImcTarget::GainMargin(A) if A > 1.0 && A.is_finite() => {
            let x = root(2.0, 3.0, |x| (2.0 / x).atan() + x - PI);
            0.5 * L * (A * x.hypot(2.0) / x - 1.0)
        }
        ImcTarget::GainMargin(A) => return Err(Error::argument("gain_margin", A, "a factor above 1")),
        ImcTarget::PhaseMargin(degrees) => {
            let phase = within_90(degrees)?;
            // 1/z of one side, twice as much of the other.
            let rest = FRAC_PI_2 - phase;
            let z = root(0.1, 4.0 / rest, |z| FRAC_PI_2 - (2.0 * z).atan() + rest - 1.0 / z);
            // tau_c^2 + tau_c L = (z L)^2
            2.0 * z * z * L / (1.0 + (1.0 + 4.0 * z * z).sqrt())
        }
    };
    let Ti = T + 0.5 * L;
    let settings = Pid { Td: 0.5 * L * (T / Ti), ..Pid::pi(Ti / (K * (tau_c + 0.5 * L)), Ti) };
    Ok((settings, tau_c))
}

fn second(plant: &Second, target: ImcTarget) -> Found {
    let Second { K, sum: p, product: q, Tz, L } = *plant;
    let (b, ahead) = ((-Tz).max(0.0), Tz.max(0.0));
    let a = match target {
        ImcTarget::TauC(tau_c) => check_tau_c(tau_c, L + b)? + L + b,
        ImcTarget::GainMargin(_) | ImcTarget::PhaseMargin(_) if L + b == 0.0 => return Err(target.no_delay()),
        ImcTarget::GainMargin(A) if A > 0.0 && A.is_finite() => A * unit_gain(b, L),
        ImcTarget::GainMargin(A) => return Err(Error::argument("gain_margin", A, "a factor above 1")),
        ImcTarget::PhaseMargin(degrees) => {
            let phase = within_90(degrees)?;
            let left = FRAC_PI_2 - phase;
            // Where either term alone is all that is left.
            let most = (left / L).min(left.tan() / b);
            b.hypot(1.0 / root(0.0, most, |w| (b * w).atan() + w * L - left))
        }
    };
    let tau_c = a - L - b;
    if tau_c < -1e-9 * a {
        let text = format!("`{}` is {}, below what tau_c = 0 gives already", target.name(), target.value());
        return Err(Error::new("U01", text).remedy("ask for more margin"));
    }
    let Ti = p - ahead;
    let settings = Pid { Td: (q / Ti - ahead).max(0.0), Tf: ahead, ..Pid::pi(Ti / (K * a), Ti) };
    Ok((settings, tau_c.max(0.0)))
}

/// Whether a PID can have the plant's poles as its zeros and the plant's zero to the left as its filter.
fn is_cancelled(plant: &Second) -> bool {
    let Second { sum: p, product: q, Tz, .. } = *plant;
    Tz <= 0.0 || Tz < p && q >= Tz * (p - Tz)
}

/// `a` at which `(1 - b s) e^(-L s)/(a s)` has a gain margin of 1.
fn unit_gain(b: f64, L: f64) -> f64 {
    if L == 0.0 {
        return b;
    }
    let w = root(0.0, FRAC_PI_2 / L, |w| (b * w).atan() + w * L - FRAC_PI_2);
    b.hypot(1.0 / w)
}

fn within_90(degrees: f64) -> Result<f64> {
    if degrees > 0.0 && degrees < 90.0 {
        return Ok(degrees.to_radians());
    }
    Err(Error::argument("phase_margin", degrees, "between 0 and 90 degrees"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const L: f64 = 0.1;

    fn tau_c(target: ImcTarget) -> f64 {
        imc_pid(&Fopdt { K: -2.0, T: 0.3, L }.into(), target, None).expect("settings").tau_c / L
    }

    /// Source 001 as corrected: 3 needs 1.433589 L, 60 degrees 0.637557 L.
    #[test]
    fn the_known_time_constants_come_out() {
        assert!((tau_c(ImcTarget::GainMargin(3.0)) - 1.433_589).abs() < 5e-7);
        assert!((tau_c(ImcTarget::PhaseMargin(60.0)) - 0.637_557).abs() < 5e-7);
    }

    #[test]
    fn every_phase_margin_has_its_time_constant() {
        for degrees in [0.01, 1.0, 30.0, 60.0, 85.0, 89.9, 89.9999f64] {
            let tau = tau_c(ImcTarget::PhaseMargin(degrees));
            let z = (tau * tau + tau).sqrt();
            let phase = PI - (2.0 * z).atan() - 1.0 / z;
            assert!((phase - degrees.to_radians()).abs() < 1e-9, "{degrees}: {}", phase.to_degrees());
        }
    }
}
