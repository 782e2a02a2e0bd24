//! Downhill in `ln T`, `ln zeta` and `L`, one delay sample at a time where the cost has kinks.

use super::super::fit::Status;
use super::problem::{Linear, Point, Problem};
use crate::linalg::{Triangle, dot, solve_damped};

/// Where a descent may end.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Stop {
    /// As soon as downhill leads out of a cell.
    AtBound,
    /// At the least cost inside the cells.
    AtMinimum,
    /// Where the cost is within this share of it.
    Within(f64),
}

/// Cosine between the residual and the Jacobian at a minimum.
const SLOPE: f64 = 1e-9;

/// Longest step of a logarithm.
const MOST_LN: f64 = 2.0;

impl Stop {
    /// Cosine between the residual and the Jacobian that is small enough.
    fn slope(self) -> f64 {
        match self {
            Stop::Within(share) => share.sqrt(),
            _ => SLOPE,
        }
    }
}

impl Problem<'_, '_> {
    /// The best minimum found from any start.
    pub(super) fn minimum(&self) -> Option<Point> {
        let starts = self.starts().into_iter().chain(self.smaller_starts());
        let minima: Vec<Point> = starts.filter_map(|x| self.search(x)).collect();
        let best = self.best(&minima)?;
        // On its way down in delay a search gives away rows that its end does not need.
        let again = self.search(best.x.clone());
        again.or(Some(best))
    }

    /// The best of several minima, judged on the rows that all of them leave.
    pub(super) fn best(&self, points: &[Point]) -> Option<Point> {
        let history = points.iter().map(|p| p.history).max()?;
        let cost = |p: &Point| {
            self.evaluate(&Point { history, ..p.clone() }).map_or(f64::INFINITY, |(cost, _)| cost)
        };
        points.iter().map(|p| (cost(p), p)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, p)| p.clone())
    }

    /// From cell to cell downhill, until the minimum lies inside the cells or at kinks.
    pub(super) fn search(&self, x: Vec<f64>) -> Option<Point> {
        let m = self.cells_of(&x);
        let history = self.room(&m);
        let start = Point { x, m, history, cost: f64::NAN, status: Status::NotConverged };
        let mut best = self.descend(start, Stop::AtBound, None)?;
        while let Some(next) = self.beyond(&best) {
            best = next;
        }
        self.descend(best, Stop::AtMinimum, None)
    }

    /// A lower point on the other side of a bound on which a delay lies.
    fn beyond(&self, best: &Point) -> Option<Point> {
        let delays = (0..self.codes.len()).filter(|&i| self.codes[i].delay);
        delays.flat_map(|i| [(i, false), (i, true)]).find_map(|(i, up)| self.across(best, i, up))
    }

    /// The same for one delay, upwards or downwards.
    fn across(&self, best: &Point, i: usize, up: bool) -> Option<Point> {
        let (L, m) = (best.x[self.place_of_L(i)?], best.m[i]);
        let f = L - m as f64;
        let mut cells = best.m.clone();
        match self.codes[i] {
            code if self.kinked(i) => {
                // An output that jumps tells its delay to the sample: every point is at a bound.
                let leaves = code.jumps() || if up { f >= 1.0 } else { f <= 0.0 };
                let room = if up { m < *self.cells().end() } else { m > *self.cells().start() };
                if !(leaves && room) {
                    return None;
                }
                cells[i] = if up { m + 1 } else { m - 1 };
            }
            _ if L < best.history as f64 - 1.0 || best.history > *self.cells().end() => return None,
            _ => {}
        }
        // Costs compare between cells as long as both leave the same rows.
        let history = if cells[i] + 1 >= best.history { self.room(&cells) } else { best.history };
        let point = Point { m: cells, history, ..best.clone() };
        let next = self.descend(point, Stop::AtBound, None)?;
        (history != best.history || next.cost < best.cost * (1.0 - 1e-12)).then_some(next)
    }

    /// The cell of each delay.
    pub(super) fn cells_of(&self, x: &[f64]) -> Vec<usize> {
        let cell =
            |i: usize| self.place_of_L(i).map_or(0, |j| (x[j].floor() as usize).min(*self.cells().end()));
        (0..self.codes.len()).map(cell).collect()
    }

    /// Rows given away so that the delays have room to grow.
    fn room(&self, m: &[usize]) -> usize {
        let most = m.iter().max().copied().unwrap_or(0);
        let smooth = (0..self.codes.len()).any(|i| self.codes[i].delay && !self.kinked(i));
        let further = if smooth { 5 + most / 4 } else { 2 };
        (most + further).min(*self.cells().end()) + 1
    }

    /// Bounds of the coordinates, the delays within their cells where the cost has kinks.
    fn bounds_at(&self, point: &Point) -> Vec<(f64, f64)> {
        let mut bounds = vec![(f64::NEG_INFINITY, f64::INFINITY); point.x.len()];
        for (i, code) in self.codes.iter().enumerate() {
            let own = self.own(i);
            bounds[own.clone()].fill((0.02f64.ln(), (100.0 * self.y.len() as f64).ln()));
            if code.pair {
                bounds[own.start + code.times()] = (1e-3f64.ln(), 1e2f64.ln());
            }
            if let Some(j) = self.place_of_L(i) {
                let cell = point.m[i] as f64;
                bounds[j] = match code {
                    _ if code.jumps() => (cell, cell),
                    _ if self.kinked(i) => (cell.max(self.bounds.0), (cell + 1.0).min(self.bounds.1)),
                    _ => (self.bounds.0, self.bounds.1.min(point.history as f64 - 1.0)),
                };
                bounds[j].1 = bounds[j].1.max(bounds[j].0);
            }
        }
        bounds
    }

    /// A point within bounds, delays without kinks in the cells where they lie.
    fn settled(&self, mut point: Point, bounds: &[(f64, f64)], held: Option<usize>) -> Point {
        for (j, (x, (low, high))) in point.x.iter_mut().zip(bounds).enumerate() {
            if held != Some(j) {
                *x = x.clamp(*low, *high);
            }
        }
        for (i, m) in self.cells_of(&point.x).into_iter().enumerate() {
            if !self.kinked(i) {
                point.m[i] = m;
            }
        }
        point
    }

    /// Levenberg-Marquardt within bounds, coordinate `held` fixed.
    pub(super) fn descend(&self, start: Point, stop: Stop, held: Option<usize>) -> Option<Point> {
        let bounds = self.bounds_at(&start);
        let mut point = self.settled(start, &bounds, held);
        let (mut cost, mut linear) = self.evaluate(&point)?;
        // An integrator sums the rounding of all rows.
        let exact = if self.drifts() { 1e-22 } else { 1e-26 } * dot(&self.y, &self.y);
        let mut damping = 1e-3;
        point.status = Status::NotConverged;
        for _ in 0..60 {
            let slopes = self.projected(&point, &linear)?;
            let local = Local { slopes, x: &point.x, bounds: &bounds, held };
            let (free, slope) = (local.free(), local.slope(cost));
            if cost <= exact || slope < stop.slope() {
                point.status = Status::Converged;
                break;
            }
            if stop == Stop::AtBound && self.leaves(&local) {
                break;
            }
            let trial = (0..12).find_map(|_| {
                let step = local.step(&free, damping);
                let x = point.x.iter().zip(&step).map(|(x, d)| x + d).collect();
                let trial = self.settled(Point { x, ..point.clone() }, &bounds, held);
                match self.evaluate(&trial) {
                    Some((lower, linear)) if lower < cost => Some((trial, lower, linear)),
                    _ => {
                        damping *= 10.0;
                        None
                    }
                }
            });
            let Some(accepted) = trial else {
                // No representable step lowers the cost: a minimum to rounding, if the slope agrees.
                if slope < 1e-5 {
                    point.status = Status::Converged;
                }
                break;
            };
            let gained = cost - accepted.1;
            (point, cost, linear) = accepted;
            if matches!(stop, Stop::Within(share) if damping < 0.1 && gained < 10.0 * share * cost) {
                break; // steps of Gauss and Newton gain far less each time
            }
            damping = (damping * 0.1).max(1e-12);
        }
        Some(Point { cost, ..point })
    }

    /// Whether downhill leads out of a delay's cell.
    fn leaves(&self, local: &Local<'_>) -> bool {
        (0..self.codes.len()).filter_map(|i| self.place_of_L(i)).any(|j| local.leaves(j))
    }

    /// The triangle `[ln T …, ln zeta, L, …, c, d | y]`, linear parameters projected out (Kaufman 1975).
    fn projected(&self, point: &Point, linear: &Linear) -> Option<Triangle> {
        Some(self.full(point, linear)?.below(self.linear()))
    }
}

