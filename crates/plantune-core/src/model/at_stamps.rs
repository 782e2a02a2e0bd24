//! One or two lags behind a dead time, exactly from stamp to stamp, however these lie.
//!
//! ```text
//! T1 x1' = u(t - L) - x1,   T2 x2' = x1 - x2,   u held from its stamp to the next
//! over d seconds without a move of u(t - L):   e = exp(-d/T)
//! x1 <- u + e1 (x1 - u)
//! x2 <- u + e2 (x2 - u) + c (x1 - u),   c = T1 (e1 - e2)/(T1 - T2) = e2 (d/T2) (e^z - 1)/z,  z = d/T2 - d/T1
//! d x1/dL: a move du of u that arrives takes du/T1 from it; between, the same transition without an input
//! ```
//!
//! The breaks are all stamps and all stamps shifted by `L`. No matrix exponential is needed, and equal time
//! constants are no special case. Van Loan 1978 is the general form; METHODS 2.2.

/// Unit-gain lags and a dead time, in the unit of the stamps.
#[derive(Clone, Copy, Debug)]
pub struct AtStamps<'a> {
    /// Time constants, one or two.
    pub T: &'a [f64],
    /// Dead time.
    pub L: f64,
}

/// States: of one lag the first alone.
pub type States = [f64; 2];

/// Signals of one segment.
#[derive(Clone, Copy, Debug)]
pub struct Stamped<'a> {
    /// Stamps of `u` and of `y`, ascending.
    pub t: &'a [f64],
    /// Input from each stamp on; before the first as at it.
    pub u: &'a [f64],
    /// Row at which a response begins.
    pub first: usize,
}

