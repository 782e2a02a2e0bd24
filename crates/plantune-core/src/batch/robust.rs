//! Huber's estimate of any polynomial structure: a large error counts by its size, a spike not at all.
//!
//! ```text
//! min sum rho(eps / s):   w = min(1, c s / |eps|),   c = 1.345,   s = 1.4826 median |eps|
//!
//! P = kappa^2 s^2 mean psi^2 / (mean psi')^2 (J'J)^-1,   psi(x) = max(-c, min(c, x)),   x = eps / s
//! kappa = 1 + (n/N) (1 - mean psi') / mean psi'
//! ```
//!
//! Each round is the estimator itself on weighted rows. A row beyond `5 s` is no measurement: the first of each
//! run of such errors is marked as missing, since the ones behind it may be its echo in the regressor, and
//! the rounds begin again. Weights alone leave ARX 3 to 5 % off with five spikes of 20 standard deviations,
//! for a spike is a regressor too.
//!
//! Huber 1981, 6.5, 7.6 and 7.8.

use super::fit::Fit;
use super::huber::{C, weight};
use super::scores::{Scores, scores};
use crate::error::Result;
use crate::model::Model;
use crate::note::Note;
use crate::record::Record;
use crate::sim::Start;
use crate::stats::median;

/// Errors beyond are no measurements.
const SPIKE: f64 = 5.0;

/// Share of its standard deviation that no parameter moves any more in a round.
const SETTLED: f64 = 1e-3;

const MOST_ROUNDS: usize = 50;

/// Rounds of marking.
const MOST_MARKINGS: usize = 10;

/// The estimate of a record with one output in which some rows are wrong; `estimate` honours weights.
pub fn robust(
    rec: &Record,
    offset: bool,
    start: Start,
    estimate: impl Fn(&Record) -> Result<Fit>,
) -> Result<Fit> {
    reweighted_fit(rec, |rec| {
        let fit = estimate(rec)?;
        let Model::Poly(model) = &fit.model else { unreachable!("only polynomial models are estimated so") };
        let scores = scores(rec, model, offset.then_some(fit.offset), start)?;
        Ok((fit, scores))
    })
}

/// The same of an estimator that gives its scores as well.
pub(super) fn reweighted_fit(
    rec: &Record,
    estimate: impl Fn(&Record) -> Result<(Fit, Scores)>,
) -> Result<Fit> {
    let mut valid: Vec<bool> = (0..rec.N()).map(|k| rec.is_valid(k, 0)).collect();
    let before = count(&valid);
    let mut markings = 0;
    loop {
        let own = Record { valid: Some(&valid), ..rec.clone() };
        let reweighted = reweighted(&own, &estimate)?;
        let spikes = reweighted.spikes();
        if spikes.is_empty() || markings == MOST_MARKINGS {
            let note = note(rec, &valid, before - count(&valid), &reweighted);
            let mut fit = reweighted.fit();
            fit.notes.extend(note);
            return Ok(fit);
        }
        markings += 1;
        spikes.into_iter().for_each(|k| valid[k] = false);
    }
}

/// Where the weights have settled.
struct Reweighted {
    fit: Fit,
    scores: Scores,
    /// Standard deviation of the errors that are none of a spike; 0 where half of them are equal.
    s: f64,
}

fn reweighted(rec: &Record, estimate: impl Fn(&Record) -> Result<(Fit, Scores)>) -> Result<Reweighted> {
    let mut weights = vec![1.0; rec.N()];
    let mut last: Option<Vec<f64>> = None;
    let mut rounds = 0;
    loop {
        let own = Record { weights: Some(&weights), ..rec.clone() };
        let (fit, scores) = estimate(&own)?;
        let s = 1.4826 * median(scores.eps.iter().map(|e| e.abs()).collect());
        let settled = last.as_ref().is_some_and(|theta| has_settled(theta, &fit));
        rounds += 1;
        if settled || s <= 0.0 || rounds == MOST_ROUNDS {
            return Ok(Reweighted { fit, scores, s });
        }
        last = Some(fit.theta);
        weights.fill(1.0);
        for (&row, eps) in scores.rows.iter().zip(&scores.eps) {
            weights[row] = weight(*eps, s).sqrt();
        }
    }
}

fn has_settled(theta: &[f64], fit: &Fit) -> bool {
    let width = fit.P.len().isqrt();
    let moved = theta.iter().zip(&fit.theta).map(|(last, now)| (last - now).abs());
    moved.enumerate().all(|(i, moved)| moved <= SETTLED * fit.P[i * width + i].sqrt())
}

