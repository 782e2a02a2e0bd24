//! A model judged on a record: simulation fit, one-step fit, residuals, and whether u explains y at all.
//!
//! `fit = 100 (1 - |y - yhat| / |y - mean(y)|)`.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use super::line::line;
use super::memory::memory;
use super::model_free::model_free;
use super::residuals::{Residuals, correlation, residuals};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::extent;
use crate::model::{Model, TermModel};
use crate::note::{Note, Place, rounded};
use crate::record::Record;
use crate::sim::{OverRecord, Start, over_record};
use crate::stats::{centred, f_tail};

/// What is estimated on the record at hand.
#[derive(Clone, Debug)]
pub struct CheckOptions {
    /// Initial state.
    pub x0: Start,
    /// Offset; estimated when absent.
    pub offset: Option<f64>,
    /// Lags of the residual correlations.
    pub lags: usize,
    /// Rows on which the model was fitted, where they are known: its own error is the larger, the fewer.
    pub fitted: Option<usize>,
}

/// How a model does on a record.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// Simulation fit, %.
    pub fit: f64,
    /// One-step fit, %.
    pub fit_1step: f64,
    /// Root mean squared simulation error.
    pub rmse: f64,
    /// Mean squared one-step error on this record.
    pub loss: f64,
    /// Rows judged.
    pub N: usize,
    /// Offset used in the simulation.
    pub offset: f64,
    /// Rows and simulated output.
    pub simulated: OverRecord,
    /// One-step errors on the same rows.
    pub errors: Vec<f64>,
    /// Correlations of the one-step errors.
    pub residuals: Residuals,
    /// Factor by which correlated residuals widen a standard deviation.
    pub widening: f64,
    /// Whether the input follows errors, as it does in closed loop.
    pub feedback: bool,
    /// Fit above the limit and residuals free of the input.
    pub passed: bool,
    /// Doubts.
    pub notes: Vec<Note>,
    /// Whether the errors are rounding.
    pub(super) exact: bool,
}

/// Judges `model` on `rec`. `X04` comes with the verdict, for study.
pub fn check(
    model: &Model,
    rec: &Record,
    options: &CheckOptions,
    limits: &Limits,
) -> std::result::Result<Verdict, (Error, Option<Box<Verdict>>)> {
    let verdict = judge(model, rec, options, limits).map_err(|e| (e, None))?;
    related(rec, verdict, limits)
}

/// Judges a model with regressors of one's own, run from the first rows of each segment.
pub fn check_terms(
    model: &TermModel,
    given: &[f64],
    rec: &Record,
    lags: usize,
    limits: &Limits,
) -> std::result::Result<Verdict, (Error, Option<Box<Verdict>>)> {
    let run = |horizon: Option<usize>| {
        let (rows, yhat) = model.over_record(rec, given, horizon).map_err(|e| (e, None))?;
        Ok(OverRecord { rows, yhat, offset: model.d, x0: Vec::new() })
    };
    related(rec, judged(rec, run(None)?, &run(Some(1))?, lags, limits), limits)
}

/// The verdict, unless u explains nothing of y (X04).
pub(super) fn related(
    rec: &Record,
    verdict: Verdict,
    limits: &Limits,
) -> std::result::Result<Verdict, (Error, Option<Box<Verdict>>)> {
    let p = relation(rec, &verdict);
    if p <= limits.X04 {
        return Ok(verdict);
    }
    let error = Error::new(
        "X04",
        format!(
            "no relation: on these {} rows the model is no better than the mean (fit {:.1} %)",
            verdict.N, verdict.fit
        ),
    )
    .at(Place::column(&rec.names[rec.nu]))
    .count(verdict.N)
    .measured(p, limits.X04)
    .remedy("check that the columns belong together; record with larger steps of the input");
    Err((error, Some(Box::new(verdict))))
}

