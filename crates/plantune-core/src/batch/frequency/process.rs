//! Process models over frequency: `c0 H0(w; x) + c1 H1(w; x)`, `H0` the unit plant, `H1` the same times s.
//!
//! ```text
//! x = [c0 (c1) | ln T … (ln zeta) (L)],   K = c0,  Tz = c1/c0
//! ```
//!
//! Both are exact at the frequencies of the data, behind the hold where these are sampled. They are linear in the
//! first parameters; by the others they are differenced, over steps that leave ten digits of the slope. Starts come
//! from a grid of times and delays, where the delay turns the phase and the gains follow by least squares.

use super::{Family, Points};
use crate::batch::process::Code;
use crate::linalg::Complex;
use crate::linalg::{Triangle, solve_damped};
use crate::model::{Model, ProcessModel, TransferFunction, seen};

/// Steps of differences, of logarithms and of the dead time over the time of the centre.
const STEP: f64 = 1e-5;

/// Times of the grid, and starts taken from it.
const TIMES: usize = 14;
const STARTS: usize = 5;

/// Ratios of a further lag to the first, and dampings, on the grid.
const RATIOS: [f64; 3] = [0.1, 0.4, 0.95];
const DAMPINGS: [f64; 3] = [0.1, 0.4, 0.9];

/// A process model of a code over some points.
pub struct Process {
    pub code: Code,
    pub points: Points,
}

impl Process {
    /// Numerators `1` and, with a zero, `s`, over the poles at the nonlinear coordinates.
    fn parts(&self, x: &[f64]) -> Option<Vec<Vec<Complex<f64>>>> {
        let plant = self.plant(1.0, x, 0.0);
        if !(plant.T.iter().chain(&plant.zeta).all(|v| v.is_finite() && *v > 0.0) && plant.L.is_finite()) {
            return None;
        }
        let base = plant.transfer();
        let numerators = [vec![1.0], vec![1.0, 0.0]];
        let part = |num: &Vec<f64>| {
            let G = TransferFunction { num: num.clone(), ..base.clone() };
            seen(&G.into(), 0, self.points.Ts, &self.points.w)
        };
        let parts: Vec<Vec<Complex<f64>>> = numerators[..self.code.linear()].iter().map(part).collect();
        parts.iter().flatten().all(|g| g.re.is_finite() && g.im.is_finite()).then_some(parts)
    }

    fn plant(&self, K: f64, x: &[f64], Tz: f64) -> ProcessModel {
        let n = self.code.times();
        let zeta = self.code.pair.then(|| x[n].exp());
        ProcessModel {
            K,
            T: x[..n].iter().map(|ln| ln.exp()).collect(),
            L: if self.code.delay { x[x.len() - 1] } else { 0.0 },
            Tz,
            zeta,
            integrating: self.code.integrating,
        }
    }

    fn sum(&self, c: &[f64], x: &[f64]) -> Option<Vec<Complex<f64>>> {
        let parts = self.parts(x)?;
        Some(
            (0..self.points.w.len())
                .map(|k| c.iter().zip(&parts).map(|(c, part)| part[k] * *c).sum())
                .collect(),
        )
    }

    /// Gains of the parts and the cost that they leave.
    fn gains(&self, parts: &[Vec<Complex<f64>>]) -> (Vec<f64>, f64) {
        let (p, m) = (&self.points, parts.len());
        let mut rows = Vec::with_capacity(2 * p.w.len());
        for k in 0..p.w.len() {
            let row = |of: fn(&Complex<f64>) -> f64| -> Vec<f64> {
                parts.iter().map(|part| of(&part[k])).chain([of(&p.G[k])]).map(|x| x * p.weight[k]).collect()
            };
            rows.push(row(|z| z.re));
            rows.push(row(|z| z.im));
        }
        let triangle = Triangle::of_rows(m + 1, rows.iter().map(Vec::as_slice));
        let c = solve_damped(&triangle, &(0..m).collect::<Vec<_>>(), m, 0.0);
        let fitted: Vec<Complex<f64>> =
            (0..p.w.len()).map(|k| c.iter().zip(parts).map(|(c, part)| part[k] * *c).sum()).collect();
        let cost = p.cost(&fitted);
        (c, cost)
    }

