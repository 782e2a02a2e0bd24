//! A process fit looked at again: rows that count less, residuals that are not white, records that could have been.
//!
//! The scores are those of the search: derivatives by `K, K Tz, …, O` and `ln T …, ln zeta, L, …, c, d`, from
//! which the delta rule leads to the parameters. Where a profile of the loss gave an interval, its width is kept
//! in proportion.

use super::super::bootstrap::{Bootstrap, BootstrapOptions, drawn};
use super::super::robust::reweighted_fit;
use super::super::sandwich::{Sandwich, sandwich_of};
use super::super::scores::Scores;
use super::problem::{Linear, Point, Problem};
use super::{Code, Fit, OffsetOf, ProcessOptions, located};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::dot;
use crate::model::ProcessModel;
use crate::record::Record;

/// Share by which the loss of a fit may differ from that of the point that is taken for it.
const SAME: f64 = 1e-6;

/// What is known of a fit.
#[derive(Clone, Copy, Debug)]
pub struct Known<'f> {
    /// One plant per input.
    pub plants: &'f [ProcessModel],
    /// Coefficients of `C`, then of `D`, without their leading ones.
    pub noise: (&'f [f64], &'f [f64]),
    /// Rows used.
    pub N: usize,
    /// Mean squared one-step error.
    pub loss: f64,
    /// Whether an offset was estimated.
    pub offset: bool,
    /// Rows at which it changes.
    pub steps: &'f [usize],
}

/// Huber's estimate, as [`super::super::robust`] of polynomial models.
pub fn robust_process(
    rec: &Record,
    codes: &[Code],
    options: &ProcessOptions,
    limits: &Limits,
) -> Result<Fit> {
    reweighted_fit(rec, |rec| {
        let found = located(rec, codes, options, limits)?;
        let scores = found.problem.scores(&found.point).ok_or_else(|| found.problem.no_relation(1.0))?.0;
        Ok((found.fit, scores))
    })
}

/// The sandwich of a fit with covariance `P`; its widening is that of `theta`, then of the offset.
pub fn process_sandwich(
    rec: &Record,
    codes: &[Code],
    known: &Known,
    P: &[f64],
    limits: &Limits,
) -> Result<Sandwich> {
    let (problem, point) = again(rec, codes, known, limits)?;
    let (scores, linear) = problem.scores(&point).ok_or_else(stranger)?;
    let found = sandwich_of(&scores, known.noise.0.len() + known.noise.1.len() == 0)?;
    let columns = problem.told_apart();
    let (wide, plain) = (
        problem.in_units(&found.P, &columns, &point, &linear),
        problem.in_units(&found.plain, &columns, &point, &linear),
    );
    let n = wide.len().isqrt();
    let share = |own: &[f64], i: usize| {
        let (own, plain) = (own[i * n + i], plain[i * n + i]);
        if plain > 0.0 { (own / plain).sqrt() } else { 1.0 }
    };
    // What the profile adds to the delta rule.
    let profile: Vec<f64> = (0..n).map(|i| share(P, i)).collect();
    Ok(Sandwich {
        P: (0..n * n).map(|ij| wide[ij] * profile[ij / n] * profile[ij % n]).collect(),
        widening: (0..n).map(|i| share(&wide, i)).collect(),
        ..found
    })
}

/// Draws records and fits each from the fit.
pub fn process_bootstrap(
    rec: &Record,
    codes: &[Code],
    known: &Known,
    options: &BootstrapOptions,
    limits: &Limits,
) -> Result<Bootstrap> {
    let (problem, point) = again(rec, codes, known, limits)?;
    let scores = problem.scores(&point).ok_or_else(stranger)?.0;
    let polynomial = |coefficients: &[f64]| [&[1.0], coefficients].concat();
    let noise = (polynomial(known.noise.0), polynomial(known.noise.1));
    drawn(rec, &scores, &noise, options, |new| {
        let mut other = Problem::new(new, &problem.codes, &options_of(known), limits).ok()?;
        (other.noise, other.bounds) = (problem.noise, problem.bounds);
        other.steps.clone_from(&problem.steps);
        other.stretches.clone_from(&problem.stretches);
        let found = other.search(point.x.clone())?;
        let (_, linear) = other.evaluate(&found)?;
        let plants = other.plants(&found, &linear);
        let theta = plants.iter().zip(&other.codes).flat_map(|(plant, code)| code.theta(plant));
        let offset = known.offset.then(|| other.offset_of(&plants, &linear));
        Some(theta.chain(offset).collect())
    })
}

fn options_of(known: &Known) -> ProcessOptions {
    ProcessOptions {
        offset: known.offset,
        offset_of: OffsetOf::All,
        L: None,
        noise: (known.noise.0.len(), known.noise.1.len()),
    }
}