fn judge(model: &Model, rec: &Record, options: &CheckOptions, limits: &Limits) -> Result<Verdict> {
    if let Some(growth) = growth(model, rec) {
        return one_step_ahead(model, rec, options, growth, limits);
    }
    let simulated = over_record(model, rec, None, options.x0, options.offset)?;
    let predicted = over_record(model, rec, Some(1), options.x0, options.offset)?;
    let mut verdict = judged(rec, simulated, &predicted, options.lags, limits);
    if !verdict.notes.is_empty() {
        verdict.notes.extend(memory(model, rec, limits));
        let moved = level(model, rec, options, &verdict, limits)?;
        verdict.notes.extend(moved);
    }
    if !verdict.exact {
        let run = &verdict.simulated;
        let counts: Vec<usize> = (0..run.rows.len()).filter(|&k| rec.is_valid(run.rows[k], 0)).collect();
        let rows: Vec<usize> = counts.iter().map(|&k| run.rows[k]).collect();
        let errors: Vec<f64> = counts.iter().map(|&k| rec.y_at(run.rows[k], 0) - run.yhat[k]).collect();
        let differs = model_free(model, rec, (&rows, &errors), options.fitted, limits);
        verdict.notes.extend(differs);
    }
    Ok(verdict)
}

/// Factor by which an unstable model's state grows over the longest segment, where no simulation can stay near.
fn growth(model: &Model, rec: &Record) -> Option<f64> {
    let size = |&(re, im): &(f64, f64)| match model {
        Model::Poly(_) => f64::hypot(re, im),
        _ => (re * rec.Ts).exp(),
    };
    let largest = model.poles().iter().map(size).fold(0.0, f64::max);
    let longest = rec.segments().map(|s| s.len()).max()?;
    Some(largest.powf(longest as f64)).filter(|&growth| growth > FARTHEST)
}

/// Growth at which rounding of the first row fills the last: a simulation then says nothing, however true the model.
const FARTHEST: f64 = 1e15;

/// M02: an unstable model is judged by what it predicts of the next row.
fn one_step_ahead(
    model: &Model,
    rec: &Record,
    options: &CheckOptions,
    growth: f64,
    limits: &Limits,
) -> Result<Verdict> {
    let predicted = over_record(model, rec, Some(1), options.x0, options.offset)?;
    let mut verdict = judged(rec, predicted.clone(), &predicted, options.lags, limits);
    let text = "unstable: judged one step ahead, since its simulation leaves every record";
    verdict.notes.push(
        Note::warning("M02", text)
            .measured(growth, FARTHEST)
            .remedy("trust it in closed loop only: simulate.closed_loop"),
    );
    Ok(verdict)
}

/// What a simulation and a one-step prediction of one output say.
pub(super) fn judged(
    rec: &Record,
    simulated: OverRecord,
    predicted: &OverRecord,
    lags: usize,
    limits: &Limits,
) -> Verdict {
    let counts =
        |rows: &[usize]| -> Vec<usize> { (0..rows.len()).filter(|&k| rec.is_valid(rows[k], 0)).collect() };
    let errors = |run: &OverRecord| -> Vec<f64> {
        counts(&run.rows).iter().map(|&k| rec.y_at(run.rows[k], 0) - run.yhat[k]).collect()
    };
    let (simulation_errors, errors) = (errors(&simulated), errors(predicted));
    let rows: Vec<usize> = counts(&predicted.rows).iter().map(|&k| predicted.rows[k]).collect();
    let y: Vec<f64> = rows.iter().map(|&k| rec.y_at(k, 0)).collect();
    let residuals = residuals(rec, &rows, &errors, lags);
    let N = errors.len();
    let mean_square = |e: &[f64]| e.iter().map(|x| x * x).sum::<f64>() / e.len() as f64;
    let fit = fit_percent(&y, &simulation_errors);
    // Rounding has a colour of its own that says nothing.
    let (low, high) = extent(&y);
    let rounding = 1e-9 * (high - low);
    let exact = errors.iter().chain(&simulation_errors).all(|e| e.abs() <= rounding);
    let fit_1step = fit_percent(&y, &errors);
    let mut notes = if exact { Vec::new() } else { notes(rec, &residuals, [fit, fit_1step], limits) };
    if let Some(coloured) = notes.iter_mut().find(|note| note.code == "M08") {
        coloured.text += &named_line(rec, &rows, &errors);
    }
    let passed = fit >= limits.V01 && notes.iter().all(|n| n.code != "V02");
    Verdict {
        fit,
        fit_1step,
        rmse: mean_square(&simulation_errors).sqrt(),
        loss: mean_square(&errors),
        N,
        offset: simulated.offset,
        widening: if exact { 1.0 } else { widening(&residuals) },
        feedback: !exact && feedback(&residuals),
        simulated,
        errors,
        residuals,
        passed,
        notes,
        exact,
    }
}

