//! The predictor's rows for [`super::super::scores`].

use super::super::orders::Orders;
use super::super::scores::{Scaled, scaled_theta};
use super::predictor::Predictor;
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
