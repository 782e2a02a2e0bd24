//! Signals.

use std::ops::Range;

use numpy::{
    AllowTypeChange, Complex64, PyArray1, PyArrayLike1, PyReadonlyArray1, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use plantune_core::signal::{self, Band, Filter, Marks, Phases, Sos, Sweep};
use plantune_core::{Error, Limits, Record};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::note::{NoteOut, notes};
use crate::values::{Array, LimitsIn, Matrix, RecordIn, array, matrix};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(prbs, m)?)?;
    m.add_function(wrap_pyfunction!(register_bits, m)?)?;
    m.add_function(wrap_pyfunction!(gbn, m)?)?;
    m.add_function(wrap_pyfunction!(multisine, m)?)?;
    m.add_function(wrap_pyfunction!(chirp, m)?)?;
    m.add_function(wrap_pyfunction!(staircase, m)?)?;
    m.add_function(wrap_pyfunction!(crest_factor, m)?)?;
    m.add_function(wrap_pyfunction!(drive, m)?)?;
    m.add_function(wrap_pyfunction!(envelope, m)?)?;
    m.add_function(wrap_pyfunction!(uniform_step, m)?)?;
    m.add_function(wrap_pyfunction!(steps, m)?)?;
    m.add_function(wrap_pyfunction!(resample, m)?)?;
    m.add_function(wrap_pyfunction!(decimate, m)?)?;
    m.add_function(wrap_pyfunction!(has_no_level, m)?)?;
    m.add_function(wrap_pyfunction!(offset_steps, m)?)?;
    m.add_function(wrap_pyfunction!(remove_lines, m)?)?;
    m.add_function(wrap_pyfunction!(without_lines, m)?)?;
    m.add_function(wrap_pyfunction!(without_steps, m)?)?;
    m.add_function(wrap_pyfunction!(remove_means, m)?)?;
    m.add_function(wrap_pyfunction!(without_levels, m)?)?;
    m.add_function(wrap_pyfunction!(smooth, m)?)?;
    m.add_function(wrap_pyfunction!(prefilter, m)?)?;
    m.add_function(wrap_pyfunction!(stretches, m)?)?;
    m.add_class::<Butterworth>()
}

/// Anything that holds numbers `(N,)`.
type Numbers<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;

/// The numbers of an optional array.
fn optional<'a>(x: &'a Option<PyReadonlyArray2<'_, f64>>) -> PyResult<Option<&'a [f64]>> {
    Ok(x.as_ref().map(|x| x.as_slice()).transpose()?)
}

#[pyfunction]
fn prbs(py: Python<'_>, n: usize, hold: usize, bits: u32, seed: u64) -> Outcome<Array<'_>> {
    Ok(array(py, signal::prbs(n, hold, bits, seed)?))
}

/// Fewest bits with which a PRBS does not repeat.
#[pyfunction]
fn register_bits(n: usize, hold: usize) -> u32 {
    signal::register_bits(n, hold)
}

#[pyfunction]
fn gbn(py: Python<'_>, n: usize, hold: f64, least: usize, seed: u64) -> Outcome<Array<'_>> {
    Ok(array(py, signal::gbn(n, hold, least, seed)?))
}

/// Random phases with a seed, Schroeder's without.
#[pyfunction]
fn multisine(
    py: Python<'_>,
    n: usize,
    period: usize,
    band: (f64, f64),
    Ts: f64,
    seed: Option<u64>,
) -> Outcome<Array<'_>> {
    let phases = seed.map_or(Phases::Schroeder, Phases::Random);
    Ok(array(py, signal::multisine(n, period, band, Ts, phases)?))
}

#[pyfunction]
fn chirp(py: Python<'_>, n: usize, Ts: f64, band: (f64, f64), logarithmic: bool) -> Outcome<Array<'_>> {
    let sweep = if logarithmic { Sweep::Logarithmic } else { Sweep::Linear };
    Ok(array(py, signal::chirp(n, Ts, band, sweep)?))
}

#[pyfunction]
fn staircase(py: Python<'_>, levels: Vec<f64>, hold: usize) -> Outcome<Array<'_>> {
    Ok(array(py, signal::staircase(&levels, hold)?))
}

/// Peak over root mean square.
#[pyfunction]
fn crest_factor(u: Numbers<'_>) -> Outcome<f64> {
    Ok(signal::crest_factor(u.as_slice().map_err(PyErr::from)?)?)
}

/// A periodic test input.
#[pyfunction]
fn drive<'py>(py: Python<'py>, kind: &str, n: usize, period: usize) -> Outcome<Array<'py>> {
    Ok(array(py, signal::drive(kind, n, period)?))
}

/// Rows worth drawing.
#[pyfunction]
fn envelope<'py>(
    py: Python<'py>,
    y: PyReadonlyArray1<'py, f64>,
    start: usize,
    end: usize,
    buckets: usize,
) -> Outcome<Bound<'py, PyArray1<usize>>> {
    let rows = signal::envelope(y.as_slice().map_err(PyErr::from)?, start..end, buckets);
    Ok(PyArray1::from_vec(py, rows))
}

