//! Models over records and in closed loops.

use numpy::PyReadonlyArray1;
use plantune_core::sim::{self, ClosedLoopSettings, RelaySettings, Start};
use plantune_core::tune::indices;
use plantune_core::{Error, Limits};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::model::{ModelIn, PidIn, plant};
use crate::values::{Array, LimitsIn, RecordIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(over_record, m)?)?;
    m.add_function(wrap_pyfunction!(default_horizon, m)?)?;
    m.add_function(wrap_pyfunction!(load_horizon, m)?)?;
    m.add_function(wrap_pyfunction!(closed_loop, m)?)?;
    m.add_function(wrap_pyfunction!(simulate_relay, m)?)
}

pub fn start(x0: &str) -> plantune_core::Result<Start> {
    match x0 {
        "estimate" => Ok(Start::Estimate),
        "zero" => Ok(Start::Zero),
        other => Err(Error::argument("x0", format!("\"{other}\""), "\"estimate\" or \"zero\"")),
    }
}

/// Rows, model output, offset and initial states.
type OverRecordOut<'py> = (Vec<usize>, Array<'py>, f64, Vec<Vec<f64>>);

#[pyfunction]
fn over_record<'py>(
    py: Python<'py>,
    rec: RecordIn<'py>,
    model: ModelIn,
    horizon: Option<usize>,
    x0: &str,
    offset: Option<f64>,
    limits: LimitsIn,
) -> Outcome<OverRecordOut<'py>> {
    let limits: Limits = limits.into();
    let record = rec.view(&limits)?;
    let start = start(x0)?;
    let run = py.detach(|| sim::over_record(&model.0, &record, horizon, start, offset))?;
    Ok((run.rows, array(py, run.yhat), run.offset, run.x0))
}

/// The dict behind `plantune.simulate.Response(**d)`.
#[derive(IntoPyObject)]
struct ResponseOut<'py> {
    t: Array<'py>,
    r: Array<'py>,
    y: Array<'py>,
    u: Array<'py>,
    indices: IndicesOut,
}

/// The dict behind `plantune.simulate.Indices(**d)`.
#[derive(IntoPyObject)]
struct IndicesOut {
    rise: f64,
    settling: f64,
    overshoot: f64,
    ise: f64,
    iae: f64,
    itae: f64,
    control_overshoot: f64,
    control_energy: f64,
    total_variation: f64,
}

#[pyfunction]
#[allow(clippy::too_many_arguments)] // one per field of the core's settings
fn closed_loop<'py>(
    py: Python<'py>,
    model: ModelIn,
    pid: PidIn,
    dt: f64,
    r: PyReadonlyArray1<'py, f64>,
    d: PyReadonlyArray1<'py, f64>,
    noise: PyReadonlyArray1<'py, f64>,
    offset: f64,
    u0: f64,
) -> Outcome<ResponseOut<'py>> {
    let plant = plant(model)?;
    let slice = |x: &PyReadonlyArray1<'py, f64>| x.as_slice().map(<[f64]>::to_vec).map_err(PyErr::from);
    let (r, d, noise) = (slice(&r)?, slice(&d)?, slice(&noise)?);
    let settings = ClosedLoopSettings { dt, r: &r, d: &d, noise: &noise, offset, u0, fineness: 1000.0 };
    let pid = pid.into();
    let run = py.detach(|| sim::closed_loop(&plant, &pid, &settings))?;
    let i = indices(&run);
    let every = |x: &[f64]| array(py, x.iter().step_by(run.stride).copied().collect());
    Ok(ResponseOut {
        t: array(py, (0..=r.len()).map(|k| k as f64 * dt).collect()),
        r: every(&run.r),
        y: every(&run.y),
        u: every(&run.u),
        indices: IndicesOut {
            rise: i.rise,
            settling: i.settling,
            overshoot: i.overshoot,
            ise: i.ise,
            iae: i.iae,
            itae: i.itae,
            control_overshoot: i.control_overshoot,
            control_energy: i.control_energy,
            total_variation: i.total_variation,
        },
    })
}

#[pyfunction]
fn default_horizon(model: ModelIn, pid: PidIn) -> Outcome<f64> {
    Ok(sim::default_horizon(&plant(model)?, &pid.into())?)
}

#[pyfunction]
fn load_horizon(model: ModelIn, pid: PidIn) -> Outcome<f64> {
    Ok(sim::load_horizon(&plant(model)?, &pid.into())?)
}

/// Input and measured output under a relay.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // one per field of the core's settings
fn simulate_relay<'py>(
    py: Python<'py>,
    model: ModelIn,
    low: f64,
    high: f64,
    hysteresis: f64,
    Ts: f64,
    r: f64,
    offset: f64,
    rest: usize,
    noise: PyReadonlyArray1<'py, f64>,
) -> Outcome<(Array<'py>, Array<'py>)> {
    let (plant, noise) = (plant(model)?, noise.as_slice().map_err(PyErr::from)?);
    let settings = RelaySettings { low, high, hysteresis, Ts, r, offset, rest, noise };
    let (u, y) = py.detach(|| sim::relay(&plant, &settings))?;
    Ok((array(py, u), array(py, y)))
}
