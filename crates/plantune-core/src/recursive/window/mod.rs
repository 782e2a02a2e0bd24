//! Windowed maximum likelihood: a first-order plant of any dead time, refitted on the last rows.
//!
//! ```text
//! y(t) = a y(t-1) + b1 u(t-m-1) + b2 u(t-m-2) + d + e(t) + c e(t-1),   L = m Ts + f
//! K = (b1 + b2) / (1 - a),   T = -Ts / ln a,   f = Ts + T ln(1 - b1/K),   O = d / (1 - a)
//! ```
//!
//! This is the sampled plant exactly ([`crate::model::Fopdt`]) under equation noise with one coefficient, which
//! holds white noise on y (`c = -a`) as well as on the equation (`c = 0`), and is unbiased in a closed loop. The
//! level `d` is a parameter of each stretch: where it jumps, [`Window::new_level`] begins another one and the
//! plant stays known. Every delay of the range is searched from where it stood at the last fit; the probability of
//! a delay is the likelihood at its minimum, spread as its standard deviation says.
//!
//! Ljung 1999, 7.2 and 7.4; the exact delay as in source 001, (3.5-46), with a fraction.

mod cell;
mod predictor;

use std::ops::{Range, RangeInclusive};

use statrs::function::erf::erf;

use self::cell::{EXACT, Found, OWN, Rows, SHARED, linearised, search};
pub use self::predictor::Predictor;
use crate::error::{Error, Result};
use crate::linalg::{extent, solve};
use crate::model::Fopdt;

/// Shortest and longest time constant searched, in samples.
const TIMES: (f64, f64) = (0.2, 1e5);

/// Rows beside the parameters that a fit needs.
const SPARE: usize = 2;

/// Pivots below this share mean that the rows do not tell parameters apart.
const RANK_TOLERANCE: f64 = 1e-9;

/// Squared deviations of `b2`, let free at an end of the range, from which on the delay lies beyond it.
const BEYOND: f64 = 9.0;

/// Likelihood against that of the best, from which on a minimum counts.
const UNLIKELY: f64 = 1e-6;

/// The same, below which a delay is out of the question for now.
const HOPELESS: f64 = 1e-9;

/// Rows kept, and how they fall into stretches.
#[derive(Clone, Debug)]
pub struct Window {
    Ts: f64,
    /// Delays in whole samples.
    cells: RangeInclusive<usize>,
    /// Whether a delay may have a fraction of a sample.
    fraction: bool,
    /// Most rows that count.
    most: usize,
    u: Vec<f64>,
    y: Vec<f64>,
    counts: Vec<bool>,
    starts: Vec<Begin>,
    /// `a, b1, b2, c` of each cell at the last fit, in the units of the signals.
    warm: Vec<[f64; 4]>,
    /// Cells that the last fit found out of the question.
    hopeless: Vec<bool>,
    /// The cell of these that is searched all the same.
    turn: usize,
}

/// The first row of a stretch, and whether the rows before it belong to the same signals.
#[derive(Clone, Copy, Debug)]
struct Begin {
    row: usize,
    gap: bool,
}

/// What the rows say.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The most probable plant.
    pub model: Fopdt,
    /// Covariance of `K, T, L, O` over all plants that are possible; row-major.
    pub P: [f64; 16],
    /// Whether the rows speak for a delay beyond the range.
    pub outside: bool,
    /// `O` in `y = G u + O`, of the last stretch.
    pub offset: f64,
    /// Coefficient of the noise, `C = 1 + c q^-1`.
    pub c: f64,
    /// Variance of `e`.
    pub s2: f64,
    /// Squared errors in the sum.
    pub N: usize,
    /// Sum of squared errors.
    pub rss: f64,
    /// Plants that the rows leave possible, each a minimum of the likelihood, with its probability.
    pub modes: Vec<Mode>,
    /// Probability of each whole-sample delay `nk = 1 + L/Ts` of the range, `L` rounded.
    pub delays: Vec<f64>,
    /// Its one-step predictor.
    pub predictor: Predictor,
}

