//! The dead time: a map of starts, steps of half a sample, then the best place between two of them.
//!
//! The map is the correlation of y with the filtered input, which a whole delay only shifts. Between two
//! places the delay follows the step of Gauss and Newton, `a` and `b` the rounds at each delay.

use super::data::{Data, Point, Rounds};
use super::filter::Filter;
use crate::linalg::dot;

/// On the grid, between its points, and at the end.
const ON_GRID: Rounds = Rounds { most: 6, rest: 1e-3 };
const BETWEEN: Rounds = Rounds { most: 6, rest: 1e-6 };
const AT_END: Rounds = Rounds { most: 60, rest: 1e-9 };

/// Time constants of the map, and the most delays.
const TIMES: usize = 10;
const DELAYS: usize = 100;

/// Places of the map whose true loss is looked at, and starts.
const TRIED: usize = 12;
const STARTS: usize = 3;

/// Steps without a gain after which a walk ends.
const PATIENCE: usize = 4;

/// Most steps between two points of the grid, and the length in samples at which they end.
const STEPS: usize = 20;
const STILL: f64 = 1e-7;

/// Poles of a start lie apart, times a time constant.
const APART: [f64; 4] = [1.0, 1.7, 2.9, 4.9];

impl Data {
    /// The best model with a delay within the bounds, samples, and the rows of history that it leaves.
    pub(super) fn best(&self, bounds: (f64, f64)) -> Option<(Point, usize)> {
        let history = bounds.1.ceil() as usize + 1;
        let walks = self.starts(bounds, history);
        let walks = walks.into_iter().filter_map(|(L, a)| self.walk(L, a, bounds, history));
        let coarse = walks.min_by(|a, b| a.rss.total_cmp(&b.rss))?;
        let (low, high) = ((coarse.L - 0.5).max(bounds.0), (coarse.L + 0.5).min(bounds.1));
        let history = high.ceil() as usize + 1;
        // The loss has a kink at whole samples: on either side a search of its own.
        let kink = coarse.L.round().clamp(low, high);
        let sides = [(low, kink), (kink, high)].into_iter().filter(|(low, high)| high > low);
        let ends = sides.filter_map(|side| self.between(&coarse, side, history));
        let here = self.at_delay(coarse.L, &coarse.a, BETWEEN, history);
        let best = ends.chain(here).min_by(|a, b| a.rss.total_cmp(&b.rss))?;
        Some((self.at_delay(best.L, &best.a, AT_END, history)?, history))
    }

    /// The best places of a map over time constants and delays, with a denominator each.
    fn starts(&self, bounds: (f64, f64), history: usize) -> Vec<(f64, Vec<f64>)> {
        let mut map = self.map(bounds, history);
        map.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut places: Vec<(f64, f64)> = Vec::new();
        for (_, T, L) in map {
            let far = |&(other, at): &(f64, f64)| {
                (L - at).abs() > (0.5 * T).max(2.0) || T / other > 4.0 || other / T > 4.0
            };
            if places.len() < TRIED && places.iter().all(far) {
                places.push((T, L));
            }
        }
        let tried = places.into_iter().filter_map(|(T, L)| {
            let a = start(T, self.n);
            self.simulated(&a, L, history).map(|(_, rss)| (rss, L, a))
        });
        let mut tried: Vec<(f64, f64, Vec<f64>)> = tried.collect();
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        tried.into_iter().take(STARTS).map(|(_, L, a)| (L, a)).collect()
    }

    /// Squared correlation, time constant and delay of each place.
    fn map(&self, bounds: (f64, f64), history: usize) -> Vec<(f64, f64, f64)> {
        let longest = self.stretches.iter().map(|(_, run)| run.len()).max().unwrap_or(2) as f64 / 3.0;
        let (first, last) = (bounds.0.round() as usize, bounds.1.round() as usize);
        let stride = ((last - first) / DELAYS).max(1);
        let mut map = Vec::new();
        for i in 0..TIMES {
            let T = longest.max(2.0).powf(i as f64 / (TIMES - 1) as f64);
            let Some(w) = self.undelayed(&start(T, self.n)) else { continue };
            for m in (first..=last).step_by(stride) {
                let r2 = self.correlation(&w, m, history);
                map.push((r2, T, (m as f64).clamp(bounds.0, bounds.1)));
            }
        }
        map
    }

    /// The filtered input without delay, one signal per stretch.
    fn undelayed(&self, a: &[f64]) -> Option<Vec<Vec<f64>>> {
        let filter = Filter::new(a)?;
        let one = |(segment, _): &(std::ops::Range<usize>, _)| {
            filter.late(&self.u[segment.clone()], 0.0).into_iter().step_by(self.n + 1).collect()
        };
        Some(self.stretches.iter().map(one).collect())
    }

    /// Squared correlation of `y(t)` and `w(t - m)`, means removed.
    fn correlation(&self, w: &[Vec<f64>], m: usize, history: usize) -> f64 {
        let (mut n, mut sw, mut sy, mut sww, mut syy, mut swy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (stretch, w) in self.stretches.iter().zip(w) {
            let (rows, from) = (self.used(stretch, history), stretch.0.start + m);
            if rows.is_empty() {
                continue;
            }
            let (y, w) = (&self.y[rows.clone()], &w[rows.start - from..rows.end - from]);
            n += y.len() as f64;
            (sw, sy) = (sw + w.iter().sum::<f64>(), sy + y.iter().sum::<f64>());
            (sww, syy, swy) = (sww + dot(w, w), syy + dot(y, y), swy + dot(w, y));
        }
        let (vw, vy, c) = (sww - sw * sw / n, syy - sy * sy / n, swy - sw * sy / n);
        if vw > 0.0 && vy > 0.0 { c * c / (vw * vy) } else { 0.0 }
    }

    /// Steps of half a sample to either side while they lower the loss.
    fn walk(&self, L: f64, a: Vec<f64>, bounds: (f64, f64), history: usize) -> Option<Point> {
        let mut best = self.at_delay(L, &a, ON_GRID, history)?;
        for step in [0.5, -0.5] {
            let (mut L, mut failed) = (best.L, 0);
            while failed < PATIENCE {
                L += step;
                if L < bounds.0 - 1e-9 || L > bounds.1 + 1e-9 {
                    break;
                }
                match self.at_delay(L, &best.a, ON_GRID, history) {
                    Some(point) if point.rss < best.rss => (best, failed) = (point, 0),
                    _ => failed += 1,
                }
            }
        }
        Some(best)
    }

    /// The least loss with a delay between two.
    fn between(&self, near: &Point, (low, high): (f64, f64), history: usize) -> Option<Point> {
        let mut best = self.at_delay(0.5 * (low + high), &near.a, BETWEEN, history)?;
        for _ in 0..STEPS {
            let all = self.information(&best, history)?.theta;
            let mut step = (best.L + all[all.len() - 1]).clamp(low, high) - best.L;
            let lower = loop {
                if step.abs() < STILL {
                    return Some(best);
                }
                match self.at_delay(best.L + step, &best.a, BETWEEN, history) {
                    Some(point) if point.rss < best.rss => break point,
                    _ => step *= 0.25,
                }
            };
            best = lower;
        }
        Some(best)
    }
}

/// `prod (APART_i s / T)^-1`: poles apart, the slowest time constant `T`.
fn start(T: f64, n: usize) -> Vec<f64> {
    let factors = (0..n).map(|i| [1.0, T / APART[i % APART.len()]]);
    let A = factors.fold(vec![1.0], |A, factor| crate::poly::product(&A, &factor));
    A[1..].to_vec()
}
