//! Poles as sections in a row, `s + w` or `s^2 + 2 zeta w s + w^2`, with `q = [ln w, ln zeta, …]`.
//!
//! ```text
//! phi_j(t) = (e_1' e^(A t))_j,   A block bidiagonal: [-w] or [[0, w], [-w, -2 zeta w]], coupled by w
//! ```
//!
//! The `phi_j` span every solution of `(d/dt - p_1) … (d/dt - p_k) phi = 0` and are smooth in `q` through
//! repeated poles (`zeta = 1`) and from real to complex ones, where the `e^(p_i t)` themselves become parallel.
//! The states of a pair are scaled by `w`, so that no entry grows faster than `w`.

use super::sloped::Sloped;
use crate::linalg::Complex;

/// One or two poles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Section {
    /// `s^2 + 2 zeta w s + w^2`.
    Pair,
    /// `s + w`.
    Lag,
}

impl Section {
    /// Poles, and parameters as well.
    pub(super) fn order(self) -> usize {
        match self {
            Section::Pair => 2,
            Section::Lag => 1,
        }
    }
}

/// Sections with their parameters.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sections {
    pub(super) pattern: Vec<Section>,
    /// `ln w, ln zeta` of a pair, `ln w` of a lag, one after the other.
    pub(super) q: Vec<f64>, // (k)
}

impl Sections {
    /// Pairs first, then a single lag. Complex poles go with their conjugates; of real ones the closest (in ln)
    /// are paired first, as only partners can meet and turn complex.
    pub(super) fn of(poles: &[Complex<f64>]) -> Self {
        let mut upper: Vec<Complex<f64>> = poles.iter().copied().filter(|p| p.im > 0.0).collect();
        upper.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        let mut pairs: Vec<(f64, f64)> = upper.iter().map(|p| (p.norm_sqr(), -2.0 * p.re)).collect();
        let mut real: Vec<f64> = poles.iter().filter(|p| p.im == 0.0).map(|p| -p.re).collect();
        real.sort_by(f64::total_cmp);
        while real.len() > 1 {
            let gap = |i: &usize| (real[i + 1] / real[*i]).ln();
            let closest = (0..real.len() - 1).min_by(|i, j| gap(i).total_cmp(&gap(j))).unwrap_or(0);
            let (a, b) = (real.remove(closest), real.remove(closest));
            pairs.push((a * b, a + b));
        }
        let pair = |&(w2, sum): &(f64, f64)| [w2.ln() / 2.0, (sum / (2.0 * w2.sqrt())).ln()];
        let pattern = [vec![Section::Pair; pairs.len()], vec![Section::Lag; real.len()]].concat();
        let q = pairs.iter().flat_map(pair).chain(real.iter().map(|w| w.ln())).collect();
        Sections { pattern, q }
    }

    /// Number of poles.
    pub(super) fn order(&self) -> usize {
        self.q.len()
    }

    /// Each section with the place of its first parameter, which is that of its first state as well.
    pub(super) fn places(&self) -> impl Iterator<Item = (Section, usize)> + '_ {
        self.pattern.iter().scan(0, |at, &section| {
            *at += section.order();
            Some((section, *at - section.order()))
        })
    }

    /// Poles in closed form, by falling rate: as eigenvalues of `A` a repeated one would split.
    pub(super) fn poles(&self) -> Vec<Complex<f64>> {
        let mut poles = Vec::with_capacity(self.order());
        for (section, at) in self.places() {
            let w = self.q[at].exp();
            match section {
                Section::Lag => poles.push(Complex::new(-w, 0.0)),
                Section::Pair => poles.extend(pair_of(w, self.q[at + 1].exp())),
            }
        }
        poles.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
        poles
    }

    /// `A` with its slopes along `q`: entries of a section grow with its `w`, its damping with `zeta`.
    pub(super) fn matrix(&self) -> Sloped {
        let k = self.order();
        let mut A = Sloped::zeros(k, k);
        for (section, i) in self.places() {
            let w = self.q[i].exp();
            let mut entries = match section {
                Section::Lag => vec![(i, i, -w)],
                Section::Pair => {
                    let damping = -2.0 * self.q[i + 1].exp() * w;
                    A.slope(i + 1)[(i + 1) * k + i + 1] = damping;
                    vec![(i, i + 1, w), (i + 1, i, -w), (i + 1, i + 1, damping)]
                }
            };
            if i > 0 {
                entries.push((i - 1, i, w));
            }
            for (row, column, value) in entries {
                A.value()[row * k + column] = value;
                A.slope(i)[row * k + column] = value;
            }
        }
        A
    }
}

/// The two roots of `s^2 + 2 zeta w s + w^2`; the second by the product, so that no digits are lost.
fn pair_of(w: f64, zeta: f64) -> [Complex<f64>; 2] {
    if zeta >= 1.0 {
        let fast = -w * (zeta + (zeta * zeta - 1.0).sqrt());
        return [Complex::new(fast, 0.0), Complex::new(w * w / fast, 0.0)];
    }
    let (re, im) = (-w * zeta, w * (1.0 - zeta * zeta).sqrt());
    [Complex::new(re, -im), Complex::new(re, im)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poles_come_back_from_their_sections() {
        let real = |x: f64| Complex::new(x, 0.0);
        for poles in [
            vec![real(-0.8)],
            vec![real(-0.8), real(-0.3), real(-0.2)],
            vec![real(-2.0), Complex::new(-0.5, -3.0), Complex::new(-0.5, 3.0), real(-0.1)],
            vec![real(-0.5); 4],
        ] {
            let back = Sections::of(&poles).poles();
            assert!(back.iter().zip(&poles).all(|(a, b)| (a - b).norm() < 1e-7), "{back:?}");
        }
        // Of three real ones the closest two are a pair.
        let sections = Sections::of(&[real(-0.8), real(-0.3), real(-0.2)]);
        assert!((sections.q[0] - 0.06f64.ln() / 2.0).abs() < 1e-12);
    }
}
