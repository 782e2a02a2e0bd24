//! Householder reflections with a triangle per register lane, compiled for each instruction set and
//! chosen at run time.
//!
//! Row `k` of a block belongs to lane `k mod lanes`. Each lane works out a QR of its own rows, so that
//! no sum, root or quotient waits for another lane; at the end the triangles are stacked and reflected
//! once more. Two columns at a time become reflections, which then pass over the others together:
//! half the traffic of one at a time. The last bits depend on the number of lanes, thus on the machine.
//!
//! ```text
//! H = I - v v' / beta,  v = [v0; x],  beta = v'v / 2,  H [top; x] = [-+norm; 0]
//! w = v . [top; b] / beta,  H [top; b] = [top; b] - w v
//! ```

use pulp::{Arch, Scalar, Simd, WithSimd};

/// Most lanes that a register has; a triangle per lane needs room for `(n, n, LANES)`.
pub const LANES: usize = 8;

/// Reflects the rows of a block into the triangles of their lanes.
///
/// `r` holds the triangles, `(n, n, lanes)` row-major. The block holds `n` columns one after the
/// other, each `stride` long, of which `rows` count; both are multiples of [`LANES`].
pub fn absorb(r: &mut [f64], n: usize, block: &mut [f64], stride: usize, rows: usize) {
    Arch::new().dispatch(Absorb { r, n, block, stride, rows });
}

/// Stacks the triangles of all lanes below `r` and reflects them into it; clears them. The room holds as many
/// columns as the triangles.
pub fn gather(r: &mut [f64], n: usize, triangles: &mut [f64], room: &mut [f64]) {
    struct Lanes;
    impl WithSimd for Lanes {
        type Output = usize;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F64_LANES
        }
    }
    let lanes = Arch::new().dispatch(Lanes);
    let stride = room.len() / n.max(1);
    // As many rows of each triangle at a time as there is room for.
    for part in (0..n).step_by(stride / lanes) {
        let part = part..n.min(part + stride / lanes);
        for j in 0..n {
            let column = &mut room[j * stride..][..part.len() * lanes];
            for (i, rows) in part.clone().zip(column.chunks_exact_mut(lanes)) {
                if i <= j {
                    rows.copy_from_slice(&triangles[(i * n + j) * lanes..][..lanes]);
                } else {
                    rows.fill(0.0);
                }
            }
        }
        let rows = part.len() * lanes;
        Absorb { r, n, block: &mut *room, stride, rows }.with_simd(Scalar);
    }
    triangles.fill(0.0);
}

struct Absorb<'a> {
    r: &'a mut [f64],
    n: usize,
    block: &'a mut [f64],
    stride: usize,
    rows: usize,
}

impl WithSimd for Absorb<'_> {
    type Output = ();

    /// Two columns become two reflections, which then go over the others in one pass.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let n = self.n;
        let (rows, stride) = (self.rows / S::F64_LANES, self.stride / S::F64_LANES);
        let r = S::as_mut_simd_f64s(self.r).0;
        let block = S::as_mut_simd_f64s(self.block).0;
        for j in (0..n).step_by(2) {
            let (head, rest) = block.split_at_mut((j + 2).min(n) * stride);
            let head = &mut head[j * stride..];
            let (x, z) = head.split_at_mut(stride);
            let x = &x[..rows];
            if j + 1 == n {
                Reflection::new(simd, products(simd, x, x)[0], &mut r[j * n + j]);
                return;
            }
            let z = &mut z[..rows];
            let [xx, xz] = products(simd, x, z);
            let first = Reflection::new(simd, xx, &mut r[j * n + j]);
            let w = first.share(simd, xz, &mut r[j * n + j + 1]);
            let [zz, xz] = subtract(simd, z, w, x);
            let second = Reflection::new(simd, zz, &mut r[(j + 1) * n + j + 1]);

            let (upper, lower) = r[j * n..(j + 2) * n].split_at_mut(n);
            let pair = Pair { x, z, xz, first, second };
            let (upper, lower) = (&mut upper[j + 2..], &mut lower[j + 2..]);
            pair.reflect(simd, upper, lower, rest, stride);
        }
    }
}

/// `v0` and `1 / beta` of a reflection in each lane.
struct Reflection<S: Simd> {
    v0: S::f64s,
    inverse: S::f64s,
}

impl<S: Simd> Reflection<S> {
    /// From `x . x` and the entry above `x`, which becomes the new diagonal.
    #[inline(always)]
    fn new(simd: S, xx: S::f64s, top: &mut S::f64s) -> Self {
        // Where nothing is below the diagonal, nothing is done; 1e-290 keeps 1 / beta finite.
        let nothing = simd.less_than_f64s(xx, simd.splat_f64s(1e-290));
        let norm = simd.sqrt_f64s(simd.mul_add_e_f64s(*top, *top, xx));
        let negative = simd.less_than_f64s(*top, simd.splat_f64s(0.0));
        let signed = simd.select_f64s(negative, simd.neg_f64s(norm), norm);
        let v0 = simd.add_f64s(*top, signed);
        let beta = simd.mul_f64s(signed, v0);
        let inverse = simd.div_f64s(simd.splat_f64s(1.0), beta);
        *top = simd.select_f64s(nothing, *top, simd.neg_f64s(signed));
        Reflection { v0, inverse: simd.select_f64s(nothing, simd.splat_f64s(0.0), inverse) }
    }

