//! Signals.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::signal;
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::values::{Array, LimitsIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(prbs, m)?)?;
    m.add_function(wrap_pyfunction!(envelope, m)?)?;
    m.add_function(wrap_pyfunction!(uniform_step, m)?)?;
    m.add_function(wrap_pyfunction!(steps, m)?)?;
    m.add_function(wrap_pyfunction!(resample, m)?)?;
    m.add_function(wrap_pyfunction!(remove_means, m)?)
}

#[pyfunction]
fn prbs(py: Python<'_>, n: usize, hold: usize, bits: u32, seed: u64) -> Outcome<Array<'_>> {
    Ok(array(py, signal::prbs(n, hold, bits, seed)?))
}

/// Rows worth drawing.
#[pyfunction]
fn envelope<'py>(
    py: Python<'py>,
    y: PyReadonlyArray1<'py, f64>,
    start: usize,
    end: usize,
    buckets: usize,
) -> Outcome<Bound<'py, PyArray1<usize>>> {
    let rows = signal::envelope(y.as_slice().map_err(PyErr::from)?, start..end, buckets);
    Ok(PyArray1::from_vec(py, rows))
}

#[pyfunction]
fn uniform_step(t: PyReadonlyArray1<'_, f64>, limits: LimitsIn) -> Outcome<f64> {
    Ok(signal::uniform_step(t.as_slice().map_err(PyErr::from)?, &limits.into())?)
}

/// The dict behind `plantune.inspection.Stamps(**d)`.
#[derive(IntoPyObject)]
struct StepsOut {
    step: f64,
    p1: f64,
    p99: f64,
    gaps: usize,
    back: usize,
}

/// What the steps between stamps look like; none of fewer than two.
#[pyfunction]
fn steps(t: PyReadonlyArray1<'_, f64>) -> Outcome<Option<StepsOut>> {
    let found = signal::steps(t.as_slice().map_err(PyErr::from)?);
    Ok(found.map(|s| StepsOut { step: s.step, p1: s.p1, p99: s.p99, gaps: s.gaps, back: s.back }))
}

/// Columns, starts and original rows on the new grid.
type ResampledOut<'py> = (Array<'py>, Vec<Array<'py>>, Vec<usize>, Bound<'py, PyArray1<i64>>);

#[pyfunction]
fn resample<'py>(
    py: Python<'py>,
    t: PyReadonlyArray1<'py, f64>,
    columns: Vec<Vec<f64>>,
    held: Vec<bool>,
    Ts: f64,
) -> Outcome<ResampledOut<'py>> {
    let out = signal::resample(t.as_slice().map_err(PyErr::from)?, &columns, &held, Ts)?;
    let columns = out.columns.into_iter().map(|c| array(py, c)).collect();
    Ok((array(py, out.t), columns, out.starts, PyArray1::from_vec(py, out.rows)))
}

/// `x` without the mean of each column over the rows that count, and these means.
#[pyfunction]
fn remove_means<'py>(
    py: Python<'py>,
    x: PyReadonlyArray2<'py, f64>,
    valid: PyReadonlyArray2<'py, bool>,
) -> Outcome<(Bound<'py, PyArray2<f64>>, Vec<f64>)> {
    let (rows, width) = (x.shape()[0], x.shape()[1]);
    let (x, valid) = (x.as_slice().map_err(PyErr::from)?, valid.as_slice().map_err(PyErr::from)?);
    let means = signal::means(x, width, |k, i| valid[k * width + i]);
    let without = PyArray1::from_vec(py, signal::without_levels(x, &means));
    Ok((without.reshape([rows, width]).map_err(crate::error::Raise::from)?, means))
}
