//! What each input of a record excites: how many parameters, at which frequencies, by how many moves.
//!
//! ```text
//! order    the largest p for which the centred Hankel matrix of p columns has full rank        X02
//! crest    max |u - mean| / sqrt(var)
//! band     from where 5 % of the power lies below to where 5 % lies above, of the periodogram
//! hold     rows from one move to the next, median and longest
//! ```
//!
//! A test signal for a gain, a lag and a delay moves every 0.8 to 1.6 (T + L): faster, it starves the gain, slower,
//! lag and delay. Ljung 1999, 13.2; METHODS 8.

use std::ops::Range;

use super::column::without_means;
use super::density::longest;
use super::reach;
use crate::excitation::{LEAST_EXCITATION, excitation_order};
use crate::limits::Limits;
use crate::linalg::extent;
use crate::note::{Note, rounded};
use crate::record::Record;
use crate::signal::{Stretched, Window, welch};
use crate::stats::median;

/// Highest order looked for.
const MOST_ORDER: usize = 20;

/// Share of the travel below which an input has not moved.
const MOVE: f64 = 1e-9;

/// Levels up to which they are listed.
const MOST_LEVELS: usize = 12;

/// Share of the power outside either end of the band.
const TAIL: f64 = 0.05;

/// Moves of a test signal per `T + L`: slower and faster than this are told.
const FAST: f64 = 0.3;
const SLOW: f64 = 5.0;

/// Moves below which one more is worth asking for.
const FEW_MOVES: usize = 4;