/// 100 for an exact fit, 0 for the mean, negative for worse; an output that stands still is fitted or not.
fn fit_percent(y: &[f64], e: &[f64]) -> f64 {
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let around: f64 = y.iter().map(|y| (y - mean).powi(2)).sum();
    let left: f64 = e.iter().map(|e| e * e).sum();
    if around > 0.0 {
        100.0 * (1.0 - (left / around).sqrt())
    } else if left == 0.0 {
        100.0
    } else {
        0.0
    }
}

/// p-value of the slope in `y = c + slope yhat`, on as many rows as the autocorrelation of both leaves
/// independent (Bartlett); 1 for a slope that is not positive. Initial states fitted to y explain a row of it each
/// whatever u is, and count beside the slope.
fn relation(rec: &Record, verdict: &Verdict) -> f64 {
    let run = &verdict.simulated;
    let rows: Vec<usize> = (0..run.rows.len()).filter(|&k| rec.is_valid(run.rows[k], 0)).collect();
    let y = centred(rows.iter().map(|&k| rec.y_at(run.rows[k], 0)).collect());
    let yhat = centred(rows.iter().map(|&k| run.yhat[k]).collect());
    let r = correlation(&y, &yhat, 0)[0];
    if !(r > 0.0) {
        return 1.0;
    }
    let most = (rows.len() / 4).min(500);
    let shared: f64 = correlation(&y, &y, most)[1..]
        .iter()
        .zip(&correlation(&yhat, &yhat, most)[1..])
        .map(|(a, b)| a * b)
        .sum();
    let independent = (rows.len() as f64 / (1.0 + 2.0 * shared).max(1.0)).max(3.0);
    let states = run.x0.iter().map(Vec::len).sum::<usize>() as f64;
    let fitted = 1.0 + states * independent / rows.len() as f64;
    let F = r * r * (independent - 2.0) / (1.0 - r * r).max(f64::EPSILON) / fitted;
    f_tail(F, fitted, independent - 2.0)
}

/// `sqrt(1 + 2 sum |r_e(k)|)` over the lags outside the band; 1 where no more are outside than by chance.
fn widening(residuals: &Residuals) -> f64 {
    let outside: Vec<f64> =
        residuals.autocorr.iter().skip(1).map(|r| r.abs()).filter(|&r| r > residuals.band).collect();
    if outside.len() <= by_chance(residuals.autocorr.len()) {
        return 1.0;
    }
    (1.0 + 2.0 * outside.iter().sum::<f64>()).sqrt()
}

/// Whether some input follows errors of the same row or of earlier ones, beyond what chance gives.
fn feedback(residuals: &Residuals) -> bool {
    let until_now = residuals.cross_lags.iter().take_while(|lag| **lag <= 0).count();
    let mut inputs = residuals.crosscorr.iter().zip(&residuals.cross_band);
    inputs.any(|(r, band)| {
        // The model's own error, which doubles the variance in `cross_limit`, has no part here.
        let limit = residuals.cross_limit * FRAC_1_SQRT_2 * band;
        r[..until_now].iter().any(|r| r.abs() > limit)
    })
}

/// Lags that may lie outside a 99 % band without saying anything.
fn by_chance(lags: usize) -> usize {
    1 + lags / 20
}

