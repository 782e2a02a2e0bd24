//! Levenberg-Marquardt on a triangle: `min |eps(theta)|^2` by steps from the triangle of `[psi | eps]`.
//!
//! ```text
//! theta <- theta + delta,   min |eps - psi delta|^2  with  |D delta| <= radius
//! ```
//!
//! While the region of trust ([`Region`]) holds the step of Gauss and Newton, it is mixed with the last ones
//! ([`Memory`]). A step that does not lower the cost, or ends where nothing is finite, costs the memory first, then
//! part of the radius. Costs that agree to rounding are told apart by the gradient, so the last steps polish.
//! The end is where the cosine between the residual and the space of the columns is below [`GRADIENT`]; where a
//! column has died against its largest length, it is no minimum but a plateau.
//!
//! From both starts all 27 nonlinear problems of NIST StRD end with 7 digits or more (`tests/nist_nonlinear.rs`).
//!
//! Marquardt 1963; Moré 1978.

mod mixing;
mod region;

use self::mixing::Memory;
use self::region::Region;
use super::qr::Triangle;
use super::solve::solve_damped;

/// Cosine between the residual and the space of the gradient's columns at a minimum (Bates and Watts 1981).
const GRADIENT: f64 = 3e-8;

/// The same where rounding lets no step lower the cost any more.
const ROUNDED: f64 = 1e-5;

/// Steps after which a search ends wherever it is.
pub const MOST_STEPS: usize = 400;

/// A nonlinear least-squares problem.
pub trait Residuals {
    /// The triangle of `[psi | eps]` at `theta`; None where there is no model, or its residual overflows.
    fn linearise(&mut self, theta: &[f64]) -> Option<Triangle>;

    /// Brings `theta` to where a model is allowed.
    fn project(&self, theta: &mut [f64]);

    /// Cost that is zero but for rounding.
    fn exact(&self) -> f64;

    /// Whether a point hides states that follow it a step behind, and its slope with them.
    fn has_states(&self) -> bool {
        false
    }

    /// Steps after which a search ends wherever it is.
    fn most_steps(&self) -> usize {
        MOST_STEPS
    }
}

/// Share by which costs of two points may differ by rounding, where the residual is small against the signals.
pub const TIE: f64 = 1e-9;

/// Where a descent ended.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Parameters.
    pub theta: Vec<f64>,
    /// Sum of squared residuals.
    pub cost: f64,
    /// Cosine between the residual and the space of the columns.
    pub slope: f64,
    /// Triangle of `[psi | eps]` there.
    pub triangle: Triangle,
    /// Whether the gradient test passed.
    pub converged: bool,
}

impl Minimum {
    /// Costs that agree to rounding are told apart by their slopes.
    fn is_below(&self, other: &Minimum) -> bool {
        self.cost < other.cost * (1.0 - TIE) || (self.ties(other) && self.slope < other.slope)
    }

    fn ties(&self, other: &Minimum) -> bool {
        (self.cost - other.cost).abs() <= TIE * other.cost
    }
}

/// Descends from `theta`; None where there is no model.
pub fn minimise(problem: &mut impl Residuals, mut theta: Vec<f64>) -> Option<Minimum> {
    problem.project(&mut theta);
    let exact = problem.exact();
    let mut best = Minimum::at(problem, theta)?;
    let mut memory = Memory::default();
    let mut region = Region::around(&best);
    let mut stale = problem.has_states();
    for _ in 0..problem.most_steps() {
        if best.is_flat(GRADIENT, exact) || region.is_nothing(&best) {
            break;
        }
        // Gauss and Newton's step, mixed with the last ones, while the region holds it; else the best one inside.
        let newton = best.newton();
        let inside = region.holds(&newton);
        if !inside {
            memory.clear();
        }
        let mixed = !memory.is_empty();
        let step = if inside { memory.mix(&best, newton) } else { region.edge(&best) };
        match best.after(problem, &step) {
            Some(trial) if trial.is_below(&best) => {
                // A full step that fell short is no fault of the region: the mixture learns from it.
                if !inside && !trial.ties(&best) {
                    region.learn(&step, (best.cost - trial.cost) / (best.cost - best.cost_after(&step)));
                }
                best = trial;
                region.see(&best);
                stale = problem.has_states();
            }
            trial => {
                memory.clear();
                if !mixed && !stale {
                    region.shrink(&step, trial.is_some());
                }
                if stale || trial.is_some_and(|trial| trial.ties(&best)) {
                    // Its slope, and the step by it, date from states that were not yet the best.
                    best = Minimum::at(problem, best.theta)?;
                    stale = false;
                }
            }
        }
    }
    let limit = if region.is_nothing(&best) { ROUNDED } else { GRADIENT };
    best.converged = best.is_flat(limit, exact) && !region.has_died(&best);
    Some(best)
}

