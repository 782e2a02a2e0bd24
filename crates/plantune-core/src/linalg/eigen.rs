//! Eigenvalues of small matrices.

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
