//! Sign-perturbed sums for ARX: the regressor holds past outputs, so each set of signs has an output of its own.
//!
//! ```text
//! r(t) = y(t) - phi(t)' theta
//! y_i(t) = phi_i(t)' theta + a_i(t) r(t),   phi_i = [-y_i(t-1) … | u(t-nk) … | 1]
//! S_i = |R_i^-1/2 sum phi_i a_i r|^2,   R_i = sum phi_i phi_i'
//! ```
//!
//! Csáji, Campi and Weyer 2015, V.

use super::orders::Orders;
use super::sign_perturbed_sums::{check, inside};
use crate::error::{Error, Result};
use crate::linalg::{Random, Triangle};
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
}