#[pyfunction]
fn uniform_step(t: PyReadonlyArray1<'_, f64>, limits: LimitsIn) -> Outcome<f64> {
    Ok(signal::uniform_step(t.as_slice().map_err(PyErr::from)?, &limits.into())?)
}

/// The dict behind `plantune.inspection.Stamps(**d)`.
#[derive(IntoPyObject)]
struct StepsOut {
    step: f64,
    p1: f64,
    p99: f64,
    gaps: usize,
    back: usize,
}

/// What the steps between stamps look like; none of fewer than two.
#[pyfunction]
fn steps(t: PyReadonlyArray1<'_, f64>) -> Outcome<Option<StepsOut>> {
    let found = signal::steps(t.as_slice().map_err(PyErr::from)?);
    Ok(found.map(|s| StepsOut { step: s.step, p1: s.p1, p99: s.p99, gaps: s.gaps, back: s.back }))
}

/// Columns, starts and original rows on the new grid.
type ResampledOut<'py> = (Array<'py>, Matrix<'py>, Vec<usize>, Bound<'py, PyArray1<i64>>);

#[pyfunction]
fn resample<'py>(
    py: Python<'py>,
    t: PyReadonlyArray1<'py, f64>,
    x: PyReadonlyArray2<'py, f64>,
    held: Vec<bool>,
    Ts: f64,
) -> Outcome<ResampledOut<'py>> {
    let (t, x) = (t.as_slice().map_err(PyErr::from)?, x.as_slice().map_err(PyErr::from)?);
    let out = signal::resample(t, x, &held, Ts)?;
    let x = matrix(py, out.x, held.len())?;
    Ok((array(py, out.t), x, out.starts, PyArray1::from_vec(py, out.rows)))
}

/// What a filter remembers.
#[derive(IntoPyObject)]
struct MarksOut {
    count: usize,
    left: f64,
    notes: Vec<NoteOut>,
}

impl From<&Marks> for MarksOut {
    fn from(marks: &Marks) -> Self {
        MarksOut { count: marks.count, left: marks.left, notes: notes(&marks.notes) }
    }
}

#[derive(IntoPyObject)]
struct DecimatedOut<'py> {
    u: Matrix<'py>,
    y: Matrix<'py>,
    further: Matrix<'py>,
    valid: Matrix<'py, bool>,
    starts: Vec<usize>,
    rows: Bound<'py, PyArray1<usize>>,
    after: Array<'py>,
    left_out: usize,
    marks: MarksOut,
}

#[pyfunction]
fn decimate<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    further: PyReadonlyArray2<'py, f64>,
    held: Vec<bool>,
    Ts: f64,
    limits: LimitsIn,
) -> Outcome<DecimatedOut<'py>> {
    let limits: Limits = limits.into();
    let rec = rec.view(&limits)?;
    let further = further.as_slice().map_err(PyErr::from)?;
    let out = py.detach(|| signal::decimate(&rec, further, &held, Ts, &limits))?;
    Ok(DecimatedOut {
        u: matrix(py, out.u, rec.nu)?,
        y: matrix(py, out.y, rec.ny)?,
        further: matrix(py, out.further, held.len())?,
        valid: matrix(py, out.valid, rec.ny)?,
        starts: out.starts,
        rows: PyArray1::from_vec(py, out.rows),
        after: array(py, out.after),
        left_out: out.left_out,
        marks: MarksOut::from(&out.marks),
    })
}

/// Whether no column of a record has a level left.
#[pyfunction]
fn has_no_level(rec: RecordIn<'_>, limits: LimitsIn) -> Outcome<bool> {
    Ok(signal::has_no_level(&rec.view_of_any_stamps(&limits.into())?))
}

