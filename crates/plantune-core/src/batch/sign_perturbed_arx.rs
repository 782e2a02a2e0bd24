//! Sign-perturbed sums for ARX: the regressor holds past outputs, so each set of signs has an output of its own.
//!
//! ```text
//! r(t) = y(t) - phi(t)' theta
//! y_i(t) = phi_i(t)' theta + a_i(t) r(t),   phi_i = [-y_i(t-1) … | u(t-nk) … | 1]
//! S_i = |R_i^-1/2 sum phi_i a_i r|^2,   R_i = sum phi_i phi_i'
//! ```
//!
//! Csáji, Campi and Weyer 2015, V.

use super::least_squares::RANK_TOLERANCE;
use super::orders::Orders;
use super::sign_perturbed_sums::{check, inside};
use crate::error::{Error, Result};
use crate::linalg::{Random, Triangle, dot, normal_draws, solve};
use crate::record::Record;

/// Whether `theta = [a, b, d]` is inside, `d` the constant of `A y = B u + d + e` where there is one.
pub fn arx_contains(
    rec: &Record,
    orders: &Orders,
    theta: &[f64],
    (m, q): (usize, usize),
    seed: u64,
) -> Result<bool> {
    check(m, q)?;
    let n = orders.n();
    if theta.len() != n && theta.len() != n + 1 {
        let needed = format!("{n} entries, or {} with the constant", n + 1);
        return Err(Error::argument("theta", format!("{} entries", theta.len()), &needed));
    }
    if rec.valid.is_some() || rec.ny != 1 {
        return Err(Error::argument("rec", "rows that do not count", "one output, every row valid"));
    }
    let problem = Problem { rec, orders, theta, first: orders.history() };
    let r = problem.residuals();
    let mut random = Random::new(seed);
    let mut sums = vec![problem.sum(&r)];
    for _ in 1..m {
        let perturbed: Vec<f64> = r.iter().map(|r| random.sign() * r).collect();
        sums.push(problem.sum(&perturbed));
    }
    Ok(inside(&sums, &random.permutation(m), q))
}

/// The box around the region: `(low, high)` of each entry of `theta = [a, b, d]`, the estimate by least squares.
///
/// An end of entry `j` is sought along `P e_j`, where an ellipsoid has it, and along rays near the best so far;
/// it is infinite where the region reaches beyond a thousand standard deviations.
pub fn arx_box(
    rec: &Record,
    orders: &Orders,
    theta: &[f64],
    sizes: (usize, usize),
    seed: u64,
) -> Result<Vec<(f64, f64)>> {
    arx_contains(rec, orders, theta, sizes, seed)?; // refusals
    let problem = Problem { rec, orders, theta, first: orders.history() };
    let Some(P) = problem.covariance() else {
        return Err(Error::new("X02", "columns of the regressor depend on each other")
            .remedy("ask for lower orders, or record with more steps of the input"));
    };
    let n = theta.len();
    let holds = |ray: &[f64], t: f64| {
        let moved: Vec<f64> = theta.iter().zip(ray).map(|(x, d)| x + t * d).collect();
        arx_contains(rec, orders, &moved, sizes, seed).unwrap_or(false)
    };
    let aside = normal_draws(&vec![0.0; n], &P, RAYS, seed);
    let end = |j: usize, sign: f64| {
        let (variance, sd) = (P[j * n + j], P[j * n + j].sqrt());
        // Entry j of a ray is the sign, so t is how far it moves entry j.
        let mut best: Vec<f64> = (0..n).map(|i| sign * P[i * n + j] / variance).collect();
        let mut most = reach(|t| holds(&best, t), 0.0, sd);
        for drawn in &aside {
            let along = drawn[j] * sign;
            let turned = (0..n).map(|i| best[i] + ASIDE / sd * (drawn[i] - along * best[i]));
            let ray: Vec<f64> = turned.collect();
            let further = most + CLOSE * sd;
            if most.is_finite() && holds(&ray, further) {
                most = reach(|t| holds(&ray, t), further, 0.1 * sd);
                best = ray;
            }
        }
        sign * most
    };
    Ok((0..n).map(|j| (theta[j] + end(j, -1.0), theta[j] + end(j, 1.0))).collect())
}

/// Rays beside the first, how far they turn aside, and the gain that counts; in standard deviations.
const RAYS: usize = 24;
const ASIDE: f64 = 0.4;
const CLOSE: f64 = 0.02;

/// Standard deviations beyond which a region is taken as not bounded.
const FAR: f64 = 1e3;

/// How far a ray stays inside, from a place inside on; in steps that double, then by halves.
fn reach(holds: impl Fn(f64) -> bool, from: f64, step: f64) -> f64 {
    let (mut low, mut length) = (from, step);
    while holds(low + length) {
        (low, length) = (low + length, 2.0 * length);
        if length > FAR * step {
            return f64::INFINITY;
        }
    }
    let mut high = low + length;
    while high - low > CLOSE * step {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    high
}

struct Problem<'p> {
    rec: &'p Record<'p>,
    orders: &'p Orders,
    theta: &'p [f64],
    first: usize,
}

