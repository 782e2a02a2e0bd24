//! How long a step response takes to show all that a model does.
//!
//! ```text
//! L + 8 / min |Re p|   over the poles that decay; beside an integrator alone as long again as its delay
//! ```

use super::Model;

/// Time constants after which a decay is over: `e^-8` is 0.03 %.
const DECAYS: f64 = 8.0;

/// Seconds from a step until its answer is seen whole, at least `Ts` of a polynomial model.
pub fn horizon(model: &Model) -> f64 {
    let (rates, delay, least): (Vec<f64>, f64, f64) = match model {
        Model::Poly(m) => {
            let rate = |(re, im): (f64, f64)| -re.hypot(im).ln() / m.Ts;
            (model.poles().into_iter().map(rate).collect(), m.nk[0] as f64 * m.Ts, 10.0 * m.Ts)
        }
        _ => {
            let delay = model.transfer().map_or(0.0, |G| G.L);
            (model.poles().iter().map(|p| -p.0).collect(), delay, 0.0)
        }
    };
    let slowest = rates.into_iter().map(f64::abs).filter(|r| *r > 1e-9).fold(f64::INFINITY, f64::min);
    let decay = if slowest.is_finite() { DECAYS / slowest } else { 4.0 * delay };
    let whole = (delay + decay).max(least);
    if whole > 0.0 { whole } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Fopdt, PolyModel};

    #[test]
    fn the_slowest_decay_rules() {
        assert!((horizon(&Fopdt { K: 2.0, T: 5.0, L: 3.0 }.into()) - 43.0).abs() < 1e-12);
        let sampled = PolyModel::arx(vec![1.0, -(-0.1f64).exp()], vec![vec![1.0]], vec![2], 0.5);
        assert!((horizon(&Model::Poly(sampled)) - (1.0 + 8.0 * 5.0)).abs() < 1e-9);
    }
}