/// `x` without the mean of each column over the rows that count, and these means.
#[pyfunction]
fn remove_means<'py>(
    py: Python<'py>,
    x: PyReadonlyArray2<'py, f64>,
    valid: PyReadonlyArray2<'py, bool>,
) -> Outcome<(Matrix<'py>, Vec<f64>)> {
    let width = x.shape()[1];
    let (x, valid) = (x.as_slice().map_err(PyErr::from)?, valid.as_slice().map_err(PyErr::from)?);
    let means = signal::means(x, width, |k, i| valid[k * width + i]);
    Ok((matrix(py, signal::without_levels(x, &means), width)?, means))
}

/// `x` without a level per column.
#[pyfunction]
fn without_levels<'py>(
    py: Python<'py>,
    x: PyReadonlyArray2<'py, f64>,
    levels: Vec<f64>,
) -> Outcome<Matrix<'py>> {
    let x = x.as_slice().map_err(PyErr::from)?;
    Ok(matrix(py, signal::without_levels(x, &levels), levels.len())?)
}

/// What the level of a signal does, as the dict behind `plantune.analyze.OffsetSteps`.
#[derive(IntoPyObject)]
struct OffsetStepsOut<'py> {
    at: Vec<usize>,
    sizes: Array<'py>,
    sd: Array<'py>,
    levels: Array<'py>,
    ratio: f64,
    slope: Option<f64>,
}

#[pyfunction]
fn offset_steps<'py>(py: Python<'py>, x: PyReadonlyArray1<'py, f64>) -> Outcome<OffsetStepsOut<'py>> {
    let x = x.as_slice().map_err(PyErr::from)?;
    let found = py.detach(|| signal::offset_steps(x));
    Ok(OffsetStepsOut {
        at: found.at,
        sizes: array(py, found.sizes),
        sd: array(py, found.sd),
        levels: array(py, found.levels),
        ratio: found.ratio,
        slope: found.slope,
    })
}

/// Level, slope and middle time of a line.
type LineOut = (f64, f64, f64);

/// `x` without the line of each column over its rows that count, and level and slope of each.
#[pyfunction]
fn remove_lines<'py>(
    py: Python<'py>,
    x: PyReadonlyArray2<'py, f64>,
    t: PyReadonlyArray1<'py, f64>,
    valid: PyReadonlyArray2<'py, bool>,
) -> Outcome<(Matrix<'py>, Vec<LineOut>)> {
    let width = x.shape()[1];
    let (x, valid) = (x.as_slice().map_err(PyErr::from)?, valid.as_slice().map_err(PyErr::from)?);
    let t = t.as_slice().map_err(PyErr::from)?;
    let lines = signal::lines(x, width, t, |k, i| valid[k * width + i]);
    let said = lines.iter().map(|l| (l.level, l.slope, l.middle)).collect();
    Ok((matrix(py, signal::without_lines(x, t, &lines), width)?, said))
}

/// `x (N, width)` without the given lines.
#[pyfunction]
fn without_lines<'py>(
    py: Python<'py>,
    x: PyReadonlyArray2<'py, f64>,
    t: PyReadonlyArray1<'py, f64>,
    lines: Vec<LineOut>,
) -> Outcome<Matrix<'py>> {
    let (x, t) = (x.as_slice().map_err(PyErr::from)?, t.as_slice().map_err(PyErr::from)?);
    let lines: Vec<signal::Line> =
        lines.into_iter().map(|(level, slope, middle)| signal::Line { level, slope, middle }).collect();
    Ok(matrix(py, signal::without_lines(x, t, &lines), lines.len())?)
}

/// A signal without steps of these sizes at these rows.
#[pyfunction]
fn without_steps<'py>(
    py: Python<'py>,
    x: PyReadonlyArray1<'py, f64>,
    at: Vec<usize>,
    sizes: Vec<f64>,
) -> Outcome<Array<'py>> {
    Ok(array(py, signal::without_steps(x.as_slice().map_err(PyErr::from)?, &at, &sizes)))
}

/// A range of rows as Python's slices have it.
fn bounds(ranges: Vec<Range<usize>>) -> Vec<(usize, usize)> {
    ranges.into_iter().map(|r| (r.start, r.end)).collect()
}

/// Fields of `plantune.Record` that a filter changes.
#[derive(IntoPyObject)]
struct SignalsOut<'py> {
    u: Matrix<'py>,
    y: Matrix<'py>,
    r: Option<Matrix<'py>>,
    valid: Matrix<'py, bool>,
}

