//! Polynomials in `q^-1`, coefficients in ascending powers: `p[0] + p[1] q^-1 + …`.

use crate::linalg::{Complex, eigenvalues};

/// `a(q) b(q)`.
pub fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut c = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            c[i + j] += x * y;
        }
    }
    c
}

/// `p(q)` at `q^-1 = z^-1`.
pub fn at(p: &[f64], z: Complex<f64>) -> Complex<f64> {
    let w = z.inv();
    p.iter().rev().fold(Complex::new(0.0, 0.0), |sum, &c| sum * w + c)
}

/// `p(1)`.
pub fn at_one(p: &[f64]) -> f64 {
    p.iter().sum()
}

/// Roots in `z` of `p(q)`, zeros at the origin from trailing zero coefficients left out.
pub fn roots(p: &[f64]) -> Vec<(f64, f64)> {
    let first = p.iter().position(|&c| c != 0.0).unwrap_or(p.len());
    let last = p.iter().rposition(|&c| c != 0.0).map_or(first, |k| k + 1);
    let p = &p[first..last.max(first)];
    if p.len() < 2 {
        return Vec::new();
    }
    let n = p.len() - 1;
    let mut companion = vec![0.0; n * n];
    for j in 0..n {
        companion[j] = -p[j + 1] / p[0];
    }
    for i in 1..n {
        companion[i * n + i - 1] = 1.0;
    }
    eigenvalues(&companion, n)
}

/// `y = x / p(q)` in place, from rest; `p[0]` must be 1.
pub fn divide(p: &[f64], x: &mut [f64]) {
    for k in 0..x.len() {
        let mut y = x[k];
        for (i, c) in p.iter().enumerate().skip(1).take(k) {
            y -= c * x[k - i];
        }
        x[k] = y;
    }
}

/// `y = p(q) x`, from rest.
pub fn multiply(p: &[f64], x: &[f64]) -> Vec<f64> {
    (0..x.len()).map(|k| p.iter().take(k + 1).enumerate().map(|(i, c)| c * x[k - i]).sum()).collect()
}

/// The first `len` terms of `numerator(q) / denominator(q)`.
pub fn impulse(numerator: &[f64], denominator: &[f64], len: usize) -> Vec<f64> {
    let mut g = vec![0.0; len];
    for (slot, &c) in g.iter_mut().zip(numerator) {
        *slot = c;
    }
    divide(denominator, &mut g);
    g
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_a_product_are_the_factors() {
        let p = product(&product(&[1.0, -0.9], &[1.0, 0.5]), &[2.0, 0.0, 0.0]);
        let mut r = roots(&p);
        r.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert!((r[0].0 + 0.5).abs() < 1e-12 && (r[1].0 - 0.9).abs() < 1e-12);
    }

    #[test]
    fn dividing_undoes_multiplying() {
        let p = [1.0, -1.2, 0.5];
        let x: Vec<f64> = (0..30).map(|k| (f64::from(k) * 0.7).sin()).collect();
        let mut y = multiply(&p, &x);
        divide(&p, &mut y);
        assert!(x.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
