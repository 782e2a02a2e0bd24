//! Least squares from a triangle: `min |R[:, columns] theta - R[:, rhs]|`, column-scaled and pivoted.

use super::qr::Triangle;

/// A full-rank solution.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Parameters, in the order of the columns asked for.
    pub theta: Vec<f64>, // (n)
    /// `(X'X)^-1`, row-major.
    pub inverse_gram: Vec<f64>, // (n, n)
    /// Sum of squared residuals.
    pub rss: f64,
    /// Smallest over largest diagonal of the scaled, pivoted triangle.
    pub ratio: f64,
}

/// Why there is no solution: the columns that depend on the others, in the order of the columns asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct RankDeficient {
    /// Numerical rank.
    pub rank: usize,
    /// Smallest over largest diagonal of the scaled, pivoted triangle.
    pub ratio: f64,
    /// Columns that add nothing to the others.
    pub dependent: Vec<usize>,
}

/// Solves for the chosen columns; a pivot below `tolerance` times the largest means rank deficiency.
pub fn solve(
    triangle: &Triangle,
    columns: &[usize],
    rhs: usize,
    tolerance: f64,
) -> Result<Solution, RankDeficient> {
    let n = columns.len();
    let qr = PivotedQr::new(triangle, columns, rhs);
    let ratio = qr.ratio();
    if ratio <= tolerance {
        let rank = qr.rank(tolerance);
        return Err(RankDeficient { rank, ratio, dependent: qr.order[rank..].to_vec() });
    }
    let inverse = qr.inverse();
    let mut theta = vec![0.0; n];
    let mut inverse_gram = vec![0.0; n * n];
    for i in 0..n {
        let (row, scale_i) = (qr.order[i], qr.scale[qr.order[i]]);
        theta[row] = (i..n).map(|k| inverse[i * n + k] * qr.rhs()[k]).sum::<f64>() / scale_i;
        for j in 0..n {
            let (column, scale_j) = (qr.order[j], qr.scale[qr.order[j]]);
            inverse_gram[row * n + column] =
                (i.max(j)..n).map(|k| inverse[i * n + k] * inverse[j * n + k]).sum::<f64>()
                    / (scale_i * scale_j);
        }
    }
    Ok(Solution { theta, inverse_gram, rss: qr.rest(n), ratio })
}

/// Sum of squared residuals of the best fit on the chosen columns, dependent ones included.
pub fn residual_norm2(triangle: &Triangle, columns: &[usize], rhs: usize, tolerance: f64) -> f64 {
    let qr = PivotedQr::new(triangle, columns, rhs);
    qr.rest(qr.rank(tolerance))
}

/// Solution of `min |R[:, columns] x - R[:, rhs]|^2 + damping |S x|^2` with `S` the lengths of the columns; zero
/// columns get zero.
pub fn solve_damped(triangle: &Triangle, columns: &[usize], rhs: usize, damping: f64) -> Vec<f64> {
    let qr = PivotedQr::damped(triangle, columns, rhs, damping);
    let n = columns.len();
    let mut x = vec![0.0; n];
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| qr.a[j * qr.rows + k] * x[j]).sum();
        let diagonal = qr.a[k * qr.rows + k];
        x[k] = if diagonal.abs() > 1e-15 * qr.diagonal(0) { (qr.rhs()[k] - known) / diagonal } else { 0.0 };
    }
    let mut ordered = vec![0.0; n];
    for (x, &j) in x.iter().zip(&qr.order) {
        ordered[j] = x / qr.scale[j];
    }
    ordered
}

/// Householder QR with column pivoting of `R[:, columns] / scale`, applied to `R[:, rhs]` as well.
struct PivotedQr {
    a: Vec<f64>, // (rows, n) column-major, then the right-hand side; the triangle stands in its upper part
    rows: usize,
    scale: Vec<f64>,   // (n) of the columns asked for
    order: Vec<usize>, // (n) which column stands where
}

impl PivotedQr {
    fn new(triangle: &Triangle, columns: &[usize], rhs: usize) -> Self {
        PivotedQr::damped(triangle, columns, rhs, 0.0)
    }

    /// The same with `n` rows `sqrt(damping) I` below the scaled columns.
    fn damped(triangle: &Triangle, columns: &[usize], rhs: usize, damping: f64) -> Self {
        let height = columns.iter().copied().chain([rhs]).max().map_or(0, |c| c + 1);
        let n = columns.len();
        let below = if damping > 0.0 { n } else { 0 };
        let rows = height + below;
        let column = |c: usize| (0..height).map(move |i| triangle.at(i, c));
        let scale: Vec<f64> = columns
            .iter()
            .map(|&c| column(c).map(|x| x * x).sum::<f64>().sqrt())
            .map(|norm| if norm > 0.0 { norm } else { 1.0 })
            .collect();
        let mut a = Vec::with_capacity(rows * (n + 1));
        for (j, (&c, s)) in columns.iter().zip(&scale).enumerate() {
            a.extend(column(c).map(|x| x / s));
            a.extend((0..below).map(|i| if i == j { damping.sqrt() } else { 0.0 }));
        }
        a.extend(column(rhs).chain((0..below).map(|_| 0.0)));
        let mut qr = PivotedQr { a, rows, scale, order: (0..n).collect() };
        for k in 0..n.min(rows) {
            qr.pivot(k);
            qr.reflect(k);
        }
        qr
    }

