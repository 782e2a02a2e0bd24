//! Recursive least squares for any linear model.

use numpy::{AllowTypeChange, PyArrayLike1, PyArrayLike2};
use plantune_core::Error;
use plantune_core::recursive::{self, Ud};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::options::{Covariance, Each, Forget};
use crate::error::Outcome;
use crate::values::{Array, Matrix, array, matrix};

/// Recursive least squares, for any model linear in its parameters.
///
/// After `t` samples `theta` is exactly the minimum of the sum of `lam**(t - k)` times the squared
/// error `y(k) - phi(k)' theta`, and of `lam**t` times the distance to `theta0`, weighted with the
/// inverse of `P0`: with `lam=1`, ridge regression of weight `1/P0`.
///
/// Parameters
/// ----------
/// n : int
///     Number of parameters, at least 1.
/// lam : float
///     Forgetting factor in (0, 1]; it remembers about `1 / (1 - lam)` samples, and all of them at 1.
/// P0 : float, or array (n, n)
///     Covariance of `theta0` in units of the noise variance; a number is times identity.
/// theta0 : array (n,), optional
///     Parameters to start from; zero by default.
/// forgetting : str
///     "exponential": by `lam` in all directions.  "directional" (Kulhavy 1987): only what a sample
///     brings anew is forgotten of the old.  "variable" (Fortescue, Kershenbaum and Ydstie 1981):
///     errors larger than the noise shorten the memory, down to a factor of 0.9; `1 / (1 - lam)` is
///     the memory otherwise.  "kalman": a random walk of the parameters.
/// lam0, rho : float, optional
///     Of exponential forgetting: a factor to begin with, from which it grows to `lam`, each sample
///     leaving `rho` of the gap, 0.99 by default.  None: `lam` from the beginning.
/// R1, R2 : float or array (n,), float
///     Of the Kalman filter: variance of each parameter's step, and of the noise.
/// clip : float, optional
///     Cut errors at so many standard deviations, 6 for instance.  None: never.
/// P_max : float, optional
///     Bound for the entries of `D`; 1e12 times the largest of the start by default.
///
/// Attributes
/// ----------
/// theta, sd : array (n,)
///     Parameters and their standard deviations, infinite before the noise is known.
/// P : array (n, n)
///     Their covariance in units of the noise variance, exactly symmetric.
/// noise_sd : float
///     Standard deviation of the noise, taken over the last 200 errors.
/// expected_digits : array (n,)
///     Decimal digits to which each parameter is that of least squares: what rounding, and what is
///     left of the start, leave of 16.  Look here before `theta` where columns are nearly dependent.
/// factors : pair of arrays (n, n) and (n,)
///     `U` and `D` of `P = U diag(D) U'`, `U` unit upper triangular.
/// D_most : float
///     The most that forgetting may make of an entry of `D`.
/// n, lam, forgetting, lam0, clip : int, float, str, float, float or None
///     As given.
///
/// Raises
/// ------
/// UsageError
///     An argument out of its range, a sample that is not finite or of another size (U01).
/// NumericsError
///     A sample so large that its square overflows (N02).
///
/// Notes
/// -----
/// Source 000, (2.2-15); source 001, (3.7-7) to (3.7-11) as corrected; kept as `U D U'` and updated
/// after Bierman (1977).  What (3.7-11) prints, `R2 = lam` without dividing `P`, does not forget: it is
/// `forgetting="kalman", R2=lam`.  `sd` counts what is forgotten: `s^2 P / (1 + lam)` in the long run.
/// There is no excitation gate, since no input is known here: `ARX` has one.  For a record as a
/// whole take `estimate.arx`.
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> rls = pt.recursive.RLS(2, lam=0.99)
/// >>> u, y = [1.0, 0.0, -1.0, 2.0, 0.5], 0.0
/// >>> for k in range(5):
/// ...     phi, y = [-y, u[k]], 0.8 * y + 0.5 * u[k]
/// ...     eps = rls.update(phi, y)
/// >>> rls.theta.round(4)
/// array([-0.8,  0.5])
#[pyclass(name = "RLS", module = "plantune._core")]
pub struct Rls {
    rls: recursive::Rls,
    forget: Forget,
    clip: Option<f64>,
    P_max: Option<f64>,
}

