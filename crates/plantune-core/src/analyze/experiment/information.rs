//! What an input will tell of K, T and L, before it is run.
//!
//! With `u` held between rows, at rest at `u(0)` before, and `x = t - t_j - L` the time since a move `du_j`
//! arrived:
//!
//! ```text
//! y(t) = O + K sum du_j (1 - e^(-x/T)) + v(t)
//! psi  = dy/d(K, T, L):
//!   dK = sum du_j (1 - e^(-x/T))     dT = -K/T sum du_j x/T e^(-x/T)     dL = -K/T sum du_j e^(-x/T)
//! white v                    Cov = sd^2 (psi'psi)^-1
//! v = e / A(q), fitted as
//! if it were white           Cov = M (psi'R psi) M,   M = (psi'psi)^-1,   R the covariance of v
//! ```
//!
//! A move that arrives just at a row has two slopes by L; the fit sees both, so it counts half. `O` is a
//! further column and, unless the input begins like a step test, so is the free response `e^(-t/T)`: the
//! rows before the first delayed input are history then, as the fit takes them ([`crate::batch::process`]).
//! `psi'R psi` is the sum over `g g'` with `g = psi / A(q)` run backward in time. Ljung 1999, 9.4; METHODS 1.1.

use crate::error::{Error, Result};
use crate::linalg::{Triangle, dot, solve};
use crate::model::{Fopdt, Fraction};
use crate::poly::is_stable;

/// Columns that depend on the others to this accuracy are not told apart.
const RANK_TOLERANCE: f64 = 1e-8;

/// Share of the first value below which a response of the noise has died out.
const DIED_OUT: f64 = 1e-9;

/// Longest memory of the noise, in rows.
const LONGEST_MEMORY: usize = 1_000_000;

/// The disturbance at the output: `v(t) = phi_1 v(t-1) + ... + e(t)`, white without `phi`.
#[derive(Clone, Debug, PartialEq)]
pub struct Disturbance {
    /// Standard deviation of `v`.
    pub sd: f64,
    /// `phi_1 ...`.
    pub ar: Vec<f64>,
}

/// Predicted standard deviations, and the response they go with.
#[derive(Clone, Debug)]
pub struct Predicted {
    /// Of K, T and L.
    pub sd: [f64; 3],
    /// `sd K / |K|`, `sd T / T`, `sd L / (T + L)`.
    pub relative: [f64; 3],
    /// Response without noise, its value at rest taken as zero.
    pub y: Vec<f64>,
}

impl Predicted {
    /// The least known of the three.
    pub fn worst(&self) -> f64 {
        self.relative.iter().copied().fold(0.0, f64::max)
    }
}

/// Standard deviations that a fit of K, T, L and O to the response to `u` will have.
pub fn predicted_sd(plant: &Fopdt, u: &[f64], Ts: f64, noise: &Disturbance) -> Result<Predicted> {
    noise.check()?;
    if !u.iter().all(|u| u.is_finite()) {
        return Err(Error::argument("u", "not finite", "finite numbers"));
    }
    let psi = sensitivities(plant, u, Ts);
    let y = psi.iter().map(|row| plant.K * row[0]).collect();
    let rows = regressor(plant, u, Ts, psi);
    let n = rows.first().map_or(0, Vec::len);
    if rows.len() < n {
        return Err(Error::new("X03", format!("{} rows come after the dead time", rows.len()))
            .measured(rows.len() as f64, n as f64)
            .remedy("record longer"));
    }
    let with_rhs = rows.iter().map(|row| [row.as_slice(), &[0.0]].concat()).collect::<Vec<_>>();
    let triangle = Triangle::of_rows(n + 1, with_rhs.iter().map(Vec::as_slice));
    let columns: Vec<usize> = (0..n).collect();
    let solution = solve(&triangle, &columns, n, RANK_TOLERANCE).map_err(|deficient| {
        Error::new("X02", "the input does not tell K, T and L apart")
            .measured(deficient.ratio, RANK_TOLERANCE)
            .remedy("let the input move more often, or record longer")
    })?;
    let sd = noise.deviations(&rows, &solution.inverse_gram);
    let relative = [sd[0] / plant.K.abs(), sd[1] / plant.T, sd[2] / (plant.T + plant.L)];
    Ok(Predicted { sd, relative, y })
}

/// `dK dT dL` of each row.
fn sensitivities(plant: &Fopdt, u: &[f64], Ts: f64) -> Vec<[f64; 3]> {
    let Fopdt { K, T, L } = *plant;
    let Fraction { m, f } = Fraction::of(L, Ts);
    let (h, a) = (Ts / T, (-Ts / T).exp());
    let late = (Ts - f) / T; // time since a move arrived at the row after it, in T
    let (mut w, mut z) = (0.0, 0.0); // sum du e^(-x/T), sum du x/T e^(-x/T)
    let at = |k: usize| u[k.min(u.len() - 1)] - u[0];
    (0..u.len())
        .map(|k| {
            (w, z) = (a * w, a * (z + h * w));
            if f > 0.0 {
                let j = k.saturating_sub(m + 1);
                let du = if k > m + 1 { at(j) - at(j - 1) } else { 0.0 } * (-late).exp();
                (w, z) = (w + du, z + late * du);
                return [at(j) - w, -K / T * z, -K / T * w];
            }
            let j = k.saturating_sub(m);
            let du = if k > m { at(j) - at(j - 1) } else { 0.0 };
            let half = w + du / 2.0;
            w += du;
            [at(j) - w, -K / T * z, -K / T * half]
        })
        .collect()
}

