//! Step responses as sums of modes.

use numpy::{Complex64, PyArray1};
use plantune_core::Record;
use plantune_core::batch::{self, Mode, StepModes, StepModesOptions, standard_deviations};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::model::ModelOut;
use crate::note::{NoteOut, notes};
use crate::values::{Array, LimitsIn, Matrix, RecordIn, array, matrix};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(areas, m)?)?;
    m.add_function(wrap_pyfunction!(idt_criterion, m)?)?;
    m.add_function(wrap_pyfunction!(step_modes, m)?)
}

/// The dict behind `plantune.estimate.StepModes(**d)`.
#[derive(IntoPyObject)]
struct StepModesOut<'py> {
    order: usize,
    modes: Vec<ModeOut>,
    poles: Bound<'py, PyArray1<Complex64>>,
    names: Vec<String>,
    theta: Array<'py>,
    sd: Array<'py>,
    P: Matrix<'py>,
    gain: Option<f64>,
    gain_sd: Option<f64>,
    level: f64,
    level_sd: f64,
    rest: Option<f64>,
    rest_sd: Option<f64>,
    step_at: Option<f64>,
    step: Option<f64>,
    delay: Option<f64>,
    delay_sd: Option<f64>,
    numerator: Option<Array<'py>>,
    numerator_sd: Option<Array<'py>>,
    zeros: Option<Bound<'py, PyArray1<Complex64>>>,
    model: Option<ModelOut>,
    tried: Vec<TriedOut>,
    colour: f64,
    N: usize,
    loss: f64,
    bic: f64,
    status: &'static str,
    t: Array<'py>,
    y: Array<'py>,
    curve: Array<'py>,
    curve_sd: Array<'py>,
    curve_band: (Array<'py>, Array<'py>),
    parts_t: Array<'py>,
    parts: Matrix<'py>,
    parts_band: (Matrix<'py>, Matrix<'py>),
    rows: Matrix<'py, i64>,
    notes: Vec<NoteOut>,
}

#[derive(IntoPyObject)]
struct ModeOut {
    kind: &'static str,
    T: f64,
    T_sd: f64,
    T_interval: (f64, f64),
    w: f64,
    w_sd: f64,
    zeta: Option<f64>,
    zeta_sd: Option<f64>,
}

impl From<&Mode> for ModeOut {
    fn from(mode: &Mode) -> Self {
        let w = 1.0 / mode.T;
        ModeOut {
            kind: mode.kind.as_str(),
            T: mode.T,
            T_sd: mode.T * mode.sd_ln_T,
            T_interval: mode.interval(),
            w,
            w_sd: w * mode.sd_ln_T,
            zeta: mode.zeta.map(|(zeta, _)| zeta),
            zeta_sd: mode.zeta.map(|(zeta, sd)| zeta * sd),
        }
    }
}

#[derive(IntoPyObject)]
struct TriedOut {
    order: usize,
    loss: f64,
    bic: f64,
    why: String,
}

