//! Estimators of many loops at several delays, side by side.

use numpy::ndarray::Dimension;
use numpy::{
    AllowTypeChange, PyArray1, PyArrayDyn, PyArrayLike, PyArrayLike1, PyArrayLike2, PyArrayMethods,
    PyReadonlyArray1, PyUntypedArrayMethods,
};
use plantune_core::Error;
use plantune_core::recursive::{self, BankSettings};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::values::{Array, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<Bank>()
}

/// Whether C filters the gradient: "rml", or "els".
pub fn is_rml(method: &str) -> plantune_core::Result<bool> {
    match method {
        "rml" => Ok(true),
        "els" => Ok(false),
        other => Err(Error::argument("method", format!("{other:?}"), "\"rml\" or \"els\"")),
    }
}

/// From so many estimators on, other Python threads run meanwhile.
const LONG: usize = 1000;

/// An array of three or four dimensions.
type Cube<'py> = Bound<'py, PyArrayDyn<f64>>;

/// One number for all four parameters, or four.
#[derive(FromPyObject)]
enum Variances {
    One(f64),
    Four([f64; 4]),
}

/// A bank of delays: for each loop and each candidate delay a first-order ARMAX with offset.
///
/// `y(t) = a y(t-1) + b u(t-nk) + d + e(t) + c e(t-1)`, estimated recursively on signals counted from
/// the loop's first sample.  The gain is `b / (1 - a)`, the time constant `-Ts / ln(a)`, the offset
/// `d / (1 - a)` from `y(0) - b u(0) / (1 - a)`.  Many loops cost little more than one: the
/// arithmetic runs in the widest registers at hand.
///
/// Parameters
/// ----------
/// loops : int
///     Number of loops, at least 1.
/// nk : pair of int
///     Least and greatest candidate delay in samples, at least 1; both are candidates.
/// lam, lam0, rho : float
///     The forgetting factor goes from `lam0` to `lam`: `lam - (lam - lam0) rho**t`, `t` counting the
///     samples learnt.  `lam0` and `lam` in (0, 1], `rho` in [0, 1].
/// P0 : float, or four
///     Start variances of a, b, d, c in units of the noise variance.
/// method : {"rml", "els"}
///     Recursive maximum likelihood, or extended least squares.
/// errors : bool
///     Whether `eps`, `q`, `s2` and `sd` are kept, which costs about a tenth of the time.
/// clip : float, optional
///     Standard deviations at which an error is cut before it is learnt, for instance 6; not in the first
///     50 samples, nor where `q >= 1`.  Needs `errors`.
/// swell : float
///     The most that forgetting may make of a variance, in units of the largest `P0`, at least 1.
/// c_most : float
///     Largest `|c|`, in (0, 1).
/// memory : float
///     Samples over which `s2` is a mean, more than 50.
///
/// Attributes
/// ----------
/// nk : array (candidates,)
///     Candidate delays.
/// theta : array (loops, candidates, 4)
///     Parameters a, b, d, c.
/// P : array (loops, candidates, 4, 4)
///     Their covariance in units of the noise variance.
/// sd : array (loops, candidates, 4)
///     Their standard deviations; 0 unless `errors`.
/// eps, q, s2 : array (loops, candidates)
///     Error of the last sample before it was learnt; `q = psi' P psi`, so that its variance is
///     `s2 (1 + q)`; robust variance of the noise.  0 unless `errors`.
/// learnt : array (loops,)
///     Whether the last sample was learnt.
/// restarts : array (loops,)
///     How often a loop started anew because its numbers overflowed.
/// origin : array (loops, 2)
///     First u and y of each loop, from which its signals are counted; NaN before they came.
/// loops : int
///     As given.
///
/// Raises
/// ------
/// UsageError
///     An argument out of its range, or of another size (U01).
///
/// Notes
/// -----
/// The first `nk[-1]` samples of a loop are not learnt: what u was before is not known.  A number that
/// is not finite pauses its own loop for as long as it would be remembered; a loop whose numbers
/// overflow starts anew.  No other loop is touched.
///
/// Source 001, 3.7.4d; Ljung and Söderström (1983); `P = U D U'` updated after Bierman (1977).
/// For one loop of any order take `ARMAX`; for a record as a whole `estimate.armax`.
///
/// Examples
/// --------
/// >>> import numpy as np, plantune as pt
/// >>> rec = pt.datasets.engine_loop(t_end=10.0)
/// >>> bank = pt.recursive.Bank(1, nk=(4, 8))
/// >>> eps, q = bank.run(rec.u, rec.y, errors=True)
/// >>> best = np.abs(eps[-100:, 0]).sum(axis=0).argmin()
/// >>> bank.nk[best], bank.theta[0, best, :2].round(3)
/// (np.int64(6), array([ 0.874, -0.746]))
#[pyclass(module = "plantune._core")]
pub struct Bank {
    bank: recursive::Bank,
}

