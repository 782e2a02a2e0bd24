//! ARX with regressors of one's own, by least squares:
//! `A(q) y(t) = sum_i B_i(q) u_i(t - nk_i) + sum_m g_m x_m(t) + d + e(t)`.
//!
//! Each `x_m` is a further input without delay, so this is [`arx`](super::arx) of a wider record. A row counts where
//! every lag lies in its segment on outputs that count, and where no given column is NaN. The data are centred on their
//! first row for the digits; the constant comes back as the `d` of the equation above, since a model that is not
//! linear in its signals has no level `O`.
//!
//! Source 000, (2.2-3) to (2.2-5) and chapter 4; Ljung 1999, 5.2.

use std::ops::Range;

use super::arx::columns;
use super::fit::{Fit, Status, standard_deviations};
use super::least_squares::{digits, rounding};
use super::orders::{Orders, too_short};
use super::poly_fit::{EXACT, doubts, with_offset};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{RankDeficient, solve};
use crate::model::{Lagged, Model, Own, longest_lag};
use crate::note::Place;
use crate::record::{Record, Scale};
use crate::regress::Regression;

/// Fits the orders and the regressors `own` to the record's only output; `given (N, width)` holds columns that the
/// caller computed.
///
/// The model of the fit is an ARX model of the inputs and of each regressor as one more; `offset` is `d`.
pub fn term_arx(
    rec: &Record,
    orders: &Orders,
    own: &[Own],
    given: &[f64],
    offset: bool,
    limits: &Limits,
) -> Result<Fit> {
    check(rec, orders, own, offset, limits)?;
    let x = own_columns(rec, own, given);
    let runs = runs(rec, history(orders, own), orders.na, &x, own.len());
    let orders = with_own(orders, own.len());
    let all = orders.n() + usize::from(offset);
    let N: usize = runs.iter().map(Range::len).sum();
    if N <= all {
        return Err(too_short(N, all));
    }
    check_motion(own, &x, &runs)?;
    let u = beside(rec, &x, own.len());
    let wide = Record { u: &u, nu: rec.nu + own.len(), ..rec.clone() };
    let regression = Regression::over(&wide, 0, columns(&orders, offset), runs);
    let triangle = regression.triangle();
    let every: Vec<usize> = (0..all).collect();
    let names = names(rec, &orders, own);
    let solution = solve(&triangle, &every, all, limits.X08).map_err(|e| dependent(&e, &names, limits))?;
    let error = rounding(&triangle, &solution, &solution.theta, solution.rss);

    let unit = units(&orders, &regression.u, regression.y, all);
    let s2 = solution.rss / (N - all) as f64;
    let covariance: Vec<f64> =
        (0..all * all).map(|ij| s2 * solution.inverse_gram[ij] * unit[ij / all] * unit[ij % all]).collect();
    let n = orders.n();
    let theta: Vec<f64> = solution.theta.iter().zip(&unit).map(|(t, s)| t * s).collect();
    let (d, gradient) = constant(&orders, &theta, &regression.u, regression.y);
    let mut fit = Fit {
        model: Model::Poly(orders.model(&theta[..n], rec.Ts)),
        P: if offset { with_offset(&covariance, &gradient, all) } else { covariance },
        expected_digits: digits(&error[..n], &solution.theta[..n]),
        theta: theta[..n].to_vec(),
        names,
        offset: if offset { d } else { 0.0 },
        steps: Vec::new(),
        x0: rec.segments().map(|_| Vec::new()).collect(),
        N,
        loss: solution.rss / regression.y.factor.powi(2) / N as f64,
        status: Status::Exact,
        notes: Vec::new(),
        intervals: Vec::new(),
        plants: Vec::new(),
        sampled: None,
    };
    let sd = standard_deviations(&fit.P, fit.theta.len());
    let exact = solution.rss <= EXACT * N as f64;
    fit.notes = doubts(&fit.theta, &sd, sd.len(), N, exact, limits);
    fit.finite()
}

/// What `arx` refuses, but for inputs without a coefficient of their own, and names that are not told apart.
fn check(rec: &Record, orders: &Orders, own: &[Own], offset: bool, limits: &Limits) -> Result<()> {
    let at_least_one = Orders { nb: orders.nb.iter().map(|&nb| nb.max(1)).collect(), ..orders.clone() };
    at_least_one.check(rec, offset, limits)?;
    for (m, x) in own.iter().enumerate() {
        if own[..m].iter().any(|other| other.name() == x.name()) {
            let came = format!("`{}` twice", x.name());
            return Err(Error::argument("regressors", came, "a list without repetition"));
        }
    }
    Ok(())
}

