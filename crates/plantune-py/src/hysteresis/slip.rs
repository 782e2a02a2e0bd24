//! Elements in series: in and out, learnt sample by sample, learnt from a record.

use numpy::{AllowTypeChange, PyArrayLike1, PyReadonlyArray1, PyReadonlyArray2};
use plantune_core::hysteresis::{
    Element, LearntSlip, Model, SeriesSlip, SlipLearner, SlipSettings, identify_slip,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::{HysteresisIn, HysteresisOut, not_a_model};
use crate::error::Outcome;
use crate::note::{NoteOut, notes};
use crate::values::{Array, Frozen, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<SeriesSlipLearner>()?;
    m.add_function(wrap_pyfunction!(series_slip_identify, m)?)?;
    m.add_function(wrap_pyfunction!(series_slip_closed, m)?)?;
    m.add_function(wrap_pyfunction!(series_slip_through, m)?)
}

#[derive(FromPyObject)]
struct SeriesSlipIn<'py> {
    up: PyReadonlyArray2<'py, f64>,
    down: PyReadonlyArray2<'py, f64>,
}

/// A `SeriesSlip`, by attribute.
pub fn read(value: &Borrowed<'_, '_, PyAny>) -> PyResult<SeriesSlip> {
    let SeriesSlipIn { up, down } = value.extract()?;
    let group = |rows: PyReadonlyArray2<'_, f64>| -> Vec<Element> {
        let rows = rows.as_array();
        rows.rows().into_iter().map(|e| Element { x_b: e[0], y_b: e[1], k: e[2] }).collect()
    };
    Ok(SeriesSlip { up: group(up), down: group(down) })
}

/// Rows `(x_b, y_b, slope)`.
pub fn rows(group: &[Element]) -> Vec<(f64, f64, f64)> {
    group.iter().map(|e| (e.x_b, e.y_b, e.k)).collect()
}

fn series_slip(model: &Bound<'_, PyAny>) -> PyResult<SeriesSlip> {
    match model.extract()? {
        HysteresisIn(Model::SeriesSlip(slip)) => Ok(slip),
        HysteresisIn(_) => Err(not_a_model(&model.as_borrowed())),
    }
}

/// Fields of the loop whose elements meet.
#[pyfunction]
fn series_slip_closed(model: &Bound<'_, PyAny>) -> Outcome<HysteresisOut> {
    Ok(Model::SeriesSlip(series_slip(model)?.closed()?).into())
}

/// Fields of the model moved so that a branch passes (x, y).
#[pyfunction]
fn series_slip_through(model: &Bound<'_, PyAny>, x: f64, y: f64, way: f64) -> Outcome<HysteresisOut> {
    Ok(Model::SeriesSlip(series_slip(model)?.through(x, y, way)?).into())
}

/// What a record gave: fields of the model, and how it fits.
#[derive(IntoPyObject)]
struct LearntOut {
    model: HysteresisOut,
    N: usize,
    rms: f64,
    worst: f64,
    relative: f64,
    sd: Frozen,
    notes: Vec<NoteOut>,
}

