//! Eigenvalues, singular vectors and exponentials of small matrices.

use nalgebra::{DMatrix, DVector};

use super::qr::Triangle;

/// Eigenvalues `(real, imaginary)` of a square matrix, row-major.
pub fn eigenvalues(a: &[f64], n: usize) -> Vec<(f64, f64)> {
    if n == 0 {
        return Vec::new();
    }
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

/// Right singular vectors of the matrix behind a triangle, one a row, by falling singular value; `(n, n)`.
pub fn right_singular_vectors(triangle: &Triangle) -> Vec<f64> {
    let n = triangle.n();
    let r = DMatrix::from_fn(n, n, |i, j| triangle.at(i, j));
    let V = r.svd(false, true).v_t.unwrap_or_else(|| DMatrix::identity(n, n));
    (0..n * n).map(|ij| V[(ij / n, ij % n)]).collect()
}

/// Singular values of the scaled columns `R[:, ..n] / scale` of a triangle, and its last column seen from them.
pub struct Singular {
    /// Largest first.
    pub values: Vec<f64>,
    /// `U'` times the last column.
    pub rhs: Vec<f64>,
    v_t: DMatrix<f64>,
}

impl Singular {
    /// Of the first `scale.len()` columns.
    pub fn of(triangle: &Triangle, scale: &[f64]) -> Self {
        let n = scale.len();
        let svd = DMatrix::from_fn(n, n, |i, j| triangle.at(i, j) / scale[j]).svd(true, true);
        let (u, v_t) = (svd.u.unwrap_or_default(), svd.v_t.unwrap_or_default());
        let rhs = DVector::from_fn(n, |i, _| triangle.at(i, n));
        Singular {
            values: svd.singular_values.iter().copied().collect(),
            rhs: u.tr_mul(&rhs).iter().copied().collect(),
            v_t,
        }
    }

    /// `V z`
    pub fn right(&self, z: &[f64]) -> Vec<f64> {
        self.v_t.tr_mul(&DVector::from_column_slice(z)).iter().copied().collect()
    }
}
