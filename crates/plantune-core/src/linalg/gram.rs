//! Sums of products of columns, and their triangle where it is as good as that of a QR.
//!
//! ```text
//! G = X'X = R'R
//! ```
//!
//! Cholesky's triangle loses digits with the square of the condition number, that of a QR with the number
//! itself. A search needs a direction and a gradient, which both give while the columns are far from
//! dependent: with pivots above [`LEAST_PIVOT`] ten digits are left. Else the answer is None.

use pulp::{Arch, Simd, WithSimd};

use super::qr::Triangle;

/// Least diagonal of the triangle, as a share of the length of its column.
const LEAST_PIVOT: f64 = 1e-3;

/// `X'X` of the rows so far, of which the last column is the right-hand side.
pub struct Gram {
    n: usize,
    g: Vec<f64>, // (n, n) row-major, upper part
}

impl Gram {
    /// Of no rows.
    pub fn new(n: usize) -> Self {
        Gram { n, g: vec![0.0; n * n] }
    }

    /// Takes rows, given column by column.
    pub fn add<'x>(&mut self, column: impl Fn(usize) -> &'x [f64]) {
        Arch::new().dispatch(Add { gram: self, column });
    }

    /// The triangle, if the columns before the last are far from dependent.
    pub fn triangle(&self) -> Option<Triangle> {
        let n = self.n;
        let mut r = self.g.clone();
        for i in 0..n {
            let (above, own) = r.split_at_mut(i * n);
            for j in i..n {
                own[j] -= above.chunks_exact(n).map(|row| row[i] * row[j]).sum::<f64>();
            }
            let length2 = self.g[i * n + i];
            if i + 1 < n && !(own[i] > LEAST_PIVOT * LEAST_PIVOT * length2) {
                return None;
            }
            let pivot = own[i].max(0.0).sqrt();
            own[i..n].iter_mut().for_each(|x| *x /= pivot.max(f64::MIN_POSITIVE));
            own[i] = pivot;
        }
        r.iter().all(|x| x.is_finite()).then(|| Triangle::of_upper(n, r))
    }
}

struct Add<'g, F> {
    gram: &'g mut Gram,
    column: F,
}

impl<'x, F: Fn(usize) -> &'x [f64]> WithSimd for Add<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Gram { n, g } = self.gram;
        for i in 0..*n {
            let x = (self.column)(i);
            let mut j = i;
            while j < *n {
                let count = (*n - j).min(4);
                // Idle ones repeat the last.
                let columns = std::array::from_fn(|k| (self.column)(j + k.min(count - 1)));
                let sums = products::<S, 4>(simd, x, columns);
                g[i * *n + j..][..count].iter_mut().zip(sums).for_each(|(g, sum)| *g += sum);
                j += count;
            }
        }
    }
}

/// `x . y` for each of the columns.
#[inline(always)]
fn products<S: Simd, const K: usize>(simd: S, x: &[f64], columns: [&[f64]; K]) -> [f64; K] {
    let len = x.len();
    let (xs, x_tail) = S::as_simd_f64s(x);
    let columns = columns.map(|y| S::as_simd_f64s(&y[..len]));
    let heads = columns.map(|(head, _)| &head[..xs.len()]);
    let mut sums = [simd.splat_f64s(0.0); K];
    for (t, &x) in xs.iter().enumerate() {
        for k in 0..K {
            sums[k] = simd.mul_add_e_f64s(x, heads[k][t], sums[k]);
        }
    }
    let tail = |k: usize| x_tail.iter().zip(columns[k].1).map(|(x, y)| x * y).sum::<f64>();
    std::array::from_fn(|k| simd.reduce_sum_f64s(sums[k]) + tail(k))
}

#[cfg(test)]
mod tests {
    use super::super::draws::white;
    use super::*;

    /// The triangle of a QR, but for signs of rows; rows come in parts of any length.
    #[test]
    fn columns_far_from_dependent_give_the_triangle_of_a_qr() {
        for n in 1..10 {
            let columns: Vec<Vec<f64>> = (0..n).map(|j| white(500, j as u64 + 1)).collect();
            let rows: Vec<Vec<f64>> =
                (0..500).map(|t| columns.iter().map(|column| column[t]).collect()).collect();
            let qr = Triangle::of_rows(n, rows.iter().map(Vec::as_slice));
            let mut gram = Gram::new(n);
            for part in [0..3, 3..264, 264..500] {
                gram.add(|j| &columns[j][part.clone()]);
            }
            let own = gram.triangle().expect("independent");
            for (i, j) in (0..n * n).map(|ij| (ij / n, ij % n)) {
                let sign = qr.at(i, i).signum();
                assert!((own.at(i, j) - sign * qr.at(i, j)).abs() < 1e-12, "{n} {i} {j}");
            }
        }
    }

    #[test]
    fn columns_near_dependence_are_left_to_a_qr() {
        let (x, e) = (white(300, 1), white(300, 2));
        let triangle = |share: f64| {
            let z: Vec<f64> = x.iter().zip(&e).map(|(x, e)| x + share * e).collect();
            let columns = [&x, &z, &e];
            let mut gram = Gram::new(3);
            gram.add(|j| columns[j].as_slice());
            gram.triangle()
        };
        assert!(triangle(1e-2).is_some());
        assert!(triangle(1e-4).is_none());
        assert!(triangle(0.0).is_none());
    }
}
