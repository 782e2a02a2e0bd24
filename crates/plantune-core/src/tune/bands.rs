//! Uncertainty carried on: quantiles over models drawn from a fit's normal distribution.

use super::cloud::{Fitted, cloud, draws};
use super::margins::{Margins, margins};
use crate::error::Result;
use crate::model::{Model, Pid};
use crate::stats::quantile;

/// Models drawn.
const DRAWS: usize = 400;

/// A 95 % band around a curve.
#[derive(Clone, Debug)]
pub struct Bands {
    /// 2.5 % quantile.
    pub low: Vec<f64>,
    /// 97.5 % quantile.
    pub high: Vec<f64>,
}

/// Bands of `gain phase_deg delay Ms Mt`, in this order, of one controller over the models that the fits leave
/// open.
pub fn margin_bands(fits: &[Fitted], pid: &Pid) -> Result<[(f64, f64); 5]> {
    let mut drawn: [Vec<f64>; 5] = Default::default();
    for model in &cloud(fits, DRAWS)?[1..] {
        let Margins { gain, phase_deg, delay, Ms, Mt, .. } = margins(model, pid)?;
        for (values, x) in drawn.iter_mut().zip([gain, phase_deg, delay, Ms, Mt]) {
            values.push(x);
        }
    }
    Ok(drawn.map(|mut values| {
        values.sort_by(f64::total_cmp);
        (quantile(&values, 0.025), quantile(&values, 0.975))
    }))
}

/// Band of the unit step response of input `i` at times `t`.
pub fn step_band(model: &Model, P: &[f64], i: usize, t: &[f64]) -> Result<Bands> {
    curves(draws(model, P, DRAWS)?.iter().map(|m| m.step_response(i, t)).collect())
}

/// Bands of magnitude and unwrapped phase in degrees of input `i` at frequencies `w`, rad/s.
pub fn bode_band(model: &Model, P: &[f64], i: usize, w: &[f64]) -> Result<(Bands, Bands)> {
    let models = draws(model, P, DRAWS)?;
    let magnitude = models.iter().map(|m| w.iter().map(|&w| m.freqresp(i, w).norm()).collect());
    let phase = models.iter().map(|m| phase_deg(m, i, w));
    Ok((curves(magnitude.collect())?, curves(phase.collect())?))
}

/// Phase in degrees without jumps; it starts in (-270, 90], so that a negative gain starts at -180.
pub fn phase_deg(model: &Model, i: usize, w: &[f64]) -> Vec<f64> {
    if let Some(G) = model.transfer() {
        // The dead time turns further than a grid can follow.
        return w.iter().map(|&w| G.phase_deg(w)).collect();
    }
    let mut last = f64::NAN;
    w.iter()
        .map(|&w| {
            let mut phase = model.freqresp(i, w).arg().to_degrees();
            if last.is_finite() {
                phase += 360.0 * ((last - phase) / 360.0).round();
            } else if phase > 90.0 {
                phase -= 360.0;
            }
            last = phase;
            phase
        })
        .collect()
}

/// Point-by-point quantiles.
fn curves(drawn: Vec<Vec<f64>>) -> Result<Bands> {
    let points = drawn.first().map_or(0, Vec::len);
    let mut bands = Bands { low: Vec::with_capacity(points), high: Vec::with_capacity(points) };
    let mut column = Vec::with_capacity(drawn.len());
    for k in 0..points {
        column.clear();
        column.extend(drawn.iter().map(|c| c[k]));
        column.sort_by(f64::total_cmp);
        bands.low.push(quantile(&column, 0.025));
        bands.high.push(quantile(&column, 0.975));
    }
    Ok(bands)
}
