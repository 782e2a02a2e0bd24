//! Refined instrumental variables for continuous time, with a search of the dead time:
//! `y = B(s)/A(s) e^(-L s) u + O + e`, `A = a_n s^n + … + a_1 s + 1`, `B = b_(nb-1) s^(nb-1) + … + b_0`.
//!
//! With `A` and `L` of the last round y and u are filtered by `1/A(s)`, which gives their derivatives without a
//! difference ([`filter`]); `A` and `B` follow from a regression whose instruments are the same derivatives of the
//! simulated output ([`data`]). Where the rounds rest, the instruments are the derivatives of the output to the
//! parameters, so the estimate is efficient for white output noise, with covariance `s^2 (J'J)^-1`. The dead time
//! is searched on a grid of half samples, then between its points ([`search`]).
//!
//! The input is exact (held, the fraction of the delay included), y is taken as linear between samples: an error
//! of order Ts^2 in the regressors, not in the instruments. In closed loop u follows the noise, and the
//! instruments with it: biased.
//!
//! Young and Jakeman 1980; Garnier and Wang 2008; Young 2011; Chen, Garnier and Gilson 2015 for the delay.

mod data;
mod filter;
mod search;

use self::data::{Data, Point};
use super::fit::{Fit, Status, standard_deviations};
use super::orders::too_short;
use super::sampling::sampling;
use crate::error::{Error, Result};
use crate::excitation::{check_input_motion, excitation_order, too_poor};
use crate::limits::Limits;
use crate::linalg::congruence;
use crate::model::{Fopdt, Model, TransferFunction};
use crate::note::{Note, Place};
use crate::record::Record;
use crate::relation::chance;
use crate::stats::f_tail;

/// Relative change of `a` in the last round up to which the rounds have come to rest.
const AT_REST: f64 = 1e-6;

/// Moves of the input up to which a record is a step test, too short in motion for a test of colour.
const MOST_MOVES: usize = 6;

/// Highest order: a fifth derivative of noise holds nothing.
const HIGHEST: usize = 4;

/// Longest delay searched by default, samples.
const LONGEST: f64 = 200.0;

/// What may be set.
#[derive(Clone, Debug)]
pub struct SrivcOptions {
    /// Number of poles.
    pub n: usize,
    /// Number of coefficients of the numerator, at most `n`.
    pub nb: usize,
    /// Whether an offset is estimated.
    pub offset: bool,
    /// Range of delays to search, s; a quarter of the longest segment, at most 200 samples, when absent.
    pub L: Option<(f64, f64)>,
}

/// Fits a transfer function in s with a dead time to a record with one input and one output.
pub fn srivc(rec: &Record, options: &SrivcOptions, limits: &Limits) -> Result<Fit> {
    check(rec, options)?;
    check_input_motion(rec, limits)?;
    let bounds = bounds(rec, options, limits)?;
    let data = Data::new(rec, options.n, options.nb, options.offset);
    let parameters = options.n * (1 + data.stretches.len()) + data.linear() + 1;
    let rows = data.rows(bounds.1.ceil() as usize + 1);
    if rows <= parameters {
        return Err(too_short(rows, parameters));
    }
    let wanted = options.n + options.nb + 1;
    let supported = excitation_order(rec, 0, wanted, limits.X02);
    if supported < wanted {
        return Err(too_poor(rec, 0, supported, wanted, limits));
    }
    let (best, history) = data.best(bounds).ok_or_else(|| no_relation(rec, 1.0, limits))?;
    check_relation(rec, &data, &best, history, (bounds.1 - bounds.0).ceil(), limits)?;
    fit(rec, &data, &best, (history, bounds), limits)
}

fn check(rec: &Record, options: &SrivcOptions) -> Result<()> {
    if rec.nu != 1 || rec.ny != 1 {
        return Err(Error::argument(
            "rec",
            format!("a record with {} inputs and {} outputs", rec.nu, rec.ny),
            "one with a single input and a single output",
        ));
    }
    if !(1..=HIGHEST).contains(&options.n) {
        return Err(Error::argument("n", options.n, &format!("from 1 to {HIGHEST}")));
    }
    if !(1..=options.n).contains(&options.nb) {
        return Err(Error::argument("nb", options.nb, &format!("from 1 to n = {}", options.n)));
    }
    Ok(())
}

