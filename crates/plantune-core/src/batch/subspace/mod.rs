//! Subspace identification of `x(t+1) = A x + B u + K e`, `y = C x + D u + e + O`.
//!
//! ```text
//! data         [Uf; Up; Yp; Yf] = L Q, the constant taken out
//! weights      MOESP, N4SID or CVA: singular vectors of a block of L span the observability matrix
//! observability A, C by its shift; poles outside reflected
//! simulated | past_states | projected      B, D
//! projected    Q, S, R and the Kalman gain
//! order        where it is not given
//! ```
//!
//! Verhaegen 1994; Van Overschee and De Moor 1996, chapter 4; SLICOT IB01AD, IB01BD, whose printed example the
//! combined variant reproduces.

mod bands;
mod data;
mod fit;
mod frequency;
mod observability;
mod order;
mod past_states;
mod pbsid;
mod projected;
mod simulated;
mod weights;

pub use bands::subspace_bands;
pub use fit::SubspaceFit;
pub use frequency::{FrequencyFit, subspace_frequency};
pub use order::Tried as TriedOrder;
pub use pbsid::{PbsidOptions, pbsid};
pub use weights::Method;

use self::data::{Factor, Signals};
use self::fit::finished;
use self::observability::Observability;
use self::past_states::{Matrices, past_states};
use self::projected::Projected;
use self::simulated::simulated;
use self::weights::{Weighted, weighted};
use super::orders::{Orders, too_short};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::stabilised;
use crate::note::Note;
use crate::record::Record;

/// Where `B` and `D` come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// The simulated output.
    Simulation,
    /// States made of the past, and with them `A` and `C` too.
    States,
    /// Projected states, as SLICOT combines MOESP and N4SID.
    Combined,
}

/// Settings of [`subspace`].
#[derive(Clone, Copy, Debug)]
pub struct SubspaceOptions {
    /// Block rows of past and future.
    pub rows: usize,
    /// Weight.
    pub method: Method,
    /// Where `B` and `D` come from.
    pub variant: Variant,
    /// Whether poles outside the unit circle are moved inside.
    pub stable: bool,
    /// Whether there is a `D`.
    pub direct: bool,
    /// Whether there is an `O`.
    pub offset: bool,
}

/// Radius beyond which a stable model has no pole.
const INSIDE: f64 = 0.9999;
/// Orders that are tried where none is given.
const MOST_ORDER: usize = 10;

/// Fits a model of `n` states, or of the order that the record supports best.
pub fn subspace(
    rec: &Record,
    n: Option<usize>,
    options: SubspaceOptions,
    limits: &Limits,
) -> Result<SubspaceFit> {
    check(rec, n, options, limits)?;
    let signals = Signals::of(rec, options.offset);
    let least = n.unwrap_or(1) / rec.ny + 2;
    let too_few = || too_short(signals.columns(least), 2 * least * (rec.nu + rec.ny));
    let s = signals.block_rows(options.rows, least).ok_or_else(too_few)?;
    let factor = signals.factor(s, options.offset);
    let weighted = weighted(&factor, options.method);
    let mut tried = Vec::new();
    let n = match n {
        Some(n) => n,
        None => {
            tried = orders(rec, &signals, &factor, &weighted, options);
            tried.iter().min_by(|a, b| a.bic.total_cmp(&b.bic)).map_or(1, |best| best.n)
        }
    };
    let matrices = matrices(rec, &signals, &factor, &weighted, n, options);
    let notes = notes(s, options, &matrices);
    let unit = signals.y[0].unit;
    let singular_values =
        weighted.S.iter().map(|v| if rec.ny == 1 && options.method != Method::Cva { v * unit } else { *v });
    let singular_values = singular_values.collect();
    let fit = SubspaceFit { singular_values, tried, rows: s, notes, ..SubspaceFit::default() };
    finished(rec, &signals, matrices, (options.direct, options.offset), None, fit)
}

/// The model of the scaled signals.
fn matrices(
    rec: &Record,
    signals: &Signals,
    factor: &Factor,
    weighted: &Weighted,
    n: usize,
    options: SubspaceOptions,
) -> Matrices {
    let limit = options.stable.then_some(INSIDE);
    if options.variant == Variant::States {
        return past_states(signals, factor, weighted, n, options.direct, limit);
    }
    let mut states = Observability::of(weighted, n, factor.l, options.variant == Variant::Simulation);
    let mut moved = 0;
    if let Some(limit) = limit {
        (states.A, moved) = stabilised(&states.A, limit);
    }
    let projected = Projected::of(factor, &states);
    let (B, D) = match options.variant {
        Variant::Combined => projected.inputs(&states, factor.m, options.direct),
        _ => {
            let found = simulated(rec, signals, (&states.A, &states.C), (options.direct, options.offset));
            (found.B, found.D)
        }
    };
    let K = projected.gain(&states.A, &states.C);
    Matrices { A: states.A, B, C: states.C, D, K, moved }
}

/// Every order that the singular values leave, judged by its simulation.
fn orders(
    rec: &Record,
    signals: &Signals,
    factor: &Factor,
    weighted: &Weighted,
    options: SubspaceOptions,
) -> Vec<order::Tried> {
    let real = weighted.S.iter().take_while(|s| **s > 1e-10 * weighted.S[0]).count();
    let most = MOST_ORDER.min((factor.s - 1) * factor.l).min(real.max(1));
    let errors = |n: usize| {
        let states = Observability::of(weighted, n, factor.l, true);
        let (A, _) = stabilised(&states.A, INSIDE);
        simulated(rec, signals, (&A, &states.C), (options.direct, options.offset)).errors
    };
    order::judged(&(1..=most).map(errors).collect::<Vec<_>>(), (factor.m, factor.l))
}

fn check(rec: &Record, n: Option<usize>, options: SubspaceOptions, limits: &Limits) -> Result<()> {
    if n == Some(0) {
        return Err(Error::argument("n", 0, "at least 1, or \"auto\""));
    }
    let n = n.unwrap_or(1);
    let most = (options.rows.max(1) - 1) * rec.ny;
    if n > most {
        let needed = format!("at least {}, for {n} states of {} outputs", n.div_ceil(rec.ny) + 1, rec.ny);
        return Err(Error::argument("rows", options.rows, &needed));
    }
    let per_output = n.div_ceil(rec.ny);
    let orders = Orders::arx(per_output, vec![per_output; rec.nu], vec![1; rec.nu]);
    orders.check_inputs(rec, n * (rec.nu + rec.ny) / rec.ny, limits)
}

fn notes(s: usize, options: SubspaceOptions, matrices: &Matrices) -> Vec<Note> {
    let mut notes = Vec::new();
    if s < options.rows {
        let text =
            format!("{s} block rows instead of {}: the record has no more columns for them", options.rows);
        notes.push(Note::info("X03", text).measured(s as f64, options.rows as f64).remedy("record longer"));
    }
    if matrices.moved > 0 {
        let text = format!("{} poles lay outside the unit circle and were moved inside", matrices.moved);
        notes.push(
            Note::warning("M02", text)
                .count(matrices.moved)
                .remedy("stable=False keeps them; check for drift, and for feedback"),
        );
    }
    if matrices.K.is_none() {
        let text = "the errors leave no Kalman gain: K = 0, and a prediction is a simulation";
        notes.push(Note::info("N05", text));
    }
    notes
}
