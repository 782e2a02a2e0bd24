//! The data of a process fit, the rows that count, and the columns of its regressions at a point.

use std::borrow::Cow;
use std::ops::Range;

use super::super::fit::Status;
use super::super::orders::too_short;
use super::chain::{Chain, Drive, MOST};
use super::code::Code;
use super::irregular::{in_steps, within};
use super::noise::Noise;
use super::{ProcessOptions, RANK_TOLERANCE};
use crate::error::Result;
use crate::limits::Limits;
use crate::linalg::{Block, Segmented, Triangle, dot, extent, solve, sum};
use crate::record::{Record, Scale};

/// Moves of the input up to which a segment counts as a step test.
pub(super) const MOST_MOVES: usize = 6;

/// Share of the segment over which the input must be held at first.
const LEAST_REST: f64 = 0.015;

/// Share of the output's travel that it may drift before the first move and still be at rest.
const DRIFT: f64 = 0.05;

/// Standard deviations of its noise by which a drift must pass that.
const SURE: f64 = 3.0;

/// The scaled data and the rows on which residuals count.
pub(super) struct Problem<'r, 'a> {
    pub(super) rec: &'r Record<'a>,
    pub(super) limits: &'r Limits,
    pub(super) codes: Vec<Code>,
    /// Orders of `C` and `D`.
    pub(super) noise: (usize, usize),
    pub(super) offset: bool,
    /// Rows from which on the offset is another one.
    pub(super) steps: Vec<usize>,
    /// Whether the offset also drifts along a line.
    pub(super) line: bool,
    pub(super) u: Vec<Vec<f64>>,
    pub(super) y: Vec<f64>,
    pub(super) scale_u: Vec<Scale>,
    pub(super) scale_y: Scale,
    pub(super) stretches: Vec<Stretch>,
    /// Stamps in mean steps, where they are not uniform.
    pub(super) t: Option<Vec<f64>>,
    /// Bounds of the delay, samples.
    pub(super) bounds: (f64, f64),
}

/// A segment, and whether its plant was at rest before it.
#[derive(Clone)]
pub(super) struct Stretch {
    pub(super) rows: Range<usize>,
    pub(super) at_rest: bool,
    /// Moves of the input.
    pub(super) moves: usize,
    /// Rows within the first `h` mean steps, for each `h`; none where each step has one.
    pub(super) within: Vec<usize>,
}

impl Stretch {
    /// Rows that a history of so many mean steps takes.
    pub(super) fn given(&self, history: usize) -> usize {
        self.within.get(history).or(self.within.last()).copied().unwrap_or(history)
    }

    /// First residual row when segments not at rest give `history` steps away.
    pub(super) fn first(&self, history: usize) -> usize {
        if self.at_rest {
            self.rows.start
        } else {
            (self.rows.start + self.given(history)).min(self.rows.end)
        }
    }
}

/// A point of the search.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// `ln T …, ln zeta, L` of each input, time in samples, then `c …, d …`.
    pub(super) x: Vec<f64>,
    /// Cell of each input's delay, `m <= L <= m + 1`.
    pub(super) m: Vec<usize>,
    /// Rows of each segment that are history only.
    pub(super) history: usize,
    pub(super) cost: f64,
    pub(super) status: Status,
}

/// What follows linearly at a point: `[K, K Tz, …, O]`, and the free states of each segment.
pub(super) struct Linear {
    pub(super) theta: Vec<f64>,
    pub(super) x0: Vec<Vec<f64>>,
    /// Columns `[free states | responses and their slopes, 1 or t]` of each segment.
    columns: Vec<Vec<Vec<f64>>>,
}

fn moves(u: &[Vec<f64>], rows: &Range<usize>) -> usize {
    (rows.start + 1..rows.end).filter(|&k| u.iter().any(|u| u[k] != u[k - 1])).count()
}

/// Whether a segment looks like a step test that begins at rest: the inputs move a few times only, and
/// before their first move the output has not gone anywhere.
fn starts_at_rest(u: &[Vec<f64>], y: &[f64], rows: &Range<usize>, moves: usize) -> bool {
    let y = &y[rows.clone()];
    let held = held_at_first(u, rows);
    if !few_after_rest(moves, held, y.len()) {
        return false;
    }
    let (low, high) = extent(y);
    let (drift, sd) = drift(&y[..held]);
    drift <= DRIFT * (high - low) + SURE * sd
}

