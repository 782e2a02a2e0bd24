//! Whether an ARX model shows errors in variables on data: its regressor holds a noisy output (V08).
//!
//! ```text
//! a pole on the left, |z| > max(0.15, 2 sd), or a real zero in (1, 1.5)
//! and errors that are not white:  Q over 10 lags, p < 0.01
//! and on the same rows           RSS(simulated ARX) > 1.1 RSS(OE),  the better one of order n and n - 1
//! ```
//!
//! The roots alone ([`super::plausible`]) can be a plant's. With the two others no true ARX of five plants was
//! doubted, and of noisy, quantised and smoothed outputs nearly all were. Source 000, 3.1 and 3.2; Söderström 2007.

use super::plausibility::{poles, zeros};
use super::residuals::residuals;
use crate::batch::{Orders, PemOptions, pem};
use crate::error::Result;
use crate::limits::Limits;
use crate::linalg::dot;
use crate::model::{Model, PolyModel};
use crate::note::Note;
use crate::record::Record;
use crate::sim::{Start, over_record};

/// Least magnitude of a pole on the left, and its standard deviations.
const POLE: f64 = 0.15;
const SURE: f64 = 2.0;

/// Largest zero beyond the unit circle that noise makes.
const ZERO: f64 = 1.5;

/// Lags of the errors, and the chance below which they are not white.
const LAGS: usize = 10;
const CHANCE: f64 = 0.01;

/// Share by which an output-error model of like order must simulate better, in squares.
const BETTER: f64 = 1.1;

/// V08 where an ARX model, of covariance `P`, shows the pattern on a record.
pub fn noisy_regressors(
    model: &PolyModel,
    P: Option<&[f64]>,
    rec: &Record,
    limits: &Limits,
) -> Result<Option<Note>> {
    let orders = Orders::of(model);
    if orders.na == 0 || !orders.is_arx() || !has_symptom(model, P) || is_white(model, rec)? {
        return Ok(None);
    }
    let own = simulated(&Model::Poly(model.clone()), rec)?;
    let rivals = (orders.na.saturating_sub(1).max(1)..=orders.na)
        .filter_map(|n| output_errors(&orders, n, rec, limits));
    let least = rivals.fold(f64::INFINITY, f64::min);
    let ratio = own / least;
    Ok((ratio > BETTER).then(|| {
        let text = format!(
            "errors in variables: least squares takes noise of the output as a regressor, and simulates \
             with {ratio:.2} times the squared error of an output-error model"
        );
        Note::warning("V08", text)
            .measured(ratio, BETTER)
            .remedy("fit OE, BJ or iv4, with nk of at least 1; or filter u and y alike, never y alone")
    }))
}

/// Whether a pole or a zero lies where noise puts it.
fn has_symptom(model: &PolyModel, P: Option<&[f64]>) -> bool {
    let left = poles(model, 0, P).iter().any(|p| p.z.re < 0.0 && p.z.norm() > POLE.max(SURE * p.sd));
    let beyond = |i| zeros(model, i, P).iter().any(|r| r.z.im == 0.0 && r.z.re > 1.0 && r.z.re < ZERO);
    left || (0..model.B.len()).any(beyond)
}

/// Whether the one-step errors may be white.
fn is_white(model: &PolyModel, rec: &Record) -> Result<bool> {
    let (rows, errors) = errors(&Model::Poly(model.clone()), rec, Some(1))?;
    Ok(residuals(rec, &rows, &errors, LAGS).portmanteau >= CHANCE)
}

/// Mean squared error of the simulation, its level free.
fn simulated(model: &Model, rec: &Record) -> Result<f64> {
    let (_, errors) = errors(model, rec, None)?;
    Ok(dot(&errors, &errors) / errors.len() as f64)
}

/// The same of an output-error model of order `n`; None where the record does not support it.
fn output_errors(arx: &Orders, n: usize, rec: &Record, limits: &Limits) -> Option<f64> {
    let orders = Orders::oe(arx.nb.clone(), vec![n; arx.nb.len()], arx.nk.clone());
    let options = PemOptions { offset: true, start: Start::Estimate };
    let fit = pem(rec, &orders, options, limits).ok()?;
    simulated(&fit.model, rec).ok()
}

/// Valid rows and the errors there.
fn errors(model: &Model, rec: &Record, horizon: Option<usize>) -> Result<(Vec<usize>, Vec<f64>)> {
    let run = over_record(model, rec, horizon, Start::Estimate, None)?;
    let valid = run.rows.iter().zip(&run.yhat).filter(|(k, _)| rec.is_valid(**k, 0));
    Ok(valid.map(|(&k, yhat)| (k, rec.y_at(k, 0) - yhat)).unzip())
}
