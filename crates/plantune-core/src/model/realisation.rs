//! A transfer function without its delay as states, and how they move over a stretch of time.
//!
//! ```text
//! x' = A x + B v,  y = C x + D v          companion form, time in units of the plant's own
//! v a straight line from v0 to v1 over h:  x <- Phi x + begin v0 + end v1
//! [Phi Gamma1 Gamma2] = the top of exp [A h  B h  0; 0 0 I; 0 0 0],  end = Gamma2, begin = Gamma1 - Gamma2
//! ```

use super::{Fraction, PolyModel, TransferFunction};
use crate::linalg::{eigenvalues, exponential};
use crate::poly::product;

/// States of a proper transfer function, the delay left out.
#[derive(Clone, Debug)]
pub struct Realisation {
    /// Number of states.
    pub n: usize,
    A: Vec<f64>, // (n, n) row-major, per unit of time
    /// Output of each state.
    pub C: Vec<f64>,
    /// Direct share of the input.
    pub D: f64,
    /// Unit of time, s.
    unit: f64,
}

/// How the states move over a stretch on which the input is a straight line.
#[derive(Clone, Debug)]
pub struct Transition {
    /// `(n, n)` row-major.
    pub Phi: Vec<f64>,
    /// Weight of the input at the beginning.
    pub begin: Vec<f64>,
    /// Weight of the input at the end.
    pub end: Vec<f64>,
}

impl Transition {
    /// Weight of an input that stands still.
    pub fn held(&self) -> Vec<f64> {
        self.begin.iter().zip(&self.end).map(|(b, e)| b + e).collect()
    }

    /// `Phi x`.
    pub fn moved(&self, x: &[f64]) -> Vec<f64> {
        let n = x.len();
        (0..n).map(|i| (0..n).map(|j| self.Phi[i * n + j] * x[j]).sum()).collect()
    }
}

impl Realisation {
    /// In companion form, time measured so that the coefficients are of one size.
    pub fn of(G: &TransferFunction) -> Self {
        let first = G.den.iter().position(|&a| a != 0.0).unwrap_or(0);
        let den = &G.den[first..];
        let n = den.len() - 1;
        let unit = den
            .iter()
            .enumerate()
            .skip(1)
            .fold(0.0f64, |fastest, (k, a)| fastest.max((a / den[0]).abs().powf(1.0 / k as f64)));
        let unit = if unit > 0.0 { 1.0 / unit } else { 1.0 };
        let scaled = |p: &[f64]| -> Vec<f64> {
            let pad = (n + 1).saturating_sub(p.len());
            let padded = [vec![0.0; pad], p[p.len().saturating_sub(n + 1)..].to_vec()].concat();
            padded.iter().enumerate().map(|(k, c)| c / den[0] * unit.powi(k as i32)).collect()
        };
        let (a, b) = (scaled(den), scaled(&G.num));
        let D = b[0];
        let mut A = vec![0.0; n * n];
        for j in 0..n {
            A[j] = -a[j + 1];
        }
        for i in 1..n {
            A[i * n + i - 1] = 1.0;
        }
        let C = (0..n).map(|j| b[j + 1] - D * a[j + 1]).collect();
        Realisation { n, A, C, D, unit }
    }

    /// Over `h` seconds.
    pub fn over(&self, h: f64) -> Transition {
        let (n, size) = (self.n, self.n + 2);
        let tau = h / self.unit;
        let mut M = vec![0.0; size * size];
        for i in 0..n {
            for j in 0..n {
                M[i * size + j] = self.A[i * n + j] * tau;
            }
        }
        if n > 0 {
            M[n] = tau; // B = [1, 0, …]'
        }
        M[n * size + n + 1] = 1.0;
        let E = exponential(&M, size);
        let column = |j: usize| -> Vec<f64> { (0..n).map(|i| E[i * size + j]).collect() };
        let (whole, end) = (column(n), column(n + 1));
        Transition {
            Phi: (0..n * n).map(|ij| E[ij / n * size + ij % n]).collect(),
            begin: whole.iter().zip(&end).map(|(w, e)| w - e).collect(),
            end,
        }
    }

    /// `C x`.
    pub fn output(&self, x: &[f64]) -> f64 {
        self.C.iter().zip(x).map(|(c, x)| c * x).sum()
    }

    /// Output `t` seconds after a unit step from rest.
    pub fn step(&self, t: f64) -> f64 {
        self.D + self.output(&self.over(t).held())
    }

    /// `d x / d t`, 1/s, for the states `x` and the input `v`.
    pub fn slope(&self, x: &[f64], v: f64) -> f64 {
        let n = self.n;
        let rate =
            |i: usize| (0..n).map(|j| self.A[i * n + j] * x[j]).sum::<f64>() + if i == 0 { v } else { 0.0 };
        (0..n).map(|i| self.C[i] * rate(i)).sum::<f64>() / self.unit
    }