/// How far a signal has gone over its rows, twice the distance of the means of its halves; and the standard deviation
/// that white noise gives it, from the differences of neighbours.
fn drift(y: &[f64]) -> (f64, f64) {
    let half = y.len() / 2;
    if half < 2 {
        return ((y[y.len() - 1] - y[0]).abs(), 0.0); // too few to tell noise
    }
    let mean = |y: &[f64]| sum(y) / y.len() as f64;
    let drift = 2.0 * (mean(&y[y.len() - half..]) - mean(&y[..half])).abs();
    let differences = y.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / (y.len() - 1) as f64;
    // var(difference) = 2 s^2, and of twice the distance of the means 4 (2 s^2 / half).
    (drift, 2.0 * (differences / half as f64).sqrt())
}

/// Rows before the first move.
fn held_at_first(u: &[Vec<f64>], rows: &Range<usize>) -> usize {
    rows.clone().take_while(|&k| u.iter().all(|u| u[k] == u[rows.start])).count()
}

/// A few moves, the first of them after some rest.
fn few_after_rest(moves: usize, held: usize, rows: usize) -> bool {
    moves <= MOST_MOVES && held < rows && held as f64 >= LEAST_REST * rows as f64
}

/// Whether a fit will take the plant as at rest before this input, if the output agrees.
pub fn begins_as_step_test(u: &[f64]) -> bool {
    let (u, rows) = ([u.to_vec()], 0..u.len());
    few_after_rest(moves(&u, &rows), held_at_first(&u, &rows), rows.len())
}

impl<'r, 'a> Problem<'r, 'a> {
    pub(super) fn new(
        rec: &'r Record<'a>,
        codes: &[Code],
        options: &ProcessOptions,
        limits: &'r Limits,
    ) -> Result<Self> {
        let scale_u: Vec<Scale> = (0..rec.nu).map(|i| Scale::of(&rec.input(i), options.offset)).collect();
        let y = rec.output_held(0);
        let scale_y = Scale::of(&y, options.offset);
        let span = rec.segments().map(|s| s.len()).max().unwrap_or(0);
        let default = (0.0, (span as f64 / 4.0).min(200.0));
        let bounds = options.L.map_or(default, |(low, high)| (low / rec.Ts, high / rec.Ts));
        let scaled = |(i, scale): (usize, &Scale)| rec.input(i).iter().map(|&x| scale.apply(x)).collect();
        let u: Vec<Vec<f64>> = scale_u.iter().enumerate().map(scaled).collect();
        let t = in_steps(rec, limits);
        let rests = options.offset || !codes.iter().any(|c| c.integrating);
        let stretch = |rows: Range<usize>| {
            let moves = moves(&u, &rows);
            let within = t.as_deref().map_or_else(Vec::new, |t| within(&t[rows.clone()], bounds.1));
            Stretch { at_rest: rests && starts_at_rest(&u, &y, &rows, moves), moves, rows, within }
        };
        // A noise model needs the errors of all rows before.
        let whole = options.noise == (0, 0) || rec.valid.is_none();
        let stretches = if whole {
            rec.segments().map(stretch).collect()
        } else {
            rec.runs(0, 0, 0).into_iter().map(stretch).collect()
        };
        let problem = Problem {
            rec,
            stretches,
            t: t.clone(),
            limits,
            codes: codes.to_vec(),
            noise: (0, 0),
            offset: options.offset,
            steps: options.offset_of.known(rec),
            line: false,
            y: y.iter().map(|&x| scale_y.apply(x)).collect(),
            u,
            scale_u,
            scale_y,
            bounds,
        };
        let rows = problem.rows(problem.cells().start() + 1);
        let needed = problem.parameters() + problem.locals() * problem.rec.starts.len();
        if rows <= needed {
            return Err(too_short(rows, needed));
        }
        Ok(problem)
    }

    /// Delay cells allowed.
    pub(super) fn cells(&self) -> std::ops::RangeInclusive<usize> {
        let cell = |L: f64| (L + 1e-9).floor() as usize;
        cell(self.bounds.0)..=cell(self.bounds.1)
    }

