//! Tuning over the models that the data leave open, and how much more data would be worth.
//!
//! ```text
//! the 95 % quantile of Ms over the cloud <= Ms asked for     (so for Mt and the noise gain)
//! kept = Ki of the set design / Ki of the point design        what the uncertainty leaves
//! ```
//!
//! More data of the same kind shrink the covariance in proportion, and sharpen the weights of the delays; the
//! least factor at which the wish can be met, or costs little, is searched and told in seconds of record.

use super::cloud::{Fitted, cloud};
use super::optimise::{Optimum, Wish, optimise};
use crate::error::Result;

/// Models drawn for the search.
pub const DRAWS: usize = 200;

/// Most times that more data are considered.
const MOST: f64 = 4096.0;

/// A controller that keeps its limits over the uncertainty.
pub struct Posterior {
    /// Over the cloud.
    pub set: Optimum,
    /// On the most probable model alone.
    pub point: Optimum,
    /// Times as much data at which the price would be small; absent where it is already, or never.
    pub more: Option<f64>,
}

impl Posterior {
    /// Share of the point design's integral gain that the uncertainty leaves.
    pub fn kept(&self) -> f64 {
        kept(&self.set, &self.point)
    }
}

fn kept(set: &Optimum, point: &Optimum) -> f64 {
    set.pid.Ki / point.pid.Ki
}

/// The optimum over the fits; `dear` is the share of the point design's `Ki` below which more data pay.
pub fn posterior(fits: &[Fitted], wish: &Wish, dear: f64) -> Result<Posterior> {
    let point = optimise(&cloud(fits, 0)?, wish)?;
    let at = |more: f64| {
        let scaled: Vec<Fitted> = fits.iter().map(|fit| fit.with_more_data(more)).collect();
        cloud(&scaled, DRAWS).and_then(|models| optimise(&models, wish))
    };
    let kept = |set: &Optimum| kept(set, &point);
    match at(1.0) {
        Ok(set) if kept(&set) >= dear => Ok(Posterior { set, point, more: None }),
        Ok(set) => {
            let enough = |more: f64| at(more).is_ok_and(|set| kept(&set) >= dear);
            Ok(Posterior { set, point, more: least(enough) })
        }
        Err(error) if error.code() == "X13" => {
            let more = least(|more| at(more).is_ok());
            Err(match more.and_then(|more| seconds(fits, more)) {
                Some(s) => {
                    error.remedy(format!("record about {s:.3} s more of the same kind, or allow a larger Ms"))
                }
                None => error,
            })
        }
        Err(error) => Err(error),
    }
}

/// Seconds of record that `more` times as much data are on top of what there is.
pub fn seconds(fits: &[Fitted], more: f64) -> Option<f64> {
    let fit = fits.first()?;
    fit.Ts.map(|Ts| (more - 1.0) * fit.N as f64 * Ts)
}

/// The least factor that is enough, to a tenth.
fn least(enough: impl Fn(f64) -> bool) -> Option<f64> {
    let mut high = 2.0;
    while !enough(high) {
        high *= 2.0;
        if high > MOST {
            return None;
        }
    }
    let mut low = 0.5 * high;
    while high / low > 1.1 {
        let middle = (low * high).sqrt();
        if enough(middle) { high = middle } else { low = middle }
    }
    Some(high)
}
