//! An operator at work.

use numpy::PyReadonlyArray1;
use plantune_core::hysteresis::Operator;
use pyo3::prelude::*;

use super::HysteresisIn;
use crate::error::{Outcome, Raise};
use crate::values::{Array, array};

/// A hysteresis model at work, sample by sample, from its virgin state on.
///
/// Parameters
/// ----------
/// model : PlayStack, ...
///     Any model of `pt.hysteresis`.
///
/// Attributes
/// ----------
/// model : PlayStack, ...
///     As given.
/// state : array
///     All that it remembers; may be set.
///
/// Raises
/// ------
/// UsageError
///     Not a model, or one whose parameters are none (U01).
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> stream = pt.hysteresis.Stream(pt.hysteresis.PlayStack(r=[0, 1], w=[1, 1]))
/// >>> stream.step(3.0), stream.step(2.0)
/// (5.0, 4.0)
/// >>> stream.run([0.0, 3.0])
/// array([1., 5.])
#[pyclass(module = "plantune._core")]
pub struct Stream {
    model: Py<PyAny>,
    operator: Box<dyn Operator>,
}

#[pymethods]
impl Stream {
    #[new]
    fn new(model: &Bound<'_, PyAny>) -> Outcome<Self> {
        let core: HysteresisIn = model.extract()?;
        Ok(Stream { model: model.clone().unbind(), operator: core.0.start()? })
    }

    /// Return the output at the input `x`.
    fn step(&mut self, x: f64) -> f64 {
        self.operator.step(x)
    }

    /// Return the outputs (N,): `step` in a loop, to the last bit.
    fn run<'py>(&mut self, py: Python<'py>, x: PyReadonlyArray1<'py, f64>) -> Outcome<Array<'py>> {
        let x = x.as_slice().map_err(PyErr::from)?;
        let operator = &mut self.operator;
        let y = py.detach(|| operator.run(x));
        Ok(array(py, y))
    }

    #[getter]
    fn model(&self, py: Python<'_>) -> Py<PyAny> {
        self.model.clone_ref(py)
    }

    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.operator.state())
    }

    #[setter]
    fn set_state(&mut self, state: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        self.operator.resume(state.as_slice()?).map_err(|error| Raise::from(error).into())
    }

    fn __getnewargs__(&self, py: Python<'_>) -> (Py<PyAny>,) {
        (self.model(py),)
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Array<'py> {
        self.state(py)
    }

    fn __setstate__(&mut self, state: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        self.set_state(state)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("Stream({})", self.model.bind(py).repr()?))
    }
}
