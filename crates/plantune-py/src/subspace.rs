//! Subspace identification, and what a model by states is asked.

use numpy::{Complex64, PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use plantune_core::batch::{self, BootstrapOptions, Method, PbsidOptions, SubspaceOptions, Variant};
use plantune_core::model::{self, Model, StateSpace};
use plantune_core::stats::deviation;
use plantune_core::{Error, Limits};
use pyo3::prelude::*;

use crate::batch::{FitOut, states_fit_out};
use crate::error::Outcome;
use crate::matrix::{StateSpaceIn, StateSpaceOut};
use crate::model::{ModelIn, ModelOut};
use crate::note::{NoteOut, notes};
use crate::values::{Array, LimitsIn, RecordIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(subspace, m)?)?;
    m.add_function(wrap_pyfunction!(subspace_bands, m)?)?;
    m.add_function(wrap_pyfunction!(deviations, m)?)?;
    m.add_function(wrap_pyfunction!(pbsid, m)?)?;
    m.add_function(wrap_pyfunction!(subspace_frequency, m)?)?;
    m.add_function(wrap_pyfunction!(states_of, m)?)?;
    m.add_function(wrap_pyfunction!(states_polynomial, m)?)?;
    m.add_function(wrap_pyfunction!(states_sampled, m)?)?;
    m.add_function(wrap_pyfunction!(states_continuous, m)?)?;
    m.add_function(wrap_pyfunction!(states_zeros, m)?)?;
    m.add_function(wrap_pyfunction!(states_simulate, m)?)?;
    m.add_function(wrap_pyfunction!(states_reduced, m)?)
}

/// Settings of `plantune.estimate.subspace`, by attribute.
#[derive(FromPyObject)]
struct SubspaceIn {
    rows: usize,
    method: String,
    variant: String,
    stable: bool,
    direct: bool,
    offset: bool,
}

impl SubspaceIn {
    fn options(&self) -> plantune_core::Result<SubspaceOptions> {
        let method = match self.method.as_str() {
            "moesp" => Method::Moesp,
            "n4sid" => Method::N4sid,
            "cva" => Method::Cva,
            other => {
                let needed = "\"moesp\", \"n4sid\" or \"cva\"";
                return Err(Error::argument("method", format!("\"{other}\""), needed));
            }
        };
        let variant = match self.variant.as_str() {
            "simulation" => Variant::Simulation,
            "states" => Variant::States,
            "combined" => Variant::Combined,
            other => {
                let needed = "\"simulation\", \"states\" or \"combined\"";
                return Err(Error::argument("variant", format!("\"{other}\""), needed));
            }
        };
        let SubspaceIn { rows, stable, direct, offset, .. } = *self;
        Ok(SubspaceOptions { rows, method, variant, stable, direct, offset })
    }
}

/// The fit, and `n, V, bic` of every order tried.
/// `n, V, bic` of every order tried.
type Tried = Vec<(usize, f64, f64)>;

#[pyfunction]
fn subspace<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    n: Option<usize>,
    options: SubspaceIn,
    limits: LimitsIn,
) -> Outcome<(FitOut<'py>, Tried)> {
    let limits: Limits = limits.into();
    let (record, options) = (rec.view(&limits)?, options.options()?);
    let fit = py.detach(|| batch::subspace(&record, n, options, &limits))?;
    let tried = fit.tried.iter().map(|t| (t.n, t.V, t.bic)).collect();
    Ok((states_fit_out(py, fit, record.row_ranges())?, tried))
}

/// Models of drawn records, the offset of each, and the rows in a block; `draws` are `runs, block, seed`.
#[pyfunction]
fn subspace_bands(
    py: Python<'_>,
    rec: RecordIn<'_>,
    fitted: (StateSpaceIn<'_>, Vec<f64>),
    options: SubspaceIn,
    draws: (usize, Option<usize>, u64),
    limits: LimitsIn,
) -> Outcome<(Vec<StateSpaceOut>, Vec<Vec<f64>>, usize)> {
    let limits: Limits = limits.into();
    let (record, options) = (rec.view(&limits)?, options.options()?);
    let (model, offset) = (StateSpace::from(fitted.0), fitted.1);
    let (runs, block, seed) = draws;
    let draws = BootstrapOptions { runs, block, seed };
    let run = || batch::subspace_bands(&record, (&model, &offset), options, &draws, &limits);
    let (fits, block) = py.detach(run)?;
    let (models, offsets) = fits.into_iter().map(|fit| (fit.model.into(), fit.offset)).unzip();
    Ok((models, offsets, block))
}

/// Standard deviation of each column.
#[pyfunction]
fn deviations<'py>(py: Python<'py>, rows: PyReadonlyArray2<'py, f64>) -> Array<'py> {
    let rows = rows.as_array();
    array(py, rows.columns().into_iter().map(|column| deviation(column.iter().copied())).collect())
}

#[pyfunction]
fn pbsid<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    n: usize,
    blocks: (usize, usize),
    terms: (bool, bool),
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let ((past, future), (direct, offset)) = (blocks, terms);
    let options = PbsidOptions { past, future, direct, offset };
    let fit = py.detach(|| batch::pbsid(&record, n, options, &limits))?;
    Ok(states_fit_out(py, fit, record.row_ranges())?)
}

