//! `B` and `D` as the least squares fit of the simulated output.
//!
//! ```text
//! y(t) = C A^t x0 + sum_ij B_ij (C (q I - A)^-1 e_i u_j)(t) + D u(t) + O
//! ```
//!
//! is linear in `B, D, x0, O` once `A` and `C` are known: a shared regression with an `x0` for every segment.
//! SLICOT IB01CD; Ljung 1999, 10.6.

use std::ops::Range;

use super::data::{Column, Signals};
use crate::linalg::{Block, Matrix, Segmented, Triangle, solve_damped};
use crate::model::{StateSpace, add};
use crate::record::Record;

/// Against columns that the record does not tell apart.
const DAMPING: f64 = 1e-22;

/// The inputs' share of a model, and what it leaves of the outputs.
pub struct Simulated {
    /// `(n, nu)`.
    pub B: Matrix,
    /// `(ny, nu)`.
    pub D: Matrix,
    /// Errors of each output on the rows that count.
    pub errors: Vec<Vec<f64>>, // (ny)
}

/// Of the scaled signals; `D` is zero without a direct term, `O` with no offset.
pub fn simulated(
    rec: &Record,
    signals: &Signals,
    (A, C): (&Matrix, &Matrix),
    (direct, offset): (bool, bool),
) -> Simulated {
    let (n, l, m) = (A.nrows(), C.nrows(), signals.u.len());
    let terms = if direct { l * m } else { 0 };
    let shared = n * m + terms + if offset { l } else { 0 };
    let mut problem = Segmented::new(n, shared);
    for s in rec.segments() {
        problem.push(triangle(rec, signals, &Responses::of(signals, (A, C), s), (direct, offset)));
    }
    let every: Vec<usize> = (0..shared).collect();
    let theta = solve_damped(problem.common(), &every, shared, DAMPING);
    let starts = problem.locals(&theta);
    let B = Matrix::from_row_slice(n, m, &theta[..n * m]);
    let D = if direct { Matrix::from_row_slice(l, m, &theta[n * m..][..terms]) } else { Matrix::zeros(l, m) };
    let level = |i: usize| theta.get(n * m + terms + i).copied().unwrap_or(0.0);

    let model = StateSpace { A: A.clone(), B, C: C.clone(), D, K: Matrix::zeros(n, l), Ts: Some(rec.Ts) };
    let mut errors = vec![Vec::new(); l];
    for (s, x0) in rec.segments().zip(&starts) {
        let u: Vec<f64> = s.clone().flat_map(|t| signals.u.iter().map(move |u| u.x[t])).collect();
        let y = model.simulate(&u, x0);
        for (i, errors) in errors.iter_mut().enumerate() {
            let rows = s.clone().filter(|&t| rec.is_valid(t, i));
            errors.extend(rows.map(|t| signals.y[i].x[t] - y[(t - s.start) * l + i] - level(i)));
        }
    }
    Simulated { B: model.B, D: model.D, errors }
}

/// Rows `[free | driven | u | 1 | y]` of one segment, an output after the other.
fn triangle(
    rec: &Record,
    signals: &Signals,
    responses: &Responses,
    (direct, offset): (bool, bool),
) -> Triangle {
    let (l, m) = (signals.y.len(), signals.u.len());
    let own = responses.columns.len() + if direct { l * m } else { 0 } + if offset { l } else { 0 };
    let (mut triangle, mut block) = (Triangle::new(own + 1), Block::new(own + 1));
    let mut row = Vec::with_capacity(own + 1);
    for (k, t) in responses.rows.clone().enumerate() {
        for i in (0..l).filter(|&i| rec.is_valid(t, i)) {
            row.clear();
            row.extend(responses.columns.iter().map(|y| y[k * l + i]));
            if direct {
                let of = |to: usize| move |u: &Column| if to == i { u.x[t] } else { 0.0 };
                (0..l).for_each(|to| row.extend(signals.u.iter().map(of(to))));
            }
            if offset {
                row.extend((0..l).map(|to| f64::from(u8::from(to == i))));
            }
            row.push(signals.y[i].x[t]);
            block.push(&row);
        }
    }
    triangle.absorb(&mut block);
    triangle
}

/// Outputs `(rows, ny)` to a unit of each initial state, then to each input through each state.
struct Responses {
    rows: Range<usize>,
    columns: Vec<Vec<f64>>, // (n + n nu)
}

impl Responses {
    fn of(signals: &Signals, (A, C): (&Matrix, &Matrix), rows: Range<usize>) -> Self {
        let (n, l) = (A.nrows(), C.nrows());
        let run = |i: usize, drive: Option<&[f64]>| {
            let (mut x, mut next) = (vec![0.0; n], vec![0.0; n]);
            x[i] = f64::from(u8::from(drive.is_none()));
            let mut y = vec![0.0; rows.len() * l];
            for (k, y) in y.chunks_exact_mut(l).enumerate() {
                add(C, &x, y);
                next.fill(0.0);
                add(A, &x, &mut next);
                next[i] += drive.map_or(0.0, |u| u[k]);
                std::mem::swap(&mut x, &mut next);
            }
            y
        };
        let free = (0..n).map(|i| run(i, None));
        let through = |i: usize| signals.u.iter().map(move |u| (i, u));
        let driven = (0..n).flat_map(through).map(|(i, u)| run(i, Some(&u.x[rows.clone()])));
        let columns = free.chain(driven).collect();
        Responses { rows, columns }
    }
}
