//! Loops over plain slices, compiled for each instruction set and chosen at run time.
//!
//! Sums run in as many lanes as the registers have, so their last bits depend on the machine.

use pulp::{Arch, Simd, WithSimd};

/// Calls `f`, its loops compiled for the registers at hand as far as they are inlined.
pub fn vectorised<R>(f: impl FnOnce() -> R) -> R {
    Arch::new().dispatch(f)
}

/// Asks for what will be read soon. Memory is often too far away for the processor to look ahead by itself: where it
/// is read downwards, or from page to page.
#[inline(always)]
pub fn fetch<T>(x: &T) {
    #[cfg(target_arch = "x86_64")]
    if let Some(sse) = pulp::core_arch::x86::Sse::try_new() {
        for offset in (0..size_of::<T>()).step_by(64) {
            let line = std::ptr::from_ref(x).cast::<i8>().wrapping_add(offset);
            sse._mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(line);
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = x;
}

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

/// `out = (x - zero) factor`.
pub fn scale_into(out: &mut [f64], x: &[f64], zero: f64, factor: f64) {
    struct Scaled<'a>(&'a mut [f64], &'a [f64], f64, f64);
    impl WithSimd for Scaled<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            let Scaled(out, x, zero, factor) = self;
            let (xs, x_tail) = S::as_simd_f64s(&x[..out.len()]);
            let (outs, out_tail) = S::as_mut_simd_f64s(out);
            let (zeros, factors) = (simd.splat_f64s(zero), simd.splat_f64s(factor));
            for (out, &x) in outs.iter_mut().zip(xs) {
                *out = simd.mul_f64s(simd.sub_f64s(x, zeros), factors);
            }
            for (out, x) in out_tail.iter_mut().zip(x_tail) {
                *out = (x - zero) * factor;
            }
        }
    }
    Arch::new().dispatch(Scaled(out, x, zero, factor));
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