/// Delays to search, samples.
fn bounds(rec: &Record, options: &SrivcOptions, limits: &Limits) -> Result<(f64, f64)> {
    let Some((low, high)) = options.L else {
        let longest = rec.segments().map(|s| s.len()).max().unwrap_or(0);
        return Ok((0.0, (longest as f64 / 4.0).floor().min(LONGEST)));
    };
    if !(low >= 0.0 && high >= low && high.is_finite()) {
        let came = format!("({low}, {high})");
        return Err(Error::argument("L", came, "an ascending pair of seconds, at least 0"));
    }
    let most = limits.X05 * rec.N() as f64 * rec.Ts;
    if high >= most {
        let text = format!("delays up to {high} s are asked of a record of {} s", rec.N() as f64 * rec.Ts);
        return Err(Error::new("X05", text)
            .at(Place::column("L"))
            .measured(high, most)
            .remedy("record at least three times as long as the longest delay"));
    }
    Ok((low / rec.Ts, high / rec.Ts))
}

/// X04: the F test of all parameters, its p-value times the delays tried, and that of [`chance`].
fn check_relation(
    rec: &Record,
    data: &Data,
    best: &Point,
    history: usize,
    tried: f64,
    limits: &Limits,
) -> Result<()> {
    let more = (data.n + data.nb + 1) as f64;
    let freedom = data.rows(history) as f64 - more - (data.n * data.stretches.len()) as f64;
    let gain = data.without_input(best, history) - best.rss;
    let F = gain / more / (best.rss / freedom).max(f64::MIN_POSITIVE);
    let mut p = f_tail(F, more, freedom);
    let moves = |s: &std::ops::Range<usize>| data.u[s.clone()].windows(2).filter(|w| w[0] != w[1]).count();
    if data.stretches.iter().all(|(segment, _)| moves(segment) > MOST_MOVES) {
        p = p.max(chance(&data.answers(best, history)));
    }
    let p = (p * tried.max(1.0)).min(1.0);
    if p > limits.X04 { Err(no_relation(rec, p, limits)) } else { Ok(()) }
}

fn no_relation(rec: &Record, p: f64, limits: &Limits) -> Error {
    let text = format!("no relation: {} explains nothing of {} beyond chance", rec.names[0], rec.names[1]);
    Error::new("X04", text)
        .at(Place::column(&rec.names[1]))
        .count(rec.N())
        .measured(p, limits.X04)
        .remedy("check that these two columns belong together; record with larger steps of the input")
}

/// The fit in the record's units: `K, T, L` of a first order, else `a_1 … a_n, b_0 … b_(nb-1), L`.
fn fit(
    rec: &Record,
    data: &Data,
    best: &Point,
    (history, bounds): (usize, (f64, f64)),
    limits: &Limits,
) -> Result<Fit> {
    let (N, n, nb) = (data.rows(history), data.n, data.nb);
    let solution = data.information(best, history).ok_or_else(|| no_relation(rec, 1.0, limits))?;
    let estimated = n + data.linear() + 1;
    let parameters = estimated + n * data.stretches.len();
    if N <= parameters {
        return Err(too_short(N, parameters));
    }
    let s2 = best.rss / (N - parameters) as f64;
    let map = Map::new(data, rec.Ts);
    let P = congruence(&map.rows, |i, j| s2 * solution.inverse_gram[i * estimated + j]);
    let scaled: Vec<f64> = best.a.iter().chain(&best.b).chain([&best.L]).copied().collect();
    let values: Vec<f64> =
        map.rows.iter().map(|row| row.iter().zip(&scaled).map(|(m, x)| m * x).sum()).collect();
    let theta = values[..n + nb + 1].to_vec();
    let sd = standard_deviations(&P, theta.len());
    let first = n == 1 && nb == 1;
    let speed = if first { sampling(theta[1], theta[1] + 2.0 * sd[1], rec.Ts, limits)? } else { None };
    let status = if best.moved <= AT_REST { Status::Converged } else { Status::NotConverged };
    Fit {
        model: model(&theta, n, nb),
        names: names(n, nb),
        offset: if data.offset { data.y_scale.zero + values[n + nb + 1] } else { 0.0 },
        steps: Vec::new(),
        x0: rec.segments().map(|_| Vec::new()).collect(),
        N,
        loss: best.rss / N as f64 / data.y_scale.factor.powi(2),
        status,
        expected_digits: vec![(15.0 + solution.ratio.log10()).max(0.0); theta.len()],
        notes: notes(best, bounds, N, parameters, status, limits).into_iter().chain(speed).collect(),
        intervals: Vec::new(),
        plants: Vec::new(),
        sampled: None,
        theta,
        P,
    }
    .finite()
}

