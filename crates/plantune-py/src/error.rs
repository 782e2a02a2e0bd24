//! One way from a core error to a Python exception.

use plantune_core::{Error, Note};
use pyo3::prelude::*;

use crate::note::NoteOut;

/// A core error on its way out, with a partial result that may be studied.
pub struct Raise {
    error: Box<Error>,
    result: Option<Py<PyAny>>,
}

/// What every glue function returns.
pub type Outcome<T> = Result<T, Raise>;

impl Raise {
    pub fn with_result(error: Error, result: Option<Py<PyAny>>) -> Self {
        Raise { error: Box::new(error), result }
    }
}

impl From<Error> for Raise {
    fn from(error: Error) -> Self {
        Raise { error: Box::new(error), result: None }
    }
}

impl From<PyErr> for Raise {
    fn from(error: PyErr) -> Self {
        // A conversion that failed: a wrong argument.
        Error::new("U01", error.to_string()).into()
    }
}

impl From<Raise> for PyErr {
    fn from(raise: Raise) -> Self {
        Python::attach(|py| match exception(py, &raise) {
            Ok(value) => PyErr::from_value(value),
            Err(error) => error,
        })
    }
}

/// `plantune.errors.from_core(note, result)` picks the class by the code.
fn exception<'py>(py: Python<'py>, raise: &Raise) -> PyResult<Bound<'py, PyAny>> {
    let note: &Note = raise.error.note();
    let result = raise.result.as_ref().map(|r| r.clone_ref(py));
    py.import("plantune.errors")?.call_method1("from_core", (NoteOut::from(note), result))
}
