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

/// Whether all roots in `z` lie inside the unit circle (Schur and Cohn's recursion); `p[0]` must be 1.
pub fn is_stable(p: &[f64]) -> bool {
    if let [_, c] = p {
        return c.abs() < 1.0;
    }
    let mut p = p.to_vec();
    while p.len() > 1 {
        let k = p[p.len() - 1];
        if !(k.abs() < 1.0) {
            return false;
        }
        let n = p.len() - 1;
        let scale = 1.0 / (1.0 - k * k);
        p = (0..n).map(|i| (p[i] - k * p[n - i]) * scale).collect();
    }
    true
}

/// Whether all roots in s lie in the left half-plane, coefficients in descending powers (Routh's array): of
/// second order where all coefficients have one sign, of third order where `a1 a2 > a0 a3` as well.
///
/// Source 001, (3.4-18) and (3.4-23).
pub fn is_hurwitz(p: &[f64]) -> bool {
    let sign = p[0].signum();
    if p.iter().any(|&c| !(c * sign > 0.0)) {
        return false;
    }
    let row = |first: usize| p.iter().skip(first).step_by(2).map(|c| c * sign).collect::<Vec<f64>>();
    let (mut above, mut row) = (row(0), row(1));
    while !row.is_empty() {
        if !(row[0] > 0.0) {
            return false;
        }
        let at = |r: &[f64], k: usize| r.get(k).copied().unwrap_or(0.0);
        let ratio = above[0] / row[0];
        let next: Vec<f64> = (1..above.len()).map(|k| above[k] - ratio * at(&row, k)).collect();
        (above, row) = (row, next);
    }
    true
}

/// `p(q)` with its roots outside the unit circle reflected into it, and those on it drawn in a little.
pub fn reflected(p: &[f64]) -> Vec<f64> {
    let inside = |(re, im): (f64, f64)| {
        let size = re.hypot(im);
        let factor = if size < INNERMOST { 1.0 } else { (1.0 / size).min(INNERMOST) / size };
        (re * factor, im * factor)
    };
    let mut out = vec![1.0];
    for (re, im) in roots(p).into_iter().map(inside) {
        if im == 0.0 {
            out = product(&out, &[1.0, -re]);
        } else if im > 0.0 {
            out = product(&out, &[1.0, -2.0 * re, re * re + im * im]);
        }
    }
    out.resize(p.len(), 0.0);
    out
}

/// Largest root of a reflected polynomial.
const INNERMOST: f64 = 1.0 - 1e-6;

/// An impulse response below this is over.
const DECAYED: f64 = 1e-100;

/// `y = x / p(q)` in place, from rest; `p[0]` must be 1.
pub fn divide(p: &[f64], x: &mut [f64]) {
    (0..x.len()).for_each(|k| divide_row(p, x, k));
}

fn divide_row(p: &[f64], x: &mut [f64], k: usize) {
    let past = p.iter().enumerate().skip(1).take(k);
    x[k] -= past.map(|(i, c)| c * x[k - i]).sum::<f64>();
}

/// `y = p(q) x`, from rest.
pub fn multiply(p: &[f64], x: &[f64]) -> Vec<f64> {
    (0..x.len()).map(|k| p.iter().take(k + 1).enumerate().map(|(i, c)| c * x[k - i]).sum()).collect()
}

/// The first `len` terms of `numerator(q) / denominator(q)`, zero from where they would be denormal numbers, on
/// which processors are slow.
pub fn impulse(numerator: &[f64], denominator: &[f64], len: usize) -> Vec<f64> {
    let mut g = vec![0.0; len];
    for (slot, &c) in g.iter_mut().zip(numerator) {
        *slot = c;
    }
    for k in 0..len {
        let past = (k + 1).saturating_sub(denominator.len())..k;
        if k >= numerator.len() && g[past].iter().all(|x| x.abs() < DECAYED) {
            break;
        }
        divide_row(denominator, &mut g, k);
    }
    g
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn routh_agrees_with_the_roots() {
        for (p, stable) in [
            (vec![1.0, 2.0], true),
            (vec![-1.0, 2.0], false),
            (vec![1.0, 2.0, 3.0], true),
            (vec![1.0, 2.0, 3.0, 5.9], true),
            (vec![1.0, 2.0, 3.0, 6.1], false),
            (vec![-1.0, -2.0, -3.0, -5.9], true),
            (vec![1.0, 4.0, 6.0, 4.0, 1.0], true),
            (vec![1.0, 0.0, 1.0], false),
        ] {
            assert_eq!(is_hurwitz(&p), stable, "{p:?}");
        }
    }

    #[test]
    fn an_impulse_response_ends_before_it_is_denormal() {
        let (b, f) = ([0.0, 0.0, 1.0, 0.5], [1.0, -1.2, 0.35]);
        let mut whole = vec![0.0; 3000];
        whole[..4].copy_from_slice(&b);
        divide(&f, &mut whole);
        let own = impulse(&b, &f, 3000);
        assert!(own.iter().zip(&whole).all(|(a, b)| (a - b).abs() <= 1e-100));
        assert!(own.iter().all(|x| *x == 0.0 || x.is_normal()));
        assert_eq!(impulse(&b, &[1.0], 6), [0.0, 0.0, 1.0, 0.5, 0.0, 0.0]);
    }

    #[test]
    fn roots_of_a_product_are_the_factors() {
        let p = product(&product(&[1.0, -0.9], &[1.0, 0.5]), &[2.0, 0.0, 0.0]);
        let mut r = roots(&p);
        r.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert!((r[0].0 + 0.5).abs() < 1e-12 && (r[1].0 - 0.9).abs() < 1e-12);
    }

    #[test]
    fn reflection_keeps_the_spectrum_but_for_a_factor() {
        let p = product(&[1.0, -1.25], &product(&[1.0, 0.5], &[1.0, -2.4, 1.69]));
        let r = reflected(&p);
        assert!(!is_stable(&p) && is_stable(&r));
        let ratio = |w: f64| {
            let z = Complex::from_polar(1.0, w);
            at(&p, z).norm() / at(&r, z).norm()
        };
        for w in [0.1, 0.7, 2.0, 3.1] {
            assert!((ratio(w) / (1.25 * 1.69) - 1.0).abs() < 1e-10, "{w} {}", ratio(w));
        }
        assert!(is_stable(&reflected(&[1.0, -1.0])) && is_stable(&[1.0, -1.8, 0.81]));
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
