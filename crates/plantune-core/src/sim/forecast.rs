//! What comes after the last row of a record, given the input that is to come.
//!
//! ```text
//! y(t+k) = yhat(t+k | t) + sum_{j<k} h_j e(t+k-j),     var_k = s^2 sum_{j<k} h_j^2 + g_k' P g_k
//! ```
//!
//! `H = sum h_j q^-j` is the noise model. The best forecast has the errors to come at zero. Prediction errors are affine in
//! the output, so those of any stand-in for it, taken through `H`, say how far off the stand-in is:
//! `yhat = y0 - H e0`. `g_k` is the gradient of the forecast with respect to the parameters and the offset, by central
//! differences; `P` their covariance.
//!
//! Ljung 1999, (3.31) and (3.79); Box, Jenkins and Reinsel 1994, (5.2.4) and (A5.2).

use super::over_record::{Start, over_record};
use crate::error::{Error, Result};
use crate::model::Model;
use crate::poly::multiply;
use crate::record::Record;

/// Step of the central differences, in standard deviations: small against what is known, large against rounding.
const STEP: f64 = 1e-3;

/// A fit as far as forecasts need it.
#[derive(Clone, Debug)]
pub struct Forecaster<'f> {
    /// Model.
    pub model: &'f Model,
    /// `O` in `y = G u + O`.
    pub offset: f64,
    /// Covariance of the parameters, then of the offset if it has one; empty leaves their part out.
    pub P: &'f [f64],
    /// Variance of the one-step error.
    pub variance: f64,
}

/// The output to come and its standard deviation, one for each row of the input to come.
#[derive(Clone, Debug)]
pub struct Forecast {
    /// Expected output.
    pub y: Vec<f64>,
    /// Its standard deviation.
    pub sd: Vec<f64>,
}

impl Forecaster<'_> {
    /// Variance of the one-step error of a fit with so many parameters.
    pub fn variance(loss: f64, N: usize, parameters: usize) -> f64 {
        loss * N as f64 / N.saturating_sub(parameters).max(1) as f64
    }

    /// Goes on from the last segment of `rec` under the input `u (K, nu)`.
    pub fn forecast(&self, rec: &Record, u: &[f64]) -> Result<Forecast> {
        if u.is_empty() || !u.len().is_multiple_of(rec.nu) || u.iter().any(|x| !x.is_finite()) {
            let needed = format!("finite, one row for each step ahead and {} columns", rec.nu);
            return Err(Error::argument("u_future", format!("of {} numbers", u.len()), &needed));
        }
        let y = expected(self.model, self.offset, rec, u)?;
        let h = self.model.noise_impulse(y.len());
        let noise = h.iter().scan(0.0, |sum, h| {
            *sum += self.variance * h * h;
            Some(*sum)
        });
        let parameters = self.parameter_variance(rec, u, y.len())?;
        let sd = noise.zip(parameters).map(|(noise, own)| (noise + own).sqrt()).collect();
        Ok(Forecast { y, sd })
    }

    /// `g_k' P g_k` for each step ahead.
    fn parameter_variance(&self, rec: &Record, u: &[f64], steps: usize) -> Result<Vec<f64>> {
        let width = self.P.len().isqrt();
        let theta = self.model.theta();
        let mut gradient = Vec::with_capacity(width);
        for i in 0..width {
            let h = STEP * self.P[i * width + i].sqrt();
            let moved = |h: f64| -> Result<Vec<f64>> {
                let mut all = [theta.clone(), vec![self.offset]].concat();
                all[i] += h;
                expected(&self.model.with_theta(&all[..theta.len()]), all[theta.len()], rec, u)
            };
            if !(h > 0.0) {
                gradient.push(vec![0.0; steps]);
                continue;
            }
            let (up, down) = (moved(h)?, moved(-h)?);
            gradient.push(up.iter().zip(&down).map(|(a, b)| (a - b) / (2.0 * h)).collect());
        }
        let at = |k: usize| -> f64 {
            let pair = |ij: usize| self.P[ij] * gradient[ij / width][k] * gradient[ij % width][k];
            (0..width * width).map(pair).sum::<f64>().max(0.0)
        };
        Ok((0..steps).map(at).collect())
    }
}

/// The forecast itself: `O - H e0` with the offset as stand-in for the output.
fn expected(model: &Model, offset: f64, rec: &Record, u: &[f64]) -> Result<Vec<f64>> {
    let start = *rec.starts.last().unwrap_or(&0);
    let (past, steps) = (rec.N() - start, u.len() / rec.nu);
    let valid: Vec<bool> = (0..past + steps).map(|k| k < past && rec.is_valid(start + k, 0)).collect();
    let u = [&rec.u[start * rec.nu..], u].concat();
    let y = [&rec.y[start * rec.ny..], &vec![offset; steps * rec.ny][..]].concat();
    let ahead = Record {
        u: &u,
        y: &y,
        starts: vec![0],
        valid: (rec.ny == 1).then_some(&valid),
        rows: None,
        t: None,
        ..rec.clone()
    };
    let run = over_record(model, &ahead, Some(1), Start::Estimate, Some(offset))?;
    if run.rows.first().is_none_or(|&first| first >= past) {
        return Err(Error::new(
            "X03",
            format!("the last segment has {past} rows, not more than the model's history"),
        )
        .measured(past as f64, model.history(rec.Ts) as f64 + 1.0)
        .remedy("give a record that ends with a longer segment"));
    }
    let e: Vec<f64> = run.yhat[run.yhat.len() - steps..].iter().map(|yhat| offset - yhat).collect();
    Ok(multiply(&model.noise_impulse(steps), &e).iter().map(|off| offset - off).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::model::PolyModel;

    /// AR(1) about a level: `y(t+k) = O + a^k (y(t) - O)`, `var_k = s^2 (1 - a^2k)/(1 - a^2)`.
    #[test]
    fn an_autoregression_decays_to_its_level() {
        let e = white(50, 1);
        let mut y = vec![7.0];
        for t in 1..50 {
            y.push(5.0 + 0.8 * (y[t - 1] - 5.0) + e[t]);
        }
        let u = vec![0.0; 50];
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let model = Model::Poly(PolyModel::arx(vec![1.0, -0.8], vec![vec![0.3]], vec![1], 1.0));
        let fit = Forecaster { model: &model, offset: 5.0, P: &[], variance: 4.0 };
        let ahead = fit.forecast(&rec, &[0.0; 6]).expect("a forecast");
        for k in 1..=6 {
            let a = 0.8f64.powi(k);
            assert!((ahead.y[k as usize - 1] - (5.0 + a * (y[49] - 5.0))).abs() < 1e-12);
            let exact = (4.0 * (1.0 - a * a) / (1.0 - 0.64)).sqrt();
            assert!((ahead.sd[k as usize - 1] - exact).abs() < 1e-12);
        }
        // One parameter: the sensitivity of k steps is k a^(k-1) (y - O).
        let P = [1e-4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let wider = Forecaster { P: &P, variance: 0.0, ..fit }.forecast(&rec, &[0.0; 3]).expect("a forecast");
        let exact = 1e-2 * (3.0 * 0.64 * (y[49] - 5.0)).abs();
        assert!((wider.sd[2] / exact - 1.0).abs() < 1e-6);
    }
}
