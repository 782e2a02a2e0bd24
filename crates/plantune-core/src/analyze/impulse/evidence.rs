//! How likely the outputs are under a prior: the evidence, from a thin QR.
//!
//! ```text
//! y = Phi g + O + e,  g ~ N(0, s2 c K),  e ~ N(0, s2 I),  O flat
//! QR of [1 | Phi | y] without its first row:  R1 (n, n), R2 (n), r
//! -2 ln p = N ln s2 + ln |I + c R1 K R1'| + const,
//! s2      = (R2'(I + c R1 K R1')^-1 R2 + r^2) / N
//! ```
//!
//! In units of the noise, so `s2` is the best one in closed form; `N` is one less than the rows, which the
//! flat offset costs. `K = L L'`, and one bidiagonal form of `X = R1 L` gives the evidence at every `c`
//! ([`Ridge`]).
//!
//! Chen and Ljung, Automatica 49 (2013); METHODS 2.3.

use super::kernels::Kernel;
use crate::linalg::{Ridge, Triangle, golden};

/// Scales tried, then sections of the interval around the best of them.
const SCALES: usize = 29;
const SECTIONS: usize = 24;

/// Range of `ln (c |X|^2 / n)`: from a prior that is nearly nothing to one that is nearly flat.
const LEAST: f64 = -10.0;
const MOST: f64 = 28.0;

/// What the data say about the taps of one input: the triangle of `[taps | y]`.
pub(super) struct Seen {
    pub(super) triangle: Triangle, // (n + 1)
    /// Rows that count.
    pub(super) N: f64,
    /// `ln |I + …|` of the other inputs.
    pub(super) others: f64,
}

/// A prior with its evidence.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior {
    pub(super) kernel: Kernel,
    /// Taps that are zero before the first that is alive.
    pub(super) dead: usize,
    pub(super) lam: f64,
    /// Of DC.
    pub(super) rho: f64,
    /// Scale, in units of the noise variance.
    pub(super) c: f64,
    /// Noise variance.
    pub(super) s2: f64,
    /// `-2 ln p` up to a constant.
    pub(super) cost: f64,
}

impl Seen {
    /// Number of taps.
    pub(super) fn n(&self) -> usize {
        self.triangle.n() - 1
    }

    /// `R1 L`, column-major; `L (n - dead, n - dead)` is the factor of the kernel of the living taps.
    pub(super) fn through(&self, L: &[f64], dead: usize) -> Vec<f64> {
        let (n, alive) = (self.n(), self.n() - dead);
        let mut columns = vec![0.0; n * alive]; // R1, transposed
        for (j, column) in columns.chunks_exact_mut(n).enumerate() {
            (0..=dead + j).for_each(|i| column[i] = self.triangle.at(i, dead + j));
        }
        let mut x = vec![0.0; n * alive];
        for (j, to) in x.chunks_exact_mut(n).enumerate() {
            for (i, column) in columns.chunks_exact(n).enumerate().skip(j) {
                let by = L[i * alive + j];
                let filled = dead + i + 1;
                to[..filled].iter_mut().zip(&column[..filled]).for_each(|(t, r)| *t += by * r);
            }
        }
        x
    }

    /// Column of `y`, seen from the taps.
    pub(super) fn rhs(&self) -> Vec<f64> {
        (0..self.n()).map(|i| self.triangle.at(i, self.n())).collect()
    }

    /// Squared length of what no tap reaches.
    pub(super) fn rest(&self) -> f64 {
        self.triangle.at(self.n(), self.n()).powi(2)
    }

    /// The prior of this shape with the best scale.
    pub(super) fn best_scale(&self, kernel: Kernel, dead: usize, lam: f64, rho: f64) -> Prior {
        let alive = self.n() - dead;
        let x = self.through(&kernel.factor(alive, lam, rho), dead);
        let size = x.iter().map(|x| x * x).sum::<f64>().max(f64::MIN_POSITIVE) / alive as f64;
        let ridge = Ridge::new(x, self.rhs());
        let rest = self.rest();
        let cost = |ln_c: f64| {
            let (ln_det, form) = ridge.at(ln_c.exp());
            let s2 = ((form + rest) / self.N).max(f64::MIN_POSITIVE);
            (self.N * s2.ln() + ln_det + self.others, s2)
        };
        let step = (MOST - LEAST) / (SCALES - 1) as f64;
        let at = |k: usize| LEAST + step * k as f64 - size.ln();
        let costs: Vec<f64> = (0..SCALES).map(|k| cost(at(k)).0).collect();
        let k = (0..SCALES).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
        let (ln_c, _) = golden(|x| cost(x).0, at(k.saturating_sub(1)), at((k + 1).min(SCALES - 1)), SECTIONS);
        let (cost, s2) = cost(ln_c);
        Prior { kernel, dead, lam, rho, c: ln_c.exp(), s2, cost }
    }
}
