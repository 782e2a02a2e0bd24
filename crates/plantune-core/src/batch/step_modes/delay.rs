//! When the response began: where the curve of the modes, followed back, meets the level at rest.
//!
//! ```text
//! y(t_step + L) = y_0,   dL = (dy_0 - dy)/y'    or, where it only touches,   y' = 0,   dL = -dy'/y''
//! ```
//!
//! The rows used begin after the delay, and their initial state is free: no parameter of the search is spent on it.

use super::deviations::Candidate;

/// Points between the first row and the step.
const POINTS: usize = 200;

/// The curve of the modes of the first piece at any time, with its gradient along the parameters.
pub(super) struct Curve<'c> {
    candidate: &'c Candidate,
    shared: &'c [f64],
}

impl<'c> Curve<'c> {
    pub(super) fn new(candidate: &'c Candidate, shared: &'c [f64]) -> Self {
        Curve { candidate, shared }
    }

    fn level(&self) -> f64 {
        self.shared.iter().zip(&self.candidate.linear.beta).map(|(x, b)| x * b).sum()
    }

    /// Value and slope in time, `t` from the first row of the piece.
    fn at(&self, t: f64) -> (f64, f64) {
        let (k, mut A) = (self.candidate.order(), self.candidate.sections.matrix());
        let phi = A.exponential(t);
        let c = &self.candidate.linear.c[0];
        let row = &phi.part(0)[..k];
        let value = row.iter().zip(c).map(|(r, c)| r * c).sum::<f64>();
        let a = A.value();
        let slope = (0..k).map(|i| row[i] * (0..k).map(|j| a[i * k + j] * c[j]).sum::<f64>()).sum();
        (self.level() + value, slope)
    }

    /// Gradient of the value along all parameters.
    pub(super) fn gradient(&self, t: f64) -> Vec<(usize, f64)> {
        let k = self.candidate.order();
        let phi = self.candidate.sections.matrix().exponential(t);
        let c = &self.candidate.linear.c[0];
        let along = |part: usize| phi.part(part)[..k].iter().zip(c).map(|(r, c)| r * c).sum::<f64>();
        let slopes = (0..k).map(|s| (s, along(1 + s)));
        let level = self.shared.iter().enumerate().map(|(i, x)| (self.candidate.shared() + i, *x));
        let states = (0..k).map(|j| (self.candidate.states(0) + j, phi.part(0)[j]));
        slopes.chain(level).chain(states).collect()
    }

    /// The last time before the first row, and not before `earliest`, at which the curve is nearest to `y0`,
    /// and its slope there.
    pub(super) fn meets(&self, y0: f64, earliest: f64) -> (f64, f64) {
        let gap = |t: f64| self.at(t).0 - y0;
        let time = |i: usize| earliest * i as f64 / POINTS as f64;
        let side = gap(0.0).signum();
        if let Some(i) = (1..=POINTS).find(|&i| gap(time(i)) * side <= 0.0) {
            let (mut inside, mut beyond) = (time(i - 1), time(i));
            for _ in 0..60 {
                let middle = (inside + beyond) / 2.0;
                if gap(middle) * side > 0.0 { inside = middle } else { beyond = middle }
            }
            return (beyond, self.at(beyond).1);
        }
        let nearest = (0..=POINTS).min_by(|&i, &j| gap(time(i)).abs().total_cmp(&gap(time(j)).abs()));
        let t = time(nearest.unwrap_or(POINTS));
        (t, self.at(t).1)
    }
}
