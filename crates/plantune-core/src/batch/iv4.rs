//! Instrumental variables in four steps for `A y = sum_i B_i u_i(t - nk_i) + d + v`, `v` of any colour.
//!
//! ```text
//! phi = [-y(t-1) … | u_i(t-nk_i) … | 1],   zeta = the same with x for y,   x = sum_i B_i/A u_i + d/A(1)
//! ```
//!
//! 1. Least squares on `phi`.
//! 2. Instruments `zeta` from it: `sum zeta (y - phi' theta) = 0`.
//! 3. An autoregression of what this leaves: `L v = e`.
//! 4. The same as 2 with new instruments, all of it filtered by `L`; 3 and 4 again as often as wished.
//!
//! With `QR` of `[zeta | phi | y]` the equations are `R_zphi theta = R_zy`, and
//! `Cov theta = s^2 R_zphi^-1 R_zphi^-T` with `s^2` of `e`.
//!
//! An `L` of order `na + nb` is no inverse noise model; with [`LAGS`] more the intervals are true.
//! Ljung 1999, (15.21) to (15.26); Söderström and Stoica 1989, 8.3.

use super::cancellation::cancellation;
use super::fit::{Fit, Status};
use super::least_squares::{digits, rounding};
use super::orders::{Orders, copied_input, too_short};
use super::poly_fit::{Scaled, plant_notes};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{RankDeficient, Solution, Triangle, solve};
use crate::model::PolyModel;
use crate::note::Place;
use crate::poly::{is_stable, reflected};
use crate::record::{Record, Scale};

/// Least order of the autoregression.
const LAGS: usize = 8;

/// Change of a parameter, as a share of its standard deviation, at which the rounds end.
const AT_REST: f64 = 1e-6;

/// Fits the orders to the record's only output; `rounds` of steps 3 and 4.
pub fn iv4(rec: &Record, orders: &Orders, offset: bool, rounds: usize, limits: &Limits) -> Result<Fit> {
    orders.check(rec, offset, limits)?;
    if rounds == 0 {
        return Err(Error::argument("rounds", rounds, "at least 1"));
    }
    let data = Data::new(rec, orders, offset);
    let all = data.n();
    if data.N(data.lags()) <= all {
        return Err(too_short(data.N(data.lags()), all));
    }
    let (found, status) = data.iterated(rounds).map_err(|e| dependent(rec, &e, limits))?;
    let left = data.left(&found.solution.theta);
    let rss: f64 = left.iter().flatten().map(|v| v * v).sum();
    let N = left.iter().map(Vec::len).sum();
    // `Scaled` takes s^2 from what is left; here it is that of `e`.
    let s2 = rss / (N - all) as f64;
    let inverse_gram: Vec<f64> = found.solution.inverse_gram.iter().map(|p| p * found.s2 / s2).collect();
    let error = rounding(&found.triangle, &found.solution, &found.solution.theta, 0.0);
    let theta = &found.solution.theta;
    let scaled =
        Scaled { theta, inverse_gram: &inverse_gram, rss, N, states: 0, u: &data.scale_u, y: data.scale_y };
    let mut fit = scaled.fit(orders, rec.Ts, limits);
    fit.notes.extend(cancellation(&fit, orders, true, limits));
    fit.names = orders.names(rec);
    fit.expected_digits = digits(&error[..orders.n()], &theta[..orders.n()]);
    fit.x0 = rec.segments().map(|_| Vec::new()).collect();
    let of_plant = plant_notes(rec, &fit, limits);
    fit.notes.extend(of_plant);
    fit.status = status;
    fit.finite()
}

/// Centred and scaled columns.
struct Data<'r, 'a> {
    rec: &'r Record<'a>,
    orders: &'r Orders,
    offset: bool,
    scale_u: Vec<Scale>,
    scale_y: Scale,
    u: Vec<Vec<f64>>,
    y: Vec<f64>,
    runs: Vec<std::ops::Range<usize>>,
}

