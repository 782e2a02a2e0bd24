//! First order plus dead time from areas under a step response, without a search.
//!
//! ```text
//! int_0^t v = -T v(t) + K t - K L,   v = y - y_0,   t > L from the step
//! ```
//!
//! Linear in `T`, `K` and `K L`. The noise of `v` on the right would draw `T` down; so three passes with
//! instruments follow, the noise-free `v` of the model before.
//!
//! Bi et al., Control Engineering Practice 7, 1999.

use super::integrals::integral;
use super::steps::Steps;
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{Block, Triangle, solve};
use crate::model::Fopdt;
use crate::note::Place;
use crate::record::Record;

/// Passes with instruments.
const PASSES: usize = 3;

/// `K e^(-L s)/(T s + 1)` from the first step of a record that begins at rest.
pub fn areas(rec: &Record, step_at: Option<f64>, limits: &Limits) -> Result<Fopdt> {
    super::check_single(rec)?;
    let y = rec.output_held(0);
    super::check_output(rec, &y)?;
    let steps = Steps::of(rec, &y, step_at, limits)?;
    let (Some(row), Some(rest)) = (steps.row, steps.rest.filter(|rest| rest.du != 0.0)) else {
        return Err(Error::new(
            "X07",
            "areas are counted from the rest before a step, which this record lacks",
        )
        .at(rec.place(1, 0))
        .remedy("record at least three rows at rest before the step, or use estimate.idt"));
    };
    let rows = steps.responses[0].rows.clone();
    let t: Vec<f64> = (row..rows.end).map(|k| rec.time(k) - rec.time(row)).collect();
    let v: Vec<f64> = (row..rows.end).map(|k| (y[k] - rest.y) / rest.du).collect();
    let area = integral(&t, &v);
    let late = rows.start - row;
    let own: Vec<[f64; 3]> = t.iter().zip(&v).map(|(t, v)| [-v, *t, -1.0]).collect();
    let mut found = regression(&own[late..], &own[late..], &area[late..]);
    for _ in 0..PASSES {
        let Some(Fopdt { K, T, L }) = found else { break };
        let clean = |t: f64| K * -(-(t - L).max(0.0) / T.max(f64::MIN_POSITIVE)).exp_m1();
        let instruments: Vec<[f64; 3]> = t.iter().map(|&t| [-clean(t), t, -1.0]).collect();
        found = regression(&instruments[late..], &own[late..], &area[late..]);
    }
    let plant = |m: &Fopdt| m.K.is_finite() && m.K != 0.0 && m.T > 0.0 && m.L > -m.T;
    let model = found.filter(plant).ok_or_else(|| {
        Error::new("X04", "the areas are not those of a first order with dead time")
            .at(Place::column(&rec.names[1]))
            .remedy("use estimate.idt, which finds further modes")
    })?;
    Ok(Fopdt { L: model.L.max(0.0), ..model })
}

/// Solution of `Z'X p = Z'a` for `T, K, K L`.
fn regression(Z: &[[f64; 3]], X: &[[f64; 3]], a: &[f64]) -> Option<Fopdt> {
    let mut block = Block::new(4);
    for i in 0..3 {
        let along = |j: usize| Z.iter().zip(X).map(|(z, x)| z[i] * x[j]).sum::<f64>();
        let right = Z.iter().zip(a).map(|(z, a)| z[i] * a).sum::<f64>();
        block.push(&[along(0), along(1), along(2), right]);
    }
    let mut triangle = Triangle::new(4);
    triangle.absorb(&mut block);
    let p = solve(&triangle, &[0, 1, 2], 3, 1e-15).ok()?.theta;
    Some(Fopdt { T: p[0], K: p[1], L: p[2] / p[1] })
}
