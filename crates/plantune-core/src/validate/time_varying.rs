//! Whether the parameters changed within the record, and when: the score process (M07).
//!
//! ```text
//! Q R = X of an ARX with constant,   z(t) = sum_{s <= t} q(s) eps(s) / s_e,   C(t) = sum q q'
//! statistic = max over 10 … 90 % of  z' (C - C C)^-1 z,   n parameters
//! ```
//!
//! With parameters that stand still it behaves like the largest `|B(t)|^2 / (t (1 - t))` of n Brownian
//! bridges. Its 99.5 % quantile over that range, from 20 000 simulated bridges of 400 steps each, is
//! [`limit`] to half a unit for n = 1 … 20. No refit is needed; beyond the limit both sides are fitted, and the
//! parameters must differ there as well. Nyblom 1989; Andrews 1993; Hjort and Koning 2002.

use crate::linalg::{Triangle, dot, solve};
use crate::record::Record;
use crate::regress::{Column, Regression};

/// Share of the rows at either end where a change cannot be told.
const END: f64 = 0.1;

/// Places at which the statistic is looked at.
const PLACES: usize = 400;

/// What the score process shows.
#[derive(Clone, Debug)]
pub struct TimeVarying {
    /// Its maximum.
    pub statistic: f64,
    /// What chance gives in one record of two hundred.
    pub limit: f64,
    /// The last row before the change.
    pub row: usize,
    /// Largest difference of a parameter between the two sides, standard deviations.
    pub apart: f64,
    /// Sums of the b over one plus the sums of the a: the gain on either side.
    pub gains: (f64, f64),
}

/// Looks at ARX(order, order, nk) with a constant on the record's only output; None without enough rows.
pub fn time_varying(rec: &Record, nk: &[usize], order: usize) -> Option<TimeVarying> {
    let inputs = nk.iter().enumerate();
    let inputs = inputs.flat_map(|(i, &nk)| (nk..nk + order).map(move |lag| Column::Input(i, lag)));
    let columns: Vec<Column> =
        (1..=order).map(Column::MinusOutput).chain(inputs).chain([Column::One]).collect();
    let n = columns.len();
    let regression = Regression::new(rec, 0, columns);
    let (at, rows) = regression.all_rows();
    let side = (END * at.len() as f64) as usize;
    if side < n + 2 {
        return None;
    }
    let width = n + 1;
    let part = |from: usize, to: usize| {
        let triangle = Triangle::of_rows(width, rows[from * width..to * width].chunks_exact(width));
        let every: Vec<usize> = (0..n).collect();
        solve(&triangle, &every, n, 1e-9).ok()
    };
    let all = part(0, at.len())?;
    let s2 = all.rss / (at.len() - n) as f64;
    if !(s2 > 1e-20) {
        return None;
    }
    let (statistic, p) = largest(&rows, &all.theta, &all.inverse_gram, s2, side)?;
    let (before, after) = (part(0, p + 1)?, part(p + 1, at.len())?);
    let variance = |fit: &crate::linalg::Solution, N: usize, i: usize| {
        fit.rss / (N - n) as f64 * fit.inverse_gram[i * n + i]
    };
    let apart = (0..n - 1)
        .map(|i| {
            let sd = (variance(&before, p + 1, i) + variance(&after, at.len() - p - 1, i)).sqrt();
            (before.theta[i] - after.theta[i]).abs() / sd
        })
        .fold(0.0, f64::max);
    let unit = regression.u.first().map_or(1.0, |u| u.factor) / regression.y.factor;
    let gain = |theta: &[f64]| {
        unit * theta[order..2 * order].iter().sum::<f64>() / (1.0 + theta[..order].iter().sum::<f64>())
    };
    let gains = (gain(&before.theta), gain(&after.theta));
    Some(TimeVarying { statistic, limit: limit(n), row: at[p], apart, gains })
}

/// The largest statistic and its place among the rows.
fn largest(rows: &[f64], theta: &[f64], inverse: &[f64], s2: f64, side: usize) -> Option<(f64, usize)> {
    let n = theta.len();
    let N = rows.len() / (n + 1);
    let every = ((N - 2 * side) / PLACES).max(1);
    let mut z = vec![0.0; n]; // sum x eps
    let mut C = vec![0.0; n * n]; // sum x x'
    let mut best: Option<(f64, usize)> = None;
    for (p, row) in rows.chunks_exact(n + 1).enumerate() {
        let eps = row[n] - dot(&row[..n], theta);
        for i in 0..n {
            z[i] += row[i] * eps;
            for j in 0..n {
                C[i * n + j] += row[i] * row[j];
            }
        }
        if p < side || p + side >= N || !(p - side).is_multiple_of(every) {
            continue;
        }
        // In x instead of q: z' (C - C G C)^-1 z with G = (X'X)^-1.
        let GC: Vec<f64> =
            (0..n * n).map(|ij| (0..n).map(|k| inverse[ij / n * n + k] * C[k * n + ij % n]).sum()).collect();
        let left: Vec<f64> = (0..n * n)
            .map(|ij| C[ij] - (0..n).map(|k| C[ij / n * n + k] * GC[k * n + ij % n]).sum::<f64>())
            .collect();
        // On one side the input may not yet have moved.
        let Some(value) = quadratic(&left, &z, n).map(|square| square / s2) else { continue };
        if best.is_none_or(|(most, _)| value > most) {
            best = Some((value, p));
        }
    }
    best
}

/// `z' A^-1 z` of a symmetric positive `A`, scaled by its diagonal; None where a pivot vanishes.
fn quadratic(A: &[f64], z: &[f64], n: usize) -> Option<f64> {
    let size: Vec<f64> = (0..n).map(|i| A[i * n + i].sqrt()).collect();
    let mut L = vec![0.0; n * n]; // Cholesky's
    let mut x = vec![0.0; n]; // L x = z
    for i in 0..n {
        for j in 0..=i {
            let own = A[i * n + j] / (size[i] * size[j]) - dot(&L[i * n..i * n + j], &L[j * n..j * n + j]);
            L[i * n + j] = if i == j { own.sqrt() } else { own / L[j * n + j] };
        }
        let pivot = L[i * n + i];
        if !(pivot > 1e-7) {
            return None;
        }
        x[i] = (z[i] / size[i] - dot(&L[i * n..i * n + i], &x[..i])) / pivot;
    }
    Some(dot(&x, &x))
}

/// What n bridges pass in one of two hundred records.
fn limit(n: usize) -> f64 {
    10.3 + 3.95 * (n as f64).powf(0.785)
}