/// The regressors row by row, `(N, m)`; NaN where one has no value.
fn own_columns(rec: &Record, own: &[Own], given: &[f64]) -> Vec<f64> {
    let width = given.len() / rec.N();
    let mut x = Vec::with_capacity(rec.N() * own.len());
    for s in rec.segments() {
        for k in s.clone() {
            let at = |signal: Lagged| match signal {
                Lagged::Input(i, lag) => rec.u_at(k - lag, i),
                Lagged::Output(lag) => rec.y_at(k - lag, 0),
            };
            let known = |signal: &Lagged| {
                k >= s.start + signal.lag()
                    && (!matches!(signal, Lagged::Output(_)) || rec.is_valid(k - signal.lag(), 0))
            };
            x.extend(own.iter().map(|own| {
                let has_value = own.signals().iter().all(known);
                if has_value { own.value(&at, &given[k * width..(k + 1) * width]) } else { f64::NAN }
            }));
        }
    }
    x
}

fn history(orders: &Orders, own: &[Own]) -> usize {
    let inputs = orders.nb.iter().zip(&orders.nk).filter(|(nb, _)| **nb > 0).map(|(nb, nk)| nk + nb - 1);
    inputs.chain([orders.na, longest_lag(own)]).max().unwrap_or(0)
}

/// Runs of rows on which every regressor has a value.
fn runs(rec: &Record, history: usize, na: usize, x: &[f64], m: usize) -> Vec<Range<usize>> {
    let has_values = |k: usize| x[k * m..(k + 1) * m].iter().all(|x| x.is_finite());
    let mut runs = Vec::new();
    for run in rec.runs(history, na, 0) {
        let mut start = run.start;
        for k in run.clone().chain([run.end]) {
            if k == run.end || !has_values(k) {
                if k > start {
                    runs.push(start..k);
                }
                start = k + 1;
            }
        }
    }
    runs
}

/// The orders with each regressor as one more input, without delay; an input without coefficients has no history.
fn with_own(orders: &Orders, m: usize) -> Orders {
    let nk = orders.nb.iter().zip(&orders.nk).map(|(&nb, &nk)| if nb == 0 { 1 } else { nk });
    let nb = [orders.nb.clone(), vec![1; m]].concat();
    Orders::arx(orders.na, nb, nk.chain(std::iter::repeat_n(0, m)).collect())
}

/// The inputs of a record with the regressors beside them; where one has no value, its first stands in.
fn beside(rec: &Record, x: &[f64], m: usize) -> Vec<f64> {
    let first = |j: usize| x.iter().skip(j).step_by(m).copied().find(|x| x.is_finite()).unwrap_or(0.0);
    let first: Vec<f64> = (0..m).map(first).collect();
    let row = |(u, x): (&[f64], &[f64])| {
        let finite = x.iter().zip(&first).map(|(x, first)| if x.is_finite() { *x } else { *first });
        u.iter().copied().chain(finite).collect::<Vec<f64>>()
    };
    rec.u.chunks(rec.nu).zip(x.chunks(m)).flat_map(row).collect()
}

/// X01: a regressor that takes one value tells nothing.
fn check_motion(own: &[Own], x: &[f64], runs: &[Range<usize>]) -> Result<()> {
    let m = own.len();
    for (j, own) in own.iter().enumerate() {
        let mut values = runs.iter().cloned().flatten().map(|k| x[k * m + j]);
        let Some(first) = values.next() else { continue };
        if values.all(|value| value == first) {
            let text = format!("regressor `{}` takes one value, {first}, on every row", own.name());
            return Err(Error::new("X01", text)
                .at(Place::column(own.name()))
                .remedy("leave it out, or record motion in both directions"));
        }
    }
    Ok(())
}

/// X08: a coefficient that the data cannot tell from the others.
fn dependent(refusal: &RankDeficient, names: &[String], limits: &Limits) -> Error {
    let constant = "the constant".to_owned();
    let name = names.get(refusal.dependent[0]).unwrap_or(&constant);
    let text = format!("{name} cannot be told apart: its regressor is a combination of the others");
    Error::new("X08", text)
        .at(Place::column(name))
        .count(refusal.dependent.len())
        .measured(refusal.ratio, limits.X08)
        .remedy("leave it out: positive(u) + negative(u) is u itself, then nb=0; or record with more changes of the input")
}