impl AtStamps<'_> {
    /// Number of states.
    pub fn n(&self) -> usize {
        self.T.len()
    }

    /// First row whose delayed input lies in the segment.
    pub fn history(&self, t: &[f64]) -> usize {
        t.partition_point(|t_k| *t_k < t[0] + self.L)
    }

    /// Output from the states `x` at row `first` on.
    pub fn response(&self, on: Stamped<'_>, x: States) -> Vec<f64> {
        let mut column = Vec::with_capacity(on.t.len() - on.first);
        self.walk(on, x, 1.0, |_, _| {}, |x| column.push(x[self.n() - 1]));
        column
    }

    /// The same without an input.
    pub fn decay(&self, t: &[f64], x: States) -> Vec<f64> {
        let (mut x, last) = (x, self.n() - 1);
        let mut column = vec![x[last]];
        for pair in t.windows(2) {
            self.advance(&mut x, 0.0, pair[1] - pair[0]);
            column.push(x[last]);
        }
        column
    }

    /// Derivative of the response by the dead time.
    pub fn by_delay(&self, on: Stamped<'_>) -> Vec<f64> {
        let mut column = Vec::with_capacity(on.t.len() - on.first);
        // The sensitivity moves like the states, but no input drives it: only its jumps.
        let arrive = |x: &mut States, du: f64| x[0] -= du / self.T[0];
        self.walk(on, [0.0; 2], 0.0, arrive, |x| column.push(x[self.n() - 1]));
        column
    }

    /// From stamp to stamp; `drive` is what the input counts, `arrive` gets each move of it as it arrives.
    fn walk(
        &self,
        on: Stamped<'_>,
        mut x: States,
        drive: f64,
        mut arrive: impl FnMut(&mut States, f64),
        mut take: impl FnMut(&States),
    ) {
        let Stamped { t, u, first } = on;
        let mut now = t[first];
        // The last stamp whose input has arrived; the one before the first counts as the first.
        let mut held = t.partition_point(|t_j| t_j + self.L <= now).saturating_sub(1);
        take(&x);
        for &next in &t[first + 1..] {
            while held + 1 < t.len() && t[held + 1] + self.L <= next {
                let at = t[held + 1] + self.L;
                self.advance(&mut x, drive * u[held], at - now);
                arrive(&mut x, u[held + 1] - u[held]);
                (now, held) = (at, held + 1);
            }
            self.advance(&mut x, drive * u[held], next - now);
            now = next;
            take(&x);
        }
    }

    /// The exact transition over `d` under a constant input.
    fn advance(&self, x: &mut States, u: f64, d: f64) {
        let off = x[0] - u;
        let e1 = (-d / self.T[0]).exp();
        if let Some(T2) = self.T.get(1) {
            let (e2, z) = ((-d / T2).exp(), d / T2 - d / self.T[0]);
            let c = if z.abs() < 1e-300 {
                e2 * d / T2
            } else if z > 500.0 {
                self.T[0] * (e1 - e2) / (self.T[0] - T2)
            } else {
                e2 * (d / T2) * (z.exp_m1() / z)
            };
            x[1] = u + e2 * (x[1] - u) + c * off;
        }
        x[0] = u + e1 * off;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Fopdt;

    #[test]
    fn uniform_stamps_give_the_sampled_first_order() {
        let u: Vec<f64> = (0..200).map(|k| f64::from(k / 7 * 37 % 11)).collect();
        let t: Vec<f64> = (0..200).map(|k| 0.5 * f64::from(k)).collect();
        for L in [0.0, 1.7, 2.5] {
            let plant = Fopdt { K: 1.0, T: 3.0, L };
            let lags = AtStamps { T: &[3.0], L };
            let first = plant.history(0.5);
            let ours = lags.response(Stamped { t: &t, u: &u, first }, [0.0; 2]);
            let theirs = plant.simulation(&u, 0.5).forced;
            assert!(ours.iter().zip(&theirs).all(|(a, b)| (a - b).abs() < 1e-12), "{L}");
        }
    }

    #[test]
    fn two_lags_answer_a_step_in_closed_form_equal_ones_too() {
        let t: Vec<f64> = (0..80).map(|k| 0.1 * f64::from(k) * (1.0 + 0.05 * f64::from(k))).collect();
        let u: Vec<f64> = t.iter().map(|t| f64::from(u8::from(*t > 1.0))).collect();
        let at = t.iter().find(|t| **t > 1.0).copied().unwrap_or(0.0);
        for [T1, T2] in [[5.0, 3.0], [3.0, 5.0], [4.0, 4.0]] {
            let y = AtStamps { T: &[T1, T2], L: 0.7 }.response(Stamped { t: &t, u: &u, first: 0 }, [0.0; 2]);
            for (t, y) in t.iter().zip(y) {
                let s = (t - at - 0.7).max(0.0);
                let exact = if T1 == T2 {
                    1.0 - (1.0 + s / T1) * (-s / T1).exp()
                } else {
                    1.0 - (T1 * (-s / T1).exp() - T2 * (-s / T2).exp()) / (T1 - T2)
                };
                assert!((y - exact).abs() < 1e-13, "{T1} {T2} {t}: {y} {exact}");
            }
        }
    }

    #[test]
    fn the_slope_by_the_delay_is_that_of_differences() {
        let t: Vec<f64> = (0..60).map(|k| f64::from(k) + 0.3 * f64::from(k * 7 % 5)).collect();
        let u: Vec<f64> = (0..60).map(|k| f64::from(k / 6 % 2)).collect();
        for T in [&[4.0][..], &[4.0, 2.0]] {
            let at = |L: f64| AtStamps { T, L }.response(Stamped { t: &t, u: &u, first: 5 }, [0.2, 0.1]);
            let slope = AtStamps { T, L: 2.21 }.by_delay(Stamped { t: &t, u: &u, first: 5 });
            for ((a, b), s) in at(2.21 - 1e-6).iter().zip(at(2.21 + 1e-6)).zip(slope) {
                assert!(((b - a) / 2e-6 - s).abs() < 1e-8);
            }
        }
    }
}