#[pymethods]
impl Bank {
    #[new]
    #[pyo3(signature = (
        loops, nk, lam=0.995, lam0=0.95, rho=0.99, P0=Variances::One(1e6), method="rml", errors=true,
        clip=None, swell=1e3, c_most=0.97, memory=200.0
    ))]
    #[expect(clippy::too_many_arguments)]
    fn new(
        loops: &Bound<'_, PyAny>,
        nk: &Bound<'_, PyAny>,
        lam: f64,
        lam0: f64,
        rho: f64,
        P0: Variances,
        method: &str,
        errors: bool,
        clip: Option<f64>,
        swell: f64,
        c_most: f64,
        memory: f64,
    ) -> Outcome<Self> {
        let loops =
            loops.extract().map_err(|_| Error::argument("loops", loops, "a whole number, at least 1"))?;
        let pair = || Error::argument("nk", nk, "a pair of whole numbers, least and greatest, at least 1");
        let (low, high): (usize, usize) = nk.extract().map_err(|_| pair())?;
        let rml = is_rml(method)?;
        let P0 = match P0 {
            Variances::One(P0) => [P0; 4],
            Variances::Four(P0) => P0,
        };
        let settings =
            BankSettings { lambda0: lam0, lambda: lam, rho, P0, swell, c_most, rml, errors, clip, memory };
        Ok(Bank { bank: recursive::Bank::new(loops, low, high, &settings)? })
    }

    /// Learn one sample of every loop: `u` (loops,) acts from now on, `y` (loops,) is read now.
    fn step(
        &mut self,
        py: Python<'_>,
        u: PyArrayLike1<'_, f64, AllowTypeChange>,
        y: PyArrayLike1<'_, f64, AllowTypeChange>,
    ) -> Outcome<()> {
        let (mut copies, bank) = ([Vec::new(), Vec::new()], &mut self.bank);
        let [copy_u, copy_y] = &mut copies;
        let (u, y) = (contiguous(&u, copy_u), contiguous(&y, copy_y));
        if u.len() * bank.candidates() < LONG {
            return Ok(bank.step(u, y)?);
        }
        Ok(py.detach(|| bank.step(u, y))?)
    }

    /// Learn samples, `u` and `y` (N, loops): `step` in a loop, to the last bit, in less time.
    ///
    /// With `errors=True` it returns `eps` and `q` of every sample, each (N, loops, candidates); else
    /// None.
    #[pyo3(signature = (u, y, errors=false))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        u: PyArrayLike2<'py, f64, AllowTypeChange>,
        y: PyArrayLike2<'py, f64, AllowTypeChange>,
        errors: bool,
    ) -> Outcome<Option<(Cube<'py>, Cube<'py>)>> {
        let shape = [u.shape(), y.shape()];
        let loops = self.bank.loops();
        if shape[0] != shape[1] || shape[0][1] != loops {
            let came = format!("of shapes {:?} and {:?}", shape[0], shape[1]);
            return Err(Error::argument("u and y", came, &format!("(N, {loops}), both")).into());
        }
        let (mut copies, bank) = ([Vec::new(), Vec::new()], &mut self.bank);
        let [copy_u, copy_y] = &mut copies;
        let (u, y) = (contiguous(&u, copy_u), contiguous(&y, copy_y));
        if !errors {
            py.detach(|| bank.run(u, y))?;
            return Ok(None);
        }
        let (eps, q) = py.detach(|| bank.errors(u, y))?;
        let shape = [u.len() / loops, loops, self.bank.candidates()];
        Ok(Some((shaped(py, eps, &shape)?, shaped(py, q, &shape)?)))
    }

    /// Count the signals of a loop in units of `1 / u_factor` and `1 / y_factor`, and start it anew.
    ///
    /// What the bank tells stays in the units of the signals.
    fn scale(&mut self, index: usize, u_factor: f64, y_factor: f64) -> Outcome<()> {
        Ok(self.bank.scale(index, u_factor, y_factor)?)
    }

    /// Open or close the gate of a loop; a closed one leaves theta and P as they are, while its signals
    /// move on.
    fn gate(&mut self, index: usize, open: bool) -> Outcome<()> {
        Ok(self.bank.gate(index, open)?)
    }

    /// After an alarm: add this to the variance of the offset of a loop, in units of the noise variance.
    #[pyo3(signature = (index, variance=1000.0))]
    fn open_offset(&mut self, index: usize, variance: f64) -> Outcome<()> {
        Ok(self.bank.open_offset(index, variance)?)
    }

    /// Forget all of a loop, but not whether its gate is open; its next sample is its first.
    fn reset(&mut self, index: usize) -> Outcome<()> {
        Ok(self.bank.reset(index)?)
    }

    #[getter]
    fn loops(&self) -> usize {
        self.bank.loops()
    }

    #[getter]
    fn nk<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let (low, high) = self.bank.delays();
        PyArray1::from_vec(py, (low as i64..=high as i64).collect())
    }

    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> PyResult<Cube<'py>> {
        self.each(py, &[4], |bank, k, c| bank.theta(k, c))
    }

    #[getter]
    fn P<'py>(&self, py: Python<'py>) -> PyResult<Cube<'py>> {
        self.each(py, &[4, 4], |bank, k, c| bank.P(k, c).concat())
    }

    #[getter]
    fn sd<'py>(&self, py: Python<'py>) -> PyResult<Cube<'py>> {
        self.each(py, &[4], |bank, k, c| bank.sd(k, c))
    }

    #[getter]
    fn eps<'py>(&self, py: Python<'py>) -> PyResult<Cube<'py>> {
        self.each(py, &[], |bank, k, c| [bank.eps(k, c)])
    }

    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Cube<'py>> {
        self.each(py, &[], |bank, k, c| [bank.q(k, c)])
    }

    #[getter]
    fn s2<'py>(&self, py: Python<'py>) -> PyResult<Cube<'py>> {
        self.each(py, &[], |bank, k, c| [bank.s2(k, c)])
    }

    #[getter]
    fn learnt<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_vec(py, (0..self.loops()).map(|k| self.bank.learnt(k)).collect())
    }

    #[getter]
    fn restarts<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_vec(py, (0..self.loops()).map(|k| self.bank.restarts(k)).collect())
    }

    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> PyResult<Cube<'py>> {
        let of = |k| self.bank.origin(k).map_or([f64::NAN; 2], |(u, y)| [u, y]);
        shaped(py, (0..self.loops()).flat_map(of).collect(), &[self.loops(), 2])
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let s = self.bank.settings();
        let method = if s.rml { "rml" } else { "els" };
        let first = (self.loops(), self.bank.delays(), s.lambda, s.lambda0, s.rho, s.P0);
        let rest = (method, s.errors, s.clip, s.swell, s.c_most, s.memory);
        let (first, rest) = (first.into_pyobject(py)?, rest.into_pyobject(py)?);
        first.call_method1("__add__", (rest,))
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.bank.state())
    }

    fn __setstate__(&mut self, state: PyReadonlyArray1<'_, f64>) -> Outcome<()> {
        Ok(self.bank.resume(state.as_slice().map_err(PyErr::from)?)?)
    }

    fn __repr__(&self) -> String {
        let (low, high) = self.bank.delays();
        format!("Bank(loops={}, nk=({low}, {high}))", self.loops())
    }
}