/// One minimum.
#[derive(Clone, Debug)]
pub struct Mode {
    /// The plant.
    pub model: Fopdt,
    /// Covariance of `K, T, L, O`; row-major.
    pub P: [f64; 16],
    /// Its probability.
    pub weight: f64,
}

impl Estimate {
    /// Standard deviations of `K, T, L, O`.
    pub fn sd(&self) -> [f64; 4] {
        [0, 5, 10, 15].map(|ii| self.P[ii].sqrt())
    }
}

impl Window {
    /// Of at most `most` rows, for delays `nk` in samples, between whole samples where `fraction` allows it.
    pub fn new(Ts: f64, nk: RangeInclusive<usize>, fraction: bool, most: usize) -> Result<Self> {
        if !(Ts > 0.0 && Ts.is_finite()) {
            return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
        }
        if *nk.start() < 1 || nk.end() < nk.start() {
            let came = format!("({}, {})", nk.start(), nk.end());
            return Err(Error::argument("nk", came, "an ascending pair of samples, at least 1"));
        }
        let cells = nk.start() - 1..=nk.end() - 1;
        let count = cells.clone().count();
        let (warm, hopeless) = (vec![[0.5, 0.0, 0.0, 0.0]; count], vec![false; count]);
        let room = || Vec::with_capacity(2 * most);
        let starts = vec![Begin { row: 0, gap: true }];
        Ok(Window {
            hopeless,
            turn: 0,
            Ts,
            cells,
            fraction,
            most,
            u: room(),
            y: room(),
            counts: Vec::with_capacity(2 * most),
            starts,
            warm,
        })
    }

    /// Rows held.
    pub fn len(&self) -> usize {
        self.y.len()
    }

    /// Whether it holds none.
    pub fn is_empty(&self) -> bool {
        self.y.is_empty()
    }

    /// The last rows, at most `count`, oldest first.
    pub fn last(&self, count: usize) -> (&[f64], &[f64]) {
        let from = self.y.len().saturating_sub(count);
        (&self.u[from..], &self.y[from..])
    }

    /// Takes a row: `u` acts from here on, `y` is read here. An error that does not count is left out of the sum.
    pub fn push(&mut self, u: f64, y: f64, counts: bool) {
        if self.y.len() == 2 * self.most {
            self.forget(self.most);
        }
        self.u.push(u);
        self.y.push(y);
        self.counts.push(counts);
    }

    /// The next row does not follow the last one.
    pub fn gap(&mut self) {
        self.begin(Begin { row: self.y.len(), gap: true });
    }

    /// The level may have jumped `ago` rows before the next one.
    pub fn new_level(&mut self, ago: usize) {
        self.begin(Begin { row: self.y.len().saturating_sub(ago), gap: false });
    }

    /// Forgets all but the last `rows`.
    pub fn keep(&mut self, rows: usize) {
        self.forget(self.y.len().saturating_sub(rows));
    }

    fn begin(&mut self, at: Begin) {
        while self.starts.last().is_some_and(|s| s.row >= at.row && s.row > 0) {
            self.starts.pop();
        }
        if at.row > 0 {
            self.starts.push(at);
        } else {
            self.starts = vec![Begin { row: 0, gap: true }];
        }
    }

    /// Drops the first `rows`.
    fn forget(&mut self, rows: usize) {
        self.u.drain(..rows);
        self.y.drain(..rows);
        self.counts.drain(..rows);
        let first = self.starts.iter().rposition(|s| s.row <= rows).unwrap_or(0);
        self.starts.drain(..first);
        for start in &mut self.starts {
            start.row = start.row.saturating_sub(rows);
        }
        self.starts[0] = Begin { row: 0, gap: true };
    }

