//! Eigenvalues moved inside the unit circle, the Schur vectors kept.

use nalgebra::{Complex, DMatrix};

use super::Matrix;

/// `A` with the eigenvalues beyond `limit < 1` moved: to `1/r` of their radius `r` where that lies within,
/// else onto `limit`; and how many were moved.
pub fn stabilised(A: &Matrix, limit: f64) -> (Matrix, usize) {
    let (Z, mut T) = A.map(|a| Complex::new(a, 0.0)).schur().unpack();
    let mut moved = 0;
    for i in 0..A.nrows() {
        let r = T[(i, i)].norm();
        if r > limit {
            moved += 1;
            T[(i, i)] *= limit.min(1.0 / r) / r;
        }
    }
    if moved == 0 {
        return (A.clone(), 0);
    }
    let back: DMatrix<Complex<f64>> = &Z * T * Z.adjoint();
    (back.map(|a| a.re), moved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::eigenvalues;

    #[test]
    fn what_lies_outside_is_reflected() {
        let A = Matrix::from_row_slice(3, 3, &[1.25, 1.0, 0.3, 0.0, 0.5, -0.2, 0.0, 0.2, 0.5]);
        let (inside, moved) = stabilised(&A, 0.9999);
        let mut poles = eigenvalues(inside.transpose().as_slice(), 3);
        poles.sort_by(|a, b| b.0.total_cmp(&a.0));
        assert_eq!(moved, 1);
        assert!((poles[0].0 - 0.8).abs() < 1e-12 && (poles[1].0 - 0.5).abs() < 1e-12);
        assert!((poles[1].1.abs() - 0.2).abs() < 1e-12);
        let (same, none) = stabilised(&inside, 0.9999);
        assert!(none == 0 && same == inside);
    }
}