/// The problem and the point of a fit: those that leave its rows and its loss.
fn again<'r, 'a>(
    rec: &'r Record<'a>,
    codes: &[Code],
    known: &Known,
    limits: &'r Limits,
) -> Result<(Problem<'r, 'a>, Point)> {
    if codes.len() != known.plants.len() || codes.len() != rec.nu || rec.ny != 1 {
        return Err(stranger());
    }
    let of_plant = |(code, plant): (&Code, &ProcessModel)| Code { pair: plant.zeta.is_some(), ..*code };
    let codes: Vec<Code> = codes.iter().zip(known.plants).map(of_plant).collect();
    let options = options_of(known);
    for at_rest in [true, false] {
        let mut problem = Problem::new(rec, &codes, &options, limits)?;
        if !at_rest {
            problem = problem.without_rest();
        }
        problem.noise = options.noise;
        problem.steps = known.steps.to_vec();
        if let Some(point) = problem.point_of(known) {
            return Ok((problem, point));
        }
    }
    Err(stranger())
}

fn stranger() -> Error {
    Error::argument("rec", "another record than that of the fit", "the one it was fitted to")
}

impl Problem<'_, '_> {
    fn point_of(&self, known: &Known) -> Option<Point> {
        let Ts = self.rec.Ts;
        let of_plant = |(plant, code): (&ProcessModel, &Code)| {
            let shape = plant.T.iter().map(|T| T / Ts).chain(plant.zeta).map(f64::ln);
            shape.chain(code.delay.then_some(plant.L / Ts)).collect::<Vec<f64>>()
        };
        let plants = known.plants.iter().zip(&self.codes).flat_map(of_plant);
        let x: Vec<f64> = plants.chain(known.noise.0.iter().chain(known.noise.1).copied()).collect();
        let m = self.cells_of(&x);
        let longest = m.iter().max().copied().unwrap_or(0);
        let history = (longest + 1..self.y.len()).find(|&history| self.rows(history) <= known.N)?;
        let point = Point { x, m, history, cost: f64::NAN, status: super::super::fit::Status::Converged };
        let (cost, _) = self.evaluate(&point)?;
        let loss = cost / known.N as f64 / self.scale_y.factor.powi(2);
        let rounding = 1e-18 * dot(&self.y, &self.y) / self.scale_y.factor.powi(2);
        ((loss - known.loss).abs() <= SAME * known.loss + rounding).then_some(Point { cost, ..point })
    }

    /// Scores in the record's unit of y, of the columns that data can tell apart; states are taken out of them.
    pub(super) fn scores(&self, point: &Point) -> Option<(Scores, Linear)> {
        let (_, linear) = self.evaluate(point)?;
        Some((self.scores_with(point, &linear)?, linear))
    }

    /// The same for what follows linearly, where it is not that of the point itself.
    pub(super) fn scores_with(&self, point: &Point, linear: &Linear) -> Option<Scores> {
        let mut scores = Scores {
            psi: vec![],
            eps: vec![],
            rows: vec![],
            segments: vec![],
            states: self.free_states(point.history),
        };
        let (told, mut number) = (self.told_apart(), 0);
        self.each_stretch(point, linear, |s, columns| {
            let first = s.first(point.history);
            let valid: Vec<usize> = (first..s.rows.end).filter(|&k| self.rec.is_valid(k, 0)).collect();
            let column = |j: usize| -> Vec<f64> {
                valid.iter().map(|&k| columns[j][k - first] / self.scale_y.factor).collect()
            };
            let mut eps = column(columns.len() - 1);
            let known = linear.x0[number].iter().chain(&linear.theta);
            for (j, factor) in known.enumerate() {
                eps.iter_mut().zip(column(j)).for_each(|(e, x)| *e -= factor * x);
            }
            let states = orthonormal((0..self.locals()).map(column));
            let without = |mut x: Vec<f64>| {
                states.iter().for_each(|z| take_out(z, &mut x));
                x
            };
            let psi: Vec<Vec<f64>> = told.iter().map(|j| without(column(self.locals() + j))).collect();
            scores.psi.extend((0..valid.len()).flat_map(|t| psi.iter().map(move |x| x[t])));
            scores.eps.extend(eps);
            for run in valid.chunk_by(|a, b| a + 1 == *b) {
                let start = scores.rows.len();
                scores.rows.extend(run);
                scores.segments.push(start..scores.rows.len());
            }
            number += 1;
        })?;
        Some(scores)
    }
}

/// Unit vectors of the span of columns, those that depend on others left out.
fn orthonormal(columns: impl Iterator<Item = Vec<f64>>) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = Vec::new();
    for mut x in columns {
        let size = dot(&x, &x).sqrt();
        for _ in 0..2 {
            all.iter().for_each(|z| take_out(z, &mut x));
        }
        let left = dot(&x, &x).sqrt();
        if left > 1e-10 * size {
            x.iter_mut().for_each(|x| *x /= left);
            all.push(x);
        }
    }
    all
}

/// `x <- x - z (z' x)`.
fn take_out(z: &[f64], x: &mut [f64]) {
    let share = dot(z, x);
    x.iter_mut().zip(z).for_each(|(x, z)| *x -= share * z);
}
