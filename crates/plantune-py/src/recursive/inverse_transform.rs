//! The inverse digital transform at work.

use numpy::{AllowTypeChange, Complex64, PyArray1, PyArrayLike1, PyReadonlyArray1};
use plantune_core::{Error, recursive};
use pyo3::prelude::*;

use crate::error::{Outcome, Raise};
use crate::values::{Array, array};

/// The inverse digital transform: from samples of a response back to the input that made it.
///
/// A section per real pole, `(5)` of source 003, and per pair of complex ones, `(6)`, in a row.  On a
/// step response with these poles every value is the static gain over `gain`, whatever the initial
/// state; the first `order * lag` values are NaN, for nothing is assumed of it.
///
/// Parameters
/// ----------
/// poles : array (order,)
///     1/s, real or complex with their conjugates; a repeated one stands there as often.
/// Ts : float
///     Sample time, seconds.
/// gain : float
///     Static gain of the plant, y/u: values are then in units of u.
/// lag : int
///     Samples between the values that are combined; more lag, less noise gain.
/// differentiation : bool
///     The operator of numerical differentiation instead, with roots `1 + p lag Ts` (section 3).
///
/// Attributes
/// ----------
/// order : int
///     Number of poles.
/// coefficients : array (order + 1,)
///     `d` of `x(n) = sum d_j y(n - j lag) / gain`; they sum to 1.
/// noise_gain : float
///     Standard deviation of `x` over that of white noise on `y`.
///
/// Raises
/// ------
/// UsageError
///     No pole, one at 0, one without its conjugate or with a root of 1, a sample time or lag that is none,
///     a sample that is not finite (U01).
///
/// Notes
/// -----
/// Source 003, (4) to (8), as corrected: the sections are in a row, not a linear combination.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from plantune.recursive import InverseTransform
/// >>> t = 0.1 * np.arange(6)
/// >>> back = InverseTransform([-1 / 2], Ts=0.1)
/// >>> back.run(1 - 3 * np.exp(-t / 2)).round(12)
/// array([nan,  1.,  1.,  1.,  1.,  1.])
/// >>> round(back.noise_gain, 1)
/// 28.3
#[pyclass(name = "InverseTransform", module = "plantune._core")]
pub struct InverseTransform {
    core: recursive::InverseTransform,
    settings: (Vec<Complex64>, f64, f64, usize, bool),
}

#[pymethods]
impl InverseTransform {
    #[new]
    #[pyo3(signature = (poles, Ts, gain=1.0, lag=None, differentiation=false),
           text_signature = "(poles, Ts, gain=1.0, lag=1, differentiation=False)")]
    fn new(
        poles: &Bound<'_, PyAny>,
        Ts: f64,
        gain: f64,
        lag: Option<&Bound<'_, PyAny>>,
        differentiation: bool,
    ) -> Outcome<Self> {
        let poles = complexes(poles)?;
        let needed = "a whole number, at least 1";
        let lag = lag.map_or(Ok(1), |lag| lag.extract().map_err(|_| Error::argument("lag", lag, needed)))?;
        let make = if differentiation {
            recursive::InverseTransform::differentiation
        } else {
            recursive::InverseTransform::new
        };
        let core = make(&poles, Ts, lag, gain)?;
        Ok(InverseTransform { core, settings: (poles, Ts, gain, lag, differentiation) })
    }

    /// Take one sample of `y` and return the input; NaN before the window is full.
    ///
    /// A sample that is refused changes nothing.
    fn step(&mut self, y: f64) -> Outcome<f64> {
        Ok(self.core.step(y)?)
    }

    /// Take samples (N,) and return the inputs (N,): `step` in a loop, to the last bit.
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        y: PyArrayLike1<'py, f64, AllowTypeChange>,
    ) -> Outcome<Array<'py>> {
        let y: Vec<f64> = y.as_array().to_vec();
        let core = &mut self.core;
        let x = py.detach(|| core.run(&y))?;
        Ok(array(py, x))
    }

    /// Forget all samples, as after a gap: NaN until the window is full again.
    fn restart(&mut self) {
        self.core.restart();
    }

    #[getter]
    fn order(&self) -> usize {
        self.settings.0.len()
    }

    #[getter]
    fn coefficients<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.core.coefficients())
    }

    #[getter]
    fn noise_gain(&self) -> f64 {
        self.core.noise_gain()
    }

    fn __getnewargs__<'py>(
        &self,
        py: Python<'py>,
    ) -> (Bound<'py, PyArray1<Complex64>>, f64, f64, usize, bool) {
        let (poles, Ts, gain, lag, differentiation) = &self.settings;
        (PyArray1::from_slice(py, poles), *Ts, *gain, *lag, *differentiation)
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.core.state())
    }

    fn __setstate__(&mut self, state: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        self.core.resume(state.as_slice()?).map_err(|error| Raise::from(error).into())
    }

    fn __repr__(&self) -> String {
        let (poles, Ts, ..) = &self.settings;
        format!("InverseTransform(order={}, Ts={Ts})", poles.len())
    }
}

/// Numbers of any kind, and sequences of them, as complex ones.
fn complexes(values: &Bound<'_, PyAny>) -> PyResult<Vec<Complex64>> {
    let numpy = values.py().import("numpy")?;
    let array = numpy.call_method1("array", (values, "complex128"))?.call_method1("reshape", (-1,))?;
    Ok(array.extract::<PyReadonlyArray1<'_, Complex64>>()?.as_array().to_vec())
}
