//! Eigenvalues and exponentials of small matrices.

use nalgebra::DMatrix;

/// Eigenvalues `(real, imaginary)` of a square matrix, row-major.
pub fn eigenvalues(a: &[f64], n: usize) -> Vec<(f64, f64)> {
    let a = DMatrix::from_row_slice(n, n, a);
    a.complex_eigenvalues().iter().map(|z| (z.re, z.im)).collect()
}

/// Eigenvalues of a symmetric matrix, ascending.
pub fn symmetric_eigenvalues(a: &[f64], n: usize) -> Vec<f64> {
    let a = DMatrix::from_row_slice(n, n, a);
    let mut values: Vec<f64> = a.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Exponential of a square matrix, row-major; Padé with scaling and squaring.
pub fn exponential(a: &[f64], n: usize) -> Vec<f64> {
    let e = DMatrix::from_row_slice(n, n, a).exp();
    (0..n * n).map(|ij| e[(ij / n, ij % n)]).collect()
}