/// The rows that a fit uses, with a column for the level and, where it was not at rest, for the start.
fn regressor(plant: &Fopdt, u: &[f64], Ts: f64, psi: Vec<[f64; 3]>) -> Vec<Vec<f64>> {
    if crate::batch::begins_as_step_test(u) {
        return psi.into_iter().map(|[k, t, l]| vec![k, t, l, 1.0]).collect();
    }
    let first = plant.history(Ts);
    let decay = |i: usize| (-(i as f64) * Ts / plant.T).exp();
    psi.into_iter().skip(first).enumerate().map(|(i, [k, t, l])| vec![k, t, l, 1.0, decay(i)]).collect()
}

impl Disturbance {
    /// Refuses what is no stationary noise.
    pub fn check(&self) -> Result<()> {
        if !(self.sd > 0.0 && self.sd.is_finite()) {
            return Err(Error::argument("noise_sd", self.sd, "a positive number"));
        }
        if !self.ar.iter().all(|a| a.is_finite()) || !is_stable(&self.denominator()) {
            let came = format!("{:?}", self.ar);
            return Err(Error::argument("ar", came, "the coefficients of a stationary autoregression"));
        }
        Ok(())
    }

    /// `A(q) = 1 - phi_1 q^-1 - ...`.
    fn denominator(&self) -> Vec<f64> {
        [1.0].into_iter().chain(self.ar.iter().map(|phi| -phi)).collect()
    }

    /// Standard deviations of the first three parameters; `M = (psi'psi)^-1`.
    fn deviations(&self, psi: &[Vec<f64>], M: &[f64]) -> [f64; 3] {
        let n = psi[0].len();
        [0, 1, 2].map(|i| {
            let row = &M[i * n..][..n];
            let weights: Vec<f64> = psi.iter().map(|psi| dot(psi, row)).collect();
            // In the units of e, of which v has the variance sum h^2.
            self.sd * (self.backward_power(&weights) / self.backward_power(&[1.0])).sqrt()
        })
    }

    /// Sum of squares of `x / A(q)` run backward in time, on into the past until it has died out.
    fn backward_power(&self, x: &[f64]) -> f64 {
        let tiny = DIED_OUT * x.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let mut later = vec![0.0; self.ar.len()]; // g(s+1), g(s+2), ...
        let mut power = 0.0;
        let mut step = |x: f64| {
            let g = x + dot(&self.ar, &later);
            if let Some(last) = later.last_mut() {
                *last = g;
                later.rotate_right(1);
            }
            power += g * g;
            later.iter().all(|g| g.abs() <= tiny)
        };
        x.iter().rev().for_each(|&x| {
            step(x);
        });
        (0..LONGEST_MEMORY).find(|_| step(0.0));
        power
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANT: Fopdt = Fopdt { K: 2.0, T: 10.0, L: 3.37 };

    fn moves() -> Vec<f64> {
        (0..300).map(|k| [0.0, 1.0, -1.0, 1.0, 0.5, -1.0][k / 12 * 7 % 6]).collect()
    }

    #[test]
    fn sensitivities_are_differences_of_the_response() {
        let u = moves();
        let y = |K, T, L| -> Vec<f64> {
            sensitivities(&Fopdt { K, T, L }, &u, 1.0).iter().map(|row| K * row[0]).collect()
        };
        let psi = sensitivities(&PLANT, &u, 1.0);
        let d = 1e-5;
        for (i, (high, low)) in [
            (y(2.0 + d, 10.0, 3.37), y(2.0 - d, 10.0, 3.37)),
            (y(2.0, 10.0 + d, 3.37), y(2.0, 10.0 - d, 3.37)),
            (y(2.0, 10.0, 3.37 + d), y(2.0, 10.0, 3.37 - d)),
        ]
        .iter()
        .enumerate()
        {
            let off =
                (0..300).map(|k| ((high[k] - low[k]) / (2.0 * d) - psi[k][i]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-7, "{i}: {off}");
        }
    }

    /// An autoregression so short that it is white, and one slow against the record.
    #[test]
    fn coloured_noise_hides_more_than_white() {
        let u = moves();
        let of = |ar: Vec<f64>| predicted_sd(&PLANT, &u, 1.0, &Disturbance { sd: 0.1, ar }).expect("fine").sd;
        let (white, nearly, slow) = (of(vec![]), of(vec![1e-9]), of(vec![0.9]));
        assert!((0..3).all(|i| (nearly[i] / white[i] - 1.0).abs() < 1e-6));
        assert!(slow[0] > 2.0 * white[0] && slow[1] > 2.0 * white[1]);
    }

    #[test]
    fn an_input_at_rest_and_an_unstable_noise_are_refused() {
        let noise = Disturbance { sd: 0.1, ar: vec![] };
        assert_eq!(predicted_sd(&PLANT, &[1.0; 100], 1.0, &noise).expect_err("rest").code(), "X02");
        assert!(Disturbance { sd: 0.1, ar: vec![1.1] }.check().is_err());
    }
}
