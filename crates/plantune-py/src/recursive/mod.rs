//! Estimators that learn one sample at a time: compiled classes, since a wrapper would cost more than a sample.

mod family;
mod inverse_transform;
mod options;
mod rls;
mod term_arx;

use pyo3::prelude::*;

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<rls::Rls>()?;
    m.add_class::<term_arx::TermArx>()?;
    m.add_class::<inverse_transform::InverseTransform>()?;
    family::register(m)
}
