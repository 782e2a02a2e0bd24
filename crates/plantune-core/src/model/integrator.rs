//! Whether a polynomial model may be integrating or unstable, and what it knows of a plant that is (M01, M02).
//!
//! ```text
//! integrating:  |p(1)| <= 1.96 sd p(1)  for p = A or F_i,  and  |K| <= 1.96 sd K
//! slope:        p(q) = (1 - q^-1) r(q),   r(1) = -sum k p_k,   S = B(1) / (r(1) o(1) Ts),   o the other of A, F_i
//! unstable:     |z| > 1 of a pole that is not that integrator
//! ```
//!
//! `p(1)` is linear in the parameters. Where it may vanish, a gain has no bound; both conditions are asked, since a
//! pole that cancels a zero leaves `p(1)` open and the gain known. The slope, y/(u s), is known all the same: it is
//! what `K/T` of a long lag tends to.

use super::PolyModel;
use super::derived::{Covariance, Layout, Quantity, Root, counted};
use crate::note::{Note, Place, rounded};
use crate::poly::at_one;
use crate::stats::normal_quantile;

/// A pole as close to 1 as this is there but for rounding.
const ROUNDING: f64 = 1e-9;

/// The path from an input that cannot be told from an integrator.
pub struct Integrator {
    /// `p(1)` over its standard deviation; 0 where it vanishes.
    pub apart: f64,
    /// Whether `p` is `A`, else `F_i`.
    in_A: bool,
}

/// Whether input `i` acts through an integrator, as far as the parameters know; `gain` is its gain with sd.
pub fn integrator(m: &PolyModel, P: &Covariance, i: usize, gain: &Quantity) -> Option<Integrator> {
    let level = normal_quantile(0.95);
    if gain.value.is_finite() && gain.value.abs() > level * gain.sd {
        return None;
    }
    let layout = Layout::of(m);
    let open = |p: &[f64], first: usize| {
        let mut row = vec![0.0; layout.n];
        row[first..first + p.len() - 1].fill(1.0);
        let (value, sd) = (at_one(p).abs(), P.sd(&row));
        (p.len() > 1 && value <= level * sd + ROUNDING).then_some(if value > ROUNDING {
            value / sd
        } else {
            0.0
        })
    };
    let of_A = open(&m.A, layout.a).map(|apart| Integrator { apart, in_A: true });
    let of_F = open(&m.F[i], layout.f[i]).map(|apart| Integrator { apart, in_A: false });
    of_A.into_iter().chain(of_F).min_by(|a, b| a.apart.total_cmp(&b.apart))
}

/// `S` with its standard deviation.
pub fn slope(m: &PolyModel, P: &Covariance, i: usize, found: &Integrator) -> Quantity {
    let layout = Layout::of(m);
    let (a, f) = ((&m.A, layout.a), (&m.F[i], layout.f[i]));
    let ((p, at_p), (o, at_o)) = if found.in_A { (a, f) } else { (f, a) };
    let r = -p.iter().enumerate().map(|(k, c)| k as f64 * c).sum::<f64>();
    let per_b = 1.0 / (r * at_one(o) * m.Ts);
    let value = at_one(&m.B[i]) * per_b;
    let mut row = vec![0.0; layout.n];
    row[layout.b[i]..layout.b[i] + m.B[i].len()].fill(per_b);
    (1..p.len()).for_each(|k| row[at_p + k - 1] = value * k as f64 / r);
    (1..o.len()).for_each(|k| row[at_o + k - 1] = -value / at_one(o));
    Quantity { name: counted("slope", i, m.B.len()), value, sd: P.sd(&row) }
}

