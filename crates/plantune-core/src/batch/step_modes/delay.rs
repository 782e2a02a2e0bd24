//! When the response began: where the curve of the modes, followed back, is at rest.
//!
//! ```text
//! y(t) = y_0, y'(t) = 0, …, y^(m-1)(t) = 0   at t = t_step + L,   a plant with k - m zeros
//! L = min over t of r' S^-1 r,   r = [y - y_0, y', …],   S its covariance
//! ```
//!
//! The rows used begin after the delay, and their initial state is free: no parameter of the search is spent on it.
//! The most conditions that hold together, by a chi-squared test of 99 % with `m - 1` degrees of freedom, say how
//! many zeros there are. A response that leaves its rest slowly is so not taken for one with a zero.

use super::deviations::Candidate;
use super::sloped::Sloped;

/// Points looked at on either side of the first row.
const POINTS: usize = 100;

/// The same where every point costs a covariance.
const COARSE: usize = 40;

/// 99 % of chi squared with 0, 1, 2, … degrees of freedom.
const CHI2: [f64; 6] = [6.63, 6.63, 9.21, 11.34, 13.28, 15.09];

/// Deviations by which the best time may lie before the step.
const BEFORE: f64 = 3.0;

/// Share of the response that is rounding.
const ROUNDING: f64 = 1e-9;

/// A gradient along the parameters.
pub(super) type Gradient = Vec<(usize, f64)>;

/// The curve of the modes of the first piece at any time, in scaled units.
pub(super) struct Curve<'c> {
    candidate: &'c Candidate,
    shared: &'c [f64],
    A: Sloped,
    /// Unit of derivatives, 1/s.
    rate: f64,
    y0: f64,
    /// Place of `y0` in gradients.
    at_rest: usize,
}

/// The begin of the response, from the first row of the piece.
pub(super) struct Begin {
    pub(super) t: f64,
    /// Along the parameters and `y0`.
    pub(super) gradient: Gradient,
    /// Conditions that hold there: the excess of poles over zeros.
    pub(super) conditions: usize,
}

/// The conditions at one time: `r` and one derivative more, and their gradients.
struct Rest {
    r: Vec<f64>,              // (k + 1)
    gradients: Vec<Gradient>, // (k)
}

/// `r`, its slope in time and the weights of `dr` in `dL`, after `m` conditions are made white.
struct Whitened {
    distance: f64,
    step: f64,
    /// Deviation of the time.
    sd: f64,
    weights: Vec<f64>, // (m)
}

impl<'c> Curve<'c> {
    pub(super) fn new(candidate: &'c Candidate, shared: &'c [f64], y0: f64, at_rest: usize) -> Self {
        let k = candidate.order();
        let rate = candidate.sections.poles().iter().map(|p| p.norm()).product::<f64>().powf(1.0 / k as f64);
        Curve { candidate, shared, A: candidate.sections.matrix(), rate, y0, at_rest }
    }

    /// The begin, not before `earliest` (negative); `entry` is the covariance of two parameters.
    pub(super) fn begin(&self, earliest: f64, entry: impl Fn(usize, usize) -> f64) -> Begin {
        let k = self.candidate.order();
        let grid: Vec<(f64, Rest)> = (0..=COARSE)
            .map(|i| earliest * (1.0 - 2.0 * i as f64 / COARSE as f64))
            .map(|t| (t, self.rest(t)))
            .collect();
        for m in (2..=k).rev() {
            let distance =
                |at: &(f64, Rest)| self.whitened(&at.1, m, &entry).map_or(f64::INFINITY, |w| w.distance);
            let start = grid.iter().map(|at| (distance(at), at.0)).min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some(begin) = start.and_then(|(_, t)| self.descend(t, m, earliest, &entry)) {
                return begin;
            }
        }
        let t = self.crossing(earliest);
        let rest = self.rest(t);
        let weight = -1.0 / (rest.r[1] * self.rate);
        let meets = self.whitened(&rest, 1, &entry).is_some_and(|w| w.distance <= CHI2[0]);
        Begin { t, gradient: mixed(&rest.gradients, &[weight]), conditions: usize::from(meets) }
    }

