//! Experiments planned before they are run.

use numpy::{AllowTypeChange, PyArrayLike1};
use plantune_core::analyze::{self, Disturbance, Plan, Room, Shape};
use plantune_core::{Error, Limits};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::model::{ModelIn, plant};
use crate::note::{NoteOut, notes};
use crate::values::{Array, LimitsIn, array};

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(experiment, m)?)?;
    m.add_function(wrap_pyfunction!(predicted_sd, m)?)
}

/// What is wished, by attribute.
#[derive(FromPyObject)]
struct WishesIn {
    Ts: f64,
    noise_sd: f64,
    ar: Vec<f64>,
    time: Option<f64>,
    u_limits: Option<(f64, f64)>,
    y_limits: Option<(f64, f64)>,
    at: Option<(f64, f64)>,
    target: f64,
    shape: Option<String>,
    seed: u64,
}

impl WishesIn {
    fn plan(self) -> plantune_core::Result<Plan> {
        Ok(Plan {
            Ts: self.Ts,
            noise: Disturbance { sd: self.noise_sd, ar: self.ar },
            time: self.time,
            u: Room::new("u_limits", self.u_limits, self.at.map(|at| at.0))?,
            y: Room::new("y_limits", self.y_limits, self.at.map(|at| at.1))?,
            target: self.target,
            shape: self.shape.map(|name| shape(&name)).transpose()?,
            seed: self.seed,
        })
    }
}

fn shape(name: &str) -> plantune_core::Result<Shape> {
    let known = Shape::ALL.map(Shape::as_str).join(", ");
    Shape::ALL
        .into_iter()
        .find(|shape| shape.as_str() == name)
        .ok_or_else(|| Error::argument("shape", format!("\"{name}\""), &format!("one of {known}, or None")))
}

/// The dict behind `plantune.analyze.Trial(**d)`.
#[derive(IntoPyObject)]
struct TrialOut {
    shape: &'static str,
    hold: usize,
    amplitude: f64,
    reaches: bool,
    peak: f64,
    sd: [f64; 3],
    relative: [f64; 3],
}

impl From<&analyze::Trial> for TrialOut {
    fn from(trial: &analyze::Trial) -> Self {
        TrialOut {
            shape: trial.shape.as_str(),
            hold: trial.hold,
            amplitude: trial.amplitude,
            reaches: trial.reaches,
            peak: trial.peak,
            sd: trial.sd,
            relative: trial.relative,
        }
    }
}

/// The dict behind `plantune.analyze.Experiment`.
#[derive(IntoPyObject)]
struct ExperimentOut<'py> {
    t: Array<'py>,
    u: Array<'py>,
    y: Array<'py>,
    trials: Vec<TrialOut>,
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn experiment<'py>(
    py: Python<'py>,
    model: ModelIn,
    wishes: WishesIn,
    limits: LimitsIn,
) -> Outcome<ExperimentOut<'py>> {
    let (plant, plan, limits) = (plant(model)?, wishes.plan()?, Limits::from(limits));
    let out = py.detach(|| analyze::experiment(&plant, &plan, &limits))?;
    let t = (0..out.u.len()).map(|k| k as f64 * plan.Ts).collect();
    Ok(ExperimentOut {
        t: array(py, t),
        u: array(py, out.u),
        y: array(py, out.y),
        trials: out.trials.iter().map(TrialOut::from).collect(),
        notes: notes(&out.notes),
    })
}

/// The dict behind `plantune.analyze.Prediction`.
#[derive(IntoPyObject)]
struct PredictionOut<'py> {
    y: Array<'py>,
    sd: [f64; 3],
    relative: [f64; 3],
    notes: Vec<NoteOut>,
}

#[pyfunction]
fn predicted_sd<'py>(
    py: Python<'py>,
    model: ModelIn,
    u: PyArrayLike1<'py, f64, AllowTypeChange>,
    Ts: f64,
    noise_sd: f64,
    ar: Vec<f64>,
) -> Outcome<PredictionOut<'py>> {
    let (plant, noise) = (plant(model)?, Disturbance { sd: noise_sd, ar });
    let u: Vec<f64> = u.as_array().to_vec();
    let out = py.detach(|| analyze::judged(&plant, &u, Ts, &noise))?;
    Ok(PredictionOut {
        notes: notes(&analyze::near_zero(&plant, out.sd[2]).into_iter().collect::<Vec<_>>()),
        y: array(py, out.y),
        sd: out.sd,
        relative: out.relative,
    })
}
