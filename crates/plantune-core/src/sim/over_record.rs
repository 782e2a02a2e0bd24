//! A model run over a record: simulated or predicted output, with the initial state of each
//! segment, and the offset if asked for, estimated by least squares.

use std::borrow::Cow;
use std::ops::Range;

use super::irregular::Irregular;
use crate::error::{Error, Result};
use crate::linalg::{Block, Segmented, Triangle, solve};
use crate::model::{Model, Response};
use crate::record::Record;

/// What is assumed of the start of each segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Estimated from the segment.
    Estimate,
    /// At rest.
    Zero,
}

/// Model output beside the measured one, on the rows that have history.
#[derive(Clone, Debug)]
pub struct OverRecord {
    /// Rows of the record, ascending.
    pub rows: Vec<usize>,
    /// Model output on these rows.
    pub yhat: Vec<f64>,
    /// Offset used.
    pub offset: f64,
    /// Initial state per segment.
    pub x0: Vec<Vec<f64>>,
}

/// Runs `model` over `rec`: `horizon = None` simulates, `Some(k)` predicts `k` steps ahead.
///
/// `offset = None` estimates the offset of the record.
pub fn over_record(
    model: &Model,
    rec: &Record,
    horizon: Option<usize>,
    start: Start,
    offset: Option<f64>,
) -> Result<OverRecord> {
    check(model, rec, horizon)?;
    let (input, known) = drifting(model, rec, offset.unwrap_or(0.0));
    let lags = Irregular::of(model, rec)?;
    let history = model.history(rec.Ts);
    let history_of = |s: &Range<usize>| lags.as_ref().map_or(history, |lags| lags.history(s));
    let segments: Vec<_> = rec.segments().filter(|s| s.len() > history_of(s)).collect();
    if segments.is_empty() {
        return Err(Error::new(
            "X03",
            format!("no segment is longer than the model's {history} rows of history"),
        )
        .measured(rec.N() as f64, history as f64 + 1.0)
        .remedy("give a longer record"));
    }
    let responses: Vec<Response> = segments
        .iter()
        .map(|s| {
            let u = &input[s.start * rec.nu..s.end * rec.nu];
            match (&lags, horizon) {
                (Some(lags), _) => lags.error(s.clone(), known),
                (None, None) => simulated_error(model, rec, u, s.start, known),
                (None, Some(_)) => predicted_error(model, rec, u, s.clone(), known, offset.is_none()),
            }
        })
        .collect();

    // error = forced + x0 free + offset * unit: local columns `free` but the last, shared column the last.
    let shared = usize::from(offset.is_none());
    let local = if start == Start::Estimate { responses[0].free.len() - 1 } else { 0 };
    let mut problem = Segmented::new(local, shared);
    for (s, response) in segments.iter().zip(&responses) {
        let rows = s.start + history_of(s)..s.end;
        problem.push(segment_triangle(rec, rows, response, local, shared));
    }
    let unit: Vec<f64> = if shared == 1 {
        solve(problem.common(), &[0], 1, 0.0).map(|s| s.theta).unwrap_or(vec![0.0])
    } else {
        Vec::new()
    };
    let x0 = problem.locals(&unit);

    let mut out = OverRecord { rows: Vec::new(), yhat: Vec::new(), offset: known, x0 };
    out.offset += unit.first().copied().unwrap_or(0.0);
    for ((s, response), x0) in segments.iter().zip(&responses).zip(&out.x0) {
        let error: Vec<f64> = (0..response.forced.len())
            .map(|k| {
                let local: f64 = x0.iter().zip(&response.free).map(|(x, f)| x * f[k]).sum();
                let common: f64 = unit
                    .iter()
                    .zip(&response.free[response.free.len() - shared..])
                    .map(|(x, f)| x * f[k])
                    .sum();
                response.forced[k] - local - common
            })
            .collect();
        let error = match horizon {
            Some(steps) => ahead(&error, &model.noise_impulse(steps)),
            None => error,
        };
        for (k, e) in error.into_iter().enumerate() {
            let row = s.start + history_of(s) + k;
            out.rows.push(row);
            out.yhat.push(rec.y_at(row, 0) - e);
        }
    }
    Ok(out)
}

/// The input, and the offset to take from y. Of an integrating process the offset is a drift `d` per second:
/// the answer to a further input `d / K`.
fn drifting<'a>(model: &Model, rec: &Record<'a>, offset: f64) -> (Cow<'a, [f64]>, f64) {
    match model {
        Model::Process(m) if m.integrating && offset != 0.0 => {
            (rec.u.iter().map(|u| u + offset / m.K).collect(), 0.0)
        }
        _ => (Cow::Borrowed(rec.u), offset),
    }
}

fn check(model: &Model, rec: &Record, horizon: Option<usize>) -> Result<()> {
    model.check_Ts(rec.Ts)?;
    if rec.nu != model.nu() {
        return Err(Error::argument(
            "rec",
            format!("a record with {} inputs", rec.nu),
            &format!("one with {}, like the model", model.nu()),
        ));
    }
    if rec.ny != 1 {
        return Err(Error::argument(
            "rec",
            format!("a record with {} outputs", rec.ny),
            "one with a single output",
        ));
    }
    if horizon == Some(0) {
        return Err(Error::argument("horizon", 0, "at least 1"));
    }
    Ok(())
}

/// Simulation error `y - O - yhat`, its free responses, and the response to a unit offset last.
fn simulated_error(model: &Model, rec: &Record, u: &[f64], start: usize, offset: f64) -> Response {
    let mut response = model.simulation(u, rec.nu, rec.Ts);
    let first = start + model.history(rec.Ts);
    for (k, f) in response.forced.iter_mut().enumerate() {
        *f = rec.y_at(first + k, 0) - offset - *f;
    }
    response.free.push(vec![1.0; response.forced.len()]);
    response
}

/// Prediction error, its free responses with the sign of [`simulated_error`], and that to a unit offset last.
fn predicted_error(
    model: &Model,
    rec: &Record,
    u: &[f64],
    s: Range<usize>,
    offset: f64,
    with_unit: bool,
) -> Response {
    let y: Vec<f64> = s.clone().map(|k| rec.y_at(k, 0) - offset).collect();
    let mut response = model.prediction_error(u, rec.nu, &y, rec.Ts);
    response.free.iter_mut().flatten().for_each(|v| *v = -*v);
    if with_unit {
        let (no_input, ones) = (vec![0.0; u.len()], vec![1.0; s.len()]);
        response.free.push(model.prediction_error(&no_input, rec.nu, &ones, rec.Ts).forced);
    } else {
        response.free.push(vec![0.0; response.forced.len()]);
    }
    response
}

fn segment_triangle(rec: &Record, rows: Range<usize>, r: &Response, local: usize, shared: usize) -> Triangle {
    let n = local + shared + 1;
    let (mut triangle, mut block) = (Triangle::new(n), Block::new(n));
    let mut row = vec![0.0; n];
    let unit = r.free.len() - 1;
    for (k, _) in rows.enumerate().filter(|(_, row)| rec.is_valid(*row, 0)) {
        for (j, x) in row[..local].iter_mut().enumerate() {
            *x = r.free[j][k];
        }
        if shared == 1 {
            row[local] = r.free[unit][k];
        }
        row[n - 1] = r.forced[k];
        block.push(&row);
    }
    triangle.absorb(&mut block);
    triangle
}

/// `steps`-ahead error from the one-step errors: `sum_{j < steps} h_j e(t - j)`.
fn ahead(e: &[f64], h: &[f64]) -> Vec<f64> {
    crate::poly::multiply(h, e)
}