/// The projected problem at a point.
struct Local<'p> {
    slopes: Triangle,
    x: &'p [f64],
    bounds: &'p [(f64, f64)],
    held: Option<usize>,
}

impl Local<'_> {
    fn n(&self) -> usize {
        self.x.len()
    }

    /// Half the slope of the cost downhill.
    fn downhill(&self, j: usize) -> f64 {
        (0..=j).map(|i| self.slopes.at(i, j) * self.slopes.at(i, self.n())).sum()
    }

    /// Whether a coordinate is at a bound and downhill lies beyond.
    fn leaves(&self, j: usize) -> bool {
        let ((low, high), downhill) = (self.bounds[j], self.downhill(j));
        (self.x[j] <= low && downhill <= 0.0) || (self.x[j] >= high && downhill >= 0.0)
    }

    /// Coordinates that may move.
    fn free(&self) -> Vec<usize> {
        (0..self.n()).filter(|&j| self.held != Some(j) && !self.leaves(j)).collect()
    }

    /// Largest cosine between the residual and a free column of the Jacobian.
    fn slope(&self, cost: f64) -> f64 {
        let size = cost.sqrt().max(f64::MIN_POSITIVE);
        let length = |j: usize| (0..=j).map(|i| self.slopes.at(i, j).powi(2)).sum::<f64>().sqrt();
        let cosine = |j: usize| (self.downhill(j) / (length(j).max(f64::MIN_POSITIVE) * size)).abs();
        self.free().into_iter().map(cosine).fold(0.0, f64::max)
    }

    /// Damped step; a coordinate at a bound stays where the step would leave it.
    fn step(&self, free: &[usize], damping: f64) -> Vec<f64> {
        let outward = |j: usize, d: f64| {
            (self.x[j] <= self.bounds[j].0 && d < 0.0) || (self.x[j] >= self.bounds[j].1 && d > 0.0)
        };
        let mut free = free.to_vec();
        loop {
            let moved = solve_damped(&self.slopes, &free, self.n(), damping);
            let stuck: Vec<usize> =
                free.iter().zip(&moved).filter(|(j, d)| outward(**j, **d)).map(|(j, _)| *j).collect();
            if stuck.is_empty() {
                let mut step = vec![0.0; self.n()];
                free.iter().zip(&moved).for_each(|(&j, d)| step[j] = d.clamp(-self.most(j), self.most(j)));
                return step;
            }
            free.retain(|j| !stuck.contains(j));
        }
    }

    /// Longest step: of a logarithm where there is a finite bound below zero, else none.
    fn most(&self, j: usize) -> f64 {
        if self.bounds[j].0 < 0.0 && self.bounds[j].0.is_finite() { MOST_LN } else { f64::INFINITY }
    }
}
