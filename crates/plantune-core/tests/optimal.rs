//! The optimum on random plants: always stable, always within its limits, never a refusal.

#![allow(non_snake_case)]

use plantune_core::model::{Filter, Fopdt, Model};
use plantune_core::tune::{Answer, Robustness, Terms, Wish, margins, optimise};

/// Uniform numbers from an explicit seed.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn of<T: Copy>(&mut self, choice: &[T]) -> T {
        choice[(self.between(0.0, choice.len() as f64) as usize).min(choice.len() - 1)]
    }
}

fn plants(count: usize, seed: u64) {
    let mut random = Random(seed);
    for case in 0..count {
        let K = 10f64.powf(random.between(-3.0, 3.0)) * random.of(&[-1.0, 1.0]);
        let T = 10f64.powf(random.between(-3.0, 3.0));
        let L = T * 10f64.powf(random.between(-2.0, 2.0));
        let model = Model::from(Fopdt { K, T, L });
        let Ms = random.between(1.2, 2.2);
        let Mt = random.of(&[f64::INFINITY, 1.3]);
        let wish = Wish {
            limits: Robustness { Ms, Mt, noise_gain: f64::INFINITY },
            answer: random.of(&[Answer::Load, Answer::SetPoint]),
            terms: random.of(&[Terms::Pi, Terms::Pi, Terms::Pi, Terms::Pid]),
            filter: Filter::D1,
            Ts: None,
            share: 1.0,
        };
        let found = optimise(std::slice::from_ref(&model), &wish);
        assert!(found.is_ok(), "case {case}: {found:?} on {model:?} {wish:?}");
        let found = found.expect("checked");
        let m = margins(&model, &found.pid).expect("margins");
        assert!(m.stable && m.Ms <= Ms && m.Mt <= Mt, "case {case}: {m:?} {found:?} on {model:?}");
        assert!(found.cost.is_finite() && found.cost > 0.0, "case {case}: {found:?}");
    }
}

#[test]
fn random_plants_are_tuned_within_their_limits() {
    plants(150, 1);
}

/// The claim of the documentation, counted: `make test-all`.
#[test]
#[ignore = "about ten minutes"]
fn ten_thousand_random_plants_are_tuned_within_their_limits() {
    plants(10_000, 2);
}
