//! Whether an output has anything to do with an input, before a model is believed.

use crate::error::Error;
use crate::limits::Limits;
use crate::linalg::{Triangle, dot, residual_norm2};
use crate::note::Place;
use crate::record::Record;
use crate::stats::f_tail;

/// Autoregression that takes up the colour of the output.
const COLOUR: usize = 4;

/// p-value of the explanation `w` of the output `y`, both on consecutive rows of one segment each.
///
/// An autoregression stands for the colour of y, so that two slow signals that have nothing to do with each
/// other are not taken as related: `y(t)` on its past and 1, without and with `w(t), w(t-1), w(t-2)`.
pub fn chance(segments: &[(Vec<f64>, Vec<f64>)]) -> f64 {
    let n = COLOUR + 1 + 3;
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (y, w) in segments {
        for t in COLOUR..y.len() {
            let mut row: Vec<f64> = (1..=COLOUR).map(|lag| y[t - lag] - y[0]).collect();
            row.push(1.0);
            row.extend((0..3).map(|lag| w[t - lag] - w[0]));
            row.push(y[t] - y[0]);
            rows.push(row);
        }
    }
    if rows.len() <= n + 1 {
        return 1.0;
    }
    let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
    let own: Vec<usize> = (0..=COLOUR).collect();
    let all: Vec<usize> = (0..n).collect();
    let (without, with) =
        (residual_norm2(&triangle, &own, n, 1e-12), residual_norm2(&triangle, &all, n, 1e-12));
    let freedom = (rows.len() - n) as f64;
    f_tail((without - with) / 3.0 / (with / freedom).max(f64::MIN_POSITIVE), 3.0, freedom)
}

/// A delay from `first` samples on at which changes of y clearly follow changes of u, if there is one.
pub fn follows_later(rec: &Record, input: usize, first: usize) -> Option<usize> {
    let N = rec.N();
    let changes = |x: &[f64]| x.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>();
    let (u, y) = (changes(&rec.input(input)), changes(&rec.output_held(0)));
    let strength = |lag: usize| {
        let (u, y) = (&u[..N - 1 - lag], &y[lag..]);
        let moves = u.iter().filter(|x| **x != 0.0).count();
        let size = dot(u, u).sqrt() * dot(y, y).sqrt();
        if moves >= 10 && size > 0.0 { (dot(u, y) / size).abs() * (u.len() as f64).sqrt() } else { 0.0 }
    };
    let lags = first..N - N / 10;
    let (lag, most) = lags.map(|lag| (lag, strength(lag))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (most > 6.0).then_some(lag)
}

/// X05: y follows u only after more than the allowed share of the record.
pub fn beyond(rec: &Record, input: usize, lag: usize, limits: &Limits) -> Error {
    let name = rec.input_name(input);
    Error::new("X05", format!("y follows {name} only after about {lag} of {} rows", rec.N()))
        .at(Place::column(name))
        .count(rec.N())
        .measured(lag as f64, limits.X05 * rec.N() as f64)
        .remedy("record at least three times as long as the delay")
}
