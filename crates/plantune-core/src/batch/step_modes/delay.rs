//! When the response began: where the curve of the modes, followed back, meets the level at rest.
//!
//! ```text
//! y(t_step + L) = y_0,   dL = (dy_0 - dy)/y'    or, where it only touches,   y' = 0,   dL = -dy'/y''
//! ```
//!
//! The rows used begin after the delay, and their initial state is free: no parameter of the search is spent on it.
//! A response of two lags or more without zeros leaves its rest with slope 0. So a turn of the curve whose level is
//! that of the rest, within two deviations, is taken before a crossing.

use super::deviations::Candidate;
use super::sloped::Sloped;

/// Points looked at on either side of the first row.
const POINTS: usize = 100;

/// Deviations within which a turn lies on the level at rest.
const TOUCHES: f64 = 2.0;

/// The curve of the modes of the first piece at any time, in scaled units.
pub(super) struct Curve<'c> {
    candidate: &'c Candidate,
    shared: &'c [f64],
    A: Sloped,
}

/// The begin of the response, from the first row of the piece, and its gradient along the parameters and `y0`.
pub(super) struct Begin {
    pub(super) t: f64,
    pub(super) gradient: Vec<(usize, f64)>,
}

impl<'c> Curve<'c> {
    pub(super) fn new(candidate: &'c Candidate, shared: &'c [f64]) -> Self {
        Curve { candidate, shared, A: candidate.sections.matrix() }
    }

    /// `y(t)`, `y'(t)`, `y''(t)`, … as rows of `e^(A t)`, `A e^(A t)`, ….
    fn derivative(&self, t: f64, times: usize) -> Sloped {
        (0..times).fold(self.A.exponential(t), |phi, _| self.A.times(&phi))
    }

    /// The `times`-th derivative at `t`.
    fn at(&self, t: f64, times: usize) -> f64 {
        let row = self.derivative(t, times);
        let modes = row.part(0).iter().zip(&self.candidate.linear.c[0]).map(|(r, c)| r * c).sum::<f64>();
        modes + if times == 0 { self.level() } else { 0.0 }
    }

    /// Gradient of the `times`-th derivative along all parameters.
    fn gradient(&self, t: f64, times: usize) -> Vec<(usize, f64)> {
        let (c, k) = (self.candidate, self.candidate.order());
        let row = self.derivative(t, times);
        let along =
            |part: usize| row.part(part)[..k].iter().zip(&c.linear.c[0]).map(|(r, c)| r * c).sum::<f64>();
        let slopes = (0..k).map(|s| (s, along(1 + s)));
        let level =
            self.shared.iter().enumerate().map(|(i, x)| (c.shared() + i, if times == 0 { *x } else { 0.0 }));
        let states = (0..k).map(|j| (c.states(0) + j, row.part(0)[j]));
        slopes.chain(level).chain(states).collect()
    }

    /// The begin of the response, not before `earliest` (negative); `at_rest` is the place of `y0` in gradients
    /// and `sd` the deviation of a gradient.
    pub(super) fn begin(
        &self,
        y0: f64,
        earliest: f64,
        at_rest: usize,
        sd: impl Fn(&[(usize, f64)]) -> f64,
    ) -> Begin {
        let gap_gradient = |t: f64| [self.gradient(t, 0), vec![(at_rest, -1.0)]].concat();
        let crossing = self.crossing(y0, earliest);
        if let Some(t) = self.turn(crossing, earliest) {
            if (self.at(t, 0) - y0).abs() <= TOUCHES * sd(&gap_gradient(t)) {
                let bend = self.at(t, 2);
                return Begin { t, gradient: divided(self.gradient(t, 1), -bend) };
            }
        }
        Begin { t: crossing, gradient: divided(gap_gradient(crossing), -self.at(crossing, 1)) }
    }

    /// The last crossing of `y0`, looked for from some time after the first row back; the nearest point without one.
    fn crossing(&self, y0: f64, earliest: f64) -> f64 {
        let side = (self.level() - y0).signum();
        let gap = |t: f64| (self.at(t, 0) - y0) * side;
        let time = |i: usize| earliest * (i as f64 / POINTS as f64 - 1.0);
        match (1..=2 * POINTS).find(|&i| gap(time(i)) <= 0.0) {
            Some(i) => bisected(time(i - 1), time(i), |t| gap(t) > 0.0),
            None => {
                let nearest = (0..=2 * POINTS).min_by(|&i, &j| gap(time(i)).total_cmp(&gap(time(j))));
                time(nearest.unwrap_or(POINTS))
            }
        }
    }

    /// The turn of the curve before `from`.
    fn turn(&self, from: f64, earliest: f64) -> Option<f64> {
        let time = |i: usize| from + (earliest - from) * i as f64 / POINTS as f64;
        let side = self.at(from, 1).signum();
        let i = (1..=POINTS).find(|&i| self.at(time(i), 1) * side <= 0.0)?;
        Some(bisected(time(i - 1), time(i), |t| self.at(t, 1) * side > 0.0))
    }

    fn level(&self) -> f64 {
        self.shared.iter().zip(&self.candidate.linear.beta).map(|(x, b)| x * b).sum()
    }
}

/// The end of `inside`, which holds at `a` and not at `b`.
fn bisected(mut a: f64, mut b: f64, inside: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..50 {
        let middle = (a + b) / 2.0;
        if inside(middle) { a = middle } else { b = middle }
    }
    b
}

fn divided(gradient: Vec<(usize, f64)>, by: f64) -> Vec<(usize, f64)> {
    gradient.into_iter().map(|(i, g)| (i, g / by)).collect()
}
