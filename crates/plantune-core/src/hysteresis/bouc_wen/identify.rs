//! The oscillator from a record: a first model by its equation, the answer by its output.
//!
//! The record is taken in units in which the largest displacement s and the largest force U are 1:
//!
//! ```text
//! m c k alpha = (U / s) times theirs      bg bd = U^(1 - nu) / s times theirs      z = U times its own
//! ```
//!
//! Covariance: `sigma^2 (Psi' Psi)^-1` of the slopes at the minimum, for white noise on y.

use super::initial_state::initial_state;
use super::output_error::{NU, OutputError, parted};
use super::start::{first_model, strongest};
use super::tangent::COLUMNS;
use super::{BoucWen, doubts};
use crate::error::{Error, Result};
use crate::linalg::{Minimum, congruence, extent, minimise, solve};
use crate::note::{Note, Place};

/// Names of the columns.
pub const NAMES: [&str; COLUMNS] = ["m", "c", "k", "alpha", "bg", "bd", "nu", "y0", "v0", "z0"];

/// Slopes that depend on the others by more than this leave a parameter free.
const TOLERANCE: f64 = 1e-7;

/// Samples per period below which the splines between samples err.
const COARSE: f64 = 10.0;

/// How to fit.
#[derive(Clone, Debug, PartialEq)]
pub struct BoucWenSettings {
    /// Sample time, s.
    pub Ts: f64,
    /// nu where it is known.
    pub nu: Option<f64>,
    /// Whether the record begins at rest; else its first state is found as well.
    pub at_rest: bool,
    /// Whether the first model is the answer.
    pub start_only: bool,
}

/// The fitted model.
#[derive(Clone, Debug)]
pub struct BoucWenFit {
    /// The model.
    pub model: BoucWen,
    /// State at the first row.
    pub x0: [f64; 3],
    /// Standard deviations of `m c k alpha bg bd nu y0 v0 z0`; 0 of what was given.
    pub sd: Vec<f64>,
    /// Errors over all rows.
    pub errors: Vec<f64>,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Fits the model to a record.
pub fn identify_bouc_wen(u: &[f64], y: &[f64], settings: &BoucWenSettings) -> Result<BoucWenFit> {
    check(u, y, settings)?;
    let Ts = settings.Ts;
    let (s, U) = (largest(y), largest(u));
    let (u1, y1) = (scaled(u, U), scaled(y, s));
    let model = first_model(&u1, &y1, Ts, settings.nu)?;
    let x0 = if settings.at_rest { [0.0; 3] } else { initial_state(&model, &u1, &y1, Ts)? };
    let mut problem = OutputError::new(&u1, &y1, Ts, &model, x0);
    if settings.start_only {
        return finished(&problem, &problem.theta.clone(), vec![0.0; COLUMNS], u, y, settings, Vec::new());
    }
    problem.free = free(settings);
    let found = descended(&mut problem)?;
    let theta = problem.filled(&found.theta);
    let sd = deviations(&problem, &found, &theta, s, U, y.len())?;
    let mut notes = doubts(&found, y.len(), theta[6], sd[6]);
    notes.extend(coarse(y, Ts));
    finished(&problem, &theta, sd, u, y, settings, notes)
}

fn check(u: &[f64], y: &[f64], settings: &BoucWenSettings) -> Result<()> {
    if !(settings.Ts > 0.0 && settings.Ts.is_finite()) {
        return Err(Error::argument("Ts", settings.Ts, "a positive number of seconds"));
    }
    if u.len() != y.len() {
        return Err(Error::new("D09", format!("u has {} rows and y has {}", u.len(), y.len()))
            .remedy("pass rows of the same instants"));
    }
    if let Some(nu) = settings.nu.filter(|nu| !(NU.0..=NU.1).contains(nu)) {
        return Err(Error::argument("nu", nu, &format!("from {} to {}", NU.0, NU.1)));
    }
    for (name, x) in [("u", u), ("y", y)] {
        let (low, high) = extent(x);
        if x.is_empty() || !(high - low > 1e-8 * largest(x)) {
            return Err(Error::new("X01", format!("`{name}` stands still"))
                .at(Place::column(name))
                .remedy("record a moving force, near the resonance, in several amplitudes"));
        }
    }
    Ok(())
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |most, x| most.max(x.abs()))
}

fn scaled(x: &[f64], unit: f64) -> Vec<f64> {
    x.iter().map(|x| x / unit).collect()
}

