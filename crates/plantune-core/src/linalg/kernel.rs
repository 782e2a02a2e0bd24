//! The two inner loops of the QR, compiled for each instruction set and chosen at run time.
//!
//! Sums run in a fixed number of lanes and never use a fused multiply-add, so every
//! instruction set gives the same bits.

use multiversion::multiversion;

/// Lanes of a sum: two AVX-512 registers, four of AVX2.
const LANES: usize = 16;

/// Columns that share one pass over the reflector.
const GROUP: usize = 4;

/// `x . y`, summed in [`LANES`] lanes.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    let mut sum = [0.0; LANES];
    let (mut xs, mut ys) = (x.chunks_exact(LANES), y.chunks_exact(LANES));
    for (a, b) in xs.by_ref().zip(ys.by_ref()) {
        for l in 0..LANES {
            sum[l] += a[l] * b[l];
        }
    }
    for (l, (a, b)) in xs.remainder().iter().zip(ys.remainder()).enumerate() {
        sum[l] += a * b;
    }
    total(&sum)
}

/// Applies `H = I - v v' / beta`, `v = [v0; x]`, to the columns `[top_k; b_k]` behind `x`.
///
/// `rest` holds the columns `b_k` one after the other, each as long as `x`.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub fn reflect(x: &[f64], v0: f64, beta: f64, top: &mut [f64], rest: &mut [f64]) {
    let rows = x.len();
    let mut groups = rest.chunks_exact_mut(rows * GROUP);
    let mut k = 0;
    for group in groups.by_ref() {
        let (b0, tail) = group.split_at_mut(rows);
        let (b1, tail) = tail.split_at_mut(rows);
        let (b2, b3) = tail.split_at_mut(rows);
        let mut sum = [[0.0; LANES]; GROUP];
        for ((((a, p), q), r), s) in x
            .chunks_exact(LANES)
            .zip(b0.chunks_exact(LANES))
            .zip(b1.chunks_exact(LANES))
            .zip(b2.chunks_exact(LANES))
            .zip(b3.chunks_exact(LANES))
        {
            for l in 0..LANES {
                sum[0][l] += a[l] * p[l];
                sum[1][l] += a[l] * q[l];
                sum[2][l] += a[l] * r[l];
                sum[3][l] += a[l] * s[l];
            }
        }
        let mut w = [0.0; GROUP];
        for g in 0..GROUP {
            w[g] = (v0 * top[k + g] + total(&sum[g])) / beta;
            top[k + g] -= w[g] * v0;
        }
        for ((((a, p), q), r), s) in x
            .chunks_exact(LANES)
            .zip(b0.chunks_exact_mut(LANES))
            .zip(b1.chunks_exact_mut(LANES))
            .zip(b2.chunks_exact_mut(LANES))
            .zip(b3.chunks_exact_mut(LANES))
        {
            for l in 0..LANES {
                p[l] -= w[0] * a[l];
                q[l] -= w[1] * a[l];
                r[l] -= w[2] * a[l];
                s[l] -= w[3] * a[l];
            }
        }
        k += GROUP;
    }
    for b in groups.into_remainder().chunks_exact_mut(rows) {
        let mut sum = [0.0; LANES];
        for (a, p) in x.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
            for l in 0..LANES {
                sum[l] += a[l] * p[l];
            }
        }
        let w = (v0 * top[k] + total(&sum)) / beta;
        top[k] -= w * v0;
        for (a, p) in x.chunks_exact(LANES).zip(b.chunks_exact_mut(LANES)) {
            for l in 0..LANES {
                p[l] -= w * a[l];
            }
        }
        k += 1;
    }
}

#[inline(always)]
fn total(sum: &[f64; LANES]) -> f64 {
    let mut half = [0.0; LANES / 2];
    for l in 0..LANES / 2 {
        half[l] = sum[l] + sum[l + LANES / 2];
    }
    (half[0] + half[4]) + (half[1] + half[5]) + ((half[2] + half[6]) + (half[3] + half[7]))
}
