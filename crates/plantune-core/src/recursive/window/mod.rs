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
mod plant;
mod predictor;
mod scaled;

use std::ops::{Range, RangeInclusive};

use self::cell::{Found, SHARED};
pub use self::predictor::Predictor;
use self::scaled::Scaled;
use crate::error::{Error, Result};
use crate::model::Fopdt;

/// Likelihood against that of the best, below which a delay is out of the question for now.
const HOPELESS: f64 = 1e-9;

/// Where the search begins in the dark: `a, b1, b2, c`.
const UNKNOWN: [f64; SHARED] = [0.5, 0.0, 0.0, 0.0];

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
    warm: Vec<[f64; SHARED]>,
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
        let (warm, hopeless) = (vec![UNKNOWN; count], vec![false; count]);
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

    /// Rows since the level began, or the signals.
    pub fn level_len(&self) -> usize {
        self.y.len() - self.starts.last().map_or(0, |start| start.row)
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
        let cells = self.cells.clone().zip(&self.warm).enumerate();
        let search = |(i, (m, warm)): (usize, (usize, &[f64; SHARED]))| {
            is_due(i).then(|| scaled.search(m, *warm)).flatten()
        };
        let found: Vec<Option<Found>> = cells.map(search).collect();
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
        scaled.estimate(&found, &weights, best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    const TS: f64 = 0.02;
    const O: f64 = 583.451;

    fn plant(L: f64) -> Fopdt {
        Fopdt { K: -5.939, T: 0.1491, L }
    }

    /// An input that steps, and the plant's answer from rest.
    fn record(L: f64, rows: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let levels = white(rows, seed);
        let u: Vec<f64> = (0..rows).map(|k| 30.0 + if k < 20 { 0.0 } else { levels[k / 11] }).collect();
        let moved: Vec<f64> = u.iter().map(|u| u - 30.0).collect();
        let level = plant(L).K * 30.0 + O;
        (u, plant(L).simulate(&moved, TS, 0.0).iter().map(|y| y + level).collect())
    }

    fn window(u: &[f64], y: &[f64], fraction: bool) -> Window {
        let mut window = Window::new(TS, 1..=9, fraction, 400).expect("sound");
        u.iter().zip(y).for_each(|(&u, &y)| window.push(u, y, true));
        window
    }

    fn close(estimate: &Estimate, truth: &Fopdt, share: f64) {
        let Fopdt { K, T, L } = estimate.model;
        let far = [K / truth.K - 1.0, T / truth.T - 1.0, (L - truth.L) / truth.T, estimate.offset / O - 1.0];
        assert!(far.iter().all(|x| x.abs() < share), "{truth:?}: {:?} {}", estimate.model, estimate.offset);
    }

    #[test]
    fn without_noise_any_delay_is_exact() {
        for L in [0.0, 0.013, 0.1, 0.107, 0.1399] {
            let (u, y) = record(L, 120, 3);
            let estimate = window(&u, &y, true).fit().expect("a plant");
            close(&estimate, &plant(L), 1e-7);
            assert!((estimate.delays[(L / TS).round() as usize] - 1.0).abs() < 1e-9);
        }
    }

    /// In any units, and after more rows than the window holds.
    #[test]
    fn units_and_old_rows_do_not_matter() {
        let (u, y) = record(0.107, 900, 4);
        let scaled = |x: &[f64], by: f64| x.iter().map(|x| x * by).collect::<Vec<f64>>();
        let here = window(&u, &y, true).fit().expect("a plant").model;
        let there = window(&scaled(&u, 1e6), &scaled(&y, 1e-6), true).fit().expect("a plant").model;
        assert!((there.K / here.K / 1e-12 - 1.0).abs() < 1e-9 && (there.T / here.T - 1.0).abs() < 1e-9);
        let other: Vec<f64> = (0..500).map(|k| f64::from(k % 7)).chain(u[500..].iter().copied()).collect();
        close(&window(&other, &y, true).fit().expect("a plant"), &plant(0.107), 1e-6);
    }

    #[test]
    fn a_level_that_jumped_costs_the_plant_nothing() {
        let (u, mut y) = record(0.1, 200, 5);
        y[120..].iter_mut().for_each(|y| *y += 60.0);
        let mut knowing = window(&u, &y, true);
        assert!((knowing.fit().expect("a plant").model.K / plant(0.1).K - 1.0).abs() > 0.05);
        knowing.new_level(80);
        let found = knowing.fit().expect("a plant");
        assert!((found.model.K / plant(0.1).K - 1.0).abs() < 1e-6, "{:?}", found.model);
        assert!((found.offset - O - 60.0).abs() < 1e-4, "{}", found.offset);
    }

    /// After a gap neither state nor inputs are known.
    #[test]
    fn a_gap_costs_its_history() {
        let (u, y) = record(0.1, 120, 6);
        let (other_u, other_y) = record(0.1, 120, 7);
        let mut both = window(&u, &y, true);
        both.gap();
        other_u.iter().zip(&other_y).skip(40).for_each(|(&u, &y)| both.push(u, y, true));
        close(&both.fit().expect("a plant"), &plant(0.1), 1e-6);
    }

    /// White noise on y and on the equation, with and without a fraction: 95 % intervals.
    #[test]
    fn intervals_hold_in_their_share() {
        for (L, fraction, of_equation) in
            [(0.1, false, false), (0.107, true, false), (0.107, true, true), (0.1, false, true)]
        {
            let mut held = [0; 3];
            for seed in 0..200 {
                let (u, mut y) = record(L, 300, 1000 + seed);
                let (mut state, a) = (0.0, (-TS / plant(L).T).exp());
                for (y, e) in y.iter_mut().zip(white(300, seed)) {
                    state = if of_equation { a * state + 0.1 * e } else { 0.3 * e };
                    *y += state;
                }
                let estimate = window(&u, &y, fraction).fit().expect("a plant");
                let (sd, Fopdt { K, T, L: delay }) = (estimate.sd(), estimate.model);
                let far = [K - plant(L).K, T - plant(L).T, delay - L];
                (0..3).for_each(|i| held[i] += usize::from(far[i].abs() <= 1.96 * sd[i] + 1e-9));
            }
            assert!(
                held.iter().all(|held| (180..=200).contains(held)),
                "{L} {fraction} {of_equation}: {held:?}"
            );
        }
    }

    #[test]
    fn an_input_at_rest_tells_no_plant() {
        let y: Vec<f64> = white(200, 9);
        assert!(window(&[1.0; 200], &y, true).fit().is_none());
        assert_eq!(Window::new(TS, 0..=3, true, 100).expect_err("nk = 0").code(), "U01");
    }
}
