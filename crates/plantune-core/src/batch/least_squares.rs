//! Batch least squares `min |y - Phi theta|^2` on exactly the columns given.
//!
//! QR of the regressor, never the normal equations: column-scaled, column-pivoted, with a
//! stated rank tolerance. Where the condition asks for it, the solution is refined on the
//! augmented system with residuals in double-double (Björck 1967):
//!
//! ```text
//! f = y - r - Phi theta,  g = -Phi' r        (exact sums)
//! dtheta = R^-1 (Q' f) - (Phi' Phi)^-1 g,  dr = f - Phi dtheta
//! ```
//!
//! Source 000, (2.2-3) to (2.2-5).

use super::orders::too_short;
use crate::error::{Error, Result};
use crate::linalg::{RankDeficient, Solution, Triangle, solve};

/// Pivots below this share of the largest mean rank deficiency.
pub const RANK_TOLERANCE: f64 = 1e-14;

/// Problems whose pivots stay above this share need no refinement.
const WELL_CONDITIONED: f64 = 1e-2;

/// Decimal digits below which a parameter is no answer.
const FEWEST_DIGITS: f64 = 3.0;

/// Share of y that the lost digits must amount to: a parameter that is zero has none to lose.
const LOST: f64 = 1e-9;

/// Parameters with their covariance.
#[derive(Clone, Debug)]
pub struct LinearFit {
    /// Parameters.
    pub theta: Vec<f64>, // (n)
    /// Covariance, `s^2 (Phi' Phi)^-1` with `s^2 = RSS / (N - n)`; row-major.
    pub P: Vec<f64>, // (n, n)
    /// Rows.
    pub N: usize,
    /// `RSS / N`.
    pub loss: f64,
    /// Decimal digits of each parameter that rounding leaves.
    pub expected_digits: Vec<f64>, // (n)
}

/// Solves for the columns of the row-major `phi (N, n)`.
pub fn least_squares(phi: &[f64], n: usize, y: &[f64]) -> Result<LinearFit> {
    check(phi, n, y)?;
    let N = y.len();
    let scaled = Scaled::new(phi, n);
    let triangle = scaled.triangle(y);
    let columns: Vec<usize> = (0..n).collect();
    let solution = solve(&triangle, &columns, n, RANK_TOLERANCE).map_err(|e| dependent(&e))?;
    let (theta, error) = match scaled.refined(&solution, y) {
        Some(refined) => refined,
        None => (solution.theta.clone(), rounding(&triangle, &solution, &solution.theta, solution.rss)),
    };
    let rss: f64 = scaled.residuals(&theta, y).iter().map(|r| r * r).sum();
    let s2 = if N > n { rss / (N - n) as f64 } else { f64::NAN };
    let digits = digits(&error, &theta);
    check_digits(&digits, &error, y)?;
    let factor = |j: usize| scaled.factor[j];
    Ok(LinearFit {
        P: (0..n * n).map(|ij| s2 * solution.inverse_gram[ij] * factor(ij / n) * factor(ij % n)).collect(),
        theta: theta.iter().enumerate().map(|(j, t)| t * factor(j)).collect(),
        N,
        loss: rss / N as f64,
        expected_digits: digits,
    })
}

fn check(phi: &[f64], n: usize, y: &[f64]) -> Result<()> {
    if n == 0 || phi.len() != n * y.len() {
        return Err(Error::new(
            "D09",
            format!("phi has {} values, y has {} rows and theta {n} entries", phi.len(), y.len()),
        )
        .remedy("give phi one row per value of y"));
    }
    if !phi.iter().chain(y).all(|x| x.is_finite()) {
        let row = y.iter().position(|x| !x.is_finite());
        let row = row.or(phi.iter().position(|x| !x.is_finite()).map(|k| k / n));
        return Err(Error::new("D07", "phi or y holds a number that is not finite")
            .at(crate::note::Place { column: "phi, y".into(), row, time: None })
            .remedy("remove that row"));
    }
    if y.len() < n {
        return Err(too_short(y.len(), n));
    }
    Ok(())
}

