//! First order plus dead time by variable projection: `y = K xi(T, L) + O + x0 a^(t-t0)`.
//!
//! For given `T, L` the output of the unit-gain plant is simulated exactly ([`crate::model::Fopdt`])
//! and gain, offset and the initial state of each segment follow by linear least squares. What is left
//! is a problem in `ln T` and `L` for Levenberg-Marquardt with Kaufman's projected Jacobian. The cost
//! has a kink in `L` at every whole sample and several minima, so each delay sample is searched as a cell
//! of its own, from the best places of a correlation map. No regressor is held: each evaluation streams
//! its rows through a QR.
//!
//! The input before a segment is unknown, so residuals start where the delayed input lies in the segment.
//! A step test that begins at rest is the exception: there the plant starts in equilibrium with the input
//! held before, and no row is given away, for the rest is all that fixes the offset.
//!
//! Golub and Pereyra 1973; Kaufman 1975; source 001, 3.5.6.
mod problem;
mod search;
mod starts;

use self::problem::{MOST_MOVES, Point, Problem, Stretch};
use super::fit::{Fit, Status};
use super::orders::too_short;
use super::sampling::sampling;
use crate::error::{Error, Result};
use crate::excitation::{LEAST_EXCITATION, check_input_motion, excitation_order, too_poor};
use crate::limits::Limits;
use crate::linalg::{Solution, Triangle, congruence, dot, residual_norm2, solve};
use crate::model::Fopdt;
use crate::note::{Note, Place};
use crate::record::Record;
use crate::relation::{beyond, chance, follows_later};
use crate::stats::f_tail;

/// Pivots below this share mean that the data do not tell parameters apart.
const RANK_TOLERANCE: f64 = 1e-13;

/// p-value below which errors clearly follow the input.
const FOLLOWS: f64 = 1e-4;

/// What may be set.
#[derive(Clone, Debug)]
pub struct ProcessOptions {
    /// Whether an offset is estimated.
    pub offset: bool,
    /// Range of delays to search, s; a quarter of the longest segment, at most 200 samples, when absent.
    pub L: Option<(f64, f64)>,
}

/// Fits `K e^(-L s) / (T s + 1)` to a record with one input and one output.
pub fn p1d(rec: &Record, options: &ProcessOptions, limits: &Limits) -> Result<Fit> {
    check(rec, options, limits)?;
    check_input_motion(rec, limits)?;
    let mut problem = Problem::new(rec, options, limits)?;
    let supported = excitation_order(rec, 0, LEAST_EXCITATION, limits.X02);
    if supported < LEAST_EXCITATION {
        return Err(too_poor(rec, 0, supported, LEAST_EXCITATION, limits));
    }
    let mut best = problem.minimum().ok_or_else(|| no_relation(rec, 1.0, limits))?;
    if problem.contradicts_rest(&best) {
        problem = problem.without_rest();
        best = problem.minimum().ok_or_else(|| no_relation(rec, 1.0, limits))?;
    }
    problem.fit(&best)
}

fn check(rec: &Record, options: &ProcessOptions, limits: &Limits) -> Result<()> {
    if rec.nu != 1 || rec.ny != 1 {
        return Err(Error::argument(
            "rec",
            format!("a record with {} inputs and {} outputs", rec.nu, rec.ny),
            "one with a single input and a single output",
        ));
    }
    if let Some((low, high)) = options.L {
        if !(low >= 0.0 && high >= low && high.is_finite()) {
            return Err(Error::argument(
                "L",
                format!("({low}, {high})"),
                "an ascending pair of seconds, at least 0",
            ));
        }
        let longest = limits.X05 * rec.N() as f64 * rec.Ts;
        if high >= longest {
            return Err(Error::new(
                "X05",
                format!("delays up to {high} s are asked of a record of {} s", rec.N() as f64 * rec.Ts),
            )
            .at(Place::column("L"))
            .measured(high, longest)
            .remedy("record at least three times as long as the longest delay"));
        }
    }
    Ok(())
}

/// X04: what y does has nothing to do with u.
fn no_relation(rec: &Record, p: f64, limits: &Limits) -> Error {
    Error::new(
        "X04",
        format!("no relation: {} explains nothing of {} beyond chance", rec.names[0], rec.names[rec.nu]),
    )
    .at(Place::column(&rec.names[rec.nu]))
    .count(rec.N())
    .measured(p, limits.X04)
    .remedy("check that these two columns belong together; record with larger steps of the input")
}

