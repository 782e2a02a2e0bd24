//! Predictor-based subspace identification, for records of a closed loop.
//!
//! ```text
//! y(t) = sum_(i=1..p) h_i z(t-i) + D u(t) + e,   z = [u; y],  h_i = C Abar^(i-1) [B - K D, K],  Abar = A - K C
//! C Abar^j x(t) = sum_(i=1..p-j) h_(i+j) z(t-i),  j = 0 … f-1        Abar^p = 0
//! x = S^(-1/2) U' (these rows) [z(t-1) … z(t-p)],   U, S of the rows on all columns
//! y on x, u: C, D, e;   x(t+1) on x, u, e: A, B, K
//! ```
//!
//! `e` is white and independent of the past whether or not `u` is fed back: the loop bends nothing, as long as
//! `p` covers the memory of `Abar`, and there is no `D` or the loop has a delay. Chiuso, Automatica 43, 2007
//! (PBSIDopt); METHODS 2.3.

use super::super::orders::{Orders, too_short};
use super::data::{Signals, rows};
use super::fit::{SubspaceFit, finished};
use super::past_states::{Matrices, regression};
use super::weights::TOLERANCE;
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{Matrix, Svd, least_squares, lower, svd};
use crate::note::Note;
use crate::record::Record;

/// Settings of [`pbsid`].
#[derive(Clone, Copy, Debug)]
pub struct PbsidOptions {
    /// Lags of the predictor.
    pub past: usize,
    /// Block rows of the observability matrix, at most `past`.
    pub future: usize,
    /// Whether there is a `D`.
    pub direct: bool,
    /// Whether there is an `O`.
    pub offset: bool,
}

/// Fits a model of `n` states.
pub fn pbsid(rec: &Record, n: usize, options: PbsidOptions, limits: &Limits) -> Result<SubspaceFit> {
    check(rec, n, options, limits)?;
    let PbsidOptions { past: p, future: f, direct, offset } = options;
    let signals = Signals::of(rec, offset);
    let (m, l) = (rec.nu, rec.ny);
    let before = p * (m + l);
    let known = before + if direct { m } else { 0 };
    if signals.columns_of(p + 1) <= known + l {
        return Err(too_short(signals.columns_of(p + 1), known));
    }
    let now = if direct { rows(&signals.u, p..p + 1) } else { Vec::new() };
    let layout = [rows(&signals.u, 0..p), rows(&signals.y, 0..p), now, rows(&signals.y, p..p + 1)].concat();
    let L = lower(&signals.triangle(&layout, p + 1, offset));
    let R = L.transpose();
    let h = least_squares(&R.columns(0, known).into_owned(), &R.columns(known, l).into_owned(), TOLERANCE);

    let ahead = ahead(&h.rows(0, before).transpose(), (p, f), (m, l));
    let Svd { U, S, .. } = svd(&(&ahead * L.view((0, 0), (before, before))));
    let scale: Vec<f64> = S.iter().take(n).map(|s| s.powf(-0.5)).collect();
    let T = Matrix::from_diagonal(&scale.into()) * U.columns(0, n).transpose() * ahead;
    let (matrices, level) = matrices(&signals, p, &T, direct);
    let notes = notes(&matrices);
    let level = level.map(|level| in_units(&signals, &matrices, &level));
    let fit = SubspaceFit { singular_values: S, rows: f, notes, ..SubspaceFit::default() };
    finished(rec, &signals, matrices, (direct, offset), level, fit)
}

/// Rows `j = 0 … f-1` of what the past says of the outputs ahead, on `[u(t-p) … u(t-1), y(t-p) … y(t-1)]`.
fn ahead(h: &Matrix, (p, f): (usize, usize), (m, l): (usize, usize)) -> Matrix {
    let mut ahead = Matrix::zeros(f * l, p * (m + l));
    // What stands at lag i + j moves to lag i: j places later in time.
    for j in 0..f {
        for (begin, width) in [(0, m), (p * m, l)] {
            let kept = (p - j) * width;
            ahead.view_mut((j * l, begin + j * width), (l, kept)).copy_from(&h.view((0, begin), (l, kept)));
        }
    }
    ahead
}

/// The model of the scaled signals, and the level of its output if it has one.
fn matrices(signals: &Signals, p: usize, T: &Matrix, direct: bool) -> (Matrices, Option<Matrix>) {
    let (n, m, l) = (T.nrows(), signals.u.len(), signals.y.len());
    let R = lower(&regression(signals, p, T)).transpose();
    let width = n + m + 1;
    let y = R.columns(width + n, l).into_owned();
    let mut known = R.columns(0, width).into_owned();
    let all = known.clone();
    if !direct {
        known.columns_mut(n, m).fill(0.0);
    }
    let CD = least_squares(&known, &y, TOLERANCE);
    let mut with_errors = Matrix::zeros(R.nrows(), width + l);
    with_errors.columns_mut(0, width).copy_from(&all);
    with_errors.columns_mut(width, l).copy_from(&(&y - &known * &CD));
    let ABK = least_squares(&with_errors, &R.columns(width, n).into_owned(), TOLERANCE);
    let A = ABK.rows(0, n).transpose();
    let C = CD.rows(0, n).transpose();
    let at_rest = (Matrix::identity(n, n) - &A).try_inverse();
    let level = at_rest
        .map(|rest| &C * rest * ABK.rows(n + m, 1).transpose() + CD.rows(n + m, 1).transpose())
        .filter(|level| level.iter().all(|x| x.is_finite()));
    let found = Matrices {
        B: ABK.rows(n, m).transpose(),
        D: CD.rows(n, m).transpose(),
        K: Some(ABK.rows(width, l).transpose()),
        A,
        C,
        moved: 0,
    };
    (found, level)
}

/// `O` in the record's units: the level of the scaled output, less what the inputs' own zero gives.
fn in_units(signals: &Signals, m: &Matrices, level: &Matrix) -> Vec<f64> {
    let n = m.A.nrows();
    let rest = (Matrix::identity(n, n) - &m.A).try_inverse().unwrap_or_else(|| Matrix::zeros(n, n));
    let gain = &m.C * rest * &m.B + &m.D;
    let zero = Matrix::from_fn(signals.u.len(), 1, |j, _| signals.u[j].zero / signals.u[j].unit);
    let scaled = level - gain * zero;
    signals.y.iter().zip(scaled.iter()).map(|(y, x)| y.zero + y.unit * x).collect()
}

fn check(rec: &Record, n: usize, options: PbsidOptions, limits: &Limits) -> Result<()> {
    let PbsidOptions { past, future, .. } = options;
    if n == 0 || n > future * rec.ny {
        let needed = format!("from 1 to {}, future times the outputs", future * rec.ny);
        return Err(Error::argument("n", n, &needed));
    }
    if future == 0 || future > past {
        return Err(Error::argument("future", future, &format!("from 1 to past = {past}")));
    }
    let orders = Orders::arx(1, vec![1; rec.nu], vec![1; rec.nu]);
    orders.check_inputs(rec, n * (rec.nu + rec.ny) / rec.ny, limits)
}

fn notes(m: &Matrices) -> Vec<Note> {
    let beyond = crate::model::spectrum(&m.A).iter().filter(|p| p.0.hypot(p.1) > 1.0).count();
    let text = format!("{beyond} poles of the plant lie outside the unit circle: it needs its loop");
    let note = Note::warning("M02", text).count(beyond).remedy("predict, or simulate the loop");
    (beyond > 0).then_some(note).into_iter().collect()
}
