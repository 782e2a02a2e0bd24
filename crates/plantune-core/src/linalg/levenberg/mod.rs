//! Levenberg-Marquardt on a triangle: `min |eps(theta)|^2` by steps from the triangle of `[psi | eps]`.
//!
//! ```text
//! min |eps - psi delta|^2 + damping |S delta|^2,   S the lengths of the columns of psi
//! ```
//!
//! Undamped steps are mixed with the last ones ([`Memory`]); only when one fails is damping raised.
//! The end is where the cosine between the residual and the space of the columns is below [`GRADIENT`].
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

const MOST_STEPS: usize = 100;

/// A nonlinear least-squares problem.
pub trait Residuals {
    /// The triangle of `[psi | eps]` at `theta`; None where there is no model, or its residual overflows.
    fn linearise(&mut self, theta: &[f64]) -> Option<Triangle>;

    /// Brings `theta` to where a model is allowed.
    fn project(&self, theta: &mut [f64]);

    /// Cost that is zero but for rounding.
    fn exact(&self) -> f64;

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
    let mut best = Minimum::at(problem, theta)?;
    let mut memory = Memory::default();
    let mut region = Region::around(&best);
    for _ in 0..problem.most_steps() {
        if best.cost <= problem.exact() || best.slope <= GRADIENT {
            best.converged = !region.has_died(&best);
            break;
        }
        let newton = best.newton();
        let (step, mixed) = if region.holds(&newton) {
            let alone = memory.is_empty();
            (memory.mix(&best, newton), !alone)
        } else {
            memory.clear();
            (region.edge(&best), false)
        };
        let mut theta: Vec<f64> = best.theta.iter().zip(&step).map(|(t, d)| t + d).collect();
        problem.project(&mut theta);
        match Minimum::at(problem, theta) {
            Some(trial) if trial.is_below(&best) => {
                if !trial.ties(&best) {
                    region.learn(&step, (best.cost - trial.cost) / (best.cost - best.cost_after(&step)));
                }
                best = trial;
                region.see(&best);
            }
            trial => {
                memory.clear();
                let finite = trial.is_some();
                if trial.is_some_and(|trial| trial.ties(&best)) {
                    // Its slope may date from initial states that were not yet the best.
                    best = Minimum::at(problem, best.theta)?;
                }
                if !mixed {
                    region.shrink(&step, finite);
                }
                if region.is_nothing(&best.theta) {
                    best.converged = best.slope <= ROUNDED && !region.has_died(&best);
                    break;
                }
            }
        }
    }
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

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        for start in [[-1.2, 1.0], [5.0, -3.0], [-4.0, 9.0]] {
            let end = minimise(&mut Valley, start.to_vec()).expect("a minimum");
            assert!(end.converged && end.cost < 1e-28, "{start:?} {end:?}");
            assert!((end.theta[0] - 1.0).abs() < 1e-12 && (end.theta[1] - 1.0).abs() < 1e-12);
        }
    }
}
