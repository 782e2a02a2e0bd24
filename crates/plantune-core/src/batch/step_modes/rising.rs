//! Source 003, 4: poles by criterion (15), the order rising until nothing is left.
//!
//! The lag decides how many digits survive: neighbouring samples of a slow response are nearly equal. Too long a lag
//! folds fast roots over. So every lag 1, 2, 4, … is tried, and that one kept whose poles reproduce the samples
//! best, level and initial state free; of a long record they are judged on
//! rows evenly picked. Criterion (15) has no place for noise: how many digits it leaves is measured
//! by adding as much noise again, and less than two are refused.

use std::ops::Range;

use super::criterion::Criterion;
use super::search::{Data, Piece, Projection};
use super::sections::Sections;
use super::steps::Steps;
use super::zeros::numerator;
use super::{StepModesOptions, check, check_output, known_level};
use crate::batch::orders::too_short;
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{Complex, extent};
use crate::note::Note;
use crate::poly;
use crate::record::{Record, Scale};

/// Fewest digits of the poles that are given.
const LEAST_DIGITS: f64 = 2.0;

/// A higher order must leave less than this share of what the best lower one leaves.
const BETTER: f64 = 0.5;

/// The most there are.
const MOST_DIGITS: f64 = 15.0;

/// Share of the travel of y below which what is left is rounding.
const ROUNDING: f64 = 1e-12;

/// Rows on which lags are judged.
const MOST_JUDGED: usize = 10_000;

/// What (15) makes of a step response.
#[derive(Clone, Debug)]
pub struct Transformed {
    /// 1/s, by falling rate.
    pub poles: Vec<Complex<f64>>,
    /// Samples between the values of one row.
    pub lag: usize,
    /// What y ends at.
    pub level: f64,
    /// Static gain, where the level before the step is known, or 1 or as given where it was given.
    pub gain: Option<f64>,
    /// Of the plant, descending powers, the last 1; None where the record does not begin at rest without delay.
    pub numerator: Option<Vec<f64>>,
    /// Its roots, 1/s, leading coefficients that are nothing left out.
    pub zeros: Vec<Complex<f64>>,
    /// Root mean square of y minus its modes.
    pub rms: f64,
    /// Decimal digits of the poles that noise leaves.
    pub digits: f64,
    /// Of each order tried its best lag and what is left, units of y; none where no root settles.
    pub tried: Vec<Rise>,
    /// First and last row used.
    pub rows: (usize, usize),
    /// Doubts.
    pub notes: Vec<Note>,
}

/// An order, and its best lag with what it leaves.
pub type Rise = (usize, Option<(usize, f64)>);

/// One order at its best lag.
struct Found {
    criterion: Criterion,
    poles: Vec<Complex<f64>>,
    rms: f64, // scaled
}

/// Poles of a step response by (15); what is left must fall below `eps` times the travel of y.
pub fn idt_criterion(
    rec: &Record,
    options: &StepModesOptions,
    lag: Option<usize>,
    eps: f64,
    limits: &Limits,
) -> Result<Transformed> {
    check(rec, options)?;
    check_evenly_sampled(rec, lag, eps)?;
    let y = rec.output_held(0);
    check_output(rec, &y)?;
    let steps = Steps::of(rec, &y, options.step_at, limits)?.first();
    let scale = Scale::of(&y, true);
    let known = known_level(&steps, steps.responses[0].u, options.gain);
    let scaled = |k: usize| known.map_or(scale.apply(y[k]), |level| (y[k] - level) * scale.factor);
    let rows = steps.responses[0].rows.clone();
    let data = judged(rec, rows.clone(), known.is_none(), scaled);
    let counting = |k: usize| if rec.is_valid(k, 0) { scaled(k) } else { f64::NAN };
    let samples: Vec<f64> = rows.map(counting).collect();
    let orders = options.order.map_or(1..=options.max_order, |k| k..=k);
    check_length(samples.len(), *orders.start(), lag)?;
    let (low, high) = extent(&data.pieces[0].y);
    let (mut tried, mut best): (Vec<_>, Option<Found>) = (Vec::new(), None);
    for k in orders {
        let found = best_lag(&samples, &data, k, lag, rec.Ts);
        tried.push((k, found.as_ref().map(|f| (f.criterion.lag, f.rms / scale.factor))));
        if let Some(found) = found.filter(|f| best.as_ref().is_none_or(|b| f.rms < BETTER * b.rms)) {
            let done = found.rms <= eps * (high - low);
            best = Some(found);
            if done {
                break;
            }
        }
    }
    let found = best.ok_or_else(|| no_roots(rec, &tried))?;
    let digits = digits(&found, rec.Ts);
    if digits < LEAST_DIGITS && options.order.is_some() && found.rms <= ROUNDING * (high - low) {
        return Err(too_many(rec, &found, digits));
    }
    if digits < LEAST_DIGITS {
        return Err(too_noisy(rec, &found, digits, found.rms / scale.factor));
    }
    let above = found.rms > eps * (high - low);
    let notes = above.then(|| noisy(rec, &found, digits, eps * (high - low), scale.factor));
    let notes = notes.into_iter().chain(steps.start(rec)).collect();
    Ok(Transformed { notes, ..report(rec, &steps, &scale, options, (found, tried, digits), &y) })
}

