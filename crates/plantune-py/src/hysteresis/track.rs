//! A plant with hysteresis in its loop.

use numpy::PyReadonlyArray1;
use plantune_core::hysteresis::{Tracking, track};
use plantune_core::model::Pid;
use pyo3::prelude::*;

use super::HysteresisIn;
use super::cmac::Cmac;
use crate::error::Outcome;
use crate::model::{ModelIn, PidIn};
use crate::note::{NoteOut, notes};
use crate::values::Frozen;

/// Fields of `Tracking`, but for what was given.
#[derive(IntoPyObject)]
struct TrackOut {
    y: Frozen,
    u: Frozen,
    ahead: Frozen,
    pass_rms: Frozen,
    rms: f64,
    worst: f64,
    relative: f64,
    notes: Vec<NoteOut>,
}

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(hysteresis_track, m)?)
}

/// Signals and errors of a plant that follows `r`.
#[pyfunction]
#[pyo3(signature = (plant, r, one_pass, Ts, noise, limits, dynamics=None, inverse=None, pid=None, cmac=None))]
#[allow(clippy::too_many_arguments)] // the parts of the loop, by name
fn hysteresis_track(
    plant: HysteresisIn,
    r: PyReadonlyArray1<'_, f64>,
    one_pass: usize,
    Ts: f64,
    noise: PyReadonlyArray1<'_, f64>,
    limits: (f64, f64),
    dynamics: Option<ModelIn>,
    inverse: Option<HysteresisIn>,
    pid: Option<PidIn>,
    mut cmac: Option<PyRefMut<'_, Cmac>>,
) -> Outcome<TrackOut> {
    let pid = pid.map(Pid::from);
    let parts = Tracking {
        plant: &plant.0,
        dynamics: dynamics.as_ref().map(|m| &m.0),
        inverse: inverse.as_ref().map(|m| &m.0),
        pid: pid.as_ref(),
        cmac: cmac.as_mut().map(|c| &mut c.core),
        Ts,
        limits,
        noise: noise.as_slice().map_err(PyErr::from)?,
    };
    let run = track(r.as_slice().map_err(PyErr::from)?, one_pass, parts)?;
    Ok(TrackOut {
        y: Frozen(run.y),
        u: Frozen(run.u),
        ahead: Frozen(run.ahead),
        pass_rms: Frozen(run.pass_rms),
        rms: run.rms,
        worst: run.worst,
        relative: run.relative,
        notes: notes(&run.notes),
    })
}