impl Bank {
    /// The same numbers of each estimator, `(loops, candidates, …)`.
    fn each<'py, I: IntoIterator<Item = f64>>(
        &self,
        py: Python<'py>,
        shape: &[usize],
        of: impl Fn(&recursive::Bank, usize, usize) -> I,
    ) -> PyResult<Cube<'py>> {
        let (loops, candidates) = (self.bank.loops(), self.bank.candidates());
        let mut numbers = Vec::with_capacity(loops * candidates * shape.iter().product::<usize>());
        for k in 0..loops {
            (0..candidates).for_each(|c| numbers.extend(of(&self.bank, k, c)));
        }
        shaped(py, numbers, &[&[loops, candidates], shape].concat())
    }
}

/// The numbers of an array row by row, copied only where they lie otherwise.
fn contiguous<'a, D: Dimension>(
    x: &'a PyArrayLike<'_, f64, D, AllowTypeChange>,
    copy: &'a mut Vec<f64>,
) -> &'a [f64] {
    match x.as_slice() {
        Ok(slice) if x.is_c_contiguous() => slice,
        _ => {
            copy.extend(x.as_array().iter());
            copy
        }
    }
}

/// Row-major numbers as an array of this shape.
fn shaped<'py>(py: Python<'py>, x: Vec<f64>, shape: &[usize]) -> PyResult<Cube<'py>> {
    array(py, x).reshape(shape)
}
