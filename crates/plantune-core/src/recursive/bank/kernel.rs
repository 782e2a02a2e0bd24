//! One sample of eight estimators side by side, in whatever registers the processor has.
//!
//! ```text
//! phi   = [y(t-1), u(t-nk), 1, ebar(t-1)]         psi = phi - c psi(t-1)
//! f     = U' psi ;  g_j = D_j f_j ;  alpha_0 = lambda ;  alpha_j = alpha_(j-1) + f_j g_j
//! D_j   <- D_j alpha_(j-1) / (alpha_j lambda) ;  U_ij <- U_ij - b_i f_j / alpha_(j-1) ;  b_i += U_ij g_j
//! theta <- theta + b eps / alpha_4                eps = y - phi' theta ;  ebar = y - phi' theta afterwards
//! ```
//!
//! Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, chapter V. Every `alpha` follows
//! from the old factors, so one division serves all four: of 1 by their product.

use std::ops::{Deref, DerefMut};

use pulp::Simd;

/// Estimators in a row: one register of AVX-512, two of AVX2.
pub const W: usize = 8;

/// A number of each of eight estimators, or of their signals. Where rows straddle lines of the cache, one loop
/// takes nearly twice as long.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Row(pub [f64; W]);

impl Row {
    /// The same number eight times.
    pub const fn of(x: f64) -> Self {
        Row([x; W])
    }
}

impl Deref for Row {
    type Target = [f64; W];

    #[inline(always)]
    fn deref(&self) -> &[f64; W] {
        &self.0
    }
}

impl DerefMut for Row {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64; W] {
        &mut self.0
    }
}

/// Numbers of one estimator.
pub const NUMBERS: usize = 19;

/// All that eight estimators remember: 19 numbers each, in one piece, for memory is what limits a large bank.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct Lanes {
    /// Parameters a, b, d, c.
    pub theta: [Row; 4],
    /// `U` above the diagonal, column by column: U01, U02, U12, U03, U13, U23.
    pub U: [Row; 6],
    /// Diagonal `D`.
    pub D: [Row; 4],
    /// Regressor divided by `C(q)`.
    pub psi: [Row; 4],
    /// Error after the update, which is `e(t-1)` to the next sample.
    pub ebar: Row,
}

/// What those who ask for it learn of eight estimators.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct Errors {
    /// Error before the update.
    pub eps: Row,
    /// `psi' P psi`.
    pub q: Row,
    /// Robust variance of the noise.
    pub s2: Row,
}

impl Lanes {
    /// No knowledge but `P0`, at rest.
    pub fn new(P0: &[f64; 4]) -> Self {
        let zero = Row::of(0.0);
        Lanes { theta: [zero; 4], U: [zero; 6], D: P0.map(Row::of), psi: [zero; 4], ebar: zero }
    }

    /// Every row, in the order of the fields.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.theta.iter().chain(&self.U).chain(&self.D).chain(&self.psi).chain([&self.ebar])
    }

    /// Every row, to be written.
    pub fn rows_mut(&mut self) -> impl Iterator<Item = &mut Row> {
        let Lanes { theta, U, D, psi, ebar } = self;
        theta.iter_mut().chain(U).chain(D).chain(psi).chain([ebar])
    }

    /// `P = U D U'` of one estimator.
    pub fn P(&self, slot: usize) -> [[f64; 4]; 4] {
        let at = |i: usize, k: usize| if i == k { 1.0 } else { self.U[k * (k - 1) / 2 + i][slot] };
        let sum = |i: usize, j: usize| (j..4).map(|k| at(i, k) * self.D[k][slot] * at(j, k)).sum();
        std::array::from_fn(|i| std::array::from_fn(|j| sum(i.min(j), i.max(j))))
    }

    /// `U D U' <- U D U' + variance x x'` with `x` the unit vector of parameter `n`.
    ///
    /// Agee and Turner, White Sands Missile Range TR-38, 1972: from the last column to the first.
    pub fn add_variance(&mut self, slot: usize, n: usize, variance: f64) {
        let (mut x, mut c) = ([0.0; 4], variance);
        x[n] = 1.0;
        for j in (0..=n).rev() {
            let (s, D) = (x[j], self.D[j][slot]);
            let more = D + c * s * s;
            let beta = c * s / more;
            for (U, x) in self.U[j * j.saturating_sub(1) / 2..].iter_mut().zip(&mut x[..j]) {
                *x -= s * U[slot];
                U[slot] += beta * *x;
            }
            c *= D / more;
            self.D[j][slot] = more;
        }
    }
}

