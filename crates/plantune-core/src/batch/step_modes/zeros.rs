//! The numerator of the plant behind a step response from rest.
//!
//! ```text
//! N(s)/D(s) = s Y(s),   y = K + e_1' e^(A t) c from the instant at which the response begins
//! N = K D(s) + s [det(sI - A + c e_1') - det(sI - A)]
//! ```
//!
//! Any multiplicity of the poles; for distinct real ones this is (11) of source 003, as corrected.

use super::sections::Sections;

/// Coefficients of `N(s)/N(0)` in descending powers, `k + 1` of them.
///
/// `level` is what y ends at, counted from rest, and `c` the states when the response begins.
pub(super) fn numerator(sections: &Sections, level: f64, c: &[f64]) -> Vec<f64> {
    let k = sections.order();
    let mut A = sections.matrix();
    let D = characteristic(A.value(), k);
    let mut closed = A.value().to_vec();
    (0..k).for_each(|i| closed[i * k] -= c[i]);
    let shifted = characteristic(&closed, k);
    // s times the difference, whose leading coefficients cancel.
    let term = |i: usize| if i < k { shifted[i + 1] - D[i + 1] } else { 0.0 };
    (0..=k).map(|i| (level * D[i] + term(i)) / (level * D[k])).collect()
}

/// Coefficients of `det(sI - A)` in descending powers (Faddeev and LeVerrier).
fn characteristic(A: &[f64], n: usize) -> Vec<f64> {
    let mut p = vec![1.0];
    let mut M = vec![0.0; n * n];
    for k in 1..=n {
        let last = p[k - 1];
        // M <- A M + p_(k-1) I;  p_k = -tr(A M)/k
        let previous = M.clone();
        for (i, j) in (0..n * n).map(|ij| (ij / n, ij % n)) {
            let product: f64 = (0..n).map(|l| A[i * n + l] * previous[l * n + j]).sum();
            M[i * n + j] = product + if i == j { last } else { 0.0 };
        }
        let trace: f64 = (0..n * n).map(|ij| A[ij] * M[(ij % n) * n + ij / n]).sum();
        p.push(-trace / k as f64);
    }
    p
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::Complex;

    #[test]
    fn a_row_of_lags_has_no_zero() {
        let poles: Vec<Complex<f64>> = [-1.0, -0.5].iter().map(|p| Complex::new(*p, 0.0)).collect();
        let sections = Sections::of(&poles);
        // y = 1 - 2 e^(-t/2) + e^(-t): y(0) = y'(0) = 0, so e_1'c = -1 and e_1'A c = 0.
        let (w, zeta) = (0.5f64.sqrt(), 0.75 / 0.5f64.sqrt());
        assert!((sections.q[1].exp() - zeta).abs() < 1e-12 && (sections.q[0].exp() - w).abs() < 1e-12);
        let n = numerator(&sections, 1.0, &[-1.0, 0.0]);
        assert!(n[0].abs() < 1e-12 && n[1].abs() < 1e-12 && (n[2] - 1.0).abs() < 1e-12, "{n:?}");
    }
}
