//! All of a model by least squares on states that are combinations of the past.
//!
//! ```text
//! X = S1^(-1/2) U1' W1 L32 L22^+ Wp
//! [x(t+1); y(t)] = [A B; C D] [x(t); u(t)] + constant + [w; v]        [Q S; S' R] = mean products of [w; v]
//! ```
//!
//! The first algorithm of Van Overschee and De Moor 1996, figure 4.6, made robust by not using the future; what
//! most open packages do.

use super::data::{Factor, Signals};
use super::weights::{TOLERANCE, Weighted};
use crate::linalg::{Block, Matrix, Triangle, kalman_gain, least_squares, lower, over_triangle, stabilised};

/// The matrices of a model of the scaled signals.
pub struct Matrices {
    /// `(n, n)`.
    pub A: Matrix,
    /// `(n, nu)`.
    pub B: Matrix,
    /// `(ny, n)`.
    pub C: Matrix,
    /// `(ny, nu)`.
    pub D: Matrix,
    /// `(n, ny)`; none where the Riccati equation has no solution.
    pub K: Option<Matrix>,
    /// How many poles were moved inside.
    pub moved: usize,
}

/// Of order `n`; poles beyond `limit` are moved inside where there is one.
pub fn past_states(
    signals: &Signals,
    factor: &Factor,
    weighted: &Weighted,
    n: usize,
    direct: bool,
    limit: Option<f64>,
) -> Matrices {
    let (m, l) = (factor.m, factor.l);
    let T = states(factor, weighted, n);
    let R = lower(&regression(signals, factor.s, &T)).transpose();
    let (of, width) =
        (|range: std::ops::Range<usize>| R.columns(range.start, range.len()).into_owned(), n + m + 1);
    let known = of(0..width);
    let (next, y) = (of(width..width + n), of(width + n..width + n + l));
    let mut AB = least_squares(&known, &next, TOLERANCE);
    let CD = if direct {
        least_squares(&known, &y, TOLERANCE)
    } else {
        let mut without = known.clone();
        without.columns_mut(n, m).fill(0.0);
        least_squares(&without, &y, TOLERANCE)
    };
    let (A, moved) =
        limit.map_or((AB.rows(0, n).transpose(), 0), |limit| stabilised(&AB.rows(0, n).transpose(), limit));
    if moved > 0 {
        let driven = of(n..width);
        let rest = least_squares(&driven, &(&next - of(0..n) * A.transpose()), TOLERANCE);
        AB.rows_mut(0, n).copy_from(&A.transpose());
        AB.rows_mut(n, m + 1).copy_from(&rest);
    }
    let C = CD.rows(0, n).transpose();
    let K = gain(&A, &C, &(next - &known * &AB), &(y - &known * &CD));
    Matrices { B: AB.rows(n, m).transpose(), D: CD.rows(n, m).transpose(), A, C, K, moved }
}

/// `T` of `x = T wp`.
fn states(factor: &Factor, weighted: &Weighted, n: usize) -> Matrix {
    let (a, b, all) = (factor.future(), factor.known(), factor.all());
    let mut left = weighted.U.columns(0, n).transpose();
    left.row_iter_mut().zip(&weighted.S).for_each(|(mut row, s)| row /= s.sqrt());
    let left = weighted.W1.as_ref().map_or(left.clone(), |W1| left * W1);
    over_triangle(&(left * factor.block(b..all, a..b)), &factor.block(a..b, a..b), TOLERANCE)
}

/// Triangle of `[x(t) u(t) 1 x(t+1) y(t)]`.
pub fn regression(signals: &Signals, s: usize, T: &Matrix) -> Triangle {
    let (m, l, n) = (signals.u.len(), signals.y.len(), T.nrows());
    let width = 2 * n + m + 1 + l;
    let (mut triangle, mut block) = (Triangle::new(width), Block::new(width));
    let state = |t: usize| {
        let mut x = vec![0.0; n];
        let past = (t - s..t).flat_map(|t| signals.u.iter().map(move |u| u.x[t]));
        let past = past.chain((t - s..t).flat_map(|t| signals.y.iter().map(move |y| y.x[t])));
        for (column, w) in T.as_slice().chunks_exact(n).zip(past) {
            x.iter_mut().zip(column).for_each(|(x, t)| *x += t * w);
        }
        x
    };
    let mut row = Vec::with_capacity(width);
    for stretch in signals.stretches.iter().filter(|r| r.len() > s + 1) {
        let mut x = state(stretch.start + s);
        for t in stretch.start + s..stretch.end - 1 {
            let next = state(t + 1);
            row.clear();
            row.extend(&x);
            row.extend(signals.u.iter().map(|u| u.x[t]));
            row.push(1.0);
            row.extend(&next);
            row.extend(signals.y.iter().map(|y| y.x[t]));
            block.push(&row);
            x = next;
        }
    }
    triangle.absorb(&mut block);
    triangle
}

/// The Kalman gain of the errors `w` and `v`, one a column.
pub fn gain(A: &Matrix, C: &Matrix, w: &Matrix, v: &Matrix) -> Option<Matrix> {
    kalman_gain(A, C, &w.tr_mul(w), &v.tr_mul(v), &w.tr_mul(v)).map(|(_, K)| K)
}