impl<'py> SignalsOut<'py> {
    fn new(
        py: Python<'py>,
        rec: &Record,
        (u, y): (Vec<f64>, Vec<f64>),
        r: Option<Vec<f64>>,
        valid: Vec<bool>,
    ) -> PyResult<Self> {
        Ok(SignalsOut {
            u: matrix(py, u, rec.nu)?,
            y: matrix(py, y, rec.ny)?,
            r: r.map(|r| matrix(py, r, rec.ny)).transpose()?,
            valid: matrix(py, valid, rec.ny)?,
        })
    }
}

/// Signals smoothed, and the ranges of rows left.
type SmoothedOut<'py> = (SignalsOut<'py>, Vec<(usize, usize)>);

#[pyfunction]
fn smooth<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    r: Option<PyReadonlyArray2<'py, f64>>,
    both: bool,
    limits: LimitsIn,
) -> Outcome<SmoothedOut<'py>> {
    let rec = rec.view(&limits.into())?;
    let out = signal::smooth(&rec, optional(&r)?, both)?;
    Ok((SignalsOut::new(py, &rec, (out.u, out.y), out.r, out.valid)?, bounds(out.rows)))
}

#[pyfunction]
fn prefilter<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    r: Option<PyReadonlyArray2<'py, f64>>,
    design: PyRef<'py, Butterworth>,
    limits: LimitsIn,
) -> Outcome<(SignalsOut<'py>, MarksOut)> {
    let limits: Limits = limits.into();
    let rec = rec.view(&limits)?;
    let (r, sos) = (optional(&r)?, &design.sos);
    let out = py.detach(|| signal::prefilter(&rec, r, sos, &limits))?;
    let marks = MarksOut::from(&out.marks);
    Ok((SignalsOut::new(py, &rec, (out.u, out.y), out.r, out.marks.valid)?, marks))
}

#[derive(IntoPyObject)]
struct StretchesOut {
    kept: Vec<(usize, usize)>,
    dropped: usize,
    dropped_rows: usize,
    needed: usize,
}

#[pyfunction]
#[allow(clippy::too_many_arguments)] // one per field of the question
fn stretches(
    rec: RecordIn<'_>,
    r: Option<PyReadonlyArray2<'_, f64>>,
    T_max: f64,
    L_max: f64,
    tolerance: f64,
    steady: bool,
    limits: LimitsIn,
) -> Outcome<StretchesOut> {
    let rec = rec.view(&limits.into())?;
    let out = signal::stretches(&rec, optional(&r)?, T_max, L_max, tolerance, steady)?;
    Ok(StretchesOut {
        kept: bounds(out.kept),
        dropped: out.dropped,
        dropped_rows: out.dropped_rows,
        needed: out.needed,
    })
}

/// Cut-offs as they are given: one, or a pair.
#[derive(Clone, Copy, FromPyObject, IntoPyObject)]
enum Cutoff {
    Pair([f64; 2]),
    One(f64),
}

/// A Butterworth filter: its design, and the filter of one signal on its way.
///
/// Poles `e^(j pi (2k + n - 1) / (2n))`, pre-warped cut-off `2 tan(w Ts / 2)`, bilinear map, in
/// second-order sections.  Source 001, (3.5-20), (3.5-28), (3.5-31), (3.7-6).
///
/// Parameters
/// ----------
/// band : "low", "high" or "band"
///     What passes.
/// order : int
///     Of the prototype, 1 to 20; a band-pass has twice as many poles.
/// w : float, or a pair for "band"
///     Cut-off, rad/s: the gain there is 0.7071.
/// Ts : float
///     Sample time, seconds.
///
/// Attributes
/// ----------
/// sos : array (sections, 6)
///     `b0 b1 b2 1 a1 a2` of each section.
/// prototype : array (order,) of complex
///     Poles at a cut-off of 1 rad/s.
/// prewarped : float or pair
///     Cut-off in the plane of the bilinear map.
/// poles : array of complex
///     In z.
/// settling : float
///     Seconds until the step response stays within 2 % of its own peak from its end, interpolated.
///
/// Raises
/// ------
/// NotIdentifiable
///     A cut-off at or above the Nyquist frequency (M10).
/// UsageError
///     An argument out of its range (U01).
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> lowpass = pt.prep.Butterworth("low", order=5, w=20.0, Ts=0.02)
/// >>> lowpass.step(583.451), lowpass.run([583.451, 583.451]).tolist()
/// (583.451, [583.451, 583.451])
/// >>> print(f"{abs(lowpass.freqresp([20.0])[0]):.4f}, {lowpass.prewarped:.4f}")
/// 0.7071, 0.4054
#[pyclass(module = "plantune._core")]
pub struct Butterworth {
    band: String,
    order: usize,
    w: Cutoff,
    Ts: f64,
    sos: Sos,
    filter: Filter,
}

