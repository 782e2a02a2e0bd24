//! The dead time: a map of starts, steps of half a sample, then the best place between two of them.

use super::data::{Data, Point};

/// Rounds on the grid, between its points, and at the end.
const ROUNDS: (usize, usize, usize) = (12, 8, 60);

/// Time constants of the map, and the most delays.
const TIMES: usize = 10;
const DELAYS: usize = 100;

/// Steps without a gain after which a walk ends.
const PATIENCE: usize = 4;

/// Rounds of golden section: a millionth of a sample.
const SECTIONS: usize = 26;

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
        let places = sides.map(|side| self.section(&coarse, side, history)).chain([coarse.L]);
        let point = |L: f64| self.at_delay(L, &coarse.a, ROUNDS.2, history);
        let best = places.filter_map(point).min_by(|a, b| a.rss.total_cmp(&b.rss))?;
        Some((best, history))
    }

    /// Up to three places of a map over time constants and delays, with a denominator each.
    fn starts(&self, bounds: (f64, f64), history: usize) -> Vec<(f64, Vec<f64>)> {
        let longest = self.stretches.iter().map(|(_, run)| run.len()).max().unwrap_or(2) as f64 / 3.0;
        let stride = ((bounds.1 - bounds.0) / DELAYS as f64).max(1.0);
        let count = ((bounds.1 - bounds.0) / stride) as usize;
        let mut map = Vec::new();
        for i in 0..TIMES {
            let T = longest.max(2.0).powf(i as f64 / (TIMES - 1) as f64);
            let a = start(T, self.n);
            for L in (0..=count).map(|j| bounds.0 + stride * j as f64) {
                if let Some((_, rss)) = self.simulated(&a, L, history) {
                    map.push((rss, T, L));
                }
            }
        }
        map.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut starts: Vec<(f64, f64)> = Vec::new();
        for (_, T, L) in map {
            let far = |&(other, at): &(f64, f64)| {
                (L - at).abs() > (0.5 * T).max(2.0) || T / other > 4.0 || other / T > 4.0
            };
            if starts.len() < 3 && starts.iter().all(far) {
                starts.push((T, L));
            }
        }
        starts.into_iter().map(|(T, L)| (L, start(T, self.n))).collect()
    }

    /// Steps of half a sample to either side while they lower the loss.
    fn walk(&self, L: f64, a: Vec<f64>, bounds: (f64, f64), history: usize) -> Option<Point> {
        let mut best = self.at_delay(L, &a, ROUNDS.0, history)?;
        for step in [0.5, -0.5] {
            let (mut L, mut failed) = (best.L, 0);
            while failed < PATIENCE {
                L += step;
                if L < bounds.0 - 1e-9 || L > bounds.1 + 1e-9 {
                    break;
                }
                match self.at_delay(L, &best.a, ROUNDS.0, history) {
                    Some(point) if point.rss < best.rss => (best, failed) = (point, 0),
                    _ => failed += 1,
                }
            }
        }
        Some(best)
    }

    /// The delay of the least loss between two, by golden section.
    fn section(&self, near: &Point, (mut low, mut high): (f64, f64), history: usize) -> f64 {
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        let loss = |L: f64| self.at_delay(L, &near.a, ROUNDS.1, history).map_or(f64::INFINITY, |p| p.rss);
        let (mut left, mut right) = (high - golden * (high - low), low + golden * (high - low));
        let (mut at_left, mut at_right) = (loss(left), loss(right));
        for _ in 0..SECTIONS {
            if at_left < at_right {
                (high, right, at_right) = (right, left, at_left);
                left = high - golden * (high - low);
                at_left = loss(left);
            } else {
                (low, left, at_left) = (left, right, at_right);
                right = low + golden * (high - low);
                at_right = loss(right);
            }
        }
        0.5 * (low + high)
    }
}

/// `prod (APART_i s / T)^-1`: poles apart, the slowest time constant `T`.
fn start(T: f64, n: usize) -> Vec<f64> {
    let factors = (0..n).map(|i| [1.0, T / APART[i % APART.len()]]);
    let A = factors.fold(vec![1.0], |A, factor| crate::poly::product(&A, &factor));
    A[1..].to_vec()
}
