//! QR of a matrix with many columns, by blocks of reflections, for matrix products run faster than single ones.
//!
//! ```text
//! H_1 … H_b = I - V T V',   T upper: T_jj = tau_j,  T_(0..j, j) = -tau_j T V' v_j
//! C <- C - V T' (V' C)                                            the columns behind the block
//! ```
//!
//! [`super::qr`] keeps a triangle per register lane and is the faster one while columns are few beside rows.
//! Schreiber and Van Loan, SIAM J. Sci. Stat. Comput. 10, 1989; LAPACK dgeqrf.

use super::{Matrix, Triangle, dot};

/// Reflections in a block.
const BLOCK: usize = 24;

/// Triangle of the QR of `M`, whose rows may be fewer than its columns.
pub fn triangle_of(mut M: Matrix) -> Triangle {
    let (rows, n) = M.shape();
    for first in (0..n.min(rows)).step_by(BLOCK) {
        let b = BLOCK.min(n.min(rows) - first);
        let (V, T) = panel(&mut M, first, b);
        let behind = first + b;
        if behind < n {
            let mut C = M.view_mut((first, behind), (rows - first, n - behind));
            let W = T.transpose() * (V.transpose() * &C);
            C.gemm(-1.0, &V, &W, 1.0);
        }
    }
    let entry = |i: usize, j: usize| if i <= j && i < rows { M[(i, j)] } else { 0.0 };
    Triangle::of_upper(n, (0..n * n).map(|ij| entry(ij / n, ij % n)).collect())
}

/// Reflects `b` columns from `first` on; the vectors `V` and the triangle `T` of their product.
fn panel(M: &mut Matrix, first: usize, b: usize) -> (Matrix, Matrix) {
    let rows = M.nrows();
    let height = rows - first;
    let (mut V, mut T) = (Matrix::zeros(height, b), Matrix::zeros(b, b));
    for j in 0..b {
        let below = &M.as_slice()[(first + j) * rows..][first + j..rows];
        let (top, norm) = (below[0], dot(below, below).sqrt());
        if norm == 0.0 {
            continue; // T_jj = 0: no reflection
        }
        let beta = -norm.copysign(top);
        let tau = (beta - top) / beta;
        let mut v = vec![0.0; height];
        v[j] = 1.0;
        v[j + 1..].iter_mut().zip(&below[1..]).for_each(|(v, x)| *v = x / (top - beta));
        for column in M.as_mut_slice()[(first + j) * rows..(first + b) * rows].chunks_exact_mut(rows) {
            let x = &mut column[first + j..];
            let w = tau * dot(&v[j..], x);
            x.iter_mut().zip(&v[j..]).for_each(|(x, v)| *x -= w * v);
        }
        let along: Vec<f64> = (0..j).map(|i| dot(&V.as_slice()[i * height..][..height], &v)).collect();
        for i in 0..j {
            T[(i, j)] = -tau * (i..j).map(|k| T[(i, k)] * along[k]).sum::<f64>();
        }
        T[(j, j)] = tau;
        V.column_mut(j).copy_from_slice(&v);
    }
    (V, T)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    #[test]
    fn the_triangle_keeps_the_gram_matrix() {
        for (rows, n) in [(200, 60), (60, 60), (40, 60), (100, 7), (30, 24), (1, 3)] {
            let mut M = Matrix::from_vec(rows, n, white(rows * n, 2));
            if n > 6 {
                M.column_mut(5).fill(0.0);
            }
            let gram = M.tr_mul(&M);
            let R = triangle_of(M);
            let R = Matrix::from_fn(n, n, |i, j| R.at(i, j));
            assert!((R.tr_mul(&R) - &gram).norm() < 1e-13 * gram.norm(), "{rows} {n}");
        }
    }
}