impl Minimum {
    fn at(problem: &mut impl Residuals, theta: Vec<f64>) -> Option<Self> {
        let triangle = problem.linearise(&theta)?;
        let finite = (0..triangle.n()).all(|i| triangle.row(i).iter().all(|x| x.is_finite()));
        finite.then(|| Minimum {
            cost: cost(&triangle),
            slope: slope(&triangle),
            theta,
            triangle,
            converged: false,
        })
    }

    /// The point a step further, if there is a model.
    fn after(&self, problem: &mut impl Residuals, step: &[f64]) -> Option<Self> {
        let mut theta: Vec<f64> = self.theta.iter().zip(step).map(|(t, d)| t + d).collect();
        problem.project(&mut theta);
        Minimum::at(problem, theta)
    }

    /// The gradient test.
    fn is_flat(&self, limit: f64, exact: f64) -> bool {
        self.slope <= limit || self.cost <= exact
    }

    /// The step of Gauss and Newton.
    fn newton(&self) -> Vec<f64> {
        let columns: Vec<usize> = (0..self.theta.len()).collect();
        solve_damped(&self.triangle, &columns, columns.len(), 0.0)
    }

    /// Lengths of the columns.
    fn lengths(&self) -> Vec<f64> {
        let length = |j: usize| (0..=j).map(|i| self.triangle.at(i, j).powi(2)).sum::<f64>().sqrt();
        (0..self.theta.len()).map(length).collect()
    }

    /// What the linear model promises after a step.
    fn cost_after(&self, step: &[f64]) -> f64 {
        let (t, rhs) = (&self.triangle, step.len());
        let left = |i: usize| t.at(i, rhs) - (i..rhs).map(|j| t.at(i, j) * step[j]).sum::<f64>();
        (0..=rhs).map(|i| left(i).powi(2)).sum()
    }
}

/// Squared length of the last column.
fn cost(triangle: &Triangle) -> f64 {
    let rhs = triangle.n() - 1;
    (0..=rhs).map(|i| triangle.at(i, rhs).powi(2)).sum()
}

/// Cosine between the last column and the space of the others.
fn slope(triangle: &Triangle) -> f64 {
    let rhs = triangle.n() - 1;
    let inside = (0..rhs).map(|i| triangle.at(i, rhs).powi(2)).sum::<f64>().sqrt();
    inside / cost(triangle).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley as residuals `10 (y - x^2), 1 - x`.
    struct Valley;

    impl Residuals for Valley {
        fn linearise(&mut self, theta: &[f64]) -> Option<Triangle> {
            let [x, y] = [theta[0], theta[1]];
            let rows = [[20.0 * x, -10.0, 10.0 * (y - x * x)], [1.0, 0.0, 1.0 - x]];
            Some(Triangle::of_rows(3, rows.iter().map(|r| r.as_slice())))
        }

        fn project(&self, _theta: &mut [f64]) {}

        fn exact(&self) -> f64 {
            1e-28
        }
    }

    /// `y = exp(-theta x)`, given where it has fallen to nothing: its column dies as theta grows.
    struct Plateau;

    impl Residuals for Plateau {
        fn linearise(&mut self, theta: &[f64]) -> Option<Triangle> {
            let row = |x: f64| [-x * (-theta[0] * x).exp(), -0.5 - (-theta[0] * x).exp()];
            Some(Triangle::of_rows(2, [row(1.0), row(2.0)].iter().map(|r| r.as_slice())))
        }

        fn project(&self, _theta: &mut [f64]) {}

        fn exact(&self) -> f64 {
            0.0
        }
    }

    #[test]
    fn a_plateau_is_no_minimum() {
        let end = minimise(&mut Plateau, vec![0.1]).expect("a model");
        assert!(!end.converged && end.theta[0] > 10.0, "{end:?}");
    }

    /// On the edge `psi'(eps - psi delta) = p D^2 delta`, p > 0, and `|D delta|` is the radius.
    #[test]
    fn the_step_to_the_edge_meets_its_equation() {
        let point = Minimum::at(&mut Valley, vec![-1.2, 1.0]).expect("a model");
        let mut region = Region::around(&point);
        region.shrink(&[0.1, -0.3], true);
        let (step, d, t) = (region.edge(&point), point.lengths(), &point.triangle);
        assert!((region.size(&step) - 1.0).abs() < 0.01);
        let left = |i: usize| t.at(i, 2) - t.at(i, 0) * step[0] - t.at(i, 1) * step[1];
        let p = [0, 1].map(|j| (0..=j).map(|i| t.at(i, j) * left(i)).sum::<f64>() / (d[j] * d[j] * step[j]));
        assert!(p[0] > 0.0 && (p[1] / p[0] - 1.0).abs() < 1e-9, "{p:?}");
    }

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        for start in [[-1.2, 1.0], [5.0, -3.0], [-4.0, 9.0]] {
            let end = minimise(&mut Valley, start.to_vec()).expect("a minimum");
            assert!(end.converged && end.cost < 1e-28, "{start:?} {end:?}");
            assert!((end.theta[0] - 1.0).abs() < 1e-12 && (end.theta[1] - 1.0).abs() < 1e-12);
        }
    }
}