fn out<'py>(py: Python<'py>, rec: &Record, found: StepModes) -> PyResult<StepModesOut<'py>> {
    let n = found.theta.len();
    let (low, high) = batch::band(&found.curve.0, &found.curve.1);
    let (parts, points) = (found.parts.y.concat(), found.parts.t.len());
    let (parts_low, parts_high) = batch::band(&parts, &found.parts.sd.concat());
    let complexes = |z: Vec<Complex64>| PyArray1::from_vec(py, z);
    let zeros =
        found.numerator.is_some().then(|| found.zeros.iter().map(|z| Complex64::new(z.0, z.1)).collect());
    let (numerator, numerator_sd) = found.numerator.unzip();
    Ok(StepModesOut {
        order: found.order,
        modes: found.modes.iter().map(ModeOut::from).collect(),
        poles: complexes(found.poles),
        names: found.names,
        theta: array(py, found.theta),
        sd: array(py, standard_deviations(&found.P, n)),
        P: matrix(py, found.P, n)?,
        gain: found.gain.map(|(K, _)| K),
        gain_sd: found.gain.map(|(_, sd)| sd),
        level: found.level.0,
        level_sd: found.level.1,
        rest: found.rest.map(|(y, _)| y),
        rest_sd: found.rest.map(|(_, sd)| sd),
        step_at: found.step.map(|(t, _)| t),
        step: found.step.map(|(_, du)| du),
        delay: found.delay.map(|(L, _)| L),
        delay_sd: found.delay.map(|(_, sd)| sd),
        numerator: numerator.map(|n| array(py, n)),
        numerator_sd: numerator_sd.map(|n| array(py, n)),
        zeros: zeros.map(complexes),
        model: found.model.map(ModelOut::from),
        bic: found.tried[found.order].bic,
        tried: found
            .tried
            .into_iter()
            .map(|t| TriedOut { order: t.order, loss: t.loss, bic: t.bic, why: t.why })
            .collect(),
        colour: found.colour,
        N: found.N,
        loss: found.loss,
        status: found.status.as_str(),
        t: array(py, found.rows.0),
        y: array(py, found.rows.1),
        curve_band: (array(py, low), array(py, high)),
        curve: array(py, found.curve.0),
        curve_sd: array(py, found.curve.1),
        parts: matrix(py, parts, points)?,
        parts_band: (matrix(py, parts_low, points)?, matrix(py, parts_high, points)?),
        parts_t: array(py, found.parts.t),
        rows: matrix(py, rec.row_ranges().concat(), 2)?,
        notes: notes(&found.notes),
    })
}

/// `K, T, L` from the areas under a step response.
#[pyfunction]
fn areas(
    py: Python<'_>,
    rec: RecordIn<'_>,
    step_at: Option<f64>,
    limits: LimitsIn,
) -> Outcome<(f64, f64, f64)> {
    let limits = limits.into();
    let record = rec.view_of_any_stamps(&limits)?;
    let model = py.detach(|| batch::areas(&record, step_at, &limits))?;
    Ok((model.K, model.T, model.L))
}

#[pyfunction]
fn step_modes<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    order: Option<usize>,
    max_order: usize,
    step_at: Option<f64>,
    gain: Option<f64>,
    limits: LimitsIn,
) -> Outcome<StepModesOut<'py>> {
    let options = StepModesOptions { order, max_order, step_at, gain };
    let limits = limits.into();
    let record = rec.view_of_any_stamps(&limits)?;
    let found = py.detach(|| batch::step_modes(&record, &options, &limits))?;
    Ok(out(py, &record, found)?)
}

/// The dict behind `plantune.estimate.IdtCriterion(**d)`.
#[derive(IntoPyObject)]
struct CriterionOut<'py> {
    order: usize,
    lag: usize,
    poles: Bound<'py, PyArray1<Complex64>>,
    level: f64,
    gain: Option<f64>,
    numerator: Option<Array<'py>>,
    zeros: Option<Bound<'py, PyArray1<Complex64>>>,
    rms: f64,
    digits: f64,
    tried: Vec<(usize, Option<(usize, f64)>)>,
    rows: (i64, i64),
    notes: Vec<NoteOut>,
}

/// Poles by criterion (15) of source 003.
#[pyfunction]
#[expect(clippy::too_many_arguments)]
fn idt_criterion<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    order: Option<usize>,
    max_order: usize,
    step_at: Option<f64>,
    gain: Option<f64>,
    lag: Option<usize>,
    eps: f64,
    limits: LimitsIn,
) -> Outcome<CriterionOut<'py>> {
    let limits = limits.into();
    let record = rec.view_of_any_stamps(&limits)?;
    let options = StepModesOptions { order, max_order, step_at, gain };
    let found = py.detach(|| batch::idt_criterion(&record, &options, lag, eps, &limits))?;
    let complexes = |z: Vec<Complex64>| PyArray1::from_vec(py, z);
    let row = |k: usize| record.rows.map_or(k as i64, |rows| rows[k]);
    Ok(CriterionOut {
        order: found.poles.len(),
        lag: found.lag,
        poles: complexes(found.poles),
        level: found.level,
        gain: found.gain,
        zeros: found.numerator.as_ref().map(|_| complexes(found.zeros)),
        numerator: found.numerator.map(|n| array(py, n)),
        rms: found.rms,
        digits: found.digits,
        tried: found.tried,
        rows: (row(found.rows.0), row(found.rows.1)),
        notes: notes(&found.notes),
    })
}