/// V13: with a level of its own the record is simulated clearly better.
fn level(
    model: &Model,
    rec: &Record,
    options: &CheckOptions,
    verdict: &Verdict,
    limits: &Limits,
) -> Result<Option<Note>> {
    if options.offset.is_none() {
        return Ok(None);
    }
    let run = over_record(model, rec, None, options.x0, None)?;
    let rows = || (0..run.rows.len()).filter(|&k| rec.is_valid(run.rows[k], 0));
    let y: Vec<f64> = rows().map(|k| rec.y_at(run.rows[k], 0)).collect();
    let errors: Vec<f64> = rows().zip(&y).map(|(k, y)| y - run.yhat[k]).collect();
    let own = fit_percent(&y, &errors);
    Ok((own > 0.0 && own - verdict.fit > limits.V13).then(|| {
        let by = run.offset - verdict.offset;
        let text = format!("the level moved by {by:.4}: with its own the simulation explains {own:.1} %");
        Note::warning("V13", text)
            .at(Place::column(&rec.names[rec.nu]))
            .measured(own - verdict.fit, limits.V13)
            .remedy(
                "look for a disturbance that the inputs do not hold; offset=\"estimate\" judges without it",
            )
    }))
}

fn notes(rec: &Record, residuals: &Residuals, [fit, fit_1step]: [f64; 2], limits: &Limits) -> Vec<Note> {
    let follow = (0..rec.nu).filter_map(|i| follows(rec, residuals, i));
    let low = (fit < limits.V01).then(|| {
        let from_y = if fit_1step < limits.V01 {
            String::new()
        } else {
            format!("; {fit_1step:.1} % one step ahead come from the last outputs, not from the inputs")
        };
        Note::warning("V01", format!("the simulation explains {fit:.1} % on these rows{from_y}"))
            .measured(fit, limits.V01)
            .remedy("look at the residuals and at the record for disturbances")
    });
    coloured(residuals).into_iter().chain(follow).chain(low).collect()
}

/// M08: the residuals follow their own past.
fn coloured(residuals: &Residuals) -> Option<Note> {
    let outside = Outside::of(&residuals.lags, &residuals.autocorr, residuals.band)?;
    Some(
        Note::warning("M08", format!("residuals are not white: {}", outside.text()))
            .count(outside.count)
            .measured(outside.most, residuals.band)
            .remedy("widen the intervals before use; look for a disturbance, or a lag the model lacks"),
    )
}

/// The frequency that stands out of coloured errors, in words; empty where none does.
fn named_line(rec: &Record, rows: &[usize], errors: &[f64]) -> String {
    line(rows, errors).map_or_else(String::new, |found| {
        let (w, period) = (found.w / rec.Ts, TAU / found.w * rec.Ts);
        let share = (100.0 * found.share).round();
        format!("; {share} % of them at {} rad/s, a period of {} s", rounded(w), rounded(period))
    })
}

/// V02: the residuals follow an input.
fn follows(rec: &Record, residuals: &Residuals, i: usize) -> Option<Note> {
    let (r, band) = (&residuals.crosscorr[i], residuals.cross_band[i]);
    let outside = Outside::of(&residuals.cross_lags, r, band)?;
    let name = rec.input_name(i);
    (outside.most.abs() > residuals.cross_limit * band).then(|| {
        Note::warning("V02", format!("residuals still follow {name}: {}", outside.text()))
            .at(Place::column(name))
            .count(outside.count)
            .measured(outside.most, band)
            .remedy("try another delay or a higher order")
    })
}

/// Lags from 1 on outside a 99 % band, more than chance puts there.
struct Outside {
    count: usize,
    /// The largest correlation, and its lag.
    most: f64,
    lag: i64,
}

impl Outside {
    fn of(lags: &[i64], r: &[f64], band: f64) -> Option<Self> {
        let later = || lags.iter().zip(r).filter(|(lag, _)| **lag >= 1);
        let count = later().filter(|(_, r)| r.abs() > band).count();
        let (&lag, &most) = later().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        let by_chance = by_chance(1 + later().count());
        (count > by_chance).then_some(Outside { count, most, lag })
    }

    fn text(&self) -> String {
        format!("{} lags outside the 99 % band, most at lag {}", self.count, self.lag)
    }
}
