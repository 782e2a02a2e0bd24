//! ARX, `A(q) y(t) = sum_i B_i(q) u_i(t - nk_i) + d + e(t)`, by least squares.
//!
//! The regressor `[-y(t-1) … -y(t-na), u_i(t-nk_i) … u_i(t-nk_i-nb_i+1), 1]` is streamed through a QR
//! and never held. With the column of ones the data are centred on their first row, so an offset of
//! any size costs no digits; it comes back as `O = y(0) - G(1) u(0) + d/A(1)` in `y = G u + O`.
//!
//! Source 000, (2.1-1) and (2.2-3) to (2.2-5).

use super::fit::{Fit, Status, standard_deviations};
use super::least_squares::{digits, rounding, too_short};
use crate::error::{Error, Result};
use crate::excitation::{check_input_motion, excitation_order, too_poor};
use crate::limits::Limits;
use crate::linalg::{RankDeficient, Solution, dot, solve, sum};
use crate::model::{Model, PolyModel};
use crate::note::{Note, Place};
use crate::poly::at_one;
use crate::record::Record;
use crate::regress::{Column, Regression};

/// Rows per parameter below which excitation cannot be judged.
const FEW_ROWS: usize = 4;

/// Orders of an ARX model; `nb` and `nk` one per input.
#[derive(Clone, Debug, PartialEq)]
pub struct ArxOrders {
    /// Number of a coefficients.
    pub na: usize,
    /// Numbers of b coefficients.
    pub nb: Vec<usize>,
    /// Delays in samples.
    pub nk: Vec<usize>,
}

/// Fits the orders to the record's only output.
pub fn arx(rec: &Record, orders: &ArxOrders, offset: bool, limits: &Limits) -> Result<Fit> {
    check(rec, orders)?;
    let columns = columns(orders, offset);
    let all = columns.len();
    let n = all - usize::from(offset);
    if rec.N() <= all {
        return Err(too_short(Regression::new(rec, 0, columns).N(), all));
    }
    check_input_motion(rec, limits)?;
    check_delays(rec, orders, limits)?;
    let regression = Regression::new(rec, 0, columns);
    let N = regression.N();
    if N <= all {
        return Err(too_short(N, all));
    }
    check_excitation(rec, orders, limits)?;
    let triangle = regression.triangle();
    let every: Vec<usize> = (0..all).collect();
    let solution = solve(&triangle, &every, all, limits.X08).map_err(|e| not_exciting(rec, &e, limits))?;
    let error = rounding(&triangle, &solution, &solution.theta, solution.rss);

    let mut fit = unscaled(&regression, orders, offset, &solution, N, rec.Ts);
    fit.names = names(rec, orders);
    fit.expected_digits = digits(&error[..n], &solution.theta[..n]);
    fit.x0 = rec.segments().map(|_| Vec::new()).collect();
    fit.notes = notes(&fit, limits);
    fit.finite()
}

fn check(rec: &Record, orders: &ArxOrders) -> Result<()> {
    if rec.ny != 1 {
        return Err(Error::argument(
            "rec",
            format!("a record with {} outputs", rec.ny),
            "one with a single output",
        ));
    }
    for (name, given) in [("nb", &orders.nb), ("nk", &orders.nk)] {
        if given.len() != rec.nu {
            return Err(Error::argument(
                name,
                format!("{given:?}"),
                &format!("a number or a list of {}, one per input", rec.nu),
            ));
        }
    }
    if orders.nb.contains(&0) {
        return Err(Error::argument("nb", format!("{:?}", orders.nb), "at least 1"));
    }
    Ok(())
}

/// Refuses delays beyond the allowed share of the record (X05).
fn check_delays(rec: &Record, orders: &ArxOrders, limits: &Limits) -> Result<()> {
    for (i, &nk) in orders.nk.iter().enumerate() {
        let share = nk as f64 / rec.N() as f64;
        if share >= limits.X05 {
            return Err(Error::new(
                "X05",
                format!("nk = {nk} is {:.0} % of a record of {} rows", 100.0 * share, rec.N()),
            )
            .at(Place::column(rec.input_name(i)))
            .measured(nk as f64, limits.X05 * rec.N() as f64)
            .remedy("record at least three times as long as the delay"));
        }
    }
    Ok(())
}

/// Refuses orders beyond what each input supports (X02).
fn check_excitation(rec: &Record, orders: &ArxOrders, limits: &Limits) -> Result<()> {
    for (i, nb) in orders.nb.iter().enumerate() {
        let wanted = orders.na + nb;
        if rec.N() < FEW_ROWS * wanted {
            continue; // The Hankel matrix would be hardly taller than wide; the regressor's rank decides.
        }
        let supported = excitation_order(rec, i, wanted, limits.X02);
        if supported < wanted {
            return Err(too_poor(rec, i, supported, wanted, limits)
                .remedy(format!("ask for na + nb <= {supported}, or record with a PRBS or several steps")));
        }
    }
    Ok(())
}

