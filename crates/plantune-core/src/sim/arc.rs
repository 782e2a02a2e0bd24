//! A smooth piece of a signal, by what its ends are known to be, and what is asked of it.
//!
//! ```text
//! Decay   p(s) = p0 + (p1 - p0) psi(s),  psi = (1 - e^(-l s)) / (1 - e^(-l))      s in [0, 1]
//! Cubic   by the values and slopes of both ends; with A = p0 + p1, B = p1 - p0, C = d0 - d1, D = d0 + d1,
//!         int p = A/2 + C/12,   int s p = A/4 + B/10 + C/24 - D/120
//!         int p^2 = A^2/4 + A C/12 + C^2/120 + 17 B^2/140 - 3 B D/140 + D^2/840
//! ```
//!
//! A decay is what a first order does under a held input, exactly. In Bernstein form,
//! `b = [p0, p0 + d0/3, p1 - d1/3, p1]`, a cubic stays between its least and largest coefficient, and changes
//! its sign at most as often as they do: a glance at four numbers tells that there is nothing to look for.

/// Halvings after which a root is as good as found.
const DEEPEST: u32 = 40;
/// Where a root lies to this share of the piece, integrals no longer depend on it.
const CLOSE: f64 = 1e-10;

/// A piece of a signal over `s` from 0 to 1.
pub trait Arc: Copy {
    /// `a + k p`.
    fn affine(&self, a: f64, k: f64) -> Self;
    /// Values at the ends.
    fn ends(&self) -> (f64, f64);
    /// Integrals, and a range that holds the piece.
    fn moments(&self) -> Moments;
    /// `int |p|` and `int s |p|`.
    fn absolute_moments(&self) -> (f64, f64);
    /// The largest value.
    fn largest(&self) -> f64;
    /// The first `s` at which it reaches zero.
    fn first_root(&self) -> Option<f64>;
    /// The last `s` at which it leaves zero.
    fn last_root(&self) -> Option<f64>;
}

/// `int p`, `int s p`, `int p^2`, and bounds of `p`.
#[derive(Clone, Copy, Debug)]
pub struct Moments {
    /// `int p`.
    pub mean: f64,
    /// `int s p`.
    pub first: f64,
    /// `int p^2`.
    pub square: f64,
    /// No value is less.
    pub low: f64,
    /// No value is larger.
    pub high: f64,
}

/// The way from `p0` to `p1` as a mode dies out.
#[derive(Clone, Copy, Debug)]
pub struct Decay {
    p0: f64,
    p1: f64,
    shape: Shape,
}

/// `int psi`, `int s psi`, `int psi^2` for one `l`.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    l: f64,
    mean: f64,
    first: f64,
    square: f64,
}

impl Shape {
    /// Of `l` time constants.
    pub fn of(l: f64) -> Self {
        let settled = -(-l).exp_m1(); // 1 - e^(-l)
        let (mean, first, square) = if l > 1.0 {
            let (a, mode) = (1.0 - settled, settled / l);
            (1.0 - mode, 0.5 - (mode - a) / l, 1.0 - 2.0 * mode + 0.5 * mode * (1.0 + a))
        } else {
            // 1 - e^(-l s) = -sum_k (-l s)^k / k!
            let (mut mean, mut first, mut square, mut term) = (0.0, 0.0, 0.0, 1.0);
            for k in 1..=20 {
                let order = f64::from(k);
                term *= -l / order;
                mean -= term / (order + 1.0);
                first -= term / (order + 2.0);
                square += term * (2f64.powi(k) - 2.0) / (order + 1.0);
            }
            (mean, first, square)
        };
        if l < 1e-100 {
            return Shape { l, mean: 1.0 / 2.0, first: 1.0 / 3.0, square: 1.0 / 3.0 };
        }
        Shape { l, mean: mean / settled, first: first / settled, square: square / (settled * settled) }
    }
}

impl Decay {
    /// From `p0` to `p1`.
    #[inline(always)]
    pub fn new(p0: f64, p1: f64, shape: Shape) -> Self {
        Decay { p0, p1, shape }
    }

