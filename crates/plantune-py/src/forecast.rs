//! Forecasts behind the last row of a record.

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::sim::Forecaster;
use plantune_core::{Error, Limits};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::model::ModelIn;
use crate::values::{Array, LimitsIn, RecordIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(forecast, m)?)
}

/// Output to come and its standard deviation; `P` flat, empty without the part of the parameters.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // one function of Python
fn forecast<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: ModelIn,
    u: PyReadonlyArray2<'py, f64>,
    offset: f64,
    P: PyReadonlyArray1<'py, f64>,
    loss: f64,
    N: usize,
    parameters: usize,
    limits: LimitsIn,
) -> Outcome<(Array<'py>, Array<'py>)> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    if u.shape()[1] != record.nu {
        let needed = format!("of shape (K, {}), one row for each step ahead", record.nu);
        return Err(Error::argument("u_future", format!("of shape {:?}", u.shape()), &needed).into());
    }
    let (P, u) = (P.as_slice().map_err(PyErr::from)?, u.as_slice().map_err(PyErr::from)?);
    let forecaster =
        Forecaster { model: &model.0, offset, P, variance: Forecaster::variance(loss, N, parameters) };
    let ahead = py.detach(|| forecaster.forecast(&record, u))?;
    Ok((array(py, ahead.y), array(py, ahead.sd)))
}
