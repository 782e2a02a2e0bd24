//! The inner loops of the QR, compiled for each instruction set and chosen at run time.
//!
//! Sums run in as many lanes as the registers have, so their last bits depend on the machine.

use pulp::{Arch, Simd, WithSimd};

/// `x . y`.
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    struct Dot<'a>(&'a [f64], &'a [f64]);
    impl WithSimd for Dot<'_> {
        type Output = f64;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> f64 {
            let n = self.0.len().min(self.1.len());
            let (xs, x_tail) = S::as_simd_f64s(&self.0[..n]);
            let (ys, y_tail) = S::as_simd_f64s(&self.1[..n]);
            let [mut a, mut b, mut c, mut d] = [simd.splat_f64s(0.0); 4];
            let ((x4, x1), (y4, y1)) = (xs.as_chunks::<4>(), ys.as_chunks::<4>());
            for (x, y) in x4.iter().zip(y4) {
                a = simd.mul_add_e_f64s(x[0], y[0], a);
                b = simd.mul_add_e_f64s(x[1], y[1], b);
                c = simd.mul_add_e_f64s(x[2], y[2], c);
                d = simd.mul_add_e_f64s(x[3], y[3], d);
            }
            for (&x, &y) in x1.iter().zip(y1) {
                a = simd.mul_add_e_f64s(x, y, a);
            }
            let sum = simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d));
            simd.reduce_sum_f64s(sum) + x_tail.iter().zip(y_tail).map(|(x, y)| x * y).sum::<f64>()
        }
    }
    Arch::new().dispatch(Dot(x, y))
}

/// Sum of `x`.
pub fn sum(x: &[f64]) -> f64 {
    struct Sum<'a>(&'a [f64]);
    impl WithSimd for Sum<'_> {
        type Output = f64;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> f64 {
            let (xs, tail) = S::as_simd_f64s(self.0);
            let [mut a, mut b, mut c, mut d] = [simd.splat_f64s(0.0); 4];
            let (x4, x1) = xs.as_chunks::<4>();
            for x in x4 {
                a = simd.add_f64s(x[0], a);
                b = simd.add_f64s(x[1], b);
                c = simd.add_f64s(x[2], c);
                d = simd.add_f64s(x[3], d);
            }
            for &x in x1 {
                a = simd.add_f64s(x, a);
            }
            let sum = simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d));
            simd.reduce_sum_f64s(sum) + tail.iter().sum::<f64>()
        }
    }
    Arch::new().dispatch(Sum(x))
}

/// Least and greatest value; `(inf, -inf)` of nothing.
pub fn extent(x: &[f64]) -> (f64, f64) {
    struct Extent<'a>(&'a [f64]);
    impl WithSimd for Extent<'_> {
        type Output = (f64, f64);

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> (f64, f64) {
            let (xs, tail) = S::as_simd_f64s(self.0);
            let (mut low, mut high) = (simd.splat_f64s(f64::INFINITY), simd.splat_f64s(f64::NEG_INFINITY));
            for &x in xs {
                low = simd.min_f64s(low, x);
                high = simd.max_f64s(high, x);
            }
            let low = tail.iter().copied().fold(simd.reduce_min_f64s(low), f64::min);
            (low, tail.iter().copied().fold(simd.reduce_max_f64s(high), f64::max))
        }
    }
    Arch::new().dispatch(Extent(x))
}

/// Householder QR of a triangle on top of a block: `rows` of the block are reflected into `r`.
///
/// `r` is the `(n, n)` row-major triangle, `block` holds `n` columns one after the other, each
/// a multiple of 8 long.
pub fn absorb(r: &mut [f64], n: usize, block: &mut [f64]) {
    Arch::new().dispatch(Absorb { r, n, block });
}

struct Absorb<'a> {
    r: &'a mut [f64],
    n: usize,
    block: &'a mut [f64],
}

