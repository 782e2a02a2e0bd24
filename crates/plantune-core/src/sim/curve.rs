//! A smooth piece of a signal: the cubic with the values and slopes of both ends.
//!
//! ```text
//! p(s) = sum_i b_i B_i(s),  B_i = C(3, i) s^i (1-s)^(3-i),  s in [0, 1]
//! b = [p0, p0 + h p0'/3, p1 - h p1'/3, p1]
//! int p = sum b_i / 4,   int s p = sum (i + 1) b_i / 20,   int p^2 = sum_ij C(3,i) C(3,j) / C(6,i+j) b_i b_j / 7
//! ```
//!
//! In Bernstein form the curve stays between its least and largest coefficient, and changes its sign at most
//! as often as they do: a glance at four numbers tells that there is nothing to look for.

/// Halvings after which a root is as good as found.
const DEEPEST: u32 = 40;

/// Coefficients in Bernstein form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve(pub [f64; 4]);

impl Curve {
    /// From values and slopes at the ends of `h` seconds.
    #[inline(always)]
    pub fn new(h: f64, (p0, slope0): (f64, f64), (p1, slope1): (f64, f64)) -> Self {
        let third = h * (1.0 / 3.0);
        Curve([p0, p0 + third * slope0, p1 - third * slope1, p1])
    }

    /// `level - p`.
    #[inline(always)]
    pub fn below(&self, level: f64) -> Self {
        Curve(self.0.map(|b| level - b))
    }

    /// Least and largest coefficient.
    #[inline(always)]
    pub fn hull(&self) -> (f64, f64) {
        // Plain comparisons: one instruction each, where `min` and `max` mind NaN.
        let order = |x: f64, y: f64| if x < y { (x, y) } else { (y, x) };
        let [a, b, c, d] = self.0;
        let ((low0, high0), (low1, high1)) = (order(a, b), order(c, d));
        (order(low0, low1).0, order(high0, high1).1)
    }

    /// `int p` and `int s p` over `[0, 1]`.
    #[inline(always)]
    pub fn moments(&self) -> (f64, f64) {
        let [a, b, c, d] = self.0;
        (0.25 * ((a + d) + (b + c)), 0.05 * ((a + 2.0 * b) + (3.0 * c + 4.0 * d)))
    }

    /// `int p^2`.
    #[inline(always)]
    pub fn square(&self) -> f64 {
        let [a, b, c, d] = self.0;
        let ends = a * (a + b + 0.1 * d) + d * (d + c);
        let inner = b * (0.6 * b + 0.9 * c + 0.4 * d) + c * (0.6 * c + 0.4 * a);
        (ends + inner) * (1.0 / 7.0)
    }

    /// `int |p|` and `int s |p|`; what is less than `least` is not looked at closely.
    pub fn absolute_moments(&self, least: f64) -> (f64, f64) {
        self.by_sign(least, DEEPEST)
    }

    fn by_sign(&self, least: f64, depth: u32) -> (f64, f64) {
        let (low, high) = self.hull();
        if depth == 0 || high.max(-low) <= least {
            return Curve(self.0.map(f64::abs)).moments();
        }
        let (at, parts) = match self.sign_changes() {
            0 => return Curve(self.0.map(f64::abs)).moments(),
            1 => {
                let at = self.only_root();
                let (left, right) = self.split(at);
                let size = |(mean, first): (f64, f64)| (mean.abs(), first.abs());
                (at, [size(left.moments()), size(right.moments())])
            }
            _ => {
                let (left, right) = self.split(0.5);
                (0.5, [left.by_sign(least, depth - 1), right.by_sign(least, depth - 1)])
            }
        };
        let ([(mean0, first0), (mean1, first1)], rest) = (parts, 1.0 - at);
        (at * mean0 + rest * mean1, at * at * first0 + rest * (at * mean1 + rest * first1))
    }

    /// The largest value.
    pub fn largest(&self) -> f64 {
        let [a, b, c, d] = self.0;
        let ends = a.max(d);
        if b.max(c) <= ends {
            return ends;
        }
        // p' / 3 = A - 2 B s + C s^2
        let (first, second, third) = (b - a, c - b, d - c);
        let (B, C) = (first - second, first - 2.0 * second + third);
        let root = (B * B - C * first).max(0.0).sqrt();
        let turns = [first / (B + root), first / (B - root)];
        let inside = turns.into_iter().filter(|s| (0.0..=1.0).contains(s));
        inside.map(|s| self.at(s)).fold(ends, f64::max)
    }

    /// The first `s` at which the curve reaches zero.
    pub fn first_root(&self) -> Option<f64> {
        self.root(true, 0)
    }

    /// The last `s` at which the curve leaves zero.
    pub fn last_root(&self) -> Option<f64> {
        self.root(false, 0)
    }

