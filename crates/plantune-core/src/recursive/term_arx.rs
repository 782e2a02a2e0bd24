//! Recursive ARX with regressors of one's own, one sample at a time:
//! `A(q) y(t) = B(q) u(t - nk) + sum_m g_m x_m(t) + d + e(t)`.
//!
//! The regressor of [`Rls`], made of the last samples; the linear part is less the first sample, so that a level costs
//! no digits. Without `P0` nothing is assumed: the first rows are gathered until least squares has an answer, and with
//! `lambda = 1` it is at every later sample the batch estimate. A row is learnt where all its lags lie behind the last
//! restart and on outputs that were there.
//!
//! Source 000, (2.2-15) and chapter 4; source 001, (3.7-7) to (3.7-11).

use super::rls::Rls;
use crate::error::{Error, Result};
use crate::model::{Lagged, Term, TermModel};
use crate::record::Record;

/// An estimator on its way along a record.
#[derive(Clone, Debug)]
pub struct TermArx {
    na: usize,
    nb: usize,
    nk: usize,
    own: Vec<Term>,
    offset: bool,
    rls: Rls,
    u: Vec<f64>, // (history + 1) newest first; NaN before the segment
    y: Vec<f64>,
    zero: [f64; 2],   // u and y of the first sample; NaN before it
    phi: Vec<f64>,    // (n)
    first: Vec<f64>,  // rows [phi | y] gathered for a start
    gathering: usize, // how many are needed; 0 when started
    samples: f64,
}

impl TermArx {
    /// At its first sample; `gather` where the start is least squares of the first rows and not that of `rls`.
    pub fn new(
        [na, nb, nk]: [usize; 3],
        own: Vec<Term>,
        offset: bool,
        rls: Rls,
        gather: bool,
    ) -> Result<Self> {
        let n = na + nb + own.len() + usize::from(offset);
        if own.iter().flat_map(Term::signals).any(|s| matches!(s, Lagged::Input(i, _) if *i > 0)) {
            return Err(Error::argument("regressors", "of a second input", "made of u and y"));
        }
        if rls.n() != n {
            return Err(Error::argument("P0", format!("for {} parameters", rls.n()), &format!("for {n}")));
        }
        let longest = own.iter().flat_map(Term::signals).map(|s| s.lag()).max().unwrap_or(0);
        let history = longest.max(na).max(if nb > 0 { nk + nb - 1 } else { 0 });
        Ok(TermArx {
            na,
            nb,
            nk,
            own,
            offset,
            rls,
            u: vec![f64::NAN; history + 1],
            y: vec![f64::NAN; history + 1],
            zero: [f64::NAN; 2],
            phi: vec![0.0; n],
            first: Vec::new(),
            gathering: if gather { 2 * n } else { 0 },
            samples: 0.0,
        })
    }

    /// Learns from the output `y` read at `t`; `u` is the input applied from `t` on.
    ///
    /// Returns the prediction error; none while lags are missing or the start is gathered. On error (U01: not finite;
    /// N02: overflow) the state is unchanged.
    pub fn step(&mut self, u: f64, y: f64) -> Result<Option<f64>> {
        if !(u.is_finite() && y.is_finite()) {
            let came = format!("u = {u}, y = {y}");
            return Err(Error::argument(
                "u, y",
                came,
                "finite numbers; skip(u) is for an output that is missing",
            ));
        }
        let zero = if self.zero[1].is_nan() { [u, y] } else { self.zero };
        let before = (std::mem::replace(&mut self.zero, zero), self.u[0], self.y[0]);
        (self.u[0], self.y[0]) = (u, y);
        let learnt = if self.fill() { self.learn() } else { Ok(None) };
        match learnt {
            Ok(_) => self.pass(),
            Err(_) => (self.zero, self.u[0], self.y[0]) = before,
        }
        learnt
    }

    /// Goes on without an output: it is missing at `t`, or does not count.
    pub fn skip(&mut self, u: f64) -> Result<()> {
        if !u.is_finite() {
            return Err(Error::argument("u", u, "a finite number"));
        }
        (self.u[0], self.y[0]) = (u, f64::NAN);
        self.pass();
        Ok(())
    }

    /// Forgets all signals, as after a gap; parameters and covariance go on.
    pub fn restart(&mut self) {
        self.u.fill(f64::NAN);
        self.y.fill(f64::NAN);
    }

    /// Learns a record's only input and output: `step` and `skip` in a loop, each segment after a `restart`.
    pub fn run(&mut self, rec: &Record) -> Result<Vec<f64>> {
        if rec.nu != 1 || rec.ny != 1 {
            let came = format!("a record with {} inputs and {} outputs", rec.nu, rec.ny);
            return Err(Error::argument("rec", came, "one with one input and one output"));
        }
        let mut eps = Vec::with_capacity(rec.N());
        for s in rec.segments() {
            self.restart();
            for k in s {
                eps.push(if rec.is_valid(k, 0) {
                    self.step(rec.u[k], rec.y[k])?.unwrap_or(f64::NAN)
                } else {
                    self.skip(rec.u[k])?;
                    f64::NAN
                });
            }
        }
        Ok(eps)
    }