/// Settings in registers.
#[derive(Clone, Copy)]
pub struct Fixed<S: Simd> {
    pub one: S::f64s,
    /// -1 where the gradient is filtered (RML), 0 where it is not (ELS).
    pub filter: S::f64s,
    pub D_most: S::f64s,
    pub c_most: S::f64s,
    pub c_least: S::f64s,
}

/// What the estimators of a group share at this sample.
#[derive(Clone, Copy)]
pub struct Now<S: Simd> {
    pub y: S::f64s,
    pub y_before: S::f64s,
    pub lambda: S::f64s,
    pub inverse: S::f64s,
    /// Which of them learn.
    pub learn: S::m64s,
}

/// How an error is judged before it is learnt.
#[derive(Clone, Copy)]
pub struct Judge<S: Simd> {
    /// Weight of this sample in `s2`.
    pub weight: S::f64s,
    /// Where `s2` still settles, every error counts in full.
    pub settled: S::m64s,
    /// Largest error believed, squared and in units of `s2 (1 + q)`.
    pub clip2: Option<S::f64s>,
    /// Least variance believed.
    pub floor: S::f64s,
    /// Largest square in `s2`, in units of it.
    pub nine: S::f64s,
}

/// The register of these lanes in a row.
#[inline(always)]
pub fn at<S: Simd>(row: &mut Row, r: usize) -> &mut S::f64s {
    &mut S::as_mut_simd_f64s(&mut row.0).0[r]
}

