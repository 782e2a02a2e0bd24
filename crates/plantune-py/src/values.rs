//! Records, limits, models and notes across the border.

use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use plantune_core::record::fingerprint;
use plantune_core::{Limits, Record};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::Outcome;

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(check_record, m)?)?;
    m.add_function(wrap_pyfunction!(is_irregular, m)?)?;
    m.add_function(wrap_pyfunction!(mean_step, m)?)?;
    m.add_function(wrap_pyfunction!(default_limits, m)?)
}

/// A `plantune.Record`, by attribute.
#[derive(FromPyObject)]
pub struct RecordIn<'py> {
    u: PyReadonlyArray2<'py, f64>,
    y: PyReadonlyArray2<'py, f64>,
    Ts: f64,
    t0: f64,
    starts: PyReadonlyArray1<'py, i64>,
    valid: PyReadonlyArray2<'py, bool>,
    rows: PyReadonlyArray1<'py, i64>,
    t: Option<PyReadonlyArray1<'py, f64>>,
    u_names: Vec<String>,
    y_names: Vec<String>,
}

impl RecordIn<'_> {
    /// Names of the inputs, then of the outputs.
    pub fn names(&self) -> Vec<String> {
        [self.u_names.as_slice(), self.y_names.as_slice()].concat()
    }

    /// The core's view of the same memory, checked; refused where its stamps are not uniform (D15).
    pub fn view(&self, limits: &Limits) -> Outcome<Record<'_>> {
        let record = self.view_of_any_stamps(limits)?;
        record.check_uniform(limits)?;
        Ok(record)
    }

    /// The same for what can serve stamps that are not uniform.
    pub fn view_of_any_stamps(&self, limits: &Limits) -> Outcome<Record<'_>> {
        let valid = self.valid.as_slice().map_err(PyErr::from)?;
        let record = Record {
            u: self.u.as_slice().map_err(PyErr::from)?,
            y: self.y.as_slice().map_err(PyErr::from)?,
            nu: self.u.shape()[1],
            ny: self.y.shape()[1],
            Ts: self.Ts,
            t0: self.t0,
            starts: self.starts.as_array().iter().map(|&s| s as usize).collect(),
            valid: if valid.iter().fold(true, |all, v| all & v) { None } else { Some(valid) },
            weights: None,
            rows: Some(self.rows.as_slice().map_err(PyErr::from)?),
            t: self.t.as_ref().map(|t| t.as_slice()).transpose().map_err(PyErr::from)?,
            names: self.names(),
        };
        Ok(record.checked(limits)?)
    }
}

/// `plantune.Limits`, by attribute.
#[derive(FromPyObject)]
pub struct LimitsIn {
    D07: f64,
    D08: f64,
    D15: f64,
    D18: f64,
    D19: f64,
    X01: f64,
    X02: f64,
    X03: f64,
    X04: f64,
    X05: f64,
    X06: f64,
    X07: f64,
    X08: f64,
    X10: f64,
    N03: f64,
    F02: f64,
    M03: f64,
    M03_most: f64,
    M04: f64,
    M05: f64,
    M06: f64,
    M09: f64,
    V01: f64,
    V03: f64,
    V04: f64,
    V06: f64,
    V07: f64,
    V09: f64,
    V10: f64,
    V11: f64,
    V13: f64,
    V16: f64,
    X12: f64,
    T04: f64,
    C07: f64,
    C07_phase: f64,
}

impl From<LimitsIn> for Limits {
    fn from(l: LimitsIn) -> Self {
        Limits {
            D07: l.D07,
            D08: l.D08,
            D15: l.D15,
            D18: l.D18,
            D19: l.D19,
            X01: l.X01,
            X02: l.X02,
            X03: l.X03,
            X04: l.X04,
            X05: l.X05,
            X06: l.X06,
            X07: l.X07,
            X08: l.X08,
            X10: l.X10,
            N03: l.N03,
            F02: l.F02,
            M03: l.M03,
            M03_most: l.M03_most,
            M04: l.M04,
            M05: l.M05,
            M06: l.M06,
            M09: l.M09,
            V01: l.V01,
            V03: l.V03,
            V04: l.V04,
            V06: l.V06,
            V07: l.V07,
            V09: l.V09,
            V10: l.V10,
            V11: l.V11,
            V13: l.V13,
            V16: l.V16,
            X12: l.X12,
            T04: l.T04,
            C07: l.C07,
            C07_phase: l.C07_phase,
        }
    }
}

pub type Array<'py> = Bound<'py, PyArray1<f64>>;

/// Numbers up to which an array of its own is made sooner than one around the vector, which needs an owner.
const FEW: usize = 256;

pub fn array<'py>(py: Python<'py>, x: Vec<f64>) -> Array<'py> {
    if x.len() <= FEW { PyArray1::from_slice(py, &x) } else { PyArray1::from_vec(py, x) }
}

/// An array `(N, width)`.
pub type Matrix<'py, T = f64> = Bound<'py, PyArray2<T>>;

/// Numbers on their way to an array that cannot be written.
pub struct Frozen(pub Vec<f64>);

impl<'py> IntoPyObject<'py> for Frozen {
    type Target = PyArray1<f64>;
    type Output = Array<'py>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Array<'py>> {
        let array = array(py, self.0);
        array.try_readwrite().map_err(PyErr::from)?.make_nonwriteable();
        Ok(array)
    }
}

/// Row-major numbers as an array `(N, width)`.
pub fn matrix<T: numpy::Element>(py: Python<'_>, x: Vec<T>, width: usize) -> PyResult<Matrix<'_, T>> {
    let rows = x.len() / width.max(1);
    let array = Array2::from_shape_vec((rows, width), x).map_err(|e| PyValueError::new_err(e.to_string()))?;
    Ok(if array.len() <= FEW {
        PyArray2::from_array(py, &array)
    } else {
        PyArray2::from_owned_array(py, array)
    })
}

/// Checks a record and returns the fingerprint of its numbers.
#[pyfunction]
fn check_record(py: Python<'_>, rec: RecordIn<'_>, limits: LimitsIn) -> Outcome<String> {
    let record = rec.view_of_any_stamps(&limits.into())?;
    Ok(py.detach(|| fingerprint(&record)))
}

/// Mean step between stamps within segments, which begin at `starts`.
#[pyfunction]
fn mean_step(t: PyReadonlyArray1<'_, f64>, starts: Vec<usize>) -> Outcome<Option<f64>> {
    Ok(plantune_core::record::mean_step(t.as_slice().map_err(PyErr::from)?, &starts))
}

/// Whether the stamps of a record are not uniform.
#[pyfunction]
fn is_irregular(rec: RecordIn<'_>, limits: LimitsIn) -> Outcome<bool> {
    let limits = limits.into();
    Ok(rec.view_of_any_stamps(&limits)?.is_irregular(&limits))
}

/// Every threshold by its code.
#[pyfunction]
fn default_limits(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let limits = PyDict::new(py);
    for (code, value) in Limits::default().items() {
        limits.set_item(code, value)?;
    }
    Ok(limits)
}
