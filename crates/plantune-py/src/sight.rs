//! Noise, spectra, frequency responses and excitation of a record.

use numpy::{Complex64, PyArray1};
use plantune_core::Limits;
use plantune_core::analyze::{self, Column, Density, DensityOptions, Moments, NoiseOptions, Way};
use plantune_core::signal::Window;
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::note::{NoteOut, notes};
use crate::values::{Array, LimitsIn, RecordIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(noise, m)?)?;
    m.add_function(wrap_pyfunction!(spectrum, m)?)?;
    m.add_function(wrap_pyfunction!(response, m)?)?;
    m.add_function(wrap_pyfunction!(coherence, m)?)?;
    m.add_function(wrap_pyfunction!(excitation, m)?)
}

/// How a density is averaged: rows of a stretch, overlap, name of the window.
type Averaging = (Option<usize>, f64, String);

fn averaging((n, overlap, window): Averaging) -> Outcome<DensityOptions> {
    Ok(DensityOptions { n, overlap, window: Window::named(&window)? })
}

/// The dict behind `plantune.analyze.Spectrum(**d)`.
#[derive(IntoPyObject)]
struct SpectrumOut<'py> {
    w: Array<'py>,
    P: Array<'py>,
    low: Array<'py>,
    high: Array<'py>,
    n: usize,
    averaged: usize,
    dof: f64,
}

fn density_out<'py>(py: Python<'py>, d: Density) -> SpectrumOut<'py> {
    SpectrumOut {
        w: array(py, d.w),
        P: array(py, d.P),
        low: array(py, d.low),
        high: array(py, d.high),
        n: d.n,
        averaged: d.averaged,
        dof: d.dof,
    }
}

#[pyfunction]
fn spectrum<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    column: usize,
    way: Averaging,
    limits: LimitsIn,
) -> Outcome<SpectrumOut<'py>> {
    let limits: Limits = limits.into();
    let options = averaging(way)?;
    let record = rec.view(&limits)?;
    let found = py.detach(|| analyze::density(&Column::of(&record, column)?, &options))?;
    Ok(density_out(py, found))
}

/// Level and power: rows, mean, rms, variance, signal to noise in dB.
type MomentsOut = (usize, f64, f64, f64, f64);

fn moments(m: &Moments) -> MomentsOut {
    (m.N, m.mean, m.rms, m.var, m.snr)
}

#[derive(IntoPyObject)]
struct PartOut {
    first: usize,
    last: usize,
    moments: MomentsOut,
    N_mean: f64,
    N_var: f64,
    kurtosis: f64,
}

/// What `plantune.analyze.NoiseReport` is built from.
#[derive(IntoPyObject)]
struct NoiseOut<'py> {
    moments: MomentsOut,
    edges: Array<'py>,
    centres: Array<'py>,
    counts: Vec<usize>,
    density: Array<'py>,
    normal: Array<'py>,
    rule: &'static str,
    R: Array<'py>,
    band: f64,
    inside: f64,
    white: f64,
    N_mean: f64,
    memory: usize,
    periodogram: SpectrumOut<'py>,
    spectrum: SpectrumOut<'py>,
    parseval: f64,
    quantum: Option<f64>,
    parts: Vec<PartOut>,
    p_mean: Option<f64>,
    p_var: Option<f64>,
    advice: Vec<String>,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn noise<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    column: usize,
    parts: Option<usize>,
    lags: Option<usize>,
    way: Averaging,
    limits: LimitsIn,
) -> Outcome<NoiseOut<'py>> {
    let limits: Limits = limits.into();
    let options = NoiseOptions { parts, lags, density: averaging(way)? };
    let record = rec.view(&limits)?;
    let found = py.detach(|| analyze::noise(&record, column, &options, &limits))?;
    let row = |k: usize| record.place(column, k).row.unwrap_or(k);
    let part = |p: &analyze::Part| PartOut {
        first: row(p.rows.start),
        last: row(p.rows.end - 1),
        moments: moments(&p.moments),
        N_mean: p.N_mean,
        N_var: p.N_var,
        kurtosis: p.kurtosis,
    };
    let (histogram, colour) = (found.histogram, found.colour);
    Ok(NoiseOut {
        moments: moments(&found.moments),
        edges: array(py, histogram.edges),
        centres: array(py, histogram.centres),
        counts: histogram.counts,
        density: array(py, histogram.density),
        normal: array(py, histogram.normal),
        rule: histogram.rule.as_str(),
        R: array(py, colour.R),
        band: colour.band,
        inside: colour.inside,
        white: colour.white,
        N_mean: colour.N_mean,
        memory: colour.memory,
        periodogram: density_out(py, found.periodogram),
        spectrum: density_out(py, found.density),
        parseval: found.parseval,
        quantum: found.quantum,
        parts: found.comparison.parts.iter().map(part).collect(),
        p_mean: found.comparison.p_mean,
        p_var: found.comparison.p_var,
        advice: found.advice,
        notes: notes(&found.notes),
    })
}

