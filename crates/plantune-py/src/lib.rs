//! Glue: reads Python values by attribute, calls the core without the interpreter lock, returns plain dicts.
//!
//! One function per verb, one file per folder of the core.

// The field's letters keep their case, here as in the core.
#![allow(non_snake_case)]
#![allow(missing_docs)]

mod adapt;
mod analyze;
mod bank;
mod batch;
mod error;
mod experiment;
mod forecast;
mod forms;
mod freqresp;
mod hysteresis;
mod matrix;
mod model;
mod note;
mod recursive;
mod sight;
mod signal;
mod sim;
mod step_modes;
mod subspace;
mod terms;
mod tune;
mod uncertainty;
mod validate;
mod values;

use pyo3::prelude::*;

#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    for register in [
        values::register,
        signal::register,
        model::register,
        freqresp::register,
        matrix::register,
        sim::register,
        forecast::register,
        batch::register,
        terms::register,
        uncertainty::register,
        step_modes::register,
        subspace::register,
        recursive::register,
        bank::register,
        hysteresis::register,
        analyze::register,
        experiment::register,
        sight::register,
        validate::register,
        tune::register,
        forms::register,
        adapt::register,
    ] {
        register(m)?;
    }
    Ok(())
}
