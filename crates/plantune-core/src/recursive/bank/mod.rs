//! A bank of delays: for each of many loops and each candidate delay a first-order ARMAX with offset.
//!
//! ```text
//! y(t) = a y(t-1) + b u(t-nk) + d + e(t) + c e(t-1)            nk = low … high,  a = -a_1
//! lambda(t) = lambda - (lambda - lambda0) rho^t                  t counts what was learnt
//! |c| <= c_most
//! ```
//!
//! on signals counted from the loop's first sample, `(u - u(0)) u_factor` and `(y - y(0)) y_factor`. Recursive
//! maximum likelihood (the gradient is `phi` divided by `C(q)`) or extended least squares (it is `phi`).
//! Ljung and Söderström, Theory and Practice of Recursive Identification, 1983; source 001, 3.7.4d. The
//! recursion, and why `P` is kept as `U D U'`, stand in `kernel`.
//!
//! Eight estimators fill a register. In a bank of many loops they are those of eight loops at the same delay,
//! which share their inputs; in a bank of few loops they are neighbours in the list of all, each with its own
//! delay. Both do the same arithmetic: a loop alone and the same loop among many have the same bits.

mod column;
mod kernel;
mod sweep;

use crate::error::{Error, Result};
use column::{Column, Inputs, Window};
use kernel::{Errors, Lanes, NUMBERS, Row, W};

/// From so many loops on, a register holds eight loops at one delay.
const MANY: usize = 5;

/// What a bank is made with.
#[derive(Clone, Debug, PartialEq)]
pub struct BankSettings {
    /// Forgetting factor at the start, in (0, 1].
    pub lambda0: f64,
    /// Forgetting factor in the end, in (0, 1].
    pub lambda: f64,
    /// Pace from the one to the other, in [0, 1].
    pub rho: f64,
    /// Start variances of a, b, d, c in units of the noise variance.
    pub P0: [f64; 4],
    /// The most that forgetting may make of an entry of `D`, in units of the largest `P0`.
    pub swell: f64,
    /// Largest `|c|`, in (0, 1).
    pub c_most: f64,
    /// Whether the gradient is filtered by `1 / C(q)`: RML, else ELS.
    pub rml: bool,
    /// Whether `eps`, `q` and `s2` are kept: 15 % more memory to move.
    pub errors: bool,
    /// Largest error learnt, in standard deviations; needs `errors`. Nothing is clipped in the first 50 samples,
    /// nor where `q >= 1`: there an error speaks of the parameters, not of the noise.
    pub clip: Option<f64>,
    /// Samples over which `s2` is a mean, more than 50.
    pub memory: f64,
}

impl Default for BankSettings {
    fn default() -> Self {
        BankSettings {
            lambda0: 0.95,
            lambda: 0.995,
            rho: 0.99,
            P0: [1e6; 4],
            swell: 1e3,
            c_most: 0.97,
            rml: true,
            errors: false,
            clip: None,
            memory: 200.0,
        }
    }
}

impl BankSettings {
    fn check(&self) -> Result<()> {
        for (name, lambda) in [("lam0", self.lambda0), ("lam", self.lambda)] {
            if !(lambda > 0.0 && lambda <= 1.0) {
                return Err(Error::argument(name, lambda, "in (0, 1]"));
            }
        }
        if !(self.rho >= 0.0 && self.rho <= 1.0) {
            return Err(Error::argument("rho", self.rho, "in [0, 1]"));
        }
        if let Some(wrong) = self.P0.iter().find(|&&P0| !(P0 > 0.0 && P0 <= 1e20)) {
            return Err(Error::argument("P0", wrong, "positive, and at most 1e20"));
        }
        if !(self.swell >= 1.0 && self.swell <= 1e15) {
            return Err(Error::argument("swell", self.swell, "in [1, 1e15]"));
        }
        if !(self.c_most > 0.0 && self.c_most < 1.0) {
            return Err(Error::argument("c_most", self.c_most, "in (0, 1)"));
        }
        if self.clip.is_some_and(|clip| !(clip > 0.0 && clip.is_finite() && self.errors)) {
            return Err(Error::argument("clip", self.clip.unwrap_or_default(), "positive, with errors kept"));
        }
        if !(self.memory > 50.0 && self.memory.is_finite()) {
            return Err(Error::argument("memory", self.memory, "more than 50 samples"));
        }
        Ok(())
    }