/// `"auto"`, `"welch"`, `"bt"` or `"lines"`, with the numbers of each.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct WayIn {
    method: String,
    n: Option<usize>,
    overlap: f64,
    window: String,
    M: Option<usize>,
    half: Option<usize>,
}

impl WayIn {
    fn read(self) -> Outcome<Way> {
        let welch = DensityOptions { n: self.n, overlap: self.overlap, window: Window::named(&self.window)? };
        match self.method.as_str() {
            "auto" => Ok(Way::Auto),
            "welch" => Ok(Way::Welch(welch)),
            "bt" => Ok(Way::BlackmanTukey { M: self.M }),
            "lines" => Ok(Way::Lines { half: self.half }),
            other => Err(plantune_core::Error::argument(
                "method",
                format!("{other:?}"),
                "\"auto\", \"welch\", \"bt\" or \"lines\"",
            )
            .into()),
        }
    }
}

/// What `plantune.models.FrequencyResponse` is built from; arrays flat, (n, ny, nu) and (n, ny).
#[derive(IntoPyObject)]
struct ResponseOut<'py> {
    w: Array<'py>,
    G: Bound<'py, PyArray1<Complex64>>,
    sd: Option<Array<'py>>,
    radius: Option<Array<'py>>,
    coherence: Option<Array<'py>>,
    share: f64,
    method: String,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn response<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    way: WayIn,
    memory: Option<f64>,
    limits: LimitsIn,
) -> Outcome<ResponseOut<'py>> {
    let limits: Limits = limits.into();
    let way = way.read()?;
    let record = rec.view(&limits)?;
    let found = py.detach(|| analyze::response(&record, way, memory, &limits))?;
    Ok(ResponseOut {
        w: array(py, found.value.w),
        G: PyArray1::from_vec(py, found.value.G),
        sd: found.sd.map(|x| array(py, x)),
        radius: found.value.radius.map(|x| array(py, x)),
        coherence: found.coherence.map(|x| array(py, x)),
        share: found.share,
        method: found.way,
        notes: notes(&found.notes),
    })
}

/// The dict behind `plantune.analyze.Coherence`.
#[derive(IntoPyObject)]
struct CoherenceOut<'py> {
    w: Array<'py>,
    value: Array<'py>,
    low: Array<'py>,
    high: Array<'py>,
    multiple: Array<'py>,
    limit: f64,
    method: String,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn coherence<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    way: WayIn,
    memory: Option<f64>,
    limits: LimitsIn,
) -> Outcome<CoherenceOut<'py>> {
    let limits: Limits = limits.into();
    let way = way.read()?;
    let record = rec.view(&limits)?;
    let found = py.detach(|| analyze::coherence(&record, way, memory, &limits))?;
    Ok(CoherenceOut {
        w: array(py, found.w),
        value: array(py, found.pairs),
        low: array(py, found.low),
        high: array(py, found.high),
        multiple: array(py, found.multiple),
        limit: found.limit,
        method: found.way,
        notes: notes(&found.notes),
    })
}

/// The dict behind `plantune.analyze.InputExcitation(**d)`.
#[derive(IntoPyObject)]
struct ExcitationOut<'py> {
    name: String,
    order: usize,
    at_least: bool,
    crest: f64,
    moves: usize,
    hold: f64,
    longest_hold: f64,
    levels: Vec<(f64, f64)>,
    band: (f64, f64),
    w: Array<'py>,
    P: Array<'py>,
    advice: Vec<String>,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn excitation<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    limits: LimitsIn,
) -> Outcome<(Vec<ExcitationOut<'py>>, Option<f64>)> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let (found, memory) = py.detach(|| analyze::excitation(&record, &limits));
    let out = |e: analyze::Excitation| ExcitationOut {
        name: e.name,
        order: e.order,
        at_least: e.at_least,
        crest: e.crest,
        moves: e.moves,
        hold: e.hold.0,
        longest_hold: e.hold.1,
        levels: e.levels,
        band: e.band,
        w: array(py, e.w),
        P: array(py, e.P),
        advice: e.advice,
        notes: notes(&e.notes),
    };
    Ok((found.into_iter().map(out).collect(), memory))
}
