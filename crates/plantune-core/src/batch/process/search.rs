//! Downhill in `ln T` and `L`, one delay sample at a time.

use super::super::fit::Status;
use super::problem::{Linear, Point, Problem};
use crate::linalg::dot;

/// Where a descent may end.
#[derive(Clone, Copy, PartialEq)]
enum Stop {
    /// As soon as downhill leads out of the cell.
    AtBound,
    /// At the least cost inside the cell.
    AtMinimum,
}

impl Problem<'_, '_> {
    /// From cell to cell downhill, until the minimum lies inside a cell or at a kink.
    fn search(&self, T: f64, m: usize) -> Option<Point> {
        let Ts = self.rec.Ts;
        let reach = *self.cells.end();
        let room = |m: usize| (m + 2).min(reach) + 1;
        let (history, status) = (room(m), Status::NotConverged);
        let start = Point { ln_T: T.ln(), m, f: 0.5 * Ts, history, cost: f64::NAN, status };
        let mut best = self.descend(start, Stop::AtBound)?;
        loop {
            let next = if best.f <= 0.0 && best.m > *self.cells.start() {
                Point { m: best.m - 1, f: Ts, ..best }
            } else if best.f >= Ts && best.m < reach {
                Point { m: best.m + 1, f: 0.0, ..best }
            } else {
                break;
            };
            // Costs compare between cells as long as both leave the same rows.
            let history = if next.m + 1 > best.history { room(next.m) } else { best.history };
            let point = self.descend(Point { history, ..next }, Stop::AtBound)?;
            if history == best.history && point.cost >= best.cost * (1.0 - 1e-12) {
                break;
            }
            best = point;
        }
        self.descend(best, Stop::AtMinimum)
    }

    /// The best minimum found from any start.
    pub(super) fn minimum(&self) -> Option<Point> {
        let minima: Vec<Point> = self.starts().into_iter().filter_map(|(T, m)| self.search(T, m)).collect();
        self.best(&minima)
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
    fn descend(&self, start: Point, stop: Stop) -> Option<Point> {
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
            if stop == Stop::AtBound && gauss_newton.leaves(point.f, low, high) {
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

    /// The problem in `ln T, L` alone, linear parameters projected out.
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
    /// Whether the delay is at a bound of its cell and downhill lies beyond.
    fn leaves(&self, f: f64, low: f64, high: f64) -> bool {
        let downhill = self.r12 * self.b1 + self.r22 * self.b2;
        (f <= low && downhill < 0.0) || (f >= high && downhill > 0.0)
    }

    /// Largest cosine between the residual and a free column of the Jacobian.
    fn slope(&self, f: f64, low: f64, high: f64, cost: f64) -> f64 {
        let size = cost.sqrt().max(f64::MIN_POSITIVE);
        let T = self.r11 * self.b1 / (self.r11.abs().max(f64::MIN_POSITIVE) * size);
        let length = self.r12.hypot(self.r22).max(f64::MIN_POSITIVE);
        let L = (self.r12 * self.b1 + self.r22 * self.b2) / (length * size);
        T.abs().max(if self.leaves(f, low, high) { 0.0 } else { L.abs() })
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
