//! Gauss-Newton steps mixed with the last ones: where the residual is large they fall short or overshoot by a factor
//! that depends on the direction, and what the last ones became shows it.
//!
//! ```text
//! delta_k(theta)   the step at theta_k;  of all mixtures of the last ones, the one whose step vanishes
//! theta + delta - sum_i gamma_i (dtheta_i + ddelta_i),   min_gamma |S (delta - sum_i gamma_i ddelta_i)|
//! ```
//!
//! Anderson 1965.

use super::Minimum;

/// Steps remembered.
const MOST_MEMORY: usize = 5;

/// Curvature of the residual against that of the gradient's space: a change whose length is `x` times the
/// residual's tells nothing where the later ones leave less than `sqrt(CURVED) x` of it. Over random OE and
/// ARMAX models, 10 to 100 needs a fifth fewer evaluations than 0.
const CURVED: f64 = 30.0;

/// The last points and the steps of Gauss and Newton there.
#[derive(Default)]
pub(super) struct Memory {
    points: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Memory {
    /// The next step from `best`, whose own is `newton`.
    pub(super) fn mix(&mut self, best: &Minimum, newton: Vec<f64>) -> Vec<f64> {
        let most = best.theta.len().min(MOST_MEMORY);
        let older = self.points.len().saturating_sub(most);
        self.points.drain(..older);
        let mixed = self.mixed(best, &newton);
        self.points.push((best.theta.clone(), newton));
        mixed
    }

    /// Whether the next step is that of Gauss and Newton itself.
    pub(super) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Forgets all points: what happened between them is not what happens here.
    pub(super) fn clear(&mut self) {
        self.points.clear();
    }

    /// `newton` less the mixture of the last moves that takes most of it away, in the lengths of the columns.
    fn mixed(&self, best: &Minimum, newton: &[f64]) -> Vec<f64> {
        let n = newton.len();
        let scale = best.lengths();
        let (mut left, mut mixed) = (newton.to_vec(), newton.to_vec());
        let mut before: Vec<(Vec<f64>, Vec<f64>)> = Vec::with_capacity(self.points.len());
        for (point, step) in self.points.iter().rev() {
            // What the step became, and the move that made it so; orthogonal to the later ones.
            let mut change: Vec<f64> = newton.iter().zip(step).map(|(now, then)| now - then).collect();
            let mut moved: Vec<f64> = (0..n).map(|j| best.theta[j] - point[j] + change[j]).collect();
            let own = norm2(&change, &scale);
            for (other, with) in &before {
                let share = product(&change, other, &scale) / norm2(other, &scale);
                subtract(&mut change, share, other);
                subtract(&mut moved, share, with);
            }
            if norm2(&change, &scale) * best.cost > CURVED * own * own {
                let share = product(&left, &change, &scale) / norm2(&change, &scale);
                subtract(&mut left, share, &change);
                subtract(&mut mixed, share, &moved);
                before.push((change, moved));
            }
        }
        mixed
    }
}

fn product(x: &[f64], y: &[f64], scale: &[f64]) -> f64 {
    x.iter().zip(y).zip(scale).map(|((x, y), s)| x * y * s * s).sum()
}

fn norm2(x: &[f64], scale: &[f64]) -> f64 {
    product(x, x, scale)
}

fn subtract(x: &mut [f64], share: f64, y: &[f64]) {
    x.iter_mut().zip(y).for_each(|(x, y)| *x -= share * y);
}
