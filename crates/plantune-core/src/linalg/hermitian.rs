//! Inverse of a small Hermitian positive definite matrix by its Cholesky factor, `A = L L*`.

use super::Complex;

/// `A^-1` of the row-major `(n, n)` matrix; None where a pivot of the matrix scaled to a unit diagonal is below
/// `tolerance`: its rows then depend on each other.
pub fn hermitian_inverse(A: &[Complex<f64>], n: usize, tolerance: f64) -> Option<Vec<Complex<f64>>> {
    let zero = Complex::new(0.0, 0.0);
    let size: Vec<f64> = (0..n).map(|i| A[i * n + i].re.sqrt()).collect();
    if size.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let mut L = vec![zero; n * n];
    for i in 0..n {
        for j in 0..=i {
            let known: Complex<f64> = (0..j).map(|k| L[i * n + k] * L[j * n + k].conj()).sum();
            let rest = A[i * n + j] / (size[i] * size[j]) - known;
            if i == j && rest.re <= tolerance {
                return None;
            }
            L[i * n + j] = if i == j { rest.re.sqrt().into() } else { rest / L[j * n + j] };
        }
    }
    // M = L^-1, then A^-1 = M* M, both scales undone.
    let mut M = vec![zero; n * n];
    for j in 0..n {
        M[j * n + j] = L[j * n + j].inv();
        for i in j + 1..n {
            let known: Complex<f64> = (j..i).map(|k| L[i * n + k] * M[k * n + j]).sum();
            M[i * n + j] = -known / L[i * n + i];
        }
    }
    let entry = |i: usize, j: usize| {
        let sum: Complex<f64> = (i.max(j)..n).map(|k| M[k * n + i].conj() * M[k * n + j]).sum();
        sum / (size[i] * size[j])
    };
    Some((0..n * n).map(|ij| entry(ij / n, ij % n)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_times_the_matrix_is_one() {
        let c = Complex::new;
        let A = [
            c(4.0, 0.0),
            c(1.0, 2.0),
            c(0.0, -1.0),
            c(1.0, -2.0),
            c(9e6, 0.0),
            c(3.0, 1.0),
            c(0.0, 1.0),
            c(3.0, -1.0),
            c(2.0, 0.0),
        ]; // rustfmt would put one number on a line
        let inverse = hermitian_inverse(&A, 3, 1e-12).expect("definite");
        for i in 0..3 {
            for j in 0..3 {
                let sum: Complex<f64> = (0..3).map(|k| A[i * 3 + k] * inverse[k * 3 + j]).sum();
                assert!((sum - f64::from(u8::from(i == j))).norm() < 1e-9, "{i} {j}: {sum}");
            }
        }
    }

    #[test]
    fn dependent_rows_have_none() {
        let c = Complex::new;
        let A = [c(1.0, 0.0), c(0.0, 1.0), c(0.0, -1.0), c(1.0, 0.0)];
        assert!(hermitian_inverse(&A, 2, 1e-9).is_none());
    }
}