impl Problem<'_, '_> {
    fn fit(&self, best: &Point) -> Result<Fit> {
        let Ts = self.rec.Ts;
        let (rss, linear) = self.evaluate(best).ok_or_else(|| no_relation(self.rec, 1.0, self.limits))?;
        let n = self.linear();
        let every: Vec<usize> = (0..n + 2).collect();
        let all = self.full(best, &linear);
        let N = self.rows(best.history);
        let states = self.stretches(best.history).filter(|s| !s.at_rest).count();
        let parameters = n + 2 + states;
        if N <= parameters {
            return Err(too_short(N, parameters));
        }
        self.check_relation(&all, rss, N)?;

        let (T, L) = (best.ln_T.exp(), best.m as f64 * Ts + best.f);
        self.check_colour(&Fopdt { K: 1.0, T, L })?;
        // Before the solution: of a `T` far below `Ts` nothing is left in the rows.
        let upper = self.upper_T(best, linear.theta[0], rss, N - parameters);
        let sampled = sampling(T, upper, Ts, self.limits)?;
        let solution = solve(&all, &every, n + 2, RANK_TOLERANCE)
            .map_err(|_| no_relation(self.rec, 1.0, self.limits))?;
        let gain_unit = self.scale_u.factor / self.scale_y.factor;
        let K = linear.theta[0] * gain_unit;
        let offset = linear.theta.get(1).copied().unwrap_or(0.0) / self.scale_y.factor;
        let s2 = rss / (N - parameters) as f64;
        let model = Fopdt { K, T, L };
        // The state without the offset, at the first residual row of each segment.
        let state = |(s, x): (&Stretch, &Vec<f64>)| {
            let held = if s.at_rest { self.rec.u[s.rows.start] } else { self.scale_u.zero };
            vec![K * held + x[0] / self.scale_y.factor]
        };
        Fit {
            theta: vec![K, T, L],
            P: self.covariance(&solution, s2, T, gain_unit),
            names: ["K", "T", "L"].map(str::to_owned).to_vec(),
            offset: if self.offset { self.scale_y.zero - K * self.scale_u.zero + offset } else { 0.0 },
            x0: self.stretches(best.history).zip(&linear.x0).map(state).collect(),
            N,
            loss: rss / N as f64 / self.scale_y.factor.powi(2),
            status: best.status,
            expected_digits: vec![15.0 + solution.ratio.log10(); 3],
            notes: self.notes(&model, N, best).into_iter().chain(sampled).collect(),
            model: model.into(),
        }
        .finite()
    }

    /// Covariance of `K, T, L, O` in the record's units from that of `K, O, ln T, L/Ts` in scaled units.
    fn covariance(&self, solution: &Solution, s2: f64, T: f64, gain_unit: f64) -> Vec<f64> {
        let n = self.linear();
        let all = n + 2;
        // Row i of `map` gives result i from the scaled parameters; O = y0 - K u0 + O'/factor.
        let mut map = vec![vec![0.0; all]; 3 + usize::from(self.offset)];
        map[0][0] = gain_unit;
        map[1][n] = T;
        map[2][n + 1] = self.rec.Ts;
        if self.offset {
            map[3][0] = -gain_unit * self.scale_u.zero;
            map[3][1] = 1.0 / self.scale_y.factor;
        }
        congruence(&map, |i, j| s2 * solution.inverse_gram[i * all + j])
    }

    /// Refuses a model that explains no more than the best of as many random inputs would (X04).
    ///
    /// The F test of three parameters, with the p-value multiplied by the number of delays tried.
    fn check_relation(&self, all: &Triangle, rss: f64, N: usize) -> Result<()> {
        let own: Vec<usize> = (1..self.linear()).collect();
        let without = residual_norm2(all, &own, all.n() - 1, RANK_TOLERANCE);
        let freedom = (N - self.linear() - 3) as f64;
        let F = (without - rss) / 3.0 / (rss / freedom).max(f64::MIN_POSITIVE);
        let tried = self.cells.clone().count() as f64;
        let p = (tried * f_tail(F, 3.0, freedom)).min(1.0);
        if p > self.limits.X04 { Err(self.unrelated(p)) } else { Ok(()) }
    }

    /// The same with the colour of y taken up by an autoregression. A step test moves too seldom for it.
    fn check_colour(&self, unit: &Fopdt) -> Result<()> {
        if self.stretches.iter().any(|s| s.moves <= MOST_MOVES) {
            return Ok(());
        }
        let forced = |s: &Stretch| {
            let rows = s.rows.clone();
            (self.y[rows.clone()].to_vec(), unit.simulate(&self.u[rows], self.rec.Ts, 0.0))
        };
        let segments: Vec<_> = self.stretches.iter().map(forced).collect();
        let p = (self.cells.clone().count() as f64 * chance(&segments)).min(1.0);
        if p > self.limits.X04 { Err(self.unrelated(p)) } else { Ok(()) }
    }

