//! Division of several signals by one polynomial, side by side, so that none waits for its own last value.
//!
//! ```text
//! y(t) = x(t) - c_1 y(t-1) - … - c_P y(t-P)
//! ```
//!
//! The last values stay in registers, and products are fused with sums where the processor can.

use pulp::{Arch, Simd, WithSimd};

/// Divides `rows` in place, given the values before them, newest first; returns the last values.
///
/// The quotient of the first row, times `sign`, is divided once more into `twice`, which has its own past.
pub struct Recursion<'s, const P: usize, const K: usize, const T: usize> {
    /// Coefficients after the leading one.
    pub c: [f64; P],
    /// Signals.
    pub rows: [&'s mut [f64]; K],
    /// Their values before.
    pub past: [[f64; P]; K],
    /// Room for what is divided twice.
    pub twice: [&'s mut [f64]; T],
    /// Its values before.
    pub twice_past: [[f64; P]; T],
    /// Sign of what is divided twice.
    pub sign: f64,
}

impl<const P: usize, const K: usize, const T: usize> Recursion<'_, P, K, T> {
    /// Runs over all rows.
    pub fn run(self) {
        Arch::new().dispatch(self);
    }
}

impl<const P: usize, const K: usize, const T: usize> WithSimd for Recursion<'_, P, K, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        // On WebAssembly a fused product is a call; everywhere else a register set comes with it.
        if S::IS_SCALAR || cfg!(target_arch = "wasm32") {
            self.over(|c, y, x| x - c * y);
        } else {
            self.over(|c, y, x| (-c).mul_add(y, x));
        }
    }
}

impl<const P: usize, const K: usize, const T: usize> Recursion<'_, P, K, T> {
    #[inline(always)]
    fn over(self, less: impl Fn(f64, f64, f64) -> f64) {
        let Recursion { c, rows, mut past, twice, mut twice_past, sign } = self;
        let len = rows.first().map_or(0, |row| row.len());
        let rows = rows.map(|row| &mut row[..len]);
        let twice = twice.map(|row| &mut row[..len]);
        for t in 0..len {
            let mut first = 0.0;
            for k in (0..K).rev() {
                first = step(&c, rows[k][t], &mut past[k], &less);
                rows[k][t] = first;
            }
            for j in 0..T {
                twice[j][t] = step(&c, sign * first, &mut twice_past[j], &less);
            }
        }
    }
}

#[inline(always)]
fn step<const P: usize>(c: &[f64; P], x: f64, y: &mut [f64; P], less: impl Fn(f64, f64, f64) -> f64) -> f64 {
    let mut now = x;
    for i in (0..P).rev() {
        now = less(c[i], y[i], now); // the newest last: only this product is waited for
    }
    for i in (1..P).rev() {
        y[i] = y[i - 1];
    }
    y[0] = now;
    now
}