/// Elements from a record (N,).
#[pyfunction]
fn series_slip_identify<'py>(
    py: Python<'py>,
    x: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
    settings: SettingsIn,
) -> Outcome<LearntOut> {
    let (x, y) = (x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let LearntSlip { model, N, rms, worst, relative, sd, notes: doubts } =
        py.detach(|| identify_slip(x, y, settings.into()))?;
    let model = Model::SeriesSlip(model).into();
    Ok(LearntOut { model, N, rms, worst, relative, sd: Frozen(sd), notes: notes(&doubts) })
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct SettingsIn {
    threshold: f64,
    consecutive: Option<usize>,
    P0: f64,
    noise_sd: f64,
    band: f64,
}

impl From<SettingsIn> for SlipSettings {
    fn from(s: SettingsIn) -> Self {
        let SettingsIn { threshold, consecutive, P0, noise_sd, band } = s;
        SlipSettings { threshold, consecutive, P0, noise_sd, band }
    }
}

/// Elements in series, learnt one sample at a time.
///
/// Parameters
/// ----------
/// threshold : float
///     Error beyond which a new element begins, in units of y.
/// consecutive : int, optional
///     Samples in a row that must be beyond it.  By default 1 where the threshold has eight standard
///     deviations of the noise, else 3.
/// P0 : float
///     Variance of the slope of a new element in units of the noise variance, 1/x^2: large against
///     `1/d^2`, `d` the step of the input.
/// noise_sd : float
///     Standard deviation of the noise of y.
/// band : float
///     How far the input must come back to have turned, in units of x: its noise.
///
/// Attributes
/// ----------
/// model : SeriesSlip
///     What has been learnt: for each direction the last stretch that went as far as the one before it.
/// elements : tuple of int
///     Elements of the rising and of the falling group.
/// threshold, consecutive, P0, noise_sd, band
///     As given; `consecutive` is the number in use.
///
/// Raises
/// ------
/// UsageError
///     A setting or sample out of its range (U01).
/// NotIdentifiable
///     `model` is asked for before the input has moved (X01).
///
/// Notes
/// -----
/// Recursive least squares of the slope through each breakpoint, on increments; the next element begins
/// at the last sample inside the threshold and keeps the slope.  When the input turns, the other group is
/// learnt afresh from measured positions, so that no loop drifts.  Source 002, 4.2 to 4.4, as corrected.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import plantune as pt
/// >>> x = 50 - 50 * np.cos(np.linspace(0, 2 * np.pi, 401))
/// >>> y = pt.hysteresis.PlayStack(r=[0, 10, 20], w=[0.4, 0.1, 0.1]).simulate(x)
/// >>> learner = pt.hysteresis.SeriesSlipLearner(threshold=0.5)
/// >>> errors = learner.run(x, y)
/// >>> learner.elements
/// (2, 3)
#[pyclass(module = "plantune._core")]
pub struct SeriesSlipLearner(SlipLearner);

#[pymethods]
impl SeriesSlipLearner {
    #[new]
    #[pyo3(signature = (threshold, consecutive=None, P0=100.0, noise_sd=0.0, band=0.0))]
    fn new(threshold: f64, consecutive: Option<usize>, P0: f64, noise_sd: f64, band: f64) -> Outcome<Self> {
        let settings = SlipSettings { threshold, consecutive, P0, noise_sd, band };
        Ok(SeriesSlipLearner(SlipLearner::new(settings)?))
    }

    /// Learn one sample and return the error of the element in use before that; 0 for the first one.
    ///
    /// A sample that is refused changes nothing.
    fn step(&mut self, x: f64, y: f64) -> Outcome<f64> {
        Ok(self.0.step(x, y)?)
    }

    /// Learn samples, x and y (N,), and return every error (N,): `step` in a loop, to the last bit.
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        x: PyArrayLike1<'py, f64, AllowTypeChange>,
        y: PyArrayLike1<'py, f64, AllowTypeChange>,
    ) -> Outcome<Array<'py>> {
        let (x, y) = (x.as_array().to_vec(), y.as_array().to_vec());
        let learner = &mut self.0;
        let errors = py.detach(|| learner.run(&x, &y))?;
        Ok(array(py, errors))
    }

    #[getter]
    fn model<'py>(&self, py: Python<'py>) -> Outcome<Bound<'py, PyAny>> {
        let fields = HysteresisOut::from(Model::SeriesSlip(self.0.model()?)).into_pyobject(py)?;
        let class = py.import("plantune.models.hysteresis")?.getattr("SeriesSlip")?;
        Ok(class.call((), Some(fields.cast::<PyDict>().map_err(PyErr::from)?))?)
    }

    #[getter]
    fn elements(&self) -> (usize, usize) {
        self.0.model().map_or((0, 0), |m| (m.up.len(), m.down.len()))
    }

    #[getter]
    fn threshold(&self) -> f64 {
        self.0.settings().threshold
    }

    #[getter]
    fn consecutive(&self) -> usize {
        self.0.settings().patience()
    }

    #[getter]
    fn P0(&self) -> f64 {
        self.0.settings().P0
    }

    #[getter]
    fn noise_sd(&self) -> f64 {
        self.0.settings().noise_sd
    }

    #[getter]
    fn band(&self) -> f64 {
        self.0.settings().band
    }

    fn __getnewargs__(&self) -> (f64, Option<usize>, f64, f64, f64) {
        let s = self.0.settings();
        (s.threshold, s.consecutive, s.P0, s.noise_sd, s.band)
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.state())
    }

    fn __setstate__(&mut self, state: PyReadonlyArray1<'_, f64>) -> Outcome<()> {
        Ok(self.0.resume(state.as_slice().map_err(PyErr::from)?)?)
    }

    fn __repr__(&self) -> String {
        let (up, down) = self.elements();
        format!("SeriesSlipLearner(threshold={}, elements=({up}, {down}))", self.threshold())
    }
}
