//! First order plus dead time, `G(s) = K e^(-L s) / (T s + 1)`, with any real delay.
//!
//! With a zero-order hold and `L = m Ts + f`, `0 <= f < Ts`, sampling is exact:
//!
//! ```text
//! y(t) = a y(t-1) + b1 u(t-m-1) + b2 u(t-m-2)
//! a  = exp(-Ts/T)
//! b1 = K (1 - exp(-(Ts-f)/T))
//! b2 = K (exp(-(Ts-f)/T) - a)
//! ```
//!
//! Source 001, (3.4-1) and (3.5-46) for `f = 0`; the fraction by splitting the hold interval.

use super::{PolyModel, Response};
use crate::linalg::Complex;

/// `K e^(-L s) / (T s + 1)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fopdt {
    /// Static gain, y/u.
    pub K: f64,
    /// Time constant, s.
    pub T: f64,
    /// Dead time, s.
    pub L: f64,
}

/// A delay as whole samples and a rest, `L = m Ts + f` with `0 <= f < Ts`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fraction {
    /// Whole samples.
    pub m: usize,
    /// The rest, s.
    pub f: f64,
}

impl Fraction {
    /// Splits `L`; a rest within rounding of a whole sample counts as one.
    pub fn of(L: f64, Ts: f64) -> Self {
        let samples = L / Ts;
        let nearest = samples.round();
        if (samples - nearest).abs() < 1e-9 * nearest.max(1.0) {
            return Fraction { m: nearest as usize, f: 0.0 };
        }
        let m = samples.floor();
        Fraction { m: m as usize, f: L - m * Ts }
    }
}

impl Fopdt {
    /// `a, b1, b2` and the whole samples `m` of the exact sampled form.
    pub fn sampled(&self, Ts: f64) -> (f64, f64, f64, usize) {
        let Fraction { m, f } = Fraction::of(self.L, Ts);
        let a = (-Ts / self.T).exp();
        let b1 = -self.K * (-(Ts - f) / self.T).exp_m1();
        let b2 = -self.K * (-(Ts - f) / self.T).exp() * (-f / self.T).exp_m1();
        (a, b1, b2, m)
    }

    /// The sampled form behind a zero-order hold.
    pub fn held(&self, Ts: f64) -> PolyModel {
        let (a, b1, b2, m) = self.sampled(Ts);
        let B = if b2 == 0.0 { vec![b1] } else { vec![b1, b2] };
        PolyModel::arx(vec![1.0, -a], vec![B], vec![m + 1], Ts)
    }

    /// Rows until all inputs of the recursion lie in the record.
    pub fn history(&self, Ts: f64) -> usize {
        Fraction::of(self.L, Ts).m + 1
    }

    /// Output from `y(0) = x0`; the input before row 0 is zero.
    pub fn simulate(&self, u: &[f64], Ts: f64, x0: f64) -> Vec<f64> {
        let (a, b1, b2, m) = self.sampled(Ts);
        let mut y = Vec::with_capacity(u.len());
        let mut state = x0;
        for k in 0..u.len() {
            if k > 0 {
                let newer = if k > m { u[k - m - 1] } else { 0.0 };
                let older = if k > m + 1 { u[k - m - 2] } else { 0.0 };
                state = a * state + b1 * newer + b2 * older;
            }
            y.push(state);
        }
        y
    }

    /// Response over a segment from row [`Fopdt::history`] on, where the state is unknown.
    pub fn simulation(&self, u: &[f64], Ts: f64) -> Response {
        let (a, b1, b2, m) = self.sampled(Ts);
        let rows = u.len().saturating_sub(m + 1);
        let (mut forced, mut free) = (Vec::with_capacity(rows), Vec::with_capacity(rows));
        let (mut state, mut decay) = (0.0, 1.0);
        for k in 0..rows {
            if k > 0 {
                state = a * state + b1 * u[k] + b2 * u[k - 1];
                decay *= a;
            }
            forced.push(state);
            free.push(decay);
        }
        Response { forced, free: vec![free] }
    }

    /// `G(j w)`.
    pub fn freqresp(&self, w: f64) -> Complex<f64> {
        Complex::from_polar(self.K, -w * self.L) / Complex::new(1.0, w * self.T)
    }

    /// Response at time `t` to a unit step at time 0.
    pub fn step_response(&self, t: f64) -> f64 {
        if t <= self.L { 0.0 } else { -self.K * (-(t - self.L) / self.T).exp_m1() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A staircase input answered by the superposition of analytic step responses.
    #[test]
    fn sampling_is_exact_for_any_delay() {
        let Ts = 0.02;
        let u: Vec<f64> = (0..200).map(|k| f64::from(k / 7 * 37 % 11)).collect();
        for L in [0.0, 0.013, 0.1, 0.107] {
            let model = Fopdt { K: -5.939, T: 0.1491, L };
            let y = model.simulate(&u, Ts, 0.0);
            for (k, ours) in y.iter().enumerate() {
                let exact: f64 = (0..=k)
                    .map(|j| {
                        let jump = u[j] - if j > 0 { u[j - 1] } else { 0.0 };
                        jump * model.step_response((k - j) as f64 * Ts)
                    })
                    .sum();
                assert!((ours - exact).abs() < 1e-10, "L {L} row {k}: {ours} {exact}");
            }
        }
    }
}
