//! Correlation of two signals at every lag, by way of their spectra.
//!
//! `r(lag) = sum_t x(t) y(t + lag)` for `lag = 0 … N - 1`; `R = conj(X) Y` where both are padded with as
//! many zeros, so that the circle does not close. `O(N log N)`: the direct sums are `O(N^2)`. Rounding is
//! of the order of `1e-16 ||x|| ||y||` at every lag, also where the terms of the sum are small.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

/// `sum_t x(t) y(t + lag)` for each lag from 0 on; `x` and `y` are of one length.
pub fn correlate(x: &[f64], y: &[f64]) -> Vec<f64> {
    let N = x.len().min(y.len());
    let n = (2 * N).next_power_of_two();
    let mut planner = RealFftPlanner::new();
    let forward = planner.plan_fft_forward(n);
    let spectrum = |signal: &[f64]| -> Vec<Complex<f64>> {
        let mut padded = signal[..N].to_vec();
        padded.resize(n, 0.0);
        let mut spectrum = forward.make_output_vec();
        forward.process(&mut padded, &mut spectrum).ok(); // fails on wrong lengths only
        spectrum
    };
    let mut product = spectrum(x);
    for (a, b) in product.iter_mut().zip(spectrum(y)) {
        *a = a.conj() * b / n as f64;
    }
    let mut r = vec![0.0; n];
    planner.plan_fft_inverse(n).process(&mut product, &mut r).ok(); // complains of NaN, and keeps it
    r.truncate(N);
    r
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{dot, white};

    #[test]
    fn every_lag_is_the_direct_sum() {
        for N in [0, 1, 2, 3, 17, 64, 1000] {
            let (x, y) = (white(N, 1), white(N, 2));
            let r = correlate(&x, &y);
            assert_eq!(r.len(), N);
            let size = (dot(&x, &x) * dot(&y, &y)).sqrt();
            for (lag, r) in r.iter().enumerate() {
                let direct = dot(&x[..N - lag], &y[lag..]);
                assert!((r - direct).abs() <= 1e-14 * size, "{N} {lag}: {r} {direct}");
            }
        }
    }
}
