//! Source 003, 4: poles by criterion (15), the order rising until nothing is left.
//!
//! The lag decides how many digits survive: neighbouring samples of a slow response are nearly equal. Too long a lag
//! folds fast roots over. So every lag 1, 2, 4, … is tried, and that one kept whose poles reproduce the samples
//! best, level and initial state free. Criterion (15) has no place for noise: how many digits it leaves is measured
//! by adding as much noise again, and less than two are refused.

use super::criterion::Criterion;
use super::search::{Data, Piece, Projection};
use super::sections::Sections;
use super::steps::Steps;
use super::zeros::numerator;
use super::{StepModesOptions, check, check_output, data};
use crate::batch::orders::too_short;
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{Complex, extent};
use crate::poly;
use crate::record::{Record, Scale};

/// Fewest digits of the poles that are given.
const LEAST_DIGITS: f64 = 2.0;

/// A higher order must leave less than this share of what the best lower one leaves.
const BETTER: f64 = 0.5;

/// The most there are.
const MOST_DIGITS: f64 = 15.0;

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
    let data = data(rec, &steps, &scale, options.gain);
    let samples = &data.pieces[0];
    let orders = options.order.map_or(1..=options.max_order, |k| k..=k);
    let least = Criterion::least(*orders.start(), 1);
    if samples.y.len() < least {
        return Err(too_short(samples.y.len(), least));
    }
    let (low, high) = extent(&samples.y);
    let (mut tried, mut best): (Vec<_>, Option<Found>) = (Vec::new(), None);
    for k in orders {
        let found = best_lag(&data, k, lag, rec.Ts, options.gain.is_some());
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
    if digits < LEAST_DIGITS {
        return Err(too_noisy(rec, &found, digits, found.rms / scale.factor));
    }
    Ok(report(rec, &steps, &scale, options, (found, tried, digits), &y))
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

/// The lag whose poles leave least of the samples.
fn best_lag(data: &Data, order: usize, lag: Option<usize>, Ts: f64, known: bool) -> Option<Found> {
    let y = &data.pieces[0].y;
    let lags = std::iter::successors(Some(1), |lag| Some(2 * lag));
    let lags: Vec<usize> = match lag {
        Some(lag) => vec![lag],
        None => lags.take_while(|&lag| 2 * Criterion::least(order, lag) <= y.len() || lag == 1).collect(),
    };
    lags.into_iter()
        .filter(|&lag| Criterion::least(order, lag) <= y.len())
        .filter_map(|lag| {
            let criterion = Criterion::new(y, order, lag, known);
            let poles = criterion.poles(Ts)?;
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
    let data = whole(steps, rec, y);
    let (level, c) = modes_of(&data, &found.poles).unwrap_or((y[response.rows.end - 1], Vec::new()));
    let rest = steps.rest.as_ref();
    let gain = options.gain.or_else(|| rest.map(|rest| (level - rest.y) / rest.du));
    let sections = Sections::of(&found.poles);
    // From the step on the same modes must do: with a delay they do not, and there are no zeros to tell.
    let from_step =
        steps.row.and(left(&data, &found.poles)).is_some_and(|rms| rms <= 10.0 * found.rms / scale.factor);
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
    }
}

/// Roots of a numerator whose leading coefficients are nothing below half of the digits.
fn zeros(numerator: &[f64], digits: f64) -> Vec<Complex<f64>> {
    let largest = numerator.iter().map(|b| b.abs()).fold(0.0, f64::max);
    let first = numerator.iter().position(|b| b.abs() > 10f64.powf(-0.5 * digits) * largest).unwrap_or(0);
    poly::roots(&numerator[first..]).into_iter().map(|(re, im)| Complex::new(re, im)).collect()
}

/// All rows from the step on, unscaled, the level free.
fn whole(steps: &Steps, rec: &Record, y: &[f64]) -> Data {
    let response = &steps.responses[0];
    let first = steps.row.unwrap_or(response.rows.start);
    let rows = first..response.rows.end;
    let t = rows.clone().map(|k| rec.time(k) - rec.time(first)).collect();
    Data::new(vec![Piece { first: rec.time(first), t, y: y[rows].to_vec(), shared: vec![1.0] }])
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
            "criterion (15) keeps {digits:.1} digits of the poles: noise of {rms:.3e} on y moves them towards T = 0"
        ),
    )
    .at(rec.place(1, 0))
    .count(found.criterion.order)
    .measured(digits, LEAST_DIGITS)
    .remedy("use pt.estimate.idt, which allows for noise")
}
