//! Draws from a normal distribution given by mean and covariance, from an explicit seed.

use nalgebra::{DMatrix, SymmetricEigen};

/// `count` draws from `N(mean, covariance)`; the covariance may be singular.
///
/// The correlation matrix is factored, so parameters of very different size keep their digits;
/// draws come in antithetic pairs, so their mean is `mean`.
pub fn normal_draws(mean: &[f64], covariance: &[f64], count: usize, seed: u64) -> Vec<Vec<f64>> {
    let n = mean.len();
    let sd: Vec<f64> = (0..n).map(|i| covariance[i * n + i].max(0.0).sqrt()).collect();
    let correlation = DMatrix::from_fn(n, n, |i, j| {
        let scale = sd[i] * sd[j];
        if scale > 0.0 { covariance[i * n + j] / scale } else { 0.0 }
    });
    let eigen = SymmetricEigen::new(correlation);
    let roots = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
    let factor = &eigen.eigenvectors * DMatrix::from_diagonal(&roots);
    let mut random = Random::new(seed);
    let mut draws = Vec::with_capacity(count);
    while draws.len() < count {
        let z: Vec<f64> = (0..n).map(|_| random.normal()).collect();
        for sign in [1.0, -1.0] {
            let draw =
                (0..n).map(|i| mean[i] + sign * sd[i] * (0..n).map(|j| factor[(i, j)] * z[j]).sum::<f64>());
            draws.push(draw.collect());
        }
    }
    draws.truncate(count);
    draws
}

/// The splitmix64 generator (Steele, Lea and Flood 2014).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The same numbers for the same seed.
    pub fn new(seed: u64) -> Self {
        Random(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in (0, 1).
    pub fn uniform(&mut self) -> f64 {
        ((self.next() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// A whole number from 0 to `count - 1`.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.uniform() * count as f64) as usize).min(count - 1)
    }

    /// 1 or -1, as likely.
    pub fn sign(&mut self) -> f64 {
        if self.next() >> 63 == 0 { 1.0 } else { -1.0 }
    }

    /// The numbers from 0 to `count - 1` in random order (Fisher and Yates).
    pub fn permutation(&mut self, count: usize) -> Vec<usize> {
        let mut all: Vec<usize> = (0..count).collect();
        for k in (1..count).rev() {
            all.swap(k, self.below(k + 1));
        }
        all
    }

    /// Standard normal, Box and Muller.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// `n` independent standard normal numbers, for tests.
#[cfg(test)]
pub fn white(n: usize, seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed);
    (0..n).map(|_| random.normal()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_have_the_covariance_asked_for() {
        let covariance = [4.0, 1.2, 1.2, 1.0];
        let draws = normal_draws(&[10.0, -1.0], &covariance, 20_000, 1);
        let mean = |f: &dyn Fn(&Vec<f64>) -> f64| draws.iter().map(f).sum::<f64>() / 20_000.0;
        assert!((mean(&|d| d[0]) - 10.0).abs() < 1e-9);
        for (i, j) in [(0, 0), (0, 1), (1, 1)] {
            let centre = [10.0, -1.0];
            let ours = mean(&|d| (d[i] - centre[i]) * (d[j] - centre[j]));
            assert!((ours - covariance[i * 2 + j]).abs() < 0.1, "{i}{j}: {ours}");
        }
    }
}
