//! The loop of IMC-PI with gain margin 3, `k e^(-L s) / s` with `k L = pi/6`, against its closed form:
//! `y' = k (1 - y(t - L))`, solved by the method of steps in exact arithmetic.

#![allow(non_snake_case)] // the field's letters

use plantune_core::model::Fopdt;
use plantune_core::sim::{ClosedLoopSettings, closed_loop};
use plantune_core::tune::{ImcTarget, Indices, imc_pi, indices};

/// Indices of the unit step over `30 L`; `K` scales u, `T` cancels, `L` scales time.
fn step(K: f64, T: f64, L: f64) -> Indices {
    let model = Fopdt { K, T, L };
    let pid = imc_pi(&model.into(), ImcTarget::GainMargin(3.0)).expect("settings").pid;
    let (r, zero) = (vec![1.0; 3000], vec![0.0; 3000]);
    let settings = ClosedLoopSettings {
        dt: 0.01 * L,
        r: &r,
        d: &zero,
        noise: &zero,
        offset: 0.0,
        u0: 0.0,
        fineness: 1000.0,
    };
    indices(&closed_loop(&model, &pid, &settings).expect("a sound loop"))
}

/// Nodes are so close that the straight line between them costs about 1e-6.
fn assert_close(name: &str, ours: f64, exact: f64) {
    assert!((ours / exact - 1.0).abs() < 5e-6, "{name}: {ours}, not {exact}");
}

#[test]
fn indices_are_those_of_the_closed_form() {
    for (K, T, L) in [(1.0, 1.0, 1.0), (-5.939, 0.1491, 0.1), (0.2, 900.0, 30.0), (3.0, 0.5, 4.0)] {
        let i = step(K, T, L);
        assert_close("overshoot", i.overshoot, 5.643415);
        assert_close("ise", i.ise, 1.6539867 * L);
        assert_close("iae", i.iae, 2.1378556 * L);
        assert_close("itae", i.itae, 2.8556536 * L * L);
        assert_close("settling", i.settling, 6.03673 * L);
    }
}

#[test]
fn the_gain_of_the_plant_scales_the_input_only() {
    let (one, ten) = (step(1.0, 2.0, 1.0), step(-10.0, 2.0, 1.0));
    assert_close("iae", ten.iae, one.iae);
    assert_close("control energy", ten.control_energy, one.control_energy / 100.0);
    assert_close("total variation", ten.total_variation, one.total_variation / 10.0);
}
