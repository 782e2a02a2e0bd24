//! Models over records and in closed loops.

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray2, PyUntypedArrayMethods};
use plantune_core::model::Pid;
use plantune_core::sim::{
    self, Actuator, AntiWindup, ClosedLoopSettings, Indices, LoopPlant, RelaySettings, Schedule, Start,
    Table, Varying,
};
use plantune_core::{Error, Limits};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::model::{ModelIn, PidIn, plant};
use crate::note::{NoteOut, notes};
use crate::values::{Array, LimitsIn, RecordIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(over_record, m)?)?;
    m.add_function(wrap_pyfunction!(default_horizon, m)?)?;
    m.add_function(wrap_pyfunction!(load_horizon, m)?)?;
    m.add_function(wrap_pyfunction!(closed_loop, m)?)?;
    m.add_function(wrap_pyfunction!(simulate_varying, m)?)?;
    m.add_function(wrap_pyfunction!(table, m)?)?;
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

/// How a response ends.
#[derive(IntoPyObject)]
struct LoopOut {
    rows: usize,
    indices: IndicesOut,
    notes: Vec<NoteOut>,
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

impl From<Indices> for IndicesOut {
    fn from(i: Indices) -> Self {
        IndicesOut {
            rise: i.rise,
            settling: i.settling,
            overshoot: i.overshoot,
            ise: i.ise,
            iae: i.iae,
            itae: i.itae,
            control_overshoot: i.control_overshoot,
            control_energy: i.control_energy,
            total_variation: i.total_variation,
        }
    }
}

/// `plantune.simulate.Actuator`, by attribute.
#[derive(FromPyObject)]
struct ActuatorIn {
    low: f64,
    high: f64,
    rate: f64,
    dead_band: f64,
    step: f64,
}

impl From<ActuatorIn> for Actuator {
    fn from(a: ActuatorIn) -> Self {
        Actuator { low: a.low, high: a.high, rate: a.rate, dead_band: a.dead_band, step: a.step }
    }
}

/// `plantune.simulate.Schedule`, by attribute.
#[derive(FromPyObject)]
struct ScheduleIn<'py> {
    Kp: Signal<'py>,
    Ti: Signal<'py>,
    Ki: Signal<'py>,
    Td: Signal<'py>,
}

/// `plantune.simulate.VaryingPlant`, by attribute.
#[derive(FromPyObject)]
struct VaryingIn<'py> {
    K: PyReadonlyArray1<'py, f64>,
    T: PyReadonlyArray1<'py, f64>,
    L: PyReadonlyArray1<'py, f64>,
    offset: PyReadonlyArray1<'py, f64>,
}

impl VaryingIn<'_> {
    fn view(&self) -> Outcome<Varying<'_>> {
        Ok(Varying {
            K: self.K.as_slice().map_err(PyErr::from)?,
            T: self.T.as_slice().map_err(PyErr::from)?,
            L: self.L.as_slice().map_err(PyErr::from)?,
            offset: self.offset.as_slice().map_err(PyErr::from)?,
        })
    }
}

/// A model, or a plant that varies.
enum PlantIn<'py> {
    Fixed(ModelIn),
    Varying(VaryingIn<'py>),
}

impl<'py> FromPyObject<'_, 'py> for PlantIn<'py> {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let kind: Option<String> = value.getattr("kind").and_then(|kind| kind.extract()).ok();
        Ok(match kind.as_deref() {
            Some("varying") => PlantIn::Varying(value.extract()?),
            _ => PlantIn::Fixed(value.extract()?),
        })
    }
}

/// A signal that may be absent.
type Signal<'py> = Option<PyReadonlyArray1<'py, f64>>;

fn view<'a>(x: &'a Signal<'_>) -> Outcome<Option<&'a [f64]>> {
    Ok(x.as_ref().map(|x| x.as_slice()).transpose().map_err(PyErr::from)?)
}

/// Fills the rows `t, r, y, u` of `out`, `r.len() + 1` columns.
#[pyfunction]
#[pyo3(signature = (plant, pid, dt, r, out, *, d=None, dy=None, noise=None, p=None, manual=None, offset=0.0, u0=0.0,
                    actuator=None, y_step=0.0, anti_windup="clamping", Tt=None, settings=Vec::new(), schedule=None))]