/// Learns one sample; `r` counts registers within the row. What is returned is huge, or no number, where
/// the numbers of an estimator have left their range.
#[inline(always)]
pub fn learn<S: Simd, const GATED: bool>(
    simd: S,
    fixed: &Fixed<S>,
    now: &Now<S>,
    u: S::f64s,
    lanes: &mut Lanes,
    r: usize,
    errors: Option<(&mut Errors, &Judge<S>)>,
) -> S::f64s {
    let add = |a, b, c| simd.mul_add_e_f64s(a, b, c); // a b + c
    let less = |a, b, c| simd.negate_mul_add_e_f64s(a, b, c); // c - a b
    let mul = |a, b| simd.mul_f64s(a, b);
    let Lanes { theta, U, D, psi, ebar } = lanes;
    let theta = theta.each_mut().map(|row| at::<S>(row, r));
    let U = U.each_mut().map(|row| at::<S>(row, r));
    let D = D.each_mut().map(|row| at::<S>(row, r));
    let psi = psi.each_mut().map(|row| at::<S>(row, r));
    let ebar = at::<S>(ebar, r);

    // The error before, and the gradient.
    let (y1, e1, one) = (now.y_before, *ebar, fixed.one);
    let residual = |a, b, d, c| less(c, e1, simd.sub_f64s(less(a, y1, now.y), add(b, u, d)));
    let [a, b, d, c] = theta;
    let eps = residual(*a, *b, *d, *c);
    let filter = mul(fixed.filter, *c);
    let [p0, p1, p2, p3] = psi;
    *p0 = add(filter, *p0, y1);
    *p1 = add(filter, *p1, u);
    *p2 = add(filter, *p2, one);
    *p3 = add(filter, *p3, e1);
    let (p0, p1, p2, p3) = (*p0, *p1, *p2, *p3);

    // f = U' psi, and every alpha.
    let [U01, U02, U12, U03, U13, U23] = U;
    let [D0, D1, D2, D3] = D;
    let f1 = add(*U01, p0, p1);
    let f2 = add(*U12, p1, add(*U02, p0, p2));
    let f3 = add(*U23, p2, add(*U13, p1, add(*U03, p0, p3)));
    let (g0, g1, g2, g3) = (mul(*D0, p0), mul(*D1, f1), mul(*D2, f2), mul(*D3, f3));
    let a1 = add(p0, g0, now.lambda);
    let a2 = add(f1, g1, a1);
    let a3 = add(f2, g2, a2);
    let a4 = add(f3, g3, a3);

    // Their inverses, by one division, that of `a4` first: the parameters wait for it.
    let (a12, a123) = (mul(a1, a2), mul(mul(a1, a2), a3));
    let inverse = simd.div_f64s(one, mul(a123, a4));
    let (i4, i123) = (mul(inverse, a123), mul(inverse, a4));
    let (i3, i12) = (mul(i123, a12), mul(i123, a3));
    let (i2, i1) = (mul(i12, a1), mul(i12, a2));

    // What is believed of the error.
    let believed = match errors {
        None => eps,
        Some((errors, judge)) => {
            let q = simd.sub_f64s(a4, now.lambda);
            judged::<S, GATED>(simd, judge, now, eps, q, errors, r)
        }
    };
    let step = mul(believed, i4);

    // The factors.
    let keep = |new: S::f64s, old: S::f64s| if GATED { simd.select_f64s(now.learn, new, old) } else { new };
    let D_of = |D: S::f64s, share: S::f64s| keep(simd.min_f64s(mul(D, share), fixed.D_most), D);
    *D0 = D_of(*D0, i1);
    *D1 = D_of(*D1, mul(mul(a1, i2), now.inverse));
    *D2 = D_of(*D2, mul(mul(a2, i3), now.inverse));
    *D3 = D_of(*D3, mul(mul(a3, i4), now.inverse));
    let (m1, m2, m3) = (mul(f1, i1), mul(f2, i2), mul(f3, i3));
    let (u01, u02, u12, u03, u13, u23) = (*U01, *U02, *U12, *U03, *U13, *U23);
    *U01 = keep(less(g0, m1, u01), u01);
    let b0 = add(u01, g1, g0);
    *U02 = keep(less(b0, m2, u02), u02);
    *U12 = keep(less(g1, m2, u12), u12);
    let (b0, b1) = (add(u02, g2, b0), add(u12, g2, g1));
    *U03 = keep(less(b0, m3, u03), u03);
    *U13 = keep(less(b1, m3, u13), u13);
    *U23 = keep(less(g2, m3, u23), u23);
    let (b0, b1, b2) = (add(u03, g3, b0), add(u13, g3, b1), add(u23, g3, g2));

    // The parameters, `c` kept inside, and the error after.
    *a = keep(add(b0, step, *a), *a);
    *b = keep(add(b1, step, *b), *b);
    *d = keep(add(b2, step, *d), *d);
    let free = add(g3, step, *c);
    *c = keep(simd.max_f64s(simd.min_f64s(free, fixed.c_most), fixed.c_least), *c);
    *ebar = residual(*a, *b, *d, *c);
    add(eps, eps, a4)
}

/// Notes error and variance, and returns the error as far as it is believed.
#[inline(always)]
fn judged<S: Simd, const GATED: bool>(
    simd: S,
    judge: &Judge<S>,
    now: &Now<S>,
    eps: S::f64s,
    q: S::f64s,
    errors: &mut Errors,
    r: usize,
) -> S::f64s {
    let mul = |a, b| simd.mul_f64s(a, b);
    *at::<S>(&mut errors.eps, r) = eps;
    *at::<S>(&mut errors.q, r) = q;
    let s2 = at::<S>(&mut errors.s2, r);
    let (one, spread) = (simd.splat_f64s(1.0), simd.add_f64s(simd.splat_f64s(1.0), q));
    let square = simd.div_f64s(mul(eps, eps), spread);
    let before = simd.max_f64s(*s2, judge.floor);
    let capped = simd.select_f64s(judge.settled, simd.min_f64s(square, mul(judge.nine, before)), square);
    let next = simd.mul_add_e_f64s(judge.weight, simd.sub_f64s(capped, *s2), *s2);
    *s2 = if GATED { simd.select_f64s(now.learn, next, *s2) } else { next };
    match judge.clip2 {
        None => eps,
        Some(clip2) => {
            // Where the prediction is less certain than the noise, an error speaks of the parameters.
            let sure = simd.and_m64s(judge.settled, simd.less_than_f64s(q, one));
            let most = simd.sqrt_f64s(mul(clip2, mul(before, spread)));
            let clipped = simd.max_f64s(simd.min_f64s(eps, most), simd.neg_f64s(most));
            simd.select_f64s(sure, clipped, eps)
        }
    }
}
