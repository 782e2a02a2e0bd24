//! Least squares with shared columns and columns that live in one segment only (initial states).
//!
//! Each segment is reduced to its own triangle `[local | shared | rhs]`; the rows that hold
//! only shared columns go on into one common triangle. However many segments there are, the
//! common problem keeps its size; the local parameters follow by back substitution.

use super::qr::{Block, Triangle};

/// The common triangle and the heads that the segments left behind.
pub struct Segmented {
    local: usize,
    common: Triangle,
    /// Rows on their way into `common`; the first segment needs none.
    block: Option<Block>,
    heads: Vec<Triangle>,
}

impl Segmented {
    /// `local` columns per segment, then `shared` columns, then the right-hand side.
    pub fn new(local: usize, shared: usize) -> Self {
        Segmented { local, common: Triangle::new(shared + 1), block: None, heads: Vec::new() }
    }

    /// Number of shared columns.
    pub fn shared(&self) -> usize {
        self.common.n() - 1
    }

    /// Takes one segment's triangle of `local + shared + 1` columns.
    pub fn push(&mut self, segment: Triangle) {
        if self.heads.is_empty() {
            self.common = segment.below(self.local);
        } else {
            let block = self.block.get_or_insert_with(|| Block::new(self.common.n()));
            (self.local..segment.n()).for_each(|i| block.push(&segment.row(i)[self.local..]));
        }
        self.heads.push(segment);
    }

    /// The triangle of the shared columns and the right-hand side.
    pub fn common(&mut self) -> &Triangle {
        if let Some(block) = &mut self.block {
            self.common.absorb(block);
        }
        &self.common
    }

    /// Local parameters of each segment, given the shared ones; a column that is zero gets zero.
    pub fn locals(&self, shared: &[f64]) -> Vec<Vec<f64>> {
        let left = |head: &Triangle, i: usize| {
            let known = shared.iter().enumerate().map(|(j, s)| head.at(i, self.local + j) * s);
            head.at(i, head.n() - 1) - known.sum::<f64>()
        };
        self.heads.iter().map(|head| self.back_substitute(head, |i| left(head, i))).collect()
    }

    /// For each segment the local parameters that explain most of each shared column, and of the right-hand side.
    pub fn shares(&self) -> Vec<Vec<Vec<f64>>> {
        let of = |head: &Triangle| {
            (self.local..head.n()).map(|j| self.back_substitute(head, |i| head.at(i, j))).collect()
        };
        self.heads.iter().map(of).collect()
    }

    /// Solves the triangle of the local columns for a right-hand side.
    fn back_substitute(&self, head: &Triangle, rhs: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut x = vec![0.0; self.local];
        for i in (0..self.local).rev() {
            let known: f64 = (i + 1..self.local).map(|j| head.at(i, j) * x[j]).sum();
            let length = (0..=i).map(|k| head.at(k, i).powi(2)).sum::<f64>().sqrt();
            let diagonal = head.at(i, i);
            if diagonal.abs() > 1e-12 * length {
                x[i] = (rhs(i) - known) / diagonal;
            }
        }
        x
    }
}