fn check_evenly_sampled(rec: &Record, lag: Option<usize>, eps: f64) -> Result<()> {
    if rec.t.is_some() {
        return Err(Error::argument(
            "rec",
            "a record with uneven stamps",
            "uniform: use pt.estimate.idt, or resample",
        ));
    }
    if lag == Some(0) {
        return Err(Error::argument("lag", 0, "at least 1"));
    }
    if !(eps > 0.0) {
        return Err(Error::argument("eps", eps, "a positive share of the travel of y"));
    }
    Ok(())
}

fn check_length(rows: usize, order: usize, lag: Option<usize>) -> Result<()> {
    let least = Criterion::least(order, 1);
    if rows < least {
        return Err(too_short(rows, least));
    }
    let longest = (rows - least) / order + 1;
    match lag {
        Some(lag) if lag > longest => {
            Err(Error::argument("lag", lag, &format!("at most {longest} for order {order} and {rows} rows")))
        }
        _ => Ok(()),
    }
}

/// At most so many rows that count, evenly picked, from the first on.
fn judged(rec: &Record, rows: Range<usize>, level: bool, value: impl Fn(usize) -> f64) -> Data {
    let rows: Vec<usize> = rows.filter(|&k| rec.is_valid(k, 0)).collect();
    let picked = || rows.iter().step_by(rows.len().div_ceil(MOST_JUDGED).max(1));
    let first = rows.first().copied().unwrap_or(0);
    Data::new(vec![Piece {
        first: rec.time(first),
        t: picked().map(|&k| (k - first) as f64 * rec.Ts).collect(),
        y: picked().map(|&k| value(k)).collect(),
        shared: if level { vec![1.0] } else { Vec::new() },
    }])
}

/// The lag whose poles leave least of the samples.
fn best_lag(y: &[f64], data: &Data, order: usize, lag: Option<usize>, Ts: f64) -> Option<Found> {
    let lags = std::iter::successors(Some(1), |lag| Some(2 * lag));
    let lags: Vec<usize> = match lag {
        Some(lag) => vec![lag],
        None => lags.take_while(|&lag| 2 * Criterion::least(order, lag) <= y.len() || lag == 1).collect(),
    };
    lags.into_iter()
        .filter(|&lag| Criterion::least(order, lag) <= y.len())
        .filter_map(|lag| {
            let criterion = Criterion::new(y, order, lag, data.shared() == 0);
            let poles = criterion.is_determined().then(|| criterion.poles(Ts))??;
            let rms = left(data, &poles)?;
            Some(Found { criterion, poles, rms })
        })
        .min_by(|a, b| a.rms.total_cmp(&b.rms))
}

/// Root mean square of the samples minus the nearest sum of these modes and a level.
fn left(data: &Data, poles: &[Complex<f64>]) -> Option<f64> {
    let piece = &data.pieces[0];
    let mut projection = Projection::new(data, Sections::of(poles));
    projection.fill();
    let linear = projection.linear()?;
    let modes = |n: usize| -> f64 {
        linear.c[0].iter().enumerate().map(|(j, c)| c * projection.basis(0).column(0, j)[n]).sum()
    };
    let level = linear.beta.first().copied().unwrap_or(0.0);
    let square = |n: usize| (piece.y[n] - level - modes(n)).powi(2);
    let sum: f64 = (0..piece.y.len()).map(square).sum();
    let freedom = piece.y.len().saturating_sub(2 * poles.len() + linear.beta.len()).max(1);
    Some((sum / freedom as f64).sqrt())
}

/// Digits of the least certain pole: what noise leaves, its bias and twice its scatter.
fn digits(found: &Found, Ts: f64) -> f64 {
    let (criterion, before) = (&found.criterion, ordered(found.poles.clone()));
    let Some(d) = criterion.coefficients() else { return 0.0 };
    // Errors of the rows: those of y through the transform.
    let size = found.rms * d.iter().map(|d| d * d).sum::<f64>().sqrt();
    let noisy = std::iter::once((criterion.with_noise(found.rms * found.rms), 1.0));
    let shaken = (0..criterion.unknowns()).map(|i| (criterion.shaken(i, size), 2.0));
    let mut shift2 = vec![0.0; before.len()];
    for (criterion, times) in noisy.chain(shaken) {
        let Some(after) = criterion.poles(Ts) else { return 0.0 };
        for ((shift2, p), q) in shift2.iter_mut().zip(&before).zip(ordered(after)) {
            *shift2 += (times * (p - q).norm() / p.norm()).powi(2);
        }
    }
    (-0.5 * shift2.iter().copied().fold(0.0, f64::max).log10()).clamp(0.0, MOST_DIGITS)
}

