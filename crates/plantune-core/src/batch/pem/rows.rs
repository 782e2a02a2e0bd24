//! The predictor at a model that is known: its rows, and the minimum next to it on another record.

use super::super::orders::Orders;
use super::super::scores::{Scaled, scaled_theta, unscaled};
use super::predictor::Predictor;
use crate::linalg::minimise;
use crate::model::PolyModel;
use crate::record::Record;
use crate::sim::Start;

/// Rows `[psi | eps]` of a model on scaled data; `offset` where `O` was estimated.
pub(in super::super) fn rows(
    rec: &Record,
    model: &PolyModel,
    offset: Option<f64>,
    start: Start,
) -> Option<Scaled> {
    let orders = Orders::of(model);
    let mut predictor = Predictor::new(rec, &orders, offset.is_some(), start);
    let theta = scaled_theta(&orders, model, offset, &predictor.scale_u, predictor.scale_y);
    let parts = predictor.rows(&theta)?;
    let states = predictor.states();
    Some(Scaled { parts, states, u: predictor.scale_u, y: predictor.scale_y })
}

/// `theta`, then the offset, of the minimum that a descent from a model reaches.
pub(in super::super) fn refit(
    rec: &Record,
    model: &PolyModel,
    offset: Option<f64>,
    start: Start,
) -> Option<Vec<f64>> {
    let orders = Orders::of(model);
    let mut predictor = Predictor::new(rec, &orders, offset.is_some(), start);
    let theta = scaled_theta(&orders, model, offset, &predictor.scale_u, predictor.scale_y);
    let minimum = minimise(&mut predictor, theta)?;
    Some(unscaled(&orders, &minimum.theta, rec.Ts, (&predictor.scale_u, predictor.scale_y)))
}