    /// Fits the last rows, at most as many as the window is wide; None where they do not tell a plant.
    ///
    /// Delays out of the question at the last fit are searched in turn, one at each fit.
    pub fn fit(&mut self) -> Option<Estimate> {
        let first = self.y.len().saturating_sub(self.most);
        self.turn = (self.turn + 1) % self.hopeless.len();
        let (turn, hopeless) = (self.turn, self.hopeless.clone());
        self.search(first..self.y.len(), |i| i == turn || !hopeless[i])
    }

    /// Fits some of the rows, at every delay.
    pub fn fit_rows(&mut self, range: Range<usize>) -> Option<Estimate> {
        self.search(range, |_| true)
    }

    fn search(&mut self, range: Range<usize>, is_due: impl Fn(usize) -> bool) -> Option<Estimate> {
        let scaled = Scaled::new(self, range)?;
        let last = *self.cells.end();
        let inside = |m: usize| self.fraction && m < last;
        let due = self.cells.clone().zip(&self.warm).enumerate();
        let found: Vec<Option<Found>> = due
            .map(|(i, (m, warm))| if is_due(i) { scaled.search(m, *warm, inside(m)) } else { None })
            .collect();
        for (warm, found) in self.warm.iter_mut().zip(&found) {
            if let Some(found) = found {
                *warm = scaled.physical(&found.theta);
            }
        }
        let weights = scaled.weights(&found);
        let best = (0..weights.len()).max_by(|&i, &j| weights[i].total_cmp(&weights[j]))?;
        for (i, hopeless) in self.hopeless.iter_mut().enumerate() {
            *hopeless = weights[i] < HOPELESS && i.abs_diff(best) > 1;
        }
        scaled.estimate(&found, &weights, best, self.cells.clone())
    }
}

/// The rows of a fit in scaled units.
struct Scaled {
    rows: Rows,
    Ts: f64,
    u0: f64,
    y0: f64,
    /// What one unit of u and of y becomes.
    su: f64,
    sy: f64,
    /// Whether a delay may have a fraction of a sample.
    fraction: bool,
}

/// A minimum as a plant.
#[derive(Clone)]
struct Plant {
    model: Fopdt,
    P: [f64; 16],
    offset: f64,
    predictor: Predictor,
}

impl Scaled {
    fn new(window: &Window, range: Range<usize>) -> Option<Self> {
        let (u, y) = (&window.u[range.clone()], &window.y[range.clone()]);
        let (u0, y0) = (*u.first()?, *y.first()?);
        let factor = |x: &[f64]| {
            let (low, high) = extent(x);
            if high > low { 1.0 / (high - low) } else { 1.0 }
        };
        let (su, sy) = (factor(u), factor(y));
        let history = window.cells.end() + 2;
        let begin = |s: &Begin| (s.row.max(range.start) - range.start, s.gap || s.row <= range.start);
        let inside = |s: &&Begin| s.row < range.end;
        let starts: Vec<(usize, bool)> = window.starts.iter().filter(inside).map(begin).collect();
        let from = starts.iter().rposition(|s| s.0 == 0).unwrap_or(0);
        let mut stretches: Vec<Range<usize>> = Vec::new();
        let mut ready = 0; // from here on every lag of u is there
        for (k, &(row, gap)) in starts.iter().enumerate().skip(from) {
            if gap || row == 0 {
                ready = row + history;
            }
            let end = starts.get(k + 1).map_or(u.len(), |next| next.0);
            let stretch = ready.max(row + 1)..end;
            if stretch.len() > OWN && stretch.start < end {
                stretches.push(stretch);
            }
        }
        let a = |T: f64| (-1.0 / T).exp();
        let rows = Rows {
            u: u.iter().map(|u| (u - u0) * su).collect(),
            y: y.iter().map(|y| (y - y0) * sy).collect(),
            counts: window.counts[range].to_vec(),
            stretches,
            a: (a(TIMES.0), a(TIMES.1)),
        };
        let parameters = 4 + OWN * rows.stretches.len();
        (rows.N() >= parameters + SPARE && !rows.stretches.is_empty()).then_some(Scaled {
            rows,
            Ts: window.Ts,
            u0,
            y0,
            su,
            sy,
            fraction: window.fraction,
        })
    }

