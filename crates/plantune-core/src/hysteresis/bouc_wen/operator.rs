//! The oscillator at work: Runge and Kutta's rule of fourth order, several steps per sample.
//!
//! ```text
//! y' = v    v' = (u - c v - k y - z) / m    z' = v (alpha - |z|^nu (bg sgn(v z) + bd))
//! ```
//!
//! The benchmark's displacement, from its true parameters: 1.0e-6 m rms with two steps per sample, 3.6e-7 with
//! four, 2.6e-7 with eight, which is where the published data end.

use super::spline::{Between, Hold, fill_plain};
use super::{BoucWen, power, sign};
use crate::error::{Error, Result};
use crate::hysteresis::{Operator, copy_state};

/// Output over a record of forces from `x0 = (y, y', z)`, the output at each row before its force acts on.
pub fn simulate(
    model: &BoucWen,
    u: &[f64],
    Ts: f64,
    x0: [f64; 3],
    hold: Hold,
    steps: Option<usize>,
) -> Result<Vec<f64>> {
    let model = BoucWen { Ts: Some(Ts), ..model.clone() };
    model.check()?;
    let steps = steps.unwrap_or_else(|| model.steps(Ts));
    if steps == 0 {
        return Err(Error::argument("substeps", 0, "1 or more"));
    }
    let between = Between::new(u, hold);
    let mut points = vec![0.0; 2 * steps + 1];
    let mut s = x0;
    let mut y = Vec::with_capacity(u.len());
    for t in 0..u.len() {
        if t > 0 {
            between.fill(t - 1, &mut points);
            s = over_sample(&model, s, &points, Ts);
        }
        y.push(s[0]);
    }
    if let Some(row) = y.iter().position(|y| !y.is_finite()) {
        return Err(overflow(row, Ts));
    }
    Ok(y)
}

fn overflow(row: usize, Ts: f64) -> Error {
    Error::new("N02", format!("the output grows beyond all numbers at row {row}")).count(row).remedy(format!(
        "take more substeps, or a shorter sample time than {Ts} s; the model may be unstable"
    ))
}

/// From one sample to the next, given the force at the ends and the middle of every step.
fn over_sample(model: &BoucWen, mut s: [f64; 3], points: &[f64], Ts: f64) -> [f64; 3] {
    let h = Ts / (points.len() / 2) as f64;
    for force in points.windows(3).step_by(2) {
        s = step(model, s, [force[0], force[1], force[2]], h);
    }
    s
}

fn step(model: &BoucWen, s: [f64; 3], u: [f64; 3], h: f64) -> [f64; 3] {
    let along = |k: &[f64; 3], h: f64| [s[0] + h * k[0], s[1] + h * k[1], s[2] + h * k[2]];
    let k1 = slope(model, s, u[0]);
    let k2 = slope(model, along(&k1, h / 2.0), u[1]);
    let k3 = slope(model, along(&k2, h / 2.0), u[1]);
    let k4 = slope(model, along(&k3, h), u[2]);
    let mean = |i: usize| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0;
    along(&[mean(0), mean(1), mean(2)], h)
}

fn slope(p: &BoucWen, [y, v, z]: [f64; 3], u: f64) -> [f64; 3] {
    let drag = p.bg * sign(v * z) + p.bd;
    [v, (u - p.c * v - p.k * y - z) / p.m, v * (p.alpha - power(z.abs(), p.nu) * drag)]
}

/// The oscillator, sample by sample.
pub struct Oscillator {
    model: BoucWen,
    Ts: f64,
    points: Vec<f64>,
    s: [f64; 3],
    /// The force at the last sample, once there was one.
    before: Option<f64>,
}

impl Oscillator {
    pub(super) fn new(model: BoucWen, Ts: f64) -> Self {
        let points = vec![0.0; 2 * model.steps(Ts) + 1];
        Oscillator { model, Ts, points, s: [0.0; 3], before: None }
    }
}

impl Operator for Oscillator {
    fn step(&mut self, u: f64) -> f64 {
        if let Some(before) = self.before {
            fill_plain(before, u, Hold::Line, &mut self.points);
            self.s = over_sample(&self.model, self.s, &self.points, self.Ts);
        }
        self.before = Some(u);
        self.s[0]
    }

    /// `y, y', z`, and the last force; NaN before the first.
    fn state(&self) -> Vec<f64> {
        [&self.s[..], &[self.before.unwrap_or(f64::NAN)]].concat()
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        let mut own = [0.0; 4];
        copy_state(&mut own, state)?;
        self.s.copy_from_slice(&own[..3]);
        self.before = (!own[3].is_nan()).then_some(own[3]);
        Ok(())
    }
}