fn model(theta: &[f64], n: usize, nb: usize) -> Model {
    if n == 1 && nb == 1 {
        return Fopdt { K: theta[0], T: theta[1], L: theta[2] }.into();
    }
    let den = theta[..n].iter().rev().copied().chain([1.0]).collect();
    let num = theta[n..n + nb].iter().rev().copied().collect();
    TransferFunction { num, den, L: theta[n + nb] }.into()
}

fn names(n: usize, nb: usize) -> Vec<String> {
    if n == 1 && nb == 1 {
        return ["K", "T", "L"].map(str::to_owned).to_vec();
    }
    let (a, b) = ((1..=n).map(|k| format!("a{k}")), (0..nb).map(|k| format!("b{k}")));
    a.chain(b).chain(["L".to_owned()]).collect()
}

/// What the parameters of the fit are of the scaled ones `a, b, O, L`: linear, row by row.
struct Map {
    rows: Vec<Vec<f64>>,
}

impl Map {
    fn new(data: &Data, Ts: f64) -> Self {
        let (n, nb) = (data.n, data.nb);
        let width = n + data.linear() + 1;
        let gain = data.u_scale.factor / data.y_scale.factor;
        let unit = |at: usize, value: f64| {
            let mut row = vec![0.0; width];
            row[at] = value;
            row
        };
        let power = |k: usize| Ts.powi(k as i32);
        let mut rows: Vec<Vec<f64>> = (0..n).map(|k| unit(k, power(k + 1))).collect();
        rows.extend((0..nb).map(|k| unit(n + k, gain * power(k))));
        if n == 1 && nb == 1 {
            rows.swap(0, 1); // K before T
        }
        rows.push(unit(width - 1, Ts));
        if data.offset {
            let mut row = unit(n + nb, 1.0 / data.y_scale.factor);
            row[n] = -gain * data.u_scale.zero;
            rows.push(row);
        }
        Map { rows }
    }
}

fn notes(
    best: &Point,
    bounds: (f64, f64),
    N: usize,
    parameters: usize,
    status: Status,
    limits: &Limits,
) -> Vec<Note> {
    let per_parameter = N as f64 / parameters as f64;
    let few = (per_parameter < limits.X03).then(|| {
        Note::warning("X03", format!("{N} rows for {parameters} parameters: intervals are rough"))
            .count(N)
            .measured(per_parameter, limits.X03)
            .remedy("record longer")
    });
    let moving = (status != Status::Converged).then(|| {
        Note::warning("N05", "the rounds did not come to rest")
            .measured(best.moved, AT_REST)
            .remedy("ask for a lower order, or give a range of delays: L=(low, high)")
    });
    let at_end = (best.L >= bounds.1 - 0.25 && bounds.1 > bounds.0).then(|| {
        Note::warning("X05", "the delay lies at the end of the range searched")
            .at(Place::column("L"))
            .measured(best.L, bounds.1)
            .remedy("search a wider range: L=(low, high)")
    });
    few.into_iter().chain(moving).chain(at_end).collect()
}
