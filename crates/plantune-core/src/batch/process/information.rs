//! What the rows of a record say about `K`, `T` and `L` of a plant that is known roughly, before any fit.
//!
//! ```text
//! psi = d y / d(K, T, L, O) at the rough plant, the states before each segment taken out
//! v = eps - psi d,    d the step of Gauss and Newton from the rough plant: the noise of these rows
//! A(q) v = e          the autoregression of v whose order BIC takes
//! Cov = s^2 (sum A psi (A psi)')^-1,    s^2 the variance of e
//! ```
//!
//! It is the covariance of a fit with a noise model. Feedback does not bias it: e does not know the inputs
//! before it, v does. The same regression, `A eps` on `A psi`, says which gain the rows ask for. Ljung 1999,
//! 7.4, 9.4 and 13.4.

use super::super::fit::{Status, standard_deviations};
use super::super::sandwich::autoregression;
use super::super::scores::Scores;
use super::problem::{Point, Problem};
use super::{Code, ProcessOptions};
use crate::limits::Limits;
use crate::linalg::{Block, Solution, Triangle, dot, solve, sum};
use crate::model::Fopdt;
use crate::record::Record;

/// Pivots below this share mean that the rows do not tell the parameters apart.
const LEAST_RATIO: f64 = 1e-6;

/// Standard deviations that a record gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Information {
    /// Gain that these rows ask for, time constant and delay being free.
    pub K: f64,
    /// Standard deviations of `K`, of `T` (s) and of `L` (s).
    pub sd: [f64; 3],
    /// Share of the output that the input explains in simulation, %.
    pub fit: f64,
}

/// What the rows of a record with one input and one output say about a plant; None where they tell nothing.
pub fn information(rec: &Record, plant: &Fopdt, limits: &Limits) -> Option<Information> {
    let options = ProcessOptions { offset: true, ..ProcessOptions::default() };
    let mut problem = Problem::new(rec, &[Code::P1D], &options, limits).ok()?;
    let L = plant.L / rec.Ts;
    problem.bounds.1 = problem.bounds.1.max(L + 1.0);
    let x = vec![(plant.T / rec.Ts).ln(), L];
    let m = problem.cells_of(&x);
    let point = Point { history: m[0] + 1, x, m, cost: f64::NAN, status: Status::Converged };
    let (_, mut linear) = problem.evaluate(&point)?;
    linear.theta[0] = plant.K / problem.gain_unit(0);
    let scores = problem.scores_with(&point, &linear)?;
    let noise = errors_after_a_step(&scores)?;
    let fit = 100.0 * (1.0 - (dot(&noise, &noise) / spread(rec)).sqrt());
    let (A, _) = autoregression(&Scores { eps: noise, ..scores.clone() }).ok()?;
    let (solution, rows) = regressed(&scores, &A)?;
    let s2 = solution.rss / rows.checked_sub(scores.n() + scores.states).filter(|&n| n > 0)? as f64;
    let covariance: Vec<f64> = solution.inverse_gram.iter().map(|x| s2 * x).collect();
    let P = problem.in_units(&covariance, &problem.told_apart(), &point, &linear);
    let sd = standard_deviations(&P, 3);
    let K = plant.K + solution.theta[0] * problem.gain_unit(0);
    sd.iter().all(|sd| sd.is_finite()).then_some(Information { K, sd: [sd[0], sd[1], sd[2]], fit })
}

/// What the best step of the parameters leaves of the errors.
fn errors_after_a_step(scores: &Scores) -> Option<Vec<f64>> {
    let (step, _) = regressed(scores, &[1.0])?;
    Some((0..scores.eps.len()).map(|t| scores.eps[t] - dot(scores.psi(t), &step.theta)).collect())
}

/// `A eps` on `A psi`, and the number of rows.
fn regressed(scores: &Scores, A: &[f64]) -> Option<(Solution, usize)> {
    let n = scores.n();
    let (mut triangle, mut block, mut rows) = (Triangle::new(n + 1), Block::new(n + 1), 0);
    for s in &scores.segments {
        for t in s.start + A.len() - 1..s.end {
            let filtered = |x: &dyn Fn(usize) -> f64| -> f64 {
                A.iter().enumerate().map(|(lag, a)| a * x(t - lag)).sum()
            };
            let mut row: Vec<f64> = (0..n).map(|j| filtered(&|t| scores.psi(t)[j])).collect();
            row.push(filtered(&|t| scores.eps[t]));
            block.push(&row);
            rows += 1;
        }
    }
    triangle.absorb(&mut block);
    let every: Vec<usize> = (0..n).collect();
    Some((solve(&triangle, &every, n, LEAST_RATIO).ok()?, rows))
}

/// Sum of squares of y about its mean.
fn spread(rec: &Record) -> f64 {
    let y = rec.output(0);
    let mean = sum(&y) / y.len() as f64;
    y.iter().map(|y| (y - mean).powi(2)).sum()
}
