//! A fit of a window: its rows in scaled units, the minimum of every delay, and what they say together.

use std::ops::{Range, RangeInclusive};

use statrs::function::erf::erf;

use super::cell::{EXACT, Found, Free, OWN, Rows, SHARED, linearised, search};
use super::plant::{Plant, RANK_TOLERANCE};
use super::{Begin, Estimate, Mode, Window};
use crate::linalg::{extent, solve};

/// Shortest and longest time constant searched, in samples.
const TIMES: (f64, f64) = (0.2, 1e5);

/// Rows beside the parameters that a fit needs.
const SPARE: usize = 2;

/// Squared deviations of `b2`, let free at an end of the range, from which on the delay lies beyond it.
const BEYOND: f64 = 4.0;

/// Likelihood against that of the best, from which on a minimum counts.
const UNLIKELY: f64 = 1e-6;

/// The rows of a fit, centred and scaled.
pub(super) struct Scaled {
    pub(super) rows: Rows,
    pub(super) Ts: f64,
    pub(super) fraction: bool,
    cells: RangeInclusive<usize>,
    pub(super) u0: f64,
    pub(super) y0: f64,
    /// What one unit of u and of y becomes.
    pub(super) su: f64,
    pub(super) sy: f64,
}

impl Scaled {
    pub(super) fn new(window: &Window, range: Range<usize>) -> Option<Self> {
        let (u, y) = (&window.u[range.clone()], &window.y[range.clone()]);
        let (u0, y0) = (*u.first()?, *y.first()?);
        let factor = |x: &[f64]| {
            let (low, high) = extent(x);
            if high > low { 1.0 / (high - low) } else { 1.0 }
        };
        let (su, sy) = (factor(u), factor(y));
        let a = |T: f64| (-1.0 / T).exp();
        let rows = Rows {
            u: u.iter().map(|u| (u - u0) * su).collect(),
            y: y.iter().map(|y| (y - y0) * sy).collect(),
            stretches: stretches(window, &range),
            counts: window.counts[range].to_vec(),
            a: (a(TIMES.0), a(TIMES.1)),
        };
        let parameters = 4 + OWN * rows.stretches.len();
        (rows.N() >= parameters + SPARE && !rows.stretches.is_empty()).then_some(Scaled {
            rows,
            Ts: window.Ts,
            fraction: window.fraction,
            cells: window.cells.clone(),
            u0,
            y0,
            su,
            sy,
        })
    }

    /// The minimum of a cell, from the coefficients of the last fit.
    pub(super) fn search(&self, m: usize, [a, b1, b2, c]: [f64; SHARED]) -> Option<Found> {
        let gain = self.sy / self.su;
        let inside = self.fraction && m < *self.cells.end();
        search(&self.rows, m, [a, b1 * gain, b2 * gain, c], inside)
    }

    /// Coefficients in the units of the signals.
    pub(super) fn physical(&self, theta: &[f64]) -> [f64; SHARED] {
        let gain = self.su / self.sy;
        [theta[0], theta[1] * gain, theta[2] * gain, theta[3]]
    }

    /// Likelihood at the minimum of each cell, that of the best being 1.
    pub(super) fn weights(&self, found: &[Option<Found>]) -> Vec<f64> {
        let half = 0.5 * self.rows.N() as f64;
        let floor = EXACT * self.rows.N() as f64;
        let cost = |f: &Option<Found>| f.as_ref().map_or(f64::INFINITY, |f| f.cost + floor);
        let least = found.iter().map(cost).fold(f64::INFINITY, f64::min);
        found.iter().map(|f| (-half * (cost(f) / least).ln()).exp()).collect()
    }

