//! Models over records and in closed loops.

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray2, PyUntypedArrayMethods};
use plantune_core::model::{Fopdt, Pid};
use plantune_core::sim::{
    self, Actuator, AntiWindup, ClosedLoopSettings, Indices, LiveLoop, LiveSettings, LiveState, LoopPlant,
    RelaySettings, Schedule, Start, Table, Varying,
};
use plantune_core::{Error, Limits};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

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
    m.add_function(wrap_pyfunction!(simulate_relay, m)?)?;
    m.add_class::<LoopSimulator>()
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
    let record = rec.view_of_any_stamps(&limits)?;
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

/// A first-order plant under a sampled PID, one sample at a time; both may change at any sample.
///
/// Parameters
/// ----------
/// K, T, L : float
///     Static gain, time constant and dead time of the plant, seconds.
/// Ts : float
///     Sample time, seconds.
/// pid : PID
///     The controller; its own `Ts` is absent or this one.
/// offset : float
///     `O` in `y = G u + O`.
/// u0 : float
///     Input at which the loop begins in equilibrium.
/// longest : float
///     Longest dead time that the plant may get, seconds; `L` by default.
/// actuator : Actuator, optional
///     Limits, rate, dead band and step of u.
/// y_step : float
///     Step of the y that is read; 0 for none.
/// anti_windup, Tt : str, float
///     As in `simulate.closed_loop`.
///
/// Attributes
/// ----------
/// pid : PID
///     The settings at work.
/// plant : tuple of float
///     `K, T, L, offset` now.
///
/// Raises
/// ------
/// UsageError
///     An argument out of its range (U01).
/// NotIdentifiable
///     Parameters that are no plant (M12).
///
/// Notes
/// -----
/// The same numbers as `simulate.closed_loop` with a `VaryingPlant`, to the last bit.
/// Source 001, (3.7-20) to (3.7-25).
///
/// Examples
/// --------
/// >>> import plantune as pt
/// >>> loop = LoopSimulator(K=2.0, T=1.0, L=0.1, Ts=0.1, pid=pt.models.PID(Kp=0.5, Ti=1.0))
/// >>> u, y = loop.step(3.0)
/// >>> round(u, 9), y
/// (1.65, 0.0)
/// >>> loop.set(pt.models.PID(Kp=1.0, Ti=1.0))
/// >>> for _ in range(200):
/// ...     u, y = loop.step(3.0)
/// >>> round(u, 6), round(y, 6)
/// (1.5, 3.0)
#[pyclass(module = "plantune._core")]
pub struct LoopSimulator {
    live: LiveLoop,
    pid: Py<PyAny>,
    actuator: Option<Py<PyAny>>,
    anti_windup: (String, Option<f64>),
}

/// `K, T, L, Ts, pid`.
type LoopArguments = (f64, f64, f64, f64, Py<PyAny>);

/// `x`, inputs that still act, memory of the controller, position.
type LoopStateOut = (f64, Vec<f64>, [f64; 6], Option<f64>);

#[pymethods]
impl LoopSimulator {
    #[new]
    #[pyo3(signature = (K, T, L, Ts, pid, *, offset=0.0, u0=0.0, longest=0.0, actuator=None, y_step=0.0,
                        anti_windup="clamping", Tt=None))]
    #[allow(clippy::too_many_arguments)] // one per field of the core's settings
    fn new(
        K: f64,
        T: f64,
        L: f64,
        Ts: f64,
        pid: Bound<'_, PyAny>,
        offset: f64,
        u0: f64,
        longest: f64,
        actuator: Option<Bound<'_, PyAny>>,
        y_step: f64,
        anti_windup: &str,
        Tt: Option<f64>,
    ) -> Outcome<Self> {
        let limits = actuator.as_ref().map(|a| a.extract::<ActuatorIn>()).transpose()?;
        let settings = LiveSettings {
            Ts,
            longest,
            u0,
            actuator: limits.map_or(Actuator::default(), Actuator::from),
            y_step,
            anti_windup: winding(anti_windup, Tt)?,
        };
        let controller = pid.extract::<PidIn>()?.into();
        let live = LiveLoop::new(&Fopdt { K, T, L }, offset, &controller, settings)?;
        let anti_windup = (anti_windup.to_owned(), Tt);
        Ok(LoopSimulator { live, pid: pid.unbind(), actuator: actuator.map(Bound::unbind), anti_windup })
    }

    /// Go to the next sample: the output `u` of the controller from there on, and the `y` read there.
    #[pyo3(signature = (r, noise=0.0))]
    fn step(&mut self, r: f64, noise: f64) -> Outcome<(f64, f64)> {
        Ok(self.live.step(r, noise)?)
    }

    /// Go to the next sample in manual: the output is `u` within its limits, and automatic goes on from it.
    #[pyo3(signature = (r, u, noise=0.0))]
    fn hold(&mut self, r: f64, u: f64, noise: f64) -> Outcome<(f64, f64)> {
        Ok(self.live.hold(r, noise, u)?)
    }

    /// Take other controller settings from the next sample on, without a bump.
    fn set(&mut self, pid: Bound<'_, PyAny>) -> Outcome<()> {
        self.live.set(&pid.extract::<PidIn>()?.into())?;
        self.pid = pid.unbind();
        Ok(())
    }

    /// Take other parameters of the plant: they bring it to the next sample.
    fn set_plant(&mut self, K: f64, T: f64, L: f64, offset: f64) -> Outcome<()> {
        Ok(self.live.set_plant(&Fopdt { K, T, L }, offset)?)
    }

    #[getter]
    fn pid(&self, py: Python<'_>) -> Py<PyAny> {
        self.pid.clone_ref(py)
    }

    #[getter]
    fn plant(&self) -> (f64, f64, f64, f64) {
        let (Fopdt { K, T, L }, offset) = self.live.plant().parameters();
        (K, T, L, offset)
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<(LoopArguments, Bound<'py, PyDict>)> {
        let ((K, T, L, offset), s) = (self.plant(), self.live.settings());
        let named = [("offset", offset), ("u0", s.u0), ("longest", s.longest), ("y_step", s.y_step)];
        let named = named.into_py_dict(py)?;
        named.set_item("actuator", &self.actuator)?;
        named.set_item("anti_windup", &self.anti_windup.0)?;
        named.set_item("Tt", self.anti_windup.1)?;
        Ok(((K, T, L, s.Ts, self.pid(py)), named))
    }

    fn __getstate__(&self) -> LoopStateOut {
        let LiveState { x, past, controller, position } = self.live.state();
        (x, past, controller, position)
    }

    fn __setstate__(&mut self, state: LoopStateOut) -> Outcome<()> {
        let (x, past, controller, position) = state;
        Ok(self.live.resume(LiveState { x, past, controller, position })?)
    }
}
