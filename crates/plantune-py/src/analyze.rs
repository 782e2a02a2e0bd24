//! Looks at a record.

use plantune_core::analyze::{self, Actuators, Ends, ImpulseOptions, Kernel, delay_scan};
use plantune_core::excitation::{check_input_motion, excitation_order};
use plantune_core::model::Model;
use plantune_core::{Error, Limits};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::model::ModelOut;
use crate::note::{NoteOut, notes};
use crate::values::{Array, LimitsIn, RecordIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(health, m)?)?;
    m.add_function(wrap_pyfunction!(informative, m)?)?;
    m.add_function(wrap_pyfunction!(exclude, m)?)?;
    m.add_function(wrap_pyfunction!(compression, m)?)?;
    m.add_function(wrap_pyfunction!(spikes, m)?)?;
    m.add_function(wrap_pyfunction!(excitation_orders, m)?)?;
    m.add_function(wrap_pyfunction!(input_moves, m)?)?;
    m.add_function(wrap_pyfunction!(impulse, m)?)?;
    m.add_function(wrap_pyfunction!(xcorr, m)?)?;
    m.add_function(wrap_pyfunction!(delay_evidence, m)?)?;
    m.add_function(wrap_pyfunction!(delay, m)?)
}

/// The dict behind `plantune.analyze.DelayScan(**d)`.
#[derive(IntoPyObject)]
struct DelayOut<'py> {
    nk: usize,
    order: usize,
    candidates: Vec<usize>,
    loss: Array<'py>,
    orders: Vec<usize>,
    runner_up: usize,
    N: usize,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn delay<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    input: usize,
    nk: (usize, usize),
    limits: LimitsIn,
) -> Outcome<DelayOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let scan = py.detach(|| delay_scan(&record, input, nk, &limits))?;
    Ok(delay_out(py, scan))
}

fn delay_out(py: Python<'_>, scan: analyze::DelayScan) -> DelayOut<'_> {
    DelayOut {
        nk: scan.nk,
        order: scan.order,
        candidates: scan.candidates,
        loss: array(py, scan.loss),
        orders: scan.orders,
        runner_up: scan.runner_up,
        N: scan.N,
        notes: notes(&scan.notes),
    }
}

/// The dict behind `plantune.analyze.Health(**d)`; rows are those of the file.
#[derive(IntoPyObject)]
struct HealthOut {
    stuck: Vec<(String, usize, usize)>,
    spikes: Vec<(String, usize, f64)>,
    sentinels: Vec<(String, f64, usize)>,
    saturated: Vec<(String, usize, usize)>,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn health(py: Python<'_>, rec: RecordIn<'_>, limits: LimitsIn) -> Outcome<HealthOut> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let found = py.detach(|| analyze::health(&record, &limits));
    let name = |output: usize| record.names[record.nu + output].clone();
    let row = |k: usize| record.place(0, k).row.unwrap_or(k);
    let stretch = |s: &analyze::Stretch| (name(s.output), row(s.rows.start), row(s.rows.end - 1));
    let spike = |s: &analyze::Spike| (name(s.output), row(s.row), s.size);
    let at_limit =
        |s: &analyze::Saturated| (record.names[s.input].clone(), row(s.rows.start), row(s.rows.end - 1));
    let sentinel = |s: &analyze::Sentinel| (record.names[s.column].clone(), s.value, s.count);
    Ok(HealthOut {
        stuck: found.stuck.iter().map(stretch).collect(),
        spikes: found.spikes.iter().map(spike).collect(),
        sentinels: found.sentinels.iter().map(sentinel).collect(),
        saturated: found.saturated.iter().map(at_limit).collect(),
        notes: notes(&found.notes),
    })
}

/// The dict behind `plantune.prep.exclude`; `kept` are rows of the record.
#[derive(IntoPyObject)]
struct ExcludedOut {
    kept: Vec<(usize, usize)>,
    log: Vec<String>,
    notes: Vec<NoteOut>,
}

/// The record without stuck and saturated rows; `ends` per input, guessed where they are asked for so.
#[pyfunction]
#[pyo3(signature = (rec, ends, guess, stuck, limits))]
fn exclude(
    py: Python<'_>,
    rec: RecordIn<'_>,
    ends: Option<Vec<Ends>>,
    guess: bool,
    stuck: bool,
    limits: LimitsIn,
) -> Outcome<ExcludedOut> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let actuators = match ends {
        Some(ends) => Actuators::Known(ends),
        None if guess => Actuators::Guessed,
        None => Actuators::Unknown,
    };
    let out = py.detach(|| analyze::exclude(&record, &actuators, stuck, &limits))?;
    Ok(ExcludedOut {
        kept: out.kept.iter().map(|rows| (rows.start, rows.end)).collect(),
        log: out.log,
        notes: notes(&out.notes),
    })
}

