//! Moving-block bootstrap of the residuals: estimates from records that could have been.
//!
//! ```text
//! y*(t) = y(t) + H(q) (e*(t) - e(t)),   H = C/(D A)
//! e*: blocks of b residuals that may start anywhere, centred, times sqrt(N/(N - n))
//! b = (sqrt(6) r/(1 - r^2))^(2/3) N^(1/3),   r their correlation at lag one
//! ```
//!
//! `H e` is what the noise added to the record, so the answer to the input, the offset and the initial states
//! stay as they were. Each record is fitted anew, from the estimate itself.
//!
//! Künsch 1989; the length of a block is the best one for the variance of a mean of a first-order autoregression
//! ([`Scores::memory`]; Carlstein 1986 has `2 r/(1 - r^2)` for blocks that do not overlap).

use super::orders::Orders;
use super::pem;
use super::scores::{Scores, estimate_arx, scores};
use crate::error::{Error, Result};
use crate::linalg::Random;
use crate::model::PolyModel;
use crate::poly::{divide, multiply, product};
use crate::record::Record;
use crate::sim::Start;

/// What may be set.
#[derive(Clone, Copy, Debug)]
pub struct BootstrapOptions {
    /// Records drawn.
    pub runs: usize,
    /// Residuals in a block; by the rule where absent.
    pub block: Option<usize>,
    /// Seed of the draws.
    pub seed: u64,
}

/// Estimates from drawn records.
#[derive(Clone, Debug)]
pub struct Bootstrap {
    /// One row per record that could be fitted: `theta`, then the offset.
    pub estimates: Vec<Vec<f64>>,
    /// Residuals in a block.
    pub block: usize,
}

/// Draws records and fits the model's orders to each; `offset` where `O` was estimated.
pub fn bootstrap(
    rec: &Record,
    model: &PolyModel,
    offset: Option<f64>,
    start: Start,
    options: &BootstrapOptions,
) -> Result<Bootstrap> {
    let own = scores(rec, model, offset, start)?;
    let orders = Orders::of(model);
    let noise = (model.C.clone(), product(&model.D, &model.A));
    drawn(rec, &own, &noise, options, |new| {
        if orders.is_arx() {
            estimate_arx(new, &orders, offset.is_some())
        } else {
            pem::refit(new, model, offset, start)
        }
    })
}

/// Draws records of a fit with these scores, whose noise goes through `C / D`, and estimates from each.
pub(super) fn drawn(
    rec: &Record,
    own: &Scores,
    noise: &(Vec<f64>, Vec<f64>),
    options: &BootstrapOptions,
    estimate: impl Fn(&Record) -> Option<Vec<f64>>,
) -> Result<Bootstrap> {
    let N = own.eps.len();
    let block = options.block.unwrap_or_else(|| own.memory());
    if !(1..=N).contains(&block) {
        return Err(Error::argument("block", block, &format!("in [1, {N}], the number of residuals")));
    }
    if options.runs < 2 {
        return Err(Error::argument("runs", options.runs, "2 or more"));
    }
    let mean = own.eps.iter().sum::<f64>() / N as f64;
    let size = (N as f64 / N.saturating_sub(own.n() + own.states).max(1) as f64).sqrt();
    let residuals: Vec<f64> = own.eps.iter().map(|e| (e - mean) * size).collect();
    let mut random = Random::new(options.seed);
    let mut estimates = Vec::with_capacity(options.runs);
    for _ in 0..options.runs {
        let drawn = blocks(&residuals, block, &mut random);
        let y = with_residuals(rec, own, noise, &drawn);
        let new = Record { y: &y, ..rec.clone() };
        estimates.extend(estimate(&new).filter(|e| e.iter().all(|x| x.is_finite())));
    }
    if estimates.len() < options.runs.div_ceil(2) {
        return Err(Error::new("N05", "most of the drawn records could not be fitted")
            .count(options.runs - estimates.len())
            .remedy("ask for lower orders"));
    }
    Ok(Bootstrap { estimates, block })
}

/// Mean squares and products of the estimates about their mean, row-major.
pub fn spread(estimates: &[Vec<f64>]) -> Vec<f64> {
    let (n, count) = (estimates[0].len(), estimates.len() as f64);
    let mean: Vec<f64> = (0..n).map(|j| estimates.iter().map(|e| e[j]).sum::<f64>() / count).collect();
    let product = |i: usize, j: usize| -> f64 {
        estimates.iter().map(|e| (e[i] - mean[i]) * (e[j] - mean[j])).sum::<f64>() / (count - 1.0)
    };
    (0..n * n).map(|ij| product(ij / n, ij % n)).collect()
}

/// As many residuals, in blocks that may start anywhere.
fn blocks(e: &[f64], length: usize, random: &mut Random) -> Vec<f64> {
    let mut drawn = Vec::with_capacity(e.len() + length);
    while drawn.len() < e.len() {
        let first = random.below(e.len() - length + 1);
        drawn.extend_from_slice(&e[first..first + length]);
    }
    drawn.truncate(e.len());
    drawn
}

/// The record's output with other residuals.
fn with_residuals(rec: &Record, own: &Scores, (C, D): &(Vec<f64>, Vec<f64>), drawn: &[f64]) -> Vec<f64> {
    let mut y = rec.y.to_vec();
    for s in rec.segments() {
        // Rows that do not count, and history, keep their residuals.
        let first = own.rows.partition_point(|&k| k < s.start);
        let end = own.rows.partition_point(|&k| k < s.end);
        let mut change = vec![0.0; s.len()];
        for k in first..end {
            change[own.rows[k] - s.start] = drawn[k] - own.eps[k];
        }
        let mut change = multiply(C, &change);
        divide(D, &mut change);
        y[s].iter_mut().zip(&change).for_each(|(y, c)| *y += c);
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::{PemOptions, arx, pem as fit_pem};
    use crate::limits::Limits;
    use crate::linalg::white;

    /// Where the residuals are white, the spread over drawn records is the covariance of the fit.
    #[test]
    fn white_residuals_give_the_covariance_of_the_fit() {
        let N = 400;
        let (u, e) = (white(N, 1), white(N, 2));
        let plant = PolyModel::arx(vec![1.0, -0.8], vec![vec![0.5]], vec![1], 1.0);
        let y: Vec<f64> = plant.simulate(&u, 1).iter().zip(&e).map(|(y, e)| 7.0 + y + 0.3 * e).collect();
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let limits = Limits::default();
        let options = PemOptions { offset: true, start: Start::Estimate };
        for orders in [Orders::arx(1, vec![1], vec![1]), Orders::oe(vec![1], vec![1], vec![1])] {
            let fit = if orders.is_arx() {
                arx(&rec, &orders, true, &limits)
            } else {
                fit_pem(&rec, &orders, options, &limits)
            }
            .expect("a fit");
            let model = &orders.model(&fit.theta, rec.Ts);
            let options = BootstrapOptions { runs: 400, block: Some(1), seed: 1 };
            let found = bootstrap(&rec, model, Some(fit.offset), Start::Estimate, &options).expect("runs");
            let P = spread(&found.estimates);
            for i in 0..3 {
                let ratio = (P[i * 4] / fit.P[i * 4]).sqrt();
                // 400 runs give a standard deviation to 3.5 %; three of them allowed.
                assert!((ratio - 1.0).abs() < 0.11, "{orders} {i}: {ratio}");
            }
        }
    }
}
