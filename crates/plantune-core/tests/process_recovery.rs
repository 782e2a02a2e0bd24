//! The process fit on data whose truth is known, made by superposition of analytic step responses.

#![allow(non_snake_case)] // the field's letters

use plantune_core::batch::{Fit, ProcessOptions, Status, p1d};
use plantune_core::model::Fopdt;
use plantune_core::signal::prbs;
use plantune_core::{Limits, Record};

const TS: f64 = 0.02;

/// `O + sum_j (u_j - u_(j-1)) S(t - t_j)`, the input held at `u_0` before row 0.
fn response(model: &Fopdt, u: &[f64], offset: f64) -> Vec<f64> {
    let moves: Vec<(usize, f64)> =
        (1..u.len()).map(|j| (j, u[j] - u[j - 1])).filter(|(_, jump)| *jump != 0.0).collect();
    (0..u.len())
        .map(|k| {
            let since = moves.iter().take_while(|(j, _)| *j <= k);
            let sum: f64 = since.map(|(j, jump)| jump * model.step_response((k - j) as f64 * TS)).sum();
            offset + model.K * u[0] + sum
        })
        .collect()
}

fn fitted(u: &[f64], y: &[f64], offset: bool) -> Fit {
    let rec = Record::uniform(u, 1, y, 1, TS).expect("fine");
    p1d(&rec, &ProcessOptions { offset, ..ProcessOptions::default() }, &Limits::default()).expect("a fit")
}

fn assert_is(fit: &Fit, truth: [f64; 3], share: f64) {
    for ((ours, truth), name) in fit.theta.iter().zip(truth).zip(["K", "T", "L"]) {
        assert!((ours - truth).abs() < share * truth.abs().max(TS), "{name}: {ours}, not {truth}");
    }
}

#[test]
fn noise_free_data_give_the_plant_back_for_any_delay() {
    let u: Vec<f64> = prbs(1500, 15, 9, 3).expect("a sequence").iter().map(|u| 30.0 + 8.0 * u).collect();
    for L in [0.0, 0.0061, 0.1, 0.107, 0.39] {
        let model = Fopdt { K: -5.939, T: 0.1491, L };
        let fit = fitted(&u, &response(&model, &u, 583.451), true);
        assert_is(&fit, [model.K, model.T, L], 1e-6);
        assert!((fit.offset - 583.451).abs() < 1e-4, "L {L}: {}", fit.offset);
        assert_eq!(fit.status, Status::Converged, "L {L}");
    }
}

#[test]
fn one_step_from_rest_is_enough() {
    let u: Vec<f64> = (0..400).map(|k| if k < 50 { 2.0 } else { 3.0 }).collect();
    let model = Fopdt { K: 4.0, T: 0.8, L: 0.213 };
    assert_is(&fitted(&u, &response(&model, &u, -1.0), true), [4.0, 0.8, 0.213], 1e-6);
}

#[test]
fn units_of_the_input_scale_the_gain_only() {
    let u: Vec<f64> = prbs(800, 10, 8, 5).expect("a sequence");
    let y = response(&Fopdt { K: 2.0, T: 0.3, L: 0.05 }, &u, 1.0);
    let twice: Vec<f64> = u.iter().map(|u| 2.0 * u).collect();
    let (one, two) = (fitted(&u, &y, true), fitted(&twice, &y, true));
    assert_eq!((two.theta[0], two.theta[1], two.theta[2]), (one.theta[0] / 2.0, one.theta[1], one.theta[2]));
}

#[test]
fn the_start_of_a_record_in_motion_is_estimated() {
    let u = prbs(1200, 10, 8, 5).expect("a sequence");
    let model = Fopdt { K: 2.0, T: 0.6, L: 0.07 };
    let y = response(&model, &u, 10.0);
    assert_is(&fitted(&u[307..], &y[307..], true), [2.0, 0.6, 0.07], 1e-6);
}