/// By falling rate.
fn ordered(mut poles: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
    poles.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
    poles
}

fn report(
    rec: &Record,
    steps: &Steps,
    scale: &Scale,
    options: &StepModesOptions,
    (found, tried, digits): (Found, Vec<Rise>, f64),
    y: &[f64],
) -> Transformed {
    let response = &steps.responses[0];
    // Unscaled and the level free, from the step on.
    let first = steps.row.unwrap_or(response.rows.start);
    let data = judged(rec, first..response.rows.end, true, |k| y[k]);
    let (level, c) = modes_of(&data, &found.poles).unwrap_or((y[response.rows.end - 1], Vec::new()));
    let rest = steps.rest.as_ref();
    let gain = options.gain.or_else(|| rest.map(|rest| (level - rest.y) / rest.du));
    let sections = Sections::of(&found.poles);
    // From the step on the same modes must do: with a delay they do not, and there are no zeros to tell.
    let from_step = steps.row.filter(|&row| rec.is_valid(row, 0)).and(left(&data, &found.poles));
    let from_step = from_step.is_some_and(|rms| rms <= 10.0 * found.rms / scale.factor);
    let at_rest = rest.map_or(0.0, |rest| rest.y);
    let numerator = (from_step && !c.is_empty()).then(|| numerator(&sections, level - at_rest, &c));
    let zeros = numerator.as_deref().map_or(Vec::new(), |n| zeros(n, digits));
    Transformed {
        poles: ordered(found.poles),
        lag: found.criterion.lag,
        level,
        gain,
        numerator,
        zeros,
        rms: found.rms / scale.factor,
        digits,
        tried,
        rows: (response.rows.start, response.rows.end - 1),
        notes: Vec::new(),
    }
}

/// Roots of a numerator whose leading coefficients are nothing below half of the digits.
fn zeros(numerator: &[f64], digits: f64) -> Vec<Complex<f64>> {
    let largest = numerator.iter().map(|b| b.abs()).fold(0.0, f64::max);
    let first = numerator.iter().position(|b| b.abs() > 10f64.powf(-0.5 * digits) * largest).unwrap_or(0);
    poly::roots(&numerator[first..]).into_iter().map(|(re, im)| Complex::new(re, im)).collect()
}

/// Level and states at the first row.
fn modes_of(data: &Data, poles: &[Complex<f64>]) -> Option<(f64, Vec<f64>)> {
    let mut projection = Projection::new(data, Sections::of(poles));
    projection.fill();
    let mut linear = projection.linear()?;
    Some((linear.beta[0], linear.c.swap_remove(0)))
}

/// X02: no order has roots of a response that settles.
fn no_roots(rec: &Record, tried: &[Rise]) -> Error {
    let most = tried.last().map_or(0, |t| t.0);
    Error::new("X02", format!("no order up to {most} has roots of a response that settles"))
        .at(rec.place(1, 0))
        .count(most)
        .remedy("use pt.estimate.idt, which allows for noise; record until the response settles")
}

/// N04: (15) under noise.
fn too_noisy(rec: &Record, found: &Found, digits: f64, rms: f64) -> Error {
    Error::new(
        "N04",
        format!(
            "criterion (15) keeps {digits:.1} digits of the poles: what order {} leaves of y, {rms:.3e} rms, moves \
             them towards T = 0",
            found.criterion.order
        ),
    )
    .at(rec.place(1, 0))
    .count(found.criterion.order)
    .measured(digits, LEAST_DIGITS)
    .remedy("use pt.estimate.idt, which allows for noise")
}

/// X02: an order beyond that of the response.
fn too_many(rec: &Record, found: &Found, digits: f64) -> Error {
    let order = found.criterion.order;
    Error::new("X02", format!("order {order} is more than y holds: roots beyond its modes are arbitrary"))
        .at(rec.place(1, 0))
        .count(order)
        .measured(digits, LEAST_DIGITS)
        .remedy("ask for a lower order, or leave it to the data with order=\"auto\"")
}

/// N04: more is left than was asked for.
fn noisy(rec: &Record, found: &Found, digits: f64, most: f64, factor: f64) -> Note {
    let text = format!(
        "order {} leaves {:.3e} rms of y, which keeps {digits:.1} digits of the poles",
        found.criterion.order,
        found.rms / factor
    );
    Note::warning("N04", text)
        .at(rec.place(1, 0))
        .measured(found.rms / factor, most / factor)
        .remedy("use pt.estimate.idt, which allows for noise, or a larger eps")
}