/// The dict behind `plantune.estimate.FrequencyFit(**d)`.
#[derive(IntoPyObject)]
struct FrequencyFitOut<'py> {
    model: ModelOut,
    singular_values: Array<'py>,
    block_rows: usize,
    loss: f64,
    notes: Vec<NoteOut>,
}

/// `G` row-major, `(len(w), ny, nu)`.
#[pyfunction]
fn subspace_frequency<'py>(
    py: Python<'py>,
    w: PyReadonlyArray1<'py, f64>,
    G: PyReadonlyArray1<'py, Complex64>,
    size: (usize, usize),
    Ts: Option<f64>,
    n: Option<usize>,
    stable: bool,
) -> Outcome<FrequencyFitOut<'py>> {
    let (w, G) = (w.as_slice().map_err(PyErr::from)?, G.as_slice().map_err(PyErr::from)?);
    let fit = py.detach(|| batch::subspace_frequency(w, G, size, Ts, n, stable))?;
    Ok(FrequencyFitOut {
        model: ModelOut::States(fit.model.into()),
        singular_values: array(py, fit.singular_values),
        block_rows: fit.rows,
        loss: fit.loss,
        notes: notes(&fit.notes),
    })
}

/// A polynomial model by states.
#[pyfunction]
fn states_of(model: ModelIn) -> Outcome<StateSpaceOut> {
    match &model.0 {
        Model::Poly(m) => Ok(StateSpace::of_polynomial(m).into()),
        _ => Err(Error::argument("model", "in continuous time", "a sampled one; c2d gives one").into()),
    }
}

/// A model by states of one output as a polynomial model.
#[pyfunction]
fn states_polynomial(model: StateSpaceIn) -> Outcome<ModelOut> {
    Ok(Model::Poly(StateSpace::from(model).polynomial()?).into())
}

#[pyfunction]
fn states_sampled(model: StateSpaceIn, Ts: f64) -> Outcome<StateSpaceOut> {
    Ok(StateSpace::from(model).sampled(Ts)?.into())
}

#[pyfunction]
fn states_continuous(model: StateSpaceIn) -> Outcome<StateSpaceOut> {
    Ok(StateSpace::from(model).continuous()?.into())
}

/// Of the whole model, or of one output and input.
#[pyfunction]
fn states_zeros<'py>(
    py: Python<'py>,
    model: StateSpaceIn,
    pair: Option<(usize, usize)>,
) -> Outcome<Bound<'py, PyArray1<Complex64>>> {
    let model = StateSpace::from(model);
    let zeros = pair.map_or(model.zeros(), |(i, j)| model.pair(i, j).zeros())?;
    Ok(PyArray1::from_iter(py, zeros.into_iter().map(|(re, im)| Complex64::new(re, im))))
}

/// From a state on; `(N, ny)`, row-major.
#[pyfunction]
fn states_simulate<'py>(
    py: Python<'py>,
    model: StateSpaceIn,
    u: PyReadonlyArray1<'py, f64>,
    x0: Vec<f64>,
) -> Outcome<Array<'py>> {
    let (model, u) = (StateSpace::from(model), u.as_slice().map_err(PyErr::from)?);
    Ok(array(py, py.detach(|| model.simulate(u, &x0))))
}

/// The reduced model, the Hankel singular values and the bound of the error.
#[pyfunction]
fn states_reduced<'py>(
    py: Python<'py>,
    model: StateSpaceIn,
    n: usize,
) -> Outcome<(StateSpaceOut, Array<'py>, f64)> {
    let reduced = model::reduce(&StateSpace::from(model), n)?;
    Ok((reduced.model.into(), array(py, reduced.hankel), reduced.bound))
}