/// The dict behind `plantune.analyze.OutputCompression(**d)`.
#[derive(IntoPyObject)]
struct CompressionOut {
    repeated: f64,
    in_line: f64,
    step: Option<f64>,
    refilled: Option<&'static str>,
}

/// What each output shows of a historian's compression, and the same in words.
#[pyfunction]
fn compression(
    py: Python<'_>,
    rec: RecordIn<'_>,
    keep: bool,
    limits: LimitsIn,
) -> Outcome<(Vec<CompressionOut>, Vec<NoteOut>)> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let (found, said) = py.detach(|| analyze::compressed_outputs(&record, keep));
    let out = |c: analyze::Compression| CompressionOut {
        repeated: c.repeated,
        in_line: c.in_line,
        step: c.step,
        refilled: c.refilled.map(analyze::Refilled::as_str),
    };
    Ok((found.into_iter().map(out).collect(), notes(&said)))
}

/// Row of the record and output of each spike, and the same in words.
#[pyfunction]
fn spikes(
    py: Python<'_>,
    rec: RecordIn<'_>,
    limits: LimitsIn,
) -> Outcome<(Vec<usize>, Vec<usize>, Vec<NoteOut>)> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let found = py.detach(|| analyze::spikes(&record, &limits));
    let said = notes(&analyze::spikes_notes(&record, &found, &limits));
    Ok((found.iter().map(|s| s.row).collect(), found.iter().map(|s| s.output).collect(), said))
}

/// Parameters of a linear model that each input supports, up to `most`.
#[pyfunction]
fn excitation_orders(rec: RecordIn<'_>, most: usize, limits: LimitsIn) -> Outcome<Vec<usize>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    Ok((0..record.nu).map(|i| excitation_order(&record, i, most, limits.X02)).collect())
}

/// Whether every input moves (X01).
#[pyfunction]
fn input_moves(rec: RecordIn<'_>, limits: LimitsIn) -> Outcome<bool> {
    let limits: Limits = limits.into();
    Ok(check_input_motion(&rec.view(&limits)?, &limits).is_ok())
}

/// A stretch as the dict behind `plantune.analyze.InformativeStretch(**d)`; rows are those of the record.
#[derive(IntoPyObject)]
struct InformativeStretchOut {
    first: usize,
    stop: usize,
    F: f64,
    p: f64,
    feedback: bool,
    K: f64,
    sd: [f64; 3],
    fit: f64,
    score: f64,
    agrees: bool,
    identifiable: bool,
}

/// The dict behind `plantune.analyze.Informative(**d)`.
#[derive(IntoPyObject)]
struct InformativeOut<'py> {
    stretches: Vec<InformativeStretchOut>,
    plant: Option<ModelOut>,
    firsts: Vec<usize>,
    stops: Vec<usize>,
    condition: Array<'py>,
    F: Array<'py>,
    p: Array<'py>,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn informative<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    window: usize,
    input: usize,
    output: usize,
    limits: LimitsIn,
) -> Outcome<InformativeOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let options = analyze::InformativeOptions { window, input, output };
    let found = py.detach(|| analyze::informative(&record, &options, &limits))?;
    let windows = &found.windows;
    let of = |value: fn(&analyze::Window) -> f64| array(py, windows.iter().map(value).collect());
    let stretch = |s: &analyze::InformativeStretch| InformativeStretchOut {
        first: s.rows.start,
        stop: s.rows.end,
        F: s.F,
        p: s.p,
        feedback: s.has_feedback(),
        K: s.information.map_or(f64::NAN, |i| i.K),
        sd: s.information.map_or([f64::INFINITY; 3], |i| i.sd),
        fit: s.information.map_or(f64::NAN, |i| i.fit),
        score: s.score,
        agrees: s.agrees,
        identifiable: s.identifiable(),
    };
    Ok(InformativeOut {
        stretches: found.stretches.iter().map(stretch).collect(),
        plant: found.plant.map(|plant| Model::Process(plant.into()).into()),
        firsts: windows.iter().map(|w| w.rows.start).collect(),
        stops: windows.iter().map(|w| w.rows.end).collect(),
        condition: of(|w| w.condition),
        F: of(|w| w.F),
        p: of(|w| w.p),
        notes: notes(&found.notes),
    })
}

/// The dict behind `plantune.analyze.ImpulseResponse(**d)`; one array per input.
#[derive(IntoPyObject)]
struct ImpulseOut<'py> {
    first: usize,
    g: Vec<Array<'py>>,
    sd: Vec<Array<'py>>,
    P: Vec<Array<'py>>,
    step: Vec<Array<'py>>,
    step_sd: Vec<Array<'py>>,
    nk: Vec<usize>,
    weights: Vec<Array<'py>>,
    c: Vec<Option<f64>>,
    lam: Vec<Option<f64>>,
    rho: Vec<Option<f64>>,
    noise_sd: f64,
    D: Array<'py>,
    evidence: Option<f64>,
    N: usize,
    notes: Vec<NoteOut>,
}

