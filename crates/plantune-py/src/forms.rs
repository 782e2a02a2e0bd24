//! PID forms and faceplates.

use plantune_core::Error;
use plantune_core::model::Pid;
use plantune_core::tune::forms::{
    self, Faceplate, Form, GainScale, Quantity, Refused, Rounding, Scale, Setting, Settings, Unit,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{Outcome, Raise};
use crate::model::{PidIn, gains_of};
use crate::note::{NoteOut, notes};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(to_form, m)?)?;
    m.add_function(wrap_pyfunction!(from_form, m)?)?;
    m.add_function(wrap_pyfunction!(enter, m)?)
}

const FORMS: [Form; 5] = [Form::Ideal, Form::Parallel, Form::Series, Form::Pb, Form::Velocity];

fn form_of(name: &str) -> Outcome<Form> {
    FORMS.into_iter().find(|form| form.name() == name).ok_or_else(|| {
        let known = FORMS.map(Form::name).join(", ");
        Error::argument("form", format!("\"{name}\""), &format!("one of {known}")).into()
    })
}

/// Settings by their letters.
fn lettered<'py>(py: Python<'py>, form: Form, settings: Settings) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (letter, value) in form.letters().into_iter().zip(settings) {
        dict.set_item(letter, value)?;
    }
    Ok(dict)
}

/// The refusal, with the nearest settings and their deviation as its result.
fn refused(py: Python<'_>, form: Form, refused: Refused) -> PyResult<Raise> {
    let nearest = refused.nearest.map(|nearest| -> PyResult<Py<PyAny>> {
        let result = (lettered(py, form, nearest.settings)?, nearest.deviation);
        Ok(result.into_pyobject(py)?.into_any().unbind())
    });
    Ok(Raise::with_result(refused.error, nearest.transpose()?))
}

#[pyfunction]
fn to_form<'py>(
    py: Python<'py>,
    pid: PidIn,
    form: &str,
    pv_span: Option<f64>,
    op_span: Option<f64>,
    minutes: bool,
) -> Outcome<Bound<'py, PyDict>> {
    let (form, scale) = (form_of(form)?, Scale::new(pv_span, op_span, minutes)?);
    match forms::to_form(&pid.into(), form, &scale) {
        Ok(settings) => Ok(lettered(py, form, settings)?),
        Err(error) => Err(refused(py, form, error)?),
    }
}

/// The settings behind `plantune.models.PID(**d)` but for weights, filter and sample time.
#[derive(IntoPyObject)]
struct PidOut {
    Kp: f64,
    Ti: f64,
    Td: f64,
    Tf: f64,
    b: f64,
    pure_Ki: Option<f64>,
}

impl From<Pid> for PidOut {
    fn from(pid: Pid) -> Self {
        let (Kp, Ti, Td, Tf, pure_Ki) = gains_of(&pid);
        PidOut { Kp, Ti, Td, Tf, b: pid.b, pure_Ki }
    }
}

#[pyfunction]
fn from_form(
    form: &str,
    settings: Settings,
    rest: PidIn,
    pv_span: Option<f64>,
    op_span: Option<f64>,
    minutes: bool,
) -> Outcome<PidOut> {
    let scale = Scale::new(pv_span, op_span, minutes)?;
    Ok(forms::from_form(form_of(form)?, settings, &rest.into(), &scale)?.into())
}

/// `plantune.export.Profile`, by attribute.
#[derive(FromPyObject)]
struct FaceplateIn {
    form: String,
    gain: String,
    signed: bool,
    settings: Vec<SettingIn>,
}

#[derive(FromPyObject)]
struct SettingIn {
    name: String,
    quantity: String,
    unit: String,
    digits: Option<usize>,
    decimals: Option<usize>,
    fixed: Option<f64>,
    default: Option<f64>,
    off: Option<f64>,
    range: Option<(f64, f64)>,
}

impl FaceplateIn {
    fn faceplate(self) -> Outcome<Faceplate> {
        Ok(Faceplate {
            form: form_of(&self.form)?,
            gain: match self.gain.as_str() {
                "engineering" => GainScale::Engineering,
                "output" => GainScale::Output,
                "span" => GainScale::Span,
                other => return Err(unknown("gain", other)),
            },
            signed: self.signed,
            settings: self.settings.into_iter().map(SettingIn::setting).collect::<Outcome<_>>()?,
        })
    }
}

impl SettingIn {
    fn setting(self) -> Outcome<Setting> {
        Ok(Setting {
            quantity: match self.quantity.as_str() {
                "Kp" => Quantity::Kp,
                "PB" => Quantity::Pb,
                "Ti" => Quantity::Ti,
                "Ki" => Quantity::Ki,
                "Td" => Quantity::Td,
                "Kd" => Quantity::Kd,
                "Tf" => Quantity::Tf,
                "Tf/Td" => Quantity::Alpha,
                "Td/Tf" => Quantity::N,
                "b" => Quantity::B,
                "c" => Quantity::C,
                "constant" => Quantity::Constant,
                other => return Err(unknown("quantity", other)),
            },
            unit: match self.unit.as_str() {
                "" | "%" | "%/%" => Unit::One,
                "s" => Unit::Second,
                "min" => Unit::Minute,
                "1/s" => Unit::PerSecond,
                "1/min" | "repeats/min" => Unit::PerMinute,
                "samples" => Unit::Sample,
                "1/sample" => Unit::PerSample,
                other => return Err(unknown("unit", other)),
            },
            rounding: match self.decimals {
                Some(decimals) => Rounding::Decimals(decimals),
                None => Rounding::Digits(self.digits.unwrap_or(7)),
            },
            name: self.name,
            fixed: self.fixed,
            default: self.default,
            off: self.off,
            range: self.range,
        })
    }
}

fn unknown(field: &str, value: &str) -> Raise {
    Error::argument(field, format!("\"{value}\""), "a word that profiles know").into()
}

/// What an entry comes to; the controllers without weight on D, filter and sample time.
#[derive(IntoPyObject)]
struct EntryOut {
    values: Vec<f64>,
    direct: bool,
    controller: PidOut,
    unrounded: PidOut,
    c: f64,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn enter(
    py: Python<'_>,
    pid: PidIn,
    profile: FaceplateIn,
    pv_span: Option<f64>,
    op_span: Option<f64>,
    digits: Option<usize>,
) -> Outcome<EntryOut> {
    let faceplate = profile.faceplate()?;
    match forms::enter(&pid.into(), &faceplate, pv_span, op_span, digits) {
        Ok(entry) => Ok(EntryOut {
            values: entry.values,
            direct: entry.direct,
            c: entry.controller.c,
            controller: entry.controller.into(),
            unrounded: entry.unrounded.into(),
            notes: notes(&entry.notes),
        }),
        Err(error) => Err(refused(py, faceplate.form, error)?),
    }
}
