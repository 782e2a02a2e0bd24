//! Sign-perturbed sums: a region for `theta` of `y = phi' theta + e` that is exact for any number of rows.
//!
//! ```text
//! r(t) = y(t) - phi(t)' theta,   R = sum phi phi'
//! S_0 = |R^-1/2 sum phi(t) r(t)|^2,   S_i = |R^-1/2 sum phi(t) a_i(t) r(t)|^2,   a_i(t) = +-1 at random,  i = 1 .. m-1
//! theta is inside unless S_0 is among the q largest of the m:   probability 1 - q/m
//! ```
//!
//! This holds where the noise is independent and symmetric about zero, whatever its distribution from row to row. With
//! `z = R^1/2 (theta - theta_hat)`, `S_0 = |z|^2` and `S_i = |b_i - A_i z|^2`, so the region lies in the ball of radius
//! `r`, the `q`-th largest of `max |z|^2` where `|z|^2 <= |b - A z|^2`. Its dual has no gap, and one variable:
//!
//! ```text
//! r_i = min over l > 1/(1 - d_max) of   l b'b + l^2 sum_j c_j^2 / (l (1 - d_j) - 1),   A'A = V D V',  c = V' A' b
//! ```
//!
//! Csáji, Campi and Weyer 2015; the ball after Weyer, Campi and Csáji 2017, their semidefinite program solved in
//! the eigenvectors. METHODS 2.4.

use super::least_squares::{RANK_TOLERANCE, least_squares};
use crate::error::{Error, Result};
use crate::linalg::{Random, Triangle, right_singular_vectors, solve};

/// The sums of one problem, ready to be asked for any `theta`.
#[derive(Clone, Debug)]
pub struct SignPerturbedSums {
    n: usize,
    q: usize,
    /// Estimate by least squares.
    pub theta: Vec<f64>, // (n)
    /// `R^-1`, row-major.
    pub inverse_gram: Vec<f64>, // (n, n)
    root: Triangle, // R = root' root
    sums: Vec<Sum>,
    order: Vec<usize>, // breaks ties; that of S_0 first
}

/// `b - A z` of one set of signs.
#[derive(Clone, Debug)]
struct Sum {
    b: Vec<f64>, // (n)
    A: Vec<f64>, // (n, n)
}

/// The sums for row-major `phi (N, n)`; `m` of them, among which the `q` largest are outside.
pub fn sign_perturbed_sums(
    phi: &[f64],
    n: usize,
    y: &[f64],
    (m, q): (usize, usize),
    seed: u64,
) -> Result<SignPerturbedSums> {
    check(m, q)?;
    let theta = least_squares(phi, n, y)?.theta;
    let row = |t: usize| &phi[t * n..][..n];
    let residual = |t: usize| y[t] - row(t).iter().zip(&theta).map(|(x, b)| x * b).sum::<f64>();
    let rows: Vec<Vec<f64>> = (0..y.len()).map(|t| [row(t), &[residual(t)]].concat()).collect();
    let all = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
    let every: Vec<usize> = (0..n).collect();
    let inverse_gram = solve(&all, &every, n, RANK_TOLERANCE)
        .map_err(|e| {
            Error::new("X02", "columns of phi depend on each other").measured(e.ratio, RANK_TOLERANCE)
        })?
        .inverse_gram;
    let root = Triangle::of_upper(n, (0..n).flat_map(|i| all.row(i)[..n].to_vec()).collect());
    // Rows of phi R^-1/2: then R^-1/2 sum phi a r = sum q a r.
    let orthonormal: Vec<Vec<f64>> = (0..y.len()).map(|t| transposed_solve(&root, row(t))).collect();
    let mut random = Random::new(seed);
    let mut sums = Vec::with_capacity(m - 1);
    for _ in 1..m {
        let mut sum = Sum { b: vec![0.0; n], A: vec![0.0; n * n] };
        for (t, q) in orthonormal.iter().enumerate() {
            let sign = random.sign();
            for i in 0..n {
                sum.b[i] += sign * q[i] * rows[t][n];
                (0..n).for_each(|j| sum.A[i * n + j] += sign * q[i] * q[j]);
            }
        }
        sums.push(sum);
    }
    let order = random.permutation(m);
    Ok(SignPerturbedSums { n, q, theta, inverse_gram, root, sums, order })
}

