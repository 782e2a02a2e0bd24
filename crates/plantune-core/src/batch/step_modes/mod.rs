//! A step response as a sum of modes, and what the data support of it.
//!
//! ```text
//! y(t) = level + sum_j c_j phi_j(t) + e(t),   t from the first row after the delay
//! ```
//!
//! The `phi_j` belong to k poles ([`sections`]); their factors `c_j` hold initial state and zeros, both free. So the
//! record may start anywhere on its step, as source 003 asks for, and several steps in one record share the
//! poles. The story: the rows that count ([`steps`]); for every order poles to start from ([`starts`]) and the
//! minimum from there ([`search`]); their deviations ([`deviations`]); the order that the data support ([`order`]);
//! then gain, delay and zeros where the rest before the step is known.
//!
//! Source 003, 2 and (15), in the form of METHODS 5: variable projection instead of a search over the operator.

mod areas;
mod basis;
mod criterion;
mod delay;
mod deviations;
mod integrals;
mod order;
mod parts;
mod pencil;
mod report;
mod rising;
mod search;
mod sections;
mod sloped;
mod starts;
mod steps;
mod zeros;

pub use areas::areas;
pub use order::{Kind, Mode};
pub use report::{Parts, StepModes, Tried, band};
pub use rising::{Transformed, idt_criterion};

use self::deviations::Candidate;
use self::report::report;
use self::search::{Data, Piece};
use self::sections::Sections;
use self::steps::Steps;
use super::orders::too_short;
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{Complex, extent};
use crate::note::{Note, rounded};
use crate::record::{Record, Scale};
use crate::stats::f_tail;

/// Highest order that can be asked for.
pub const MOST_MODES: usize = 6;

/// Times that an earlier first row is tried.
const MOST_CUTS: usize = 4;

/// Deviations after which a delay is over.
const OVER: f64 = 2.0;

/// Travel of y, as a share of its size, that is rounding.
const STILL: f64 = 1e-13;

/// What may be set.
#[derive(Clone, Debug)]
pub struct StepModesOptions {
    /// Number of poles; chosen by the data when absent.
    pub order: Option<usize>,
    /// Highest order tried.
    pub max_order: usize,
    /// Time of the step, s; found in the input when absent.
    pub step_at: Option<f64>,
    /// Static gain, y/u, where it is known.
    pub gain: Option<f64>,
}

/// Finds the modes of a step response with one input and one output.
///
/// Several steps share the modes; where they contradict each other the first one is taken, with a note.
pub fn step_modes(rec: &Record, options: &StepModesOptions, limits: &Limits) -> Result<StepModes> {
    check(rec, options)?;
    let y = rec.output_held(0);
    check_output(rec, &y)?;
    let mut steps = Steps::of(rec, &y, options.step_at, limits)?;
    let mut answer = analysed(rec, options, limits, &steps, &y)?;
    for _ in 0..MOST_CUTS {
        let over = answer.delay.map(|(L, sd)| L + OVER * sd);
        let Some(earlier) = over.and_then(|delay| steps.earlier(rec, delay)) else { break };
        let Ok(again) = analysed(rec, options, limits, &earlier, &y) else { break };
        (steps, answer) = (earlier, again);
    }
    Ok(answer)
}

fn analysed(
    rec: &Record,
    options: &StepModesOptions,
    limits: &Limits,
    steps: &Steps,
    y: &[f64],
) -> Result<StepModes> {
    let together = Study::new(rec, options, limits, steps, y)?;
    let answer = report(&together)?;
    let Some(p) = together.contradiction(answer.order) else { return Ok(answer) };
    let first = steps.first();
    let mut answer = report(&Study::new(rec, options, limits, &first, y)?)?;
    answer.notes.push(together.apart(&answer.poles, p));
    Ok(answer)
}

/// The responses that are taken together, and the best fit of every order.
struct Study<'a> {
    rec: &'a Record<'a>,
    options: &'a StepModesOptions,
    limits: &'a Limits,
    steps: &'a Steps,
    scale: Scale,
    data: Data,
    all: Vec<Candidate>,
}

impl<'a> Study<'a> {
    fn new(
        rec: &'a Record<'a>,
        options: &'a StepModesOptions,
        limits: &'a Limits,
        steps: &'a Steps,
        y: &[f64],
    ) -> Result<Self> {
        let scale = Scale::of(y, true);
        let data = data(rec, steps, &scale, options.gain);
        let parameters = |k: usize| k + data.shared() + data.pieces.len() * k;
        let highest = options.order.unwrap_or(options.max_order);
        let possible = (0..=highest).take_while(|&k| data.N() > parameters(k) + 2).last().unwrap_or(0);
        let least = options.order.unwrap_or(1);
        if possible < least {
            return Err(too_short(data.N(), parameters(least) + 2));
        }
        let all = order::candidates(&data, possible, options.order.is_some());
        Ok(Study { rec, options, limits, steps, scale, data, all })
    }