/// Columns that are searched.
fn free(settings: &BoucWenSettings) -> Vec<usize> {
    let known = |j: &usize| (*j == 6 && settings.nu.is_some()) || (*j > 6 && settings.at_rest);
    (0..COLUMNS).filter(|j| !known(j)).collect()
}

fn descended(problem: &mut OutputError) -> Result<Minimum> {
    let from = problem.begin();
    minimise(problem, from).ok_or_else(|| {
        Error::new("N02", "the output of the first model overflows")
            .remedy("pass nu=1, or a record that begins at rest")
    })
}

/// Standard deviations of all ten in the units of the record; refuses what depends on the rest.
fn deviations(
    problem: &OutputError,
    found: &Minimum,
    theta: &[f64; COLUMNS],
    s: f64,
    U: f64,
    N: usize,
) -> Result<Vec<f64>> {
    let n = problem.free.len();
    let columns: Vec<usize> = (0..n).collect();
    let solution = solve(&found.triangle, &columns, n, TOLERANCE).map_err(|deficient| {
        let names: Vec<&str> = deficient.dependent.iter().map(|&j| NAMES[problem.free[j]]).collect();
        Error::new("X02", format!("the record does not tell {} from the rest", names.join(", ")))
            .measured(deficient.ratio, TOLERANCE)
            .remedy("let y swing so far that its loops open, or pass nu")
    })?;
    let variance = found.cost / N.saturating_sub(n).max(1) as f64;
    let J = derivatives(theta, s, U);
    let rows: Vec<Vec<f64>> = J.iter().map(|row| problem.free.iter().map(|&j| row[j]).collect()).collect();
    let P = congruence(&rows, |i, j| variance * solution.inverse_gram[i * n + j]);
    Ok((0..COLUMNS).map(|i| P[i * COLUMNS + i].sqrt()).collect())
}

/// The ten in the units of the record.
fn restored(theta: &[f64; COLUMNS], s: f64, U: f64) -> [f64; COLUMNS] {
    let [m, c, k, alpha, bg, bd, nu, y0, v0, z0] = *theta;
    let (stiffness, loss) = (U / s, U.powf(1.0 - nu) / s);
    let [m, c, k, alpha] = [m, c, k, alpha].map(|x| x * stiffness);
    [m, c, k, alpha, loss * bg, loss * bd, nu, s * y0, s * v0, U * z0]
}

/// Their derivatives over the scaled ones; those of bg and bd over nu as well.
fn derivatives(theta: &[f64; COLUMNS], s: f64, U: f64) -> [[f64; COLUMNS]; COLUMNS] {
    let unit = restored(&[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, theta[6], 1.0, 1.0, 1.0], s, U);
    let mut J = [[0.0; COLUMNS]; COLUMNS];
    for (i, row) in J.iter_mut().enumerate() {
        row[i] = if i == 6 { 1.0 } else { unit[i] };
    }
    J[4][6] = -unit[4] * theta[4] * U.ln();
    J[5][6] = -unit[5] * theta[5] * U.ln();
    J
}

fn coarse(y: &[f64], Ts: f64) -> Option<Note> {
    let samples = strongest(y, Ts).map_or(f64::INFINITY, |w| 2.0 * std::f64::consts::PI / (w * Ts));
    (samples < COARSE).then(|| {
        Note::warning("M09", format!("y has {samples:.1} samples per period"))
            .measured(samples, COARSE)
            .remedy("sample faster: the force is interpolated between samples")
    })
}

fn finished(
    problem: &OutputError,
    theta: &[f64; COLUMNS],
    sd: Vec<f64>,
    u: &[f64],
    y: &[f64],
    settings: &BoucWenSettings,
    mut notes: Vec<Note>,
) -> Result<BoucWenFit> {
    let (s, U) = (largest(y), largest(u));
    let (model, x0) = parted(&restored(theta, s, U));
    let model = BoucWen { Ts: Some(settings.Ts), ..model };
    model.check()?;
    let simulated = super::simulate(&model, u, settings.Ts, x0, super::Hold::Spline, Some(problem.steps))?;
    let errors: Vec<f64> = y.iter().zip(&simulated).map(|(y, f)| y - f).collect();
    let negative = [("c", model.c), ("k", model.k)].into_iter().find(|(_, value)| *value < 0.0);
    if let Some((name, value)) = negative {
        let text = format!("{name} is {value:.3e}: below zero");
        notes.push(Note::warning("M12", text).remedy("record more periods, or at another amplitude"));
    }
    Ok(BoucWenFit { model, x0, sd, errors, notes })
}