impl Problem<'_> {
    fn fill(&self, y: &[f64], t: usize, phi: &mut Vec<f64>) {
        phi.clear();
        phi.extend((1..=self.orders.na).map(|k| -y[t - k]));
        for (i, (&nb, &nk)) in self.orders.nb.iter().zip(&self.orders.nk).enumerate() {
            phi.extend((nk..nk + nb).map(|lag| self.rec.u_at(t - lag, i)));
        }
        phi.resize(self.theta.len(), 1.0);
    }

    fn predicted(&self, phi: &[f64]) -> f64 {
        phi.iter().zip(self.theta).map(|(x, b)| x * b).sum()
    }

    fn residuals(&self) -> Vec<f64> {
        let mut phi = Vec::new();
        let mut all = Vec::new();
        for s in self.rec.segments() {
            for t in s.start + self.first.min(s.len())..s.end {
                self.fill(self.rec.y, t, &mut phi);
                all.push(self.rec.y[t] - self.predicted(&phi));
            }
        }
        all
    }

    /// Covariance of `theta` as least squares has it; None where columns depend on each other.
    fn covariance(&self) -> Option<Vec<f64>> {
        let (n, r) = (self.theta.len(), self.residuals());
        let (mut phi, mut rows, mut next) = (Vec::new(), Vec::new(), r.iter());
        for s in self.rec.segments() {
            for (t, r) in (s.start + self.first.min(s.len())..s.end).zip(&mut next) {
                self.fill(self.rec.y, t, &mut phi);
                rows.push([phi.as_slice(), &[*r]].concat());
            }
        }
        let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
        let every: Vec<usize> = (0..n).collect();
        let solution = solve(&triangle, &every, n, RANK_TOLERANCE).ok()?;
        let s2 = dot(&r, &r) / r.len().saturating_sub(n).max(1) as f64;
        Some(solution.inverse_gram.iter().map(|x| s2 * x).collect())
    }

    /// `S` of the record whose residuals are these.
    fn sum(&self, r: &[f64]) -> f64 {
        let mut y = self.rec.y.to_vec();
        let (mut phi, mut rows, mut next) = (Vec::new(), Vec::new(), r.iter());
        for s in self.rec.segments() {
            for (t, r) in (s.start + self.first.min(s.len())..s.end).zip(&mut next) {
                self.fill(&y, t, &mut phi);
                y[t] = self.predicted(&phi) + r;
                rows.push([phi.as_slice(), &[*r]].concat());
            }
        }
        // Q' r of the QR of phi: the last column of the triangle above its end.
        let n = self.theta.len();
        let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
        (0..n).map(|i| triangle.at(i, n).powi(2)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::model::PolyModel;

    /// At 40 rows, heavy tails: 95 % of 200, binomial, three standard deviations allowed.
    #[test]
    fn regions_of_arx_hold_the_truth() {
        let holds = |seed: u64| {
            let (u, e) = (white(40, 2 * seed), white(40, 2 * seed + 1));
            let plant = PolyModel::arx(vec![1.0, -0.7], vec![vec![0.5]], vec![1], 1.0);
            let mut noise: Vec<f64> = e.iter().map(|e| 0.2 * e.powi(3)).collect();
            crate::poly::divide(&plant.A, &mut noise);
            let y: Vec<f64> = plant.simulate(&u, 1).iter().zip(&noise).map(|(y, e)| y + e).collect();
            let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
            let orders = Orders::arx(1, vec![1], vec![1]);
            arx_contains(&rec, &orders, &[-0.7, 0.5, 0.0], (100, 5), seed).expect("an answer")
        };
        let held = (1..=200).filter(|&seed| holds(seed)).count();
        assert!((181..=199).contains(&held), "{held} of 200");
    }
    /// The region lies in its box, which touches it: no random point inside is outside the box.
    #[test]
    fn the_box_holds_the_region() {
        let (N, u, e) = (80, white(80, 1), white(80, 2));
        let plant = PolyModel::arx(vec![1.0, -0.7], vec![vec![0.5]], vec![1], 1.0);
        let mut noise: Vec<f64> = e.iter().map(|e| 0.3 * e).collect();
        crate::poly::divide(&plant.A, &mut noise);
        let y: Vec<f64> = plant.simulate(&u, 1).iter().zip(&noise).map(|(y, e)| y + e).collect();
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let orders = Orders::arx(1, vec![1], vec![1]);
        let theta = super::super::scores::estimate_arx(&rec, &orders, false).expect("a fit");
        let ends = arx_box(&rec, &orders, &theta, (20, 1), 3).expect("a box");
        assert!(arx_contains(&rec, &orders, &theta, (20, 1), 3).expect("an answer"), "{N}");
        let draws = white(1600, 4);
        for pair in draws.chunks_exact(2) {
            let at = |j: usize| 0.5 * (ends[j].0 + ends[j].1) + pair[j] * (ends[j].1 - ends[j].0) / 2.5;
            let point = [at(0), at(1)];
            if arx_contains(&rec, &orders, &point, (20, 1), 3).expect("an answer") {
                for j in 0..2 {
                    let room = 0.05 * (ends[j].1 - ends[j].0);
                    assert!(point[j] > ends[j].0 - room && point[j] < ends[j].1 + room, "{point:?} {ends:?}");
                }
            }
        }
    }
}
