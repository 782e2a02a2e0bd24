//! A memory that learns, as a compiled class.

use numpy::ndarray::Array3;
use numpy::{PyArray3, PyReadonlyArray1};
use plantune_core::hysteresis::{Cmac as Core, CmacSettings};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::{Outcome, Raise};
use crate::values::{Array, array};

/// A cerebellar model (CMAC): a function of one signal, learnt while it is used.
///
/// Parameters
/// ----------
/// range : (float, float)
///     Of the signal; beyond it the outermost cells answer.
/// cells : int
///     Cells in the range.
/// layers : int
///     Layers of cells, each shifted by one step, `(high - low)/(cells layers)`.
/// beta : float
///     Share of the error that is learnt at once, in (0, 1].
/// dead_zone : float
///     Errors up to this are not learnt, in units of the target.
///
/// Attributes
/// ----------
/// w : array (2, layers, cells + 1)
///     Weights for a rising and for a falling signal.
/// state : array
///     All that it remembers; may be set.
///
/// Raises
/// ------
/// UsageError
///     A range that does not ascend, no cells, `beta` outside (0, 1] (U01).
///
/// Notes
/// -----
/// Two tables, since a function of the signal alone cannot undo hysteresis; they have no memory for minor loops.
/// In a loop: `pt.hysteresis.track(plant, r, Ts, pid=pid, cmac=cmac)`. Source 002, 3.3 and figure 3.3.
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> cmac = pt.hysteresis.Cmac(range=(0.0, 1.0), cells=10, layers=4, beta=0.5)
/// >>> for _ in range(20):
/// ...     for s in (0.2, 0.5, 0.8):
/// ...         _ = cmac.recall(s)
/// ...         cmac.learn(3.0 * s)
/// >>> round(cmac.recall(0.5), 3)
/// 1.5
#[pyclass(module = "plantune._core")]
pub struct Cmac {
    pub core: Core,
}

#[pymethods]
impl Cmac {
    #[new]
    #[pyo3(signature = (range, cells=25, layers=8, beta=0.3, dead_zone=0.0))]
    fn new(range: (f64, f64), cells: usize, layers: usize, beta: f64, dead_zone: f64) -> Outcome<Self> {
        Ok(Cmac { core: Core::new(CmacSettings { range, cells, layers, beta, dead_zone })? })
    }

    /// Return what was learnt for the signal `s`.
    fn recall(&mut self, s: f64) -> f64 {
        self.core.recall(s)
    }

    /// Learn what should have come out of the last `recall`.
    fn learn(&mut self, target: f64) {
        self.core.learn(target);
    }

    #[getter]
    fn range(&self) -> (f64, f64) {
        self.core.settings().range
    }

    #[getter]
    fn cells(&self) -> usize {
        self.core.settings().cells
    }

    #[getter]
    fn layers(&self) -> usize {
        self.core.settings().layers
    }

    #[getter]
    fn beta(&self) -> f64 {
        self.core.settings().beta
    }

    #[getter]
    fn dead_zone(&self) -> f64 {
        self.core.settings().dead_zone
    }

    #[getter]
    fn w<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let shape = (2, self.layers(), self.cells() + 1);
        let w = Array3::from_shape_vec(shape, self.core.w().to_vec());
        Ok(PyArray3::from_owned_array(py, w.map_err(|e| PyValueError::new_err(e.to_string()))?))
    }

    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.core.state())
    }

    #[setter]
    fn set_state(&mut self, state: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        self.core.resume(state.as_slice()?).map_err(|error| Raise::from(error).into())
    }

    fn __getnewargs__(&self) -> ((f64, f64), usize, usize, f64, f64) {
        let CmacSettings { range, cells, layers, beta, dead_zone } = *self.core.settings();
        (range, cells, layers, beta, dead_zone)
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Array<'py> {
        self.state(py)
    }

    fn __setstate__(&mut self, state: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        self.set_state(state)
    }

    fn __repr__(&self) -> String {
        let CmacSettings { range: (low, high), cells, layers, beta, dead_zone } = self.core.settings();
        format!(
            "Cmac(range=({low}, {high}), cells={cells}, layers={layers}, beta={beta}, dead_zone={dead_zone})"
        )
    }
}