fn dependent(refusal: &RankDeficient) -> Error {
    Error::new(
        "X02",
        format!("column {} of phi depends on the others: rank {}", refusal.dependent[0], refusal.rank),
    )
    .count(refusal.dependent.len())
    .measured(refusal.ratio, RANK_TOLERANCE)
    .remedy("leave that column out or excite it")
}

/// Refuses parameters of which rounding leaves fewer than three digits (N04).
fn check_digits(digits: &[f64], error: &[f64], y: &[f64]) -> Result<()> {
    let size = y.iter().fold(0.0f64, |m, y| m.max(y.abs()));
    let lost = |j: &usize| digits[*j] < FEWEST_DIGITS && error[*j] > LOST * size;
    let few: Vec<usize> = (0..digits.len()).filter(lost).collect();
    let Some(&j) = few.iter().min_by(|&&a, &&b| digits[a].total_cmp(&digits[b])) else { return Ok(()) };
    let text = format!("rounding leaves {:.1} digits of the coefficient of column {j} of phi", digits[j]);
    Err(Error::new("N04", text)
        .count(few.len())
        .measured(digits[j], FEWEST_DIGITS)
        .remedy("leave out a column that others nearly repeat, or centre and scale them"))
}

/// Decimal digits of each parameter that are left when it is wrong by `error`.
pub(super) fn digits(error: &[f64], theta: &[f64]) -> Vec<f64> {
    let digits = |(e, t): (&f64, &f64)| -(e / t.abs().max(f64::MIN_POSITIVE)).log10();
    error.iter().zip(theta).map(digits).map(|d| d.clamp(0.0, 15.9)).collect()
}

/// Error that rounding causes in `R theta = Q' y`, from a componentwise bound:
/// `|dtheta| <= eps (|R^-1| |R| |theta| + |(R'R)^-1| |R|' |r|)`.
pub(super) fn rounding(triangle: &Triangle, solution: &Solution, theta: &[f64], rss: f64) -> Vec<f64> {
    let n = theta.len();
    let length = |j: usize| (0..=j).map(|k| triangle.at(k, j).powi(2)).sum::<f64>().sqrt();
    let lengths: Vec<f64> = (0..n).map(length).collect();
    let product: f64 = theta.iter().zip(&lengths).map(|(t, l)| t.abs() * l).sum();
    (0..n)
        .map(|i| {
            let own = solution.inverse_gram[i * n + i].sqrt();
            let cross: f64 =
                lengths.iter().enumerate().map(|(j, l)| solution.inverse_gram[i * n + j].abs() * l).sum();
            f64::EPSILON * (own * product + cross * rss.sqrt())
        })
        .collect()
}

/// The problem with power-of-two column scales, so that scaling adds no rounding.
struct Scaled<'a> {
    phi: &'a [f64],
    n: usize,
    factor: Vec<f64>,
}

impl<'a> Scaled<'a> {
    fn new(phi: &'a [f64], n: usize) -> Self {
        let factor = (0..n)
            .map(|j| {
                let largest = phi.iter().skip(j).step_by(n).fold(0.0f64, |m, x| m.max(x.abs()));
                if largest > 0.0 {
                    2f64.powi(-(largest.log2().ceil() as i32).clamp(-1000, 1000))
                } else {
                    1.0
                }
            })
            .collect();
        Scaled { phi, n, factor }
    }