/// The equations solved.
struct Found {
    solution: Solution,
    triangle: Triangle,
    /// Variance of `e`.
    s2: f64,
}

impl<'r, 'a> Data<'r, 'a> {
    fn new(rec: &'r Record<'a>, orders: &'r Orders, offset: bool) -> Self {
        let scaled = |x: &[f64], s: Scale| x.iter().map(|&x| s.apply(x)).collect::<Vec<f64>>();
        let scale_u: Vec<Scale> = (0..rec.nu).map(|i| Scale::of(&rec.input(i), offset)).collect();
        let held = rec.output_held(0);
        let scale_y = Scale::of(&held, offset);
        Data {
            u: (0..rec.nu).map(|i| scaled(&rec.input(i), scale_u[i])).collect(),
            y: scaled(&held, scale_y),
            runs: rec.runs(orders.history(), orders.na, 0),
            scale_u,
            scale_y,
            rec,
            orders,
            offset,
        }
    }

    fn n(&self) -> usize {
        self.orders.n() + usize::from(self.offset)
    }

    /// Order of the autoregression.
    fn lags(&self) -> usize {
        LAGS.max(self.orders.n())
    }

    /// Rows left when a filter of this order has passed.
    fn N(&self, lags: usize) -> usize {
        self.runs.iter().map(|run| run.len().saturating_sub(lags)).sum()
    }

    /// All four steps.
    fn iterated(&self, rounds: usize) -> std::result::Result<(Found, Status), RankDeficient> {
        let plain = [1.0];
        let mut last = self.solved(&self.y, &plain)?;
        last = self.solved(&self.simulated(&last.solution.theta), &plain)?;
        for _ in 0..rounds {
            let L = self.autoregression(&last.solution.theta)?;
            let next = self.solved(&self.simulated(&last.solution.theta), &L)?;
            let n = self.n();
            let at_rest = (0..n).all(|i| {
                let sd = (next.s2 * next.solution.inverse_gram[i * n + i]).sqrt();
                (next.solution.theta[i] - last.solution.theta[i]).abs() <= AT_REST * sd
            });
            last = next;
            if at_rest {
                return Ok((last, Status::Converged));
            }
        }
        // Rounds asked for are rounds done: one is the method as printed.
        Ok((last, if rounds == 1 { Status::Exact } else { Status::NotConverged }))
    }

    /// `[-x(t-1) … | u_i(t-nk_i) … | 1]` at row `t`.
    fn row(&self, x: &[f64], t: usize, out: &mut Vec<f64>) {
        let Orders { na, nb, nk, .. } = self.orders;
        out.extend((1..=*na).map(|k| -x[t - k]));
        for (i, u) in self.u.iter().enumerate() {
            out.extend((nk[i]..nk[i] + nb[i]).map(|lag| u[t - lag]));
        }
        out.extend(self.offset.then_some(1.0));
    }

    /// `theta` by the instruments made of `x`, everything filtered by `L`.
    fn solved(&self, x: &[f64], L: &[f64]) -> std::result::Result<Found, RankDeficient> {
        let n = self.n();
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for run in &self.runs {
            let of = |t: usize| {
                let mut row = Vec::with_capacity(2 * n + 1);
                self.row(x, t, &mut row);
                self.row(&self.y, t, &mut row);
                row.push(self.y[t]);
                row
            };
            let plain: Vec<Vec<f64>> = run.clone().map(of).collect();
            rows.extend(plain.windows(L.len()).map(|past| {
                let at = |j: usize| L.iter().zip(past.iter().rev()).map(|(c, row)| c * row[j]).sum();
                (0..2 * n + 1).map(at).collect()
            }));
        }
        let all = Triangle::of_rows(2 * n + 1, rows.iter().map(Vec::as_slice));
        let square: Vec<Vec<f64>> = (0..n).map(|i| (n..=2 * n).map(|j| all.at(i, j)).collect()).collect();
        let triangle = Triangle::of_rows(n + 1, square.iter().map(Vec::as_slice));
        let every: Vec<usize> = (0..n).collect();
        let solution = solve(&triangle, &every, n, RANK_TOLERANCE)?;
        let e = |row: &Vec<f64>| {
            row[2 * n] - row[n..].iter().zip(&solution.theta).map(|(x, t)| x * t).sum::<f64>()
        };
        let s2 = rows.iter().map(|row| e(row).powi(2)).sum::<f64>() / (rows.len() - n) as f64;
        Ok(Found { solution, triangle, s2 })
    }

