//! The score of a fitted polynomial model, row by row: `[psi | eps]`, of which the minimum makes `psi' eps = 0`.
//!
//! ```text
//! psi(t) = -d eps(t)/d(theta, O),        P = s^2 (psi' psi)^-1
//! ```
//!
//! The initial states are parameters too; what they explain of each column is taken out, so that every
//! covariance computed from `psi` holds for any initial state. The constant `d` of the predictor stands for
//! `O = y0 + (d - G u0) / A(1)`; with `g` the gradient of `O`, `psi_O = psi_d / g_d` and
//! `psi_j - psi_d g_j / g_d` is the gradient at constant `O`.
//!
//! Ljung 1999, (9.10) and (10.3).

use std::ops::Range;

use super::arx::columns;
use super::least_squares::RANK_TOLERANCE;
use super::orders::Orders;
use super::pem;
use super::poly_fit::units;
use crate::error::{Error, Result};
use crate::linalg::solve;
use crate::model::PolyModel;
use crate::record::{Record, Scale};
use crate::regress::Regression;
use crate::sim::Start;

/// The rows on which a model was fitted, in the record's units.
#[derive(Clone, Debug)]
pub struct Scores {
    /// `-d eps / d(theta, O)`; without an offset `theta` alone. Row-major.
    pub psi: Vec<f64>, // (N, n)
    /// One-step prediction errors.
    pub eps: Vec<f64>, // (N)
    /// Rows of the record.
    pub rows: Vec<usize>, // (N)
    /// Those of them that follow each other without a break.
    pub segments: Vec<Range<usize>>,
    /// Parameters beside those of `psi`: initial states.
    pub states: usize,
}

impl Scores {
    /// Number of parameters of `psi`.
    pub fn n(&self) -> usize {
        self.psi.len() / self.eps.len().max(1)
    }

    /// `psi` of row `t`.
    pub fn psi(&self, t: usize) -> &[f64] {
        &self.psi[t * self.n()..][..self.n()]
    }

    /// Rows over which residuals remember, `(sqrt(6) r/(1 - r^2))^(2/3) N^(1/3)` with `r` the correlation of neighbours,
    /// at most a quarter of them: the best length of a block, and of a sum with Bartlett's weights, where they are a
    /// first-order autoregression (Künsch 1989; Andrews 1991).
    pub fn memory(&self) -> usize {
        let e = &self.eps;
        let pairs = self.segments.iter().flat_map(|s| e[s.clone()].windows(2));
        let r = pairs.map(|p| p[0] * p[1]).sum::<f64>() / e.iter().map(|e| e * e).sum::<f64>();
        let r = if r.is_finite() { r.abs().min(0.99) } else { 0.0 };
        let best = (6f64.sqrt() * r / (1.0 - r * r)).powf(2.0 / 3.0) * (e.len() as f64).cbrt();
        (best.ceil() as usize).clamp(1, (e.len() / 4).max(1))
    }

    /// `s^2 = RSS / (N - n - states)`.
    pub fn variance(&self) -> f64 {
        let rss: f64 = self.eps.iter().map(|e| e * e).sum();
        rss / self.eps.len().saturating_sub(self.n() + self.states) as f64
    }
}

/// Scaled rows `[psi | eps]`, column by column, and the rows of the record that they are; of a range without a break.
pub(super) type Part = (Vec<Vec<f64>>, Vec<usize>);

/// What the two predictors have in common.
pub(super) struct Scaled {
    pub(super) parts: Vec<Part>,
    pub(super) states: usize,
    pub(super) u: Vec<Scale>,
    pub(super) y: Scale,
}

/// `theta`, then the offset where there is one, from a solution on scaled data.
pub(super) fn unscaled(orders: &Orders, theta: &[f64], Ts: f64, (u, y): (&[Scale], Scale)) -> Vec<f64> {
    let unit = units(orders, theta.len(), u, y);
    let mut theta: Vec<f64> = theta.iter().zip(unit).map(|(t, unit)| t * unit).collect();
    let n = orders.n();
    if theta.len() > n {
        let u0: Vec<f64> = u.iter().map(|u| u.zero).collect();
        theta[n] = orders.model(&theta[..n], Ts).level(theta[n], &u0, y.zero).0;
    }
    theta
}