    /// Where it is zero, if it is within.
    fn only_root(&self) -> Option<f64> {
        let (p0, p1, l) = (self.p0, self.p1, self.shape.l);
        let share = p0 / (p0 - p1);
        if p0 == p1 || !(0.0..=1.0).contains(&share) {
            return None;
        }
        Some(if l < 1e-8 { share } else { -(share * (-l).exp_m1()).ln_1p() / l })
    }
}

impl Arc for Decay {
    #[inline(always)]
    fn affine(&self, a: f64, k: f64) -> Self {
        Decay { p0: a + k * self.p0, p1: a + k * self.p1, shape: self.shape }
    }

    #[inline(always)]
    fn ends(&self) -> (f64, f64) {
        (self.p0, self.p1)
    }

    #[inline(always)]
    fn moments(&self) -> Moments {
        let (p0, way) = (self.p0, self.p1 - self.p0);
        let mean = way * self.shape.mean;
        // Plain comparisons: one instruction each, where `min` and `max` mind NaN.
        let (low, high) = if way > 0.0 { (p0, self.p1) } else { (self.p1, p0) };
        Moments {
            mean: p0 + mean,
            first: 0.5 * p0 + way * self.shape.first,
            square: p0 * (p0 + 2.0 * mean) + way * way * self.shape.square,
            low,
            high,
        }
    }

    fn absolute_moments(&self) -> (f64, f64) {
        let Moments { mean, first, .. } = self.moments();
        let Some(at) = self.only_root() else { return (mean.abs(), first.abs()) };
        let before = Decay { p0: self.p0, p1: 0.0, shape: Shape::of(at * self.shape.l) }.moments();
        let (mean0, first0) = (at * before.mean, at * at * before.first);
        (mean0.abs() + (mean - mean0).abs(), first0.abs() + (first - first0).abs())
    }

    fn largest(&self) -> f64 {
        self.p0.max(self.p1)
    }

    fn first_root(&self) -> Option<f64> {
        self.only_root()
    }

    fn last_root(&self) -> Option<f64> {
        self.only_root()
    }
}

/// A cubic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cubic {
    p0: f64,
    p1: f64,
    /// Slopes per piece.
    d0: f64,
    d1: f64,
}

impl Cubic {
    /// From values and slopes at the ends of `h` seconds.
    #[inline(always)]
    pub fn new(h: f64, (p0, slope0): (f64, f64), (p1, slope1): (f64, f64)) -> Self {
        Cubic { p0, p1, d0: h * slope0, d1: h * slope1 }
    }

    fn bernstein(&self) -> [f64; 4] {
        [self.p0, self.p0 + self.d0 / 3.0, self.p1 - self.d1 / 3.0, self.p1]
    }

    /// Coefficients of `1, s, s^2, s^3`.
    fn powers(&self) -> [f64; 4] {
        let Cubic { p0, p1, d0, d1 } = *self;
        [p0, d0, 3.0 * (p1 - p0) - 2.0 * d0 - d1, d0 + d1 - 2.0 * (p1 - p0)]
    }

    fn at(&self, s: f64) -> f64 {
        let c = self.powers();
        c[0] + s * (c[1] + s * (c[2] + s * c[3]))
    }

    fn slope(&self, s: f64) -> f64 {
        let c = self.powers();
        c[1] + s * (2.0 * c[2] + s * 3.0 * c[3])
    }

    /// `int p` and `int s p` over `[0, s]`.
    fn until(&self, s: f64) -> (f64, f64) {
        let c = self.powers();
        (
            s * (c[0] + s * (c[1] / 2.0 + s * (c[2] / 3.0 + s * c[3] / 4.0))),
            s * s * (c[0] / 2.0 + s * (c[1] / 3.0 + s * (c[2] / 4.0 + s * c[3] / 5.0))),
        )
    }

    /// Both halves, each with its own `[0, 1]`.
    fn halves(&self) -> (Self, Self) {
        let (middle, slope) = (self.at(0.5), 0.5 * self.slope(0.5));
        (
            Cubic { p1: middle, d0: 0.5 * self.d0, d1: slope, ..*self },
            Cubic { p0: middle, d0: slope, d1: 0.5 * self.d1, ..*self },
        )
    }