    fn D_most(&self) -> f64 {
        self.P0.iter().fold(0.0, |most, &P0| f64::max(most, P0)) * self.swell
    }
}

/// Estimators of `loops` loops at every delay from `low` to `high`, on their way along their records.
#[derive(Clone, Debug, PartialEq)]
pub struct Bank {
    settings: BankSettings,
    loops: usize,
    low: usize,
    high: usize,
    copies: usize,          // columns of a loop: 1, or one for each candidate
    per: usize,             // eights of estimators that share their inputs: candidates, or 1
    lanes: Vec<Lanes>,      // (groups, per)
    errors: Vec<Errors>,    // (groups, per), or none
    inputs: Vec<Inputs>,    // (groups)
    attention: Vec<bool>,   // (groups): whether a column is not to be treated as all others are
    windows: Vec<Window>,   // (groups), or none
    factors: Vec<[Row; 2]>, // (groups): of u and y, or none
    ring: Vec<Row>,         // (groups, high + 1): u of the last samples
    columns: Vec<Column>,   // (groups * 8)
    head: usize,            // row of the ring for the sample to come
    backwards: bool,
    broken: bool,
}

impl Bank {
    /// `loops` loops, at least 1, and candidate delays from `low`, at least 1, to `high`.
    pub fn new(loops: usize, low: usize, high: usize, settings: &BankSettings) -> Result<Self> {
        settings.check()?;
        if loops == 0 {
            return Err(Error::argument("loops", loops, "at least 1"));
        }
        if !(1 <= low && low <= high) {
            return Err(Error::argument(
                "nk",
                format!("{low} to {high}"),
                "a range that starts at 1 or later",
            ));
        }
        let candidates = high - low + 1;
        let (copies, per) = if loops < MANY { (candidates, 1) } else { (1, candidates) };
        let groups = (loops * copies).div_ceil(W);
        let column = |c: usize| Column {
            source: (c < loops * copies).then_some(c / copies),
            lag: if copies > 1 {
                low + c % copies
            } else if per > 1 {
                0
            } else {
                low
            },
            ..Column::default()
        };
        let zero = Row::of(0.0);
        let kept = |n: usize| if settings.errors { n } else { 0 };
        Ok(Bank {
            loops,
            low,
            high,
            copies,
            per,
            lanes: vec![Lanes::new(&settings.P0); groups * per],
            errors: vec![Errors { eps: zero, q: zero, s2: zero }; kept(groups * per)],
            inputs: vec![Inputs::new(settings.lambda0); groups],
            attention: vec![true; groups],
            windows: vec![Window::default(); kept(groups)],
            factors: Vec::new(),
            ring: vec![zero; groups * (high + 1)],
            columns: (0..groups * W).map(column).collect(),
            head: 0,
            backwards: false,
            broken: false,
            settings: settings.clone(),
        })
    }

    /// Counts the signals of this loop in units of `1 / u_factor` and `1 / y_factor`, and starts it anew.
    /// What the bank tells stays in units of the signals.
    pub fn scale(&mut self, index: usize, u_factor: f64, y_factor: f64) -> Result<()> {
        for (name, factor) in [("u_factor", u_factor), ("y_factor", y_factor)] {
            if !(factor.is_finite() && factor > 0.0) {
                return Err(Error::argument(name, factor, "finite and positive"));
            }
        }
        self.reset(index)?;
        self.factors.resize(self.inputs.len(), [Row::of(1.0); 2]);
        for c in self.columns_of(index) {
            self.factors[c / W][0][c % W] = u_factor;
            self.factors[c / W][1][c % W] = y_factor;
        }
        Ok(())
    }

