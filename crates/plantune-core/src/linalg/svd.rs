//! Singular values by one-sided Jacobi rotations, and the least squares solutions and inverses that follow.
//!
//! ```text
//! rotate columns p, q of W = M V until all are at right angles:  S = their lengths, U = W / S
//! zeta = (|q|^2 - |p|^2)/(2 p'q),  t = sign(zeta)/(|zeta| + sqrt(1 + zeta^2)),  c = 1/sqrt(1 + t^2), s = c t
//! ```
//!
//! Of a tall matrix `M` is its triangle, transposed, which needs fewer sweeps. Small singular values keep their
//! digits, and equal ones are no special case: the bidiagonal iteration of the matrix crate was 3e-5 off on
//! orthonormal columns that had lost a row. Hestenes 1958; Drmač and Veselić, SIAM J. Matrix Anal. 29, 2008.

use nalgebra::DMatrix;

use super::kernel::dot;
use super::qr::Triangle;

/// A dense matrix.
pub type Matrix = DMatrix<f64>;

/// `M = U diag(S) Vt`, the singular values falling.
pub struct Svd {
    /// Left vectors, one a column.
    pub U: Matrix,
    /// Singular values.
    pub S: Vec<f64>,
    /// Right vectors, one a row.
    pub Vt: Matrix,
}

/// Sweeps after which nothing rotates any more, by a wide margin.
const MOST_SWEEPS: usize = 60;

/// The thin singular value decomposition; vectors that belong to zero are zero.
pub fn svd(M: &Matrix) -> Svd {
    if M.nrows() < M.ncols() {
        let Svd { U, S, Vt } = svd(&M.transpose());
        return Svd { U: Vt.transpose(), S, Vt: U.transpose() };
    }
    // M = Q R, R' = W V': the columns of R' rotated.
    let (Q, R) = M.clone().qr().unpack();
    let (right, S, left) = rotated(R.transpose());
    Svd { U: Q * left, S, Vt: right.transpose() }
}

/// Left vectors, lengths by falling size, right vectors of a square matrix.
fn rotated(mut W: Matrix) -> (Matrix, Vec<f64>, Matrix) {
    let n = W.ncols();
    let mut V = Matrix::identity(n, n);
    for _ in 0..MOST_SWEEPS {
        let mut moved = false;
        for p in 0..n {
            for q in p + 1..n {
                if let Some((c, s)) = rotation(column(&W, p), column(&W, q)) {
                    rotate(&mut W, p, q, c, s);
                    rotate(&mut V, p, q, c, s);
                    moved = true;
                }
            }
        }
        if !moved {
            break;
        }
    }
    let lengths: Vec<f64> = W.column_iter().map(|w| w.norm()).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| lengths[b].total_cmp(&lengths[a]));
    let S: Vec<f64> = order.iter().map(|&j| lengths[j]).collect();
    let unit = |s: f64| if s > 0.0 { 1.0 / s } else { 0.0 };
    let U = Matrix::from_fn(n, n, |i, j| W[(i, order[j])] * unit(S[j]));
    (U, S, Matrix::from_fn(n, n, |i, j| V[(i, order[j])]))
}

/// Cosine and sine that bring two columns to right angles; none where they are.
fn rotation(p: &[f64], q: &[f64]) -> Option<(f64, f64)> {
    let (pp, qq, pq) = (dot(p, p), dot(q, q), dot(p, q));
    if pq.abs() <= 2.0 * f64::EPSILON * (p.len() as f64 * pp * qq).sqrt() {
        return None;
    }
    let zeta = (qq - pp) / (2.0 * pq);
    let t = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
    let c = 1.0 / (1.0 + t * t).sqrt();
    Some((c, c * t))
}

fn column(M: &Matrix, j: usize) -> &[f64] {
    &M.as_slice()[j * M.nrows()..][..M.nrows()]
}

fn rotate(M: &mut Matrix, p: usize, q: usize, c: f64, s: f64) {
    let rows = M.nrows();
    let (left, right) = M.as_mut_slice().split_at_mut(q * rows);
    for (x, y) in left[p * rows..][..rows].iter_mut().zip(&mut right[..rows]) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
}

/// The left singular vectors and values of a wide matrix, from the triangle of its transpose.
pub fn left_singular(M: &Matrix) -> (Matrix, Vec<f64>) {
    let Svd { U, S, .. } = svd(M);
    (U, S)
}

/// Powers of a symmetric matrix without negative eigenvalues; those below `floor` of the largest count as that.
pub fn symmetric_powers<const K: usize>(P: &Matrix, powers: [f64; K], floor: f64) -> [Matrix; K] {
    let Svd { U, S, .. } = svd(P);
    let most = S.first().copied().unwrap_or(0.0);
    powers.map(|p| {
        let size = |j: usize| S[j].max(floor * most).powf(p);
        Matrix::from_fn(U.nrows(), U.ncols(), |i, j| U[(i, j)] * size(j)) * U.transpose()
    })
}

