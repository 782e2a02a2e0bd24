//! All inputs together: each has a prior, and sees the others as part of the noise.
//!
//! ```text
//! y = sum_j Phi_j g_j + O + e:   given the priors of the others, Cov (y - Phi_i g_i) = s2 (I + sum_j c_j Phi_j K_j Phi_j')
//! ```
//!
//! Their taps are taken up like the offset, as columns before those of input `i` with rows `[I 0 0]` of their prior
//! below: dropping them from the triangle leaves what the data say of input `i`. So one search serves one input
//! and several, in turns; each turn raises the evidence.

use super::evidence::{Prior, Seen};
use super::kernels::Kernel;
use super::search;
use crate::linalg::{Block, Triangle};

/// Largest number of dead taps looked for.
const MOST_DEAD: usize = 60;

/// Turns over several inputs.
const TURNS: usize = 2;

/// The triangle of all inputs, and the prior that each of them has so far.
pub(super) struct System {
    triangle: Triangle, // (nu n + 1), without the row of the constant: the offset is flat
    n: usize,
    N: f64,
    pub(super) priors: Vec<Prior>, // (nu)
}

impl System {
    /// From the triangle of `[1 | taps | y]` over `N` rows, with TC priors and all taps alive.
    pub(super) fn new(triangle: Triangle, n: usize, N: usize) -> Self {
        let nu = (triangle.n() - 2) / n;
        let mut system = System { triangle: triangle.below(1), n, N: (N - 1) as f64, priors: Vec::new() };
        for i in 0..nu {
            let prior = search::best(&system.seen(i), Kernel::Tc, 0);
            system.priors.push(prior);
        }
        system
    }

    /// The priors of each input by counts of dead taps, or of one count that is known; the best are kept.
    pub(super) fn by_dead_taps(&mut self, known: Option<usize>) -> Vec<Vec<Prior>> {
        let nu = self.priors.len();
        let mut all = vec![Vec::new(); nu];
        let turns = if nu > 1 { TURNS } else { 1 };
        for i in (0..turns).flat_map(|_| 0..nu) {
            let seen = self.seen(i);
            all[i] = match known {
                Some(dead) => vec![search::best(&seen, Kernel::Tc, dead)],
                None => search::by_dead_taps(&seen, Kernel::Tc, MOST_DEAD),
            };
            self.priors[i] = search::most_likely(&all[i]);
        }
        all
    }

    /// What the data say of input `i`, given the priors that the others have.
    pub(super) fn seen(&self, i: usize) -> Seen {
        let all = (self.triangle.n() - 1) / self.n;
        if all == 1 {
            return Seen { triangle: self.triangle.clone(), N: self.N, others: 0.0 };
        }
        let others: Vec<usize> = (0..self.priors.len()).filter(|&j| j != i).collect();
        let known = others.len() * self.n;
        let width = known + self.n + 1;
        let mut triangle = Triangle::new(width);
        let mut block = Block::new(width);
        let scaled: Vec<Vec<f64>> = others.iter().map(|&j| self.scaled(j)).collect();
        let mut row = vec![0.0; width];
        for k in 0..self.triangle.n() {
            for (to, x) in row.chunks_exact_mut(self.n).zip(&scaled) {
                to.copy_from_slice(&x[k * self.n..][..self.n]);
            }
            let own = &self.triangle.row(k)[i * self.n..][..self.n];
            row[known..width - 1].copy_from_slice(own);
            row[width - 1] = self.triangle.at(k, self.triangle.n() - 1);
            block.push(&row);
        }
        for k in 0..known {
            row.fill(0.0);
            row[k] = 1.0;
            block.push(&row);
        }
        triangle.absorb(&mut block);
        let ln_det = (0..known).map(|k| 2.0 * triangle.at(k, k).abs().ln()).sum();
        Seen { triangle: triangle.below(known), N: self.N, others: ln_det }
    }

    /// `sqrt(c) R L` of input `j`, row-major with `n` columns; the dead ones are zero.
    fn scaled(&self, j: usize) -> Vec<f64> {
        let (n, prior) = (self.n, &self.priors[j]);
        let alive = n - prior.dead;
        let L = prior.kernel.factor(alive, prior.lam, prior.rho);
        let mut x = vec![0.0; self.triangle.n() * n];
        for (k, to) in x.chunks_exact_mut(n).enumerate() {
            let row = &self.triangle.row(k)[j * n + prior.dead..][..alive];
            for (r, l) in row.iter().zip(L.chunks_exact(alive)) {
                to.iter_mut().zip(l).for_each(|(t, l)| *t += prior.c.sqrt() * r * l);
            }
        }
        x
    }
}