    /// Segments long enough to count when `history` rows are given away.
    pub(super) fn stretches(&self, history: usize) -> impl Iterator<Item = &Stretch> {
        self.stretches.iter().filter(move |s| s.rows.len() > s.given(history) + 2)
    }

    /// Residual rows when each segment not at rest gives `history` rows away.
    pub(super) fn rows(&self, history: usize) -> usize {
        self.stretches(history)
            .flat_map(|s| s.first(history)..s.rows.end)
            .filter(|&k| self.rec.is_valid(k, 0))
            .count()
    }

    /// Number of columns shared by all segments: gains, offset if estimated, its steps.
    pub(super) fn linear(&self) -> usize {
        self.gains() + self.levels()
    }

    /// Columns of them that are responses or their slopes.
    pub(super) fn gains(&self) -> usize {
        self.codes.iter().map(Code::linear).sum()
    }

    /// Columns of them that are the offset and its steps.
    pub(super) fn levels(&self) -> usize {
        usize::from(self.offset) + self.steps.len() + usize::from(self.line)
    }

    /// Number of coordinates of a point.
    pub(super) fn nonlinear(&self) -> usize {
        self.codes.iter().map(Code::nonlinear).sum::<usize>() + self.noise.0 + self.noise.1
    }

    /// All but the states.
    pub(super) fn parameters(&self) -> usize {
        self.linear() + self.nonlinear()
    }

    /// States of each segment.
    pub(super) fn locals(&self) -> usize {
        self.codes.iter().map(Code::states).sum()
    }

    /// States that are free in all segments together.
    pub(super) fn free_states(&self, history: usize) -> usize {
        let integrators = self.codes.iter().filter(|c| c.integrating).count();
        self.stretches(history).map(|s| if s.at_rest { integrators } else { self.locals() }).sum()
    }

    /// Whether the offset is a drift.
    pub(super) fn drifts(&self) -> bool {
        self.codes.iter().any(|c| c.integrating)
    }

    /// Coordinates of input `i` in a point.
    pub(super) fn own(&self, i: usize) -> Range<usize> {
        let start = self.codes[..i].iter().map(Code::nonlinear).sum();
        start..start + self.codes[i].nonlinear()
    }

    /// Where the delay of input `i` stands in a point.
    pub(super) fn place_of_L(&self, i: usize) -> Option<usize> {
        self.codes[i].delay.then(|| self.own(i).end - 1)
    }

    /// Nonlinear parameters of input `i` at a point, in samples.
    pub(super) fn natural(&self, point: &Point, i: usize) -> Vec<f64> {
        let last = self.place_of_L(i);
        self.own(i).map(|j| if Some(j) == last { point.x[j] } else { point.x[j].exp() }).collect()
    }

    fn chains(&self, point: &Point, slopes: bool) -> Vec<Chain> {
        let chain = |i: usize| Chain::new(self.codes[i], &self.natural(point, i), point.m[i], slopes);
        (0..self.codes.len()).map(chain).collect()
    }

    fn noise_at(&self, point: &Point) -> Option<Noise> {
        Noise::new(&point.x[point.x.len() - self.noise.0 - self.noise.1..], self.noise)
    }

    /// Cost and what follows linearly at a point.
    pub(super) fn evaluate(&self, point: &Point) -> Option<(f64, Linear)> {
        let (chains, noise) = (self.chains(point, false), self.noise_at(point)?);
        let mut problem = Segmented::new(self.locals(), self.linear());
        let mut columns = Vec::new();
        for s in self.stretches(point.history) {
            let own = self.regressors(s, point.history, &chains);
            let white =
                noise.whitened(own.iter().map(Vec::as_slice).chain([self.measured(s, point.history)]));
            problem.push(self.triangle(s, point.history, &white));
            columns.push(own);
        }
        let every: Vec<usize> = (0..self.linear()).collect();
        let solution = solve(problem.common(), &every, self.linear(), RANK_TOLERANCE).ok()?;
        let x0 = problem.locals(&solution.theta);
        solution.rss.is_finite().then_some((solution.rss, Linear { theta: solution.theta, x0, columns }))
    }

    /// Triangle of `[K, K Tz, …, O | ln T …, ln zeta, L, …, c, d | y]` over all segments, states eliminated.
    pub(super) fn full(&self, point: &Point, linear: &Linear) -> Option<Triangle> {
        let mut problem = Segmented::new(self.locals(), self.parameters());
        self.each_stretch(point, linear, |s, columns| {
            problem.push(self.triangle(s, point.history, columns));
        })?;
        Some(problem.common().clone())
    }

