//! Recursive ARX with regressors of one's own.

use numpy::{AllowTypeChange, PyArrayLike1};
use plantune_core::recursive::{self, Ud};
use plantune_core::{Error, Limits};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::options::{Covariance, Forget};
use crate::error::Outcome;
use crate::terms::terms;
use crate::values::{Array, LimitsIn, RecordIn, array};

/// Recursive ARX with regressors of one's own,
/// `A(q) y(t) = B(q) u(t - nk) + sum_m g_m x_m(t) + d + e(t)`.
///
/// With `lam=1` and without `P0` it is, at every sample from its start on, the least squares of
/// `estimate.arx(rec, na, nb, nk, regressors=...)`.
///
/// Parameters
/// ----------
/// na, nb : int
///     Numbers of a and of b coefficients, >= 0.
/// nk : int
///     Delay of the b coefficients in samples (0 = direct term).
/// regressors : list of str
///     Made of `u` and `y` as those of `estimate.arx`: `"positive(u(t-1))"`, `"sign(y(t-1))"`.
/// lam : float
///     Forgetting factor in (0, 1].
/// offset : bool
///     Whether the constant `d` is estimated.
/// P0 : float or array (n, n), optional
///     Covariance of the start in units of the noise variance; `n` counts the constant, which is last.  None: the
///     first rows are gathered until least squares has an answer.
/// forgetting : "exponential", "directional" or "variable"
///     As of `RLS`.
/// clip : float, optional
///     Cut errors at so many standard deviations.
///
/// Attributes
/// ----------
/// names, theta, sd
///     Of the coefficients: a1 ... b1 ..., then the regressors as they were written.
/// offset : float
///     The constant `d` of the equation.
/// noise_sd : float
///     Standard deviation of the noise.
/// samples : int
///     Taken in so far, learnt or not.
///
/// Raises
/// ------
/// UsageError
///     A regressor that cannot be read, an argument out of its range, a sample that is not finite (U01).
/// NumericsError
///     A sample so large that its square overflows (N02).
///
/// Notes
/// -----
/// Source 000, (2.2-15) and chapter 4.  `copy.deepcopy` and `pickle` keep the state, to the last bit.
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> rec = pt.datasets.printer_motor("prbs", equation_var=0.01, resolution=0)
/// >>> own = pt.recursive.TermARX(2, 2, 1, regressors=["sign(y(t-1))"])
/// >>> eps = own.run(rec)
/// >>> own.names
/// ['a1', 'a2', 'b1', 'b2', 'sign(y(t-1))']
/// >>> bool(abs(own.theta[4]) < 3 * own.sd[4])  # this motor has no dry friction
/// True
#[pyclass(name = "TermARX", module = "plantune._core")]
pub struct TermArx {
    inner: recursive::TermArx,
    orders: [usize; 3],
    regressors: Vec<String>,
    offset: bool,
    forget: Forget,
    clip: Option<f64>,
}

#[pymethods]
impl TermArx {
    #[new]
    #[pyo3(signature = (na, nb, nk=1, *, regressors, lam=1.0, offset=true, P0=None, forgetting="exponential",
                        lam0=None, rho=None, clip=None))]
    #[allow(clippy::too_many_arguments)] // keywords of Python
    fn new(
        na: &Bound<'_, PyAny>,
        nb: &Bound<'_, PyAny>,
        nk: usize,
        regressors: Vec<String>,
        lam: f64,
        offset: bool,
        P0: Option<Covariance<'_>>,
        forgetting: &str,
        lam0: Option<f64>,
        rho: Option<f64>,
        clip: Option<f64>,
    ) -> Outcome<Self> {
        let whole = |name: &str, value: &Bound<'_, PyAny>| {
            value.extract::<usize>().map_err(|_| Error::argument(name, value, "a whole number, not negative"))
        };
        let orders = [whole("na", na)?, whole("nb", nb)?, nk];
        let own = terms(&regressors, &["u".to_owned(), "y".to_owned()])?;
        let n = orders[0] + orders[1] + own.len() + usize::from(offset);
        let gather = P0.is_none();
        let P0 = Ud::of_matrix(n.max(1), &P0.unwrap_or(Covariance::Scalar(1.0)).matrix(n.max(1))?)?;
        let forget = Forget { forgetting: forgetting.to_owned(), lam, lam0, rho, R1: None, R2: 1.0 };
        let mut rls = recursive::Rls::new(P0, forget.scheme(n, (1.0, 0.99))?)?;
        if let Some(clip) = clip {
            rls = rls.cutting(clip)?;
        }
        let inner = recursive::TermArx::new(orders, own, offset, rls, gather)?;
        Ok(TermArx { inner, orders, regressors, offset, forget, clip })
    }

    /// Learn from the output `y` read at `t`; `u` is the input applied from `t` on, as in a `Record`.
    ///
    /// Return the prediction error; NaN while lags are missing and the first rows are gathered.  A sample that is
    /// refused changes nothing.
    fn step(&mut self, u: f64, y: f64) -> Outcome<f64> {
        Ok(self.inner.step(u, y)?.unwrap_or(f64::NAN))
    }

    /// Go on without an output: it is missing, or does not count.
    fn skip(&mut self, u: f64) -> Outcome<()> {
        Ok(self.inner.skip(u)?)
    }

    /// Forget all signals, as after a gap; parameters and covariance go on.
    fn restart(&mut self) {
        self.inner.restart();
    }

    /// Learn a record and return its prediction errors (N,): `step` in a loop, to the last bit.
    ///
    /// Every segment after a `restart`, the first as well; `skip` where the output does not count.
    fn run<'py>(&mut self, py: Python<'py>, rec: &Bound<'py, PyAny>) -> Outcome<Array<'py>> {
        let input: RecordIn<'py> = rec.extract()?;
        let limits: Option<LimitsIn> = rec.getattr("limits")?.extract()?;
        let record = input.view(&limits.map_or_else(Limits::default, Limits::from))?;
        let inner = &mut self.inner;
        let eps = py.detach(|| inner.run(&record))?;
        Ok(array(py, eps))
    }

    #[getter]
    fn names(&self) -> Vec<String> {
        self.inner.names()
    }

    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.inner.theta().to_vec())
    }

    #[getter]
    fn sd<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.inner.sd())
    }

    #[getter]
    fn offset(&self) -> f64 {
        self.inner.d()
    }

    #[getter]
    fn noise_sd(&self) -> f64 {
        self.inner.rls().noise_sd()
    }

    #[getter]
    fn samples(&self) -> usize {
        self.inner.samples()
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<((usize, usize, usize), Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("regressors", &self.regressors)?;
        keywords.set_item("lam", self.forget.lam)?;
        keywords.set_item("offset", self.offset)?;
        keywords.set_item("forgetting", &self.forget.forgetting)?;
        keywords.set_item("lam0", self.forget.lam0)?;
        keywords.set_item("rho", self.forget.rho)?;
        keywords.set_item("clip", self.clip)?;
        Ok((self.orders.into(), keywords))
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.inner.state())
    }

    fn __setstate__(&mut self, state: PyArrayLike1<'_, f64, AllowTypeChange>) -> Outcome<()> {
        Ok(self.inner.resume(&state.as_array().to_vec())?)
    }

    fn __repr__(&self) -> String {
        let [na, nb, nk] = self.orders;
        format!("TermARX({na}, {nb}, {nk}): {} samples, theta={:?}", self.samples(), self.inner.theta())
    }
}