fn columns(orders: &ArxOrders, offset: bool) -> Vec<Column> {
    let outputs = (1..=orders.na).map(Column::MinusOutput);
    let inputs = orders.nb.iter().zip(&orders.nk).enumerate();
    let inputs = inputs.flat_map(|(i, (&nb, &nk))| (nk..nk + nb).map(move |lag| Column::Input(i, lag)));
    outputs.chain(inputs).chain(offset.then_some(Column::One)).collect()
}

/// Back to the record's units; the covariance of the offset by the delta rule.
fn unscaled(
    regression: &Regression,
    orders: &ArxOrders,
    offset: bool,
    solution: &Solution,
    N: usize,
    Ts: f64,
) -> Fit {
    let all = solution.theta.len();
    let n = all - usize::from(offset);
    let mut unit = vec![1.0; all];
    let mut next = orders.na;
    for (i, &nb) in orders.nb.iter().enumerate() {
        unit[next..next + nb].fill(regression.u[i].factor / regression.y.factor);
        next += nb;
    }
    if offset {
        unit[n] = 1.0 / regression.y.factor;
    }
    let scaled: Vec<f64> = solution.theta.iter().zip(&unit).map(|(t, s)| t * s).collect();
    let (theta, d) = (scaled[..n].to_vec(), scaled.get(n).copied().unwrap_or(0.0));
    let rss = solution.rss / regression.y.factor.powi(2);
    let s2 = rss / (N - all) as f64;
    let covariance: Vec<f64> = (0..all * all)
        .map(|ij| {
            let (i, j) = (ij / all, ij % all);
            // In scaled units the noise is s^2 factor_y^2.
            s2 * regression.y.factor.powi(2) * solution.inverse_gram[ij] * unit[i] * unit[j]
        })
        .collect();

    let model = model(orders, &theta, Ts);
    let (O, gradient) = offset_of(&model, orders, regression, d);
    let P = if offset { with_offset(&covariance, &gradient, all) } else { covariance };
    Fit {
        model: Model::Poly(model),
        theta,
        P,
        names: Vec::new(),
        offset: if offset { O } else { 0.0 },
        x0: Vec::new(),
        N,
        loss: rss / N as f64,
        status: Status::Exact,
        expected_digits: Vec::new(),
        notes: Vec::new(),
    }
}

fn model(orders: &ArxOrders, theta: &[f64], Ts: f64) -> PolyModel {
    let A = [&[1.0], &theta[..orders.na]].concat();
    let mut rest = &theta[orders.na..];
    let mut B = Vec::new();
    for &nb in &orders.nb {
        let (own, others) = rest.split_at(nb);
        B.push(own.to_vec());
        rest = others;
    }
    PolyModel::arx(A, B, orders.nk.clone(), Ts)
}

/// `O` of `y = G u + O` and its gradient with respect to `a, b, d`; for an integrator the drift.
fn offset_of(model: &PolyModel, orders: &ArxOrders, regression: &Regression, d: f64) -> (f64, Vec<f64>) {
    let A1 = at_one(&model.A);
    let u0: Vec<f64> = regression.u.iter().map(|s| s.zero).collect();
    let y0 = regression.y.zero;
    let rest: f64 = d - model.B.iter().zip(&u0).map(|(b, u)| at_one(b) * u).sum::<f64>();
    let size: f64 = model.A.iter().map(|a| a.abs()).sum();
    let divisor = if A1.abs() > 1e-10 * size { A1 } else { f64::INFINITY };
    let integrating = divisor.is_infinite();
    let b_and_d = if integrating { 1.0 } else { 1.0 / A1 };
    let mut gradient = vec![-rest / (divisor * divisor); orders.na];
    for (b, u) in model.B.iter().zip(&u0) {
        gradient.extend(b.iter().map(|_| -u * b_and_d));
    }
    gradient.push(b_and_d);
    let O = if integrating { A1 * y0 + rest } else { y0 + rest / A1 };
    (O, gradient)
}

/// Covariance of `theta, O` from that of `theta, d`.
fn with_offset(covariance: &[f64], gradient: &[f64], all: usize) -> Vec<f64> {
    let n = all - 1;
    let to_offset: Vec<f64> =
        (0..all).map(|i| (0..all).map(|j| covariance[i * all + j] * gradient[j]).sum()).collect();
    let mut P = covariance.to_vec();
    for i in 0..n {
        P[i * all + n] = to_offset[i];
        P[n * all + i] = to_offset[i];
    }
    P[n * all + n] = gradient.iter().zip(&to_offset).map(|(g, c)| g * c).sum();
    P
}