/// Refuses numbers of sums that give no region.
pub(super) fn check(m: usize, q: usize) -> Result<()> {
    if q == 0 || m <= q {
        return Err(Error::argument("q", q, &format!("in [1, m - 1], m being {m}")));
    }
    Ok(())
}

impl SignPerturbedSums {
    /// Whether `theta` is inside.
    pub fn contains(&self, theta: &[f64]) -> Result<bool> {
        if theta.len() != self.n {
            let needed = format!("{} entries", self.n);
            return Err(Error::argument("theta", format!("{} entries", theta.len()), &needed));
        }
        let n = self.n;
        let apart: Vec<f64> = theta.iter().zip(&self.theta).map(|(t, own)| t - own).collect();
        let z: Vec<f64> = (0..n).map(|i| (i..n).map(|j| self.root.at(i, j) * apart[j]).sum()).collect();
        let size = |sum: &Sum| -> f64 {
            let left = |i: usize| sum.b[i] - (0..n).map(|j| sum.A[i * n + j] * z[j]).sum::<f64>();
            (0..n).map(|i| left(i).powi(2)).sum()
        };
        let all: Vec<f64> =
            std::iter::once(z.iter().map(|z| z * z).sum()).chain(self.sums.iter().map(size)).collect();
        Ok(inside(&all, &self.order, self.q))
    }

    /// `r` of the ellipsoid `(theta - theta_hat)' R (theta - theta_hat) <= r` that holds the region; infinite where
    /// the region is not bounded.
    pub fn radius(&self) -> f64 {
        let mut all: Vec<f64> = self.sums.iter().map(|sum| sum.radius(self.n)).collect();
        all.sort_by(|a, b| b.total_cmp(a));
        all[self.q - 1]
    }

    /// Half widths of the ellipsoid along each parameter.
    pub fn half_widths(&self) -> Vec<f64> {
        let r = self.radius();
        (0..self.n).map(|j| (r * self.inverse_gram[j * self.n + j]).sqrt()).collect()
    }
}

/// Whether the first of the sums is not among the `q` largest.
pub(super) fn inside(sums: &[f64], order: &[usize], q: usize) -> bool {
    let larger = |k: &usize| sums[*k] > sums[0] || (sums[*k] == sums[0] && order[*k] > order[0]);
    (1..sums.len()).filter(larger).count() >= q
}

impl Sum {
    /// `max |z|^2` where `|z|^2 <= |b - A z|^2`.
    fn radius(&self, n: usize) -> f64 {
        let (b2, d, c) = self.in_eigenvectors(n);
        let top = d.iter().copied().fold(0.0, f64::max);
        if !(top < 1.0 - 1e-12) {
            return f64::INFINITY;
        }
        let least = 1.0 / (1.0 - top);
        let dual = |l: f64| {
            let terms =
                d.iter().zip(&c).map(|(d, c)| if *c == 0.0 { 0.0 } else { c * c / (l * (1.0 - d) - 1.0) });
            l * b2 + l * l * terms.sum::<f64>()
        };
        // The dual is convex: by golden sections in ln(l - least).
        let at = |x: f64| dual(least + x.exp());
        let (mut low, mut high) = (least.ln() - 40.0, least.ln() + 40.0);
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        for _ in 0..120 {
            let (left, right) = (high - golden * (high - low), low + golden * (high - low));
            if at(left) < at(right) { high = right } else { low = left }
        }
        at(0.5 * (low + high))
    }

