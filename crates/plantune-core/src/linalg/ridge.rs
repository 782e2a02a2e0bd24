//! A ridge problem at every scale of its prior, from one bidiagonal form.
//!
//! ```text
//! y = X x + e,  x ~ N(0, c I),  e ~ N(0, I):   y ~ N(0, I + c X X')
//! X = U [B; 0] V',  f = U'y:   y'(I + c X X')^-1 y = min |sqrt(c) B z - f|^2 + |z|^2 + rest
//! ```
//!
//! Householder reflections from both sides make `B` bidiagonal once; then plane rotations bring
//! `[sqrt(c) B; I]` to a triangle in `O(n)` for each `c`, and nothing is squared on the way.
//!
//! L. Eldén, BIT 17 (1977); Golub and Kahan, SIAM J. Numer. Anal. 2 (1965).

use super::kernel::{dot, vectorised};

/// The bidiagonal form of a matrix, and a right-hand side seen from it.
pub struct Ridge {
    diagonal: Vec<f64>, // (n)
    above: Vec<f64>,    // (n - 1)
    f: Vec<f64>,        // (n)
    /// Squared length of what the columns cannot reach.
    rest: f64,
}

impl Ridge {
    /// Of `x`, column-major with `y.len()` rows, which are at least as many as its columns.
    pub fn new(mut x: Vec<f64>, mut y: Vec<f64>) -> Self {
        let rows = y.len();
        let n = x.len() / rows;
        let (mut diagonal, mut above) = (vec![0.0; n], vec![0.0; n.saturating_sub(1)]);
        let (mut row, mut w) = (vec![0.0; n], vec![0.0; rows]);
        for k in 0..n {
            diagonal[k] = from_the_left(&mut x, rows, k, &mut y);
            if k + 1 < n {
                above[k] = from_the_right(&mut x, rows, k, &mut row, &mut w);
            }
        }
        let rest = y[n..].iter().map(|y| y * y).sum();
        y.truncate(n);
        Ridge { diagonal, above, f: y, rest }
    }

    /// `ln |I + c X X'|` and `y'(I + c X X')^-1 y`.
    pub fn at(&self, c: f64) -> (f64, f64) {
        let root = c.sqrt();
        let (mut ln_det, mut product, mut left) = (0.0, 1.0f64, self.rest);
        let (mut below, mut rhs) = (1.0f64, 0.0);
        for (k, (d, f)) in self.diagonal.iter().zip(&self.f).enumerate() {
            let (a, b) = (root * d, root * self.above.get(k).copied().unwrap_or(0.0));
            // The row of B and the one below it: [a b | f], [below 0 | rhs].
            let rho2 = a * a + below * below;
            let rho = rho2.sqrt();
            let (cos, sin) = (a / rho, below / rho);
            let passed = cos * rhs - sin * f;
            product *= rho2;
            if !(1e-100..1e100).contains(&product) {
                ln_det += product.ln();
                product = 1.0;
            }
            // What is left of them, and the next row of I: [-sin b | passed], [1 | 0].
            let next2 = 1.0 + (sin * b).powi(2);
            left += passed * passed / next2;
            (below, rhs) = (next2.sqrt(), -sin * b * passed / next2.sqrt());
        }
        (ln_det + product.ln(), left)
    }
}

/// Reflects column `k` onto its diagonal, and the columns right of it and `y` with it.
fn from_the_left(x: &mut [f64], rows: usize, k: usize, y: &mut [f64]) -> f64 {
    let (head, tail) = x.split_at_mut((k + 1) * rows);
    let v = &mut head[k * rows + k..];
    let norm = dot(v, v).sqrt();
    if norm == 0.0 {
        return 0.0;
    }
    let diagonal = -norm.copysign(v[0]);
    let beta = norm * (norm + v[0].abs());
    v[0] -= diagonal;
    let reflect = |to: &mut [f64]| {
        let by = dot(v, to) / beta;
        vectorised(|| to.iter_mut().zip(v.iter()).for_each(|(t, v)| *t -= by * v));
    };
    tail.chunks_exact_mut(rows).for_each(|column| reflect(&mut column[k..]));
    reflect(&mut y[k..]);
    diagonal
}

/// Reflects row `k` right of its diagonal onto the first of it, and the rows below with it.
fn from_the_right(x: &mut [f64], rows: usize, k: usize, v: &mut [f64], w: &mut [f64]) -> f64 {
    let v = &mut v[k + 1..];
    v.iter_mut().zip(x[(k + 1) * rows..].chunks_exact(rows)).for_each(|(v, column)| *v = column[k]);
    let norm = dot(v, v).sqrt();
    if norm == 0.0 {
        return 0.0;
    }
    let above = -norm.copysign(v[0]);
    let beta = norm * (norm + v[0].abs());
    v[0] -= above;
    let w = &mut w[k + 1..rows];
    vectorised(|| {
        w.fill(0.0);
        for (column, v) in x[(k + 1) * rows..].chunks_exact(rows).zip(v.iter()) {
            w.iter_mut().zip(&column[k + 1..]).for_each(|(w, x)| *w += v * x);
        }
        for (column, v) in x[(k + 1) * rows..].chunks_exact_mut(rows).zip(v.iter()) {
            let by = v / beta;
            column[k + 1..].iter_mut().zip(w.iter()).for_each(|(x, w)| *x -= by * w);
        }
    });
    above
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{symmetric_eigenvalues, white};

    /// Against the eigenvalues of `X X'` and the normal equations of the small problem.
    #[test]
    fn determinant_and_form_are_those_of_the_covariance() {
        let (rows, n) = (9, 6);
        let (x, y) = (white(rows * n, 1), white(rows, 2));
        let gram: Vec<f64> = (0..rows * rows)
            .map(|ij| (0..n).map(|j| x[j * rows + ij / rows] * x[j * rows + ij % rows]).sum())
            .collect();
        let ridge = Ridge::new(x, y.clone());
        for c in [1e-3, 1.0, 1e4] {
            let covariance: Vec<f64> =
                (0..rows * rows).map(|ij| c * gram[ij] + f64::from(ij / rows == ij % rows)).collect();
            let det: f64 = symmetric_eigenvalues(&covariance, rows).iter().map(|w| w.ln()).sum();
            let solved = crate::linalg::left_divide(&covariance, &y, rows).expect("regular");
            let (ln_det, form) = ridge.at(c);
            assert!((ln_det - det).abs() < 1e-9, "{ln_det} {det}");
            assert!((form - dot(&y, &solved)).abs() < 1e-9 * dot(&y, &y), "{form}");
        }
    }

    #[test]
    fn columns_of_zeros_reach_nothing() {
        let (ln_det, form) = Ridge::new(vec![0.0; 8], vec![1.0, 2.0, 0.0, 0.0]).at(3.0);
        assert!((ln_det, form) == (0.0, 5.0));
    }
}