/// `a1 … b1 …`, with the input behind a b when there are several: `b1[power]`.
fn names(rec: &Record, orders: &ArxOrders) -> Vec<String> {
    let a = (1..=orders.na).map(|k| format!("a{k}"));
    let b = orders.nb.iter().enumerate().flat_map(|(i, &nb)| {
        (1..=nb).map(
            move |k| {
                if rec.nu == 1 { format!("b{k}") } else { format!("b{k}[{}]", rec.input_name(i)) }
            },
        )
    });
    a.chain(b).collect()
}

/// Why the regressor has not full rank: inputs that copy each other (X11), or an input that feeds back the
/// output, or an exact model of lower order (X08).
fn not_exciting(rec: &Record, refusal: &RankDeficient, limits: &Limits) -> Error {
    if let Some((first, second, share)) = copied_input(rec) {
        let (a, b) = (rec.input_name(first), rec.input_name(second));
        return Error::new("X11", format!("inputs {a} and {b} copy each other"))
            .at(Place::column(b))
            .measured(share, 1e-10)
            .remedy(format!("leave {b} out, or move it on its own"));
    }
    let text = "the regressor has not full rank: an exact model of lower order, or plain feedback";
    let error = Error::new("X08", text)
        .remedy("ask for lower orders; with feedback move the set point or add a dither to u");
    error
        .at(Place::column(rec.input_name(0)))
        .count(refusal.dependent.len())
        .measured(refusal.ratio, limits.X08)
}

/// Two inputs whose centred columns agree but for a factor, and the share of the second that differs.
fn copied_input(rec: &Record) -> Option<(usize, usize, f64)> {
    let centred = |i: usize| {
        let x = rec.input(i);
        let mean = sum(&x) / x.len() as f64;
        x.iter().map(|v| v - mean).collect::<Vec<f64>>()
    };
    let columns: Vec<Vec<f64>> = (0..rec.nu).map(centred).collect();
    let pairs = (0..rec.nu).flat_map(|i| (i + 1..rec.nu).map(move |j| (i, j)));
    pairs
        .map(|(i, j)| {
            let (a, b) = (&columns[i], &columns[j]);
            let share = 1.0 - dot(a, b).powi(2) / (dot(a, a) * dot(b, b));
            (i, j, share)
        })
        .find(|&(_, _, share)| share < 1e-10)
}

