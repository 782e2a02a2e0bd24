//! From the coefficients of a minimum to the plant, and from their covariance to that of `K, T, L, O`.
//!
//! ```text
//! K = (b1 + b2)/(1 - a),  T = -Ts/ln a,  L = m Ts + Ts + T ln(1 - b1/K),  O = y0 - K u0 + d/(1 - a)
//! ```
//!
//! by the delta rule, in the units of the signals. Where the delay is a whole number of samples, L has no variance.
//!
//! The covariance `s^2 G`, `G = (sum psi psi')^-1`, holds where the errors are white and the plant is of first order.
//! What else there is, a drift, another lag, a delay beyond the range, makes the errors of a while agree:
//!
//! ```text
//! Cov = G S G,   S the scatter of sum psi eps from one part of the rows to the next
//! ```
//!
//! Where it says more than chance would, the standard deviation is that. Huber 1967; White 1982; batch means.

use super::Predictor;
use super::cell::{Found, Free, OWN, linearised, scatter};
use super::scaled::Scaled;
use crate::linalg::{congruence, solve};
use crate::model::Fopdt;

/// Pivots below this share mean that the rows do not tell parameters apart.
pub(super) const RANK_TOLERANCE: f64 = 1e-9;

/// Ratio to the standard deviation of white errors from which on that of the scatter counts: one in thirty reaches
/// it by chance.
const SCATTERED: f64 = 1.6;

/// A minimum as a plant.
#[derive(Clone)]
pub(super) struct Plant {
    pub(super) model: Fopdt,
    pub(super) P: [f64; 16],
    pub(super) offset: f64,
    pub(super) predictor: Predictor,
}

impl Scaled {
    /// None where the rows leave the plant open.
    pub(super) fn plant(&self, found: &Found, m: usize) -> Option<Plant> {
        let theta = &found.theta;
        let free = Free { b2: self.fraction, c: found.free.c };
        let triangle = linearised(&self.rows, m, theta, free)?;
        let n = triangle.n() - 1;
        let solution = solve(&triangle, &(0..n).collect::<Vec<usize>>(), n, RANK_TOLERANCE).ok()?;
        let s2 = found.cost / (self.rows.N() - found.parameters()) as f64;
        let (a, b1, b2, d) = (theta[0], theta[1], theta[2], theta[theta.len() - OWN]);
        // Where a, b1, b2 and the last d stand among the columns.
        let own = [Some(0), Some(1), self.fraction.then_some(2), Some(n - OWN)];
        let covariance = |i: usize, j: usize| match (own[i], own[j]) {
            (Some(i), Some(j)) => solution.inverse_gram[i * n + j],
            _ => 0.0,
        };
        let (gain, rest) = (self.su / self.sy, 1.0 - a);
        let (K, T) = ((b1 + b2) / rest, -self.Ts / a.ln());
        let share = b1 / K; // 1 - e^(-(Ts-f)/T)
        let f = (self.Ts + T * (1.0 - share).ln()).clamp(0.0, self.Ts);
        let L_of_share = -T / (1.0 - share);
        // Rows of derivatives by a, b1, b2, d.
        let K_by = [K / rest, 1.0 / rest, 1.0 / rest, 0.0];
        let T_by = [self.Ts / (a * a.ln().powi(2)), 0.0, 0.0, 0.0];
        let share_by = |j: usize| (f64::from(u8::from(j == 1)) - share * K_by[j]) / K;
        let L_by = [0, 1, 2, 3].map(|j| T_by[j] * (1.0 - share).ln() + L_of_share * share_by(j));
        let level_by = [d / (rest * rest), 0.0, 0.0, 1.0 / rest];
        let O_by = [0, 1, 2, 3].map(|j| level_by[j] / self.sy - gain * self.u0 * K_by[j]);
        let L_by = if self.fraction { L_by } else { [0.0; 4] };
        let J = [K_by.map(|x| x * gain), T_by, L_by, O_by];
        let S = scatter(&self.rows, m, theta, free);
        let G = &solution.inverse_gram;
        let row = |i: usize| &G[i * n..][..n];
        let scattered =
            congruence(&own.map(|i| i.map_or(vec![0.0; n], |i| row(i).to_vec())), |i, j| S[i * n + j]);
        let P = widened(
            congruence(&J, |i, j| s2 * covariance(i, j)),
            &congruence(&J, |i, j| scattered[4 * i + j]),
        );
        let model = Fopdt { K: K * gain, T, L: m as f64 * self.Ts + f };
        let offset = self.y0 - model.K * self.u0 + d / rest / self.sy;
        let finite = P.iter().chain([&model.K, &T, &f, &offset]).all(|x| x.is_finite());
        let units = [self.u0, self.su, self.y0, self.sy];
        let own_P = std::array::from_fn(|ij| covariance(ij / 4, ij % 4));
        let predictor = Predictor::new([a, b1, b2, theta[3], d], own_P, s2, m, units);
        Some(Plant { model, P: P.try_into().ok()?, offset, predictor }).filter(|_| finite)
    }
}

/// `P` with the standard deviations of the scatter where they say more.
fn widened(P: Vec<f64>, scattered: &[f64]) -> Vec<f64> {
    let factor = |i: usize| {
        let ratio = (scattered[5 * i] / P[5 * i]).sqrt();
        if ratio > SCATTERED { ratio } else { 1.0 }
    };
    (0..16).map(|ij| P[ij] * factor(ij / 4) * factor(ij % 4)).collect()
}
