//! The choice of the delay at work: a bank of first-order models behind the engine loop of source 001, 3.7.6c,
//! offset 583.451, set point 400 +- 50 switching at random; time until the right delay is chosen for good.

#![allow(non_snake_case)] // the field's letters

use plantune_core::adapt::{Counters, DelayChoice, Posterior, PosteriorSettings};
use plantune_core::linalg::normal_draws;
use plantune_core::model::{Fopdt, Pid};
use plantune_core::recursive::{Bank, BankSettings};
use plantune_core::signal::prbs;
use plantune_core::sim::{LiveLoop, LiveSettings};

const TS: f64 = 0.02;
const N: usize = 500;
const NK: (usize, usize) = (3, 9);
const RIGHT: usize = 3; // nk = 6: the hold counts as one sample

/// Seconds from the first move of the set point until the choice is right for good; infinite if it never is.
fn time(choice: &mut DelayChoice, hold: usize, sd: f64, seed: u64) -> f64 {
    let plant = Fopdt { K: -5.939, T: 0.1491, L: 0.1 };
    let (pid, O) = (Pid::pi(-0.018, 0.018 / 0.3385), 583.451);
    let at_rest = LiveSettings { u0: (400.0 - O) / plant.K, ..LiveSettings::new(TS) };
    let mut live = LiveLoop::new(&plant, O, &pid, at_rest).expect("a loop");
    let settings = BankSettings { errors: true, ..BankSettings::default() };
    let mut bank = Bank::new(1, NK.0, NK.1, &settings).expect("a bank");
    let m = NK.1 - NK.0 + 1;
    let (mut eps, mut q) = (vec![0.0; m], vec![0.0; m]);
    let r = prbs(N, hold, 10, seed).expect("a sequence");
    let noise = normal_draws(&[0.0], &[1.0], N, seed);
    let mut right_from = None;
    for (k, (r, noise)) in r.iter().zip(&noise).enumerate() {
        let (u, y) = live.step(400.0 + 50.0 * r, sd * noise[0]).expect("a sample");
        bank.step(&[u], &[y]).expect("a sample");
        (0..m).for_each(|i| (eps[i], q[i]) = (bank.eps(0, i), bank.q(0, i)));
        right_from = match choice.step(&eps, &q) {
            RIGHT => right_from.or(Some(k)),
            _ => None,
        };
    }
    right_from.map_or(f64::INFINITY, |k| k as f64 * TS)
}

/// Median and 90 % quantile over 40 seeds, holds of 0.2 to 0.5 s.
fn times(make: impl Fn() -> DelayChoice, sd: f64) -> (f64, f64) {
    let of = |seed: u64| time(&mut make(), 10 + 5 * (seed as usize % 4), sd, seed);
    let mut all: Vec<f64> = (0..40).map(of).collect();
    all.sort_by(f64::total_cmp);
    (0.5 * (all[19] + all[20]), all[35])
}

fn posterior() -> DelayChoice {
    DelayChoice::Posterior(Posterior::new(7, 0, PosteriorSettings::default()).expect("sound"))
}

fn counters() -> DelayChoice {
    DelayChoice::Counters(Counters::new(7, 0, 50, 10).expect("sound"))
}

/// METHODS 1.5: 1.1 s without noise; with noise of variance 1.5 a median of 2.0 s, 7.8 s for 90 %.
#[test]
fn the_posterior_finds_the_delay_within_the_known_times() {
    let (median, most) = times(posterior, 0.0);
    assert!(median < 0.5 && most < 1.1, "{median} {most}");
    let (median, most) = times(posterior, 1.5f64.sqrt());
    assert!(median < 2.1 && most < 4.0, "{median} {most}");
}

#[test]
fn the_counters_find_it_through_their_neighbours() {
    let (median, most) = times(counters, 0.0);
    assert!(median < 1.1 && most < 2.0, "{median} {most}");
    let (median, most) = times(counters, 1.5f64.sqrt());
    assert!(median < 2.1 && most < 6.0, "{median} {most}");
}