    /// Makes `phi(t)`; whether every lag is there.
    fn fill(&mut self) -> bool {
        let TermArx { na, nb, nk, own, u, y, zero, phi, .. } = self;
        let at = |s: Lagged| match s {
            Lagged::Input(_, lag) => u[lag],
            Lagged::Output(lag) => y[lag],
        };
        if !own.iter().flat_map(Term::signals).all(|s| at(*s).is_finite()) {
            return false;
        }
        let level = if self.offset { *zero } else { [0.0; 2] };
        let outputs = (1..=*na).map(|j| level[1] - y[j]);
        let inputs = (0..*nb).map(|j| u[*nk + j] - level[0]);
        let rows = outputs.chain(inputs).chain(own.iter().map(|x| x.value(&at))).chain([1.0]);
        phi.iter_mut().zip(rows).for_each(|(phi, x)| *phi = x);
        phi.iter().all(|x| x.is_finite())
    }

    fn learn(&mut self) -> Result<Option<f64>> {
        let y = self.y[0] - if self.offset { self.zero[1] } else { 0.0 };
        if self.gathering == 0 {
            return self.rls.update(&self.phi, y).map(Some);
        }
        self.first.extend_from_slice(&self.phi);
        self.first.push(y);
        let width = self.phi.len() + 1;
        if self.first.len() / width == self.gathering {
            let phi: Vec<f64> = self.first.chunks(width).flat_map(|row| row[..width - 1].to_vec()).collect();
            let y: Vec<f64> = self.first.chunks(width).map(|row| row[width - 1]).collect();
            match self.rls.begin(&phi, &y, y.len()) {
                Ok(_) => (self.gathering, self.first) = (0, Vec::new()),
                Err(refusal) if refusal.code() == "X02" => self.gathering *= 2,
                Err(other) => return Err(other),
            }
        }
        Ok(None)
    }

    /// Moves on to the next sample.
    fn pass(&mut self) {
        let last = self.u.len() - 1;
        self.u.copy_within(..last, 1.min(last));
        self.y.copy_within(..last, 1.min(last));
        self.samples += 1.0;
    }

    /// Whether the parameters are more than their start.
    pub fn begun(&self) -> bool {
        self.gathering == 0
    }

    /// `a1 … b1 …`, then the regressors as they were written.
    pub fn names(&self) -> Vec<String> {
        let a = (1..=self.na).map(|j| format!("a{j}"));
        let b = (1..=self.nb).map(|j| format!("b{j}"));
        a.chain(b).chain(self.own.iter().map(|x| x.text().to_owned())).collect()
    }

    /// Coefficients in the order of their names.
    pub fn theta(&self) -> &[f64] {
        &self.rls.theta()[..self.na + self.nb + self.own.len()]
    }

    /// Their standard deviations, infinite before anything is known.
    pub fn sd(&self) -> Vec<f64> {
        let sd = self.rls.sd();
        let known = |sd: &f64| if self.begun() { *sd } else { f64::INFINITY };
        sd[..self.theta().len()].iter().map(known).collect()
    }

    /// The constant `d` of the equation of raw signals.
    pub fn d(&self) -> f64 {
        if !self.offset || self.zero[1].is_nan() {
            return 0.0;
        }
        let (theta, [u0, y0]) = (self.rls.theta(), self.zero);
        let (a, b) = theta[..self.na + self.nb].split_at(self.na);
        theta[theta.len() - 1] + y0 * (1.0 + a.iter().sum::<f64>()) - u0 * b.iter().sum::<f64>()
    }

    /// The model at this moment.
    pub fn model(&self) -> TermModel {
        let (a, rest) = self.theta().split_at(self.na);
        let (b, g) = rest.split_at(self.nb);
        TermModel {
            A: [&[1.0], a].concat(),
            B: vec![b.to_vec()],
            nk: vec![if self.nb == 0 { 1 } else { self.nk }],
            own: self.own.iter().cloned().map(crate::model::Own::Term).collect(),
            g: g.to_vec(),
            d: self.d(),
        }
    }

    /// The regression inside.
    pub fn rls(&self) -> &Rls {
        &self.rls
    }

    /// Samples taken in so far, learnt or not.
    pub fn samples(&self) -> usize {
        self.samples as usize
    }

    /// Every number of the state; the settings are not among them.
    pub fn state(&self) -> Vec<f64> {
        let counts = [self.samples, self.gathering as f64, self.first.len() as f64];
        [&counts[..], &self.zero, &self.u, &self.y, &self.first, &self.rls.state()].concat()
    }

    /// Goes on from where another with the same settings stood.
    pub fn resume(&mut self, state: &[f64]) -> Result<()> {
        let wrong = || Error::argument("state", format!("{} numbers", state.len()), "that of this estimator");
        let history = self.u.len();
        let gathered = *state.get(2).ok_or_else(wrong)? as usize;
        let after = 5 + 2 * history + gathered;
        if state.len() < after {
            return Err(wrong());
        }
        self.rls.resume(&state[after..])?;
        (self.samples, self.gathering) = (state[0], state[1] as usize);
        self.zero = [state[3], state[4]];
        self.u.copy_from_slice(&state[5..5 + history]);
        self.y.copy_from_slice(&state[5 + history..5 + 2 * history]);
        self.first = state[5 + 2 * history..after].to_vec();
        Ok(())
    }
}
