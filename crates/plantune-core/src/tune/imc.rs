//! Internal model control: the controller that inverts what of a model can be inverted.
//!
//! ```text
//! G = G_- G_+                                                          (3.6-11)
//! C_imc = C_F / G_-,  C_F = 1 / (tau_c s + 1)^n                         (3.6-6), (3.6-9), (3.6-12)
//! C = C_imc / (1 - C_imc G) = C_F / (G_- (1 - C_F G_+))                 (3.6-14), (3.6-15)
//! loop: y / r = C_F G_+                                                 (3.6-13)
//! ```
//!
//! `G_+` holds the zeros to the right, `1 - s/z` each, and the dead time: exact, or as `1 - L s` (3.6-3), or as
//! the zero of `(1 - L s/2) / (1 + L s/2)`, whose lag `G_-` keeps (3.6-20). With `mirror` the zeros stand over
//! their mirror images, `(1 - s/z) / (1 + s/z)`, the least ISE for steps. Source 001, 3.6.1 to 3.6.5.
//!
//! Of an integrating plant a filter of gain 1 would leave a load standing; there the filter is
//! `C_F = (f s + 1) / (tau_c s + 1)^n` with `f = n tau_c - G_+'(0)`, so that `1 - C_F G_+` has two zeros at 0.
//! Mirror and integrator: M. Morari and E. Zafiriou, Robust Process Control (1989), chapters 4 and 5.

use super::half_rule::{sampled, unstable};
use crate::error::{Error, Result};
use crate::linalg::Complex;
use crate::model::{Delay, Model, TransferFunction};
use crate::poly::product;

/// The parts of a design.
#[derive(Clone, Debug, PartialEq)]
pub struct Imc {
    /// `G_-`.
    pub invertible: TransferFunction,
    /// `G_+`, of gain 1.
    pub non_invertible: TransferFunction,
    /// `C_F`.
    pub filter: TransferFunction,
    /// `C_imc`.
    pub controller: TransferFunction,
    /// `C`, where it is rational.
    pub classic: Option<TransferFunction>,
    /// `y / r` on the model.
    pub closed_loop: TransferFunction,
    /// `n`.
    pub order: usize,
}

/// The design for a model; without an order the least that makes `C_imc` proper.
pub fn imc(model: &Model, tau_c: f64, order: Option<usize>, delay: Delay, mirror: bool) -> Result<Imc> {
    if !(tau_c > 0.0 && tau_c.is_finite()) {
        return Err(Error::argument("tau_c", tau_c, "positive"));
    }
    if order == Some(0) {
        return Err(Error::argument("order", 0, "1 or more"));
    }
    let G = check_stable(model)?;
    let integrating = G.den.last() == Some(&0.0);
    let (invertible, non_invertible) = split(&G, delay, mirror);
    let degree = |p: &[f64]| p.len() - 1;
    let least = degree(&invertible.den) - degree(&invertible.num) + usize::from(integrating);
    let order = order.unwrap_or(least.max(1));
    let filter = TransferFunction {
        num: if integrating { vec![order as f64 * tau_c - slope(&non_invertible), 1.0] } else { vec![1.0] },
        den: (0..order).fold(vec![1.0], |p, _| product(&p, &[tau_c, 1.0])),
        L: 0.0,
    };
    let controller = TransferFunction {
        num: product(&filter.num, &invertible.den),
        den: product(&filter.den, &invertible.num),
        L: 0.0,
    };
    let classic = (non_invertible.L == 0.0).then(|| classic(&invertible, &non_invertible, &filter));
    let closed_loop = filter.times(&non_invertible);
    Ok(Imc { invertible, non_invertible, filter, controller, classic, closed_loop, order })
}

/// `C(j w)` of a controller on its model, the dead time of the model as it is there.
pub fn classic_freqresp(controller: &TransferFunction, model: &Model, w: f64) -> Complex<f64> {
    let C = controller.freqresp(w);
    C / (1.0 - C * model.freqresp(0, w))
}

/// The model as a transfer function; refuses an unstable one (M02), two integrators (M01), no plant (M12).
fn check_stable(model: &Model) -> Result<TransferFunction> {
    model.check()?;
    let G = model.transfer().ok_or_else(sampled)?;
    let poles = G.poles();
    if let Some((re, _)) = poles.iter().find(|(re, im)| *re > 0.0 || *re == 0.0 && *im != 0.0) {
        return Err(unstable(*re));
    }
    if poles.iter().filter(|pole| **pole == (0.0, 0.0)).count() > 1 {
        return Err(Error::new("M01", "the plant has two integrators, IMC here serves one")
            .remedy("close an inner loop on its rate first, and control the outer one"));
    }
    if G.num.last() == Some(&0.0) {
        return Err(Error::new("M12", "the plant has a zero at 0: no input holds it at a set point")
            .remedy("check the model"));
    }
    Ok(G.into_owned())
}

