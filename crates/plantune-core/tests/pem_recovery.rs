//! Output-error and ARMAX fits of simulated plants whose truth is known.

use plantune_core::batch::{Orders, PemOptions, Status, pem};
use plantune_core::linalg::normal_draws;
use plantune_core::model::PolyModel;
use plantune_core::poly::{divide, multiply, product};
use plantune_core::sim::Start;
use plantune_core::{Limits, Record};

const FREE: PemOptions = PemOptions { offset: true, start: Start::Estimate };

/// The even rows of draws that come in antithetic pairs are independent.
fn white(n: usize, seed: u64) -> Vec<f64> {
    normal_draws(&[0.0], &[1.0], 2 * n, seed).into_iter().step_by(2).flatten().collect()
}

fn plant() -> PolyModel {
    PolyModel {
        A: vec![1.0, -0.6],
        B: vec![vec![0.5, 0.2], vec![-0.3]],
        C: vec![1.0, 0.5, 0.2],
        D: vec![1.0, -0.4],
        F: vec![vec![1.0, -0.5], vec![1.0, -1.1, 0.4]],
        nk: vec![2, 1],
        Ts: 0.1,
    }
}

/// Every coefficient of the whole family, two inputs, three segments in mid-motion, an offset.
#[test]
fn noise_free_data_give_every_structure_back() {
    let u = white(2 * 900, 1);
    let one = || vec![1.0];
    let armax = PolyModel { D: one(), F: vec![one(), one()], ..plant() };
    let oe = PolyModel { A: one(), C: one(), D: one(), ..plant() };
    for (model, orders) in [
        (oe, Orders::oe(vec![2, 1], vec![1, 2], vec![2, 1])),
        (armax, Orders::armax(1, vec![2, 1], 2, vec![2, 1])),
    ] {
        let e = white(900, 2);
        let mut disturbance = multiply(&model.C, &e);
        divide(&product(&model.A, &model.D), &mut disturbance);
        // Noise small enough that C is seen and the rest exact.
        let y = model.simulate(&u, 2);
        let y: Vec<f64> = y.iter().zip(&disturbance).map(|(y, v)| y + 1e-6 * v + 583.451).collect();
        let mut rec = Record::uniform(&u, 2, &y, 1, 0.1).expect("fine");
        rec.starts = vec![0, 300, 500];
        let fit = pem(&rec, &orders, FREE, &Limits::default()).expect("a fit");
        assert_eq!(fit.status, Status::Converged);
        for ((name, ours), truth) in fit.names.iter().zip(&fit.theta).zip(model.theta()) {
            let tolerance = if name.starts_with('c') { 0.15 } else { 1e-5 };
            assert!((ours - truth).abs() < tolerance, "{name} {ours} {truth}");
        }
        assert!((fit.offset - 583.451).abs() < 1e-5, "{}", fit.offset);
    }
}
