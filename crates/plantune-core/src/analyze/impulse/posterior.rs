//! The impulse response given data and prior, with its covariance.
//!
//! ```text
//! g = sqrt(c) L z,  z ~ N(0, s2 I):  min |sqrt(c) R1 L z - R2|^2 + |z|^2,   QR  [sqrt(c) R1 L  R2; I  0] = Q [T t]
//! z = T^-1 t,   Cov g = s2 G G',  G = sqrt(c) L T^-1
//! over several counts of dead taps with weights w:
//! g = sum w g_d,   Cov g = sum w (Cov g_d + (g_d - g)(g_d - g)')
//! ```

use super::evidence::{Prior, Seen};
use crate::linalg::{Block, Triangle, dot};

/// Taps and their covariance.
pub(super) struct Taps {
    pub(super) g: Vec<f64>, // (n)
    pub(super) P: Vec<f64>, // (n, n)
}

/// Weight below which a count of dead taps is left out.
const LEAST_WEIGHT: f64 = 1e-3;

/// Mean and covariance under one prior.
pub(super) fn posterior(seen: &Seen, prior: &Prior) -> Taps {
    let (n, m) = (seen.n(), seen.n() - prior.dead);
    let L = prior.kernel.factor(m, prior.lam, prior.rho);
    let x = seen.through(&L, prior.dead);
    let root = prior.c.sqrt();
    let triangle = ridge_triangle(&x, &seen.rhs(), root);
    let inverse = inverse(&triangle, m);
    let mut G = vec![0.0; m * m];
    for (i, to) in G.chunks_exact_mut(m).enumerate() {
        for (k, from) in inverse.chunks_exact(m).enumerate().take(i + 1) {
            let by = root * L[i * m + k];
            to.iter_mut().zip(from).for_each(|(t, f)| *t += by * f);
        }
    }
    let rows: Vec<&[f64]> = G.chunks_exact(m).collect();
    let t: Vec<f64> = (0..m).map(|k| triangle.at(k, m)).collect();
    let (mut g, mut P) = (vec![0.0; n], vec![0.0; n * n]);
    for (i, row) in rows.iter().enumerate() {
        g[prior.dead + i] = dot(row, &t);
        for (j, other) in rows.iter().enumerate().take(i + 1) {
            let p = prior.s2 * dot(row, other);
            P[(prior.dead + i) * n + prior.dead + j] = p;
            P[(prior.dead + j) * n + prior.dead + i] = p;
        }
    }
    Taps { g, P }
}

/// The mixture over several counts of dead taps.
pub(super) fn averaged(seen: &Seen, priors: &[Prior], weights: &[f64]) -> Taps {
    let n = seen.n();
    let kept: Vec<(f64, Taps)> = priors
        .iter()
        .zip(weights)
        .filter(|(_, w)| **w > LEAST_WEIGHT)
        .map(|(prior, &w)| (w, posterior(seen, prior)))
        .collect();
    let sum: f64 = kept.iter().map(|(w, _)| w).sum();
    let g: Vec<f64> = (0..n).map(|k| kept.iter().map(|(w, t)| w * t.g[k]).sum::<f64>() / sum).collect();
    let mut P = vec![0.0; n * n];
    for (w, taps) in &kept {
        let apart: Vec<f64> = taps.g.iter().zip(&g).map(|(a, b)| a - b).collect();
        for (ij, p) in P.iter_mut().enumerate() {
            *p += w / sum * (taps.P[ij] + apart[ij / n] * apart[ij % n]);
        }
    }
    Taps { g, P }
}

/// Triangle of `[root X | y; I | 0]`, `X` column-major.
pub(super) fn ridge_triangle(x: &[f64], y: &[f64], root: f64) -> Triangle {
    let (rows, m) = (y.len(), x.len() / y.len());
    let mut triangle = Triangle::new(m + 1);
    let mut block = Block::new(m + 1);
    let mut row = vec![0.0; m + 1];
    for (i, y) in y.iter().enumerate() {
        (0..m).for_each(|j| row[j] = root * x[j * rows + i]);
        row[m] = *y;
        block.push(&row);
    }
    for i in 0..m {
        row.fill(0.0);
        row[i] = 1.0;
        block.push(&row);
    }
    triangle.absorb(&mut block);
    triangle
}

/// Inverse of the leading `m` rows and columns, row-major.
fn inverse(triangle: &Triangle, m: usize) -> Vec<f64> {
    let mut inverse = vec![0.0; m * m];
    for i in (0..m).rev() {
        let (head, tail) = inverse.split_at_mut((i + 1) * m);
        let own = &mut head[i * m..];
        own[i] = 1.0;
        for (k, row) in tail.chunks_exact(m).enumerate() {
            let by = triangle.at(i, i + 1 + k);
            own.iter_mut().zip(row).for_each(|(o, r)| *o -= by * r);
        }
        let pivot = triangle.at(i, i);
        own.iter_mut().for_each(|o| *o /= pivot);
    }
    inverse
}
