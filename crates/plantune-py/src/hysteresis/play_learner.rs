//! Weights of a stack of plays, learnt sample by sample.

use numpy::{AllowTypeChange, PyArrayLike1, PyReadonlyArray1};
use plantune_core::hysteresis::{Model, PlayLearner as Core, PlayLearnerSettings};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::HysteresisOut;
use crate::error::Outcome;
use crate::values::{Array, array};

/// Weights of a stack of plays, learnt one sample at a time and never negative.
///
/// After each sample the weights are the minimum, over `w >= 0`, of the sum of `lam**(t - k)` times the squared
/// error and of `lam**t` times the squared length of weights and offset over `P0`: exactly with `hold=0`.
///
/// Parameters
/// ----------
/// r : array (n,)
///     Half widths of the plays, ascending from 0, in units of x.
/// lam : float
///     Forgetting factor in (0, 1]; it remembers about `1 / (1 - lam)` samples, and all of them at 1.
/// offset : bool
///     Learn an offset, of either sign.
/// P0 : float
///     Variance of each weight before the first sample, in units of the noise variance.
/// gate : float, optional
///     How far x must have moved since the last sample learnt for another to be learnt, in units of x.
///     By default 1e-3 of the range of x seen so far where anything is forgotten, else 0.
/// hold : float
///     Share of the most that was ever known about each weight that is not forgotten, in [0, 1]: weights of
///     plays that small loops do not move stay where they are.  Without effect at `lam=1`.
///
/// Attributes
/// ----------
/// w : array (n,)
///     Weights.
/// offset : float
///     Offset.
/// sd : array (n + 1,)
///     Standard deviations of the weights and of the offset; 0 of what stands at 0.
/// model : PlayStack
///     What has been learnt, in the virgin state.
/// seen : int
///     Samples.
/// r, lam, gate, hold : array, float, float or None, float
///     As given.
///
/// Raises
/// ------
/// UsageError
///     A setting or sample out of its range (U01).
/// DataError
///     x and y of different lengths (D09).
/// NotIdentifiable
///     `model` is asked for before the input has moved (X01).
///
/// Notes
/// -----
/// Recursive least squares in square-root form without a bound; the bound enters the answer by active sets,
/// sought from the last answer on.  The plays begin in the virgin state with the first sample.  Weights of
/// plays that x has not moved keep a large `sd`.  METHODS 4.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import plantune as pt
/// >>> x = np.sin(np.linspace(0, 20, 500))
/// >>> y = pt.hysteresis.PlayStack(r=[0, 0.2, 0.5], w=[1, 0.5, 0]).simulate(x)
/// >>> learner = pt.hysteresis.PlayLearner(r=[0, 0.2, 0.5])
/// >>> errors = learner.run(x, y)
/// >>> learner.w.round(6)
/// array([1. , 0.5, 0. ])
#[pyclass(module = "plantune._core")]
pub struct PlayLearner(Core);

#[pymethods]
impl PlayLearner {
    #[new]
    #[pyo3(signature = (r, lam=1.0, offset=true, P0=1e8, gate=None, hold=1e-4))]
    fn new(
        r: PyArrayLike1<'_, f64, AllowTypeChange>,
        lam: f64,
        offset: bool,
        P0: f64,
        gate: Option<f64>,
        hold: f64,
    ) -> Outcome<Self> {
        let r = r.as_array().to_vec();
        Ok(PlayLearner(Core::new(PlayLearnerSettings { r, lambda: lam, offset, P0, gate, hold })?))
    }

    /// Learn one sample and return the error of the weights before that.
    ///
    /// A sample that is refused changes nothing.
    fn step(&mut self, x: f64, y: f64) -> Outcome<f64> {
        Ok(self.0.step(x, y)?)
    }

    /// Learn samples, x and y (N,), and return every error (N,): `step` in a loop, to the last bit.
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
        y: PyReadonlyArray1<'py, f64>,
    ) -> Outcome<Array<'py>> {
        let (x, y) = (x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
        let learner = &mut self.0;
        let errors = py.detach(|| learner.run(x, y))?;
        Ok(array(py, errors))
    }

    #[getter]
    fn model<'py>(&self, py: Python<'py>) -> Outcome<Bound<'py, PyAny>> {
        let fields = HysteresisOut::from(Model::PlayStack(self.0.model()?)).into_pyobject(py)?;
        let class = py.import("plantune.models.hysteresis")?.getattr("PlayStack")?;
        Ok(class.call((), Some(fields.cast::<PyDict>().map_err(PyErr::from)?))?)
    }

    #[getter]
    fn w<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.w().to_vec())
    }

    #[getter]
    fn offset(&self) -> f64 {
        self.0.offset()
    }

    #[getter]
    fn sd<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.sd())
    }

    #[getter]
    fn r<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.settings().r.clone())
    }

    #[getter]
    fn lam(&self) -> f64 {
        self.0.settings().lambda
    }

    #[getter]
    fn gate(&self) -> Option<f64> {
        self.0.settings().gate
    }

    #[getter]
    fn hold(&self) -> f64 {
        self.0.settings().hold
    }

    #[getter]
    fn seen(&self) -> usize {
        self.0.seen()
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> (Array<'py>, f64, bool, f64, Option<f64>, f64) {
        let s = self.0.settings();
        (self.r(py), s.lambda, s.offset, s.P0, s.gate, s.hold)
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.state())
    }

    fn __setstate__(&mut self, state: PyReadonlyArray1<'_, f64>) -> Outcome<()> {
        Ok(self.0.resume(state.as_slice().map_err(PyErr::from)?)?)
    }

    fn __repr__(&self) -> String {
        let s = self.0.settings();
        format!("PlayLearner(n={}, lam={}, seen={})", s.r.len(), s.lambda, self.0.seen())
    }
}
