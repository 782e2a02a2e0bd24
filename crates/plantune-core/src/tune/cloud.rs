//! The models that the data leave open: draws from one fit, or from fits of several delays.
//!
//! ```text
//! theta ~ N(theta_hat, P),   of fit i with probability w_i = L_i / sum L,   ln L_i = -(N/2) ln V_i
//! ```
//!
//! With one fit the delay is a parameter like the others (P1D); polynomial models have a fit for each delay,
//! and the likelihood weighs them. `N` is that of the shortest, so that all speak of the same rows.

use crate::error::{Error, Result};
use crate::linalg::normal_draws;
use crate::model::{Model, ProcessModel, TransferFunction};

/// Seed of the draws, so that the same fits give the same models.
const SEED: u64 = 0x001;

/// A fit as far as the cloud needs it.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model.
    pub model: Model,
    /// Covariance of its parameters, and of what follows them; row-major, flat.
    pub P: Vec<f64>,
    /// Rows used.
    pub N: usize,
    /// Mean squared prediction error.
    pub loss: f64,
    /// Sample time of the record, s; absent where it counts in samples.
    pub Ts: Option<f64>,
}

impl Fitted {
    /// As if `more` times as many rows had said the same.
    pub fn with_more_data(&self, more: f64) -> Self {
        let P = self.P.iter().map(|p| p / more).collect();
        Fitted { P, N: (self.N as f64 * more) as usize, ..self.clone() }
    }
}

/// The most probable model first, then `count` draws; those that describe no plant are left out.
pub fn cloud(fits: &[Fitted], count: usize) -> Result<Vec<Model>> {
    let weights = weights(fits);
    let best = (0..fits.len()).max_by(|&i, &j| weights[i].total_cmp(&weights[j]));
    let Some(best) = best else {
        return Err(Error::argument("model", "nothing", "a model or a fit"));
    };
    let mut models = vec![fits[best].model.clone()];
    let mut said = 0.0;
    for (fit, weight) in fits.iter().zip(&weights) {
        // So that the shares add up to `count`.
        let from = (said * count as f64).round();
        said += weight;
        let own = ((said * count as f64).round() - from) as usize;
        if own > 0 {
            models.extend(draws(&fit.model, &fit.P, own)?);
        }
    }
    Ok(models)
}

/// Probability of each fit.
pub fn weights(fits: &[Fitted]) -> Vec<f64> {
    let N = fits.iter().map(|f| f.N).min().unwrap_or(0) as f64;
    let least = fits.iter().map(|f| f.loss).fold(f64::INFINITY, f64::min);
    let likelihood: Vec<f64> = fits
        .iter()
        .map(|f| if f.loss == least { 1.0 } else { (-0.5 * N * (f.loss / least).ln()).exp() })
        .collect();
    let sum: f64 = likelihood.iter().sum();
    likelihood.into_iter().map(|l| l / sum).collect()
}

/// Draws around the model's parameters, in antithetic pairs; a drawn delay below zero counts as none, and
/// draws that describe no plant are left out.
pub fn draws(model: &Model, P: &[f64], count: usize) -> Result<Vec<Model>> {
    let theta = model.theta();
    let n = theta.len();
    let size = P.len().isqrt();
    if size < n || size * size != P.len() {
        return Err(Error::argument(
            "P",
            format!("{} numbers", P.len()),
            &format!("square, at least {n} by {n}"),
        ));
    }
    let own: Vec<f64> = (0..n * n).map(|ij| P[ij / n * size + ij % n]).collect();
    let drawn = |theta: &Vec<f64>| match model.with_theta(theta) {
        Model::Process(m) => Model::Process(ProcessModel { L: m.L.max(0.0), ..m }),
        Model::Transfer(m) => Model::Transfer(TransferFunction { L: m.L.max(0.0), ..m }),
        other => other,
    };
    let models: Vec<Model> =
        normal_draws(&theta, &own, count, SEED).iter().map(drawn).filter(Model::is_sound).collect();
    if models.len() < count / 2 {
        return Err(Error::new(
            "X07",
            "more than half of the models inside the uncertainty are no plants (T <= 0)",
        )
        .count(count - models.len())
        .measured(models.len() as f64 / count as f64, 0.5)
        .remedy("record longer or with larger steps"));
    }
    Ok(models)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Fopdt;

    fn fitted(L: f64, loss: f64) -> Fitted {
        let model = Fopdt { K: 2.0, T: 5.0, L }.into();
        Fitted { model, P: vec![0.01, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.0, 0.0], N: 100, loss, Ts: None }
    }

    #[test]
    fn the_delays_come_in_the_shares_of_their_likelihood() {
        // Half the likelihood: ln 2 = (N/2) ln(V2 / V1).
        let models = cloud(&[fitted(1.0, 1.0), fitted(2.0, (2f64.ln() / 50.0).exp())], 300).expect("models");
        let late = models[1..].iter().filter(|m| matches!(m, Model::Process(p) if p.L == 2.0)).count();
        assert_eq!((models.len(), late), (301, 100));
        assert_eq!(models[0], fitted(1.0, 1.0).model);
    }
}