    fn search(&self, m: usize, warm: [f64; SHARED], inside: bool) -> Option<Found> {
        let [a, b1, b2, c] = warm;
        let gain = self.sy / self.su;
        search(&self.rows, m, [a, b1 * gain, b2 * gain, c], inside)
    }

    /// Coefficients in the units of the signals.
    fn physical(&self, theta: &[f64]) -> [f64; SHARED] {
        let gain = self.su / self.sy;
        [theta[0], theta[1] * gain, theta[2] * gain, theta[3]]
    }

    /// Likelihood at the minimum of each cell, that of the best being 1.
    fn weights(&self, found: &[Option<Found>]) -> Vec<f64> {
        let half = 0.5 * self.rows.N() as f64;
        let floor = EXACT * self.rows.N() as f64;
        let cost = |f: &Option<Found>| f.as_ref().map_or(f64::INFINITY, |f| f.cost + floor);
        let least = found.iter().map(cost).fold(f64::INFINITY, f64::min);
        found.iter().map(|f| (-half * (cost(f) / least).ln()).exp()).collect()
    }

    fn estimate(
        &self,
        found: &[Option<Found>],
        weights: &[f64],
        best: usize,
        cells: RangeInclusive<usize>,
    ) -> Option<Estimate> {
        let N = self.rows.N();
        let weight = |i: usize| weights.get(i).copied().unwrap_or(0.0);
        let (mut plants, mut shown): (Vec<(Plant, f64)>, _) = (Vec::new(), None);
        for (i, at) in found.iter().enumerate() {
            // Between whole samples a minimum has two flanks, which are not plants of their own.
            let is_top = !self.fraction || weight(i) >= weight(i.wrapping_sub(1)).max(weight(i + 1));
            let is_minimum = is_top && weight(i) > UNLIKELY;
            let Some(at) = at.as_ref().filter(|_| i == best || is_minimum) else { continue };
            let plant = self.plant(at, cells.start() + i);
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
        let outside = self.is_outside(fit, best, &cells);
        let delays = cells.map(|m| delay_share(&modes, m as f64, self.Ts)).collect();
        Some(Estimate {
            model: shown.model,
            P: about(&shown, &plants),
            outside,
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
    fn is_outside(&self, found: &Found, i: usize, cells: &RangeInclusive<usize>) -> bool {
        let (first, m) = (*cells.start(), cells.start() + i);
        let (shorter, longer) = (m == first && first > 0, m == *cells.end());
        let tested = (shorter || longer) && !found.free.b2;
        let Some(triangle) = tested.then(|| linearised(&self.rows, m, &found.theta, found.free.c)).flatten()
        else {
            return false;
        };
        let n = triangle.n() - 1;
        let Ok(solution) = solve(&triangle, &(0..n).collect::<Vec<_>>(), n, RANK_TOLERANCE) else {
            return false;
        };
        let s2 = (found.cost / (self.rows.N() - found.parameters()) as f64).max(EXACT);
        let (b1, b2) = (found.theta[1], solution.theta[2]);
        let surely = b2 * b2 > BEYOND * s2 * solution.inverse_gram[2 * n + 2];
        surely && if b2 * b1 > 0.0 { longer } else { shorter }
    }

    /// The plant of a minimum, the covariance of `K, T, L, O`, and `O`; None where the rows leave it open.
    fn plant(&self, found: &Found, m: usize) -> Option<Plant> {
        let theta = &found.theta;
        let (a, b1, b2) = (theta[0], theta[1], theta[2]);
        let triangle = linearised(&self.rows, m, theta, found.free.c)?;
        let n = triangle.n() - 1;
        // A delay of whole samples is known: b2 is 0, and L has no variance.
        let columns: Vec<usize> = (0..n).filter(|&j| self.fraction || j != 2).collect();
        let solution = solve(&triangle, &columns, n, RANK_TOLERANCE).ok()?;
        let inverse = |i: usize, j: usize| {
            let at = |column: usize| columns.iter().position(|&j| j == column);
            at(i).zip(at(j)).map_or(0.0, |(i, j)| solution.inverse_gram[i * columns.len() + j])
        };
        let s2 = found.cost / (self.rows.N() - found.parameters()) as f64;
        let K = (b1 + b2) / (1.0 - a);
        let T = -self.Ts / a.ln();
        let share = b1 / K; // 1 - e^(-(Ts-f)/T)
        let f = (self.Ts + T * (1.0 - share).ln()).clamp(0.0, self.Ts);
        let d = theta[theta.len() - OWN];
        // Rows of the map from a, b1, b2 and the last d to K, T, L, O.
        let (K_a, K_b) = (K / (1.0 - a), 1.0 / (1.0 - a));
        let T_a = self.Ts / (a * a.ln().powi(2));
        let per_share = -T / (1.0 - share);
        let share_a = -b1 / (K * K) * K_a;
        let share_b1 = 1.0 / K - b1 / (K * K) * K_b;
        let share_b2 = -b1 / (K * K) * K_b;
        let L_a = T_a * (1.0 - share).ln() + per_share * share_a;
        let gain = self.su / self.sy;
        let (O_a, O_d) = (d / (1.0 - a).powi(2), 1.0 / (1.0 - a));
        let of_L = [L_a, per_share * share_b1, per_share * share_b2, 0.0];
        let map = [
            [K_a * gain, K_b * gain, K_b * gain, 0.0],
            [T_a, 0.0, 0.0, 0.0],
            if self.fraction { of_L } else { [0.0; 4] },
            [
                O_a / self.sy - gain * self.u0 * K_a,
                -gain * self.u0 * K_b,
                -gain * self.u0 * K_b,
                O_d / self.sy,
            ],
        ];
        let own = [0, 1, 2, n - OWN];
        let mut P = [0.0; 16];
        for (ij, p) in P.iter_mut().enumerate() {
            let (left, right) = (&map[ij / 4], &map[ij % 4]);
            for (i, l) in own.iter().zip(left) {
                for (j, r) in own.iter().zip(right) {
                    *p += s2 * l * r * inverse(*i, *j);
                }
            }
        }
        let model = Fopdt { K: K * gain, T, L: m as f64 * self.Ts + f };
        let offset = self.y0 - model.K * self.u0 + d / (1.0 - a) / self.sy;
        let mut own_P = [0.0; 16];
        for (ij, p) in own_P.iter_mut().enumerate() {
            *p = inverse(own[ij / 4], own[ij % 4]);
        }
        let predictor =
            Predictor::new([a, b1, b2, theta[3], d], own_P, s2, m, [self.u0, self.su, self.y0, self.sy]);
        let finite = P.iter().chain([&model.K, &T, &f, &offset]).all(|x| x.is_finite());
        finite.then_some(Plant { model, P, offset, predictor })
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

/// Probability that `L` rounds to `m` samples.
fn delay_share(modes: &[Mode], m: f64, Ts: f64) -> f64 {
    let below = |mode: &Mode, samples: f64| {
        let (away, sd) = (samples * Ts - mode.model.L, mode.P[10].sqrt());
        if sd > 0.0 { 0.5 * (1.0 + erf(away / sd / std::f64::consts::SQRT_2)) } else { f64::from(away > 0.0) }
    };
    modes.iter().map(|mode| mode.weight * (below(mode, m + 0.5) - below(mode, m - 0.5))).sum()
}