    /// Hands `[states | K, K Tz, …, O | ln T …, ln zeta, L, …, c, d | y]` of each stretch over, made white.
    pub(super) fn each_stretch(
        &self,
        point: &Point,
        linear: &Linear,
        mut take: impl FnMut(&Stretch, &[Cow<'_, [f64]>]),
    ) -> Option<()> {
        let (chains, noise) = (self.chains(point, true), self.noise_at(point)?);
        for ((s, x0), own) in self.stretches(point.history).zip(&linear.x0).zip(&linear.columns) {
            let y = self.measured(s, point.history);
            let slopes = self.derivatives(s, point.history, &chains, linear, x0);
            let mut white = noise.whitened(own.iter().chain(&slopes).map(Vec::as_slice));
            if !noise.is_white() {
                white.extend(noise.derivatives(&errors(own, y, linear, x0)).into_iter().map(Cow::Owned));
            }
            white.extend(noise.whitened([y].into_iter()));
            take(s, &white);
        }
        Some(())
    }

    /// Errors of each stretch at a point, before the noise model.
    pub(super) fn residuals(&self, point: &Point) -> Option<Vec<Vec<f64>>> {
        let (_, linear) = self.evaluate(point)?;
        Some(self.errors_with(point, &linear))
    }

    /// Errors of each stretch with these linear parameters.
    pub(super) fn errors_with(&self, point: &Point, linear: &Linear) -> Vec<Vec<f64>> {
        let of = |((s, x0), own): ((&Stretch, &Vec<f64>), &Vec<Vec<f64>>)| {
            errors(own, self.measured(s, point.history), linear, x0)
        };
        self.stretches(point.history).zip(&linear.x0).zip(&linear.columns).map(of).collect()
    }

    fn measured(&self, s: &Stretch, history: usize) -> &[f64] {
        &self.y[s.first(history)..s.rows.end]
    }

    /// Columns `[free states | responses and their slopes, 1 or t]` of one segment.
    fn regressors(&self, s: &Stretch, history: usize, chains: &[Chain]) -> Vec<Vec<f64>> {
        let first = s.first(history) - s.rows.start;
        let len = s.rows.len() - first;
        let (mut free, mut forced) = self.lag_regressors(s, first, chains).unwrap_or_default();
        let uniform = if self.t.is_none() { chains } else { &[] };
        for (chain, u) in uniform.iter().zip(&self.u) {
            let drive = Drive { u: &u[s.rows.clone()], first, gain: 1.0 };
            for j in 0..chain.n() {
                let mut column = vec![0.0; len];
                if !s.at_rest || (chain.code.integrating && j + 1 == chain.n()) {
                    let mut x0 = [0.0; MOST];
                    x0[j] = 1.0;
                    chain.decay(x0, &mut column);
                }
                free.push(column);
            }
            let (mut response, mut slope) =
                (vec![0.0; len], vec![0.0; if chain.code.zero { len } else { 0 }]);
            let x0 = if s.at_rest { chain.rest(drive.u[0]) } else { [0.0; MOST] };
            chain.response(drive, x0, &mut response, &mut slope);
            forced.push(response);
            if chain.code.zero {
                forced.push(slope);
            }
        }
        if self.offset {
            let level = |k: usize| if self.drifts() { (first + k) as f64 / DRIFT_ROWS } else { 1.0 };
            forced.push((0..len).map(level).collect());
        }
        for &row in &self.steps {
            forced.push((0..len).map(|k| f64::from(u8::from(s.rows.start + first + k >= row))).collect());
        }
        if self.line {
            forced.push((0..len).map(|k| (s.rows.start + first + k) as f64 / self.y.len() as f64).collect());
        }
        free.into_iter().chain(forced).collect()
    }

    /// Derivatives of the output by the coordinates of each input.
    fn derivatives(
        &self,
        s: &Stretch,
        history: usize,
        chains: &[Chain],
        linear: &Linear,
        x0: &[f64],
    ) -> Vec<Vec<f64>> {
        let first = s.first(history) - s.rows.start;
        if let Some(slopes) = self.lag_derivatives(s, first, chains, linear, x0) {
            return slopes;
        }
        let len = s.rows.len() - first;
        let mut all = Vec::new();
        let (mut gains, mut states) = (linear.theta.as_slice(), x0);
        for (chain, u) in chains.iter().zip(&self.u) {
            let (own, rest) = gains.split_at(chain.code.linear());
            let (free, others) = states.split_at(chain.n());
            (gains, states) = (rest, others);
            let drive = Drive { u: &u[s.rows.clone()], first, gain: own[0] };
            let mut columns = vec![vec![0.0; len]; chain.slopes.len()];
            let mut begin = if s.at_rest { chain.rest(own[0] * drive.u[0]) } else { [0.0; MOST] };
            begin.iter_mut().zip(free).for_each(|(x, free)| *x += free);
            chain.run(drive, begin, |k, _, slopes| {
                columns.iter_mut().zip(slopes).for_each(|(column, y)| column[k - first] = y.0);
            });
            if let Some(&gain) = own.get(1) {
                let begin = if s.at_rest { chain.rest(gain * drive.u[0]) } else { [0.0; MOST] };
                chain.run(Drive { gain, ..drive }, begin, |k, _, slopes| {
                    columns.iter_mut().zip(slopes).for_each(|(column, y)| column[k - first] += y.1);
                });
            }
            all.append(&mut columns);
        }
        all
    }

    /// Triangle of the columns' valid rows.
    fn triangle(&self, s: &Stretch, history: usize, columns: &[Cow<'_, [f64]>]) -> Triangle {
        let (mut triangle, mut block) = (Triangle::new(columns.len()), Block::new(columns.len()));
        let first = s.first(history);
        let (mut k, end) = (first, s.rows.end);
        while k < end {
            // A run of valid rows, as far as the block has room.
            let run = (k..end.min(k + block.free())).take_while(|&k| self.rec.is_valid(k, 0)).count();
            if run == 0 {
                k += 1;
                continue;
            }
            for (j, column) in columns.iter().enumerate() {
                block.next_rows(j, run).copy_from_slice(&column[k - first..][..run]);
            }
            if let Some(weights) = self.rec.weights {
                block.weigh(&weights[k..k + run]);
            }
            block.grow(run);
            k += run;
        }
        triangle.absorb(&mut block);
        triangle
    }

    /// Whether the rows that count only because their segment is taken as at rest speak against it: their
    /// mean squared error is more than twice that of all rows.
    pub(super) fn contradicts_rest(&self, point: &Point) -> bool {
        let (Some((cost, _)), Some(errors)) = (self.evaluate(point), self.residuals(point)) else {
            return false;
        };
        let (mut sum, mut count) = (0.0, 0);
        for (s, e) in self.stretches(point.history).zip(&errors).filter(|(s, _)| s.at_rest) {
            let given =
                (0..s.given(point.history).min(e.len())).filter(|k| self.rec.is_valid(s.rows.start + k, 0));
            for k in given {
                sum += e[k] * e[k];
                count += 1;
            }
        }
        let exact = 1e-20 * dot(&self.y, &self.y);
        sum > exact && sum / f64::from(count) > 2.0 * cost / self.rows(point.history) as f64
    }

    /// The same data under other codes.
    pub(super) fn with_codes(&self, codes: Vec<Code>) -> Self {
        Problem {
            codes,
            u: self.u.clone(),
            y: self.y.clone(),
            scale_u: self.scale_u.clone(),
            stretches: self.stretches.clone(),
            steps: self.steps.clone(),
            t: self.t.clone(),
            ..*self
        }
    }

    /// Takes no segment as at rest.
    pub(super) fn without_rest(mut self) -> Self {
        self.stretches.iter_mut().for_each(|s| s.at_rest = false);
        self
    }
}

/// `y - X [x0, theta]` of one segment.
fn errors(columns: &[Vec<f64>], y: &[f64], linear: &Linear, x0: &[f64]) -> Vec<f64> {
    let mut errors = y.to_vec();
    for (column, factor) in columns.iter().zip(x0.iter().chain(&linear.theta)) {
        errors.iter_mut().zip(column).for_each(|(e, x)| *e -= factor * x);
    }
    errors
}

/// Rows in which a drift of one grows to one.
pub(super) const DRIFT_ROWS: f64 = 100.0;