    /// One sample of every loop: `u[k]` acts from now on, `y[k]` is read now, so that `y(t)` is explained by
    /// `u` up to `t - nk`.
    ///
    /// Allocates nothing. A number that is not finite pauses its own loop for as long as it would be
    /// remembered; a loop whose numbers overflow starts anew.
    pub fn step(&mut self, u: &[f64], y: &[f64]) -> Result<()> {
        for (name, x) in [("u", u), ("y", y)] {
            if x.len() != self.loops {
                let needed = format!("{} numbers, one of each loop", self.loops);
                return Err(Error::argument(name, format!("{} numbers", x.len()), &needed));
            }
        }
        sweep::run(self, u, y);
        Ok(())
    }

    /// `step` for each row of `u` and `y`, `(N, loops)` row-major: the same bits, in less time.
    pub fn run(&mut self, u: &[f64], y: &[f64]) -> Result<()> {
        if u.len() != y.len() || !u.len().is_multiple_of(self.loops) {
            let came = format!("{} and {} numbers", u.len(), y.len());
            return Err(Error::argument("u and y", came, &format!("{} a sample, each", self.loops)));
        }
        sweep::run(self, u, y);
        Ok(())
    }

    /// `run` that returns `eps` and `q` of every sample, each `(N, loops, candidates)`.
    pub fn errors(&mut self, u: &[f64], y: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
        if !self.settings.errors {
            return Err(Error::argument("errors", "not kept", "kept from the start, to be returned"));
        }
        if u.len() != y.len() {
            return Err(Error::argument("u", format!("{} numbers", u.len()), &format!("{}, as y", y.len())));
        }
        let size = u.len() * self.candidates();
        let (mut eps, mut q) = (Vec::with_capacity(size), Vec::with_capacity(size));
        for (u, y) in u.chunks(self.loops).zip(y.chunks(self.loops)) {
            self.step(u, y)?;
            for (k, c) in (0..self.loops).flat_map(|k| (0..self.candidates()).map(move |c| (k, c))) {
                eps.push(self.eps(k, c));
                q.push(self.q(k, c));
            }
        }
        Ok((eps, q))
    }

    /// Number of loops.
    pub fn loops(&self) -> usize {
        self.loops
    }

    /// Candidate delays, least and greatest.
    pub fn delays(&self) -> (usize, usize) {
        (self.low, self.high)
    }

    /// Number of candidate delays.
    pub fn candidates(&self) -> usize {
        self.high - self.low + 1
    }

    /// What it was made with.
    pub fn settings(&self) -> &BankSettings {
        &self.settings
    }

    /// Parameters a, b, d, c on signals counted from the loop's first sample, in their units.
    pub fn theta(&self, index: usize, candidate: usize) -> [f64; 4] {
        let (eight, slot) = self.place(index, candidate);
        let (units, _) = self.units(index);
        std::array::from_fn(|i| self.lanes[eight].theta[i][slot] * units[i])
    }

    /// Covariance of the parameters in units of the noise variance.
    pub fn P(&self, index: usize, candidate: usize) -> [[f64; 4]; 4] {
        let (eight, slot) = self.place(index, candidate);
        let (units, y_factor) = self.units(index);
        let mut P = self.lanes[eight].P(slot);
        for (i, row) in P.iter_mut().enumerate() {
            for (j, P) in row.iter_mut().enumerate() {
                *P *= units[i] * units[j] * y_factor * y_factor;
            }
        }
        P
    }

    /// Error before the update, `eps = y - phi' theta`, of the last sample; 0 unless errors are kept.
    pub fn eps(&self, index: usize, candidate: usize) -> f64 {
        let (_, y_factor) = self.units(index);
        self.kept(index, candidate, |errors| &errors.eps) / y_factor
    }

    /// `q = psi' P psi` of the last sample: `eps` has the variance `s2 (1 + q)`; 0 unless errors are kept.
    pub fn q(&self, index: usize, candidate: usize) -> f64 {
        self.kept(index, candidate, |errors| &errors.q)
    }

