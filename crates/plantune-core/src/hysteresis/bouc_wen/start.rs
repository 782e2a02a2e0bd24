//! The oscillator without a search over its output: variable projection in the form of its equation.
//!
//! ```text
//! F u = m F y'' + c F y' + k F y + alpha F zeta(g, d, nu),   F = 1 / ((s/w)^4 + 2.61 (s/w)^3 + ... + 1)
//! ```
//!
//! One filter of fourth order gives displacement, speed and acceleration from its states, with no difference of
//! samples. Both signals run as splines between samples, four points each; zeta is driven by the unfiltered
//! displacement, whose extremes at 150 Hz fall between samples of 750 Hz. A cut-off of 1.75 times the strongest
//! frequency of y keeps the noise of the acceleration out: at 60 Hz the benchmark is met to 1.4e-6 m, at 250 Hz to
//! 4.4e-5 m. The first rows, in which the filter forgets where it started, do not count.

use std::f64::consts::PI;

use super::BoucWen;
use super::projection::Projection;
use super::spline::{Between, Hold};
use crate::error::{Error, Result};
use crate::model::{Realisation, TransferFunction};
use crate::note::Place;
use crate::poly::product;
use crate::signal::prototype;

/// Points per sample.
const FINE: usize = 4;

/// Cut-off over the strongest frequency.
const CUT: f64 = 1.75;

/// Periods of the cut-off that do not count.
const FORGOTTEN: f64 = 8.0;

/// Most rows; the search over the output has all of them.
const MOST_ROWS: usize = 6000;

/// Share of its standard deviation that a signal must cross to have changed sides.
const BAND: f64 = 0.3;

/// Fewest samples per period of the strongest frequency.
const FEWEST: f64 = 5.0;

/// A first model, all in units in which the largest displacement and the largest force are 1.
pub(super) fn first_model(u: &[f64], y: &[f64], Ts: f64, nu: Option<f64>) -> Result<BoucWen> {
    let w = strongest(y, Ts)?;
    let N = u.len().min(MOST_ROWS);
    let mut projection = of_equation(&u[..N], &y[..N], Ts, CUT * w, nu)?;
    let nothing = || {
        Error::new("N05", "no parameters reproduce the record")
            .remedy("check signs and units of u and y, or pass nu=1")
    };
    let theta = projection.search().ok_or_else(nothing)?.theta;
    let shape = projection.shape(&theta);
    let c = projection.coefficients(&theta).ok_or_else(nothing)?;
    if !(c[0] > 0.0) || !(c[3] > 0.0) {
        let (what, value) = if c[0] > 0.0 { ("alpha", c[3]) } else { ("m", c[0]) };
        return Err(Error::new(
            "X02",
            format!("the record asks for {what} of {value:.3e}, must be positive"),
        )
        .remedy("excite the resonance with more than one amplitude, and check the sign of y"));
    }
    // z = alpha zeta
    let loss = c[3].powf(1.0 - shape.nu);
    let (bg, bd) = (shape.g * loss, shape.d * loss);
    Ok(BoucWen { m: c[0], c: c[1], k: c[2], alpha: c[3], bg, bd, nu: shape.nu, Ts: None })
}

/// Strongest frequency, rad/s: half the rate at which the signal changes sides of its mean.
pub(super) fn strongest(y: &[f64], Ts: f64) -> Result<f64> {
    let N = y.len() as f64;
    let mean = y.iter().sum::<f64>() / N;
    let sd = (y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / N).sqrt();
    let (mut side, mut changes, mut first, mut last) = (0.0, 0, 0, 0);
    for (t, y) in y.iter().enumerate().filter(|(_, y)| (*y - mean).abs() > BAND * sd) {
        let now = (y - mean).signum();
        if now != side {
            if side == 0.0 {
                first = t;
            } else {
                changes += 1;
            }
            (side, last) = (now, t);
        }
    }
    if changes < 4 {
        return Err(Error::new("X02", format!("y changes sides {changes} times"))
            .at(Place::column("y"))
            .measured(changes as f64, 4.0)
            .remedy("record several periods, in which y swings to both sides"));
    }
    let samples = 2.0 * (last - first) as f64 / changes as f64;
    if samples < FEWEST {
        return Err(Error::new("M09", format!("y has {samples:.1} samples per period"))
            .at(Place::column("y"))
            .measured(samples, FEWEST)
            .remedy(format!("sample every {:.3e} s or faster", samples / 10.0 * Ts)));
    }
    Ok(2.0 * PI / (samples * Ts))
}