#[allow(clippy::too_many_arguments)] // one per field of the core's settings
fn closed_loop<'py>(
    py: Python<'py>,
    plant: PlantIn<'py>,
    pid: PidIn,
    dt: f64,
    r: PyReadonlyArray1<'py, f64>,
    mut out: PyReadwriteArray2<'py, f64>,
    d: Signal<'py>,
    dy: Signal<'py>,
    noise: Signal<'py>,
    p: Signal<'py>,
    manual: Signal<'py>,
    offset: f64,
    u0: f64,
    actuator: Option<ActuatorIn>,
    y_step: f64,
    anti_windup: &str,
    Tt: Option<f64>,
    settings: Vec<(usize, PidIn)>,
    schedule: Option<ScheduleIn<'py>>,
) -> Outcome<LoopOut> {
    let settings: Vec<(usize, Pid)> = settings.into_iter().map(|(row, pid)| (row, pid.into())).collect();
    let schedule = match &schedule {
        None => Schedule::default(),
        Some(s) => Schedule { Kp: view(&s.Kp)?, Ti: view(&s.Ti)?, Ki: view(&s.Ki)?, Td: view(&s.Td)? },
    };
    let wanted = ClosedLoopSettings {
        d: view(&d)?,
        dy: view(&dy)?,
        noise: view(&noise)?,
        p: view(&p)?,
        manual: view(&manual)?,
        offset,
        u0,
        actuator: actuator.map_or(Actuator::default(), Actuator::from),
        y_step,
        anti_windup: winding(anti_windup, Tt)?,
        settings: &settings,
        schedule,
        ..ClosedLoopSettings::new(dt, r.as_slice().map_err(PyErr::from)?)
    };
    let (pid, rows) = (pid.into(), wanted.r.len() + 1);
    let out = out.as_slice_mut().map_err(PyErr::from)?;
    let mut lines = out.chunks_exact_mut(rows);
    let (Some(t), Some(r), Some(y), Some(u)) = (lines.next(), lines.next(), lines.next(), lines.next())
    else {
        return Err(Error::argument("out", "too small", "of four rows").into());
    };
    let varying;
    let plant = match &plant {
        PlantIn::Fixed(model) => LoopPlant::Fixed(&model.0),
        PlantIn::Varying(plant) => {
            varying = plant.view()?;
            LoopPlant::Varying(&varying)
        }
    };
    let run = py.detach(|| {
        t.iter_mut().enumerate().for_each(|(k, t)| *t = k as f64 * dt);
        r[..rows - 1].copy_from_slice(wanted.r);
        r[rows - 1] = wanted.r.last().copied().unwrap_or(0.0);
        sim::closed_loop_into(plant, &pid, &wanted, y, u)
    })?;
    Ok(LoopOut { rows: run.rows, indices: run.indices.into(), notes: notes(&run.notes) })
}

fn winding(name: &str, Tt: Option<f64>) -> plantune_core::Result<AntiWindup> {
    match (name, Tt) {
        ("back_calculation", Tt) => Ok(AntiWindup::BackCalculation { Tt }),
        (_, Some(Tt)) => Err(Error::argument("Tt", Tt, "absent but for anti_windup=\"back_calculation\"")),
        ("clamping", None) => Ok(AntiWindup::Clamping),
        ("none", None) => Ok(AntiWindup::None),
        (other, None) => {
            let needed = "\"clamping\", \"back_calculation\" or None";
            Err(Error::argument("anti_windup", format!("\"{other}\""), needed))
        }
    }
}

/// Output of a plant that varies.
#[pyfunction]
fn simulate_varying<'py>(
    py: Python<'py>,
    plant: VaryingIn<'py>,
    u: PyReadonlyArray1<'py, f64>,
    Ts: f64,
    u0: f64,
) -> Outcome<Array<'py>> {
    let (plant, u) = (plant.view()?, u.as_slice().map_err(PyErr::from)?);
    Ok(array(py, py.detach(|| plant.simulate(u, Ts, u0))?))
}

/// Values of a table at operating points `(N, signals)`.
#[pyfunction]
fn table<'py>(
    py: Python<'py>,
    axes: Vec<Vec<f64>>,
    values: Vec<f64>,
    points: PyReadonlyArray2<'py, f64>,
) -> Outcome<Array<'py>> {
    let table = Table::new(axes, values)?;
    let width = points.shape()[1];
    if width != table.signals() {
        let needed = format!("{}, one per axis", table.signals());
        return Err(Error::argument("signals", format!("{width} of them"), &needed).into());
    }
    let points = points.as_slice().map_err(PyErr::from)?;
    Ok(array(py, points.chunks_exact(width).map(|point| table.at(point)).collect()))
}

#[pyfunction]
fn default_horizon(model: ModelIn, pid: PidIn) -> Outcome<f64> {
    Ok(sim::default_horizon(&model.0, &pid.into())?)
}

#[pyfunction]
fn load_horizon(model: ModelIn, pid: PidIn) -> Outcome<f64> {
    Ok(sim::load_horizon(&model.0, &pid.into())?)
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
