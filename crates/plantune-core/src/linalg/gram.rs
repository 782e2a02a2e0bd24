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

/// Columns taken together: their products with each other, and with those of another tile, stay in registers.
const TILE: usize = 4;

impl<'x, F: Fn(usize) -> &'x [f64]> WithSimd for Add<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let n = self.gram.n;
        for i in (0..n).step_by(TILE) {
            let x = self.tile(i);
            match n - i {
                1 => self.gram.keep(i, i, own::<S, 1>(simd, x)),
                2 => self.gram.keep(i, i, own::<S, 2>(simd, x)),
                3 => self.gram.keep(i, i, own::<S, 3>(simd, x)),
                _ => self.gram.keep(i, i, own::<S, TILE>(simd, x)),
            }
            for j in (i + TILE..n).step_by(TILE) {
                let y = self.tile(j);
                match n - j {
                    1 => self.gram.keep(i, j, products::<S, 1>(simd, x, y)),
                    2 => self.gram.keep(i, j, products::<S, 2>(simd, x, y)),
                    3 => self.gram.keep(i, j, products::<S, 3>(simd, x, y)),
                    _ => self.gram.keep(i, j, products::<S, TILE>(simd, x, y)),
                }
            }
        }
    }
}

impl<'x, F: Fn(usize) -> &'x [f64]> Add<'_, F> {
    /// The columns from `i` on; where there are no more, the last again.
    #[inline(always)]
    fn tile(&self, i: usize) -> [&'x [f64]; TILE] {
        std::array::from_fn(|k| (self.column)((i + k).min(self.gram.n - 1)))
    }
}

impl Gram {
    #[inline(always)]
    fn keep<const I: usize, const J: usize>(&mut self, i: usize, j: usize, sums: [[f64; J]; I]) {
        for (k, row) in sums.iter().enumerate() {
            let own = &mut self.g[(i + k) * self.n + j..][..J];
            own.iter_mut().zip(row).for_each(|(g, sum)| *g += sum);
        }
    }
}

/// `x_i . x_j` for `i <= j`, zero else.
#[inline(always)]
fn own<S: Simd, const K: usize>(simd: S, x: [&[f64]; TILE]) -> [[f64; K]; K] {
    let x: [&[f64]; K] = std::array::from_fn(|i| x[i]);
    sums(simd, x, x, |i, j| i <= j)
}

/// `x_i . y_j`
#[inline(always)]
fn products<S: Simd, const J: usize>(simd: S, x: [&[f64]; TILE], y: [&[f64]; TILE]) -> [[f64; J]; TILE] {
    sums(simd, x, std::array::from_fn(|j| y[j]), |_, _| true)
}

/// `x_i . y_j` where wanted.
#[inline(always)]
fn sums<S: Simd, const I: usize, const J: usize>(
    simd: S,
    x: [&[f64]; I],
    y: [&[f64]; J],
    wanted: impl Fn(usize, usize) -> bool,
) -> [[f64; J]; I] {
    let len = x[0].len();
    let (x, y) = (x.map(|x| S::as_simd_f64s(&x[..len])), y.map(|y| S::as_simd_f64s(&y[..len])));
    let heads = x[0].0.len();
    let (xs, ys) = (x.map(|(head, _)| &head[..heads]), y.map(|(head, _)| &head[..heads]));
    let mut sums = [[simd.splat_f64s(0.0); J]; I];
    for t in 0..heads {
        let (x, y) = (xs.map(|x| x[t]), ys.map(|y| y[t]));
        for i in 0..I {
            for j in 0..J {
                if wanted(i, j) {
                    sums[i][j] = simd.mul_add_e_f64s(x[i], y[j], sums[i][j]);
                }
            }
        }
    }
    let tail = |i: usize, j: usize| x[i].1.iter().zip(y[j].1).map(|(x, y)| x * y).sum::<f64>();
    let total = |i: usize, j: usize| {
        if wanted(i, j) { simd.reduce_sum_f64s(sums[i][j]) + tail(i, j) } else { 0.0 }
    };
    std::array::from_fn(|i| std::array::from_fn(|j| total(i, j)))
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