/// M01 for each input that may act through an integrator, M02 for poles outside the unit circle.
pub fn class_notes(m: &PolyModel, P: &Covariance, inputs: &[&str]) -> Vec<Note> {
    let found: Vec<Option<Integrator>> =
        (0..m.B.len()).map(|i| integrator(m, P, i, &super::derived::gain(m, P, i))).collect();
    let integrating = found.iter().zip(inputs).enumerate().filter_map(|(i, (found, input))| {
        let found = found.as_ref()?;
        let S = slope(m, P, i, found);
        let text = format!(
            "integrating, or nearly: a pole at 1 within its uncertainty, no steady-state gain; {input} moves y by {} ± {} per second",
            rounded(S.value),
            rounded(S.sd)
        );
        Some(
            Note::warning("M01", text)
                .at(Place::column(input))
                .measured(found.apart, normal_quantile(0.95))
                .remedy("tune it as integrating: estimate.process(rec, \"P0DI\"); or record longer"),
        )
    });
    let mut notes: Vec<Note> = integrating.collect();
    notes.extend(unstable(m, P, !notes.is_empty()));
    notes
}

/// M02: the pole farthest outside, but for the integrator.
fn unstable(m: &PolyModel, P: &Covariance, integrating: bool) -> Option<Note> {
    let level = normal_quantile(0.95);
    let sd = |root: &Root| {
        let (C, z) = (root.covariance(P), root.z);
        ((z.re * z.re * C[0] + 2.0 * z.re * z.im * C[1] + z.im * z.im * C[3]).max(0.0) / z.norm_sqr()).sqrt()
    };
    let outside = |root: &Root| {
        let near_one =
            root.z.im == 0.0 && root.z.re > 0.0 && root.z.norm() - level * sd(root) <= 1.0 + ROUNDING;
        root.z.norm() > 1.0 + ROUNDING && !(integrating && near_one)
    };
    let poles = super::derived::poles(&m.clone().into());
    let worst = poles.into_iter().filter(outside).max_by(|a, b| a.z.norm().total_cmp(&b.z.norm()))?;
    let (size, sd) = (worst.z.norm(), sd(&worst));
    let word = if size - level * sd > 1.0 { "unstable" } else { "perhaps unstable" };
    Some(
        Note::warning(
            "M02",
            format!("{word}: a pole of magnitude {size:.4} ± {} lies outside the unit circle", rounded(sd)),
        )
        .measured(size, 1.0)
        .remedy("judge it one step ahead, or in closed loop; rules for plants that settle do not apply"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn notes(a: f64, sd: f64) -> Vec<&'static str> {
        let m = PolyModel::arx(vec![1.0, -a], vec![vec![0.5]], vec![1], 2.0);
        let P = [sd * sd, 0.0, 0.0, 1e-4];
        class_notes(&m, &Covariance(&P), &["u"]).iter().map(|n| n.code).collect()
    }

    #[test]
    fn a_pole_is_an_integrator_within_its_uncertainty() {
        assert_eq!(notes(0.99, 0.01), ["M01"]);
        assert_eq!(notes(0.99, 0.004), [""; 0]);
        assert_eq!(notes(1.0, 0.0), ["M01"]);
        assert_eq!(notes(1.01, 0.01), ["M01"]);
        assert_eq!(notes(1.15, 0.01), ["M02"]);
        assert_eq!(notes(0.5, 0.1), [""; 0]);
    }

    /// `S = b / (a Ts)` for `1 - a q^-1`; of an integrator of 3 y/(u s) the slope is 3.
    #[test]
    fn the_slope_is_that_of_the_integrator() {
        let m = PolyModel::arx(vec![1.0, -1.0], vec![vec![6.0]], vec![1], 2.0);
        let P = Covariance(&[1e-4, 0.0, 0.0, 4e-4]);
        let found = Integrator { apart: 0.0, in_A: true };
        let S = slope(&m, &P, 0, &found);
        assert!((S.value - 3.0).abs() < 1e-12);
        // dS/db = 1/Ts, dS/da = S
        assert!((S.sd - (0.25 * 4e-4 + 9.0 * 1e-4f64).sqrt()).abs() < 1e-12);
    }
}