/// `options` are `n, kernel, direct, nk, whiten`.
#[pyfunction]
fn impulse<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    output: usize,
    options: (usize, Option<String>, bool, Option<usize>, bool),
    limits: LimitsIn,
) -> Outcome<ImpulseOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let (n, kernel, direct, nk, whiten) = options;
    let kernel = kernel.as_deref().map(self::kernel).transpose()?;
    let options = ImpulseOptions { n, kernel, first: usize::from(!direct), nk, whiten };
    let found = py.detach(|| analyze::impulse(&record, output, &options, &limits))?;
    Ok(impulse_out(py, found))
}

fn impulse_out(py: Python<'_>, found: analyze::ImpulseResponse) -> ImpulseOut<'_> {
    let each = |of: fn(&analyze::PathResponse) -> &[f64]| -> Vec<Array<'_>> {
        found.responses.iter().map(|r| array(py, of(r).to_vec())).collect()
    };
    let number = |of: fn(&analyze::PathResponse) -> Option<f64>| found.responses.iter().map(of).collect();
    ImpulseOut {
        first: found.first,
        g: each(|r| &r.g),
        sd: each(|r| &r.sd),
        P: each(|r| &r.P),
        step: each(|r| &r.step),
        step_sd: each(|r| &r.step_sd),
        nk: found.responses.iter().map(|r| r.nk).collect(),
        weights: each(|r| &r.weights),
        c: number(|r| r.c),
        lam: number(|r| r.lam),
        rho: number(|r| r.rho),
        noise_sd: found.noise_sd,
        evidence: found.evidence,
        N: found.N,
        notes: notes(&found.notes),
        D: array(py, found.D),
    }
}

fn kernel(name: &str) -> Outcome<Kernel> {
    let all = [Kernel::Tc, Kernel::Dc, Kernel::Ss];
    let found = all.into_iter().find(|kernel| kernel.as_str() == name);
    Ok(found.ok_or_else(|| Error::argument("kernel", format!("'{name}'"), "'tc', 'dc', 'ss' or None"))?)
}

/// The dict behind `plantune.analyze.Correlation(**d)`.
#[derive(IntoPyObject)]
struct CorrelationOut<'py> {
    lags: Vec<i64>,
    raw: Array<'py>,
    raw_band: f64,
    prewhitened: Array<'py>,
    band: f64,
    A: Array<'py>,
    peak: usize,
    first: Option<usize>,
    feedback: Option<i64>,
    N: usize,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn xcorr<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    columns: (usize, usize),
    lags: usize,
    limits: LimitsIn,
) -> Outcome<CorrelationOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let found = py.detach(|| analyze::xcorr(&record, columns, lags, &limits))?;
    Ok(correlation_out(py, found))
}

fn correlation_out(py: Python<'_>, found: analyze::Correlation) -> CorrelationOut<'_> {
    CorrelationOut {
        lags: found.lags,
        raw: array(py, found.raw),
        raw_band: found.raw_band,
        prewhitened: array(py, found.prewhitened),
        band: found.band,
        A: array(py, found.A),
        peak: found.peak,
        first: found.first,
        feedback: found.feedback,
        N: found.N,
        notes: notes(&found.notes),
    }
}

/// The dict behind `plantune.analyze.DelayEvidence`.
#[derive(IntoPyObject)]
struct EvidenceOut<'py> {
    nk: usize,
    weight: f64,
    trusted: &'static str,
    likely: Vec<usize>,
    correlation: CorrelationOut<'py>,
    arx: DelayOut<'py>,
    oe: OeScanOut<'py>,
    impulse: ImpulseOut<'py>,
    feedback: bool,
    notes: Vec<NoteOut>,
}

/// The dict behind `plantune.analyze.OEScan(**d)`.
#[derive(IntoPyObject)]
struct OeScanOut<'py> {
    candidates: Vec<usize>,
    loss: Array<'py>,
    orders: Vec<usize>,
    weights: Array<'py>,
    N: usize,
}

#[pyfunction]
fn delay_evidence<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    input: usize,
    nk: (usize, usize),
    limits: LimitsIn,
) -> Outcome<EvidenceOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let found = py.detach(|| analyze::delay_evidence(&record, input, nk, &limits))?;
    Ok(EvidenceOut {
        nk: found.nk,
        weight: found.weight,
        trusted: found.trusted,
        likely: found.likely,
        correlation: correlation_out(py, found.correlation),
        arx: delay_out(py, found.arx),
        oe: OeScanOut {
            candidates: found.oe.candidates,
            loss: array(py, found.oe.loss),
            orders: found.oe.orders,
            weights: array(py, found.oe.weights),
            N: found.oe.N,
        },
        impulse: impulse_out(py, found.impulse),
        feedback: found.feedback,
        notes: notes(&found.notes),
    })
}
