//! Poles by the matrix pencil: the roots of `Y1 - z Y0`, with the Hankel matrix of y taken as of rank k + 1.
//!
//! ```text
//! H = (y[i + j]),  V its first k + 1 right singular vectors,  z = eigenvalues of V0^+ V1
//! ```
//!
//! `V0` and `V1` are `V` without its last and its first row. The root nearest 1 is the constant. Block means of y
//! stand for y: of an exponential they are the same exponential, and white noise falls.
//!
//! Hua and Sarkar, IEEE Trans. ASSP 38, 1990.

use crate::linalg::{Complex, Triangle, eigenvalues, right_singular_vectors};

/// Block means that are kept.
const MOST_MEANS: usize = 120;

/// Right singular vectors of the Hankel matrix of block means; they serve every order.
pub(super) struct Pencil {
    vectors: Vec<f64>, // (width, width) row-major, one vector a row, by falling singular value
    width: usize,
    /// Spacing of the means, s.
    dt: f64,
}

impl Pencil {
    pub(super) fn new(t: &[f64], y: &[f64]) -> Self {
        let each = (y.len() / MOST_MEANS).max(1);
        let means: Vec<f64> =
            y.chunks_exact(each).map(|block| block.iter().sum::<f64>() / each as f64).collect();
        let width = means.len() / 2 + 1;
        let triangle = Triangle::of_rows(width, means.windows(width));
        let dt = t[t.len() - 1] / (t.len() - 1) as f64 * each as f64;
        Pencil { vectors: right_singular_vectors(&triangle), width, dt }
    }

    /// The k poles; None where the record is too short.
    pub(super) fn poles(&self, k: usize) -> Option<Vec<Complex<f64>>> {
        let n = k + 1;
        if self.width < 2 * n {
            return None;
        }
        let row = |i: usize| &self.vectors[i * self.width..][..self.width];
        let last: Vec<f64> = (0..n).map(|i| row(i)[self.width - 1]).collect();
        // V0'V0 = I - v v', v the last row of V: its inverse is I + v v' / (1 - v'v).
        let gap = 1.0 - last.iter().map(|v| v * v).sum::<f64>();
        let shifted: Vec<f64> = (0..n * n)
            .map(|ij| row(ij / n)[..self.width - 1].iter().zip(&row(ij % n)[1..]).map(|(a, b)| a * b).sum())
            .collect();
        let shift: Vec<f64> = (0..n * n)
            .map(|ij| {
                let along: f64 = (0..n).map(|l| last[l] * shifted[l * n + ij % n]).sum();
                shifted[ij] + last[ij / n] * along / gap
            })
            .collect();
        if !shift.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut z: Vec<Complex<f64>> =
            eigenvalues(&shift, n).iter().map(|&(re, im)| Complex::new(re, im)).collect();
        z.sort_by(|a, b| (a - 1.0).norm().total_cmp(&(b - 1.0).norm()));
        Some(z[1..].iter().map(|z| z.ln() / self.dt).collect())
    }
}
