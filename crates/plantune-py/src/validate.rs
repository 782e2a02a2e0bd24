//! Models judged on records.

use numpy::PyReadonlyArray1;
use plantune_core::Limits;
use plantune_core::analyze::p_of_feedback as answers;
use plantune_core::model::Model;
use plantune_core::validate::{
    self, CheckOptions, Delay, Estimated, Feedback, Residuals, Rival, Scores, Verdict,
};
use pyo3::prelude::*;

use crate::error::{Outcome, Raise};
use crate::model::ModelIn;
use crate::note::{NoteOut, notes};
use crate::sim::start;
use crate::values::{Array, LimitsIn, RecordIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(check, m)?)?;
    m.add_function(wrap_pyfunction!(plausible, m)?)?;
    m.add_function(wrap_pyfunction!(expected, m)?)?;
    m.add_function(wrap_pyfunction!(noisy_regressors, m)?)?;
    m.add_function(wrap_pyfunction!(p_of_feedback, m)?)?;
    m.add_function(wrap_pyfunction!(time_varying, m)?)?;
    m.add_function(wrap_pyfunction!(judge, m)?)
}

/// The dict behind `plantune.validate.Verdict(**d)`.
#[derive(IntoPyObject)]
pub struct VerdictOut<'py> {
    fit: f64,
    fit_1step: f64,
    rmse: f64,
    loss: f64,
    N: usize,
    offset: f64,
    rows: Vec<usize>,
    yhat: Array<'py>,
    errors: Array<'py>,
    residuals: ResidualsOut<'py>,
    widening: f64,
    feedback: bool,
    passed: bool,
    notes: Vec<NoteOut>,
}

/// The dict behind `plantune.validate.Residuals(**d)`.
#[derive(IntoPyObject)]
pub struct ResidualsOut<'py> {
    lags: Vec<i64>,
    autocorr: Array<'py>,
    band: f64,
    cross_lags: Vec<i64>,
    crosscorr: Vec<Array<'py>>,
    cross_band: Array<'py>,
    portmanteau: f64,
}

fn verdict_out(py: Python<'_>, verdict: Verdict) -> VerdictOut<'_> {
    VerdictOut {
        fit: verdict.fit,
        fit_1step: verdict.fit_1step,
        rmse: verdict.rmse,
        loss: verdict.loss,
        N: verdict.N,
        offset: verdict.offset,
        rows: verdict.simulated.rows,
        yhat: array(py, verdict.simulated.yhat),
        errors: array(py, verdict.errors),
        residuals: residuals_out(py, verdict.residuals),
        widening: verdict.widening,
        feedback: verdict.feedback,
        passed: verdict.passed,
        notes: notes(&verdict.notes),
    }
}

fn residuals_out(py: Python<'_>, r: Residuals) -> ResidualsOut<'_> {
    ResidualsOut {
        lags: r.lags,
        autocorr: array(py, r.autocorr),
        band: r.band,
        cross_lags: r.cross_lags,
        crosscorr: r.crosscorr.into_iter().map(|c| array(py, c)).collect(),
        cross_band: array(py, r.cross_band),
        portmanteau: r.portmanteau,
    }
}

/// `options` are `x0, offset, lags, fitted`.
#[pyfunction]
fn check<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: ModelIn,
    options: (String, Option<f64>, usize, Option<usize>),
    limits: LimitsIn,
) -> Outcome<VerdictOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view_of_any_stamps(&limits)?;
    let (x0, offset, lags, fitted) = options;
    let options = CheckOptions { x0: start(&x0)?, offset, lags, fitted };
    checked(py, py.detach(|| validate::check(&model.0, &record, &options, &limits)))
}

/// A verdict, or a refusal that carries one.
pub fn checked(
    py: Python<'_>,
    outcome: Result<Verdict, (plantune_core::Error, Option<Box<Verdict>>)>,
) -> Outcome<VerdictOut<'_>> {
    match outcome {
        Ok(verdict) => Ok(verdict_out(py, verdict)),
        Err((error, verdict)) => {
            let partial = verdict.map(|v| verdict_out(py, *v).into_pyobject(py)).transpose()?;
            Err(Raise::with_result(error, partial.map(|p| p.into_any().unbind())))
        }
    }
}

