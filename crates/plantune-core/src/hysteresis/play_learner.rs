//! Weights of a stack of plays, learnt sample by sample and never negative.
//!
//! ```text
//! R'R <- lambda R'R + phi' phi      phi = [z_0 ... z_(n-1), 1, y]       rotated into the triangle R
//! w    = argmin |R_w w - R_y|       w >= 0, the offset free
//! ```
//!
//! The triangle is that of least squares without a bound, and the bound enters the answer alone: projected recursive
//! least squares. (Weights cut at zero within the recursion feed back what was cut, and run away; cut in the answer
//! alone they leave twenty times the error.) From `P0` the answer is at every t the minimum of
//!
//! ```text
//! sum_k lambda^(t-k) (y(k) - O - w' z(k))^2 + lambda^t (|w|^2 + O^2) / P0      w >= 0
//! ```
//!
//! METHODS 4. Where it forgets, two things keep what is not excited (METHODS 1.3). A sample counts only if x has moved
//! since the last one that did, or rows at rest would wash out all others. And each sample holds one weight in turn
//! where it is, by a row that keeps the information `i_j = sum z_j^2` about it above a small share of the largest seen
//!
//! ```text
//! sqrt((1 - lambda) n hold max i_j) [e_j, w_j]
//! ```
//!
//! (regularised as by Gunnarsson, 35th IEEE Conf. Decision and Control, 1996). After sixty memories of
//! loops of 15 % of the range the large ones are still known to 0.04 % of the range, where 11 % are lost without.

use super::PlayStack;
use super::play_states::States;
use crate::error::{Error, Result};
use crate::linalg::{Triangle, nnls, solve};

/// Share of the range of x seen so far that is motion.
const MOTION: f64 = 1e-3;

/// Pivots below this share of the largest do not count.
const TOLERANCE: f64 = 1e-12;

/// Samples beyond this would overflow as squares.
const LARGEST: f64 = 1e150;

/// What is learnt, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayLearnerSettings {
    /// Half widths.
    pub r: Vec<f64>,
    /// Forgetting factor.
    pub lambda: f64,
    /// Whether O is learnt.
    pub offset: bool,
    /// Variance of the weights before the first sample, in units of that of the noise.
    pub P0: f64,
    /// How far x must have moved for a sample to count; by default 1e-3 of its range where `lambda < 1`, else 0.
    pub gate: Option<f64>,
    /// Share of the largest information about each weight that is not forgotten.
    pub hold: f64,
}

impl PlayLearnerSettings {
    fn check(&self) -> Result<()> {
        PlayStack::virgin(self.r.clone(), self.r.clone(), 0.0).check()?;
        if !(self.lambda > 0.0 && self.lambda <= 1.0) {
            return Err(Error::argument("lam", self.lambda, "in (0, 1]"));
        }
        if !(self.P0 > 0.0 && self.P0 <= 1e100) {
            return Err(Error::argument("P0", self.P0, "positive, and at most 1e100"));
        }
        if !(self.hold >= 0.0 && self.hold <= 1.0) {
            return Err(Error::argument("hold", self.hold, "in [0, 1]"));
        }
        match self.gate {
            Some(gate) if !(gate >= 0.0 && gate.is_finite()) => {
                Err(Error::argument("gate", gate, "0 or positive, in units of x"))
            }
            _ => Ok(()),
        }
    }
}

/// A learner on its way along a record.
#[derive(Clone, Debug)]
pub struct PlayLearner {
    settings: PlayLearnerSettings,
    states: States,
    triangle: Triangle, // z (n), 1, y
    row: Vec<f64>,      // (n + 2)
    columns: Vec<usize>,
    free: Vec<bool>,
    w: Vec<f64>, // (n + 1), the offset last
    inside: Vec<usize>,
    most: Vec<f64>,   // largest information about each
    seen: f64,        // samples
    counted: f64,     // those that counted
    memory: f64,      // sum of their weights
    extent: [f64; 2], // lowest and highest x
    last: f64,        // x of the last one that counted
}