impl Reweighted {
    /// The first row of each run of errors beyond [`SPIKE`].
    fn spikes(&self) -> Vec<usize> {
        let large = |t: usize| self.scores.eps[t].abs() > SPIKE * self.s;
        let of_segment = |rows: &std::ops::Range<usize>| {
            let first = rows.start;
            rows.clone().filter(move |&t| large(t) && (t == first || !large(t - 1))).collect::<Vec<usize>>()
        };
        if self.s <= 0.0 {
            return Vec::new();
        }
        self.scores.segments.iter().flat_map(of_segment).map(|t| self.scores.rows[t]).collect()
    }

    /// The fit with the covariance of a Huber estimate: that of the weighted rows times
    /// `mean w  sum (w eps)^2 / (sum w eps^2  mean psi'^2)  kappa^2`.
    fn fit(self) -> Fit {
        let (eps, s) = (&self.scores.eps, self.s);
        let N = eps.len() as f64;
        let inside = eps.iter().filter(|e| e.abs() <= C * s).count() as f64 / N;
        let weighted = |power: i32| -> f64 { eps.iter().map(|e| weight(*e, s).powi(power) * e * e).sum() };
        if s <= 0.0 || inside == 1.0 || !(weighted(1) > 0.0) {
            return self.fit;
        }
        let mean: f64 = eps.iter().map(|e| weight(*e, s)).sum::<f64>() / N;
        let kappa = 1.0 + self.scores.n() as f64 / N * (1.0 - inside) / inside;
        let factor = kappa / inside * (mean * weighted(2) / weighted(1)).sqrt();
        self.fit.widened(factor)
    }
}

fn count(valid: &[bool]) -> usize {
    valid.iter().filter(|&&v| v).count()
}

/// D19: which rows are left out, and how many count less.
fn note(rec: &Record, valid: &[bool], spikes: usize, end: &Reweighted) -> Option<Note> {
    let less = end.scores.eps.iter().filter(|e| e.abs() > C * end.s).count();
    let note = match (0..rec.N()).find(|&k| rec.is_valid(k, 0) && !valid[k]) {
        Some(first) => Note::info(
            "D19",
            format!(
                "robust: {spikes} rows beyond {SPIKE} standard deviations are left out, {less} count less"
            ),
        )
        .at(rec.place(rec.nu, first)),
        None if less > 0 => Note::info("D19", format!("robust: {less} rows count less, none is left out")),
        None => return None,
    };
    Some(note.count(spikes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::{Orders, PemOptions, arx, pem};
    use crate::limits::Limits;
    use crate::linalg::white;
    use crate::model::PolyModel;

    fn record(spikes: usize) -> (Vec<f64>, Vec<f64>) {
        let (N, e) = (500, white(500, 3));
        let u: Vec<f64> = white(N / 5, 1).iter().flat_map(|u| [u.signum(); 5]).collect();
        let plant = PolyModel::arx(vec![1.0, -0.8], vec![vec![0.5]], vec![1], 1.0);
        let mut y: Vec<f64> = plant.simulate(&u, 1).iter().zip(&e).map(|(y, e)| 4.0 + y + 0.1 * e).collect();
        (0..spikes).for_each(|i| y[47 + 97 * i] += if i % 2 == 0 { 2.0 } else { -2.0 });
        (u, y)
    }

    /// Within a fifth of a standard deviation of the estimate from the record without spikes.
    #[test]
    fn five_spikes_leave_the_estimate_where_it_is() {
        let limits = Limits::default();
        let options = PemOptions { offset: true, start: Start::Estimate };
        let of = |spikes: usize, orders: &Orders| {
            let (u, y) = record(spikes);
            let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
            let estimate = |rec: &Record| {
                if orders.na > 0 {
                    arx(rec, orders, true, &limits)
                } else {
                    pem(rec, orders, options, &limits)
                }
            };
            robust(&rec, true, Start::Estimate, estimate).expect("a fit")
        };
        for orders in [Orders::arx(1, vec![1], vec![1]), Orders::oe(vec![1], vec![1], vec![1])] {
            let (clean, spiked) = (of(0, &orders), of(5, &orders));
            for i in 0..2 {
                let sd = clean.P[i * 3 + i].sqrt();
                let moved = (clean.theta[i] - spiked.theta[i]).abs();
                assert!(moved < 0.4 * sd, "{orders} {i}: {moved} {sd}");
                assert!((spiked.P[i * 3 + i].sqrt() / sd - 1.0).abs() < 0.1, "{orders} {i}");
            }
            assert_eq!(spiked.notes.iter().filter(|n| n.code == "D19").count(), 1);
        }
    }
}