    /// Robust variance of the noise: the mean of `eps^2 / (1 + q)`, each at most 9 times the mean so far once
    /// 50 were learnt; 0 unless errors are kept.
    pub fn s2(&self, index: usize, candidate: usize) -> f64 {
        let (_, y_factor) = self.units(index);
        self.kept(index, candidate, |errors| &errors.s2) / (y_factor * y_factor)
    }

    /// Standard deviations of a, b, d, c; 0 unless errors are kept.
    ///
    /// With forgetting, `P` is the inverse of the sum of `lambda^k psi psi'`, and the covariance is about `s2 P`
    /// times the sum of `lambda^2k` over that of `lambda^k`.
    pub fn sd(&self, index: usize, candidate: usize) -> [f64; 4] {
        let (P, s2) = (self.P(index, candidate), self.s2(index, candidate));
        let c = self.columns_of(index).start;
        let share = self.windows.get(c / W).map_or(0.0, |w| w.share(c % W));
        std::array::from_fn(|i| (s2 * share * P[i][i]).sqrt())
    }

    /// What the signals of this loop are counted from, u and y; `None` before its first sample.
    pub fn origin(&self, index: usize) -> Option<(f64, f64)> {
        let c = self.columns_of(index).start;
        let inputs = &self.inputs[c / W];
        self.columns[c].started.then(|| (inputs.u_zero[c % W], inputs.y_zero[c % W]))
    }

    /// Whether the last sample was learnt: the gate open, and no unknown in `phi`.
    pub fn learnt(&self, index: usize) -> bool {
        self.columns[self.columns_of(index).start].learnt()
    }

    /// How often this loop started anew because its numbers overflowed.
    pub fn restarts(&self, index: usize) -> u32 {
        self.columns[self.columns_of(index).start].restarts
    }

    /// Opens or closes the gate: a closed one leaves theta and P as they are, while the signals move on.
    pub fn gate(&mut self, index: usize, open: bool) -> Result<()> {
        self.exists(index)?;
        for c in self.columns_of(index) {
            self.columns[c].gated = !open;
            self.attention[c / W] = true;
        }
        Ok(())
    }

    /// After an alarm: adds this to the variance of the offset, in units of the noise variance, at every
    /// candidate; what is known of a, b and c stays known.
    pub fn open_offset(&mut self, index: usize, variance: f64) -> Result<()> {
        self.exists(index)?;
        if !(variance > 0.0 && variance <= 1e20) {
            return Err(Error::argument("variance", variance, "positive, and at most 1e20"));
        }
        for candidate in 0..self.candidates() {
            let (eight, slot) = self.place(index, candidate);
            self.lanes[eight].add_variance(slot, 2, variance);
        }
        Ok(())
    }

    /// Forgets all of this loop, but not whether its gate is open: its next sample is its first.
    pub fn reset(&mut self, index: usize) -> Result<()> {
        self.exists(index)?;
        self.columns_of(index).for_each(|c| self.clear(c));
        Ok(())
    }

    /// Everything that it has learnt, for `resume`.
    pub fn state(&self) -> Vec<f64> {
        let mut state = vec![self.head as f64, f64::from(u8::from(self.backwards))];
        state.extend(self.lanes.iter().flat_map(Lanes::rows).flat_map(|row| row.0));
        state.extend(self.errors.iter().flat_map(|e| [&e.eps, &e.q, &e.s2]).flat_map(|row| row.0));
        state.extend(self.inputs.iter().flat_map(Inputs::rows).flat_map(|row| row.0));
        state.extend(self.windows.iter().flat_map(Window::rows).flat_map(|row| row.0));
        state.extend(self.ring.iter().flat_map(|row| row.0));
        state.extend(self.columns.iter().flat_map(Column::numbers));
        state.extend(self.factors.iter().flatten().flat_map(|row| row.0));
        state
    }

