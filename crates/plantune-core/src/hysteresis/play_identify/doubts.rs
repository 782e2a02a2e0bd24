//! What a record leaves in doubt about a stack of plays.

use super::{Form, HeldOut, PARTS};
use crate::error::{Error, Result};
use crate::hysteresis::misfit::rms;
use crate::hysteresis::{Model, cycles};
use crate::note::{Note, rounded};

/// Area of a loop, as a share of its box, from which its sense is told.
const OPEN: f64 = 0.01;

/// How many times worse the first rows must fit for a doubt about the virgin state, and rows that must follow.
const WORSE: f64 = 1.5;
const SETTLED_LEAST: usize = 20;

/// Inner turning points that show plays at work.
const TURNS: usize = 2;

/// Refuses a fit that predicts half of the rows not used worse than a constant does.
pub(super) fn refuse_what_predicts_nothing(
    x: &[f64],
    y: &[f64],
    held_out: &HeldOut,
    form: Form,
) -> Result<()> {
    if 2 * held_out.lost < PARTS {
        return Ok(());
    }
    let remedy = match form {
        Form::Even(_) => "record x and y of the same rows, from the virgin state",
        _ if clockwise(&x[x.len() - y.len()..], y) => {
            "the loop runs clockwise, plays only run the other way: take MaxwellSlip"
        }
        _ => "record x and y of the same rows, from the virgin state; of a butterfly loop take `even=True`",
    };
    Err(Error::new("X04", "the fit predicts rows not used no better than a constant")
        .measured(held_out.lost as f64 / PARTS as f64, 0.5)
        .remedy(remedy))
}

pub(super) fn doubts(model: &Model, x: &[f64], y: &[f64], merged: usize) -> Vec<Note> {
    let even = matches!(model, Model::Even(_));
    let clockwise = (!even && clockwise(x, y)).then(|| {
        let text = "the loop runs clockwise: y leads where x turns, and plays only lag";
        Note::warning("H02", text).remedy("take MaxwellSlip, whose elements are x less a play")
    });
    [at_zero(model), clockwise, few_turns(x), merged_segments(merged)].into_iter().flatten().collect()
}

fn at_zero(model: &Model) -> Option<Note> {
    let stack = match model {
        Model::PlayStack(stack) => stack,
        Model::Asymmetric(stack) => &stack.plays,
        _ => return None,
    };
    let zero: Vec<usize> = (0..stack.w.len()).filter(|i| stack.w[*i] == 0.0).collect();
    let names: Vec<String> = zero.iter().map(|i| format!("w{i}")).collect();
    let text = format!("at zero: {}", names.join(" "));
    match zero.first()? {
        0 => {
            let text = format!("{text}; without w0 the output rests after each turn, and no inverse exists");
            Some(
                Note::warning("H01", text)
                    .count(zero.len())
                    .remedy("fewer plays, or a finer record at the turns"),
            )
        }
        _ => Some(Note::info("H01", text).count(zero.len())),
    }
}

fn few_turns(x: &[f64]) -> Option<Note> {
    let last = x.len() - 1;
    let turns = cycles(x, None).map_or(0, |c| c.turns.iter().filter(|t| **t > 0 && **t < last).count());
    (turns < TURNS).then(|| {
        let text =
            format!("x turns {turns} times: the weights rest on the first rise, from the virgin state");
        Note::warning("H03", text)
            .measured(turns as f64, TURNS as f64)
            .remedy("record a whole cycle at least")
    })
}

/// Whether the first move to both ends of the range fits worse than all that follows.
pub(super) fn not_virgin(x: &[f64], errors: &[f64]) -> Option<Note> {
    let end = |better: fn(f64, f64) -> bool| {
        (0..x.len()).fold(0, |best, t| if better(x[t], x[best]) { t } else { best })
    };
    let settled = end(|a, b| a > b).max(end(|a, b| a < b));
    if settled == 0 || settled + SETTLED_LEAST > x.len() {
        return None;
    }
    let (first, later) = (rms(&errors[..settled]), rms(&errors[settled..]));
    (first > WORSE * later).then(|| {
        let text = format!("the first {settled} rows fit {:.1} times worse than those after", first / later);
        Note::warning("H06", format!("{text}: the record does not begin in the virgin state"))
            .measured(rounded(first / later), WORSE)
            .remedy(format!("skip={settled}, with a record of more than one cycle"))
    })
}

fn merged_segments(merged: usize) -> Option<Note> {
    (merged > 0).then(|| {
        let text = format!("{merged} segments of the curve had no slope of their own and took a neighbour's");
        Note::info("H05", text).count(merged)
    })
}

/// Whether the loops, x to the right and y upwards, run clockwise: `integral y dx > 0` around them.
fn clockwise(x: &[f64], y: &[f64]) -> bool {
    let whole = cycles(x, None).map_or(Vec::new(), |c| c.whole);
    let loops: Vec<(usize, usize)> = whole.iter().map(|c| (c[0], c[2])).collect();
    let all = [(0, x.len() - 1)];
    let loops = if loops.is_empty() { &all[..] } else { &loops };
    let area: f64 = loops.iter().map(|&(a, b)| area(&x[a..=b], &y[a..=b])).sum();
    area > OPEN * loops.len() as f64 * range(x) * range(y)
}

/// Of a path closed by a straight line.
fn area(x: &[f64], y: &[f64]) -> f64 {
    let next = |t: usize| (t + 1) % x.len();
    (0..x.len()).map(|t| 0.5 * (y[t] + y[next(t)]) * (x[next(t)] - x[t])).sum()
}

fn range(x: &[f64]) -> f64 {
    x.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b)) - x.iter().fold(f64::INFINITY, |a, b| a.min(*b))
}
