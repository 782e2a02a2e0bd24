//! Levenberg-Marquardt on a QR: `min |eps(theta)|^2` by steps from the triangle of `[psi | eps]`.
//!
//! ```text
//! min |eps - psi delta|^2 + damping |S delta|^2,   S the lengths of the columns of psi
//! ```
//!
//! The first step of every iteration is that of Gauss and Newton; only when it fails is damping raised.
//! The end is where the largest cosine between the residual and a column is below [`GRADIENT`].
//!
//! Marquardt 1963; Moré 1978.

use super::qr::Triangle;
use super::solve::solve_damped;

/// Largest cosine between the residual and a column of the gradient at a minimum.
const GRADIENT: f64 = 1e-8;

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
}

/// Share by which costs of two points may differ by rounding, where the residual is small against the signals.
pub const TIE: f64 = 1e-9;

/// Damping at which a step is no step any more.
const MOST_DAMPING: f64 = 1e12;

/// Where a descent ended.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Parameters.
    pub theta: Vec<f64>,
    /// Sum of squared residuals.
    pub cost: f64,
    /// Largest cosine between the residual and a column.
    pub slope: f64,
    /// Triangle of `[psi | eps]` there.
    pub triangle: Triangle,
    /// Whether the gradient test passed.
    pub converged: bool,
}

impl Minimum {
    /// Costs that agree to rounding are told apart by their slopes.
    fn is_below(&self, other: &Minimum) -> bool {
        self.cost < other.cost * (1.0 - TIE)
            || (self.cost <= other.cost * (1.0 + TIE) && self.slope < other.slope)
    }
}

/// Descends from `theta`; None where there is no model.
pub fn minimise(problem: &mut impl Residuals, mut theta: Vec<f64>) -> Option<Minimum> {
    problem.project(&mut theta);
    let triangle = problem.linearise(&theta)?;
    let mut best =
        Minimum { cost: cost(&triangle), slope: slope(&triangle), theta, triangle, converged: false };
    let columns: Vec<usize> = (0..best.theta.len()).collect();
    let mut damping = 0.0;
    for _ in 0..MOST_STEPS {
        best.converged = best.cost <= problem.exact() || best.slope <= GRADIENT;
        if best.converged {
            break;
        }
        let step = solve_damped(&best.triangle, &columns, columns.len(), damping);
        let mut theta: Vec<f64> = best.theta.iter().zip(&step).map(|(t, d)| t + d).collect();
        problem.project(&mut theta);
        let trial = problem.linearise(&theta).map(|triangle| Minimum {
            cost: cost(&triangle),
            slope: slope(&triangle),
            theta,
            triangle,
            converged: false,
        });
        match trial {
            Some(trial) if trial.is_below(&best) => {
                best = trial;
                damping = if damping > 1e-7 { damping / 10.0 } else { 0.0 };
            }
            _ if damping > MOST_DAMPING => {
                best.converged = best.slope <= ROUNDED;
                break;
            }
            _ => damping = (10.0 * damping).max(1e-4),
        }
    }
    Some(best)
}

/// Squared length of the last column.
fn cost(triangle: &Triangle) -> f64 {
    let rhs = triangle.n() - 1;
    (0..=rhs).map(|i| triangle.at(i, rhs).powi(2)).sum()
}

/// Largest cosine between the last column and another.
fn slope(triangle: &Triangle) -> f64 {
    let rhs = triangle.n() - 1;
    let product = |j: usize| (0..=j).map(|i| triangle.at(i, j) * triangle.at(i, rhs)).sum::<f64>();
    let length2 = |j: usize| (0..=j).map(|i| triangle.at(i, j).powi(2)).sum::<f64>();
    let size = cost(triangle).sqrt();
    let cosine = |j: usize| product(j).abs() / (length2(j).sqrt() * size).max(f64::MIN_POSITIVE);
    (0..rhs).map(cosine).fold(0.0, f64::max)
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
