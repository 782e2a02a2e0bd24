//! Where to begin: a map of correlations over time constants and delays.

use std::ops::Range;

use super::problem::Problem;
use crate::linalg::dot;

impl Problem<'_, '_> {
    /// The best places of the correlation between y and the filtered, shifted input, over a grid of
    /// time constants: at most three, in different delay cells.
    pub(super) fn starts(&self) -> Vec<(f64, usize)> {
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