/// `G_-` and `G_+`.
fn split(G: &TransferFunction, delay: Delay, mirror: bool) -> (TransferFunction, TransferFunction) {
    let first = G.num.iter().position(|&c| c != 0.0).unwrap_or(0);
    let (mut num, mut den) = (G.num[first..].to_vec(), G.den.clone());
    let (mut plus, mut image) = (vec![1.0], vec![1.0]);
    for (re, im) in G.zeros() {
        if re < 0.0 || im < 0.0 {
            continue;
        }
        // 1 - s/z, or both of a pair at once.
        let factor = if im == 0.0 {
            vec![-1.0 / re, 1.0]
        } else {
            let size2 = re * re + im * im;
            vec![1.0 / size2, -2.0 * re / size2, 1.0]
        };
        num = deflated(&num, &factor);
        plus = product(&plus, &factor);
        image = product(&image, &mirrored(&factor));
    }
    if mirror {
        num = product(&num, &image);
    } else {
        image = vec![1.0];
    }
    let (half, whole) = ([0.5 * G.L, 1.0], [G.L, 1.0]);
    match (delay, mirror) {
        (Delay::Exact, _) => {}
        _ if G.L == 0.0 => {}
        (Delay::Taylor, true) => {
            (num, plus) = (product(&num, &whole), product(&plus, &mirrored(&whole)));
            image = product(&image, &whole);
        }
        (Delay::Taylor, false) => plus = product(&plus, &mirrored(&whole)),
        (Delay::Pade, true) => (plus, image) = (product(&plus, &mirrored(&half)), product(&image, &half)),
        (Delay::Pade, false) => (plus, den) = (product(&plus, &mirrored(&half)), product(&den, &half)),
    }
    let L = if delay == Delay::Exact { G.L } else { 0.0 };
    (TransferFunction { num, den, L: 0.0 }, TransferFunction { num: plus, den: image, L })
}

/// `C_F / (G_- (1 - C_F G_+))` for rational parts, the poles at 0 exact and common ones cancelled.
fn classic(minus: &TransferFunction, plus: &TransferFunction, filter: &TransferFunction) -> TransferFunction {
    let open = product(&filter.num, &plus.num).into_iter().map(|c| -c).collect::<Vec<_>>();
    let mut rest = sum(&product(&filter.den, &plus.den), &open);
    let mut num = product(&product(&filter.num, &minus.den), &plus.den);
    // Both have gain 1 at 0; of an integrating plant the slopes are equal too.
    let integrating = minus.den.last() == Some(&0.0);
    let at_zero = 1 + usize::from(integrating);
    let end = rest.len();
    rest[end - at_zero..].iter_mut().for_each(|c| *c = 0.0);
    if integrating {
        rest.pop();
        num.pop();
    }
    TransferFunction { num, den: product(&minus.num, &rest), L: 0.0 }
}

/// `G_+'(0)`.
fn slope(plus: &TransferFunction) -> f64 {
    let linear = |p: &[f64]| if p.len() > 1 { p[p.len() - 2] } else { 0.0 };
    linear(&plus.num) - linear(&plus.den) - plus.L
}

/// `p(-s)`.
fn mirrored(p: &[f64]) -> Vec<f64> {
    let odd = |k: usize| (p.len() - 1 - k) % 2 == 1;
    p.iter().enumerate().map(|(k, &c)| if odd(k) { -c } else { c }).collect()
}

/// `a + b`, both in descending powers.
fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    let n = a.len().max(b.len());
    let at = |p: &[f64], k: usize| (k + p.len()).checked_sub(n).map_or(0.0, |k| p[k]);
    (0..n).map(|k| at(a, k) + at(b, k)).collect()
}

/// The quotient of `p` and a factor of it.
fn deflated(p: &[f64], factor: &[f64]) -> Vec<f64> {
    let n = p.len() + 1 - factor.len();
    let mut rest = p.to_vec();
    for k in 0..n {
        rest[k] /= factor[0];
        for j in 1..factor.len() {
            rest[k + j] -= rest[k] * factor[j];
        }
    }
    rest.truncate(n);
    rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Delay, Fopdt, ProcessModel};

    const PLANT: Fopdt = Fopdt { K: -2.0, T: 5.0, L: 0.8 };

    fn close(ours: &[f64], exact: &[f64]) {
        assert_eq!(ours.len(), exact.len(), "{ours:?} {exact:?}");
        let scale = exact.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
        assert!(ours.iter().zip(exact).all(|(a, b)| (a - b).abs() < 1e-12 * scale), "{ours:?} {exact:?}");
    }

    /// Source 001, (3.6-17) as corrected: `(T s + 1) / (K (tau_c + L) s)`; (3.6-21) beside it.
    #[test]
    fn the_classic_controllers_are_pi_and_pid() {
        let (Fopdt { K, T, L }, tau_c) = (PLANT, 0.3);
        let of = |delay| imc(&PLANT.into(), tau_c, Some(1), delay, false).expect("a design");
        let pi = of(Delay::Taylor).classic.expect("rational");
        close(&pi.num, &[T, 1.0]);
        close(&pi.den, &[K * (tau_c + L), 0.0]);
        let pid = of(Delay::Pade).classic.expect("rational");
        close(&pid.num, &[0.5 * T * L, T + 0.5 * L, 1.0]);
        close(&pid.den, &[K * (tau_c + 0.5 * L), 0.0]);
        assert_eq!(of(Delay::Exact).classic, None);
    }

    /// `Kp = (2 tau_c + L) / (K (tau_c + L)^2)`, `Ti = 2 tau_c + L`.
    #[test]
    fn of_an_integrator_the_classic_controller_is_lambda_tuning() {
        let (K, L, tau_c) = (0.4, 1.5, 2.0);
        let plant = ProcessModel { K, T: vec![], L, Tz: 0.0, zeta: None, integrating: true };
        let found = imc(&plant.into(), tau_c, None, Delay::Taylor, false).expect("a design");
        let C = found.classic.expect("rational");
        close(&C.num, &[2.0 * tau_c + L, 1.0]);
        close(&C.den, &[K * (tau_c + L) * (tau_c + L), 0.0, 0.0][..2]);
        assert_eq!(found.order, 2);
    }
}
