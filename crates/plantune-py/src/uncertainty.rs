//! What stands behind the numbers of a fit.

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::batch::{
    self, Bootstrap, BootstrapOptions, Code, Known, Orders, SignPerturbedSums, standard_deviations,
};
use plantune_core::model::derived::{self, Covariance, Curve};
use plantune_core::model::{Model, PolyModel, ProcessModel};
use plantune_core::stats::quantile;
use plantune_core::{Error, Limits, tune};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::model::ModelIn;
use crate::note::NoteOut;
use crate::sim::start;
use crate::values::{Array, LimitsIn, Matrix, RecordIn, array, matrix};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(derived_quantities, m)?)?;
    m.add_function(wrap_pyfunction!(roots_with_sd, m)?)?;
    m.add_function(wrap_pyfunction!(step_with_sd, m)?)?;
    m.add_function(wrap_pyfunction!(bode_with_sd, m)?)?;
    m.add_function(wrap_pyfunction!(scores, m)?)?;
    m.add_function(wrap_pyfunction!(sandwich, m)?)?;
    m.add_function(wrap_pyfunction!(bootstrap, m)?)?;
    m.add_function(wrap_pyfunction!(process_sandwich, m)?)?;
    m.add_function(wrap_pyfunction!(process_bootstrap, m)?)?;
    m.add_function(wrap_pyfunction!(sign_perturbed_sums, m)?)?;
    m.add_function(wrap_pyfunction!(sps_contains, m)?)?;
    m.add_function(wrap_pyfunction!(sps_arx_contains, m)?)?;
    m.add_function(wrap_pyfunction!(sps_arx_box, m)?)
}

type Flat<'py> = PyReadonlyArray1<'py, f64>;

/// Name, value and standard deviation; a bare model has no covariance, and deviations of 0.
#[pyfunction]
fn derived_quantities(model: ModelIn, P: Option<Flat<'_>>) -> Outcome<Vec<(String, f64, f64)>> {
    let sure = vec![0.0; model.0.theta().len().pow(2)];
    let P = P.as_ref().map(|P| P.as_slice()).transpose().map_err(PyErr::from)?;
    Ok(derived::derived(&model.0, &Covariance(P.unwrap_or(&sure)))
        .into_iter()
        .map(|q| (q.name, q.value, q.sd))
        .collect())
}

/// Real part, imaginary part, and the covariance of the two; of the poles, or the zeros from an input.
#[pyfunction]
fn roots_with_sd(
    model: ModelIn,
    P: Flat<'_>,
    zeros_from: Option<usize>,
) -> Outcome<Vec<(f64, f64, Vec<f64>)>> {
    let P = Covariance(P.as_slice().map_err(PyErr::from)?);
    let roots = zeros_from.map_or_else(|| derived::poles(&model.0), |i| derived::zeros(&model.0, i));
    Ok(roots.iter().map(|r| (r.z.re, r.z.im, r.covariance(&P))).collect())
}

type CurveOut<'py> = (Array<'py>, Array<'py>);

fn curve(py: Python<'_>, curve: Curve) -> CurveOut<'_> {
    (array(py, curve.value), array(py, curve.sd))
}

#[pyfunction]
fn step_with_sd<'py>(
    py: Python<'py>,
    model: ModelIn,
    P: Flat<'py>,
    input: usize,
    t: Flat<'py>,
) -> Outcome<CurveOut<'py>> {
    let P = Covariance(P.as_slice().map_err(PyErr::from)?);
    Ok(curve(py, derived::step(&model.0, &P, input, t.as_slice().map_err(PyErr::from)?)))
}

/// Magnitude and phase in degrees.
#[pyfunction]
fn bode_with_sd<'py>(
    py: Python<'py>,
    model: ModelIn,
    P: Flat<'py>,
    input: usize,
    w: Flat<'py>,
) -> Outcome<(CurveOut<'py>, CurveOut<'py>)> {
    let P = Covariance(P.as_slice().map_err(PyErr::from)?);
    let w = w.as_slice().map_err(PyErr::from)?;
    let (magnitude, sd) = derived::bode(&model.0, &P, input, w);
    let phase = tune::phase_deg(&model.0, input, w);
    Ok((curve(py, magnitude), curve(py, Curve { value: phase, sd })))
}

fn poly(model: ModelIn) -> Outcome<PolyModel> {
    match model.0 {
        Model::Poly(m) => Ok(m),
        _ => {
            Err(Error::argument("fit", "of a process model", "of a polynomial model, such as oe or arx")
                .into())
        }
    }
}

