//! Models with regressors of one's own.

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::batch;
use plantune_core::model::{Own, Term, TermModel};
use plantune_core::validate;
use plantune_core::{Error, Limits};
use pyo3::prelude::*;

use crate::batch::{FitOut, OrdersIn, run};
use crate::error::Outcome;
use crate::validate::{VerdictOut, checked};
use crate::values::{Array, LimitsIn, RecordIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(term_arx, m)?)?;
    m.add_function(wrap_pyfunction!(check_terms, m)?)?;
    m.add_function(wrap_pyfunction!(term_simulate, m)?)?;
    m.add_function(wrap_pyfunction!(term_check, m)?)?;
    m.add_function(wrap_pyfunction!(term_over_record, m)?)
}

/// A regressor by name, or which of the given columns it is.
type OwnIn = (String, Option<usize>);

fn own(regressors: Vec<OwnIn>, names: &[String]) -> plantune_core::Result<Vec<Own>> {
    let each = |(text, column): OwnIn| match column {
        None => Ok(Own::Term(Term::parse(&text, names)?)),
        Some(column) => Ok(Own::Column(text, column)),
    };
    regressors.into_iter().map(each).collect()
}

/// Reads terms by name (U01).
pub fn terms(texts: &[String], names: &[String]) -> plantune_core::Result<Vec<Term>> {
    texts.iter().map(|text| Term::parse(text, names)).collect()
}

/// Refuses terms that cannot be read; `names` are those of the inputs, then of the output.
#[pyfunction]
fn check_terms(texts: Vec<String>, names: Vec<String>) -> Outcome<()> {
    terms(&texts, &names)?;
    Ok(())
}

/// `plantune.models.TermModel`, by attribute.
#[derive(FromPyObject)]
struct TermModelIn {
    A: Vec<f64>,
    B: Vec<Vec<f64>>,
    nk: Vec<usize>,
    regressors: Vec<OwnIn>,
    g: Vec<f64>,
    d: f64,
    names: Vec<String>,
}

impl TermModelIn {
    fn model(self) -> Outcome<TermModel> {
        let TermModelIn { A, B, nk, regressors, g, d, names } = self;
        Ok(TermModel { A, B, nk, own: own(regressors, &names)?, g, d })
    }
}

/// Fields of `Fit`; its model has one input more for each regressor, its offset is the constant.
#[pyfunction]
fn term_arx<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    orders: OrdersIn,
    regressors: Vec<OwnIn>,
    given: PyReadonlyArray2<'py, f64>,
    offset: bool,
    limits: LimitsIn,
) -> Outcome<FitOut<'py>> {
    let own = own(regressors, &rec.names())?;
    let (orders, given) = (orders.into(), given.as_slice().map_err(PyErr::from)?);
    run(py, &rec, limits, |record, limits| batch::term_arx(record, &orders, &own, given, offset, limits))
}

/// Output for the input `u (N, nu)` and the given columns, from the outputs `y` that are known.
#[pyfunction]
fn term_simulate<'py>(
    py: Python<'py>,
    model: Bound<'py, PyAny>,
    u: PyReadonlyArray2<'py, f64>,
    given: PyReadonlyArray2<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
) -> Outcome<Array<'py>> {
    let model = model.getattr("core")?.extract::<TermModelIn>()?.model()?;
    if u.shape()[1] != model.B.len() {
        let needed = format!("{} columns", model.B.len());
        return Err(Error::argument("u", format!("{} columns", u.shape()[1]), &needed).into());
    }
    let (u, given) = (u.as_slice().map_err(PyErr::from)?, given.as_slice().map_err(PyErr::from)?);
    let known = y.as_slice().map_err(PyErr::from)?.to_vec();
    let y = py.detach(|| model.simulate(u, given, known))?;
    Ok(array(py, y))
}

/// Rows with history, and the output predicted there.
#[pyfunction]
fn term_over_record<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: Bound<'py, PyAny>,
    given: PyReadonlyArray2<'py, f64>,
    horizon: Option<usize>,
    limits: LimitsIn,
) -> Outcome<(Vec<usize>, Array<'py>)> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let model = model.getattr("core")?.extract::<TermModelIn>()?.model()?;
    let given = given.as_slice().map_err(PyErr::from)?;
    let (rows, yhat) = py.detach(|| model.over_record(&record, given, horizon))?;
    Ok((rows, array(py, yhat)))
}

/// Fields of `Verdict`, run from the first rows of each segment.
#[pyfunction]
fn term_check<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: Bound<'py, PyAny>,
    given: PyReadonlyArray2<'py, f64>,
    lags: usize,
    limits: LimitsIn,
) -> Outcome<VerdictOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let model = model.getattr("core")?.extract::<TermModelIn>()?.model()?;
    let given = given.as_slice().map_err(PyErr::from)?;
    checked(py, py.detach(|| validate::check_terms(&model, given, &record, lags, &limits)))
}
