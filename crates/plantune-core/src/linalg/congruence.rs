//! The delta rule: the covariance of functions from that of what they are functions of.
//!
//! ```text
//! x = f(theta),   Cov x = J Cov theta J',   J the rows of derivatives
//! ```

/// `J P J'` for the rows of `J`; `P(i, j)` gives the covariance of what the columns stand for. Row-major.
///
/// ```
/// use plantune_core::linalg::congruence;
///
/// // The variance of a sum: var a + var b + 2 cov.
/// let P = [[4.0, 1.0], [1.0, 9.0]];
/// assert_eq!(congruence(&[[1.0, 1.0]], |i, j| P[i][j]), [15.0]);
/// ```
pub fn congruence<J: AsRef<[f64]>>(rows: &[J], P: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let product = |left: &[f64], right: &[f64]| -> f64 {
        let of_row = |(i, l): (usize, &f64)| -> f64 {
            if *l == 0.0 { 0.0 } else { right.iter().enumerate().map(|(j, r)| l * r * P(i, j)).sum() }
        };
        left.iter().enumerate().map(of_row).sum()
    };
    rows.iter()
        .flat_map(|left| rows.iter().map(move |right| (left, right)))
        .map(|(l, r)| product(l.as_ref(), r.as_ref()))
        .collect()
}
