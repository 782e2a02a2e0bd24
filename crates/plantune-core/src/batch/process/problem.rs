//! The data of a process fit, the rows that count, and the rows of its regressions at a point.

use std::ops::{Range, RangeInclusive};

use super::super::fit::Status;
use super::super::orders::too_short;
use super::{ProcessOptions, RANK_TOLERANCE};
use crate::error::Result;
use crate::limits::Limits;
use crate::linalg::{Block, Segmented, Triangle, dot, extent, solve};
use crate::record::{Record, Scale};

/// Moves of the input up to which a segment counts as a step test.
pub(super) const MOST_MOVES: usize = 6;

/// Share of the segment over which the input must be held at first.
const LEAST_REST: f64 = 0.015;

/// What is left of a segment's start when nothing is.
const FORGOTTEN: f64 = 1e-200;

/// Share of the output's travel that it may drift before the first move and still be at rest.
const DRIFT: f64 = 0.05;

/// The scaled data and the rows on which residuals count.
pub(super) struct Problem<'r, 'a> {
    pub(super) rec: &'r Record<'a>,
    pub(super) limits: &'r Limits,
    pub(super) offset: bool,
    pub(super) u: Vec<f64>,
    pub(super) y: Vec<f64>,
    pub(super) scale_u: Scale,
    pub(super) scale_y: Scale,
    pub(super) stretches: Vec<Stretch>,
    /// Delay cells allowed, in whole samples.
    pub(super) cells: RangeInclusive<usize>,
    /// Bounds of the delay, s.
    pub(super) bounds: (f64, f64),
}

/// A segment, and whether its plant was at rest before it.
pub(super) struct Stretch {
    pub(super) rows: Range<usize>,
    pub(super) at_rest: bool,
    /// Moves of the input.
    pub(super) moves: usize,
}

impl Stretch {
    /// First residual row when segments not at rest give `history` rows away.
    pub(super) fn first(&self, history: usize) -> usize {
        if self.at_rest { self.rows.start } else { (self.rows.start + history).min(self.rows.end) }
    }
}

fn moves(u: &[f64]) -> usize {
    u.windows(2).filter(|w| w[0] != w[1]).count()
}

/// Whether a segment looks like a step test that begins at rest: the input moves a few times only, and
/// before its first move the output has not gone anywhere.
fn starts_at_rest(u: &[f64], y: &[f64], rows: &Range<usize>) -> bool {
    let (u, y) = (&u[rows.clone()], &y[rows.clone()]);
    let held = u.iter().take_while(|&&x| x == u[0]).count();
    if moves(u) > MOST_MOVES || held == u.len() || (held as f64) < LEAST_REST * u.len() as f64 {
        return false;
    }
    let (low, high) = extent(y);
    (y[held - 1] - y[0]).abs() <= DRIFT * (high - low)
}

/// A point of the search: `L = m Ts + f`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) ln_T: f64,
    pub(super) m: usize,
    pub(super) f: f64,
    /// Rows of each segment that are history only.
    pub(super) history: usize,
    pub(super) cost: f64,
    pub(super) status: Status,
}

impl<'r, 'a> Problem<'r, 'a> {
    pub(super) fn new(rec: &'r Record<'a>, options: &ProcessOptions, limits: &'r Limits) -> Result<Self> {
        let scale_u = Scale::of(rec.u, options.offset);
        let y = rec.output_held(0);
        let scale_y = Scale::of(&y, options.offset);
        let span = rec.segments().map(|s| s.len()).max().unwrap_or(0);
        let default = (span as f64 / 4.0).min(200.0) * rec.Ts;
        let bounds = options.L.unwrap_or((0.0, default));
        let cell = |L: f64| (L / rec.Ts + 1e-9).floor() as usize;
        let stretches = rec
            .segments()
            .map(|rows| Stretch {
                at_rest: starts_at_rest(rec.u, &y, &rows),
                moves: moves(&rec.u[rows.clone()]),
                rows,
            })
            .collect();
        let problem = Problem {
            rec,
            stretches,
            limits,
            offset: options.offset,
            u: rec.u.iter().map(|&x| scale_u.apply(x)).collect(),
            y: y.iter().map(|&x| scale_y.apply(x)).collect(),
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
    pub(super) fn stretches(&self, history: usize) -> impl Iterator<Item = &Stretch> {
        self.stretches.iter().filter(move |s| s.rows.len() > history + 2)
    }

    /// Residual rows when each segment not at rest gives `history` rows away.
    pub(super) fn rows(&self, history: usize) -> usize {
        self.stretches(history)
            .flat_map(|s| s.first(history)..s.rows.end)
            .filter(|&k| self.rec.is_valid(k, 0))
            .count()
    }

    /// Number of columns shared by all segments: gain, and offset if estimated.
    pub(super) fn linear(&self) -> usize {
        1 + usize::from(self.offset)
    }

    /// Cost and linear parameters `[K, O]` with the initial states at a point.
    pub(super) fn evaluate(&self, point: &Point) -> Option<(f64, Linear)> {
        let mut problem = Segmented::new(1, self.linear());
        let shape = Shape::new(point, self.rec.Ts);
        for s in self.stretches(point.history) {
            problem.push(self.segment(s, point, &shape, None));
        }
        let columns: Vec<usize> = (0..self.linear()).collect();
        let solution = solve(problem.common(), &columns, self.linear(), RANK_TOLERANCE).ok()?;
        let x0 = problem.locals(&solution.theta);
        Some((solution.rss, Linear { theta: solution.theta, x0 }))
    }

    /// Whether the rows that count only because their segment is taken as at rest speak against it: their
    /// mean squared error is more than twice that of all rows.
    pub(super) fn contradicts_rest(&self, point: &Point) -> bool {
        let Some((cost, linear)) = self.evaluate(point) else { return false };
        let shape = Shape::new(point, self.rec.Ts);
        let offset = linear.theta.get(1).copied().unwrap_or(0.0);
        let (mut sum, mut count) = (0.0, 0);
        for s in self.stretches(point.history).filter(|s| s.at_rest) {
            let u = &self.u[s.rows.clone()];
            let mut state = ShapeState::at_rest(u[0]);
            for k in 0..point.history {
                if k > 0 {
                    state.advance(&shape, u[k.saturating_sub(point.m + 1)], u[k.saturating_sub(point.m + 2)]);
                }
                if self.rec.is_valid(s.rows.start + k, 0) {
                    sum += (self.y[s.rows.start + k] - linear.theta[0] * state.xi - offset).powi(2);
                    count += 1;
                }
            }
        }
        let exact = 1e-20 * dot(&self.y, &self.y);
        sum > exact && sum / count as f64 > 2.0 * cost / self.rows(point.history) as f64
    }

    /// Takes no segment as at rest.
    pub(super) fn without_rest(mut self) -> Self {
        self.stretches.iter_mut().for_each(|s| s.at_rest = false);
        self
    }

    /// Triangle of `[K, O | lnT, L | y]` over all segments at a point, initial states eliminated.
    pub(super) fn full(&self, point: &Point, linear: &Linear) -> Triangle {
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
        }
        triangle.absorb(&mut block);
        triangle
    }
}

pub(super) struct Linear {
    pub(super) theta: Vec<f64>,
    pub(super) x0: Vec<Vec<f64>>,
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
        if self.decay <= FORGOTTEN {
            (self.decay, self.decay_ln_T) = (0.0, 0.0); // numbers next to zero would cost much time
        }
    }
}