impl PlayLearner {
    /// In the virgin state, nothing learnt.
    pub fn new(settings: PlayLearnerSettings) -> Result<Self> {
        settings.check()?;
        let n = settings.r.len();
        let columns: Vec<usize> = (0..n + usize::from(settings.offset)).collect();
        let mut triangle = Triangle::new(n + 2);
        for &j in &columns {
            let mut row = vec![0.0; n + 2];
            row[j] = settings.P0.sqrt().recip();
            triangle.learn(1.0, &mut row);
        }
        Ok(PlayLearner {
            states: States::new(settings.r.clone()),
            triangle,
            row: vec![0.0; n + 2],
            free: columns.iter().map(|j| *j == n).collect(),
            columns,
            w: vec![0.0; n + 1],
            inside: Vec::new(),
            most: vec![0.0; n + 1],
            seen: 0.0,
            counted: 0.0,
            memory: 0.0,
            extent: [f64::INFINITY, -f64::INFINITY],
            last: f64::NAN,
            settings,
        })
    }

    /// Learns one sample and returns the error of the weights before that.
    ///
    /// On error the state is unchanged.
    pub fn step(&mut self, x: f64, y: f64) -> Result<f64> {
        for (name, value) in [("x", x), ("y", y)] {
            if !(value.abs() < LARGEST) {
                return Err(Error::argument(name, value, "a finite number, below 1e150"));
            }
        }
        let n = self.states.r.len();
        self.row[..n].copy_from_slice(self.states.step(x));
        (self.row[n], self.row[n + 1]) = (1.0, y);
        let eps = y - self.w.iter().zip(&self.row).map(|(w, z)| w * z).sum::<f64>();
        self.seen += 1.0;
        self.extent = [self.extent[0].min(x), self.extent[1].max(x)];
        if self.counts(x) {
            self.last = x;
            self.counted += 1.0;
            self.memory = self.settings.lambda * self.memory + 1.0;
            self.triangle.learn(self.settings.lambda, &mut self.row);
            self.hold();
            self.answer();
        }
        Ok(eps)
    }

    /// `step` for each sample; returns every error. A sample that is refused leaves those before it learnt.
    pub fn run(&mut self, x: &[f64], y: &[f64]) -> Result<Vec<f64>> {
        if x.len() != y.len() {
            let text = format!("x has {} samples, y has {}", x.len(), y.len());
            return Err(Error::new("D09", text).remedy("give one y per x"));
        }
        x.iter().zip(y).map(|(x, y)| self.step(*x, *y)).collect()
    }

    /// Whether x has moved since the last sample that counted.
    fn counts(&self, x: f64) -> bool {
        let range = self.extent[1] - self.extent[0];
        let gate = match self.settings.gate {
            Some(gate) => gate,
            None if self.settings.lambda < 1.0 => MOTION * range,
            None => 0.0,
        };
        self.last.is_nan() || (x - self.last).abs() >= gate
    }

    /// One unknown in turn stays where it is, as far as a small share of what was known about it goes.
    fn hold(&mut self) {
        let PlayLearnerSettings { lambda, hold, .. } = self.settings;
        if lambda == 1.0 || hold == 0.0 {
            return;
        }
        let n = self.columns.len();
        let j = self.counted as usize % n;
        let information: f64 = (0..=j).map(|i| self.triangle.at(i, j).powi(2)).sum();
        self.most[j] = self.most[j].max(information);
        let weight = ((1.0 - lambda) * n as f64 * hold * self.most[j]).sqrt();
        self.row.fill(0.0);
        self.row[j] = weight;
        self.row[self.states.r.len() + 1] = weight * self.w[j];
        self.triangle.learn(1.0, &mut self.row);
    }