/// Rows `F y'', F y', F y | F u` from where the filter has forgotten its start.
fn of_equation(u: &[f64], y: &[f64], Ts: f64, w: f64, nu: Option<f64>) -> Result<Projection> {
    let h = Ts / FINE as f64;
    let (fine_u, fine_y) = (upsampled(u), upsampled(y));
    let filter = StateVariables::new(w, h);
    let (mut of_u, mut of_y) = (filter.clone(), filter.clone());
    let skip = (FORGOTTEN * 2.0 * PI / (w * h)).ceil() as usize;
    let mut rows = Vec::new();
    for t in 0..fine_y.len() {
        let before = t.saturating_sub(1);
        let force = of_u.step(fine_u[before], fine_u[t]);
        let displacement = of_y.step(fine_y[before], fine_y[t]);
        if t >= skip && (t - skip).is_multiple_of(FINE) {
            rows.push(vec![of_y.derivative(2), of_y.derivative(1), displacement, force]);
        }
    }
    if rows.len() < 40 {
        let needed = skip / FINE + 40;
        return Err(Error::new("X03", format!("{} rows, of which {} count", u.len(), rows.len()))
            .measured(u.len() as f64, needed as f64)
            .remedy(format!("record {needed} rows or more")));
    }
    Ok(Projection { rows, path: fine_y, stride: FINE, skip, filter: Some(filter), budget: 0, nu })
}

fn upsampled(x: &[f64]) -> Vec<f64> {
    let between = Between::new(x, Hold::Spline);
    let mut fine = Vec::with_capacity(FINE * x.len());
    let mut points = [0.0; FINE + 1];
    for t in 0..x.len() - 1 {
        between.fill(t, &mut points);
        fine.extend_from_slice(&points[..FINE]);
    }
    fine.push(x[x.len() - 1]);
    fine
}

/// Order of the filter.
const ORDER: usize = 4;

/// Butterworth's filter of a signal straight between points, and the derivatives of its output.
#[derive(Clone)]
pub(super) struct StateVariables {
    Phi: [[f64; ORDER]; ORDER],
    begin: [f64; ORDER],
    end: [f64; ORDER],
    C: [[f64; ORDER]; 3],
    x: [f64; ORDER],
}

impl StateVariables {
    fn new(w: f64, h: f64) -> Self {
        let pairs = prototype(ORDER).into_iter().filter(|p| p.im > 0.0);
        let mut den = pairs.fold(vec![1.0], |den, p| product(&den, &[1.0, -2.0 * p.re, 1.0]));
        den.iter_mut().enumerate().for_each(|(i, a)| *a *= w.powi(i as i32));
        let of = |derivative: usize| {
            let num = [vec![w.powi(ORDER as i32)], vec![0.0; derivative]].concat();
            Realisation::of(&TransferFunction { num, den: den.clone(), L: 0.0 })
        };
        let along = of(0).over(h);
        let row = |x: &[f64]| std::array::from_fn(|j| x[j]);
        StateVariables {
            Phi: std::array::from_fn(|i| row(&along.Phi[i * ORDER..])),
            begin: row(&along.begin),
            end: row(&along.end),
            C: std::array::from_fn(|derivative| row(&of(derivative).C)),
            x: [0.0; ORDER],
        }
    }

    /// Filters the stretch from `a` to `b`; returns the output at its end.
    pub(super) fn step(&mut self, a: f64, b: f64) -> f64 {
        let x = self.x;
        self.x = std::array::from_fn(|i| {
            let moved: f64 = self.Phi[i].iter().zip(&x).map(|(p, x)| p * x).sum();
            moved + self.begin[i] * a + self.end[i] * b
        });
        self.derivative(0)
    }

    /// Output, or its first or second derivative.
    fn derivative(&self, order: usize) -> f64 {
        self.C[order].iter().zip(&self.x).map(|(c, x)| c * x).sum()
    }
}