    /// Gauss and Newton to the time at which `m` conditions hold best; None where they do not hold.
    fn descend(
        &self,
        mut t: f64,
        m: usize,
        earliest: f64,
        entry: &impl Fn(usize, usize) -> f64,
    ) -> Option<Begin> {
        for _ in 0..12 {
            let step = self.whitened(&self.rest(t), m, entry)?.step;
            t = (t + step).clamp(2.0 * earliest, -earliest);
        }
        let rest = self.rest(t);
        let found = self.whitened(&rest, m, entry)?;
        let holds = found.distance <= CHI2[m - 1] && earliest - t <= BEFORE * found.sd;
        let t = t.max(earliest);
        holds.then(|| Begin { t, gradient: mixed(&rest.gradients, &found.weights), conditions: m })
    }

    fn rest(&self, t: f64) -> Rest {
        let (c, k) = (self.candidate, self.candidate.order());
        let (mut phi, mut unit) = (self.A.exponential(t), 1.0);
        let (mut r, mut gradients) = (Vec::with_capacity(k + 1), Vec::with_capacity(k));
        for n in 0..=k {
            let along =
                |part: usize| phi.part(part)[..k].iter().zip(&c.linear.c[0]).map(|(r, c)| r * c).sum::<f64>();
            let level = if n == 0 { self.level() - self.y0 } else { 0.0 };
            r.push((level + along(0)) / unit);
            if n < k {
                let slopes = (0..k).map(|s| (s, along(1 + s) / unit));
                let states = (0..k).map(|j| (c.states(0) + j, phi.part(0)[j] / unit));
                let mut gradient: Gradient = slopes.chain(states).collect();
                if n == 0 {
                    gradient.extend(self.shared.iter().enumerate().map(|(i, x)| (c.shared() + i, *x)));
                    gradient.push((self.at_rest, -1.0));
                }
                gradients.push(gradient);
            }
            phi = self.A.times(&phi);
            unit *= self.rate;
        }
        Rest { r, gradients }
    }

    /// Cholesky's root of the covariance of `m` conditions makes them white.
    fn whitened(&self, rest: &Rest, m: usize, entry: &impl Fn(usize, usize) -> f64) -> Option<Whitened> {
        let floor = (ROUNDING * (self.level() - self.y0)).powi(2);
        let covariance = |a: &Gradient, b: &Gradient| {
            a.iter().map(|&(i, x)| b.iter().map(|&(j, y)| x * y * entry(i, j)).sum::<f64>()).sum::<f64>()
        };
        let mut root = vec![vec![0.0; m]; m];
        for i in 0..m {
            for j in 0..=i {
                let known: f64 = (0..j).map(|l| root[i][l] * root[j][l]).sum();
                let own = covariance(&rest.gradients[i], &rest.gradients[j]) - known;
                root[i][j] = if i == j { (own + floor).sqrt() } else { own / root[j][j] };
            }
        }
        let forward = |x: &[f64]| {
            let mut out: Vec<f64> = Vec::with_capacity(m);
            (0..m).for_each(|i| {
                out.push((x[i] - (0..i).map(|j| root[i][j] * out[j]).sum::<f64>()) / root[i][i])
            });
            out
        };
        let (r, slope) = (forward(&rest.r[..m]), forward(&rest.r[1..=m]));
        let length2: f64 = slope.iter().map(|d| d * d).sum();
        let step = -r.iter().zip(&slope).map(|(r, d)| r * d).sum::<f64>() / length2 / self.rate;
        let mut weights = vec![0.0; m];
        for i in (0..m).rev() {
            let known: f64 = (i + 1..m).map(|j| root[j][i] * weights[j]).sum();
            weights[i] = (-slope[i] / length2 / self.rate - known) / root[i][i];
        }
        let distance = r.iter().map(|r| r * r).sum::<f64>();
        (distance.is_finite() && step.is_finite()).then(|| Whitened {
            distance,
            step,
            weights,
            sd: 1.0 / (length2.sqrt() * self.rate),
        })
    }

    /// The last crossing of `y0`, looked for from some time after the first row back; the nearest point without one.
    fn crossing(&self, earliest: f64) -> f64 {
        let side = (self.level() - self.y0).signum();
        let gap = |t: f64| self.rest(t).r[0] * side;
        let time = |i: usize| earliest * (i as f64 / POINTS as f64 - 1.0);
        match (1..=2 * POINTS).find(|&i| gap(time(i)) <= 0.0) {
            Some(i) => bisected(time(i - 1), time(i), |t| gap(t) > 0.0),
            None => earliest,
        }
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

/// The weighted sum of gradients.
fn mixed(gradients: &[Gradient], weights: &[f64]) -> Gradient {
    let each = gradients.iter().zip(weights);
    each.flat_map(|(g, w)| g.iter().map(move |(i, x)| (*i, w * x))).collect()
}
