//! Recursive estimators of the polynomial family: one class that learns, and one for each set of orders.

use numpy::{AllowTypeChange, PyArray1, PyArrayLike1};
use plantune_core::model::Model;
use plantune_core::recursive::{Rpem, Structure, Trace};
use plantune_core::{Error, Limits};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use super::options::Options;
use crate::error::Outcome;
use crate::model::ModelOut;
use crate::values::{Array, LimitsIn, Matrix, RecordIn, array, matrix};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<Recursion>()?;
    m.add_class::<Arx>()?;
    m.add_class::<Armax>()?;
    m.add_class::<Oe>()?;
    m.add_class::<Bj>()
}

/// What `ARX`, `ARMAX`, `OE` and `BJ` have in common.
///
/// Parameters
/// ----------
/// lam : float
///     Forgetting factor in (0, 1]; it remembers about `1 / (1 - lam)` samples, and all of them at 1.
/// offset : bool
///     Whether a constant is estimated, on data less their first sample; it comes back as `offset`.
/// P0 : float or array (n, n), optional
///     Covariance of the start in units of the noise variance, a number times identity; `n` counts
///     the constant, which is last.  None: no knowledge, whatever the units of the signals; `OE` and `BJ`
///     then look at the first 20 samples a parameter, to see how far signals go, and learn them at once.
/// theta0 : array, optional
///     Coefficients to start from; zero by default.
/// Ts : float, optional
///     Sample time in seconds, for `model`; a record that is run brings its own.
/// forgetting, lam0, rho, R1, R2
///     As of `RLS`; where the model is not linear in its parameters, what was learnt with early, wrong ones is
///     forgotten: `lam0` and `rho` are 0.95 and 0.99 with a C, 0.9 and 0.995 with an F, unless given.
/// clip : float or None
///     Cut errors at so many standard deviations; None: never, as the textbooks have it.
/// alarm : bool
///     Watch for steps of the offset, and open the constant alone when one is seen.
/// gate : bool or float, optional
///     Learn only while the input moves: its standard deviation over the window is above this, or
///     with True above 1 % of the largest seen.  None: True if anything is forgotten, else False.
/// window : int, optional
///     Samples of that window; by default twice the memory and the longest lag of the input.
/// P_max : float, optional
///     Bound for the entries of `D` of `P = U D U'`; of a start without knowledge, the start.
///
/// Attributes
/// ----------
/// names : list of str
///     Of the coefficients: a1 ... b1 ... c1 ... d1 ... f1 ...
/// theta, sd : array
///     Coefficients and their standard deviations, infinite before anything is known.
/// P : array (n, n)
///     Their covariance, and the constant's, in units of the noise variance.
/// offset, offset_sd : float
///     `O` in `y = G u + O`, in the signals' units; of an integrator the drift.
/// noise_sd : float
///     Standard deviation of the noise, taken over the last 200 errors.
/// alarms : int
///     Steps of the offset seen so far.
/// samples : int
///     Taken in so far, learnt or not.
/// learnt : bool
///     Whether the last sample was learnt: not while lags are missing, while the input rests, and after
///     an output that was missing.
/// lam, Ts : float
///     Forgetting factor of the next sample; sample time or None.
/// model : PolyModel
///     The model at this moment.
///
/// Notes
/// -----
/// It is a type to test for, and is not made by itself: `ARX`, `ARMAX`, `OE` and `BJ` bring the orders.
/// `copy.deepcopy` and `pickle` keep the state, to the last bit.
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> arx = pt.recursive.ARX(1, 1, 6, lam=0.99, Ts=0.02)
/// >>> isinstance(arx, pt.recursive.Recursion), arx.names, arx.lam
/// (True, ['a1', 'b1'], 0.99)
#[pyclass(module = "plantune._core", subclass)]
pub struct Recursion {
    rpem: Rpem,
    kind: &'static str,
    options: Options,
    Ts: Option<f64>,
}

