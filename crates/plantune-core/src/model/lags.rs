//! Lags in series behind a zero-order hold: `K / prod_i (T_i s + 1)`, all `T_i` distinct.
//!
//! ```text
//! s(t) = K (1 - sum_i c_i e^(-t/T_i)),   c_i = prod_(j != i) T_i / (T_i - T_j)
//! A(q) = prod_i (1 - e^(-Ts/T_i) q^-1),  b_k = sum_(j < k) A_j (s(k - j) - s(k - j - 1)),  k = 1 … n
//! ```
//!
//! since `B(q) / A(q)` has the increments of the sampled step response `s` for its impulse response.

use super::PolyModel;
use crate::error::{Error, Result};
use crate::poly::product;

/// The sampled form, exact.
pub fn lags(K: f64, T: &[f64], Ts: f64) -> Result<PolyModel> {
    check(K, T, Ts)?;
    let A = T.iter().fold(vec![1.0], |A, T| product(&A, &[1.0, -(-Ts / T).exp()]));
    let c = |Ti: &f64| -> f64 { T.iter().filter(|&Tj| Tj != Ti).map(|Tj| Ti / (Ti - Tj)).product() };
    // s(k) - s(k - 1), without taking near-equal numbers apart.
    let increment = |k: usize| -> f64 {
        T.iter().map(|T| -c(T) * (-(k as f64 - 1.0) * Ts / T).exp() * (-Ts / T).exp_m1()).sum()
    };
    let B = (1..=T.len()).map(|k| (0..k).map(|j| K * A[j] * increment(k - j)).sum()).collect();
    Ok(PolyModel::arx(A, vec![B], vec![1], Ts))
}

fn check(K: f64, T: &[f64], Ts: f64) -> Result<()> {
    let positive = |x: f64| x > 0.0 && x.is_finite();
    if !K.is_finite() {
        return Err(Error::argument("K", K, "finite"));
    }
    if !positive(Ts) {
        return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
    }
    let distinct = |i: usize| T[..i].iter().all(|Tj| (T[i] - Tj).abs() > 1e-6 * T[i]);
    if T.is_empty() || !(0..T.len()).all(|i| positive(T[i]) && distinct(i)) {
        return Err(Error::argument("T", format!("{T:?}"), "positive numbers of seconds, all distinct"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{ProcessModel, c2d};

    #[test]
    fn one_lag_is_the_process_model() {
        let lag = lags(-2.0, &[0.3], 0.1).expect("a model");
        let process = c2d(&ProcessModel { K: -2.0, T: 0.3, L: 0.0 }, 0.1).expect("a model");
        assert!((lag.A[1] - process.A[1]).abs() < 1e-15 && (lag.B[0][0] - process.B[0][0]).abs() < 1e-15);
    }

    /// `1 - (T1 e^(-t/T1) - T2 e^(-t/T2)) / (T1 - T2)`, and the third lag by partial fractions.
    #[test]
    fn the_step_response_is_that_of_the_lags_at_every_sample() {
        let T = [0.049f64, 0.002, 0.006];
        for n in 1..=3 {
            let model = lags(1.8, &T[..n], 0.002).expect("a model");
            for k in 0..200 {
                let t = 0.002 * f64::from(k);
                let rest: f64 = T[..n]
                    .iter()
                    .map(|Ti| {
                        let c: f64 = T[..n].iter().filter(|Tj| *Tj != Ti).map(|Tj| Ti / (Ti - Tj)).product();
                        c * (-t / Ti).exp()
                    })
                    .sum();
                let y = model.step_response(0, &[t])[0];
                assert!((y - 1.8 * (1.0 - rest)).abs() < 1e-12, "{n} lags, row {k}");
            }
        }
    }

    #[test]
    fn equal_lags_are_refused() {
        assert!(lags(1.0, &[0.1, 0.1], 0.01).is_err() && lags(1.0, &[], 0.01).is_err());
        assert!(lags(1.0, &[-0.1], 0.01).is_err() && lags(f64::NAN, &[0.1], 0.01).is_err());
    }
}