    /// Changes of sign along the coefficients, zeros left out.
    fn sign_changes(&self) -> usize {
        let (mut changes, mut last) = (0, 0.0);
        for b in self.bernstein().into_iter().filter(|&b| b != 0.0) {
            changes += usize::from(b.signum() * last < 0.0);
            last = b.signum();
        }
        changes
    }

    /// Where it crosses zero if it does so once: Newton's steps, halving where they leave the bracket.
    fn only_root(&self) -> f64 {
        let Cubic { p0, p1, .. } = *self;
        if p0 == 0.0 || p1 == 0.0 {
            return if p0 == 0.0 { 0.0 } else { 1.0 };
        }
        let (mut low, mut high) = (0.0, 1.0);
        let mut s = p0 / (p0 - p1);
        for _ in 0..60 {
            let p = self.at(s);
            if (p > 0.0) == (p0 > 0.0) {
                low = s
            } else {
                high = s
            }
            let next = s - p / self.slope(s);
            let next = if low < next && next < high { next } else { 0.5 * (low + high) };
            if (next - s).abs() < CLOSE {
                return next;
            }
            s = next;
        }
        s
    }

    fn by_sign(&self, depth: u32) -> (f64, f64) {
        let whole = self.until(1.0);
        match self.sign_changes() {
            0 => (whole.0.abs(), whole.1.abs()),
            1 => {
                let part = self.until(self.only_root());
                (part.0.abs() + (whole.0 - part.0).abs(), part.1.abs() + (whole.1 - part.1).abs())
            }
            _ if depth == 0 => (whole.0.abs(), whole.1.abs()),
            _ => {
                let (left, right) = self.halves();
                let (left, right) = (left.by_sign(depth - 1), right.by_sign(depth - 1));
                (0.5 * (left.0 + right.0), 0.25 * (left.1 + right.0 + right.1))
            }
        }
    }

    fn root(&self, first: bool, depth: u32) -> Option<f64> {
        match self.sign_changes() {
            0 => None,
            1 => Some(self.only_root()),
            _ if depth == 0 => Some(0.5),
            _ => {
                let (left, right) = self.halves();
                let left = left.root(first, depth - 1).map(|s| 0.5 * s);
                let right = right.root(first, depth - 1).map(|s| 0.5 + 0.5 * s);
                if first { left.or(right) } else { right.or(left) }
            }
        }
    }
}

impl Arc for Cubic {
    #[inline(always)]
    fn affine(&self, a: f64, k: f64) -> Self {
        Cubic { p0: a + k * self.p0, p1: a + k * self.p1, d0: k * self.d0, d1: k * self.d1 }
    }

    #[inline(always)]
    fn ends(&self) -> (f64, f64) {
        (self.p0, self.p1)
    }

    #[inline(always)]
    fn moments(&self) -> Moments {
        let Cubic { p0, p1, d0, d1 } = *self;
        let (A, B, C, D) = (p0 + p1, p1 - p0, d0 - d1, d0 + d1);
        let reach = 0.5 * B.abs() + (d0.abs() + d1.abs()) * (1.0 / 3.0);
        Moments {
            mean: 0.5 * A + C * (1.0 / 12.0),
            first: 0.25 * A + 0.1 * B + (C * (1.0 / 24.0) - D * (1.0 / 120.0)),
            square: A * (0.25 * A + C * (1.0 / 12.0))
                + B * (B * (17.0 / 140.0) - D * (3.0 / 140.0))
                + (C * C * (1.0 / 120.0) + D * D * (1.0 / 840.0)),
            low: 0.5 * A - reach,
            high: 0.5 * A + reach,
        }
    }

    fn absolute_moments(&self) -> (f64, f64) {
        self.by_sign(DEEPEST)
    }

    fn largest(&self) -> f64 {
        let [a, b, c, d] = self.bernstein();
        let ends = a.max(d);
        if b.max(c) <= ends {
            return ends;
        }
        // p' / 3 = first - 2 B s + C s^2
        let (first, second, third) = (b - a, c - b, d - c);
        let (B, C) = (first - second, first - 2.0 * second + third);
        let root = (B * B - C * first).max(0.0).sqrt();
        let turns = [first / (B + root), first / (B - root)];
        let inside = turns.into_iter().filter(|s| (0.0..=1.0).contains(s));
        inside.map(|s| self.at(s)).fold(ends, f64::max)
    }

