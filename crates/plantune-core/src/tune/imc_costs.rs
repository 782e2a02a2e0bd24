//! Cost functions of IMC on first order plus dead time, to a unit step of the set point.
//!
//! ```text
//! ideal loop, e = 1 until L, then e^(-(t - L)/tau_c)                    (3.6-63)
//!   ISE = L + tau_c/2,  IAE = L + tau_c,  ITAE = L^2/2 + L tau_c + tau_c^2     (3.6-64) to (3.6-66)
//! IMC-PI with the exact delay, e' = -e(t - L)/(tau_c + L),  e = 1 until L      (3.6-31)
//!   ISE = L cos k/(2 k (1 - sin k)),  k = L/(tau_c + L)
//!   k <= 1/e: no overshoot, IAE = L/k,  ITAE = L^2 (1 - k)/k^2;  else piece by piece
//! ```
//!
//! Source 001, 3.6.7 as corrected: its costs are those of the ideal loop, which takes a dead-time compensator;
//! with PI and a gain margin of 3 they are 1.6540 L, 2.1379 L and 2.8557 L^2. In units of L the error is a
//! polynomial between two whole times, `e_(n+1)(x) = e_n(1) - k int_0^x e_n`; what it cannot see of its tail
//! is below 1e-16. ISE by Parseval on `1/(s + k e^(-s))`.

use std::f64::consts::E;

use super::open_loop::root;
use crate::error::{Error, Result};

/// Integrals of `e^2`, `|e|` and `t |e|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Costs {
    /// ISE, s.
    pub ise: f64,
    /// IAE, s.
    pub iae: f64,
    /// ITAE, s^2.
    pub itae: f64,
}

/// Squared distance of a response from its nominal trajectory, `J = Ts sum_(n = 1)^(N_J) (y_N(n) - y(n))^2`, over
/// the first `T_J` seconds; source 001, (3.6-54) to (3.6-59), the sum times `Ts` so that it is an integral.
pub fn tracking_cost(nominal: &[f64], y: &[f64], Ts: f64, T_J: f64) -> Result<f64> {
    if nominal.len() != y.len() {
        let lengths = format!("{} and {} long", nominal.len(), y.len());
        return Err(Error::argument("y_N, y", lengths, "of the same length"));
    }
    if !(Ts > 0.0 && Ts.is_finite() && T_J > 0.0) {
        return Err(Error::argument("Ts, T_J", format!("{Ts}, {T_J}"), "positive numbers of seconds"));
    }
    let last = (T_J / Ts + 1e-9).floor().min(y.len() as f64 - 1.0).max(0.0) as usize;
    Ok(Ts * (1..=last).map(|n| (nominal[n] - y[n]).powi(2)).sum::<f64>())
}

/// Coefficients of a piece that count, `k^n/n!` being below 1e-17 beyond.
const DEGREE: usize = 20;

/// An error below this is over.
const OVER: f64 = 1e-17;

/// Of the loop that IMC aims at, the dead time compensated.
pub fn ideal_costs(L: f64, tau_c: f64) -> Result<Costs> {
    check(L, tau_c)?;
    Ok(Costs { ise: L + 0.5 * tau_c, iae: L + tau_c, itae: 0.5 * L * L + L * tau_c + tau_c * tau_c })
}

/// Of IMC-PI on the exact delay.
pub fn pi_costs(L: f64, tau_c: f64) -> Result<Costs> {
    check(L, tau_c)?;
    if L == 0.0 {
        return ideal_costs(L, tau_c);
    }
    let k = L / (tau_c + L);
    let ise = L * k.cos() / (2.0 * k * (1.0 - k.sin()));
    let (iae, itae) = if k <= 1.0 / E { (1.0 / k, (1.0 - k) / (k * k)) } else { by_pieces(k) };
    Ok(Costs { ise, iae: L * iae, itae: L * L * itae })
}

fn check(L: f64, tau_c: f64) -> Result<()> {
    for (name, value) in [("L", L), ("tau_c", tau_c)] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(Error::argument(name, value, "zero or positive"));
        }
    }
    if L + tau_c > 0.0 {
        Ok(())
    } else {
        Err(Error::argument("tau_c", tau_c, "positive without a dead time"))
    }
}

/// IAE and ITAE for a delay of 1.
fn by_pieces(k: f64) -> (f64, f64) {
    // The first piece is 1: its integrals are 1 and 1/2.
    let (mut iae, mut itae) = (1.0, 0.5);
    let mut piece = vec![1.0];
    let mut start = 1.0;
    loop {
        let mut next = vec![at(&piece, 1.0)];
        next.extend(piece.iter().take(DEGREE).enumerate().map(|(n, c)| -k * c / (n + 1) as f64));
        piece = next;
        for (a, b) in stretches(&piece) {
            let whole = integral(&piece, a, b);
            let sign = if whole < 0.0 { -1.0 } else { 1.0 };
            let late: Vec<f64> = [0.0].into_iter().chain(piece.iter().copied()).collect();
            iae += sign * whole;
            itae += sign * (integral(&late, a, b) + start * whole);
        }
        start += 1.0;
        if piece.iter().all(|c| c.abs() < OVER) {
            return (iae, itae);
        }
    }
}

/// From zero to zero; within one delay there is one at most.
fn stretches(piece: &[f64]) -> Vec<(f64, f64)> {
    if (at(piece, 0.0) > 0.0) == (at(piece, 1.0) > 0.0) {
        return vec![(0.0, 1.0)];
    }
    let zero = root(0.0, 1.0, |x| at(piece, x));
    vec![(0.0, zero), (zero, 1.0)]
}

/// `p(x)`, ascending powers.
fn at(p: &[f64], x: f64) -> f64 {
    p.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

fn integral(p: &[f64], a: f64, b: f64) -> f64 {
    let whole: Vec<f64> =
        [0.0].into_iter().chain(p.iter().enumerate().map(|(n, c)| c / (n + 1) as f64)).collect();
    at(&whole, b) - at(&whole, a)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Source 001 as corrected, gain margin 3.
    #[test]
    fn the_known_costs_come_out() {
        let (L, tau_c) = (2.0, 2.0 * (6.0 / std::f64::consts::PI - 1.0));
        let found = pi_costs(L, tau_c).expect("costs");
        for (ours, known) in
            [(found.ise / L, 1.653_986_7), (found.iae / L, 2.137_855_6), (found.itae / L / L, 2.855_653_8)]
        {
            assert!((ours - known).abs() < 5e-8, "{found:?}");
        }
    }

    /// The pieces and the closed form where both hold: the double root at `k = 1/e`.
    #[test]
    fn pieces_meet_the_closed_form() {
        for k in [0.2, 0.3, 1.0 / E] {
            let (iae, itae) = by_pieces(k);
            assert!(
                (iae * k - 1.0).abs() < 1e-12 && (itae * k * k / (1.0 - k) - 1.0).abs() < 1e-12,
                "{k} {iae}"
            );
        }
    }
}
