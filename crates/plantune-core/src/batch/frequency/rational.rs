//! Ratios of polynomials over frequency: `G = p^nk B(p)/A(p) e^(-j w L)`, `A = 1 + a1 p + …`, `B = b0 + b1 p + …`.
//!
//! ```text
//! sampled     p = e^(-j w Ts): B(q)/F(q) q^-nk
//! continuous  p = j w/w0, w0 the geometric mean of the frequencies, so that coefficients are of one size
//! start       min sum |W (A G e^(j w L) - B)/A_before|^2, repeated               Sanathanan and Koerner 1963
//! ```

use super::{Family, Points};
use crate::linalg::{Complex, Triangle, solve_damped};
use crate::model::{Model, PolyModel, TransferFunction};

/// Rounds of the start, and starts kept.
const ROUNDS: usize = 12;
const STARTS: usize = 4;

/// A ratio of polynomials over some points; parameters `a1 … a_nf, b0 … , L`.
pub struct Rational {
    nb: usize,
    nf: usize,
    nk: usize,
    delay: bool,
    p: Vec<Complex<f64>>,
    /// Unit of frequency of continuous data, rad/s.
    w0: f64,
    points: Points,
}

impl Rational {
    pub fn new(nb: usize, nf: usize, nk: usize, delay: bool, points: Points) -> Self {
        let positive: Vec<f64> = points.w.iter().copied().filter(|w| *w > 0.0).collect();
        let w0 = (positive.iter().map(|w| w.ln()).sum::<f64>() / positive.len().max(1) as f64).exp();
        let p = points.w.iter().map(|w| match points.Ts {
            Some(Ts) => Complex::from_polar(1.0, -w * Ts),
            None => Complex::new(0.0, w / w0),
        });
        Rational { p: p.collect(), nb, nf, nk, delay, w0, points }
    }

    /// Delay of point `k`: whole samples and dead time.
    fn turn(&self, k: usize, L: f64) -> Complex<f64> {
        self.p[k].powu(self.nk as u32) * Complex::from_polar(1.0, -self.points.w[k] * L)
    }

    fn A(&self, k: usize, a: &[f64]) -> Complex<f64> {
        a.iter().rev().fold(Complex::new(0.0, 0.0), |sum, a| (sum + *a) * self.p[k]) + 1.0
    }

    fn B(&self, k: usize, b: &[f64]) -> Complex<f64> {
        b.iter().rev().fold(Complex::new(0.0, 0.0), |sum, b| sum * self.p[k] + *b)
    }

    fn at(&self, x: &[f64]) -> Vec<Complex<f64>> {
        let (a, b) = x.split_at(self.nf);
        let L = if self.delay { x[x.len() - 1] } else { 0.0 };
        (0..self.p.len()).map(|k| self.turn(k, L) * self.B(k, &b[..self.nb]) / self.A(k, a)).collect()
    }

    /// Rounds of linear least squares at a dead time; the best of them with its cost.
    fn linearised(&self, L: f64) -> Option<(f64, Vec<f64>)> {
        let (n, own) = (self.nf + self.nb, self.points.w.len());
        let mut best: Option<(f64, Vec<f64>)> = None;
        let mut before = vec![1.0; own];
        for _ in 0..ROUNDS {
            let mut rows = Vec::with_capacity(2 * own);
            for k in 0..own {
                let weight = self.points.weight[k] / before[k];
                let G = self.points.G[k] * self.turn(k, L).conj();
                let mut row: Vec<Complex<f64>> =
                    (1..=self.nf).map(|i| -G * self.p[k].powu(i as u32)).collect();
                row.extend((0..self.nb).map(|i| self.p[k].powu(i as u32)));
                row.push(G);
                rows.push(row.iter().map(|z| z.re * weight).collect::<Vec<f64>>());
                rows.push(row.iter().map(|z| z.im * weight).collect());
            }
            let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
            let mut x = solve_damped(&triangle, &(0..n).collect::<Vec<_>>(), n, 0.0);
            before = (0..own).map(|k| self.A(k, &x[..self.nf]).norm()).collect();
            x.extend(self.delay.then_some(L));
            let cost = self.points.cost(&self.at(&x));
            if before.iter().any(|A| !(*A > 0.0)) || !cost.is_finite() {
                break;
            }
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, x));
            }
        }
        best
    }
}

