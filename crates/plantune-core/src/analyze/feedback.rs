//! Whether the input answers the output: u(t) on its own past and on the errors of y.
//!
//! ```text
//! e(t) from ARX(10, 10, 1) with a constant,   u(t) on u(t-1) … u(t-5), 1 and e(t), e(t-1), e(t-2)
//! ```
//!
//! In open loop no e takes part (Caines and Chan 1975). Moves of the set point are rare and large against
//! what e does; Huber's weights keep them from hiding it. An input whose innovations are mostly zero, as a
//! binary sequence's are, answers nothing: p = 1. A loop without noise of its own or moves of its set point leaves no errors
//! to tell: there p = 0 where the outputs give the input exactly, and its past does not.

use crate::batch::huber;
use crate::linalg::{Triangle, residual_norm2, solve};
use crate::record::Record;
use crate::regress::{Column, Regression};
use crate::stats::f_tail;

/// Lags of the model that gives the errors, of u, and of e.
const LONG: usize = 10;
const OWN: usize = 5;
const ERRORS: usize = 3;

/// Largest relative change of an error that ends the rounds of the weights; it moves p by as little.
const STILL: f64 = 1e-4;

/// Rows per parameter below which nothing is said.
const ROWS: usize = 4;

/// Share of the travel of y below which errors are rounding.
const EXACT: f64 = 1e-9;

/// p-value of "no error of y moves input `i`"; 1 where the rows do not tell.
///
/// Where y answers u in the same row (`direct`), what u does then is no answer to e: the regression of y holds
/// u(t), and e(t-1), e(t-2), e(t-3) take part.
pub fn p_of_feedback(rec: &Record, i: usize, direct: bool) -> f64 {
    let (lagged, latest) = (columns(rec.nu, direct), usize::from(direct));
    let n = lagged.len();
    let regression = Regression::new(rec, 0, lagged);
    let (at, rows) = regression.all_rows();
    if at.len() < ROWS * n {
        return 1.0;
    }
    let triangle = Triangle::of_rows(n + 1, rows.chunks_exact(n + 1));
    let every: Vec<usize> = (0..n).collect();
    let Ok(model) = solve(&triangle, &every, n, 1e-10) else {
        return f64::from(u8::from(!plain(rec, i)));
    };
    let error = |row: &[f64]| row[n] - row.iter().zip(&model.theta).map(|(x, t)| x * t).sum::<f64>();
    let e: Vec<f64> = rows.chunks_exact(n + 1).map(error).collect();
    let largest = |x: f64, y: f64| x.max(y.abs());
    let travel = rows.chunks_exact(n + 1).map(|row| row[n]).fold(0.0, largest);
    if e.iter().copied().fold(0.0, largest) <= EXACT * travel {
        return 1.0; // rounding answers nothing
    }
    let scale = regression.u[i];
    let mut of_u = Vec::with_capacity(at.len() * 10);
    let back = latest + ERRORS - 1;
    for p in back..at.len() {
        let t = at[p];
        if at[p - back] + back == t {
            of_u.extend((1..=OWN).map(|lag| scale.apply(rec.u_at(t - lag, i))).chain([1.0]));
            of_u.extend((latest..=back).map(|lag| e[p - lag]));
            of_u.push(scale.apply(rec.u_at(t, i)));
        }
    }
    p_of_last(&of_u)
}

/// Whether the input is what a linear controller makes of the output and of nothing else: its past does not give it,
/// but with the latest outputs it is known to the last digit.
fn plain(rec: &Record, i: usize) -> bool {
    let own = (1..=OWN).map(|lag| Column::Input(i, lag)).chain([Column::One]);
    let outputs = (0..ERRORS).map(Column::MinusOutput);
    let regression = Regression::new(rec, 0, own.chain(outputs).chain([Column::Input(i, 0)]).collect());
    let (_, rows) = regression.all_rows();
    let n = OWN + 1 + ERRORS;
    let triangle = Triangle::of_rows(n + 2, rows.chunks_exact(n + 2));
    let left = |columns: usize| residual_norm2(&triangle, &(0..columns).collect::<Vec<usize>>(), n, PLAIN);
    left(n) <= PLAIN * left(OWN + 1)
}

/// Share of an input's innovations that is rounding.
const PLAIN: f64 = 1e-12;

/// `[-y | u_i | 1]`.
fn columns(nu: usize, direct: bool) -> Vec<Column> {
    let first = usize::from(!direct);
    let inputs = (0..nu).flat_map(|i| (first..=LONG).map(move |lag| Column::Input(i, lag)));
    (1..=LONG).map(Column::MinusOutput).chain(inputs).chain([Column::One]).collect()
}

/// p-value of the errors' coefficients under Huber's weights.
fn p_of_last(rows: &[f64]) -> f64 {
    let n = OWN + 1 + ERRORS;
    let Some(found) = huber(rows, n, STILL) else { return 1.0 };
    let travel = rows.chunks_exact(n + 1).map(|row| row[n].abs()).fold(0.0, f64::max);
    if !(found.s > 1e-9 * travel) {
        return 1.0;
    }
    let first = n - ERRORS;
    let covariance = |i: usize, j: usize| found.variance * found.inverse_gram[(first + i) * n + first + j];
    let b = &found.theta[first..];
    let Some(square) = inverse_square(covariance, b) else { return 1.0 };
    f_tail(square / ERRORS as f64, ERRORS as f64, (found.eps.len() - n) as f64)
}

/// `b' P^-1 b` by elimination.
fn inverse_square(P: impl Fn(usize, usize) -> f64, b: &[f64]) -> Option<f64> {
    let n = b.len();
    let mut A: Vec<f64> = (0..n * n).map(|ij| P(ij / n, ij % n)).collect();
    let mut x = b.to_vec();
    let mut sum = 0.0;
    for k in 0..n {
        let pivot = A[k * n + k];
        if !(pivot > 0.0) {
            return None;
        }
        sum += x[k] * x[k] / pivot;
        for i in k + 1..n {
            let factor = A[i * n + k] / pivot;
            x[i] -= factor * x[k];
            (k..n).for_each(|j| A[i * n + j] -= factor * A[k * n + j]);
        }
    }
    Some(sum)
}
