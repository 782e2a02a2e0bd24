//! Stacks of plays: in and out, identified from a record.

use numpy::PyReadonlyArray1;
use plantune_core::hysteresis::{
    AsymmetricStack, DeadZones, EvenStack, Form, PlaySettings, PlayStack, identify_plays,
};
use pyo3::prelude::*;

use super::HysteresisOut;
use super::identified::IdentifiedOut;
use crate::error::Outcome;
use crate::note::{NoteOut, notes};
use crate::values::Frozen;

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(plays_identify, m)?)
}

#[derive(FromPyObject)]
pub struct PlayStackIn {
    r: Vec<f64>,
    w: Vec<f64>,
    offset: f64,
    z0: Vec<f64>,
}

impl From<PlayStackIn> for PlayStack {
    fn from(PlayStackIn { r, w, offset, z0 }: PlayStackIn) -> Self {
        PlayStack { r, w, offset, z0 }
    }
}

/// Fields of `PlayStack`.
#[derive(IntoPyObject)]
pub struct PlayStackOut {
    r: Frozen,
    w: Frozen,
    offset: f64,
    z0: Frozen,
}

impl From<PlayStack> for PlayStackOut {
    fn from(PlayStack { r, w, offset, z0 }: PlayStack) -> Self {
        PlayStackOut { r: Frozen(r), w: Frozen(w), offset, z0: Frozen(z0) }
    }
}

#[derive(FromPyObject)]
pub struct AsymmetricIn {
    r: Vec<f64>,
    w: Vec<f64>,
    knots: Vec<f64>,
    slopes: Vec<f64>,
    offset: f64,
    z0: Vec<f64>,
}

impl From<AsymmetricIn> for AsymmetricStack {
    fn from(AsymmetricIn { r, w, knots, slopes, offset, z0 }: AsymmetricIn) -> Self {
        let plays = PlayStack { r, w, offset: 0.0, z0 };
        AsymmetricStack { plays, zones: DeadZones { knots, slopes, offset } }
    }
}

/// Fields of `AsymmetricStack`, and of its inverse.
#[derive(IntoPyObject)]
pub struct AsymmetricOut {
    r: Frozen,
    w: Frozen,
    knots: Frozen,
    slopes: Frozen,
    offset: f64,
    z0: Frozen,
}

impl From<AsymmetricStack> for AsymmetricOut {
    fn from(AsymmetricStack { plays, zones }: AsymmetricStack) -> Self {
        AsymmetricOut {
            r: Frozen(plays.r),
            w: Frozen(plays.w),
            knots: Frozen(zones.knots),
            slopes: Frozen(zones.slopes),
            offset: zones.offset,
            z0: Frozen(plays.z0),
        }
    }
}

#[derive(FromPyObject)]
pub struct EvenIn {
    r: Vec<f64>,
    w: Vec<f64>,
    s: Vec<f64>,
    v: Vec<f64>,
    offset: f64,
}

impl From<EvenIn> for EvenStack {
    fn from(EvenIn { r, w, s, v, offset }: EvenIn) -> Self {
        EvenStack { plays: PlayStack::virgin(r, w, offset), even: PlayStack::virgin(s, v, 0.0) }
    }
}

/// Fields of `EvenStack`.
#[derive(IntoPyObject)]
pub struct EvenOut {
    r: Frozen,
    w: Frozen,
    s: Frozen,
    v: Frozen,
    offset: f64,
}

impl From<EvenStack> for EvenOut {
    fn from(EvenStack { plays, even }: EvenStack) -> Self {
        EvenOut {
            r: Frozen(plays.r),
            w: Frozen(plays.w),
            s: Frozen(even.r),
            v: Frozen(even.w),
            offset: plays.offset,
        }
    }
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct SettingsIn {
    form: String,
    counts: Vec<usize>,
    grid: usize,
    r: Option<Vec<f64>>,
    offset: bool,
    skip: usize,
}

impl From<SettingsIn> for PlaySettings {
    fn from(SettingsIn { form, counts, grid, r, offset, skip }: SettingsIn) -> Self {
        let form = match form.as_str() {
            "asymmetric" => Form::Asymmetric(grid),
            "even" => Form::Even(grid),
            _ => Form::Symmetric,
        };
        PlaySettings { form, counts, r, offset, skip }
    }
}

/// Fields of a fitted stack, how it was found, names of its parameters, and notes.
#[pyfunction]
fn plays_identify<'py>(
    py: Python<'py>,
    x: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
    settings: SettingsIn,
) -> Outcome<(HysteresisOut, IdentifiedOut, Vec<String>, Vec<NoteOut>)> {
    let (x, y) = (x.as_slice().map_err(PyErr::from)?, y.as_slice().map_err(PyErr::from)?);
    let settings = PlaySettings::from(settings);
    let fit = py.detach(|| identify_plays(x, y, &settings))?;
    let how = IdentifiedOut::of(&y[settings.skip..], &fit.errors, fit.sd, fit.tried);
    Ok((fit.model.into(), how, fit.names, notes(&fit.notes)))
}
