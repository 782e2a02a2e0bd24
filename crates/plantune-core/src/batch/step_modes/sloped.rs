//! Square matrices that carry their slopes along `q`, and their exponential.
//!
//! ```text
//! (X, dX)(Y, dY) = (X Y, dX Y + X dY)
//! ```
//!
//! which is the product of the augmented matrices `[[X, dX], [0, X]]` without their empty quarter. The exponential
//! is Taylor's sum of the scaled matrix, squared: its slopes are exact, not differences.

/// A matrix `(n, n)` and one slope for each parameter.
#[derive(Clone, Debug)]
pub(super) struct Sloped {
    n: usize,
    parts: Vec<f64>, // (1 + parameters, n, n): the value, then the slopes
}

/// Terms of the sum; with the norm below 1/2 the next one is below 1e-16.
const TERMS: usize = 14;

impl Sloped {
    /// All zero.
    pub(super) fn zeros(n: usize, parameters: usize) -> Self {
        Sloped { n, parts: vec![0.0; (1 + parameters) * n * n] }
    }

    fn identity(n: usize, parameters: usize) -> Self {
        let mut one = Sloped::zeros(n, parameters);
        (0..n).for_each(|i| one.parts[i * n + i] = 1.0);
        one
    }

    /// The matrix itself, row-major.
    pub(super) fn value(&mut self) -> &mut [f64] {
        &mut self.parts[..self.n * self.n]
    }

    /// Its slope along parameter `s`.
    pub(super) fn slope(&mut self, s: usize) -> &mut [f64] {
        &mut self.parts[(1 + s) * self.n * self.n..][..self.n * self.n]
    }

    /// The value (0) and the slopes (1, 2, …).
    pub(super) fn part(&self, p: usize) -> &[f64] {
        &self.parts[p * self.n * self.n..][..self.n * self.n]
    }

    fn parameters(&self) -> usize {
        self.parts.len() / (self.n * self.n).max(1) - 1
    }

    /// `self other`.
    pub(super) fn times(&self, other: &Sloped) -> Sloped {
        let mut out = Sloped::zeros(self.n, self.parameters());
        for p in 0..=self.parameters() {
            let (to, n) = (p * self.n * self.n, self.n);
            add_product(&mut out.parts[to..], self.part(p), other.part(0), n);
            if p > 0 {
                add_product(&mut out.parts[to..], self.part(0), other.part(p), n);
            }
        }
        out
    }

    /// The largest sum of magnitudes in a row.
    pub(super) fn norm(&self) -> f64 {
        let row = |i: usize| self.part(0)[i * self.n..][..self.n].iter().map(|x| x.abs()).sum::<f64>();
        (0..self.n).map(row).fold(0.0, f64::max)
    }

    /// `row self` for a row with its slopes, `(1 + parameters, n)`, into `out`.
    pub(super) fn take(&self, row: &[f64], out: &mut [f64]) {
        let n = self.n;
        out.fill(0.0);
        for (p, out) in out.chunks_exact_mut(n).enumerate() {
            let mut add = |row: &[f64], matrix: &[f64]| {
                for (x, line) in row.iter().zip(matrix.chunks_exact(n)) {
                    out.iter_mut().zip(line).for_each(|(out, m)| *out += x * m);
                }
            };
            add(&row[p * n..][..n], self.part(0));
            if p > 0 {
                add(&row[..n], self.part(p));
            }
        }
    }

    /// `e^(self h)`.
    pub(super) fn exponential(&self, h: f64) -> Sloped {
        let norm = self.norm() * h.abs();
        let halvings = (2.0 * norm).max(1.0).log2().ceil().min(1000.0);
        let scale = h / halvings.exp2();
        let small = Sloped { n: self.n, parts: self.parts.iter().map(|x| x * scale).collect() };
        // Horner: I + X (I + X/2 (I + X/3 (…)))
        let one = Sloped::identity(self.n, self.parameters());
        let mut sum = one.clone();
        for term in (1..=TERMS).rev() {
            sum = small.times(&sum);
            sum.parts.iter_mut().zip(&one.parts).for_each(|(x, i)| *x = i + *x / term as f64);
        }
        for _ in 0..halvings as usize {
            sum = sum.times(&sum);
        }
        sum
    }
}

/// `out += a b`.
fn add_product(out: &mut [f64], a: &[f64], b: &[f64], n: usize) {
    for (out, a) in out.chunks_exact_mut(n).zip(a.chunks_exact(n)) {
        for (&a, b) in a.iter().zip(b.chunks_exact(n)) {
            out.iter_mut().zip(b).for_each(|(out, b)| *out += a * b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::sections::{Section, Sections};
    use crate::linalg::exponential;

    /// Against Padé's form, and slopes against differences.
    #[test]
    fn exponential_and_its_slopes() {
        let of = |q: &[f64]| Sections { pattern: vec![Section::Pair, Section::Lag], q: q.to_vec() };
        let q = [0.3, 0.1, 1.2];
        for h in [0.01, 0.7, 9.0, -0.4] {
            let ours = of(&q).matrix().exponential(h);
            let plain: Vec<f64> = of(&q).matrix().part(0).iter().map(|x| x * h).collect();
            let size = ours.part(0).iter().fold(0.0, |a: f64, x| a.max(x.abs()));
            let near = |a: &[f64], b: &[f64], tolerance: f64| {
                a.iter().zip(b).all(|(a, b)| (a - b).abs() < tolerance * size)
            };
            assert!(near(ours.part(0), &exponential(&plain, 3), 1e-13));
            for s in 0..3 {
                let [mut up, mut down] = [q, q];
                up[s] += 1e-5;
                down[s] -= 1e-5;
                let (up, down) = (of(&up).matrix().exponential(h), of(&down).matrix().exponential(h));
                let quotient: Vec<f64> =
                    up.part(0).iter().zip(down.part(0)).map(|(a, b)| (a - b) / 2e-5).collect();
                // Slopes grow with the number of time constants.
                assert!(near(ours.part(1 + s), &quotient, 1e-8 * (1.0 + 10.0 * h * h)), "{h} {s}");
            }
        }
    }
}