impl WithSimd for Absorb<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Absorb { r, n, block } = self;
        let rows = block.len() / n;
        for j in 0..n {
            let (head, rest) = block.split_at_mut((j + 1) * rows);
            let x = S::as_simd_f64s(&head[j * rows..]).0;
            let below = length2(simd, x);
            if below == 0.0 {
                continue;
            }
            // H = I - v v' / beta with v = [v0; x] sends [R_jj; x] to [-+norm; 0].
            let row = &mut r[j * n + j..(j + 1) * n];
            let norm = (row[0] * row[0] + below).sqrt();
            let v0 = row[0] + norm.copysign(row[0]);
            let beta = norm * (norm + row[0].abs()); // v'v / 2
            row[0] = -norm.copysign(row[0]);
            reflect(simd, x, v0, beta, &mut row[1..], S::as_mut_simd_f64s(rest).0);
        }
    }
}

#[inline(always)]
fn length2<S: Simd>(simd: S, x: &[S::f64s]) -> f64 {
    let [mut a, mut b, mut c, mut d] = [simd.splat_f64s(0.0); 4];
    let (x4, x1) = x.as_chunks::<4>();
    for x in x4 {
        a = simd.mul_add_e_f64s(x[0], x[0], a);
        b = simd.mul_add_e_f64s(x[1], x[1], b);
        c = simd.mul_add_e_f64s(x[2], x[2], c);
        d = simd.mul_add_e_f64s(x[3], x[3], d);
    }
    for &x in x1 {
        a = simd.mul_add_e_f64s(x, x, a);
    }
    simd.reduce_sum_f64s(simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d)))
}

/// Applies `H` to the columns `[top_k; b_k]`, four at a time while there are four.
#[inline(always)]
fn reflect<S: Simd>(simd: S, x: &[S::f64s], v0: f64, beta: f64, top: &mut [f64], rest: &mut [S::f64s]) {
    let fours = top.len() / 4 * 4;
    let (top, last_top) = top.split_at_mut(fours);
    let (rest, last) = rest.split_at_mut(fours * x.len());
    for (top, columns) in top.chunks_exact_mut(4).zip(rest.chunks_exact_mut(4 * x.len())) {
        reflect_columns::<S, 4>(simd, x, v0, beta, top, columns);
    }
    match last_top.len() {
        1 => reflect_columns::<S, 1>(simd, x, v0, beta, last_top, last),
        2 => reflect_columns::<S, 2>(simd, x, v0, beta, last_top, last),
        3 => reflect_columns::<S, 3>(simd, x, v0, beta, last_top, last),
        _ => {}
    }
}

/// `b_k -= w_k x` with `w_k = (v0 top_k + x . b_k) / beta`, `G` columns in one pass over `x`.
#[inline(always)]
fn reflect_columns<S: Simd, const G: usize>(
    simd: S,
    x: &[S::f64s],
    v0: f64,
    beta: f64,
    top: &mut [f64],
    columns: &mut [S::f64s],
) {
    let rows = x.len();
    let mut parts = columns.chunks_exact_mut(rows);
    let b: [&mut [S::f64s]; G] = std::array::from_fn(|_| parts.next().unwrap_or_default());
    let mut sums = [[simd.splat_f64s(0.0); G]; 2];
    for k in (0..rows - rows % 2).step_by(2) {
        for g in 0..G {
            sums[0][g] = simd.mul_add_e_f64s(x[k], b[g][k], sums[0][g]);
            sums[1][g] = simd.mul_add_e_f64s(x[k + 1], b[g][k + 1], sums[1][g]);
        }
    }
    if rows % 2 == 1 {
        for g in 0..G {
            sums[0][g] = simd.mul_add_e_f64s(x[rows - 1], b[g][rows - 1], sums[0][g]);
        }
    }
    let mut w = [simd.splat_f64s(0.0); G];
    for g in 0..G {
        let share = (v0 * top[g] + simd.reduce_sum_f64s(simd.add_f64s(sums[0][g], sums[1][g]))) / beta;
        top[g] -= share * v0;
        w[g] = simd.splat_f64s(-share);
    }
    for k in 0..rows {
        for g in 0..G {
            b[g][k] = simd.mul_add_e_f64s(w[g], x[k], b[g][k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_and_tail_are_all_counted() {
        let x: Vec<f64> = (1..=37).map(f64::from).collect();
        assert_eq!(dot(&x, &x), 37.0 * 38.0 * 75.0 / 6.0);
        assert_eq!((sum(&x), extent(&x)), (37.0 * 19.0, (1.0, 37.0)));
    }
}