impl Recursion {
    fn new(kind: &'static str, structure: Structure, keywords: Option<&Bound<'_, PyDict>>) -> Outcome<Self> {
        let (options, start) = Options::read(kind, keywords)?;
        let structure = Structure { offset: options.offset(), ..structure };
        let rpem = Rpem::new(structure, options.settings(structure, &start)?)?;
        Ok(Recursion { rpem, kind, Ts: options.Ts(), options })
    }

    fn orders(&self) -> Vec<usize> {
        let Structure { na, nb, nc, nd, nf, nk, .. } = self.rpem.structure();
        match self.kind {
            "ARX" => vec![na, nb, nk],
            "ARMAX" => vec![na, nb, nc, nk],
            "OE" => vec![nb, nf, nk],
            _ => vec![nb, nc, nd, nf, nk],
        }
    }
}

#[pymethods]
impl Recursion {
    /// Learn from the output `y` read at `t`; `u` is the input applied from `t` on, as in a `Record`.
    ///
    /// Return the prediction error; NaN while lags are missing.  A sample that is refused changes nothing.
    fn step(&mut self, u: f64, y: f64) -> Outcome<f64> {
        Ok(self.rpem.step(u, y)?.unwrap_or(f64::NAN))
    }

    /// Go on without an output: it is missing, or does not count.
    fn skip(&mut self, u: f64) -> Outcome<()> {
        Ok(self.rpem.skip(u)?)
    }

    /// Forget all signals, as after a gap; parameters and covariance go on.
    fn restart(&mut self) {
        self.rpem.restart();
    }

    /// Learn a record and return its `Trace`: `step` in a loop, to the last bit.
    ///
    /// Every segment after a `restart`, the first as well; `skip` where the output does not count.  The trace
    /// keeps every `every`th row, and the last.
    #[pyo3(signature = (rec, every=1))]
    fn run<'py>(slf: &Bound<'py, Self>, rec: &Bound<'py, PyAny>, every: usize) -> Outcome<Bound<'py, PyAny>> {
        let py = slf.py();
        let input: RecordIn<'py> = rec.extract()?;
        // The thresholds that the record was made with.
        let limits: Option<LimitsIn> = rec.getattr("limits")?.extract()?;
        let record = input.view(&limits.map_or_else(Limits::default, Limits::from))?;
        let trace = {
            let this = &mut *slf.try_borrow_mut().map_err(PyErr::from)?;
            if let Some(Ts) = this.Ts.filter(|Ts| *Ts != record.Ts) {
                let needed = format!("{Ts}, the estimator's");
                return Err(Error::argument("Ts", record.Ts, &needed).into());
            }
            this.Ts = Some(record.Ts);
            let rpem = &mut this.rpem;
            py.detach(|| rpem.run(&record, every))?
        };
        let fields = trace_out(py, trace, slf.borrow().rpem.theta().len())?;
        Ok(py.import("plantune.recursive.trace")?.call_method1("from_core", (fields, rec, slf))?)
    }