#[pymethods]
impl Butterworth {
    #[new]
    fn new(band: String, order: &Bound<'_, PyAny>, w: &Bound<'_, PyAny>, Ts: f64) -> Outcome<Self> {
        let needed = "a whole number from 1 to 20";
        let order = order.extract().map_err(|_| Error::argument("order", order, needed))?;
        let w = w.extract().map_err(|_| Error::argument("w", w, "a number of rad/s, or a pair"))?;
        let design = match (band.as_str(), w) {
            ("low", Cutoff::One(w)) => Band::Low(w),
            ("high", Cutoff::One(w)) => Band::High(w),
            ("band", Cutoff::Pair([low, high])) => Band::Pass(low, high),
            ("low" | "high", _) => return Err(Error::argument("w", "a pair", "one number of rad/s").into()),
            ("band", _) => return Err(Error::argument("w", "one number", "a pair of rad/s").into()),
            _ => return Err(Error::argument("band", &band, "\"low\", \"high\" or \"band\"").into()),
        };
        let sos = signal::butter(order, design, Ts)?;
        let filter = Filter::new(&sos);
        Ok(Butterworth { band, order, w, Ts, sos, filter })
    }

    /// Filter the next sample; the first one is taken as a level that has always been there.
    fn step(&mut self, x: f64) -> Outcome<f64> {
        Ok(self.filter.step(x)?)
    }

    /// Filter samples (N,) one after the other: `step` in a loop, to the last bit.
    fn run<'py>(&mut self, py: Python<'py>, x: Numbers<'py>) -> Outcome<Array<'py>> {
        let mut x = x.as_array().to_vec();
        self.filter.run(&mut x)?;
        Ok(array(py, x))
    }

    /// Frequency response at `w` (N,), rad/s.
    fn freqresp<'py>(&self, py: Python<'py>, w: Numbers<'py>) -> Bound<'py, PyArray1<Complex64>> {
        PyArray1::from_vec(py, w.as_array().iter().map(|w| self.sos.at(w * self.Ts)).collect())
    }

    /// Response to a unit step at row 0, `n` rows.
    fn step_response<'py>(&self, py: Python<'py>, n: usize) -> Outcome<Array<'py>> {
        Ok(array(py, self.sos.step_response(n)?))
    }

    /// Rows until what was before row 0 is forgotten to this share: until `sum over j > k of |h(j)|`
    /// is no more than it.
    fn forgets(&self, share: f64) -> usize {
        self.sos.forgets(share)
    }

    #[getter]
    fn sos<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        let rows = self.sos.sections.iter().flat_map(|s| [s.b[0], s.b[1], s.b[2], 1.0, s.a[0], s.a[1]]);
        matrix(py, rows.collect(), 6)
    }

    #[getter]
    fn prototype<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<Complex64>> {
        PyArray1::from_vec(py, signal::prototype(self.order))
    }

    #[getter]
    fn prewarped(&self) -> Cutoff {
        match self.w {
            Cutoff::One(w) => Cutoff::One(signal::prewarped(w, self.Ts)),
            Cutoff::Pair(pair) => Cutoff::Pair(pair.map(|w| signal::prewarped(w, self.Ts))),
        }
    }

    #[getter]
    fn poles<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<Complex64>> {
        PyArray1::from_vec(py, self.sos.poles())
    }

    #[getter]
    fn settling(&self) -> Outcome<f64> {
        Ok(self.sos.settling(0.02)? * self.Ts)
    }

    fn __getnewargs__(&self) -> (String, usize, Cutoff, f64) {
        (self.band.clone(), self.order, self.w, self.Ts)
    }

    fn __getstate__(&self) -> (Option<f64>, Vec<[f64; 2]>) {
        let (level, state) = self.filter.state();
        (level, state.to_vec())
    }

    fn __setstate__(&mut self, state: (Option<f64>, Vec<[f64; 2]>)) -> Outcome<()> {
        Ok(self.filter.resume(state.0, state.1)?)
    }

    fn __repr__(&self) -> String {
        let w = match self.w {
            Cutoff::One(w) => format!("{w}"),
            Cutoff::Pair([a, b]) => format!("({a}, {b})"),
        };
        format!("Butterworth({:?}, order={}, w={w}, Ts={})", self.band, self.order, self.Ts)
    }
}