/// ARX anew: `theta`, then the offset.
pub(super) fn estimate_arx(rec: &Record, orders: &Orders, offset: bool) -> Option<Vec<f64>> {
    let regression = Regression::new(rec, 0, columns(orders, offset));
    let every: Vec<usize> = (0..orders.n() + usize::from(offset)).collect();
    let solution = solve(&regression.triangle(), &every, every.len(), RANK_TOLERANCE).ok()?;
    Some(unscaled(orders, &solution.theta, rec.Ts, (&regression.u, regression.y)))
}

/// The scores of a model at the record it was fitted to; `offset` where `O` was estimated.
pub fn scores(rec: &Record, model: &PolyModel, offset: Option<f64>, start: Start) -> Result<Scores> {
    let orders = Orders::of(model);
    let scaled =
        if orders.is_arx() { arx(rec, &orders, model, offset) } else { pem::rows(rec, model, offset, start) };
    let scaled = scaled.filter(|s| s.parts.iter().any(|(_, rows)| !rows.is_empty())).ok_or_else(no_rows)?;
    Ok(scaled.in_units(&orders, model, offset))
}

fn no_rows() -> Error {
    Error::new("X03", "the model has no finite prediction error on this record")
        .remedy("give the record on which the model was fitted")
}

/// `d` of the predictor on centred data from the offset in the record's units.
fn constant(model: &PolyModel, offset: f64, u: &[Scale], y: Scale) -> f64 {
    let u0: Vec<f64> = u.iter().map(|u| u.zero).collect();
    let (without, gradient) = model.level(0.0, &u0, y.zero);
    (offset - without) / gradient[gradient.len() - 1]
}

/// Parameters of a predictor on scaled data, the constant last where there is one.
pub(super) fn scaled_theta(
    orders: &Orders,
    model: &PolyModel,
    offset: Option<f64>,
    u: &[Scale],
    y: Scale,
) -> Vec<f64> {
    let mut theta = model.theta();
    theta.extend(offset.map(|O| constant(model, O, u, y)));
    let unit = units(orders, theta.len(), u, y);
    theta.iter().zip(unit).map(|(t, unit)| t / unit).collect()
}

fn arx(rec: &Record, orders: &Orders, model: &PolyModel, offset: Option<f64>) -> Option<Scaled> {
    let regression = Regression::new(rec, 0, columns(orders, offset.is_some()));
    let (u, y) = (regression.u.clone(), regression.y);
    let theta = scaled_theta(orders, model, offset, &u, y);
    let part = |run: &Range<usize>| {
        let mut columns = regression.rows(run);
        let (eps, psi) = columns.split_last_mut()?;
        for (psi, theta) in psi.iter().zip(&theta) {
            eps.iter_mut().zip(psi).for_each(|(e, psi)| *e -= theta * psi);
        }
        Some((columns, run.clone().collect()))
    };
    let parts = regression.runs().iter().map(part).collect::<Option<Vec<Part>>>()?;
    Some(Scaled { parts, states: 0, u, y })
}

impl Scaled {
    fn in_units(self, orders: &Orders, model: &PolyModel, offset: Option<f64>) -> Scores {
        let all = orders.n() + usize::from(offset.is_some());
        let unit = units(orders, all, &self.u, self.y);
        let u0: Vec<f64> = self.u.iter().map(|u| u.zero).collect();
        let gradient = offset.map(|O| {
            let d = constant(model, O, &self.u, self.y);
            model.level(d, &u0, self.y.zero).1
        });
        let mut scores =
            Scores { psi: vec![], eps: vec![], rows: vec![], segments: vec![], states: self.states };
        for (columns, rows) in self.parts {
            (0..rows.len()).for_each(|k| {
                let first = scores.psi.len();
                scores.psi.extend((0..all).map(|j| columns[j][k] / (self.y.factor * unit[j])));
                if let Some(gradient) = &gradient {
                    at_constant_offset(&mut scores.psi[first..], gradient);
                }
                scores.eps.push(columns[all][k] / self.y.factor);
            });
            for run in rows.chunk_by(|a, b| a + 1 == *b) {
                let start = scores.rows.len();
                scores.rows.extend(run);
                scores.segments.push(start..scores.rows.len());
            }
        }
        scores
    }
}