/// `psi` (N, n), `eps` (N) and the rows of the record.
#[pyfunction]
fn scores<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: ModelIn,
    offset: Option<f64>,
    x0: &str,
    limits: LimitsIn,
) -> Outcome<(Matrix<'py>, Array<'py>, Vec<usize>)> {
    let record = rec.view(&Limits::from(limits))?;
    let found = batch::scores(&record, &poly(model)?, offset, start(x0)?)?;
    let n = found.n();
    Ok((matrix(py, found.psi, n)?, array(py, found.eps), found.rows))
}

/// Flat covariance, standard deviations of `theta`, factors by which they grew, order of the noise, note.
#[pyfunction]
fn sandwich<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: ModelIn,
    offset: Option<f64>,
    x0: &str,
    limits: LimitsIn,
) -> Outcome<(Matrix<'py>, Array<'py>, NoteOut)> {
    let record = rec.view(&Limits::from(limits))?;
    let (model, start) = (poly(model)?, start(x0)?);
    let found =
        py.detach(|| batch::sandwich(&batch::scores(&record, &model, offset, start)?, &Orders::of(&model)))?;
    let n = model.theta().len();
    let sd = array(py, standard_deviations(&found.P, n));
    let note = NoteOut::from(&found.note());
    let width = found.P.len().isqrt();
    Ok((matrix(py, found.P, width)?, sd, note))
}

/// The dict behind a bootstrap.
#[derive(IntoPyObject)]
struct BootstrapOut<'py> {
    estimates: Matrix<'py>,
    low: Array<'py>,
    high: Array<'py>,
    block: usize,
    P: Matrix<'py>,
    sd: Array<'py>,
}

#[pyfunction]
#[allow(clippy::too_many_arguments)]
fn bootstrap<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: ModelIn,
    offset: Option<f64>,
    x0: &str,
    runs: usize,
    block: Option<usize>,
    seed: u64,
    limits: LimitsIn,
) -> Outcome<BootstrapOut<'py>> {
    let record = rec.view(&Limits::from(limits))?;
    let (model, start) = (poly(model)?, start(x0)?);
    let options = BootstrapOptions { runs, block, seed };
    let found = py.detach(|| batch::bootstrap(&record, &model, offset, start, &options))?;
    bootstrap_out(py, found, model.theta().len())
}

/// `parameters` of the estimates are `theta`, the offset may follow.
fn bootstrap_out(py: Python<'_>, found: Bootstrap, parameters: usize) -> Outcome<BootstrapOut<'_>> {
    let n = found.estimates[0].len();
    let sorted = |j: usize| {
        let mut column: Vec<f64> = found.estimates.iter().map(|e| e[j]).collect();
        column.sort_by(f64::total_cmp);
        column
    };
    let at = |share: f64| (0..n).map(|j| quantile(&sorted(j), share)).collect();
    let P = batch::spread(&found.estimates);
    Ok(BootstrapOut {
        low: array(py, at(0.025)),
        high: array(py, at(0.975)),
        block: found.block,
        sd: array(py, standard_deviations(&P, parameters)),
        P: matrix(py, P, n)?,
        estimates: matrix(py, found.estimates.concat(), n)?,
    })
}

/// What is known of a process fit, by attribute.
#[derive(FromPyObject)]
struct KnownIn {
    codes: Vec<String>,
    plants: Vec<ModelIn>,
    c: Vec<f64>,
    d: Vec<f64>,
    N: usize,
    loss: f64,
    offset: bool,
    steps: Vec<usize>,
}

impl KnownIn {
    /// Calls `use_it` with the codes and what is known of the fit.
    fn with<T>(&self, use_it: impl FnOnce(&[Code], &Known) -> plantune_core::Result<T>) -> Outcome<T> {
        let codes: Vec<Code> =
            self.codes.iter().map(|c| Code::read(c)).collect::<plantune_core::Result<_>>()?;
        let plants: Vec<ProcessModel> = self.plants.iter().filter_map(|m| process_model(&m.0)).collect();
        let Self { c, d, N, loss, offset, steps, .. } = self;
        let known = Known { plants: &plants, noise: (c, d), N: *N, loss: *loss, offset: *offset, steps };
        Ok(use_it(&codes, &known)?)
    }
}

fn process_model(model: &Model) -> Option<ProcessModel> {
    match model {
        Model::Process(m) => Some(m.clone()),
        _ => None,
    }
}

/// Flat covariance, standard deviations, factors by which they grew, note; `P` is that of the fit.
#[pyfunction]
fn process_sandwich<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    known: KnownIn,
    P: Flat<'py>,
    limits: LimitsIn,
) -> Outcome<(Matrix<'py>, Array<'py>, Array<'py>, NoteOut)> {
    let limits = Limits::from(limits);
    let record = rec.view(&limits)?;
    let P = P.as_slice().map_err(PyErr::from)?;
    let found = known
        .with(|codes, known| py.detach(|| batch::process_sandwich(&record, codes, known, P, &limits)))?;
    let width = found.P.len().isqrt();
    let sd = array(py, standard_deviations(&found.P, width - usize::from(known.offset)));
    let note = NoteOut::from(&found.note());
    Ok((matrix(py, found.P, width)?, sd, array(py, found.widening), note))
}