    /// Upper end of the 95 % interval of a `T` that is short against the sample time, as far as M09 asks:
    /// `T` itself where `Ts / M09` is excluded, otherwise that.
    ///
    /// The standard deviation is no help: the rows change so little with a `T` below `Ts` that it grows
    /// without bound. So the sum of squares at `Ts / M09`, with the best of the shorter delays that go
    /// with a longer `T`, is compared with the least one. Of a plant that is no first order, such as a
    /// resonance, a short `T` says nothing.
    fn upper_T(&self, best: &Point, K: f64, rss: f64, freedom: usize) -> f64 {
        let (T, limit, Ts) = (best.ln_T.exp(), self.rec.Ts / self.limits.M09, self.rec.Ts);
        if T >= limit {
            return T;
        }
        if rss > 1e-20 * dot(&self.y, &self.y) && !self.is_first_order(best, K) {
            return limit;
        }
        let cost = |L: f64| {
            let m = ((L / Ts).floor() as usize).min(best.m);
            let point = Point { ln_T: limit.ln(), m, f: L - m as f64 * Ts, ..*best };
            self.evaluate(&point).map_or(f64::INFINITY, |(cost, _)| cost)
        };
        // From the delay of the best down, in tenths of a sample; then in hundredths around the best of these.
        let longest = best.m as f64 * Ts + best.f;
        let least = |from: f64, step: f64, count: u32| {
            let delays = (0..=count).map(|i| (from - f64::from(i) * step).max(self.bounds.0).min(longest));
            delays.map(|L| (cost(L), L)).fold((f64::INFINITY, from), |a, b| if b.0 < a.0 { b } else { a })
        };
        let (_, L) = least(longest, 0.1 * Ts, 30);
        let (least, _) = least(L + 0.1 * Ts, 0.01 * Ts, 20);
        let F = (least - rss) / (rss / freedom as f64).max(f64::MIN_POSITIVE);
        if f_tail(F, 1.0, freedom as f64) < 0.05 { T } else { limit }
    }

    /// Whether the errors of a fit with a short `T` no longer follow the delayed input.
    fn is_first_order(&self, best: &Point, K: f64) -> bool {
        let (T, L) = (best.ln_T.exp(), best.m as f64 * self.rec.Ts + best.f);
        let errors = |s: &Stretch| {
            let w = Fopdt { K, T, L }.simulate(&self.u[s.rows.clone()], self.rec.Ts, 0.0);
            (self.y[s.rows.clone()].iter().zip(&w).map(|(y, w)| y - w).collect(), w)
        };
        let segments: Vec<_> = self.stretches.iter().map(errors).collect();
        chance(&segments) > FOLLOWS
    }

    fn unrelated(&self, p: f64) -> Error {
        let first = (self.limits.X05 * self.rec.N() as f64) as usize;
        match follows_later(self.rec, 0, first) {
            Some(lag) => beyond(self.rec, 0, lag, self.limits),
            None => no_relation(self.rec, p, self.limits),
        }
    }

    fn notes(&self, model: &Fopdt, N: usize, best: &Point) -> Vec<Note> {
        let mut notes = Vec::new();
        let Ts = self.rec.Ts;
        let rows_limit = self.limits.X03 * 4.0;
        if (N as f64) < rows_limit {
            notes.push(
                Note::warning("X03", format!("{N} rows for 4 parameters: intervals are rough"))
                    .count(N)
                    .measured(N as f64 / 4.0, self.limits.X03)
                    .remedy("record longer"),
            );
        }
        if self.stretches(best.history).any(|s| s.at_rest) {
            notes.push(Note::info(
                "X07",
                "a step test that begins at rest: the plant is taken as in equilibrium before it",
            ));
        }
        if best.status != Status::Converged {
            notes.push(
                Note::warning("N05", "the search stopped before the gradient test passed")
                    .remedy("give a range of delays: L=(low, high)"),
            );
        }
        if model.L >= self.bounds.1 - 0.25 * Ts {
            notes.push(
                Note::warning(
                    "X05",
                    format!("the delay lies at the end of the range searched, {:.4} s", self.bounds.1),
                )
                .at(Place::column("L"))
                .measured(model.L, self.bounds.1)
                .remedy("search a wider range: L=(low, high)"),
            );
        }
        notes
    }
}
