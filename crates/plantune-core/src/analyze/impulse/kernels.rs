//! What is believed of an impulse response before the data: smooth, and dying away.
//!
//! ```text
//! g ~ N(0, c K),  taps i, j = 1, 2, …   (of those that are alive)
//! TC  K = lam^max(i,j)
//! DC  K = lam^((i+j)/2) rho^|i-j|                       TC is DC with rho = sqrt(lam)
//! SS  K = lam^(i+j+max(i,j))/2 - lam^(3 max(i,j))/6
//! K = L L',  of DC  L_ij = lam^(i/2) rho^(i-j) (sqrt(1 - rho^2) for j > 1)
//! ```
//!
//! Chen, Ohlsson and Ljung, Automatica 48 (2012); Pillonetto and De Nicolao, Automatica 46 (2010) for SS.

/// Shape of the prior.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Tuned and correlated.
    Tc,
    /// Diagonal and correlated.
    Dc,
    /// Stable spline.
    Ss,
}

/// Least pivot of the correlation matrix of SS; below it is rounding.
const LEAST_PIVOT: f64 = 1e-14;

impl Kernel {
    /// The word used in Python and in JSON.
    pub fn as_str(self) -> &'static str {
        match self {
            Kernel::Tc => "tc",
            Kernel::Dc => "dc",
            Kernel::Ss => "ss",
        }
    }

    /// `L` with `K = L L'` over `n` taps, lower triangular, row-major; `rho` counts for DC alone.
    pub(super) fn factor(self, n: usize, lam: f64, rho: f64) -> Vec<f64> {
        match self {
            Kernel::Tc => correlated(n, lam, lam.sqrt()),
            Kernel::Dc => correlated(n, lam, rho),
            Kernel::Ss => splined(n, lam),
        }
    }
}

fn correlated(n: usize, lam: f64, rho: f64) -> Vec<f64> {
    let own = (1.0 - rho * rho).sqrt();
    let mut L = vec![0.0; n * n];
    let mut size = 1.0;
    for i in 0..n {
        size *= lam.sqrt();
        let mut by = size;
        for j in (0..=i).rev() {
            L[i * n + j] = if j > 0 { own * by } else { by };
            by *= rho;
        }
    }
    L
}

/// Cholesky of the correlation matrix, rows scaled afterwards: the sizes of the taps span many decades.
fn splined(n: usize, lam: f64) -> Vec<f64> {
    // K_ij / sqrt(K_ii K_jj) with K_ii = lam^(3 i)/3 and d = |i - j|: (3 lam^(d/2) - lam^(3 d/2))/2.
    let correlation = |d: usize| {
        let x = lam.powf(0.5 * d as f64);
        0.5 * x * (3.0 - x * x)
    };
    let by_distance: Vec<f64> = (0..n).map(correlation).collect();
    let mut L = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let (row, other) = (&L[i * n..i * n + j], &L[j * n..j * n + j]);
            let left = by_distance[i - j] - row.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
            L[i * n + j] = if i == j { left.max(LEAST_PIVOT).sqrt() } else { left / L[j * n + j] };
        }
    }
    for (i, row) in L.chunks_exact_mut(n).enumerate() {
        let size = (lam.powf(3.0 * (i + 1) as f64) / 3.0).sqrt();
        row.iter_mut().for_each(|l| *l *= size);
    }
    L
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_multiply_to_the_printed_kernels() {
        let (n, lam, rho) = (7, 0.8f64, 0.6f64);
        let power = |x: f64, k: f64| x.powf(k);
        for kernel in [Kernel::Tc, Kernel::Dc, Kernel::Ss] {
            let L = kernel.factor(n, lam, rho);
            for (i, j) in (0..n * n).map(|ij| (ij / n, ij % n)) {
                let (a, b) = ((i + 1) as f64, (j + 1) as f64);
                let most = a.max(b);
                let K = match kernel {
                    Kernel::Tc => power(lam, most),
                    Kernel::Dc => power(lam, (a + b) / 2.0) * power(rho, (a - b).abs()),
                    Kernel::Ss => power(lam, a + b + most) / 2.0 - power(lam, 3.0 * most) / 6.0,
                };
                let product: f64 = (0..n).map(|k| L[i * n + k] * L[j * n + k]).sum();
                assert!((product - K).abs() < 1e-14, "{kernel:?} {i} {j}: {product} {K}");
            }
        }
    }
}
