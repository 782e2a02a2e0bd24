//! Intervals from the profile of the sum of squares, for parameters at which the cost has kinks.
//!
//! ```text
//! RSS(L) < RSS (1 + 1.1 F / (N - n)),   F the 95 % quantile of F(1, N - n),   RSS(L) the least over all others
//! ```
//!
//! Where a delay is a whole number of samples a row of y comes under a move of u or leaves it. The delta rule
//! sees the side on which it stands and covers 89 % for 95 % in the worst place; so it does for a time constant
//! that trades with such a delay. The factor 1.1 is measured, not derived: without it 92 to 94 % are covered.
//! METHODS 2.4.

use super::super::fit::WIDTH;
use super::problem::{Point, Problem};
use super::search::Stop;
use crate::linalg::dot;
use crate::stats::f_tail;

/// Factor of the quantile.
const WIDER: f64 = 1.1;

/// Height from which one more secant, not tried, ends within half a hundredth of the width.
const NEAR: f64 = 0.05;

/// Most heights tried for an end.
const MOST_TRIES: usize = 12;

/// A 95 % interval of one coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Problem<'_, '_> {
    /// Interval of coordinate `j` around the best point, `sd` its standard deviation by the delta rule.
    pub(super) fn profile(&self, best: &Point, j: usize, sd: f64, freedom: usize) -> Option<Interval> {
        let exact = best.cost <= 1e-20 * dot(&self.y, &self.y);
        if exact || !(sd > 0.0 && sd.is_finite()) {
            return None;
        }
        let best = self.with_room(best, j, sd)?;
        let rise = best.cost * WIDER * f_limit(0.05, freedom as f64) / freedom as f64;
        let end = |sign: f64| self.end(&best, j, sign * WIDTH * sd, rise);
        Some(Interval { low: end(-1.0), high: end(1.0) })
    }

    /// The best point where longer delays leave the same rows.
    fn with_room(&self, best: &Point, j: usize, sd: f64) -> Option<Point> {
        let delays = (0..self.codes.len()).filter_map(|i| self.place_of_L(i));
        let longest = delays.map(|k| best.x[k] + if k == j { 4.0 * sd } else { 0.0 }).fold(0.0, f64::max);
        let history = best.history.max((longest.ceil() as usize).min(*self.cells().end()) + 1);
        if history == best.history {
            return Some(best.clone());
        }
        self.descend(Point { history, ..best.clone() }, Stop::AtMinimum, None)
    }

    /// Where the profile has risen by `rise`, from a first guess of the distance; by secants in its root, which
    /// is nearly a straight line.
    fn end(&self, best: &Point, j: usize, guess: f64, rise: f64) -> f64 {
        let (low, high) = self.range(best, j);
        let (mut inside, mut outside) = ((0.0, 0.0), None::<(f64, f64)>);
        let (mut distance, mut from) = (guess, best.clone());
        for _ in 0..MOST_TRIES {
            let value = (best.x[j] + distance).clamp(low, high);
            distance = value - best.x[j];
            // The profile's root, 1 at the end.
            let height = self
                .least(&mut from, j, value, 1e-3 * rise / best.cost)
                .map_or(1e3, |cost| ((cost - best.cost).max(0.0) / rise).sqrt());
            if height < 1.0 && (value <= low || value >= high) {
                return value;
            }
            if height < 1.0 {
                inside = (distance, height)
            } else {
                outside = Some((distance, height))
            }
            distance = match outside {
                Some((far, height)) => {
                    inside.0 + (far - inside.0) * ((1.0 - inside.1) / (height - inside.1)).clamp(0.05, 1.0)
                }
                None if inside.1 > 0.0 => inside.0 / inside.1.max(0.3),
                None => 3.0 * inside.0,
            };
            if (height - 1.0).abs() < NEAR {
                break;
            }
        }
        (best.x[j] + distance).clamp(low, high)
    }

    /// Least cost with coordinate `j` held.
    fn least(&self, from: &mut Point, j: usize, value: f64, share: f64) -> Option<f64> {
        let mut point = from.clone();
        point.x[j] = value;
        for (i, m) in self.cells_of(&point.x).into_iter().enumerate() {
            if self.place_of_L(i) == Some(j) {
                point.m[i] = m.min(point.history - 1);
            }
        }
        let least = self.held(point, j, Stop::Within(share))?;
        *from = least.clone();
        Some(least.cost)
    }

    /// Downhill with coordinate `j` held, other delays from cell to cell.
    fn held(&self, point: Point, j: usize, stop: Stop) -> Option<Point> {
        let mut best = self.descend(point, stop, Some(j))?;
        for i in (0..self.codes.len()).filter(|&i| self.kinked(i) && !self.codes[i].jumps()) {
            let Some(k) = self.place_of_L(i).filter(|&k| k != j) else { continue };
            for _ in 0..8 {
                let m = best.m[i];
                let f = best.x[k] - m as f64;
                let other = match f {
                    ..=0.0 if m > *self.cells().start() => m - 1,
                    1.0.. if m + 2 < best.history => m + 1,
                    _ => break,
                };
                let mut next = best.clone();
                next.m[i] = other;
                match self.descend(next, stop, Some(j)) {
                    Some(next) if next.cost < best.cost * (1.0 - 1e-12) => best = next,
                    _ => break,
                }
            }
        }
        Some(best)
    }

    /// Where coordinate `j` may lie.
    fn range(&self, best: &Point, j: usize) -> (f64, f64) {
        let is_delay = (0..self.codes.len()).any(|i| self.place_of_L(i) == Some(j));
        if is_delay {
            (self.bounds.0, self.bounds.1.min(best.history as f64))
        } else {
            (best.x[j] - 20.0, best.x[j] + 20.0)
        }
    }
}

/// What `F(1, freedom)` exceeds with probability `p`.
fn f_limit(p: f64, freedom: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1e4);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f_tail(middle, 1.0, freedom) > p { low = middle } else { high = middle }
    }
    high
}
