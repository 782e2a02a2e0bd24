//! A process model run over a record whose stamps are not uniform.
//!
//! Of one or two lags behind a dead time the transition from stamp to stamp is exact
//! ([`crate::model::AtStamps`]); such a model has white output noise, so that its prediction is its simulation.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::model::{AtStamps, Model, ProcessModel, Response, Stamped};
use crate::record::Record;

/// A model of lags and the stamps of a record.
pub(super) struct Irregular<'r, 'a> {
    rec: &'r Record<'a>,
    t: &'r [f64],
    plant: ProcessModel,
}

impl<'r, 'a> Irregular<'r, 'a> {
    /// None where the stamps are uniform; refuses what has no exact transition here (D15).
    pub(super) fn of(model: &Model, rec: &'r Record<'a>) -> Result<Option<Self>> {
        let Some(t) = rec.t.filter(|_| rec.is_irregular(&Limits::default())) else { return Ok(None) };
        match model {
            Model::Process(plant) if plant.is_lags() => Ok(Some(Irregular { rec, t, plant: plant.clone() })),
            _ => Err(Error::new(
                "D15",
                "not uniformly sampled, and this model has no exact step from stamp to stamp",
            )
            .remedy("prep.resample(rec, Ts) first; P1D and P2D process models take such stamps as they are")),
        }
    }

    fn lags(&self) -> AtStamps<'_> {
        AtStamps { T: &self.plant.T, L: self.plant.L }
    }

    /// Rows of a segment without all of their delayed input.
    pub(super) fn history(&self, s: &Range<usize>) -> usize {
        self.lags().history(&self.t[s.clone()])
    }

    /// `y - O - K response`, the free responses, and a unit offset last.
    pub(super) fn error(&self, s: Range<usize>, offset: f64) -> Response {
        let (lags, first) = (self.lags(), self.history(&s));
        let on = Stamped { t: &self.t[s.clone()], u: &self.rec.u[s.clone()], first };
        let y = lags.response(on, [0.0; 2]);
        let error = |(k, y): (usize, f64)| self.rec.y_at(s.start + first + k, 0) - offset - self.plant.K * y;
        let forced: Vec<f64> = y.into_iter().enumerate().map(error).collect();
        let unit = |i: usize| std::array::from_fn(|j| f64::from(u8::from(i == j)));
        let mut free: Vec<Vec<f64>> = (0..lags.n()).map(|i| lags.decay(&on.t[first..], unit(i))).collect();
        free.push(vec![1.0; forced.len()]);
        Response { forced, free }
    }
}