/// From `theta, d` to `theta, O`.
fn at_constant_offset(psi: &mut [f64], gradient: &[f64]) {
    let n = psi.len() - 1;
    let of_offset = psi[n] / gradient[n];
    psi[..n].iter_mut().zip(gradient).for_each(|(psi, g)| *psi -= of_offset * g);
    psi[n] = of_offset;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::{PemOptions, arx as fit_arx, pem as fit_pem};
    use crate::limits::Limits;
    use crate::linalg::{Triangle, dot, white};

    /// `P` of the fit is `s^2 (psi' psi)^-1`, and the scores sum to zero: for ARX, OE, ARMAX and Box-Jenkins, with levels
    /// far from zero, two stretches and a hole.
    #[test]
    fn the_covariance_of_a_fit_follows_from_its_scores() {
        let (N, Ts) = (600, 0.5);
        let e = white(N, 2);
        let mut hold = 0.0;
        let steps = white(N, 1);
        let u: Vec<f64> = (0..N)
            .map(|k| {
                if k % 4 == 0 {
                    hold = 40.0 + 3.0 * steps[k];
                }
                hold
            })
            .collect();
        let plant = PolyModel::arx(vec![1.0, -0.8], vec![vec![0.5]], vec![2], Ts);
        let mut noise = e.clone();
        crate::poly::divide(&[1.0, -0.5], &mut noise);
        let y: Vec<f64> =
            plant.simulate(&u, 1).iter().zip(&noise).map(|(y, e)| 500.0 + y + 0.3 * e).collect();
        let mut valid = vec![true; N];
        valid[150] = false;
        let mut rec = Record::uniform(&u, 1, &y, 1, Ts).expect("fine");
        rec.starts = vec![0, 290];
        rec.valid = Some(&valid);
        let limits = Limits::default();
        for (orders, offset) in [
            (Orders::arx(2, vec![2], vec![2]), true),
            (Orders::arx(1, vec![1], vec![2]), false),
            (Orders::oe(vec![1], vec![1], vec![2]), true),
            (Orders::armax(1, vec![1], 1, vec![2]), true),
            (Orders { nd: 1, ..Orders::oe(vec![1], vec![1], vec![2]) }, true),
            (Orders { nc: 1, nd: 1, ..Orders::oe(vec![1], vec![1], vec![2]) }, true),
        ] {
            let options = PemOptions { offset, start: Start::Estimate };
            let fit = if orders.is_arx() {
                fit_arx(&rec, &orders, offset, &limits)
            } else {
                fit_pem(&rec, &orders, options, &limits)
            }
            .expect("a fit");
            let model = &orders.model(&fit.theta, rec.Ts);
            let scores = scores(&rec, model, offset.then_some(fit.offset), Start::Estimate).expect("rows");
            let (n, N) = (scores.n(), scores.eps.len());
            assert_eq!((N, scores.rows.len(), scores.segments.len()), (fit.N, fit.N, 3), "{orders}");
            assert!((dot(&scores.eps, &scores.eps) / N as f64 / fit.loss - 1.0).abs() < 1e-8, "{orders}");
            for j in 0..n {
                let column: Vec<f64> = (0..N).map(|t| scores.psi(t)[j]).collect();
                let cosine = dot(&column, &scores.eps)
                    / (dot(&column, &column) * dot(&scores.eps, &scores.eps)).sqrt();
                assert!(cosine.abs() < 5e-6, "{orders} {j}: {cosine}");
            }
            let padded: Vec<Vec<f64>> = (0..N).map(|t| [scores.psi(t), &[0.0]].concat()).collect();
            let padded = Triangle::of_rows(n + 1, padded.iter().map(Vec::as_slice));
            let every: Vec<usize> = (0..n).collect();
            let solution = solve(&padded, &every, n, 1e-12).expect("full rank");
            for (ij, P) in fit.P.iter().enumerate() {
                let ours = scores.variance() * solution.inverse_gram[ij];
                let size = (fit.P[ij / n * (n + 1)] * fit.P[ij % n * (n + 1)]).sqrt();
                assert!((ours - P).abs() < 1e-6 * size, "{orders} {ij}: {ours} {P}");
            }
        }
    }
}