    /// `b'b`, the eigenvalues of `A'A`, and `A'b` along its eigenvectors.
    fn in_eigenvectors(&self, n: usize) -> (f64, Vec<f64>, Vec<f64>) {
        let rows = self.A.chunks_exact(n);
        let triangle = Triangle::of_rows(n, rows);
        let V = right_singular_vectors(&triangle);
        let along = |v: &[f64]| -> Vec<f64> {
            self.A.chunks_exact(n).map(|row| row.iter().zip(v).map(|(a, v)| a * v).sum()).collect()
        };
        let images: Vec<Vec<f64>> = V.chunks_exact(n).map(along).collect();
        let d = images.iter().map(|x| x.iter().map(|x| x * x).sum()).collect();
        let c = images.iter().map(|x| x.iter().zip(&self.b).map(|(x, b)| x * b).sum()).collect();
        (self.b.iter().map(|b| b * b).sum(), d, c)
    }
}

/// `x` of `root' x = rhs`.
fn transposed_solve(root: &Triangle, rhs: &[f64]) -> Vec<f64> {
    let mut x = rhs.to_vec();
    for i in 0..x.len() {
        let known: f64 = (0..i).map(|k| root.at(k, i) * x[k]).sum();
        x[i] = (x[i] - known) / root.at(i, i);
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn problem(N: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let (x, e) = (white(N, 2 * seed), white(N, 2 * seed + 1));
        let phi: Vec<f64> = (0..N).flat_map(|t| [x[t], 1.0]).collect();
        // Heavy tails whose size changes from row to row.
        let noise = |t: usize| e[t].powi(3) * (1.0 + t as f64 / N as f64);
        let y = (0..N).map(|t| 0.7 * x[t] + 2.0 + noise(t)).collect();
        (phi, y)
    }

    /// 95 % of 200 regions hold the truth at 40 rows: binomial, sd 1.5 %, three allowed.
    #[test]
    fn regions_hold_the_truth_as_often_as_they_say() {
        let holds = |seed: u64| {
            let (phi, y) = problem(40, seed);
            sign_perturbed_sums(&phi, 2, &y, (100, 5), seed)
                .expect("sums")
                .contains(&[0.7, 2.0])
                .expect("two")
        };
        let held = (1..=200).filter(|&seed| holds(seed)).count();
        assert!((181..=199).contains(&held), "{held} of 200");
    }

    /// No point of a grid is inside the region and outside the ellipsoid; the ellipsoid is not far too large.
    #[test]
    fn the_ellipsoid_holds_the_region() {
        let (phi, y) = problem(60, 5);
        let sums = sign_perturbed_sums(&phi, 2, &y, (20, 1), 3).expect("sums");
        assert!(sums.contains(&sums.theta).expect("two"));
        let (half, r) = (sums.half_widths(), sums.radius());
        let mut furthest = 0.0f64;
        for (i, j) in (0..61 * 61).map(|ij| (ij / 61, ij % 61)) {
            let at = |k: usize| 1.5 * (k as f64 / 30.0 - 1.0);
            let apart = [at(i) * half[0], at(j) * half[1]];
            let theta = [sums.theta[0] + apart[0], sums.theta[1] + apart[1]];
            if !sums.contains(&theta).expect("two") {
                continue;
            }
            let z0 = sums.root.at(0, 0) * apart[0] + sums.root.at(0, 1) * apart[1];
            furthest = furthest.max(z0 * z0 + (sums.root.at(1, 1) * apart[1]).powi(2));
        }
        assert!(furthest <= r * (1.0 + 1e-9) && furthest > 0.7 * r, "{furthest} {r}");
    }

    #[test]
    fn numbers_of_sums_that_give_no_region_are_refused() {
        let (phi, y) = problem(40, 1);
        for (m, q) in [(5, 5), (5, 0), (1, 1)] {
            assert!(sign_perturbed_sums(&phi, 2, &y, (m, q), 1).is_err());
        }
    }
}
