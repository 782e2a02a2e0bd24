//! Gain, phase and delay margins, and the peaks of the sensitivities, with the exact delay.
//!
//! ```text
//! gain margin   1/|L(j w_g)|,  arg L(j w_g) = -180 deg        source 001, (3.6-27), (3.6-28)
//! phase margin  180 deg + arg L(j w_p),  |L(j w_p)| = 1       source 001, (3.6-29), (3.6-30)
//! delay margin  phase margin / w_p
//! Ms = max |1/(1+L)|,  Mt = max |L/(1+L)|
//! noise gain = max |C/(1+L)|, from what the sensor adds to y to u
//! ```
//!
//! A sampled controller meets the exact pulse transfer function of the plant. The margins of an unstable
//! loop say nothing: it has a finite Ms as well.

use std::f64::consts::PI;

use super::open_loop::{OpenLoop, STEP, crosses_negative_axis, root};
use crate::error::Result;
use crate::linalg::Complex;
use crate::model::{Delay, Model, Pid, approximated};

/// Margins, of several crossings the one nearest to -1; infinite where the loop never crosses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Whether the closed loop is stable.
    pub stable: bool,
    /// Gain margin, factor; below 1 where the gain may fall less than rise.
    pub gain: f64,
    /// Gain margin, dB.
    pub gain_db: f64,
    /// Phase crossover, rad/s.
    pub w_gain: f64,
    /// Phase margin, degrees.
    pub phase_deg: f64,
    /// Gain crossover, rad/s.
    pub w_phase: f64,
    /// Delay margin, s.
    pub delay: f64,
    /// Largest sensitivity.
    pub Ms: f64,
    /// Largest complementary sensitivity.
    pub Mt: f64,
    /// Largest gain from measurement noise to u, u/y.
    pub noise_gain: f64,
}

/// Margins of `pid` on input 0 of `model`.
pub fn margins(model: &Model, pid: &Pid) -> Result<Margins> {
    pid.check()?;
    let open = OpenLoop::new(model, pid)?;
    let grid = open.grid();
    let L: Vec<Complex<f64>> = grid.iter().map(|&w| open.at(w)).collect();
    let [S, T, CS] = open.standstill();
    let mut result = Margins {
        stable: open.is_stable(&grid, &L),
        gain: f64::INFINITY,
        gain_db: f64::INFINITY,
        w_gain: f64::NAN,
        phase_deg: f64::INFINITY,
        w_phase: f64::NAN,
        delay: f64::INFINITY,
        Ms: peak(&grid, &L, |_, L| 1.0 / size(1.0 + L), &open).max(S),
        Mt: peak(&grid, &L, |_, L| size(L) / size(1.0 + L), &open).max(T),
        noise_gain: peak(&grid, &L, |w, L| size(open.controller(w)) / size(1.0 + L), &open)
            .max(CS)
            .max(open.noise_gain_beyond()),
    };
    for k in 0..grid.len() - 1 {
        let (a, b) = (grid[k], grid[k + 1]);
        // The size of L at a crossing is within a step of that at its ends.
        let near = size(L[k]).ln().abs() - 2.0 * STEP < result.gain.ln().abs();
        if near && crosses_negative_axis(L[k], L[k + 1]) {
            let w = root(a, b, |w| open.at(w).im);
            let at = open.at(w);
            if at.re < 0.0 && closer(1.0 / at.norm(), result.gain) {
                (result.gain, result.w_gain) = (1.0 / at.norm(), w);
            }
        }
        if (L[k].norm_sqr() > 1.0) != (L[k + 1].norm_sqr() > 1.0) {
            let w = root(a, b, |w| open.at(w).norm().ln());
            let phase = PI + open.at(w).arg(); // in [0, 2 pi]
            let signed = if phase > PI { phase - 2.0 * PI } else { phase };
            if signed.to_degrees().abs() < result.phase_deg.abs() {
                (result.phase_deg, result.w_phase) = (signed.to_degrees(), w);
            }
            result.delay = result.delay.min(phase / w);
        }
    }
    // With a sampled controller the phase reaches -180 degrees at the Nyquist frequency at the latest.
    let last = L[L.len() - 1];
    if pid.Ts.is_some() && last.re < 0.0 && closer(1.0 / last.norm(), result.gain) {
        (result.gain, result.w_gain) = (1.0 / last.norm(), grid[grid.len() - 1]);
    }
    result.gain_db = 20.0 * result.gain.log10();
    Ok(result)
}

/// Whether a gain margin is nearer to 1: one below 1 says how far the gain may fall.
fn closer(factor: f64, than: f64) -> bool {
    factor.ln().abs() < than.ln().abs()
}

/// `|z|`; quicker than `hypot`, and no loop is near the ends of the range of numbers.
fn size(z: Complex<f64>) -> f64 {
    z.norm_sqr().sqrt()
}

