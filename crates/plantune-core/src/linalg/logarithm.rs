//! Square root and logarithm of a matrix without eigenvalues at or below zero.
//!
//! ```text
//! Y <- (Y + Z^-1)/2,  Z <- (Z + Y^-1)/2        from Y = M, Z = I:  Y -> M^1/2
//! log M = 2^k log M^(1/2^k),   log(I + …) = 2 (W + W^3/3 + W^5/5 + …),  W = (M - I)(M + I)^-1
//! ```
//!
//! Denman and Beavers 1976; Higham, Functions of Matrices, 2008, 6.3 and 11.5.

use super::Matrix;

/// Distance from the identity below which ten terms of the series are exact to rounding.
const NEAR: f64 = 0.2;
const MOST: i32 = 50;

/// `log M`, the principal one; none where there is none.
pub fn logarithm(M: &Matrix) -> Option<Matrix> {
    let n = M.nrows();
    let one = Matrix::identity(n, n);
    let (mut root, mut halved) = (M.clone(), 0i32);
    while (&root - &one).norm() > NEAR {
        if halved == MOST {
            return None;
        }
        root = square_root(&root)?;
        halved += 1;
    }
    let W = (&root - &one) * (&root + &one).try_inverse()?;
    let square = &W * &W;
    let (mut power, mut sum) = (W, Matrix::zeros(n, n));
    for term in 0..10 {
        sum += &power * (2.0 / (2 * term + 1) as f64);
        power = &power * &square;
    }
    Some(sum * 2f64.powi(halved))
}

fn square_root(M: &Matrix) -> Option<Matrix> {
    let (mut Y, mut Z) = (M.clone(), Matrix::identity(M.nrows(), M.nrows()));
    for _ in 0..MOST {
        let (y, z) = (Y.clone().try_inverse()?, Z.clone().try_inverse()?);
        let next = 0.5 * (&Y + z);
        Z = 0.5 * (&Z + y);
        let step = (&next - &Y).norm();
        Y = next;
        if !(step <= 1e12 * M.norm().max(1.0)) {
            return None;
        }
        if step <= 1e-15 * Y.norm() {
            break;
        }
    }
    ((&Y * &Y - M).norm() <= 1e-9 * M.norm()).then_some(Y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{exponential, white};

    #[test]
    fn the_exponential_of_the_logarithm_is_the_matrix() {
        let A = Matrix::from_vec(5, 5, white(25, 7)) * 0.5;
        let E = Matrix::from_row_slice(5, 5, &exponential(A.transpose().as_slice(), 5));
        assert!((logarithm(&E).expect("near one") - A).norm() < 1e-11);
        assert!(logarithm(&Matrix::from_diagonal_element(2, 2, -0.5)).is_none());
    }
}