/// `M L^+` of a lower triangle; by substitution where no diagonal is below `tolerance` of the largest.
pub fn over_triangle(M: &Matrix, L: &Matrix, tolerance: f64) -> Matrix {
    let diagonal = L.diagonal().map(f64::abs);
    let solved = (diagonal.min() > tolerance * diagonal.max())
        .then(|| L.transpose().solve_upper_triangular(&M.transpose()))
        .flatten();
    solved.map_or_else(|| M * pseudo_inverse(L, tolerance), |X| X.transpose())
}

/// `L = R'` of a triangle.
pub fn lower(triangle: &Triangle) -> Matrix {
    Matrix::from_fn(triangle.n(), triangle.n(), |i, j| triangle.at(j, i))
}

/// `X` that minimises `|A X - B|`, the smallest one where there are several; what lies below `tolerance` times
/// the largest singular value counts as zero.
pub fn least_squares(A: &Matrix, B: &Matrix, tolerance: f64) -> Matrix {
    let size: Vec<f64> = A.column_iter().map(|c| c.norm()).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
    let scaled = Matrix::from_fn(A.nrows(), A.ncols(), |i, j| A[(i, j)] / size[j]);
    let mut X = pseudo_inverse(&scaled, tolerance) * B;
    X.row_iter_mut().zip(&size).for_each(|(mut row, s)| row /= *s);
    X
}

/// `A^+`; what lies below `tolerance` times the largest singular value counts as zero.
pub fn pseudo_inverse(A: &Matrix, tolerance: f64) -> Matrix {
    let Svd { U, S, Vt } = svd(A);
    let most = S.first().copied().unwrap_or(0.0);
    let inverse = |s: f64| if s > tolerance * most { 1.0 / s } else { 0.0 };
    let scaled = Matrix::from_fn(U.ncols(), U.nrows(), |i, j| U[(j, i)] * inverse(S[i]));
    Vt.tr_mul(&scaled)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    #[test]
    fn the_parts_make_the_matrix() {
        let M = Matrix::from_vec(5, 9, white(45, 3));
        let Svd { U, S, Vt } = svd(&M);
        assert!(S.windows(2).all(|s| s[0] >= s[1]));
        let again = U * Matrix::from_diagonal(&S.clone().into()) * Vt;
        assert!((again - &M).norm() < 1e-13);
        let (left, values) = left_singular(&M);
        assert!(values.iter().zip(&S).all(|(a, b)| (a - b).abs() < 1e-13));
        assert!(
            (&left * Matrix::from_diagonal(&values.into()).map(|s| s * s) * left.transpose()
                - &M * M.transpose())
            .norm()
                < 1e-12
        );
    }

    /// Singular values 1, 1, 1 and one that follows from the row that is missing.
    #[test]
    fn equal_singular_values_keep_their_digits() {
        let (Q, _) = Matrix::from_vec(15, 4, white(60, 8)).qr().unpack();
        let lost = Q.row(14).norm_squared();
        let Svd { S, .. } = svd(&Q.rows(0, 14).into_owned());
        assert!(S[..3].iter().all(|s| (s - 1.0).abs() < 1e-14));
        assert!((S[3] - (1.0 - lost).sqrt()).abs() < 1e-14);
        let short = Q.rows(0, 14).into_owned();
        let inverse = pseudo_inverse(&short, 1e-14);
        assert!((inverse * short - Matrix::identity(4, 4)).norm() < 1e-14);
    }

    #[test]
    fn a_root_squared_is_the_matrix() {
        let M = Matrix::from_vec(6, 9, white(54, 5));
        let P = &M * M.transpose();
        let [root] = symmetric_powers(&P, [0.5], 0.0);
        assert!((&root * &root - &P).norm() < 1e-12 * P.norm());
    }

    #[test]
    fn a_quotient_by_a_triangle_times_it_is_the_dividend() {
        let mut L = Matrix::from_vec(6, 6, white(36, 4)).lower_triangle();
        let M = Matrix::from_vec(2, 6, white(12, 6));
        assert!((over_triangle(&M, &L, 1e-12) * &L - &M).norm() < 1e-10);
        L.row_mut(3).fill(0.0);
        let X = over_triangle(&M, &L, 1e-12);
        assert!(((X * &L - M) * L.transpose()).norm() < 1e-10);
    }

    #[test]
    fn least_squares_leaves_an_error_at_right_angles() {
        let (A, B) = (Matrix::from_vec(12, 4, white(48, 1)), Matrix::from_vec(12, 2, white(24, 2)));
        let X = least_squares(&A, &B, 1e-12);
        assert!(A.tr_mul(&(&A * X - B)).norm() < 1e-12);
    }
}
