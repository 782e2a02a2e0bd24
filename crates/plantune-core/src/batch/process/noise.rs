//! The noise model of a process fit: `v = (C / D) e`, and errors made white by it.
//!
//! ```text
//! e = (D / C) v,   de/dc_i = -e(t - i) / C,   de/dd_j = v(t - j) / C
//! ```
//!
//! Data of a closed loop give a plant without bias only if the noise model can be true (Ljung 1999, 13.4;
//! METHODS 1.7). The errors before a segment are taken as zero.

use std::borrow::Cow;

use crate::linalg::Triangle;
use crate::poly::is_stable;

/// Lags of the autoregression that stands for the noise at the start.
const LONG: usize = 20;

/// `C` and `D` without their leading one.
pub(super) struct Noise {
    c: Vec<f64>,
    d: Vec<f64>,
}

impl Noise {
    /// From `c …, d …`; None where the noise would not be stationary or not be invertible.
    pub(super) fn new(x: &[f64], (nc, _): (usize, usize)) -> Option<Self> {
        let noise = Noise { c: x[..nc].to_vec(), d: x[nc..].to_vec() };
        let stable = |p: &[f64]| is_stable(&[&[1.0], p].concat());
        (stable(&noise.c) && stable(&noise.d)).then_some(noise)
    }

    /// Whether `C = D = 1`.
    pub(super) fn is_white(&self) -> bool {
        self.c.len() + self.d.len() == 0
    }

    /// `(D / C) x` of each column.
    pub(super) fn whitened<'x>(&self, columns: impl Iterator<Item = &'x [f64]>) -> Vec<Cow<'x, [f64]>> {
        let white = |x: &'x [f64]| {
            let mut x = Cow::Borrowed(x);
            if !self.is_white() {
                self.whiten(x.to_mut());
            }
            x
        };
        columns.map(white).collect()
    }

    /// `x <- (D / C) x`, zero before.
    fn whiten(&self, x: &mut [f64]) {
        let own = x.to_vec();
        for t in 0..x.len() {
            let past = |p: &[f64], y: &[f64]| -> f64 {
                p.iter().enumerate().take(t).map(|(i, p)| p * y[t - 1 - i]).sum()
            };
            x[t] = own[t] + past(&self.d, &own) - past(&self.c, x);
        }
    }

    /// Derivatives of the prediction, `-de`, by `c …, d …`, given the errors `v` before the noise model.
    pub(super) fn derivatives(&self, v: &[f64]) -> Vec<Vec<f64>> {
        let mut e = v.to_vec();
        self.whiten(&mut e);
        let behind = Noise { c: self.c.clone(), d: Vec::new() };
        let by = |x: &[f64], lag: usize, sign: f64| {
            let lag = lag.min(x.len());
            let late = x[..x.len() - lag].iter().map(|x| sign * x);
            let mut column: Vec<f64> = std::iter::repeat_n(0.0, lag).chain(late).collect();
            behind.whiten(&mut column);
            column
        };
        let by_c = (1..=self.c.len()).map(|i| by(&e, i, 1.0));
        by_c.chain((1..=self.d.len()).map(|j| by(v, j, -1.0))).collect()
    }
}

/// `c …, d …` to begin with: the errors of a long autoregression stand for e (Hannan and Rissanen 1982).
pub(super) fn start(segments: &[Vec<f64>], (nc, nd): (usize, usize)) -> Vec<f64> {
    let none = vec![0.0; nc + nd];
    let long = |v: &Vec<f64>| v.len().min(LONG);
    let lagged = |v: &[f64], n: usize, t: usize| (1..=n).map(|i| -v[t - i]).collect::<Vec<f64>>();
    let rows = |v: &Vec<f64>| -> Vec<Vec<f64>> {
        (long(v)..v.len()).map(|t| [lagged(v, LONG, t), vec![v[t]]].concat()).collect()
    };
    let Some(a) = regressed(LONG, segments.iter().flat_map(rows)) else { return none };
    let rows = |v: &Vec<f64>| -> Vec<Vec<f64>> {
        let mut e = vec![0.0; v.len()];
        for t in long(v)..v.len() {
            e[t] = v[t] + a.iter().enumerate().map(|(i, a)| a * v[t - 1 - i]).sum::<f64>();
        }
        let first = long(v) + nc.max(nd);
        let past = |t: usize| (1..=nc).map(|i| e[t - i]).collect::<Vec<f64>>();
        (first.min(v.len())..v.len()).map(|t| [past(t), lagged(v, nd, t), vec![v[t]]].concat()).collect()
    };
    match regressed(nc + nd, segments.iter().flat_map(rows)) {
        Some(x) if Noise::new(&x, (nc, nd)).is_some() => x,
        _ => none,
    }
}

/// Least squares over rows `[x | y]`.
fn regressed(n: usize, rows: impl Iterator<Item = Vec<f64>>) -> Option<Vec<f64>> {
    let rows: Vec<Vec<f64>> = rows.collect();
    let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
    let every: Vec<usize> = (0..n).collect();
    crate::linalg::solve(&triangle, &every, n, 1e-12).ok().map(|s| s.theta)
}