impl Family for Rational {
    fn response(&self, x: &[f64]) -> Option<(Vec<Complex<f64>>, Vec<Vec<Complex<f64>>>)> {
        let G = self.at(x);
        if G.iter().any(|g| !(g.re.is_finite() && g.im.is_finite())) {
            return None;
        }
        let L = if self.delay { x[x.len() - 1] } else { 0.0 };
        let over = |k: usize| self.A(k, &x[..self.nf]).inv();
        let own = 0..self.p.len();
        let mut columns: Vec<Vec<Complex<f64>>> = (1..=self.nf)
            .map(|i| own.clone().map(|k| -G[k] * self.p[k].powu(i as u32) * over(k)).collect())
            .collect();
        columns.extend((0..self.nb).map(|i| {
            own.clone().map(|k| self.turn(k, L) * self.p[k].powu(i as u32) * over(k)).collect::<Vec<_>>()
        }));
        if self.delay {
            columns.push(own.map(|k| G[k] * Complex::new(0.0, -self.points.w[k])).collect());
        }
        Some((G, columns))
    }

    fn project(&self, x: &mut [f64]) {
        if self.delay {
            let last = x.len() - 1;
            x[last] = x[last].max(0.0);
        }
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let delays = if self.delay { self.points.delays() } else { vec![0.0] };
        let mut found: Vec<(f64, Vec<f64>)> = delays.into_iter().filter_map(|L| self.linearised(L)).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().take(STARTS).map(|(_, x)| x).collect()
    }

    fn named(&self, x: &[f64]) -> (Model, Vec<(String, f64)>, Vec<Vec<f64>>) {
        let (a, b) = (&x[..self.nf], &x[self.nf..self.nf + self.nb]);
        let n = x.len();
        let row =
            |j: usize, slope: f64| (0..n).map(|k| if k == j { slope } else { 0.0 }).collect::<Vec<f64>>();
        if let Some(Ts) = self.points.Ts {
            let F = [&[1.0], a].concat();
            let B = b.to_vec();
            let model = PolyModel {
                A: vec![1.0],
                B: vec![B],
                C: vec![1.0],
                D: vec![1.0],
                F: vec![F],
                nk: vec![self.nk],
                Ts,
            };
            let names = (1..=self.nb).map(|k| format!("b{k}")).chain((1..=self.nf).map(|k| format!("f{k}")));
            let order: Vec<usize> = (self.nf..n).chain(0..self.nf).collect();
            let named = names.zip(order.iter().map(|&j| x[j])).collect();
            return (Model::Poly(model), named, order.into_iter().map(|j| row(j, 1.0)).collect());
        }
        let unit = |power: usize| self.w0.powi(-(power as i32));
        let powers: Vec<usize> = (1..=self.nf).chain(0..self.nb).collect();
        let mut named: Vec<(String, f64)> = (1..=self.nf)
            .map(|k| format!("a{k}"))
            .chain((0..self.nb).map(|k| format!("b{k}")))
            .zip(powers.iter().zip(x).map(|(power, x)| x * unit(*power)))
            .collect();
        let mut J: Vec<Vec<f64>> = powers.iter().enumerate().map(|(j, power)| row(j, unit(*power))).collect();
        let L = if self.delay { x[n - 1] } else { 0.0 };
        named.push(("L".to_owned(), L));
        J.push(row(n - 1, if self.delay { 1.0 } else { 0.0 }));
        let descending = |c: &[(String, f64)]| c.iter().rev().map(|(_, v)| *v).collect::<Vec<f64>>();
        let den = [descending(&named[..self.nf]), vec![1.0]].concat();
        let num = descending(&named[self.nf..self.nf + self.nb]);
        (Model::Transfer(TransferFunction { num, den, L }), named, J)
    }

    fn points(&self) -> &Points {
        &self.points
    }
}
