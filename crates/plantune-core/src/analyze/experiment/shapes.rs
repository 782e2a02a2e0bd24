//! Inputs that an experiment may use, between -1 and 1 after some rows at rest.
//!
//! ```text
//! PRBS, GBN    a clock, or a mean switching time, of 1.3 T; of 20 sequences the one that tells most
//! stairs       1, -1, 1, -1 for a quarter of the time each
//! step         1
//! multisine    Schroeder phases, all lines up to 3 / (T + L) rad/s
//! ```
//!
//! `T` is always the last to be known: a clock from 1.1 to 1.6 T serves it best whatever L is, and a factor of
//! two off costs less than a fifth (measured on predicted deviations, L from 0.3 T to 3 T; METHODS 8, pitfall 8).

use std::f64::consts::PI;

use super::information::{Disturbance, Predicted, predicted_sd};
use crate::error::Result;
use crate::model::Fopdt;
use crate::signal::{Phases, gbn, multisine, prbs, staircase};

/// Clock of a binary sequence, in time constants.
const CLOCK: f64 = 1.3;

/// Sequences drawn, of which the best is taken.
const DRAWS: u64 = 20;

/// Bits of the register: with more than the rows need, other seeds give other sequences.
const BITS: u32 = 12;

/// Share of a clock after which generalised binary noise may change again.
const LEAST: f64 = 1.0 / 3.0;

/// Top of the band of a multisine, in 1 / (T + L).
const TOP: f64 = 3.0;

/// Rows at rest before the first move, at least.
const REST: usize = 5;

/// Share of a step test that is rest.
const STEP_REST: f64 = 0.1;

/// The form of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Pseudo-random binary sequence.
    Prbs,
    /// Generalised binary noise.
    Gbn,
    /// Four steps of one length, up and down.
    Stairs,
    /// One step.
    Step,
    /// A sum of sines.
    Multisine,
}

impl Shape {
    /// Every shape.
    pub const ALL: [Shape; 5] = [Shape::Prbs, Shape::Gbn, Shape::Stairs, Shape::Step, Shape::Multisine];

    /// The word used in Python and in JSON.
    pub fn as_str(self) -> &'static str {
        match self {
            Shape::Prbs => "prbs",
            Shape::Gbn => "gbn",
            Shape::Stairs => "stairs",
            Shape::Step => "step",
            Shape::Multisine => "multisine",
        }
    }
}

/// An input with a peak of 1, and what it would tell.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) shape: Shape,
    /// Rows from one move to the next, in the mean; 1 of a multisine.
    pub(super) hold: usize,
    pub(super) u: Vec<f64>,
    pub(super) predicted: Predicted,
}

/// Rows at rest: as many as the dead time, so that the first answer is seen to begin.
pub(super) fn rest(plant: &Fopdt, Ts: f64) -> usize {
    REST.max((plant.L / Ts).ceil() as usize)
}

/// The best input of a shape.
pub(super) fn best(
    shape: Shape,
    plant: &Fopdt,
    N: usize,
    Ts: f64,
    noise: &Disturbance,
    seed: u64,
) -> Result<Candidate> {
    let draws = if matches!(shape, Shape::Prbs | Shape::Gbn) { DRAWS } else { 1 };
    let judged = |draw: u64| {
        let (hold, u) = sequence(shape, plant, N, Ts, seed.wrapping_mul(DRAWS).wrapping_add(draw))?;
        let predicted = predicted_sd(plant, &u, Ts, noise)?;
        Ok(Candidate { shape, hold, u, predicted })
    };
    (1..draws).fold(judged(0), |best, draw| match (best, judged(draw)) {
        (Ok(best), Ok(other)) if other.predicted.worst() < best.predicted.worst() => Ok(other),
        (Err(_), other) => other,
        (best, _) => best,
    })
}

/// Rows between moves, and the sequence with its rest.
fn sequence(shape: Shape, plant: &Fopdt, N: usize, Ts: f64, seed: u64) -> Result<(usize, Vec<f64>)> {
    let rest = match shape {
        Shape::Step => rest(plant, Ts).max((STEP_REST * N as f64) as usize),
        _ => rest(plant, Ts),
    };
    let rows = N.saturating_sub(rest);
    let clock = ((CLOCK * plant.T / Ts).round() as usize).max(1);
    let (hold, u) = match shape {
        Shape::Prbs => (clock, prbs(rows, clock, BITS, seed)?),
        Shape::Gbn => {
            let least = ((LEAST * clock as f64).round() as usize).max(1);
            let mean = clock.max(2 * least);
            (mean, gbn(rows, mean as f64, least, seed)?)
        }
        Shape::Stairs => {
            let tread = rows.div_ceil(4).max(1);
            (tread, staircase(&[1.0, -1.0, 1.0, -1.0], tread)?)
        }
        Shape::Step => (rows, vec![1.0; rows]),
        Shape::Multisine => {
            let top = (TOP / (plant.T + plant.L)).min(PI / Ts);
            (1, multisine(rows, rows, (0.0, top), Ts, Phases::Schroeder)?)
        }
    };
    Ok((hold, std::iter::repeat_n(0.0, rest).chain(u).take(N).collect()))
}
