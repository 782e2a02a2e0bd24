//! First order plus dead time by variable projection: `y = K xi(T, L) + O + x0 a^(t-t0)`.
//!
//! For given `T, L` the output of the unit-gain plant is simulated exactly ([`crate::model::ProcessModel`])
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

use std::ops::Range;

use super::fit::{Fit, Status};
use super::least_squares::too_short;
use crate::error::{Error, Result};
use crate::excitation::check_input_motion;
use crate::limits::Limits;
use crate::linalg::{Block, Segmented, Solution, Triangle, dot, extent, solve};
use crate::model::{Model, ProcessModel};
use crate::note::{Note, Place};
use crate::record::{Record, Scale};

/// Moves of the input up to which a segment counts as a step test.
const MOST_MOVES: usize = 10;

/// Share of the output's travel that it may drift before the first move and still be at rest.
const DRIFT: f64 = 0.05;

/// What may be set.
#[derive(Clone, Debug)]
pub struct ProcessOptions {
    /// Whether an offset is estimated.
    pub offset: bool,
    /// Range of delays to search, s; a tenth of the record, at most 200 samples, when absent.
    pub L: Option<(f64, f64)>,
}

/// Fits `K e^(-L s) / (T s + 1)` to a record with one input and one output.
pub fn p1d(rec: &Record, options: &ProcessOptions, limits: &Limits) -> Result<Fit> {
    check(rec, options, limits)?;
    check_input_motion(rec, limits)?;
    let problem = Problem::new(rec, options, limits)?;
    let minima: Vec<Point> = problem.starts().into_iter().filter_map(|(T, m)| problem.search(T, m)).collect();
    match problem.best(&minima) {
        Some(best) => problem.fit(&best),
        None => Err(no_relation(rec, 1.0, limits)),
    }
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

/// The scaled data and the rows on which residuals count.
struct Problem<'r, 'a> {
    rec: &'r Record<'a>,
    limits: &'r Limits,
    offset: bool,
    u: Vec<f64>,
    y: Vec<f64>,
    scale_u: Scale,
    scale_y: Scale,
    stretches: Vec<Stretch>,
    /// Delay cells allowed, in whole samples.
    cells: std::ops::RangeInclusive<usize>,
    /// Bounds of the delay, s.
    bounds: (f64, f64),
}

/// A segment, and whether its plant was at rest before it.
struct Stretch {
    rows: Range<usize>,
    at_rest: bool,
}

impl Stretch {
    /// First residual row when segments not at rest give `history` rows away.
    fn first(&self, history: usize) -> usize {
        if self.at_rest { self.rows.start } else { (self.rows.start + history).min(self.rows.end) }
    }
}

/// Whether a segment is a step test that begins at rest: the input moves a few times only, and before its
/// first move the output has not gone anywhere.
fn starts_at_rest(rec: &Record, rows: &Range<usize>) -> bool {
    let u = &rec.u[rows.clone()];
    let moves = u.windows(2).filter(|w| w[0] != w[1]).count();
    let held = u.iter().take_while(|&&x| x == u[0]).count();
    if moves > MOST_MOVES || held < 3 || held == u.len() {
        return false;
    }
    let (low, high) = extent(&rec.y[rows.clone()]);
    let drift = rec.y[rows.start + held - 1] - rec.y[rows.start];
    drift.abs() <= DRIFT * (high - low)
}

/// A point of the search: `L = m Ts + f`.
#[derive(Clone, Copy, Debug)]
struct Point {
    ln_T: f64,
    m: usize,
    f: f64,
    /// Rows of each segment that are history only.
    history: usize,
    cost: f64,
    status: Status,
}

impl<'r, 'a> Problem<'r, 'a> {
    fn new(rec: &'r Record<'a>, options: &ProcessOptions, limits: &'r Limits) -> Result<Self> {
        let scale_u = Scale::of(rec.u, options.offset);
        let scale_y = Scale::of(rec.y, options.offset);
        let span = rec.segments().map(|s| s.len()).max().unwrap_or(0);
        let default = (span as f64 / 4.0).min(200.0) * rec.Ts;
        let bounds = options.L.unwrap_or((0.0, default));
        let cell = |L: f64| (L / rec.Ts + 1e-9).floor() as usize;
        let stretches =
            rec.segments().map(|rows| Stretch { at_rest: starts_at_rest(rec, &rows), rows }).collect();
        let problem = Problem {
            rec,
            stretches,
            limits,
            offset: options.offset,
            u: rec.u.iter().map(|&x| scale_u.apply(x)).collect(),
            y: rec.y.iter().map(|&x| scale_y.apply(x)).collect(),
            scale_u,
            scale_y,
            cells: cell(bounds.0)..=cell(bounds.1),
            bounds,
        };
        let rows = problem.rows(problem.cells.start() + 1);
        let needed = 3 + usize::from(options.offset) + problem.rec.starts.len();
        if rows <= needed {
            return Err(too_short(rows, needed));
        }
        Ok(problem)
    }

    /// Segments long enough to count when `history` rows are given away.
    fn stretches(&self, history: usize) -> impl Iterator<Item = &Stretch> {
        self.stretches.iter().filter(move |s| s.rows.len() > history + 2)
    }

    /// Residual rows when each segment not at rest gives `history` rows away.
    fn rows(&self, history: usize) -> usize {
        self.stretches(history)
            .flat_map(|s| s.first(history)..s.rows.end)
            .filter(|&k| self.rec.is_valid(k, 0))
            .count()
    }

    /// Number of columns shared by all segments: gain, and offset if estimated.
    fn linear(&self) -> usize {
        1 + usize::from(self.offset)
    }

    // --- starts -------------------------------------------------------------------------------

    /// The best places of the correlation between y and the filtered, shifted input, over a grid of
    /// time constants: at most three, in different delay cells.
    fn starts(&self) -> Vec<(f64, usize)> {
        let span = self.rec.segments().map(|s| s.len()).max().unwrap_or(2) as f64 * self.rec.Ts;
        let (shortest, longest) = (0.3 * self.rec.Ts, span);
        let count = 14;
        let mut map: Vec<(f64, f64, usize)> = Vec::new();
        let y = Sums::new(&self.y);
        for i in 0..count {
            let T = shortest * (longest / shortest).powf(f64::from(i) / f64::from(count - 1));
            let filtered = self.filtered(T);
            let w = Sums::new(&filtered);
            for m in self.cells.clone() {
                map.push((self.correlation(&w, &y, m), T, m));
            }
        }
        map.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut starts: Vec<(f64, usize)> = Vec::new();
        for (_, T, m) in map {
            let apart = (T / self.rec.Ts / 2.0).max(2.0);
            if starts.iter().all(|&(_, other)| (other as f64 - m as f64).abs() > apart) {
                starts.push((T, m));
            }
            if starts.len() == 3 {
                break;
            }
        }
        starts
    }

    /// The unit-gain first-order response without delay, from the equilibrium of each segment's first input.
    fn filtered(&self, T: f64) -> Vec<f64> {
        let a = (-self.rec.Ts / T).exp();
        let mut w = vec![0.0; self.u.len()];
        for s in self.rec.segments() {
            let mut state = self.u[s.start];
            for k in s {
                w[k] = state;
                state = a * state + (1.0 - a) * self.u[k];
            }
        }
        w
    }

    /// Squared correlation of `y(t)` and `w(t - m)`, means removed.
    fn correlation(&self, w: &Sums, y: &Sums, m: usize) -> f64 {
        let (mut n, mut sw, mut sy, mut sww, mut syy, mut swy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for s in self.rec.segments().filter(|s| s.len() > m + 1) {
            let (earlier, later) = (s.start..s.end - m, s.start + m..s.end);
            n += earlier.len() as f64;
            sw += w.sum(&earlier);
            sy += y.sum(&later);
            sww += w.squares(&earlier);
            syy += y.squares(&later);
            swy += dot(&w.x[earlier], &y.x[later]);
        }
        let (vw, vy, c) = (sww - sw * sw / n, syy - sy * sy / n, swy - sw * sy / n);
        if n > 3.0 && vw > 0.0 && vy > 0.0 { c * c / (vw * vy) * (1.0 - 3.0 / n) } else { 0.0 }
    }

    // --- search -------------------------------------------------------------------------------

    /// From cell to cell downhill, until the minimum lies inside a cell or at a kink.
    fn search(&self, T: f64, m: usize) -> Option<Point> {
        let Ts = self.rec.Ts;
        // The same residual rows in every cell, so that costs compare.
        let reach = *self.cells.end();
        let room = |m: usize| (m + 2).min(reach) + 1;
        let start = Point {
            ln_T: T.ln(),
            m,
            f: 0.5 * Ts,
            history: room(m),
            cost: f64::NAN,
            status: Status::NotConverged,
        };
        let mut best = self.descend(start)?;
        loop {
            let next = if best.f <= 0.0 && best.m > *self.cells.start() {
                Point { m: best.m - 1, f: Ts, ..best }
            } else if best.f >= Ts && best.m < reach {
                Point { m: best.m + 1, f: 0.0, ..best }
            } else {
                return Some(best);
            };
            if next.m + 1 > best.history {
                let history = room(next.m);
                best = self.descend(Point { history, ..next })?;
                continue;
            }
            match self.descend(next) {
                Some(point) if point.cost < best.cost * (1.0 - 1e-12) => best = point,
                _ => return Some(best),
            }
        }
    }

    /// The best of several minima, judged on the rows that all of them leave.
    fn best(&self, points: &[Point]) -> Option<Point> {
        let history = points.iter().map(|p| p.history).max()?;
        let cost =
            |p: &Point| self.evaluate(&Point { history, ..*p }).map_or(f64::INFINITY, |(cost, _)| cost);
        let best = points.iter().map(|p| (cost(p), *p)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, p)| p)?;
        // On its way down in delay a search gives away rows that its end does not need.
        self.search(best.ln_T.exp(), best.m).or(Some(best))
    }

    /// Levenberg-Marquardt in `(ln T, f)` inside one cell, `0 <= f <= Ts`.
    fn descend(&self, start: Point) -> Option<Point> {
        let Ts = self.rec.Ts;
        let (low, high) = (self.bounds.0 - start.m as f64 * Ts, self.bounds.1 - start.m as f64 * Ts);
        let (low, high) = (low.max(0.0), high.min(Ts).max(low.max(0.0)));
        let ln_T_bounds = ((0.02 * Ts).ln(), (100.0 * Ts * self.y.len() as f64).ln());
        let mut point = Point { f: start.f.clamp(low, high), ..start };
        let (mut cost, mut linear) = self.evaluate(&point)?;
        let exact = 1e-26 * dot(&self.y, &self.y);
        let mut damping = 1e-3;
        for _ in 0..60 {
            let gauss_newton = self.jacobian(&point, &linear)?;
            if cost <= exact || gauss_newton.slope(point.f, low, high, cost) < 1e-9 {
                point.status = Status::Converged;
                break;
            }
            let mut accepted = false;
            for _ in 0..12 {
                let (d_ln_T, d_f) = gauss_newton.step(damping, point.f, low, high);
                let trial = Point {
                    ln_T: (point.ln_T + d_ln_T.clamp(-2.0, 2.0)).clamp(ln_T_bounds.0, ln_T_bounds.1),
                    f: (point.f + d_f * Ts).clamp(low, high),
                    ..point
                };
                let (trial_cost, trial_linear) = self.evaluate(&trial)?;
                if trial_cost < cost {
                    (point, cost, linear) = (trial, trial_cost, trial_linear);
                    damping = (damping * 0.1).max(1e-12);
                    accepted = true;
                    break;
                }
                damping *= 10.0;
            }
            if !accepted {
                // No representable step lowers the cost: a minimum to rounding, if the slope agrees.
                if gauss_newton.slope(point.f, low, high, cost) < 1e-5 {
                    point.status = Status::Converged;
                }
                break;
            }
        }
        Some(Point { cost, ..point })
    }

    /// Cost and linear parameters `[K, O]` with the initial states at a point.
    fn evaluate(&self, point: &Point) -> Option<(f64, Linear)> {
        let mut problem = Segmented::new(1, self.linear());
        let shape = Shape::new(point, self.rec.Ts);
        for s in self.stretches(point.history) {
            problem.push(self.segment(s, point, &shape, None));
        }
        let columns: Vec<usize> = (0..self.linear()).collect();
        let solution = solve(problem.common(), &columns, self.linear(), 1e-13).ok()?;
        let x0 = problem.locals(&solution.theta);
        Some((solution.rss, Linear { theta: solution.theta, x0 }))
    }

    /// Triangle of `[x0, K, O | lnT, L | y]` over all segments at a point.
    fn jacobian(&self, point: &Point, linear: &Linear) -> Option<GaussNewton> {
        let triangle = self.full(point, linear);
        let n = self.linear();
        Some(GaussNewton {
            r11: triangle.at(n, n),
            r12: triangle.at(n, n + 1),
            r22: triangle.at(n + 1, n + 1),
            b1: triangle.at(n, n + 2),
            b2: triangle.at(n + 1, n + 2),
        })
    }

    fn full(&self, point: &Point, linear: &Linear) -> Triangle {
        let mut problem = Segmented::new(1, self.linear() + 2);
        let shape = Shape::new(point, self.rec.Ts);
        for (s, x0) in self.stretches(point.history).zip(&linear.x0) {
            problem.push(self.segment(s, point, &shape, Some((linear.theta[0], x0[0]))));
        }
        problem.common().clone()
    }

    /// Triangle of one segment's rows `[a^k | xi, 1 | dyhat/dlnT, dyhat/d(L/Ts) | y]`; the
    /// derivatives only where gain and initial state are given.
    fn segment(&self, s: &Stretch, point: &Point, shape: &Shape, at: Option<(f64, f64)>) -> Triangle {
        let n = 1 + self.linear() + if at.is_some() { 2 } else { 0 } + 1;
        let (mut triangle, mut block) = (Triangle::new(n), Block::new(n));
        let mut row = [0.0; 6];
        let u = &self.u[s.rows.clone()];
        let first = s.first(point.history) - s.rows.start;
        let mut state = if s.at_rest { ShapeState::at_rest(u[0]) } else { ShapeState::free() };
        for k in first..u.len() {
            if k > first {
                // Rows before the segment are asked for only at rest, where the input was held.
                let (newer, older) = (k.saturating_sub(point.m + 1), k.saturating_sub(point.m + 2));
                state.advance(shape, u[newer], u[older]);
            }
            if !self.rec.is_valid(s.rows.start + k, 0) {
                continue;
            }
            let mut j = 0;
            let mut put = |x: f64| {
                row[j] = x;
                j += 1;
            };
            put(state.decay);
            put(state.xi);
            if self.offset {
                put(1.0);
            }
            if let Some((K, x0)) = at {
                put(K * state.xi_ln_T + x0 * state.decay_ln_T);
                put(K * state.xi_L);
            }
            put(self.y[s.rows.start + k]);
            block.push(&row[..n]);
            if block.free() == 0 {
                triangle.absorb(&mut block);
            }
        }
        triangle.absorb(&mut block);
        triangle
    }

    // --- result -------------------------------------------------------------------------------

    fn fit(&self, best: &Point) -> Result<Fit> {
        let Ts = self.rec.Ts;
        let (rss, linear) =
            self.evaluate(best).ok_or_else(|| no_relation(self.rec, f64::NAN, self.limits))?;
        let n = self.linear();
        let every: Vec<usize> = (0..n + 2).collect();
        let solution = solve(&self.full(best, &linear), &every, n + 2, 1e-12)
            .map_err(|_| no_relation(self.rec, f64::NAN, self.limits))?;
        let N = self.rows(best.history);
        let states = self.stretches(best.history).filter(|s| !s.at_rest).count();
        let parameters = n + 2 + states;
        if N <= parameters {
            return Err(too_short(N, parameters));
        }
        self.check_relation(best, rss, N)?;

        let (T, L) = (best.ln_T.exp(), best.m as f64 * Ts + best.f);
        let gain_unit = self.scale_u.factor / self.scale_y.factor;
        let K = linear.theta[0] * gain_unit;
        let offset = linear.theta.get(1).copied().unwrap_or(0.0) / self.scale_y.factor;
        let s2 = rss / (N - parameters) as f64;
        let model = ProcessModel { K, T, L };
        // The state without the offset, at the first residual row of each segment.
        let state = |(s, x): (&Stretch, &Vec<f64>)| {
            let held = if s.at_rest { self.rec.u[s.rows.start] } else { self.scale_u.zero };
            vec![K * held + x[0] / self.scale_y.factor]
        };
        Ok(Fit {
            theta: vec![K, T, L],
            P: self.covariance(&solution, s2, T, gain_unit),
            names: ["K", "T", "L"].map(str::to_owned).to_vec(),
            offset: if self.offset { self.scale_y.zero - K * self.scale_u.zero + offset } else { 0.0 },
            x0: self.stretches(best.history).zip(&linear.x0).map(state).collect(),
            N,
            loss: rss / N as f64 / self.scale_y.factor.powi(2),
            status: best.status,
            expected_digits: vec![15.0 + solution.ratio.log10(); 3],
            notes: self.notes(&model, N, best),
            model: Model::Process(model),
        })
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
        let mut P = Vec::with_capacity(map.len() * map.len());
        for left in &map {
            for right in &map {
                let mut sum = 0.0;
                for (i, l) in left.iter().enumerate() {
                    for (j, r) in right.iter().enumerate() {
                        sum += l * r * solution.inverse_gram[i * all + j];
                    }
                }
                P.push(s2 * sum);
            }
        }
        P
    }

    /// Refuses a model that explains no more than the best of as many random inputs would (X04).
    ///
    /// The F test of three parameters, with the p-value multiplied by the number of delays tried.
    fn check_relation(&self, best: &Point, rss: f64, N: usize) -> Result<()> {
        let mut problem = Segmented::new(1, usize::from(self.offset));
        let shape = Shape::new(best, self.rec.Ts);
        for s in self.stretches(best.history) {
            let mut triangle = Triangle::new(2 + usize::from(self.offset));
            let mut block = Block::new(triangle.n());
            let mut decay = if s.at_rest { 0.0 } else { 1.0 };
            for k in s.first(best.history)..s.rows.end {
                if self.rec.is_valid(k, 0) {
                    let row = [decay, 1.0, self.y[k]];
                    if self.offset {
                        block.push(&row)
                    } else {
                        block.push(&[decay, self.y[k]])
                    }
                    if block.free() == 0 {
                        triangle.absorb(&mut block);
                    }
                }
                decay *= shape.a;
            }
            triangle.absorb(&mut block);
            problem.push(triangle);
        }
        let columns: Vec<usize> = (0..usize::from(self.offset)).collect();
        let without = crate::linalg::residual_norm2(problem.common(), &columns, columns.len(), 1e-13);
        let freedom = (N - self.linear() - 3) as f64;
        let F = (without - rss) / 3.0 / (rss / freedom).max(f64::MIN_POSITIVE);
        let tried = self.cells.clone().count() as f64;
        let p = (tried * crate::stats::f_tail(F, 3.0, freedom)).min(1.0);
        if p > self.limits.X04 { Err(no_relation(self.rec, p, self.limits)) } else { Ok(()) }
    }

    fn notes(&self, model: &ProcessModel, N: usize, best: &Point) -> Vec<Note> {
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
        if model.L >= self.bounds.1 - 1e-6 * Ts {
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
        if model.T < 2.0 * Ts {
            notes.push(
                Note::warning("M09", format!("T = {:.4} s is short against Ts = {Ts} s", model.T))
                    .measured(Ts / model.T, 0.5)
                    .remedy("sample faster"),
            );
        }
        notes
    }
}

/// A signal with its running sums, so that those of any stretch cost two look-ups.
struct Sums<'x> {
    x: &'x [f64],
    first: Vec<f64>,
    second: Vec<f64>,
}

impl<'x> Sums<'x> {
    fn new(x: &'x [f64]) -> Self {
        let running = |f: fn(f64) -> f64| {
            let mut sum = 0.0;
            let sums = x.iter().map(|&v| {
                sum += f(v);
                sum
            });
            std::iter::once(0.0).chain(sums).collect()
        };
        Sums { x, first: running(|v| v), second: running(|v| v * v) }
    }

    fn sum(&self, rows: &Range<usize>) -> f64 {
        self.first[rows.end] - self.first[rows.start]
    }

    fn squares(&self, rows: &Range<usize>) -> f64 {
        self.second[rows.end] - self.second[rows.start]
    }
}

struct Linear {
    theta: Vec<f64>,
    x0: Vec<Vec<f64>>,
}

/// Coefficients of the unit-gain recursion at a point, with their derivatives.
struct Shape {
    a: f64,
    b1: f64,
    b2: f64,
    a_ln_T: f64,
    b1_ln_T: f64,
    b2_ln_T: f64,
    /// d b1 / d(L/Ts) = -d b2 / d(L/Ts).
    b1_L: f64,
}

impl Shape {
    fn new(point: &Point, Ts: f64) -> Self {
        let T = point.ln_T.exp();
        let a = (-Ts / T).exp();
        let g = (-(Ts - point.f) / T).exp();
        let (a_ln_T, g_ln_T) = (a * Ts / T, g * (Ts - point.f) / T);
        Shape {
            a,
            b1: -(-(Ts - point.f) / T).exp_m1(),
            b2: -g * (-point.f / T).exp_m1(),
            a_ln_T,
            b1_ln_T: -g_ln_T,
            b2_ln_T: g_ln_T - a_ln_T,
            b1_L: -g * Ts / T,
        }
    }
}

/// State of the recursion and of its derivatives, from rest at the first residual row.
struct ShapeState {
    xi: f64,
    xi_ln_T: f64,
    xi_L: f64,
    decay: f64,
    decay_ln_T: f64,
}

impl ShapeState {
    /// The state is a parameter of its own: the response counts from zero.
    fn free() -> Self {
        ShapeState { xi: 0.0, xi_ln_T: 0.0, xi_L: 0.0, decay: 1.0, decay_ln_T: 0.0 }
    }

    /// In equilibrium with the held input.
    fn at_rest(u: f64) -> Self {
        ShapeState { xi: u, decay: 0.0, ..ShapeState::free() }
    }

    fn advance(&mut self, c: &Shape, newer: f64, older: f64) {
        self.xi_ln_T = c.a * self.xi_ln_T + c.a_ln_T * self.xi + c.b1_ln_T * newer + c.b2_ln_T * older;
        self.xi_L = c.a * self.xi_L + c.b1_L * (newer - older);
        self.xi = c.a * self.xi + c.b1 * newer + c.b2 * older;
        self.decay_ln_T = c.a * self.decay_ln_T + c.a_ln_T * self.decay;
        self.decay *= c.a;
    }
}

/// The projected problem `min |b - R d|` in `d = (d ln T, d f/Ts)`.
struct GaussNewton {
    r11: f64,
    r12: f64,
    r22: f64,
    b1: f64,
    b2: f64,
}

impl GaussNewton {
    /// Largest cosine between the residual and a free column of the Jacobian.
    fn slope(&self, f: f64, low: f64, high: f64, cost: f64) -> f64 {
        let size = cost.sqrt().max(f64::MIN_POSITIVE);
        let T = self.r11 * self.b1 / (self.r11.abs().max(f64::MIN_POSITIVE) * size);
        let length = self.r12.hypot(self.r22).max(f64::MIN_POSITIVE);
        let L = (self.r12 * self.b1 + self.r22 * self.b2) / (length * size);
        let held = (f <= low && L < 0.0) || (f >= high && L > 0.0);
        T.abs().max(if held { 0.0 } else { L.abs() })
    }

    /// Damped step; the delay is held where it would leave the cell at a bound.
    fn step(&self, damping: f64, f: f64, low: f64, high: f64) -> (f64, f64) {
        let (g1, g2) = (self.r11 * self.b1, self.r12 * self.b1 + self.r22 * self.b2);
        let (h11, h12, h22) =
            (self.r11 * self.r11, self.r11 * self.r12, self.r12 * self.r12 + self.r22 * self.r22);
        let (d11, d22) = (h11 * (1.0 + damping), h22 * (1.0 + damping));
        let alone = if d11 > 0.0 { g1 / d11 } else { 0.0 };
        let determinant = d11 * d22 - h12 * h12;
        if !(determinant > 0.0) {
            return (alone, 0.0);
        }
        let d2 = (d11 * g2 - h12 * g1) / determinant;
        if (f <= low && d2 < 0.0) || (f >= high && d2 > 0.0) {
            return (alone, 0.0);
        }
        ((d22 * g1 - h12 * g2) / determinant, d2)
    }
}