    #[getter]
    fn names(&self) -> Vec<String> {
        self.rpem.structure().names()
    }

    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.rpem.theta().to_vec())
    }

    #[getter]
    fn sd<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.rpem.sd())
    }

    #[getter]
    fn P<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        matrix(py, self.rpem.P().matrix(), self.rpem.P().n())
    }

    #[getter]
    fn offset(&self) -> f64 {
        self.rpem.offset().0
    }

    #[getter]
    fn offset_sd(&self) -> f64 {
        self.rpem.offset().1
    }

    #[getter]
    fn noise_sd(&self) -> f64 {
        self.rpem.noise_sd()
    }

    #[getter]
    fn alarms(&self) -> usize {
        self.rpem.alarms()
    }

    #[getter]
    fn samples(&self) -> usize {
        self.rpem.samples()
    }

    #[getter]
    fn learnt(&self) -> bool {
        self.rpem.learnt()
    }

    #[getter]
    fn lam(&self) -> f64 {
        self.rpem.forgetting().lambda()
    }

    #[getter]
    fn Ts(&self) -> Option<f64> {
        self.Ts
    }

    #[getter]
    fn model<'py>(&self, py: Python<'py>) -> Outcome<Bound<'py, PyAny>> {
        let Some(Ts) = self.Ts else {
            let text = format!("a model has a sample time, and this {} was given none", self.kind);
            return Err(Error::new("U01", text).remedy("make it with Ts=, or run a record").into());
        };
        let model = ModelOut::from(Model::Poly(self.rpem.model(Ts)));
        Ok(py.import("plantune.models.convert")?.call_method1("from_core", (model,))?)
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = self.options.clone().into_pyobject(py)?;
        if self.kind != "ARMAX" {
            keywords.del_item("method")?;
        }
        Ok((PyTuple::new(py, self.orders())?, keywords))
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> (Option<f64>, Array<'py>) {
        (self.Ts, array(py, self.rpem.state()))
    }

    fn __setstate__(&mut self, state: (Option<f64>, PyArrayLike1<'_, f64, AllowTypeChange>)) -> Outcome<()> {
        self.Ts = state.0;
        Ok(self.rpem.resume(&state.1.as_array().to_vec())?)
    }

    fn __repr__(&self) -> String {
        let orders = self.orders().iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        format!("{}({orders}): {} samples, theta={:?}", self.kind, self.rpem.samples(), self.rpem.theta())
    }
}

/// A number of coefficients, or of samples.
fn order(name: &str, value: &Bound<'_, PyAny>) -> Outcome<usize> {
    Ok(value.extract().map_err(|_| Error::argument(name, value, "a whole number, not negative"))?)
}

/// The dict behind `plantune.recursive.Trace`, but for what the record adds.
#[derive(IntoPyObject)]
struct TraceOut<'py> {
    rows: Bound<'py, PyArray1<i64>>,
    theta: Matrix<'py>,
    sd: Matrix<'py>,
    offset: Array<'py>,
    offset_sd: Array<'py>,
    eps: Array<'py>,
    learnt: Bound<'py, PyArray1<bool>>,
    alarms: Bound<'py, PyArray1<i64>>,
}

fn trace_out<'py>(py: Python<'py>, trace: Trace, n: usize) -> PyResult<TraceOut<'py>> {
    let whole = |rows: Vec<usize>| PyArray1::from_iter(py, rows.into_iter().map(|k| k as i64));
    Ok(TraceOut {
        rows: whole(trace.rows),
        theta: matrix(py, trace.theta, n)?,
        sd: matrix(py, trace.sd, n)?,
        offset: array(py, trace.offset.iter().map(|o| o[0]).collect()),
        offset_sd: array(py, trace.offset.iter().map(|o| o[1]).collect()),
        eps: array(py, trace.eps),
        learnt: PyArray1::from_vec(py, trace.learnt),
        alarms: whole(trace.alarms),
    })
}

/// Recursive ARX, `A(q) y(t) = B(q) u(t - nk) + d + e(t)`.
///
/// With `lam=1` and `clip=None` it is, at every sample, the least squares of `estimate.arx`.
///
/// Parameters
/// ----------
/// na : int
///     Number of a coefficients, >= 0.
/// nb, nk : int
///     Number of b coefficients, >= 1; delay in samples (0 = direct term).
/// **options
///     Those of `Recursion`: `lam offset P0 theta0 Ts forgetting lam0 rho R1 R2 clip alarm gate window P_max`.
///
/// Raises
/// ------
/// UsageError
///     An argument out of its range, a sample that is not finite (U01).
/// NumericsError
///     A sample so large that its square overflows (N02).
///
/// Notes
/// -----
/// Source 000, (2.2-15); source 001, (3.7-7) to (3.7-11); `P` is kept as `U D U'`.  With noise on the
/// output take `ARMAX` or `OE`: here it biases the poles.
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> arx = pt.recursive.ARX(1, 1, 6, lam=0.99)
/// >>> trace = arx.run(pt.datasets.engine_loop())
/// >>> print(arx.model)
/// A(q) y(t) = B(q) u(t - 6) + e(t)
/// A(q) = 1 - 0.874469 q^-1
/// B(q) = -0.745527
/// Ts = 0.02 s
/// >>> round(arx.offset, 3), arx.alarms
/// (583.451, 0)
#[pyclass(name = "ARX", module = "plantune._core", extends = Recursion)]
pub struct Arx;