    fn root(&self, first: bool, depth: u32) -> Option<f64> {
        match self.sign_changes() {
            0 => None,
            1 => Some(self.only_root()),
            _ if depth == DEEPEST => Some(0.5),
            _ => {
                let (left, right) = self.split(0.5);
                let left = left.root(first, depth + 1).map(|s| 0.5 * s);
                let right = right.root(first, depth + 1).map(|s| 0.5 + 0.5 * s);
                if first { left.or(right) } else { right.or(left) }
            }
        }
    }

    /// Changes of sign along the coefficients, zeros left out.
    fn sign_changes(&self) -> usize {
        let mut signs = self.0.iter().filter(|&&b| b != 0.0).map(|b| *b > 0.0);
        let mut last = signs.next();
        signs.filter(|&sign| last.replace(sign) != Some(sign)).count()
    }

    /// Where it crosses zero if it does so once: false position, the end that stands still halved.
    fn only_root(&self) -> f64 {
        let (mut s0, mut s1) = (0.0, 1.0);
        let (mut p0, mut p1) = (self.0[0], self.0[3]);
        if p0 == 0.0 || p1 == 0.0 {
            return if p0 == 0.0 { s0 } else { s1 };
        }
        for _ in 0..60 {
            let s = s0 + (s1 - s0) * p0 / (p0 - p1);
            let p = self.at(s);
            if p == 0.0 || s <= s0 || s >= s1 || s1 - s0 < 1e-15 {
                return s.clamp(0.0, 1.0);
            }
            if (p > 0.0) == (p0 > 0.0) {
                (s0, p0, p1) = (s, p, 0.5 * p1);
            } else {
                (s1, p1, p0) = (s, p, 0.5 * p0);
            }
        }
        0.5 * (s0 + s1)
    }

    /// `p(s)`.
    pub fn at(&self, s: f64) -> f64 {
        self.split(s).0.0[3]
    }

    /// Both sides of `s`, each with its own `[0, 1]`.
    fn split(&self, s: f64) -> (Self, Self) {
        let mix = |x: f64, y: f64| x + s * (y - x);
        let [a, b, c, d] = self.0;
        let (ab, bc, cd) = (mix(a, b), mix(b, c), mix(c, d));
        let (abc, bcd) = (mix(ab, bc), mix(bc, cd));
        let middle = mix(abc, bcd);
        (Curve([a, ab, abc, middle]), Curve([middle, bcd, cd, d]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Zeros at 0.2, 0.5 and 0.9 of a piece of 3 s: `p = (s - 0.2)(s - 0.5)(s - 0.9)`.
    fn thrice_zero() -> Curve {
        let p = |s: f64| (s - 0.2) * (s - 0.5) * (s - 0.9);
        let slope = |s: f64| (s - 0.5) * (s - 0.9) + (s - 0.2) * (s - 0.9) + (s - 0.2) * (s - 0.5);
        Curve::new(3.0, (p(0.0), slope(0.0) / 3.0), (p(1.0), slope(1.0) / 3.0))
    }

    /// Midpoint sums of 1e6 steps.
    fn sums(curve: &Curve) -> [f64; 5] {
        let n = 1_000_000;
        let mut sums = [0.0; 5];
        for k in 0..n {
            let s = (f64::from(k) + 0.5) / f64::from(n);
            let p = curve.at(s);
            for (sum, x) in sums.iter_mut().zip([p, s * p, p * p, p.abs(), s * p.abs()]) {
                *sum += x / f64::from(n);
            }
        }
        sums
    }

    #[test]
    fn integrals_are_those_of_the_cubic() {
        for curve in [thrice_zero(), Curve([1.0, -3.0, 0.2, 2.0]), Curve([0.3, 0.1, -2.0, -0.5])] {
            let ((mean, first), (absolute, moment)) = (curve.moments(), curve.absolute_moments(0.0));
            let ours = [mean, first, curve.square(), absolute, moment];
            for (ours, sum) in ours.iter().zip(sums(&curve)) {
                assert!((ours - sum).abs() < 1e-11, "{curve:?}: {ours} {sum}");
            }
        }
    }

    #[test]
    fn first_and_last_zero_are_found() {
        let curve = thrice_zero();
        assert!((curve.first_root().expect("a root") - 0.2).abs() < 1e-12);
        assert!((curve.last_root().expect("a root") - 0.9).abs() < 1e-12);
        assert_eq!(Curve([1.0, 0.1, 0.1, 1.0]).first_root(), None);
        // All but touching zero: the coefficients change their sign, the curve does not.
        assert_eq!(Curve([1.0, -0.3, -0.3, 1.0]).first_root(), None);
    }

    #[test]
    fn the_largest_value_may_lie_inside() {
        let curve = thrice_zero();
        let sampled = (0..=10_000).map(|k| curve.at(f64::from(k) * 1e-4)).fold(f64::MIN, f64::max);
        assert!((curve.largest() - sampled).abs() < 1e-8);
        assert_eq!(Curve([0.0, 1.0, 2.0, 3.0]).largest(), 3.0);
        assert_eq!(Curve([0.0, 1.0, 1.0, 0.0]).largest(), 0.75);
    }
}
