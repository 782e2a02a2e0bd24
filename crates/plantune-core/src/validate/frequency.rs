//! A model against a measured frequency response, in discs.
//!
//! ```text
//! distance = |G_model - G| / radius;   in the disc where at most 1
//! passes:  inside >= 0.95 - 3 sqrt(0.95 0.05/m),   m = n share independent points
//! ```
//!
//! `share` is the part of a point's information that its neighbours do not hold: points of averaged spectra leave the
//! disc in company.

use crate::error::{Error, Result};
use crate::model::{FrequencyResponse, Model, seen};
use crate::note::{Note, rounded};

/// How far a model lies from the points.
#[derive(Clone, Debug)]
pub struct FrequencyVerdict {
    /// In radii; infinite where a disc has none.
    pub distance: Vec<f64>, // (n, nu)
    /// Points inside their disc.
    pub inside: usize,
    /// Share of them.
    pub part: f64,
    /// Share below which the model does not pass.
    pub limit: f64,
    /// Frequency, input and distance of the worst point.
    pub worst: (f64, usize, f64),
    /// Whether it passes.
    pub passed: bool,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Judges a model of one output on a response that has discs.
pub fn frequency(data: &FrequencyResponse, model: &Model, share: f64) -> Result<FrequencyVerdict> {
    model.check()?;
    let (n, nu) = (data.n(), data.nu);
    if data.ny != 1 || model.nu() != nu {
        let came = format!("of {} outputs and {nu} inputs", data.ny);
        return Err(Error::argument("fr", came, &format!("of one output and {} inputs", model.nu())));
    }
    let Some(radius) = &data.radius else {
        return Err(Error::argument("fr", "a response without discs", "one with `sd` or `radius`"));
    };
    let mut distance = vec![0.0; n * nu];
    for j in 0..nu {
        for (k, G) in seen(model, j, data.Ts, &data.w).iter().enumerate() {
            let at = k * nu + j;
            let off = (G - data.G[at]).norm();
            distance[at] = if off == 0.0 { 0.0 } else { off / radius[at] };
        }
    }
    let inside = distance.iter().filter(|d| **d <= 1.0).count();
    let part = inside as f64 / distance.len() as f64;
    let limit = 0.95 - 3.0 * (0.95 * 0.05 / (distance.len() as f64 * share)).sqrt();
    let at = (0..distance.len()).max_by(|&a, &b| distance[a].total_cmp(&distance[b])).unwrap_or(0);
    let worst = (data.w[at / nu], at % nu, distance[at]);
    let passed = part >= limit;
    let note = (!passed).then(|| {
        let text = format!(
            "the model lies outside the 95 % discs at {} of {} frequencies, {} radii off at {} rad/s",
            distance.len() - inside,
            distance.len(),
            rounded(worst.2),
            rounded(worst.0)
        );
        Note::warning("V02", text)
            .count(distance.len() - inside)
            .measured(part, limit)
            .remedy("another structure or delay; plot.frequency shows where it departs")
    });
    Ok(FrequencyVerdict { distance, inside, part, limit, worst, passed, notes: note.into_iter().collect() })
}
