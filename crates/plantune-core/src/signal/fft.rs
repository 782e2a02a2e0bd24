//! The discrete Fourier transform of real signals, `X(k) = sum_n x(n) e^(-2 pi i k n / N)`.
//!
//! Source 001, (3.5-10) and (3.5-11). The transform itself is the work of `realfft`.

use std::sync::Arc;

use realfft::{RealFftPlanner, RealToComplex};

use crate::linalg::Complex;

/// A transform of signals of one length.
pub struct Fourier {
    plan: Arc<dyn RealToComplex<f64>>,
    room: Vec<Complex<f64>>,
}

impl Fourier {
    /// Of `N` samples, any number.
    pub fn new(N: usize) -> Self {
        let plan = RealFftPlanner::new().plan_fft_forward(N);
        let room = plan.make_scratch_vec();
        Fourier { plan, room }
    }

    /// `X(0) … X(N/2)`; the samples are used up.
    pub fn of(&mut self, x: &mut [f64]) -> Vec<Complex<f64>> {
        let mut X = self.plan.make_output_vec();
        self.plan.process_with_scratch(x, &mut X, &mut self.room).ok(); // fails on wrong lengths only
        X
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    #[test]
    fn it_is_the_sum_that_defines_it() {
        for N in [1, 2, 3, 7, 64, 90] {
            let x = white(N, 4);
            let X = Fourier::new(N).of(&mut x.clone());
            assert_eq!(X.len(), N / 2 + 1);
            for (k, X) in X.iter().enumerate() {
                let w = std::f64::consts::TAU * k as f64 / N as f64;
                let sum: Complex<f64> =
                    x.iter().enumerate().map(|(n, x)| Complex::from_polar(*x, -w * n as f64)).sum();
                assert!((X - sum).norm() < 1e-11, "{N} {k}");
            }
        }
    }
}