fn notes(fit: &Fit, limits: &Limits) -> Vec<Note> {
    let mut notes = Vec::new();
    let per_parameter = fit.N as f64 / fit.theta.len() as f64;
    if per_parameter < limits.X03 {
        notes.push(
            Note::warning(
                "X03",
                format!("{} rows for {} parameters: intervals are rough", fit.N, fit.theta.len()),
            )
            .count(fit.N)
            .measured(per_parameter, limits.X03)
            .remedy("record longer or ask for lower orders"),
        );
    }
    let uncertain = standard_deviations(&fit.P, fit.theta.len());
    let uncertain = uncertain.iter().zip(&fit.theta).filter(|(sd, t)| 2.0 * **sd > t.abs()).count();
    if 4 * uncertain >= fit.theta.len() {
        notes.push(
            Note::warning(
                "X02",
                format!(
                    "{uncertain} of {} parameters are uncertain by more than their size",
                    fit.theta.len()
                ),
            )
            .count(uncertain)
            .measured(uncertain as f64 / fit.theta.len() as f64, 0.25)
            .remedy("ask for lower orders, or record with more changes of the input"),
        );
    }
    let scale = fit.theta.iter().fold(0.0f64, |m, t| m.max(t.abs()));
    if fit.loss == 0.0 || scale == 0.0 {
        notes.push(Note::warning("N08", "the residual is zero: variances and criteria say nothing"));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn fitted(u: &[f64], nu: usize, y: &[f64], orders: &ArxOrders, offset: bool) -> Fit {
        let rec = Record::uniform(u, nu, y, 1, 0.5).expect("fine");
        arx(&rec, orders, offset, &Limits::default()).expect("a fit")
    }

    #[test]
    fn noise_free_data_give_the_plant_and_its_offset_back() {
        let plant = PolyModel::arx(vec![1.0, -1.3, 0.42], vec![vec![0.5, 0.3], vec![-2.0]], vec![2, 0], 0.5);
        let u = white(400, 1);
        let y: Vec<f64> = plant.simulate(&u, 2).iter().map(|y| y + 583.451).collect();
        let orders = ArxOrders { na: 2, nb: vec![2, 1], nk: vec![2, 0] };
        let fit = fitted(&u, 2, &y, &orders, true);
        for (ours, truth) in fit.theta.iter().zip([-1.3, 0.42, 0.5, 0.3, -2.0]) {
            assert!((ours - truth).abs() < 1e-10, "{ours} {truth}");
        }
        assert!((fit.offset - 583.451).abs() < 1e-9);
        assert_eq!(fit.names, ["a1", "a2", "b1[u1]", "b2[u1]", "b1[u2]"]);
    }

    /// One regressor: `theta = sum u y / sum u^2`, `P = RSS / (N - 1) / sum u^2`.
    #[test]
    fn one_coefficient_is_the_projection_on_the_input() {
        let (u, e) = (white(50, 2), white(50, 3));
        let y: Vec<f64> = u.iter().zip(&e).map(|(u, e)| 3.0 * u + e).collect();
        let fit = fitted(&u, 1, &y, &ArxOrders { na: 0, nb: vec![1], nk: vec![0] }, false);
        let theta = dot(&u, &y) / dot(&u, &u);
        let rss: f64 = u.iter().zip(&y).map(|(u, y)| (y - theta * u).powi(2)).sum();
        assert!((fit.theta[0] / theta - 1.0).abs() < 1e-13);
        assert!((fit.P[0] / (rss / 49.0 / dot(&u, &u)) - 1.0).abs() < 1e-12);
        assert!((fit.loss / (rss / 50.0) - 1.0).abs() < 1e-12);
    }

    /// `na = 0`, static: `O` is the intercept of a straight line, whose variance is known.
    #[test]
    fn the_variance_of_the_offset_is_that_of_an_intercept() {
        let (u, e) = (white(80, 4), white(80, 5));
        let u: Vec<f64> = u.iter().map(|u| 20.0 + u).collect();
        let y: Vec<f64> = u.iter().zip(&e).map(|(u, e)| 7.0 - 2.0 * u + e).collect();
        let fit = fitted(&u, 1, &y, &ArxOrders { na: 0, nb: vec![1], nk: vec![0] }, true);
        let mean = u.iter().sum::<f64>() / 80.0;
        let around: f64 = u.iter().map(|u| (u - mean).powi(2)).sum();
        let s2 = fit.loss * 80.0 / 78.0;
        assert!((fit.P[3] / (s2 * (1.0 / 80.0 + mean * mean / around)) - 1.0).abs() < 1e-10);
    }

    /// `O = d / (1 + a1)` by the delta rule, `d` from a regression on explicit columns.
    #[test]
    fn the_covariance_of_the_offset_follows_from_that_of_the_constant() {
        let (u, e, mut y) = (white(200, 7), white(200, 8), vec![4.0]);
        for k in 1..200 {
            y.push(0.8 * y[k - 1] + 0.5 * u[k - 1] + 3.0 + 0.1 * e[k]);
        }
        let fit = fitted(&u, 1, &y, &ArxOrders { na: 1, nb: vec![1], nk: vec![1] }, true);
        let phi: Vec<f64> = (1..200).flat_map(|k| [-y[k - 1], u[k - 1], 1.0]).collect();
        let explicit = crate::batch::least_squares(&phi, 3, &y[1..]).expect("full rank");
        let (A1, d) = (1.0 + explicit.theta[0], explicit.theta[2]);
        let gradient = [-d / (A1 * A1), 0.0, 1.0 / A1];
        let with_theta = |i: usize| (0..3).map(|j| explicit.P[3 * i + j] * gradient[j]).sum::<f64>();
        let variance: f64 = (0..3).map(|i| gradient[i] * with_theta(i)).sum();
        assert!((fit.offset / (d / A1) - 1.0).abs() < 1e-10);
        for (i, exact) in [with_theta(0), with_theta(1), variance].into_iter().enumerate() {
            assert!((fit.P[3 * i + 2] / exact - 1.0).abs() < 1e-8, "{i}: {} {exact}", fit.P[3 * i + 2]);
        }
    }

    #[test]
    fn the_level_of_the_data_costs_no_digits() {
        let plant = PolyModel::arx(vec![1.0, -0.9], vec![vec![0.5]], vec![1], 0.5);
        let u = white(300, 6);
        // A grid that survives the shift, so that both records hold the same steps.
        let grid = |x: f64| (x * 1024.0).round() / 1024.0;
        let y: Vec<f64> = plant.simulate(&u, 1).into_iter().map(grid).collect();
        let high: Vec<f64> = y.iter().map(|y| y + 1048576.0).collect();
        let orders = ArxOrders { na: 1, nb: vec![1], nk: vec![1] };
        let (low, high) = (fitted(&u, 1, &y, &orders, true), fitted(&u, 1, &high, &orders, true));
        assert_eq!(low.theta, high.theta);
        assert!((high.offset - low.offset - 1048576.0).abs() < 1e-6);
    }
}