    /// `sum_i B_i/A u_i + d/A(1)` from rest in each segment.
    fn simulated(&self, theta: &[f64]) -> Vec<f64> {
        let mut model = self.orders.model(&theta[..self.orders.n()], self.rec.Ts);
        if !is_stable(&model.A) {
            model.A = reflected(&model.A);
        }
        let d = theta.get(self.orders.n()).copied().unwrap_or(0.0);
        let level = d / model.A.iter().sum::<f64>();
        let mut x = Vec::with_capacity(self.y.len());
        for s in self.rec.segments() {
            let u: Vec<f64> = s.flat_map(|k| self.u.iter().map(move |u| u[k])).collect();
            x.extend(model.simulate(&u, self.rec.nu).iter().map(|y| y + level));
        }
        x
    }

    /// `y - phi' theta` of each run.
    fn left(&self, theta: &[f64]) -> Vec<Vec<f64>> {
        let mut row = Vec::new();
        let mut at = |t: usize| {
            row.clear();
            self.row(&self.y, t, &mut row);
            self.y[t] - row.iter().zip(theta).map(|(x, t)| x * t).sum::<f64>()
        };
        self.runs.iter().map(|run| run.clone().map(&mut at).collect()).collect()
    }

    /// `L` of `L v = e`.
    fn autoregression(&self, theta: &[f64]) -> std::result::Result<Vec<f64>, RankDeficient> {
        let n = self.lags();
        let left = self.left(theta);
        let rows = left.iter().flat_map(|v| v.windows(n + 1)).map(|past| {
            let lags = past.iter().rev().skip(1).map(|v| -v);
            lags.chain([past[n]]).collect::<Vec<f64>>()
        });
        let rows: Vec<Vec<f64>> = rows.collect();
        let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
        let every: Vec<usize> = (0..n).collect();
        // Nothing left: no colour to take out.
        let L = solve(&triangle, &every, n, RANK_TOLERANCE).map(|s| s.theta).unwrap_or_default();
        Ok([vec![1.0], L].concat())
    }
}

/// Pivots below this share mean that instruments do not tell columns apart.
const RANK_TOLERANCE: f64 = 1e-10;

/// X11 where inputs copy each other; else X08.
fn dependent(rec: &Record, refusal: &RankDeficient, limits: &Limits) -> Error {
    copied_input(rec).unwrap_or_else(|| {
        Error::new("X08", "the instruments do not tell the parameters apart")
            .at(Place::column(rec.input_name(0)))
            .count(refusal.dependent.len())
            .measured(refusal.ratio, limits.X08)
            .remedy("ask for lower orders, or record with more changes of the input")
    })
}

/// `A`, `B` by instruments in the units of the record, as start of a search.
pub(super) fn start(rec: &Record, orders: &Orders, offset: bool) -> Option<PolyModel> {
    let data = Data::new(rec, orders, offset);
    if data.N(data.lags()) <= data.n() + data.lags() {
        return None;
    }
    let (found, _) = data.iterated(1).ok()?;
    let mut model = orders.model(&found.solution.theta[..orders.n()], rec.Ts);
    for (b, u) in model.B.iter_mut().zip(&data.scale_u) {
        b.iter_mut().for_each(|b| *b *= u.factor / data.scale_y.factor);
    }
    Some(model)
}