    /// Brings the longest remaining column to place `k`.
    fn pivot(&mut self, k: usize) {
        let n = self.order.len();
        let length2 = |j: usize| self.a[j * self.rows..][k..self.rows].iter().map(|x| x * x).sum::<f64>();
        let mut longest = (k, length2(k));
        for j in k + 1..n {
            let candidate = length2(j);
            if candidate > longest.1 {
                longest = (j, candidate);
            }
        }
        if longest.0 != k {
            self.order.swap(k, longest.0);
            for i in 0..self.rows {
                self.a.swap(k * self.rows + i, longest.0 * self.rows + i);
            }
        }
    }

    fn reflect(&mut self, k: usize) {
        let rows = self.rows;
        let (head, tail) = self.a.split_at_mut((k + 1) * rows);
        let x = &mut head[k * rows + k..];
        let norm = x.iter().map(|v| v * v).sum::<f64>().sqrt();
        if norm == 0.0 {
            return;
        }
        let diagonal = -norm.copysign(x[0]);
        let beta = norm * (norm + x[0].abs());
        x[0] -= diagonal;
        for b in tail.chunks_exact_mut(rows) {
            let b = &mut b[k..];
            let w = x.iter().zip(b.iter()).map(|(v, c)| v * c).sum::<f64>() / beta;
            b.iter_mut().zip(x.iter()).for_each(|(c, v)| *c -= w * v);
        }
        x[0] = diagonal;
    }

    fn rhs(&self) -> &[f64] {
        &self.a[self.rows * self.order.len()..]
    }

    fn diagonal(&self, k: usize) -> f64 {
        if k < self.rows.min(self.order.len()) { self.a[k * self.rows + k].abs() } else { 0.0 }
    }

    fn ratio(&self) -> f64 {
        let n = self.order.len();
        if n == 0 { 1.0 } else { self.diagonal(n - 1) / self.diagonal(0).max(f64::MIN_POSITIVE) }
    }

    fn rank(&self, tolerance: f64) -> usize {
        let floor = tolerance * self.diagonal(0);
        (0..self.order.len()).take_while(|&k| self.diagonal(k) > floor).count()
    }

    /// Squared length of the right-hand side that the first `rank` columns leave.
    fn rest(&self, rank: usize) -> f64 {
        self.rhs()[rank.min(self.rows)..].iter().map(|x| x * x).sum()
    }

    /// Inverse of the triangle, row-major.
    fn inverse(&self) -> Vec<f64> {
        let n = self.order.len();
        let at = |i: usize, j: usize| self.a[j * self.rows + i];
        let mut inverse = vec![0.0; n * n];
        for j in 0..n {
            inverse[j * n + j] = 1.0 / at(j, j);
            for i in (0..j).rev() {
                let sum: f64 = (i + 1..=j).map(|k| at(i, k) * inverse[k * n + j]).sum();
                inverse[i * n + j] = -sum / at(i, i);
            }
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quadratic() -> Triangle {
        let rows: Vec<[f64; 4]> = (0..50)
            .map(|k| {
                let x = f64::from(k) / 10.0;
                [1.0, x, x * x, 2.0 - 3.0 * x + 0.5 * x * x]
            })
            .collect();
        Triangle::of_rows(4, rows.iter().map(|r| r.as_slice()))
    }

    #[test]
    fn exact_data_give_exact_parameters() {
        let s = solve(&quadratic(), &[0, 1, 2], 3, 1e-12).expect("full rank");
        for (ours, truth) in s.theta.iter().zip([2.0, -3.0, 0.5]) {
            assert!((ours - truth).abs() < 1e-12);
        }
        assert!(s.rss < 1e-24);
    }

    #[test]
    fn a_subset_leaves_the_residual_of_the_subset() {
        let rss = residual_norm2(&quadratic(), &[0, 1], 3, 1e-12);
        // Regressing x^2/2 on a line over x = 0, 0.1, …, 4.9 leaves h^4 N (N^2 - 1)(N^2 - 4) / 720.
        let n = 50f64;
        let exact = 0.1f64.powi(4) * n * (n * n - 1.0) * (n * n - 4.0) / 720.0;
        assert!((rss / exact - 1.0).abs() < 1e-12, "{rss} {exact}");
    }

    #[test]
    fn a_repeated_column_is_named() {
        let rows: Vec<[f64; 3]> = (0..9).map(|k| [f64::from(k), 3.0 * f64::from(k), 1.0]).collect();
        let t = Triangle::of_rows(3, rows.iter().map(|r| r.as_slice()));
        let refusal = solve(&t, &[0, 1], 2, 1e-12).expect_err("collinear");
        assert_eq!((refusal.rank, refusal.dependent), (1, vec![1]));
    }
}
