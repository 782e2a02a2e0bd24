//! Time-domain indices of a closed-loop response, from true integrals.
//!
//! `rise` 10-90 %, `settling` into 2 % of the move and interpolated, overshoots in percent of the move,
//! `ise iae itae` of `r - y`, `control_energy` the integral of `u^2`, `total_variation` of `u`.
//! Source 001, tables 3.6-2 and 3.6-3, and (3.6-55).

use crate::sim::ClosedLoop;

/// Indices; NaN where the response does not define one (no set-point move, not settled).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Indices {
    /// From 10 to 90 % of the move, s.
    pub rise: f64,
    /// From when on y stays within 2 % of the move, s.
    pub settling: f64,
    /// Beyond the final value, % of the move.
    pub overshoot: f64,
    /// Integral of `e^2`.
    pub ise: f64,
    /// Integral of `|e|`.
    pub iae: f64,
    /// Integral of `t |e|`.
    pub itae: f64,
    /// Of u beyond its final value, % of its move.
    pub control_overshoot: f64,
    /// Integral of `u^2`.
    pub control_energy: f64,
    /// Sum of all moves of u.
    pub total_variation: f64,
}

/// Indices of a response.
pub fn indices(run: &ClosedLoop) -> Indices {
    let (y0, u0) = run.start;
    let nodes = run.y.len();
    let y_final = run.r[nodes - 1];
    let move_y = y_final - y0;
    let (mut ise, mut iae, mut itae, mut energy) = (0.0, 0.0, 0.0, 0.0);
    let mut variation = 0.0;
    for k in 0..nodes {
        variation += (run.u[k] - run.u_left[k]).abs();
        if k + 1 == nodes {
            break;
        }
        let (e0, e1) = (run.r[k] - run.y[k], run.r[k] - run.y[k + 1]);
        let (v0, v1) = (run.u[k], run.u_left[k + 1]);
        let t = k as f64 * run.h;
        ise += run.h * (e0 * e0 + e0 * e1 + e1 * e1) / 3.0;
        iae += run.h * 0.5 * (e0.abs() + e1.abs());
        itae += run.h * 0.5 * (t * e0.abs() + (t + run.h) * e1.abs());
        energy += run.h * (v0 * v0 + v0 * v1 + v1 * v1) / 3.0;
        variation += (v1 - v0).abs();
    }
    let progress: Vec<f64> = run.y.iter().map(|y| (y - y0) / move_y).collect();
    let defined = move_y != 0.0;
    let control: Vec<f64> = run.u.iter().map(|u| (u - u0) / (run.u_final - u0)).collect();
    Indices {
        rise: if defined {
            run.h * (first_above(&progress, 0.9) - first_above(&progress, 0.1))
        } else {
            f64::NAN
        },
        settling: if defined { run.h * settled(&progress, 0.02) } else { f64::NAN },
        overshoot: if defined { 100.0 * (highest(&progress) - 1.0).max(0.0) } else { f64::NAN },
        ise,
        iae,
        itae,
        control_overshoot: if run.u_final == u0 {
            f64::NAN
        } else {
            100.0 * (largest(&control) - 1.0).max(0.0)
        },
        control_energy: energy,
        total_variation: variation,
    }
}

/// Node, interpolated, at which `x` first reaches `level`.
fn first_above(x: &[f64], level: f64) -> f64 {
    match x.iter().position(|&v| v >= level) {
        None => f64::NAN,
        Some(0) => 0.0,
        Some(k) => k as f64 - (x[k] - level) / (x[k] - x[k - 1]),
    }
}

/// Node, interpolated, from which on `x` stays within `band` of 1; NaN if it never does.
fn settled(x: &[f64], band: f64) -> f64 {
    match x.iter().rposition(|v| (v - 1.0).abs() > band) {
        None => 0.0,
        Some(k) if k + 1 == x.len() => f64::NAN,
        Some(k) => {
            let edge = 1.0 + band * (x[k] - 1.0).signum();
            k as f64 + (x[k] - edge) / (x[k] - x[k + 1])
        }
    }
}

/// The largest value; where two straight stretches meet between nodes, the corner.
fn largest(x: &[f64]) -> f64 {
    let k = (0..x.len()).max_by(|&i, &j| x[i].total_cmp(&x[j])).unwrap_or(0);
    let corner = |left: usize| {
        // The lines through (left-1, left) and (left+1, left+2).
        let (rise, fall) = (x[left] - x[left - 1], x[left + 1] - x[left + 2]);
        let at = (x[left + 1] + fall - x[left]) / (rise + fall);
        let meets = rise > 0.0 && fall > 0.0 && (0.0..=1.0).contains(&at);
        if meets { x[left] + rise * at } else { x[k] }
    };
    let lefts = k.saturating_sub(1)..=k;
    let inside = lefts.filter(|&left| left >= 1 && left + 2 < x.len());
    inside.map(corner).fold(x[k], f64::max)
}

/// The peak of a parabola through the largest value and its neighbours.
fn highest(x: &[f64]) -> f64 {
    let k = (0..x.len()).max_by(|&i, &j| x[i].total_cmp(&x[j])).unwrap_or(0);
    if k == 0 || k + 1 == x.len() {
        return x[k];
    }
    let (a, b, c) = (x[k - 1], x[k], x[k + 1]);
    let curve = a - 2.0 * b + c;
    if curve < 0.0 { b - (c - a) * (c - a) / (8.0 * curve) } else { b }
}