    /// Goes on from where another of the same size and settings stood.
    pub fn resume(&mut self, state: &[f64]) -> Result<()> {
        let rows = self.lanes.len() * NUMBERS
            + self.errors.len() * 3
            + self.inputs.len() * Inputs::ROWS
            + self.windows.len() * Window::ROWS
            + self.ring.len();
        let without = 2 + rows * W + self.columns.len() * Column::NUMBERS;
        let with = without + 2 * W * self.inputs.len();
        if state.len() != without && state.len() != with {
            let needed = format!("{without} or {with} numbers");
            return Err(Error::argument("state", format!("{} numbers", state.len()), &needed));
        }
        self.factors = vec![[Row::of(1.0); 2]; if state.len() == with { self.inputs.len() } else { 0 }];
        let mut state = state.iter().copied();
        let mut next = || state.next().unwrap_or_default();
        self.head = next() as usize % (self.high + 1);
        self.backwards = next() != 0.0;
        let mut fill = |row: &mut Row| row.iter_mut().for_each(|x| *x = next());
        self.lanes.iter_mut().flat_map(Lanes::rows_mut).for_each(&mut fill);
        self.errors.iter_mut().flat_map(|e| [&mut e.eps, &mut e.q, &mut e.s2]).for_each(&mut fill);
        self.inputs.iter_mut().flat_map(Inputs::rows_mut).for_each(&mut fill);
        self.windows.iter_mut().flat_map(Window::rows_mut).for_each(&mut fill);
        self.ring.iter_mut().for_each(&mut fill);
        for column in &mut self.columns {
            column.set_numbers(std::array::from_fn(|_| next()));
        }
        let mut fill = |row: &mut Row| row.iter_mut().for_each(|x| *x = next());
        self.factors.iter_mut().flatten().for_each(&mut fill);
        self.attention.fill(true);
        Ok(())
    }

    fn exists(&self, index: usize) -> Result<()> {
        if index < self.loops {
            return Ok(());
        }
        Err(Error::argument("index", index, &format!("less than {}, the number of loops", self.loops)))
    }

    /// The eight that holds an estimator, and its place there.
    fn place(&self, index: usize, candidate: usize) -> (usize, usize) {
        let c = self.columns_of(index).start;
        if self.copies > 1 {
            ((c + candidate) / W, (c + candidate) % W)
        } else {
            (c / W * self.per + candidate, c % W)
        }
    }

    /// Forgets all of a column.
    fn clear(&mut self, c: usize) {
        let (group, slot) = (c / W, c % W);
        let fresh = Lanes::new(&self.settings.P0);
        for lanes in &mut self.lanes[group * self.per..(group + 1) * self.per] {
            lanes.rows_mut().zip(fresh.rows()).for_each(|(row, fresh)| row[slot] = fresh[slot]);
        }
        for errors in self.errors.iter_mut().skip(group * self.per).take(self.per) {
            (errors.eps[slot], errors.q[slot], errors.s2[slot]) = (0.0, 0.0, 0.0);
        }
        if let Some(window) = self.windows.get_mut(group) {
            window.clear(slot);
        }
        self.inputs[group].clear(slot, self.settings.lambda0);
        self.attention[group] = true;
        self.columns[c].started = false;
    }

    fn columns_of(&self, index: usize) -> std::ops::Range<usize> {
        index * self.copies..(index + 1) * self.copies
    }

    /// What makes a, b, d, c of the scaled signals those of the signals; and the factor of y.
    fn units(&self, index: usize) -> ([f64; 4], f64) {
        let c = self.columns_of(index).start;
        match self.factors.get(c / W) {
            None => ([1.0; 4], 1.0),
            Some([u, y]) => ([1.0, u[c % W] / y[c % W], 1.0 / y[c % W], 1.0], y[c % W]),
        }
    }

    fn kept(&self, index: usize, candidate: usize, row: impl Fn(&Errors) -> &Row) -> f64 {
        let (eight, slot) = self.place(index, candidate);
        self.errors.get(eight).map_or(0.0, |errors| row(errors)[slot])
    }
}

#[cfg(test)]
mod tests;