/// Largest value over all frequencies: every local one on the grid that may be the largest, refined between
/// its neighbours by golden section.
///
/// From one frequency of the grid to the next `L` and `C` change by a few percent of themselves, so that a
/// peak narrower than a step still stands out at one of its ends, and none rises further than `reach`.
fn peak(grid: &[f64], L: &[Complex<f64>], f: impl Fn(f64, Complex<f64>) -> f64, open: &OpenLoop) -> f64 {
    let values: Vec<f64> = grid.iter().zip(L).map(|(&w, &L)| f(w, L)).collect();
    let mut best = values.iter().copied().fold(0.0, f64::max);
    for k in 1..values.len() - 1 {
        let reach = || (1.0 + 3.0 * STEP) / (1.0 - 3.0 * STEP * size(L[k]) / size(1.0 + L[k]));
        let is_lower = || (0.0..best / values[k]).contains(&reach());
        if values[k] >= values[k - 1] && values[k] >= values[k + 1] && !is_lower() {
            best = best.max(highest(grid[k - 1], grid[k + 1], |w| f(w, open.at(w))));
        }
    }
    best
}

fn highest(mut a: f64, mut b: f64, at: impl Fn(f64) -> f64) -> f64 {
    let shrink = (5f64.sqrt() - 1.0) / 2.0;
    let (mut c, mut d) = (b - shrink * (b - a), a + shrink * (b - a));
    let (mut fc, mut fd) = (at(c), at(d));
    for _ in 0..50 {
        if fc > fd {
            (b, d, fd) = (d, c, fc);
            c = b - shrink * (b - a);
            fc = at(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + shrink * (b - a);
            fd = at(d);
        }
    }
    fc.max(fd)
}

/// Loop transfer `L`, sensitivity `S`, complementary sensitivity `T` and control sensitivity `CS`.
pub struct Sensitivities {
    /// `C G`.
    pub L: Vec<Complex<f64>>,
    /// `1 / (1 + L)`.
    pub S: Vec<Complex<f64>>,
    /// `L / (1 + L)`.
    pub T: Vec<Complex<f64>>,
    /// `C / (1 + L)`.
    pub CS: Vec<Complex<f64>>,
}

/// Frequency responses of the loop at `w` rad/s.
pub fn sensitivities(model: &Model, pid: &Pid, w: &[f64], delay: Delay) -> Result<Sensitivities> {
    let model = &approximated(model, delay)?;
    pid.check()?;
    let open = OpenLoop::new(model, pid)?;
    let L: Vec<Complex<f64>> = w.iter().map(|&w| open.at(w)).collect();
    let S: Vec<Complex<f64>> = L.iter().map(|L| (L + 1.0).inv()).collect();
    let T = L.iter().zip(&S).map(|(L, S)| L * S).collect();
    let CS = w.iter().zip(&S).map(|(&w, S)| pid.freqresp(w) * S).collect();
    Ok(Sensitivities { L, S, T, CS })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Fopdt;

    /// The loop of IMC-PI, `e^(-L s) / (s (tau_c + L))`.
    fn imc_loop(K: f64, T: f64, L: f64, tau_c: f64) -> (Model, Pid) {
        (Model::from(Fopdt { K, T, L }), Pid::pi(T / (K * (tau_c + L)), T))
    }

    #[test]
    fn margins_of_imc_pi_are_the_closed_forms() {
        for (K, T, L, tau_c) in [(5.939, 0.1491, 0.1, 0.05), (-2.0, 1e3, 40.0, 40.0), (1.0, 1.0, 3.0, 0.0)] {
            let (model, pid) = imc_loop(K, T, L, tau_c);
            let m = margins(&model, &pid).expect("margins");
            let close = |ours: f64, exact: f64| (ours / exact - 1.0).abs() < 1e-9;
            assert!(close(m.gain, PI * (tau_c + L) / (2.0 * L)), "(3.6-35): {}", m.gain);
            assert!(close(m.w_gain, PI / (2.0 * L)), "phase crossover: {}", m.w_gain);
            assert!(close(m.phase_deg.to_radians(), PI / 2.0 - L / (tau_c + L)), "(3.6-38): {}", m.phase_deg);
            assert!(close(m.w_phase, 1.0 / (tau_c + L)), "gain crossover: {}", m.w_phase);
            assert!(close(m.delay, m.phase_deg.to_radians() * (tau_c + L)), "delay margin: {}", m.delay);
        }
    }

    /// `|1 + L|` of `k e^(-s) / s` by brute force.
    #[test]
    fn peaks_are_those_of_a_fine_grid() {
        let (model, pid) = imc_loop(1.0, 2.0, 1.0, 0.6);
        let m = margins(&model, &pid).expect("margins");
        let of = |w: f64| Complex::from_polar(1.0 / (1.6 * w), -w - PI / 2.0);
        let fine = || (1..400_000).map(|k| of(f64::from(k) * 1e-5));
        let Ms = fine().map(|L| 1.0 / (1.0 + L).norm()).fold(0.0, f64::max);
        let Mt = fine().map(|L| (L / (1.0 + L)).norm()).fold(0.0, f64::max);
        assert!((m.Ms / Ms - 1.0).abs() < 1e-8 && (m.Mt / Mt - 1.0).abs() < 1e-8, "{m:?} {Ms} {Mt}");
    }

    /// `Kp b / (z - a)` turns to -180 degrees at the Nyquist frequency only.
    #[test]
    fn a_sampled_loop_has_its_gain_margin_at_nyquist() {
        let (Kp, Ts) = (0.5, 0.2);
        let plant = Fopdt { K: 2.0, T: 1.0, L: 0.0 };
        let pid = Pid { Ki: 0.0, Ts: Some(Ts), ..Pid::pi(Kp, 1.0) };
        let m = margins(&plant.into(), &pid).expect("margins");
        let (a, b, _, _) = plant.sampled(Ts);
        assert!((m.gain / ((1.0 + a) / (b * Kp)) - 1.0).abs() < 1e-9, "{}", m.gain);
        assert!((m.w_gain / (PI / Ts) - 1.0).abs() < 1e-9);
    }

    fn stable(model: &Model, pid: Pid) -> bool {
        margins(model, &pid).expect("margins").stable
    }

    /// `k e^(-L s) / s` is stable for `0 < k L < pi/2`.
    #[test]
    fn a_delayed_integrator_is_stable_up_to_a_quarter_turn() {
        for (k, is_stable) in [(0.01, true), (1.57, true), (1.572, false), (9.0, false), (-0.1, false)] {
            let model = Model::from(Fopdt { K: -2.0, T: 5.0, L: 1.0 });
            assert_eq!(stable(&model, Pid::pi(k * 5.0 / -2.0, 5.0)), is_stable, "{k}");
        }
    }

    /// The closed pole of `A = 1 - p q^-1`, `B = q^-1` under a proportional controller is `p - Kp`.
    #[test]
    fn a_proportional_controller_may_hold_an_unstable_plant() {
        for (p, Kp, is_stable) in [
            (1.2, 0.3, true),
            (1.2, 2.1, true),
            (1.2, 0.1, false),
            (1.2, 2.3, false),
            (1.0, 0.5, true),
            (1.0, 2.1, false),
            (1.0, -0.1, false),
            (0.5, -0.4, true),
            (0.5, -0.6, false),
        ] {
            let plant = crate::model::PolyModel::arx(vec![1.0, -p], vec![vec![1.0]], vec![1], 0.1);
            let pid = Pid { Ki: 0.0, Ts: Some(0.1), ..Pid::pi(Kp, 1.0) };
            assert_eq!(stable(&Model::Poly(plant), pid), is_stable, "{p} {Kp}");
        }
    }

    /// Integrator under a sampled PI: Jury on `(z - 1)^2 + Kp (z - 1) + Ki Ts z`.
    #[test]
    fn two_integrators_are_stable_where_jury_says_so() {
        for (Kp, Ki_Ts) in [(0.5, 0.1), (1.5, 0.9), (1.5, 1.1), (0.1, 3.0), (1.9, 0.05)] {
            let plant = crate::model::PolyModel::arx(vec![1.0, -1.0], vec![vec![1.0]], vec![1], 0.1);
            let pid = Pid { Ki: Ki_Ts / 0.1, Ts: Some(0.1), ..Pid::pi(Kp, 1.0) };
            let jury = Kp > 0.0 && 4.0 - 2.0 * Kp - Ki_Ts > 0.0;
            assert_eq!(stable(&Model::Poly(plant), pid), jury, "{Kp} {Ki_Ts}");
        }
    }

    #[test]
    fn a_lag_without_delay_has_no_gain_margin_to_lose() {
        let (model, pid) = imc_loop(2.0, 5.0, 0.0, 1.0);
        let m = margins(&model, &pid).expect("margins");
        assert!(m.gain.is_infinite() && (m.phase_deg - 90.0).abs() < 1e-9, "{m:?}");
    }

    #[test]
    fn sensitivities_add_up_to_one() {
        let (model, pid) = imc_loop(2.0, 5.0, 1.0, 1.0);
        let s = sensitivities(&model, &pid, &[0.01, 0.3, 7.0], Delay::Exact).expect("responses");
        for (S, T) in s.S.iter().zip(&s.T) {
            assert!((S + T - 1.0).norm() < 1e-14);
        }
    }
}