/// `a1 … b1 …`, then the regressors as they were written.
fn names(rec: &Record, orders: &Orders, own: &[Own]) -> Vec<String> {
    let plain = Orders { nb: orders.nb[..rec.nu].to_vec(), nf: vec![0; rec.nu], ..orders.clone() };
    plain.names(rec).into_iter().chain(own.iter().map(|own| own.name().to_owned())).collect()
}

/// What one scaled unit of each parameter is in the record's units.
fn units(orders: &Orders, u: &[Scale], y: Scale, all: usize) -> Vec<f64> {
    let inputs = u.iter().zip(&orders.nb).flat_map(|(u, &nb)| std::iter::repeat_n(u.factor / y.factor, nb));
    let mut unit: Vec<f64> = std::iter::repeat_n(1.0, orders.na).chain(inputs).collect();
    unit.resize(all, 1.0 / y.factor);
    unit
}

/// `d` of the equation of raw signals from that of centred ones, and its gradient:
/// `A (y - y0) = sum B_i (u_i - u0_i) + c` gives `d = c + A(1) y0 - sum B_i(1) u0_i`.
fn constant(orders: &Orders, theta: &[f64], u: &[Scale], y: Scale) -> (f64, Vec<f64>) {
    let inputs = u.iter().zip(&orders.nb).flat_map(|(u, &nb)| std::iter::repeat_n(-u.zero, nb));
    let mut gradient: Vec<f64> = std::iter::repeat_n(y.zero, orders.na).chain(inputs).collect();
    let shift: f64 = gradient.iter().zip(theta).map(|(g, t)| g * t).sum();
    gradient.push(1.0);
    (theta.get(orders.n()).unwrap_or(&0.0) + y.zero + shift, gradient)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::model::{Term, TermModel};

    /// The same numbers from a regression on explicit columns.
    #[test]
    fn the_fit_is_least_squares_on_explicit_columns() {
        let (u, e) = (white(300, 1), white(300, 2));
        let mut y = vec![5.0, 5.0];
        for t in 2..300 {
            y.push(1.0 + 0.7 * y[t - 1] + 0.4 * u[t - 1] - 0.3 * u[t - 2].max(0.0) + 0.1 * e[t]);
        }
        let rec = Record::uniform(&u, 1, &y, 1, 0.1).expect("fine");
        let own = [Own::Term(Term::parse("positive(u(t-2))", &rec.names).expect("a term"))];
        let orders = Orders::arx(1, vec![1], vec![1]);
        let fit = term_arx(&rec, &orders, &own, &[], true, &Limits::default()).expect("a fit");
        let phi: Vec<f64> = (2..300).flat_map(|t| [-y[t - 1], u[t - 1], u[t - 2].max(0.0), 1.0]).collect();
        let explicit = crate::batch::least_squares(&phi, 4, &y[2..]).expect("full rank");
        let ours: Vec<f64> = fit.theta.iter().copied().chain([fit.offset]).collect();
        for (i, (ours, exact)) in ours.iter().zip(&explicit.theta).enumerate() {
            assert!((ours - exact).abs() < 1e-11, "{i}: {ours} {exact}");
        }
        for (ours, exact) in fit.P.iter().zip(&explicit.P) {
            assert!((ours - exact).abs() < 1e-9 * explicit.P[15], "{ours} {exact}");
        }
        assert_eq!(fit.names, ["a1", "b1", "positive(u(t-2))"]);
        assert_eq!(fit.N, 298);
    }

    #[test]
    fn rows_count_where_every_regressor_has_a_value() {
        let u = white(40, 3);
        let names = ["u".to_owned(), "y".to_owned()];
        let own = vec![
            Own::Term(Term::parse("u(t-1)*y(t-1)", &names).expect("a term")),
            Own::Column("w".into(), 0),
        ];
        let (A, g) = (vec![1.0, -0.5], vec![0.2, 1.0]);
        let m = TermModel { A, B: vec![vec![]], nk: vec![1], own: own.clone(), g, d: 0.0 };
        let mut w = white(40, 4);
        let y = m.simulate(&u, &w, Vec::new()).expect("bounded");
        let mut valid = [true; 40];
        valid[30] = false;
        let mut rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        rec.starts = vec![0, 20];
        rec.valid = Some(&valid);
        w[10] = f64::NAN;
        let orders = Orders::arx(1, vec![0], vec![1]);
        let fit = term_arx(&rec, &orders, &own, &w, false, &Limits::default()).expect("a fit");
        // Two starts, the hole and the row behind it, the NaN.
        assert_eq!(fit.N, 40 - 2 - 2 - 1);
        assert!(fit.theta.iter().zip([-0.5, 0.2, 1.0]).all(|(t, exact)| (t - exact).abs() < 1e-12));
    }
}