    /// What the minima say together.
    pub(super) fn estimate(&self, found: &[Option<Found>], weights: &[f64], best: usize) -> Option<Estimate> {
        let N = self.rows.N();
        let weight = |i: usize| weights.get(i).copied().unwrap_or(0.0);
        let (mut plants, mut shown): (Vec<(Plant, f64)>, _) = (Vec::new(), None);
        for (i, at) in found.iter().enumerate() {
            // Between whole samples the likelihood goes on from cell to cell: only its tops count.
            let is_top = !self.fraction || weight(i) >= weight(i.wrapping_sub(1)).max(weight(i + 1));
            let counts = i == best || is_top && weight(i) > UNLIKELY;
            let Some(at) = at.as_ref().filter(|_| counts) else { continue };
            let plant = self.plant(at, self.cells.start() + i);
            if i == best {
                shown = plant.clone();
            }
            plants.extend(plant.map(|plant| (plant, weights[i])));
        }
        let sum: f64 = plants.iter().map(|(_, weight)| weight).sum();
        plants.iter_mut().for_each(|(_, weight)| *weight /= sum);
        let (shown, fit) = (shown?, found[best].as_ref()?);
        let mode = |(plant, weight): &(Plant, f64)| Mode { model: plant.model, P: plant.P, weight: *weight };
        let modes: Vec<Mode> = plants.iter().map(mode).collect();
        let parameters = fit.parameters();
        let s2 = fit.cost / (N - parameters) as f64 / (self.sy * self.sy);
        let delays = self.cells.clone().map(|m| delay_share(&modes, m as f64, self.Ts)).collect();
        Some(Estimate {
            model: shown.model,
            P: about(&shown, &plants),
            outside: self.is_outside(fit, best),
            offset: shown.offset,
            c: fit.theta[3],
            s2,
            N,
            rss: fit.cost / (self.sy * self.sy),
            modes,
            delays,
            predictor: shown.predictor,
        })
    }

    /// Whether `b2`, let free at an end of the range, would be of the sign that a delay beyond it has.
    fn is_outside(&self, found: &Found, i: usize) -> bool {
        let m = self.cells.start() + i;
        let (shorter, longer) = (i == 0 && m > 0, m == *self.cells.end());
        if found.free.b2 || !(shorter || longer) {
            return false;
        }
        let Some(triangle) = linearised(&self.rows, m, &found.theta, Free { b2: true, c: found.free.c })
        else {
            return false;
        };
        let n = triangle.n() - 1;
        let all: Vec<usize> = (0..n).collect();
        let Ok(step) = solve(&triangle, &all, n, RANK_TOLERANCE) else { return false };
        let s2 = (found.cost / (self.rows.N() - found.parameters()) as f64).max(EXACT);
        let (b1, b2) = (found.theta[1], step.theta[2]);
        let is_sure = b2 * b2 > BEYOND * s2 * step.inverse_gram[2 * n + 2];
        is_sure && if b1 * b2 > 0.0 { longer } else { shorter }
    }
}

/// Covariance of `K, T, L, O` about the plant shown, over all that are possible.
fn about(shown: &Plant, plants: &[(Plant, f64)]) -> [f64; 16] {
    let vector = |p: &Plant| [p.model.K, p.model.T, p.model.L, p.offset];
    let mut P = [0.0; 16];
    for (plant, weight) in plants {
        let (x, x0) = (vector(plant), vector(shown));
        for (ij, p) in P.iter_mut().enumerate() {
            let (i, j) = (ij / 4, ij % 4);
            *p += weight * (plant.P[ij] + (x[i] - x0[i]) * (x[j] - x0[j]));
        }
    }
    P
}

/// Rows whose errors count: from where every lag lies in the same signals, and after the first row of a level.
fn stretches(window: &Window, range: &Range<usize>) -> Vec<Range<usize>> {
    let history = window.cells.end() + 2;
    let begin = |s: &Begin| (s.row.max(range.start) - range.start, s.gap || s.row <= range.start);
    let inside = |s: &&Begin| s.row < range.end;
    let starts: Vec<(usize, bool)> = window.starts.iter().filter(inside).map(begin).collect();
    let first = starts.iter().rposition(|s| s.0 == 0).unwrap_or(0);
    let mut stretches = Vec::new();
    let mut ready = 0;
    for (k, &(row, gap)) in starts.iter().enumerate().skip(first) {
        if gap {
            ready = row + history;
        }
        let end = starts.get(k + 1).map_or(range.len(), |next| next.0);
        let stretch = ready.max(row + 1)..end;
        if stretch.len() > OWN {
            stretches.push(stretch);
        }
    }
    stretches
}

/// Probability that `L` rounds to `m` samples.
fn delay_share(modes: &[Mode], m: f64, Ts: f64) -> f64 {
    let below = |mode: &Mode, samples: f64| {
        let (away, sd) = (samples * Ts - mode.model.L, mode.P[10].sqrt());
        if sd > 0.0 { 0.5 * (1.0 + erf(away / sd / std::f64::consts::SQRT_2)) } else { f64::from(away > 0.0) }
    };
    modes.iter().map(|mode| mode.weight * (below(mode, m + 0.5) - below(mode, m - 0.5))).sum()
}