    fn row(&self, k: usize) -> impl Iterator<Item = f64> + '_ {
        self.phi[k * self.n..][..self.n].iter().zip(&self.factor).map(|(x, f)| x * f)
    }

    fn triangle(&self, y: &[f64]) -> Triangle {
        let mut row: Vec<f64> = Vec::with_capacity(self.n + 1);
        let mut triangle = Triangle::new(self.n + 1);
        let mut block = crate::linalg::Block::new(self.n + 1);
        for (k, y) in y.iter().enumerate() {
            row.clear();
            row.extend(self.row(k));
            row.push(*y);
            block.push(&row);
        }
        triangle.absorb(&mut block);
        triangle
    }

    /// `y - Phi theta`, each sum exact to a rounding.
    fn residuals(&self, theta: &[f64], y: &[f64]) -> Vec<f64> {
        y.iter().enumerate().map(|(k, &y)| self.residual(k, theta, y, 0.0)).collect()
    }

    /// `y - r - Phi theta` of one row in double-double.
    fn residual(&self, k: usize, theta: &[f64], y: f64, r: f64) -> f64 {
        let mut sum = DoubleDouble(y, 0.0);
        sum.add(-r);
        self.row(k).zip(theta).for_each(|(x, t)| sum.add_product(-x, *t));
        sum.0 + sum.1
    }

    /// Björck's refinement, for problems that need it: the solution and the error left in each entry.
    ///
    /// Stops when a step no longer halves the correction.
    fn refined(&self, solution: &Solution, y: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        if solution.ratio > WELL_CONDITIONED {
            return None;
        }
        let n = self.n;
        let columns: Vec<usize> = (0..n).collect();
        let mut theta = solution.theta.clone();
        let mut r = self.residuals(&theta, y);
        let (mut last, mut error) = (f64::INFINITY, vec![f64::INFINITY; n]);
        for _ in 0..10 {
            let f: Vec<f64> = y.iter().enumerate().map(|(k, &y)| self.residual(k, &theta, y, r[k])).collect();
            let g = self.minus_gradient(&r);
            // min |f - Phi d| and (Phi'Phi)^-1 (-g): the two parts of the augmented solution.
            let step = solve(&self.triangle(&f), &columns, n, RANK_TOLERANCE).ok()?;
            let d: Vec<f64> = (0..n)
                .map(|i| {
                    let row = &solution.inverse_gram[i * n..][..n];
                    step.theta[i] - row.iter().zip(&g).map(|(h, g)| h * g).sum::<f64>()
                })
                .collect();
            let relative = |(d, t): (&f64, &f64)| (d / t.abs().max(f64::MIN_POSITIVE)).abs();
            let size = d.iter().zip(&theta).map(relative).fold(0.0, f64::max);
            if !(size < 0.5 * last) {
                break;
            }
            last = size;
            for (k, r) in r.iter_mut().enumerate() {
                *r += f[k] - self.row(k).zip(&d).map(|(x, d)| x * d).sum::<f64>();
            }
            theta.iter_mut().zip(&d).for_each(|(t, d)| *t += d);
            error = d.iter().zip(&theta).map(|(d, t)| d.abs().max(f64::EPSILON * t.abs())).collect();
            if size < f64::EPSILON {
                break;
            }
        }
        Some((theta, error))
    }

    /// `g = -Phi' r` in double-double.
    fn minus_gradient(&self, r: &[f64]) -> Vec<f64> {
        let mut sums = vec![DoubleDouble(0.0, 0.0); self.n];
        for (k, r) in r.iter().enumerate() {
            for (sum, x) in sums.iter_mut().zip(self.row(k)) {
                sum.add_product(-x, *r);
            }
        }
        sums.iter().map(|s| s.0 + s.1).collect()
    }
}

/// An unevaluated sum of two doubles (Dekker 1971; Knuth's two-sum).
#[derive(Clone, Copy)]
struct DoubleDouble(f64, f64);

impl DoubleDouble {
    fn add(&mut self, x: f64) {
        let sum = self.0 + x;
        let rounded = sum - self.0;
        self.1 += (self.0 - (sum - rounded)) + (x - rounded);
        self.0 = sum;
    }

    fn add_product(&mut self, x: f64, y: f64) {
        let product = x * y;
        self.add(product);
        self.1 += x.mul_add(y, -product);
    }
}