#[pymethods]
impl Rls {
    #[new]
    #[pyo3(signature = (n, lam=1.0, P0=Covariance::Scalar(1e6), theta0=None, *, forgetting="exponential",
                        lam0=None, rho=None, R1=None, R2=1.0, clip=None, P_max=None))]
    #[allow(clippy::too_many_arguments)] // keywords of Python
    fn new(
        n: &Bound<'_, PyAny>,
        lam: f64,
        P0: Covariance<'_>,
        theta0: Option<PyArrayLike1<'_, f64, AllowTypeChange>>,
        forgetting: &str,
        lam0: Option<f64>,
        rho: Option<f64>,
        R1: Option<Each>,
        R2: f64,
        clip: Option<f64>,
        P_max: Option<f64>,
    ) -> Outcome<Self> {
        let n: usize = n.extract().map_err(|_| Error::argument("n", n, "a whole number, at least 1"))?;
        if n == 0 {
            return Err(Error::argument("n", n, "at least 1").into());
        }
        let forget = Forget { forgetting: forgetting.to_owned(), lam, lam0, rho, R1, R2 };
        let P0 = Ud::of_matrix(n, &P0.matrix(n)?)?;
        let mut rls = recursive::Rls::new(P0, forget.scheme(n, (1.0, 0.99))?)?;
        if let Some(theta0) = theta0 {
            rls = rls.starting_at(&theta0.as_array().to_vec())?;
        }
        if let Some(clip) = clip {
            rls = rls.cutting(clip)?;
        }
        if let Some(most) = P_max {
            rls = rls.bounded(most)?;
        }
        Ok(Rls { rls, forget, clip, P_max })
    }

    /// Start from least squares on the first rows of `phi` (N, n) and `y` (N,) instead of `P0`, then learn
    /// the others; return how many rows the batch had.
    ///
    /// `rows` of them, twice `n` by default; twice as many while their rank is not full or their condition
    /// poor.  Where even all rows have not full rank: X02.
    #[pyo3(signature = (phi, y, rows=None))]
    fn begin(
        &mut self,
        py: Python<'_>,
        phi: PyArrayLike2<'_, f64, AllowTypeChange>,
        y: PyArrayLike1<'_, f64, AllowTypeChange>,
        rows: Option<usize>,
    ) -> Outcome<usize> {
        let (phi, y) = (phi.as_array().iter().copied().collect::<Vec<_>>(), y.as_array().to_vec());
        let rows = rows.unwrap_or(2 * self.rls.n());
        Ok(py.detach(|| self.rls.begin(&phi, &y, rows))?)
    }

    /// Learn one sample, `phi` (n,) and `y`, and return the prior prediction error `y - phi' theta`.
    ///
    /// A sample that is refused changes nothing.
    fn update(&mut self, phi: PyArrayLike1<'_, f64, AllowTypeChange>, y: f64) -> Outcome<f64> {
        match phi.as_slice() {
            Ok(phi) => Ok(self.rls.update(phi, y)?),
            Err(_) => Ok(self.rls.update(&phi.as_array().to_vec(), y)?),
        }
    }

    /// Learn samples, `phi` (N, n) and `y` (N,), and return every prior prediction error (N,): `update`
    /// in a loop, to the last bit.
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        phi: PyArrayLike2<'py, f64, AllowTypeChange>,
        y: PyArrayLike1<'py, f64, AllowTypeChange>,
    ) -> Outcome<Array<'py>> {
        let (phi, y) = (phi.as_array().iter().copied().collect::<Vec<_>>(), y.as_array().to_vec());
        let eps = py.detach(|| self.rls.run(&phi, &y))?;
        Ok(array(py, eps))
    }

    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.rls.theta().to_vec())
    }

    #[getter]
    fn sd<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.rls.sd())
    }

    #[getter]
    fn P<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        matrix(py, self.rls.P().matrix(), self.rls.n())
    }

    #[getter]
    fn noise_sd(&self) -> f64 {
        self.rls.noise_sd()
    }

    #[getter]
    fn expected_digits<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.rls.expected_digits())
    }

    #[getter]
    fn factors<'py>(&self, py: Python<'py>) -> PyResult<(Matrix<'py>, Array<'py>)> {
        let n = self.rls.n();
        let (above, D) = self.rls.P().factors();
        let at = |i: usize, j: usize| match i.cmp(&j) {
            std::cmp::Ordering::Less => above[j * (j - 1) / 2 + i],
            std::cmp::Ordering::Equal => 1.0,
            std::cmp::Ordering::Greater => 0.0,
        };
        let U = (0..n * n).map(|k| at(k / n, k % n)).collect();
        Ok((matrix(py, U, n)?, array(py, D.to_vec())))
    }

    #[getter]
    fn D_most(&self) -> f64 {
        self.rls.P().most()[0]
    }

    #[getter]
    fn n(&self) -> usize {
        self.rls.n()
    }

    #[getter]
    fn lam(&self) -> f64 {
        self.forget.lam
    }

    #[getter]
    fn lam0(&self) -> f64 {
        self.forget.lam0.unwrap_or(self.forget.lam)
    }

    #[getter]
    fn forgetting(&self) -> &str {
        &self.forget.forgetting
    }

    #[getter]
    fn clip(&self) -> Option<f64> {
        self.clip
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((usize, f64), Bound<'py, PyDict>)> {
        let Forget { forgetting, lam, lam0, rho, R1, R2 } = self.forget.clone();
        let keywords = PyDict::new(py);
        keywords.set_item("forgetting", forgetting)?;
        keywords.set_item("lam0", lam0)?;
        keywords.set_item("rho", rho)?;
        keywords.set_item("R1", R1)?;
        keywords.set_item("R2", R2)?;
        keywords.set_item("clip", self.clip)?;
        keywords.set_item("P_max", self.P_max)?;
        Ok(((self.n(), lam), keywords))
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.rls.state())
    }

    fn __setstate__(&mut self, state: PyArrayLike1<'_, f64, AllowTypeChange>) -> Outcome<()> {
        Ok(self.rls.resume(&state.as_array().to_vec())?)
    }

    fn __repr__(&self) -> String {
        format!("RLS(n={}, lam={}, theta={:?})", self.n(), self.lam(), self.rls.theta())
    }
}