#[pymethods]
impl Arx {
    #[new]
    #[pyo3(signature = (na, nb, nk=None, **options), text_signature = "(na, nb, nk=1, **options)")]
    fn new(
        na: &Bound<'_, PyAny>,
        nb: &Bound<'_, PyAny>,
        nk: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> Outcome<PyClassInitializer<Self>> {
        let na = order("na", na)?;
        let nb = order("nb", nb)?;
        let nk = nk.map_or(Ok(1), |nk| order("nk", nk))?;
        let structure = Structure { na, nb, nk, ..Structure::default() };
        Ok(PyClassInitializer::from(Recursion::new("ARX", structure, options)?).add_subclass(Arx))
    }
}

/// Recursive ARMAX, `A(q) y(t) = B(q) u(t - nk) + d + C(q) e(t)`.
///
/// Parameters
/// ----------
/// na, nc : int
///     Numbers of a and of c coefficients, >= 0.
/// nb, nk : int
///     Number of b coefficients, >= 1; delay in samples (0 = direct term).
/// method : "rml" or "els"
///     Recursive maximum likelihood, with the gradient filtered by `1/C`; or extended least squares, without:
///     it may fail where `1/C - 1/2` is not positive real.
/// **options
///     Those of `Recursion`: `lam offset P0 theta0 Ts forgetting lam0 rho R1 R2 clip alarm gate window P_max`.
///
/// Raises
/// ------
/// UsageError
///     An argument out of its range, a sample that is not finite (U01).
/// NumericsError
///     A sample so large that its square overflows (N02).
///
/// Notes
/// -----
/// Source 001, (3.7-7) to (3.7-11); Ljung 1999, 11.4 and 11.5.  `C` is kept stable.  White noise on the output
/// of a plant of order n is ARMAX(n, ., n) with `C = A`.
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> rec = pt.datasets.engine_loop(noise_var=1.5)
/// >>> rml = pt.recursive.ARMAX(1, 1, 1, 6, Ts=rec.Ts)
/// >>> for u, y in zip(rec.u[:, 0], rec.y[:, 0]):
/// ...     eps = rml.step(u, y)
/// >>> rml.names, rml.alarms
/// (['a1', 'b1', 'c1'], 0)
/// >>> bool(abs(rml.model.dc_gain() + 5.939) < 0.05)
/// True
#[pyclass(name = "ARMAX", module = "plantune._core", extends = Recursion)]
pub struct Armax;

#[pymethods]
impl Armax {
    #[new]
    #[pyo3(signature = (na, nb, nc, nk=None, **options), text_signature = "(na, nb, nc, nk=1, **options)")]
    fn new(
        na: &Bound<'_, PyAny>,
        nb: &Bound<'_, PyAny>,
        nc: &Bound<'_, PyAny>,
        nk: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> Outcome<PyClassInitializer<Self>> {
        let na = order("na", na)?;
        let nb = order("nb", nb)?;
        let nc = order("nc", nc)?;
        let nk = nk.map_or(Ok(1), |nk| order("nk", nk))?;
        let structure = Structure { na, nb, nc, nk, ..Structure::default() };
        Ok(PyClassInitializer::from(Recursion::new("ARMAX", structure, options)?).add_subclass(Armax))
    }
}

/// Recursive output-error model, `y(t) = B(q)/F(q) u(t - nk) + O + e(t)`.
///
/// Parameters
/// ----------
/// nb, nk : int
///     Number of b coefficients, >= 1; delay in samples (0 = direct term).
/// nf : int
///     Number of f coefficients, >= 0.
/// **options
///     Those of `Recursion`: `lam offset P0 theta0 Ts forgetting lam0 rho R1 R2 clip alarm gate window P_max`.
///
/// Raises
/// ------
/// UsageError
///     An argument out of its range, a sample that is not finite (U01).
/// NumericsError
///     A sample so large that its square overflows (N02).
///
/// Notes
/// -----
/// Ljung 1999, 11.4 and 11.5; the gradient is filtered by `1/F`, which is kept stable.  It passes over outputs
/// that are missing.  In closed loop prefer `ARMAX`: output errors are biased there.
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> oe = pt.recursive.OE(1, 1, 6)
/// >>> trace = oe.run(pt.datasets.engine_loop())
/// >>> dict(zip(oe.names, oe.theta.round(4).tolist()))
/// {'b1': -0.7455, 'f1': -0.8745}
#[pyclass(name = "OE", module = "plantune._core", extends = Recursion)]
pub struct Oe;

#[pymethods]
impl Oe {
    #[new]
    #[pyo3(signature = (nb, nf, nk=None, **options), text_signature = "(nb, nf, nk=1, **options)")]
    fn new(
        nb: &Bound<'_, PyAny>,
        nf: &Bound<'_, PyAny>,
        nk: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> Outcome<PyClassInitializer<Self>> {
        let nb = order("nb", nb)?;
        let nf = order("nf", nf)?;
        let nk = nk.map_or(Ok(1), |nk| order("nk", nk))?;
        let structure = Structure { nb, nf, nk, ..Structure::default() };
        Ok(PyClassInitializer::from(Recursion::new("OE", structure, options)?).add_subclass(Oe))
    }
}

/// Recursive Box-Jenkins model, `y(t) = B(q)/F(q) u(t - nk) + O + C(q)/D(q) e(t)`.
///
/// Parameters
/// ----------
/// nb, nk : int
///     Number of b coefficients, >= 1; delay in samples (0 = direct term).
/// nc, nd, nf : int
///     Numbers of c, d and f coefficients, >= 0.
/// **options
///     Those of `Recursion`: `lam offset P0 theta0 Ts forgetting lam0 rho R1 R2 clip alarm gate window P_max`.
///
/// Raises
/// ------
/// UsageError
///     An argument out of its range, a sample that is not finite (U01).
/// NumericsError
///     A sample so large that its square overflows (N02).
///
/// Notes
/// -----
/// Ljung 1999, (10.53), 11.4 and 11.5; `C`, `D` and `F` are kept stable.
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> bj = pt.recursive.BJ(1, 1, 1, 1, 6)
/// >>> trace = bj.run(pt.datasets.engine_loop(noise_var=1.5))
/// >>> bj.names
/// ['b1', 'c1', 'd1', 'f1']
/// >>> bool(abs(trace.final.dc_gain() + 5.939) < 0.05)
/// True
#[pyclass(name = "BJ", module = "plantune._core", extends = Recursion)]
pub struct Bj;

#[pymethods]
impl Bj {
    #[new]
    #[pyo3(signature = (nb, nc, nd, nf, nk=None, **options), text_signature = "(nb, nc, nd, nf, nk=1, **options)")]
    fn new(
        nb: &Bound<'_, PyAny>,
        nc: &Bound<'_, PyAny>,
        nd: &Bound<'_, PyAny>,
        nf: &Bound<'_, PyAny>,
        nk: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> Outcome<PyClassInitializer<Self>> {
        let nb = order("nb", nb)?;
        let nc = order("nc", nc)?;
        let nd = order("nd", nd)?;
        let nf = order("nf", nf)?;
        let nk = nk.map_or(Ok(1), |nk| order("nk", nk))?;
        let structure = Structure { nb, nc, nd, nf, nk, ..Structure::default() };
        Ok(PyClassInitializer::from(Recursion::new("BJ", structure, options)?).add_subclass(Bj))
    }
}