/// Doubts about the roots of a model; `P` is its covariance where a fit gives one.
#[pyfunction]
fn plausible(
    model: ModelIn,
    P: Option<PyReadonlyArray1<'_, f64>>,
    inputs: Vec<String>,
    limits: LimitsIn,
) -> Outcome<Vec<NoteOut>> {
    let P = P.as_ref().map(|P| P.as_slice()).transpose().map_err(PyErr::from)?;
    Ok(notes(&validate::plausible(&model.0, P, &inputs, &limits.into())?))
}

/// V08 where an ARX model shows errors in variables on a record; nothing of other models.
#[pyfunction]
fn noisy_regressors(
    py: Python<'_>,
    rec: RecordIn<'_>,
    model: ModelIn,
    P: PyReadonlyArray1<'_, f64>,
    limits: LimitsIn,
) -> Outcome<Vec<NoteOut>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let P = P.as_slice().map_err(PyErr::from)?;
    let Model::Poly(model) = model.0 else { return Ok(Vec::new()) };
    let found = py.detach(|| validate::noisy_regressors(&model, Some(P), &record, &limits))?;
    Ok(notes(found.as_slice()))
}

/// N03 of each name found far outside of its range; `(name, found, low, high)`, of columns or of parameters.
#[pyfunction]
fn expected(all: Vec<(String, f64, f64, f64)>, columns: bool, limits: LimitsIn) -> Outcome<Vec<NoteOut>> {
    let one = |(name, found, low, high)| validate::Expected { name, found, low, high, spans: columns };
    let all: Vec<validate::Expected> = all.into_iter().map(one).collect();
    Ok(notes(&validate::expected(&all, &limits.into())))
}

/// p-value of "no error of y moves the input", one per input.
#[pyfunction]
fn p_of_feedback(py: Python<'_>, rec: RecordIn<'_>, direct: bool, limits: LimitsIn) -> Outcome<Vec<f64>> {
    let record = rec.view(&limits.into())?;
    Ok(py.detach(|| (0..record.nu).map(|i| answers(&record, i, direct)).collect()))
}

/// The dict behind `plantune.validate.TimeVarying(**d)`; `row` is one of the record.
#[derive(IntoPyObject)]
struct TimeVaryingOut {
    statistic: f64,
    limit: f64,
    row: usize,
    apart: f64,
    gains: (f64, f64),
}

#[pyfunction]
fn time_varying(
    py: Python<'_>,
    rec: RecordIn<'_>,
    nk: Vec<usize>,
    order: usize,
    limits: LimitsIn,
) -> Outcome<Option<TimeVaryingOut>> {
    let record = rec.view(&limits.into())?;
    let found = py.detach(|| validate::time_varying(&record, &nk, order));
    Ok(found.map(|f| TimeVaryingOut {
        statistic: f.statistic,
        limit: f.limit,
        row: f.row,
        apart: f.apart,
        gains: f.gains,
    }))
}

/// What the judge needs of a `plantune.validate.Verdict`, by attribute.
#[derive(FromPyObject)]
struct ScoresIn {
    fit: f64,
    rmse: f64,
    widening: f64,
}

impl From<ScoresIn> for Scores {
    fn from(s: ScoresIn) -> Self {
        Scores { fit: s.fit, rmse: s.rmse, widening: s.widening }
    }
}

/// A model and its flat covariance.
type EstimatedIn<'py> = (ModelIn, PyReadonlyArray1<'py, f64>);

fn estimated((model, P): EstimatedIn<'_>) -> Outcome<Estimated> {
    Ok(Estimated { model: model.0, P: P.as_slice().map_err(PyErr::from)?.to_vec() })
}

/// Factor for the standard deviations of the process model, and notes; `rival` is name, verdict and `nk`.
///
/// `feedback` holds the process model and the rival on the same rows, in closed loop.
#[pyfunction]
#[pyo3(signature = (process, delay, rival, feedback, limits))]
fn judge(
    process: ScoresIn,
    delay: (f64, f64, f64),
    rival: Option<(String, ScoresIn, usize)>,
    feedback: Option<(EstimatedIn<'_>, EstimatedIn<'_>)>,
    limits: LimitsIn,
) -> Outcome<(f64, Vec<NoteOut>)> {
    let (L, sd, Ts) = delay;
    let both =
        |(process, poly)| Outcome::Ok(Feedback { process: estimated(process)?, poly: estimated(poly)? });
    let feedback = feedback.map(both).transpose()?;
    let rival = rival.map(|(name, scores, nk)| Rival { name, scores: scores.into(), nk, feedback });
    let (factor, found) =
        validate::judge(&process.into(), Delay { L, sd, Ts }, rival.as_ref(), &limits.into());
    Ok((factor, notes(&found)))
}