    /// Nonlinear coordinates without the delay.
    fn shapes(&self) -> Vec<Vec<f64>> {
        let w = &self.points.w;
        let lowest = w.iter().copied().find(|w| *w > 0.0).unwrap_or(1.0);
        let (low, high) = ((0.2 / w[w.len() - 1]).ln(), (5.0 / lowest).ln());
        let first = (0..TIMES).map(|k| low + (high - low) * k as f64 / (TIMES - 1) as f64);
        let (times, pair) = (self.code.times(), self.code.pair);
        if times == 0 {
            return vec![Vec::new()];
        }
        let mut shapes = Vec::new();
        for ln_T in first {
            let ratios: &[f64] = if times > 1 { &RATIOS } else { &[1.0] };
            let dampings: &[f64] = if pair { &DAMPINGS } else { &[1.0] };
            for ratio in ratios {
                for zeta in dampings {
                    let own = (0..times).map(|k| ln_T + ratio.ln() * k as f64);
                    shapes.push(own.chain(pair.then(|| zeta.ln())).collect());
                }
            }
        }
        shapes
    }
}

impl Family for Process {
    fn response(&self, x: &[f64]) -> Option<(Vec<Complex<f64>>, Vec<Vec<Complex<f64>>>)> {
        let (c, rest) = x.split_at(self.code.linear());
        let mut columns = self.parts(rest)?;
        let G = self.sum(c, rest)?;
        for j in 0..rest.len() {
            let is_delay = self.code.delay && j + 1 == rest.len();
            let h = if is_delay { STEP / self.points.centre() } else { STEP };
            // A delay has nothing below zero: there the difference is one-sided.
            let back = if is_delay { h.min(rest[j]) } else { h };
            let at = |d: f64| {
                let mut moved = rest.to_vec();
                moved[j] += d;
                self.sum(c, &moved)
            };
            let (after, before) = (at(h)?, at(-back)?);
            columns.push(after.iter().zip(&before).map(|(a, b)| (a - b) / (h + back)).collect());
        }
        Some((G, columns))
    }

    fn project(&self, x: &mut [f64]) {
        let n = x.len();
        if self.code.delay {
            x[n - 1] = x[n - 1].max(0.0);
        }
        for ln in &mut x[self.code.linear()..n - usize::from(self.code.delay)] {
            *ln = ln.clamp(-60.0, 60.0);
        }
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let delays = if self.code.delay { self.points.delays() } else { vec![0.0] };
        let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
        for shape in self.shapes() {
            let still = [shape.clone(), if self.code.delay { vec![0.0] } else { vec![] }].concat();
            let Some(parts) = self.parts(&still) else { continue };
            for &L in &delays {
                let turn = |(part, w): (&Complex<f64>, &f64)| part * Complex::from_polar(1.0, -w * L);
                let turned: Vec<Vec<Complex<f64>>> =
                    parts.iter().map(|part| part.iter().zip(&self.points.w).map(turn).collect()).collect();
                let (c, cost) = self.gains(&turned);
                let own = [c, shape.clone(), if self.code.delay { vec![L] } else { vec![] }].concat();
                found.push((cost, own));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().take(STARTS).map(|(_, x)| x).collect()
    }

    fn named(&self, x: &[f64]) -> (Model, Vec<(String, f64)>, Vec<Vec<f64>>) {
        let (c, rest) = x.split_at(self.code.linear());
        let plant = self.plant(c[0], rest, if self.code.zero { c[1] / c[0] } else { 0.0 });
        let n = x.len();
        let unit =
            |j: usize, slope: f64| (0..n).map(|k| if k == j { slope } else { 0.0 }).collect::<Vec<f64>>();
        let (first, times) = (self.code.linear(), self.code.times());
        let mut J = vec![unit(0, 1.0)];
        J.extend((0..times).map(|k| unit(first + k, plant.T[k])));
        J.push(unit(n - 1, if self.code.delay { 1.0 } else { 0.0 }));
        if self.code.zero {
            let mut row = unit(0, -plant.Tz / c[0]);
            row[1] = 1.0 / c[0];
            J.push(row);
        }
        if let Some(zeta) = plant.zeta {
            J.push(unit(first + times, zeta));
        }
        let named = self.code.names().into_iter().zip(self.code.theta(&plant)).collect();
        (Model::Process(plant), named, J)
    }

    fn points(&self) -> &Points {
        &self.points
    }
}
