//! A noise model for a plant that is known: ARMA of what the plant leaves.
//!
//! ```text
//! v = A y - sum_i B_i/F_i u_i,   D v = C e
//! ```
//!
//! A long AR of `v` gives `e`; least squares on `v(t-1) …, e(t-1) …` gives `D` and `C` (Hannan and Rissanen 1982).

use super::super::super::orders::Orders;
use super::super::predictor::Predictor;
use super::{RANK_TOLERANCE, ROWS, reflected_if_needed};
use crate::linalg::{Triangle, solve};
use crate::model::PolyModel;

/// Order of the long AR.
const LONG: usize = 20;

/// `theta` of all orders from that of the plant, the noise model from what it leaves.
pub(super) fn with_noise(predictor: &Predictor, plant: &[f64], own: &Orders) -> Option<Vec<f64>> {
    let orders = predictor.orders();
    let mut model = orders.model(&vec![0.0; orders.n()], 1.0);
    let known = own.model(&plant[..own.n()], 1.0);
    let left: Vec<Vec<f64>> = left(predictor, &known);
    (model.C, model.D) = arma(&left, orders.nc, orders.nd)?;
    (model.A, model.B, model.F) = (known.A, known.B, known.F);
    Some(model.theta())
}

/// `v` of each stretch, less its mean and what an unknown start explains.
fn left(predictor: &Predictor, plant: &PolyModel) -> Vec<Vec<f64>> {
    let data = predictor.data();
    let of = |s: &std::ops::Range<usize>| {
        let u = &data.u[s.start * data.nu..s.end * data.nu];
        let response = plant.prediction_error(u, data.nu, &data.y[s.clone()]);
        let ones = predictor.constant().then(|| vec![1.0; response.forced.len()]);
        without(&response.forced, &[response.free, ones.into_iter().collect()].concat())
    };
    predictor.stretches().iter().map(of).collect()
}

/// `v` less its projection on the columns; itself where they depend on each other.
fn without(v: &[f64], columns: &[Vec<f64>]) -> Vec<f64> {
    let n = columns.len();
    let row = |k: usize| columns.iter().map(|c| c[k]).chain([v[k]]).collect::<Vec<f64>>();
    let Some(x) = least_squares(n, (0..v.len()).map(row)) else { return v.to_vec() };
    let explained = |k: usize| columns.iter().zip(&x).map(|(c, x)| c[k] * x).sum::<f64>();
    v.iter().enumerate().map(|(k, v)| v - explained(k)).collect()
}

/// `C` and `D` of `D v = C e`.
fn arma(v: &[Vec<f64>], nc: usize, nd: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    let N: usize = v.iter().map(Vec::len).sum();
    let n = if nc > 0 { LONG.max(2 * (nc + nd)).min(N / ROWS) } else { 0 };
    let lags =
        |x: &[f64], t: usize, n: usize, sign: f64| (1..=n).map(|k| sign * x[t - k]).collect::<Vec<f64>>();
    let long = |v: &Vec<f64>| {
        let v = v.clone();
        (n..v.len()).map(move |t| [lags(&v, t, n, -1.0), vec![v[t]]].concat())
    };
    let a = least_squares(n, v.iter().flat_map(long))?;
    let error = |v: &Vec<f64>| {
        let at = |t: usize| v[t] + lags(v, t, n, 1.0).iter().zip(&a).map(|(x, a)| x * a).sum::<f64>();
        (0..v.len()).map(|t| if t < n { 0.0 } else { at(t) }).collect::<Vec<f64>>()
    };
    let e: Vec<Vec<f64>> = if nc > 0 { v.iter().map(error).collect() } else { v.to_vec() };
    let rows = |(v, e): (&Vec<f64>, &Vec<f64>)| {
        let (v, e) = (v.clone(), e.clone());
        let first = if nc > 0 { n + nc.max(nd) } else { nd };
        (first..v.len()).map(move |t| [lags(&v, t, nd, -1.0), lags(&e, t, nc, 1.0), vec![v[t]]].concat())
    };
    let x = least_squares(nd + nc, v.iter().zip(&e).flat_map(rows))?;
    let monic = |free: &[f64]| reflected_if_needed([&[1.0], free].concat());
    Some((monic(&x[nd..]), monic(&x[..nd])))
}

/// Rows of `n` columns and what they are to explain.
fn least_squares(n: usize, rows: impl Iterator<Item = Vec<f64>>) -> Option<Vec<f64>> {
    let rows: Vec<Vec<f64>> = rows.collect();
    let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
    let every: Vec<usize> = (0..n).collect();
    if n == 0 {
        return Some(Vec::new());
    }
    solve(&triangle, &every, n, RANK_TOLERANCE).ok().map(|solution| solution.theta)
}