    /// States at rest under the constant input `v`; `None` with a pole at 0.
    pub fn rest(&self, v: f64) -> Option<Vec<f64>> {
        let n = self.n;
        if n == 0 {
            return Some(Vec::new());
        }
        // A x + B v = 0 in companion form: only the last state is not zero.
        let last = self.A[n - 1];
        if last == 0.0 {
            return None;
        }
        let mut x = vec![0.0; n];
        x[n - 1] = -v / last;
        Some(x)
    }
}

/// The plant behind a zero-order hold, any delay exact.
///
/// `A` has the poles `e^(p Ts)`, and `B = A g` follows from the first terms of the pulse response `g`. A
/// pulse of length `Ts` that arrives `f` late leaves the states `Gamma(Ts - f)` at the first sample, and adds
/// `Phi(Ts - f) Gamma(f)` before the second.
pub fn sampled(G: &TransferFunction, Ts: f64) -> PolyModel {
    let plant = Realisation::of(G);
    let n = plant.n;
    let Fraction { m, f } = Fraction::of(G.L, Ts);
    let (whole, late, early) = (plant.over(Ts), plant.over(Ts - f), plant.over(f));
    let A = monic(&eigenvalues(&whole.Phi, n));
    let (now, next) = if f > 0.0 { (0.0, plant.D) } else { (plant.D, 0.0) };
    let mut x = late.held();
    let mut g = vec![now, next + plant.output(&x)];
    for k in 1..=n {
        x = whole.moved(&x);
        if k == 1 {
            x.iter_mut().zip(late.moved(&early.held())).for_each(|(x, rest)| *x += rest);
        }
        g.push(plant.output(&x));
    }
    let terms = n + 1 + usize::from(f > 0.0);
    let B = &product(&A, &g)[..terms];
    let lead = B.iter().take_while(|&&b| b == 0.0).count();
    PolyModel::arx(A, vec![B[lead..].to_vec()], vec![m + lead], Ts)
}

/// `prod (1 - p q^-1)` over real poles and pairs.
pub(super) fn monic(poles: &[(f64, f64)]) -> Vec<f64> {
    poles.iter().fold(vec![1.0], |A, &(re, im)| match im {
        0.0 => product(&A, &[1.0, -re]),
        im if im > 0.0 => product(&A, &[1.0, -2.0 * re, re * re + im * im]),
        _ => A,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Fopdt, ProcessModel};

    #[test]
    fn a_first_order_is_sampled_as_by_its_own_formulas() {
        for L in [0.0, 0.013, 0.1, 0.107] {
            let plant = Fopdt { K: -5.939, T: 0.1491, L };
            let ours = sampled(&ProcessModel::from(plant).transfer(), 0.02);
            let known = plant.held(0.02);
            assert_eq!((ours.nk.clone(), ours.B[0].len()), (known.nk.clone(), known.B[0].len()), "{L}");
            let pairs = ours.A.iter().zip(&known.A).chain(ours.B[0].iter().zip(&known.B[0]));
            assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-14), "{ours:?} {known:?}");
        }
    }

    /// Sampled outputs are those of the step responses that a staircase input superposes.
    #[test]
    fn sampling_is_exact_for_any_order_and_delay() {
        let Ts = 0.3;
        let u: Vec<f64> = (0..60).map(|k| f64::from(k / 3 * 37 % 11)).collect();
        for (num, den) in [
            (vec![1.0], vec![1.0, 3.0, 3.0, 1.0]),
            (vec![-0.7, 1.0], vec![1.0, 0.2, 1.0]),
            (vec![2.0], vec![1.0, 0.0]),
            (vec![0.5, 0.1, 1.0], vec![1.0, 2.0, 3.0]),
            (vec![1.0, 0.4], vec![1e-4, 1.01, 100.0, 1.0]),
        ] {
            for L in [0.0, 0.11, 0.6, 0.75] {
                let G = TransferFunction { num: num.clone(), den: den.clone(), L };
                let y = sampled(&G, Ts).simulate(&u, 1);
                for (k, ours) in y.iter().enumerate() {
                    let jump = |j: usize| u[j] - if j > 0 { u[j - 1] } else { 0.0 };
                    let t: Vec<f64> = (0..=k).map(|j| (k - j) as f64 * Ts).collect();
                    let steps = G.step_response(&t);
                    let exact: f64 = (0..=k).map(|j| jump(j) * steps[j]).sum();
                    assert!(
                        (ours - exact).abs() < 1e-9 * (1.0 + exact.abs()),
                        "{G:?} row {k}: {ours} {exact}"
                    );
                }
            }
        }
    }
}