    fn first_root(&self) -> Option<f64> {
        self.root(true, DEEPEST)
    }

    fn last_root(&self) -> Option<f64> {
        self.root(false, DEEPEST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoint sums of `p, s p, p^2, |p|, s |p|` in 1e6 steps.
    fn sums(p: impl Fn(f64) -> f64) -> [f64; 5] {
        let n = 1_000_000;
        let mut sums = [0.0; 5];
        for k in 0..n {
            let s = (f64::from(k) + 0.5) / f64::from(n);
            let p = p(s);
            for (sum, x) in sums.iter_mut().zip([p, s * p, p * p, p.abs(), s * p.abs()]) {
                *sum += x / f64::from(n);
            }
        }
        sums
    }

    fn assert_integrals(arc: impl Arc + std::fmt::Debug, p: impl Fn(f64) -> f64) {
        let (Moments { mean, first, square, low, high }, absolute) = (arc.moments(), arc.absolute_moments());
        let ours = [mean, first, square, absolute.0, absolute.1];
        for (ours, sum) in ours.iter().zip(sums(&p)) {
            assert!((ours - sum).abs() < 1e-10 * (1.0 + high - low), "{arc:?}: {ours} {sum}");
        }
        assert!(
            (0..=100).all(|k| (low - 1e-12..=high + 1e-12).contains(&p(f64::from(k) / 100.0))),
            "{arc:?}"
        );
    }

    /// Zeros at 0.2, 0.5 and 0.9.
    fn thrice_zero() -> Cubic {
        let p = |s: f64| (s - 0.2) * (s - 0.5) * (s - 0.9);
        let slope = |s: f64| (s - 0.5) * (s - 0.9) + (s - 0.2) * (s - 0.9) + (s - 0.2) * (s - 0.5);
        Cubic::new(3.0, (p(0.0), slope(0.0) / 3.0), (p(1.0), slope(1.0) / 3.0))
    }

    #[test]
    fn integrals_of_a_cubic() {
        let touching = Cubic::new(1.0, (1.0, -4.1), (1.0, 4.1));
        for arc in [thrice_zero(), Cubic::new(2.0, (1.0, -6.0), (2.0, 3.0)), touching] {
            assert_integrals(arc, |s| arc.at(s));
        }
    }

    #[test]
    fn integrals_of_a_decay() {
        for l in [1e-9, 0.1, 0.999, 1.001, 7.0, 200.0] {
            for (p0, p1) in [(1.0, 3.0), (-0.3, 1.0), (0.0, -1.0), (2.0, 2.0), (1.0, -1e-3)] {
                let psi = |s: f64| (-l * s).exp_m1() / (-l).exp_m1();
                assert_integrals(Decay::new(p0, p1, Shape::of(l)), |s| p0 + (p1 - p0) * psi(s));
            }
        }
    }

    #[test]
    fn first_and_last_zero_are_found() {
        let arc = thrice_zero();
        assert!((arc.first_root().expect("a root") - 0.2).abs() < 1e-9);
        assert!((arc.last_root().expect("a root") - 0.9).abs() < 1e-9);
        // All but touching zero: the coefficients change their sign, the curve does not.
        assert_eq!(Cubic::new(1.0, (1.0, -3.9), (1.0, 3.9)).first_root(), None);
        let at = Decay::new(1.0, -1.0, Shape::of(2.0)).first_root().expect("a root");
        assert!(((-2.0 * at).exp() - 0.5 * (1.0 + (-2f64).exp())).abs() < 1e-15);
        assert_eq!(Decay::new(1.0, 2.0, Shape::of(2.0)).last_root(), None);
    }

    #[test]
    fn the_largest_value_may_lie_inside() {
        let arc = thrice_zero();
        let sampled = (0..=10_000).map(|k| arc.at(f64::from(k) * 1e-4)).fold(f64::MIN, f64::max);
        assert!((arc.largest() - sampled).abs() < 1e-8);
        assert_eq!(Cubic::new(1.0, (0.0, 3.0), (0.0, -3.0)).largest(), 0.75);
        assert_eq!(Decay::new(1.0, -1.0, Shape::of(2.0)).largest(), 1.0);
    }
}