    /// The p-value at which each step alone is described clearly better than all by the same poles and gain.
    fn contradiction(&self, order: usize) -> Option<f64> {
        if self.data.pieces.len() < 2 {
            return None;
        }
        let (together, r) = (&self.all[order], order::colour(&self.all));
        let alone = self.alone(&together.sections.poles())?;
        let N = together.N as f64;
        let floor = self.data.rounding * N;
        let (apart, whole) = (alone.iter().map(|a| a.1).sum::<f64>().max(floor), together.rss.max(floor));
        let parameters = (alone.len() * (2 * order + 1)) as f64;
        let (more, freedom) = (parameters - together.n as f64, N * (1.0 - r) / (1.0 + r) - parameters);
        let p = f_tail((whole / apart - 1.0) * freedom / more, more, freedom);
        (more > 0.0 && freedom > 0.0 && p < self.limits.X04).then_some(p)
    }

    /// Each step fitted on its own from these poles: its sections and sum of squares.
    fn alone(&self, poles: &[Complex<f64>]) -> Option<Vec<(Sections, f64)>> {
        let fit = |data: Data| data.fit(poles).map(|(sections, minimum)| (sections, minimum.cost));
        self.data.alone().map(fit).collect()
    }

    /// M07: the steps contradict each other.
    fn apart(&self, poles: &[Complex<f64>], p: f64) -> Note {
        let slowest = |s: &Sections| s.poles().last().map_or(0.0, |p| rounded(-1.0 / p.re)).to_string();
        let alone = self.alone(poles).unwrap_or_default();
        let each: Vec<String> = alone.iter().map(|a| slowest(&a.0)).collect();
        let text = format!(
            "the {} steps are not those of one linear plant, alone their longest time constants are {} s: the first \
             step is taken",
            self.data.pieces.len(),
            each.join(", "),
        );
        Note::warning("M07", text)
            .count(self.data.pieces.len())
            .measured(p, self.limits.X04)
            .remedy("make smaller steps, or name another one with step_at=")
    }
}

fn check(rec: &Record, options: &StepModesOptions) -> Result<()> {
    check_single(rec)?;
    let allowed = 1..=MOST_MODES;
    for (name, k) in [("order", options.order), ("max_order", Some(options.max_order))] {
        if let Some(k) = k.filter(|k| !allowed.contains(k)) {
            return Err(Error::argument(name, k, "1 to 6"));
        }
    }
    match options.gain {
        Some(K) if !(K.is_finite() && K != 0.0) => {
            Err(Error::argument("gain", K, "a finite number other than 0"))
        }
        _ => Ok(()),
    }
}

fn check_single(rec: &Record) -> Result<()> {
    if rec.nu != 1 || rec.ny != 1 {
        return Err(Error::argument(
            "rec",
            format!("a record with {} inputs and {} outputs", rec.nu, rec.ny),
            "one with a single input and a single output",
        ));
    }
    Ok(())
}

/// An output that stands still has no response.
fn check_output(rec: &Record, y: &[f64]) -> Result<()> {
    let (low, high) = extent(y);
    if high - low > STILL * low.abs().max(high.abs()) {
        return Ok(());
    }
    Err(Error::new("X04", format!("no response: {} stays at {low}", rec.names[1]))
        .at(rec.place(1, 0))
        .count(rec.N())
        .measured(high - low, STILL * low.abs().max(high.abs()))
        .remedy("record with a larger step, or check the sensor"))
}

/// The pieces, scaled, with what a known gain says taken off.
fn data(rec: &Record, steps: &Steps, scale: &Scale, gain: Option<f64>) -> Data {
    let (y, first) = (rec.output_held(0), steps.responses[0].u);
    let (several, each) = (steps.levels() > 1, steps.each());
    let pieces = steps.responses.iter().map(|r| {
        let known = known_level(steps, r.u, gain);
        let scaled = |k: usize| known.map_or(scale.apply(y[k]), |level| (y[k] - level) * scale.factor);
        let rows: Vec<(f64, f64)> =
            r.rows.clone().filter(|&k| rec.is_valid(k, 0)).map(|k| (rec.time(k), scaled(k))).collect();
        let shared = match (several, gain) {
            (true, None) => vec![1.0, r.u - first],
            (false, Some(_)) => vec![],
            _ => vec![1.0],
        };
        let means: Vec<(f64, f64)> = rows.chunks(each).map(mean).collect();
        Piece {
            first: means[0].0,
            t: means.iter().map(|m| m.0 - means[0].0).collect(),
            y: means.iter().map(|m| m.1).collect(),
            shared,
        }
    });
    Data::new(pieces.collect())
}

fn mean(rows: &[(f64, f64)]) -> (f64, f64) {
    let n = rows.len() as f64;
    (rows.iter().map(|r| r.0).sum::<f64>() / n, rows.iter().map(|r| r.1).sum::<f64>() / n)
}

/// The part of the level that a known gain gives: all of it with one level of the input, else its moves.
fn known_level(steps: &Steps, u: f64, gain: Option<f64>) -> Option<f64> {
    let K = gain?;
    Some(match (steps.levels(), &steps.rest) {
        (1, Some(rest)) => rest.y + K * rest.du,
        (1, None) => K * u,
        _ => K * (u - steps.responses[0].u),
    })
}
