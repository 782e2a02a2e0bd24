//! Discrete Riccati and Lyapunov equations by doubling.
//!
//! ```text
//! P = A P A' + Q - (A P C' + S)(C P C' + R)^-1 (A P C' + S)'     K = (A P C' + S)(C P C' + R)^-1
//! X = A X A' + Q
//! ```
//!
//! With `A_0 = (A - S R^-1 C)'`, `G_0 = C' R^-1 C`, `H_0 = Q - S R^-1 S'` the structured doubling
//!
//! ```text
//! W = (I + G H)^-1,   A <- A W A,   G <- G + A W G A',   H <- H + A' H W A
//! ```
//!
//! squares the closed loop at each step, so `H -> P` quadratically. Chu, Fan, Lin and Wang, Int. J. Control
//! 77, 2004; Smith 1968 for the linear equation.

use super::Matrix;

/// Doublings after which an eigenvalue within 1e-15 of the unit circle would have settled.
const MOST: usize = 60;

/// The stabilising `P`, and the gain `K`; none where `R` is singular or the doubling does not settle.
pub fn kalman_gain(A: &Matrix, C: &Matrix, Q: &Matrix, R: &Matrix, S: &Matrix) -> Option<(Matrix, Matrix)> {
    let by_R = R.clone().try_inverse()?;
    let mut a = (A - S * &by_R * C).transpose();
    let mut g = C.tr_mul(&(&by_R * C));
    let mut h = Q - S * &by_R * S.transpose();
    let n = A.nrows();
    for _ in 0..MOST {
        let w = (Matrix::identity(n, n) + &g * &h).try_inverse()?;
        let step = a.tr_mul(&(&h * &w * &a));
        let aw = &a * &w;
        g += &aw * &g * a.transpose();
        a = &aw * &a;
        h += &step;
        h = 0.5 * (&h + h.transpose());
        if step.norm() <= 1e-15 * h.norm() {
            let along = A * &h * C.transpose() + S;
            let K = along * (C * &h * C.transpose() + R).try_inverse()?;
            return K.iter().all(|k| k.is_finite()).then_some((h, K));
        }
    }
    None
}

/// `X = A X A' + Q` of a stable `A`; none where it does not settle.
pub fn lyapunov(A: &Matrix, Q: &Matrix) -> Option<Matrix> {
    let (mut power, mut X) = (A.clone(), Q.clone());
    for _ in 0..MOST {
        let step = &power * &X * power.transpose();
        X += &step;
        power = &power * &power;
        if step.norm() <= 1e-16 * X.norm() {
            return X.norm().is_finite().then(|| 0.5 * (&X + X.transpose()));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{eigenvalues, white};

    fn plant(n: usize) -> Matrix {
        let A = Matrix::from_vec(n, n, white(n * n, 4));
        let most =
            eigenvalues(A.transpose().as_slice(), n).iter().map(|p| p.0.hypot(p.1)).fold(0.0, f64::max);
        A * (0.97 / most)
    }

    #[test]
    fn the_gain_solves_its_equation_and_is_stable() {
        let (n, l) = (5, 2);
        let (A, C) = (plant(n), Matrix::from_vec(l, n, white(l * n, 5)));
        let noise = Matrix::from_vec(n + l, 40, white((n + l) * 40, 6));
        let cov = &noise * noise.transpose() / 40.0;
        let (Q, S, R) = (
            cov.view((0, 0), (n, n)).into_owned(),
            cov.view((0, n), (n, l)).into_owned(),
            cov.view((n, n), (l, l)).into_owned(),
        );
        let (P, K) = kalman_gain(&A, &C, &Q, &R, &S).expect("settles");
        let left = &A * &P * A.transpose() + &Q - &K * (&C * &P * C.transpose() + &R) * K.transpose();
        assert!((left - &P).norm() < 1e-12 * P.norm());
        let loops = (&A - &K * &C).transpose();
        assert!(eigenvalues(loops.as_slice(), n).iter().all(|p| p.0.hypot(p.1) < 1.0));
    }

    #[test]
    fn the_gramian_solves_its_equation() {
        let A = plant(6);
        let B = Matrix::from_vec(6, 2, white(12, 9));
        let Q = &B * B.transpose();
        let X = lyapunov(&A, &Q).expect("stable");
        assert!((&A * &X * A.transpose() + Q - &X).norm() < 1e-12 * X.norm());
        assert!(lyapunov(&(1.1 * plant(3)), &Matrix::identity(3, 3)).is_none());
    }
}
