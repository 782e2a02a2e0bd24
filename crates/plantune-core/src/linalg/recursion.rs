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
    fn with_simd<S: Simd>(self, simd: S) {
        // On WebAssembly a fused product is a call; everywhere else a register set comes with it.
        if S::IS_SCALAR || cfg!(target_arch = "wasm32") {
            self.over(|c, y, x| x - c * y);
        } else if P == 1 {
            self.in_lanes(simd);
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

impl<const P: usize, const K: usize, const T: usize> Recursion<'_, P, K, T> {
    /// The same for a first order, one signal after the other.
    #[inline(always)]
    fn in_lanes<S: Simd>(self, simd: S) {
        let powers = Powers::new(simd, -self.c[0]);
        let mut first: &[f64] = &[];
        for (row, past) in self.rows.into_iter().zip(self.past).rev() {
            powers.divide(row, past[0]);
            first = row;
        }
        for (twice, past) in self.twice.into_iter().zip(self.twice_past) {
            twice.iter_mut().zip(first).for_each(|(to, x)| *to = self.sign * x);
            powers.divide(twice, past[0]);
        }
    }
}

/// `y(t) = x(t) + g y(t-1)` as many rows at once as a register has lanes.
///
/// ```text
/// 1/(1 - g q^-1) = (1 + g q^-1)(1 + g^2 q^-2)(1 + g^4 q^-4) ... within them,  g^1, g^2, ... y(t-1) from before
/// ```
///
/// Kogge and Stone 1973.
struct Powers<S: Simd> {
    simd: S,
    g: f64,
    /// `g^s` for s = 1, 2, 4; zero in the lanes whose row s earlier lies before the register.
    within: [S::f64s; 3],
    /// `g, g^2, ...`
    before: S::f64s,
    /// `g` to the number of lanes.
    over: f64,
}

/// Lanes of the widest registers.
const MOST_LANES: usize = 8;

impl<S: Simd> Powers<S> {
    #[inline(always)]
    fn new(simd: S, g: f64) -> Self {
        let mut powers = [g; MOST_LANES];
        for k in 1..MOST_LANES {
            powers[k] = powers[k - 1] * g;
        }
        let lanes = |x: [f64; MOST_LANES]| S::as_simd_f64s(&x[..S::F64_LANES]).0[0];
        let within = [1, 2, 4].map(|s| {
            let mut x = [powers[s - 1]; MOST_LANES];
            x[..s].fill(0.0);
            lanes(x)
        });
        Powers { simd, g, within, before: lanes(powers), over: powers[S::F64_LANES - 1] }
    }

    #[inline(always)]
    fn divide(&self, row: &mut [f64], mut last: f64) {
        let simd = self.simd;
        let (registers, _) = S::as_mut_simd_f64s(row);
        for register in registers {
            let mut y = *register;
            y = simd.mul_add_e_f64s(self.within[0], simd.rotate_right_f64s(y, 1), y);
            if S::F64_LANES > 2 {
                y = simd.mul_add_e_f64s(self.within[1], simd.rotate_right_f64s(y, 2), y);
            }
            if S::F64_LANES > 4 {
                y = simd.mul_add_e_f64s(self.within[2], simd.rotate_right_f64s(y, 4), y);
            }
            *register = y;
        }
        for part in row.chunks_exact_mut(S::F64_LANES) {
            let next = self.over.mul_add(last, part[S::F64_LANES - 1]);
            let (registers, _) = S::as_mut_simd_f64s(part);
            for y in registers {
                *y = simd.mul_add_e_f64s(self.before, simd.splat_f64s(last), *y);
            }
            last = next;
        }
        let tail = row.len() - row.len() % S::F64_LANES;
        for y in &mut row[tail..] {
            last = self.g.mul_add(last, *y);
            *y = last;
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