    /// The bounded minimum, sought from the last one.
    fn answer(&mut self) {
        let rhs = self.states.r.len() + 1;
        let found = nnls(&self.triangle, &self.columns, &self.free, rhs, &self.inside);
        self.w[..found.x.len()].copy_from_slice(&found.x);
        self.inside = found.inside;
    }

    /// What has been learnt, in the virgin state.
    pub fn model(&self) -> Result<PlayStack> {
        if self.extent[0] >= self.extent[1] {
            return Err(Error::new("X01", "the input has not moved: there is nothing to learn from")
                .remedy("give samples of a moving input"));
        }
        let n = self.states.r.len();
        Ok(PlayStack::virgin(self.states.r.clone(), self.w[..n].to_vec(), self.w[n]))
    }

    /// Weights (n).
    pub fn w(&self) -> &[f64] {
        &self.w[..self.states.r.len()]
    }

    /// Offset.
    pub fn offset(&self) -> f64 {
        self.w[self.states.r.len()]
    }

    /// Standard deviations of weights and offset: 0 of those at zero, infinite before the noise is known.
    pub fn sd(&self) -> Vec<f64> {
        let n = self.states.r.len();
        let mut sd = vec![0.0; n + 1];
        let k = self.inside.len();
        let known = self.memory - k as f64;
        match solve(&self.triangle, &self.inside, n + 1, TOLERANCE) {
            Ok(solution) if known > 0.0 => {
                let variance = solution.rss / known;
                for (p, &j) in self.inside.iter().enumerate() {
                    sd[j] = (variance * solution.inverse_gram[p * k + p]).sqrt();
                }
            }
            _ => self.inside.iter().for_each(|&j| sd[j] = f64::INFINITY),
        }
        sd
    }

    /// What is asked of it.
    pub fn settings(&self) -> &PlayLearnerSettings {
        &self.settings
    }

    /// Samples seen.
    pub fn seen(&self) -> usize {
        self.seen as usize
    }

    /// Every number of the state; the settings are not among them.
    pub fn state(&self) -> Vec<f64> {
        let mut all = vec![self.seen, self.counted, self.memory, self.extent[0], self.extent[1], self.last];
        all.extend(&self.states.z);
        all.extend(&self.w);
        all.extend(&self.most);
        all.push(self.inside.len() as f64);
        all.extend(self.inside.iter().map(|j| *j as f64));
        (0..self.triangle.n()).for_each(|i| all.extend(&self.triangle.row(i)[i..]));
        all
    }

    /// Goes on from where another with the same settings stood.
    pub fn resume(&mut self, state: &[f64]) -> Result<()> {
        let mut numbers = state.iter().copied();
        let other = self.read(&mut numbers).filter(|_| numbers.next().is_none());
        *self = other.ok_or_else(|| {
            Error::argument("state", format!("{} numbers", state.len()), "that of a learner of so many plays")
        })?;
        Ok(())
    }

    fn read(&self, numbers: &mut impl Iterator<Item = f64>) -> Option<PlayLearner> {
        let mut next = || numbers.next();
        let mut other = self.clone();
        let PlayLearner {
            seen,
            counted,
            memory,
            extent: [low, high],
            last,
            states,
            w,
            most,
            inside,
            columns,
            ..
        } = &mut other;
        let alone = [seen, counted, memory, low, high, last];
        for place in alone.into_iter().chain(&mut states.z).chain(w).chain(most) {
            *place = next()?;
        }
        inside.clear();
        for _ in 0..next()? as usize {
            inside.push(Some(next()? as usize).filter(|j| *j < columns.len())?);
        }
        let width = other.triangle.n();
        let mut rows = vec![0.0; width * width];
        for i in 0..width {
            for place in &mut rows[i * width + i..(i + 1) * width] {
                *place = next()?;
            }
        }
        other.triangle = Triangle::of_upper(width, rows);
        Some(other)
    }
}
