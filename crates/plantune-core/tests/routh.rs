//! The conditions (3.4-19) to (3.4-27) of source 001 against the roots of the closed loop, 20 000 random loops.

#![allow(non_snake_case)]

use plantune_core::model::{Delay, Fopdt, Pid};
use plantune_core::poly::{is_hurwitz, roots};
use plantune_core::tune::closed_loop_transfers;

/// Uniform numbers in (0, 1), from an explicit seed.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[test]
fn routh_hurwitz_agrees_with_the_roots() {
    let mut random = Random(1);
    let mut stable = 0;
    for case in 0..20_000 {
        let delay = if case % 2 == 0 { Delay::Taylor } else { Delay::Pade };
        let (T, L) = (10f64.powf(random.between(-2.0, 2.0)), 10f64.powf(random.between(-2.0, 2.0)));
        let K = 10f64.powf(random.between(-2.0, 2.0)) * random.between(-1.0, 1.0).signum();
        let Kp = random.between(0.0, 2.2) * (T + 0.5 * L) / (K * L);
        let Ti = (T + L) * 10f64.powf(random.between(-1.3, 1.0));
        let Kd = if delay == Delay::Pade { random.between(-1.0, 1.1).max(0.0) * T / K } else { 0.0 };
        let pid = Pid { Td: Kd / Kp, ..Pid::pi(Kp, Ti) };
        let closed = closed_loop_transfers(&Fopdt { K, T, L }.into(), &pid, delay).expect("a loop").y_r.den;

        let (k, i, d) = (K * Kp, K * Kp / Ti, K * Kd); // the products: for either sign of K
        let conditions = match delay {
            Delay::Taylor => T - k * L > 0.0 && i > 0.0 && k - i * L + 1.0 > 0.0,
            _ => {
                let (a0, a1) = (T * L - d * L, L + 2.0 * T + 2.0 * d - k * L);
                let (a2, a3) = (2.0 + 2.0 * k - i * L, 2.0 * i);
                [a0, a1, a2, a3].iter().all(|&a| a > 0.0) && a1 * a2 > a3 * a0
            }
        };
        let real: Vec<f64> = roots(&closed).iter().map(|r| r.0).collect();
        let largest = roots(&closed).iter().map(|r| r.0.hypot(r.1)).fold(0.0, f64::max);
        if real.iter().any(|re| re.abs() < 1e-9 * largest) {
            continue; // on the edge within rounding
        }
        let by_roots = real.iter().all(|&re| re < 0.0);
        assert_eq!(is_hurwitz(&closed), by_roots, "{K} {T} {L} {pid:?} {delay:?}");
        assert_eq!(conditions, by_roots, "{K} {T} {L} {pid:?} {delay:?}");
        stable += usize::from(by_roots);
    }
    assert!((4_000..16_000).contains(&stable), "{stable}");
}
