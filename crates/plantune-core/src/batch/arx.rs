//! ARX, `A(q) y(t) = sum_i B_i(q) u_i(t - nk_i) + d + e(t)`, by least squares.
//!
//! The regressor `[-y(t-1) … -y(t-na), u_i(t-nk_i) … u_i(t-nk_i-nb_i+1), 1]` is streamed through a QR
//! and never held. With the column of ones the data are centred on their first row, so an offset of
//! any size costs no digits; it comes back as `O = y(0) - G(1) u(0) + d/A(1)` in `y = G u + O`.
//!
//! Source 000, (2.1-1) and (2.2-3) to (2.2-5).

use super::cancellation::cancellation;
use super::fit::Fit;
use super::least_squares::{digits, rounding};
use super::orders::{Orders, copied_input, too_short};
use super::poly_fit::{Scaled, plant_notes};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{RankDeficient, solve};
use crate::note::Place;
use crate::record::Record;
use crate::regress::{Column, Regression};

/// Fits the orders to the record's only output.
pub fn arx(rec: &Record, orders: &Orders, offset: bool, limits: &Limits) -> Result<Fit> {
    orders.check(rec, offset, limits)?;
    let regression = Regression::new(rec, 0, columns(orders, offset));
    let (N, n) = (regression.N(), orders.n());
    let all = n + usize::from(offset);
    if N <= all {
        return Err(too_short(N, all));
    }
    let triangle = regression.triangle();
    let every: Vec<usize> = (0..all).collect();
    let solution = solve(&triangle, &every, all, limits.X08).map_err(|e| not_exciting(rec, &e, limits))?;
    let error = rounding(&triangle, &solution, &solution.theta, solution.rss);

    let scaled = Scaled {
        theta: &solution.theta,
        inverse_gram: &solution.inverse_gram,
        rss: solution.rss,
        N,
        states: 0,
        u: &regression.u,
        y: regression.y,
    };
    let mut fit = scaled.fit(orders, rec.Ts, limits);
    fit.notes.extend(cancellation(&fit, orders, false, limits));
    fit.names = orders.names(rec);
    fit.expected_digits = digits(&error[..n], &solution.theta[..n]);
    fit.x0 = rec.segments().map(|_| Vec::new()).collect();
    let of_plant = plant_notes(rec, &fit, limits);
    fit.notes.extend(of_plant);
    fit.finite()
}

/// `[-y(t-1) … | u_i(t-nk_i) … | 1]`.
pub(super) fn columns(orders: &Orders, offset: bool) -> Vec<Column> {
    let outputs = (1..=orders.na).map(Column::MinusOutput);
    let inputs = orders.nb.iter().zip(&orders.nk).enumerate();
    let inputs = inputs.flat_map(|(i, (&nb, &nk))| (nk..nk + nb).map(move |lag| Column::Input(i, lag)));
    outputs.chain(inputs).chain(offset.then_some(Column::One)).collect()
}

/// Why the regressor has not full rank: inputs that copy each other (X11), or an input that feeds back the
/// output, or an exact model of lower order (X08).
pub(super) fn not_exciting(rec: &Record, refusal: &RankDeficient, limits: &Limits) -> Error {
    copied_input(rec).unwrap_or_else(|| {
        let text = "the regressor has not full rank: an exact model of lower order, or plain feedback";
        Error::new("X08", text)
            .at(Place::column(rec.input_name(0)))
            .count(refusal.dependent.len())
            .measured(refusal.ratio, limits.X08)
            .remedy("ask for lower orders; with feedback move the set point or add a dither to u")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{dot, white};
    use crate::model::PolyModel;

    fn fitted(u: &[f64], nu: usize, y: &[f64], orders: &Orders, offset: bool) -> Fit {
        let rec = Record::uniform(u, nu, y, 1, 0.5).expect("fine");
        arx(&rec, orders, offset, &Limits::default()).expect("a fit")
    }

    #[test]
    fn noise_free_data_give_the_plant_and_its_offset_back() {
        let plant = PolyModel::arx(vec![1.0, -1.3, 0.42], vec![vec![0.5, 0.3], vec![-2.0]], vec![2, 0], 0.5);
        let u = white(400, 1);
        let y: Vec<f64> = plant.simulate(&u, 2).iter().map(|y| y + 583.451).collect();
        let orders = Orders::arx(2, vec![2, 1], vec![2, 0]);
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
        let fit = fitted(&u, 1, &y, &Orders::arx(0, vec![1], vec![0]), false);
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
        let fit = fitted(&u, 1, &y, &Orders::arx(0, vec![1], vec![0]), true);
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
        let fit = fitted(&u, 1, &y, &Orders::arx(1, vec![1], vec![1]), true);
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
        let orders = Orders::arx(1, vec![1], vec![1]);
        let (low, high) = (fitted(&u, 1, &y, &orders, true), fitted(&u, 1, &high, &orders, true));
        assert_eq!(low.theta, high.theta);
        assert!((high.offset - low.offset - 1048576.0).abs() < 1e-6);
    }
}