    /// `w` of a column from `x . b`, and its `top` reflected.
    #[inline(always)]
    fn share(&self, simd: S, xb: S::f64s, top: &mut S::f64s) -> S::f64s {
        let w = simd.mul_f64s(simd.mul_add_e_f64s(self.v0, *top, xb), self.inverse);
        *top = simd.negate_mul_add_e_f64s(w, self.v0, *top);
        w
    }
}

/// `[x . x, x . z]`.
#[inline(always)]
fn products<S: Simd>(simd: S, x: &[S::f64s], z: &[S::f64s]) -> [S::f64s; 2] {
    let [mut xx, mut xz] = [[simd.splat_f64s(0.0); 4]; 2];
    let ((x4, x1), (z4, z1)) = (x.as_chunks::<4>(), z.as_chunks::<4>());
    for (x, z) in x4.iter().zip(z4) {
        for i in 0..4 {
            xx[i] = simd.mul_add_e_f64s(x[i], x[i], xx[i]);
            xz[i] = simd.mul_add_e_f64s(x[i], z[i], xz[i]);
        }
    }
    for (&x, &z) in x1.iter().zip(z1) {
        xx[0] = simd.mul_add_e_f64s(x, x, xx[0]);
        xz[0] = simd.mul_add_e_f64s(x, z, xz[0]);
    }
    [xx, xz].map(|[a, b, c, d]| simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d)))
}

/// `z -= w x`; returns `[z . z, x . z]`.
#[inline(always)]
fn subtract<S: Simd>(simd: S, z: &mut [S::f64s], w: S::f64s, x: &[S::f64s]) -> [S::f64s; 2] {
    for (z, &x) in z.iter_mut().zip(x) {
        *z = simd.negate_mul_add_e_f64s(w, x, *z);
    }
    products(simd, z, x)
}

/// Two reflections, the second of them with a zero where the first has its `v0`.
struct Pair<'a, S: Simd> {
    x: &'a [S::f64s],
    z: &'a [S::f64s],
    xz: S::f64s,
    first: Reflection<S>,
    second: Reflection<S>,
}

impl<S: Simd> Pair<'_, S> {
    /// Applies both to the columns `[upper_k; lower_k; b_k]`, four at a time while there are four.
    #[inline(always)]
    fn reflect(
        &self,
        simd: S,
        upper: &mut [S::f64s],
        lower: &mut [S::f64s],
        columns: &mut [S::f64s],
        stride: usize,
    ) {
        let tops = upper.chunks_mut(4).zip(lower.chunks_mut(4));
        for ((upper, lower), columns) in tops.zip(columns.chunks_mut(4 * stride)) {
            match upper.len() {
                1 => self.reflect_columns::<1>(simd, upper, lower, columns, stride),
                2 => self.reflect_columns::<2>(simd, upper, lower, columns, stride),
                3 => self.reflect_columns::<3>(simd, upper, lower, columns, stride),
                _ => self.reflect_columns::<4>(simd, upper, lower, columns, stride),
            }
        }
    }

    #[inline(always)]
    fn reflect_columns<const G: usize>(
        &self,
        simd: S,
        upper: &mut [S::f64s],
        lower: &mut [S::f64s],
        columns: &mut [S::f64s],
        stride: usize,
    ) {
        let rows = self.x.len();
        let (x, z) = (&self.x[..rows], &self.z[..rows]);
        let mut parts = columns.chunks_exact_mut(stride);
        let mut b: [&mut [S::f64s]; G] =
            std::array::from_fn(|_| &mut parts.next().unwrap_or_default()[..rows]);
        let [mut xb, mut zb] = [[simd.splat_f64s(0.0); G]; 2];
        for (k, (&x, &z)) in x.iter().zip(z).enumerate() {
            for g in 0..G {
                xb[g] = simd.mul_add_e_f64s(x, b[g][k], xb[g]);
                zb[g] = simd.mul_add_e_f64s(z, b[g][k], zb[g]);
            }
        }
        let [mut w, mut v] = [[simd.splat_f64s(0.0); G]; 2];
        for g in 0..G {
            w[g] = self.first.share(simd, xb[g], &mut upper[g]);
            v[g] = self.second.share(simd, simd.negate_mul_add_e_f64s(w[g], self.xz, zb[g]), &mut lower[g]);
        }
        for (k, (&x, &z)) in x.iter().zip(z).enumerate() {
            for (g, b) in b.iter_mut().enumerate() {
                let partly = simd.negate_mul_add_e_f64s(w[g], x, b[k]);
                b[k] = simd.negate_mul_add_e_f64s(v[g], z, partly);
            }
        }
    }
}