/// What one input does.
#[derive(Clone, Debug)]
pub struct Excitation {
    /// Name.
    pub name: String,
    /// Parameters of a linear model that it supports, at most `MOST_ORDER`.
    pub order: usize,
    /// Whether more were not looked for.
    pub at_least: bool,
    /// Largest deviation over the standard deviation.
    pub crest: f64,
    /// Rows at which it changes.
    pub moves: usize,
    /// Median and longest time between two moves, s.
    pub hold: (f64, f64),
    /// Values taken and the share of the rows at each; empty if there are more than a dozen.
    pub levels: Vec<(f64, f64)>,
    /// Ends of the band that holds 90 % of the power, rad/s.
    pub band: (f64, f64),
    /// Density of the longest run over frequency.
    pub w: Vec<f64>,
    /// In squared units per rad/s.
    pub P: Vec<f64>,
    /// What follows.
    pub advice: Vec<String>,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Looks at every input; refuses none, for that an input stands still is a finding here.
///
/// The second value is the `T + L` in seconds that advice goes by, where a quick model gives it.
pub fn excitation(rec: &Record, limits: &Limits) -> (Vec<Excitation>, Option<f64>) {
    let memory = reach(rec, limits).map(|(rows, _)| rows * rec.Ts);
    ((0..rec.nu).map(|i| of_input(rec, i, memory, limits)).collect(), memory)
}

fn of_input(rec: &Record, i: usize, memory: Option<f64>, limits: &Limits) -> Excitation {
    let u = rec.input(i);
    let (low, high) = extent(&u);
    let still = high - low <= limits.X01 * low.abs().max(high.abs());
    let runs: Vec<Range<usize>> = rec.segments().collect();
    let moved = |k: &usize| (u[*k] - u[k - 1]).abs() > MOVE * (high - low);
    let per_run: Vec<Vec<usize>> =
        runs.iter().map(|run| (run.start + 1..run.end).filter(moved).collect()).collect();
    let (order, (w, P)) = if still {
        (0, (vec![], vec![]))
    } else {
        (excitation_order(rec, i, MOST_ORDER, limits.X02), spectrum(rec, i))
    };
    let mut out = Excitation {
        name: rec.input_name(i).to_owned(),
        order,
        at_least: order == MOST_ORDER,
        crest: if still { 0.0 } else { crest(&u) },
        moves: if still { 0 } else { per_run.iter().map(Vec::len).sum() },
        hold: holds(&runs, &per_run, rec.Ts),
        levels: levels(&u, high - low),
        band: band(&w, &P),
        w,
        P,
        advice: Vec::new(),
        notes: Vec::new(),
    };
    out.notes = notes(&out, rec, i, limits);
    out.advice = advice(&out, memory);
    out
}

fn crest(u: &[f64]) -> f64 {
    let mean = u.iter().sum::<f64>() / u.len() as f64;
    let var = u.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / u.len() as f64;
    u.iter().map(|u| (u - mean).abs()).fold(0.0, f64::max) / var.sqrt()
}

/// Median time between moves, and the longest time without one, the ends of the runs included.
fn holds(runs: &[Range<usize>], moves: &[Vec<usize>], Ts: f64) -> (f64, f64) {
    let between = moves.iter().flat_map(|m| m.windows(2).map(|w| (w[1] - w[0]) as f64)).collect::<Vec<_>>();
    let longest = runs.iter().zip(moves).flat_map(|(run, moves)| {
        let edges = [&[run.start][..], moves, &[run.end]].concat();
        edges.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>()
    });
    let longest = longest.max().unwrap_or(0) as f64 * Ts;
    let usual = if between.is_empty() { longest } else { median(between) * Ts };
    (usual, longest)
}

/// Values that differ by more than rounding and the share of the rows at each; none if there are many.
fn levels(u: &[f64], travel: f64) -> Vec<(f64, f64)> {
    let mut sorted = u.to_vec();
    sorted.sort_by(f64::total_cmp);
    let groups: Vec<&[f64]> = sorted.chunk_by(|a, b| b - a <= MOVE * travel).take(MOST_LEVELS + 1).collect();
    if groups.len() > MOST_LEVELS {
        return Vec::new();
    }
    groups.iter().map(|g| (g[g.len() / 2], g.len() as f64 / u.len() as f64)).collect()
}

/// Density of the longest run.
fn spectrum(rec: &Record, i: usize) -> (Vec<f64>, Vec<f64>) {
    let run = longest(&rec.segments().collect::<Vec<_>>());
    let u = without_means(&rec.input(i), std::slice::from_ref(&run));
    let way = Stretched { n: run.len(), step: run.len(), window: Window::Rectangular };
    let found = welch(&[u], &[run], way, rec.Ts);
    found.map_or((vec![], vec![]), |S| (S.w[1..].to_vec(), S.density(0)[1..].to_vec()))
}

fn band(w: &[f64], P: &[f64]) -> (f64, f64) {
    let total: f64 = P.iter().sum();
    let mut below = 0.0;
    let sums: Vec<f64> = P
        .iter()
        .map(|P| {
            below += P;
            below
        })
        .collect();
    let at = |share: f64| sums.iter().position(|s| *s >= share * total).map_or(f64::NAN, |k| w[k]);
    if total > 0.0 { (at(TAIL), at(1.0 - TAIL)) } else { (f64::NAN, f64::NAN) }
}

fn notes(of: &Excitation, rec: &Record, i: usize, limits: &Limits) -> Vec<Note> {
    let place = rec.place(i, 0);
    let remedy = "record again with a step or a PRBS on the input";
    if of.moves == 0 {
        let text = format!("not exciting: {} stands still", of.name);
        return vec![Note::error("X01", text).at(place).measured(0.0, limits.X01).remedy(remedy)];
    }
    if of.order < LEAST_EXCITATION {
        let text = format!(
            "{} supports {} parameters, a gain, a lag and a delay need {LEAST_EXCITATION}",
            of.name, of.order
        );
        let note = Note::warning("X02", text).at(place).count(of.order);
        return vec![note.measured(of.order as f64, LEAST_EXCITATION as f64).remedy(remedy)];
    }
    Vec::new()
}

fn advice(of: &Excitation, memory: Option<f64>) -> Vec<String> {
    if of.moves == 0 {
        return vec!["move the input: nothing can be learned of a plant whose input stands still".to_owned()];
    }
    let mut said = Vec::new();
    if of.order < LEAST_EXCITATION {
        said.push("add steps of different lengths: one sine or ramp supports two parameters only".to_owned());
    }
    if of.moves < FEW_MOVES {
        said.push(format!("{} moves: a few more, up and down, tell the plant from a drift", of.moves));
    }
    let Some(memory) = memory else { return said };
    let (hold, wish) = (of.hold.0, format!("{} to {} s", rounded(0.8 * memory), rounded(1.6 * memory)));
    let clock = if hold < FAST * memory {
        Some("faster than the plant answers: that starves the gain")
    } else if hold > SLOW * memory && of.moves >= FEW_MOVES {
        Some("slower than it must: that starves lag and delay")
    } else {
        None
    };
    said.extend(clock.map(|why| {
        format!(
            "it moves every {} s, T + L is about {} s: {why}; hold each value {wish}",
            rounded(hold),
            rounded(memory)
        )
    }));
    if of.w.first().is_some() && of.band.0 > 3.0 / memory {
        said.push(format!(
            "its power lies above {} rad/s, beyond the plant's corner: add slower moves",
            rounded(of.band.0)
        ));
    }
    said
}