/// `bootstrap` of a process fit with `parameters` in `theta`.
#[pyfunction]
fn process_bootstrap<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    known: KnownIn,
    options: (usize, Option<usize>, u64),
    limits: LimitsIn,
) -> Outcome<BootstrapOut<'py>> {
    let limits = Limits::from(limits);
    let record = rec.view(&limits)?;
    let (runs, block, seed) = options;
    let options = BootstrapOptions { runs, block, seed };
    let found = known.with(|codes, known| {
        py.detach(|| batch::process_bootstrap(&record, codes, known, &options, &limits))
    })?;
    let parameters = found.estimates[0].len() - usize::from(known.offset);
    bootstrap_out(py, found, parameters)
}

fn sums(
    phi: &PyReadonlyArray2<'_, f64>,
    y: &Flat<'_>,
    sizes: (usize, usize),
    seed: u64,
) -> Outcome<SignPerturbedSums> {
    let (n, phi) = (phi.shape()[1], phi.as_slice().map_err(PyErr::from)?);
    Ok(batch::sign_perturbed_sums(phi, n, y.as_slice().map_err(PyErr::from)?, sizes, seed)?)
}

/// The estimate, half widths of the ellipsoid along each parameter, its matrix and radius.
#[pyfunction]
fn sign_perturbed_sums<'py>(
    py: Python<'py>,
    phi: PyReadonlyArray2<'py, f64>,
    y: Flat<'py>,
    sizes: (usize, usize),
    seed: u64,
) -> Outcome<(Array<'py>, Array<'py>, f64)> {
    let found = sums(&phi, &y, sizes, seed)?;
    let (half, radius) = (array(py, found.half_widths()), found.radius());
    Ok((array(py, found.theta), half, radius))
}

/// Which of the rows of `thetas` are inside.
#[pyfunction]
fn sps_contains(
    phi: PyReadonlyArray2<'_, f64>,
    y: Flat<'_>,
    thetas: Vec<Vec<f64>>,
    sizes: (usize, usize),
    seed: u64,
) -> Outcome<Vec<bool>> {
    let found = sums(&phi, &y, sizes, seed)?;
    Ok(thetas.iter().map(|theta| found.contains(theta)).collect::<Result<_, _>>()?)
}

/// The same for an ARX model on a record; a row is `theta`, then the constant where there is one.
#[pyfunction]
fn sps_arx_contains(
    py: Python<'_>,
    rec: RecordIn<'_>,
    model: ModelIn,
    thetas: Vec<Vec<f64>>,
    sizes: (usize, usize),
    seed: u64,
    limits: LimitsIn,
) -> Outcome<Vec<bool>> {
    let record = rec.view(&Limits::from(limits))?;
    let orders = Orders::of(&poly(model)?);
    let inside = |theta: &Vec<f64>| batch::arx_contains(&record, &orders, theta, sizes, seed);
    Ok(py.detach(|| thetas.iter().map(inside).collect::<Result<_, _>>())?)
}

/// Estimate by least squares, the constant last where there is one, and the ends of the region along each entry.
#[pyfunction]
fn sps_arx_box<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: ModelIn,
    offset: Option<f64>,
    sizes: (usize, usize),
    seed: u64,
    limits: LimitsIn,
) -> Outcome<(Array<'py>, Array<'py>, Array<'py>)> {
    let record = rec.view(&Limits::from(limits))?;
    let model = poly(model)?;
    let constant = offset.map(|O| O * model.A.iter().sum::<f64>());
    let theta: Vec<f64> = model.theta().into_iter().chain(constant).collect();
    let orders = Orders::of(&model);
    let ends = py.detach(|| batch::arx_box(&record, &orders, &theta, sizes, seed))?;
    let (low, high): (Vec<f64>, Vec<f64>) = ends.into_iter().unzip();
    Ok((array(py, theta), array(py, low), array(py, high)))
}
