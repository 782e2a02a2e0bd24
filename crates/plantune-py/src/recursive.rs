//! Estimators that learn one sample at a time.

use numpy::{AllowTypeChange, PyArrayLike1, PyArrayLike2, PyUntypedArrayMethods};
use plantune_core::Error;
use plantune_core::recursive;
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::values::{Array, Matrix, array, matrix};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<Rls>()
}

/// A scalar is times identity.
#[derive(FromPyObject)]
enum Covariance<'py> {
    Scalar(f64),
    Matrix(PyArrayLike2<'py, f64, AllowTypeChange>),
}

/// Recursive least squares with exponential forgetting, for any model linear in its parameters.
///
/// After `t` samples `theta` is exactly the minimum of the sum of `lam**(t - k)` times the squared
/// error `y(k) - phi(k)' theta`, and of `lam**t` times the distance to `theta0`, weighted with the
/// inverse of `P0`.
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
///
/// Attributes
/// ----------
/// theta : array (n,)
///     Parameters.
/// P : array (n, n)
///     Their covariance in units of the noise variance, exactly symmetric.
/// factors : pair of arrays (n, n) and (n,)
///     `U` and `D` of `P = U diag(D) U'`, `U` unit upper triangular.
/// D_most : float
///     The most that forgetting may make of an entry of `D`.
/// n, lam : int, float
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
/// Source 000, (2.2-15); source 001, (3.7-9); kept as `U D U'` and updated after Bierman (1977).
/// Where the data say nothing, forgetting raises `D` to at most 1e12 times its largest start value.
/// It knows neither an excitation gate nor outliers: feed it moving inputs and outputs without
/// offset, or a 1 in `phi` for the offset.  For a record as a whole take `estimate.arx`.
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
}

#[pymethods]
impl Rls {
    #[new]
    #[pyo3(signature = (n, lam=1.0, P0=Covariance::Scalar(1e6), theta0=None))]
    fn new(
        n: &Bound<'_, PyAny>,
        lam: f64,
        P0: Covariance<'_>,
        theta0: Option<PyArrayLike1<'_, f64, AllowTypeChange>>,
    ) -> Outcome<Self> {
        let n = n.extract().map_err(|_| Error::argument("n", n, "a whole number, at least 1"))?;
        let mut rls = match P0 {
            Covariance::Scalar(P0) => recursive::Rls::new(n, lam, P0)?,
            Covariance::Matrix(P0) if P0.shape() == [n, n] => {
                let P0 = P0.as_array().iter().copied().collect::<Vec<f64>>();
                recursive::Rls::new(n, lam, 1.0)?.with_covariance(&P0)?
            }
            Covariance::Matrix(P0) => {
                return Err(Error::argument("P0", format!("of shape {:?}", P0.shape()), "(n, n)").into());
            }
        };
        if let Some(theta0) = theta0 {
            rls = rls.starting_at(&theta0.as_array().to_vec())?;
        }
        Ok(Rls { rls })
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
    fn P<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        matrix(py, self.rls.P(), self.rls.theta().len())
    }

    #[getter]
    fn factors<'py>(&self, py: Python<'py>) -> PyResult<(Matrix<'py>, Array<'py>)> {
        let n = self.rls.theta().len();
        let (above, D, _) = self.rls.factors();
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
        self.rls.factors().2
    }

    #[getter]
    fn n(&self) -> usize {
        self.rls.theta().len()
    }

    #[getter]
    fn lam(&self) -> f64 {
        self.rls.lambda()
    }

    fn __getnewargs__(&self) -> (usize, f64) {
        (self.n(), self.lam())
    }

    fn __getstate__(&self) -> (Vec<f64>, Vec<f64>, Vec<f64>, f64) {
        let (U, D, D_most) = self.rls.factors();
        (self.rls.theta().to_vec(), U.to_vec(), D.to_vec(), D_most)
    }

    fn __setstate__(&mut self, state: (Vec<f64>, Vec<f64>, Vec<f64>, f64)) -> Outcome<()> {
        Ok(self.rls.resume(state.0, state.1, state.2, state.3)?)
    }

    fn __repr__(&self) -> String {
        format!("RLS(n={}, lam={}, theta={:?})", self.n(), self.lam(), self.rls.theta())
    }
}
