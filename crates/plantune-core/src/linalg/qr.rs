//! QR of a tall matrix that arrives in blocks of rows; only the triangle is kept.
//!
//! Rows are collected in a block; a full block is reflected into one triangle per register lane,
//! and these into the triangle at the end (Householder throughout), so the result has the accuracy
//! of a QR of the whole matrix while memory stays at one block.
//! Householder QR is invariant to column scaling, so scaling and pivoting wait until
//! the triangle is solved ([`super::solve`]).

use super::lines::Lines;
use super::reflect::{LANES, absorb, gather};

/// Rows of a block: ten columns of it fit into the first-level cache, and no two of them begin 4096 bytes
/// apart, which would hold up loads behind stores.
pub const BLOCK: usize = 264;

/// Rows on their way into a triangle: [`BLOCK`] of them, and what was made of those before.
pub struct Block {
    n: usize,
    data: Lines, // (BLOCK, n) column-major
    rows: usize,
    lanes: Lines, // (n, n, LANES): a triangle per lane of the rows before
    reduced: bool,
}

impl Block {
    /// Room for `n` columns.
    pub fn new(n: usize) -> Self {
        Block { n, data: Lines::new(BLOCK * n), rows: 0, lanes: Lines::new(n * n * LANES), reduced: false }
    }

    /// Number of columns.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Rows still free; at least one.
    pub fn free(&self) -> usize {
        BLOCK - self.rows
    }

    /// Column `j` of the next `len` rows, to be filled before [`Block::grow`].
    pub fn next_rows(&mut self, j: usize, len: usize) -> &mut [f64] {
        &mut self.data[j * BLOCK + self.rows..][..len]
    }

    /// Multiplies the next rows, filled but not yet declared, by a weight each.
    pub fn weigh(&mut self, weights: &[f64]) {
        for j in 0..self.n {
            self.next_rows(j, weights.len()).iter_mut().zip(weights).for_each(|(x, w)| *x *= w);
        }
    }

    /// Declares `len` filled rows as part of the block.
    pub fn grow(&mut self, len: usize) {
        self.rows += len;
        if self.rows == BLOCK {
            self.reduce();
        }
    }

    /// Appends one row.
    pub fn push(&mut self, row: &[f64]) {
        let data = &mut *self.data;
        for (j, &x) in row.iter().enumerate() {
            data[j * BLOCK + self.rows] = x;
        }
        self.rows += 1;
        if self.rows == BLOCK {
            self.reduce();
        }
    }

    /// Reflects the rows into the triangles of the lanes.
    fn reduce(&mut self) {
        let rows = self.rows.next_multiple_of(LANES);
        for column in self.data.chunks_exact_mut(BLOCK) {
            column[self.rows..rows].fill(0.0);
        }
        absorb(&mut self.lanes, self.n, &mut self.data, BLOCK, rows);
        self.rows = 0;
        self.reduced = true;
    }
}

/// Upper triangle `R` of the QR of all rows absorbed so far.
#[derive(Clone, Debug)]
pub struct Triangle {
    n: usize,
    r: Vec<f64>, // (n, n) row-major, zero below the diagonal
}

impl Triangle {
    /// Triangle of no rows, for `n` columns.
    pub fn new(n: usize) -> Self {
        Triangle { n, r: vec![0.0; n * n] }
    }

    /// From its rows, which hold nothing below the diagonal that counts.
    pub fn of_upper(n: usize, mut r: Vec<f64>) -> Self {
        (1..n).for_each(|i| r[i * n..][..i].fill(0.0));
        Triangle { n, r }
    }

    /// Number of columns.
    pub fn n(&self) -> usize {
        self.n
    }

    /// `R[i][j]`.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.r[i * self.n + j]
    }

    /// Row `i`, zero left of the diagonal.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.r[i * self.n..][..self.n]
    }

    /// The triangle without its first `count` rows and columns.
    pub fn below(&self, count: usize) -> Triangle {
        Triangle {
            n: self.n - count,
            r: (count..self.n).flat_map(|i| &self.row(i)[count..]).copied().collect(),
        }
    }

    /// Reflects all rows that `block` was given into the triangle and empties it.
    pub fn absorb(&mut self, block: &mut Block) {
        if block.rows > 0 {
            block.reduce();
        }
        if block.reduced {
            gather(&mut self.r, self.n, &mut block.lanes, &mut block.data);
            block.reduced = false;
        }
    }

    /// Weighs all rows so far by `lambda` and rotates one more in, which is used up. Allocates nothing.
    pub fn learn(&mut self, lambda: f64, row: &mut [f64]) {
        let fade = lambda.sqrt();
        for (i, r) in self.r.chunks_exact_mut(self.n).enumerate() {
            let (above, below) = (fade * r[i], row[i]);
            let length = above.hypot(below);
            let (c, s) = if length > 0.0 { (fade * above / length, below / length) } else { (fade, 0.0) };
            let (c_row, s_row) =
                if length > 0.0 { (above / length, fade * below / length) } else { (1.0, 0.0) };
            for (r, x) in r[i..].iter_mut().zip(&mut row[i..]) {
                (*r, *x) = (c * *r + s * *x, c_row * *x - s_row * *r);
            }
        }
    }

    /// Absorbs every row that `rows` pushes into the block it is given.
    pub fn of_rows<'r>(n: usize, rows: impl Iterator<Item = &'r [f64]>) -> Self {
        let mut triangle = Triangle::new(n);
        let mut block = Block::new(n);
        for row in rows {
            block.push(row);
        }
        triangle.absorb(&mut block);
        triangle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// R'R of the triangle is X'X of the rows, whatever the block boundaries.
    #[test]
    fn triangle_keeps_the_gram_matrix() {
        let n = 7;
        let rows: Vec<Vec<f64>> = (0..1000)
            .map(|k| (0..n).map(|j| ((k * (j + 3) + j * j) as f64 * 0.37).sin()).collect())
            .collect();
        let r = Triangle::of_rows(n, rows.iter().map(Vec::as_slice));
        for i in 0..n {
            for j in 0..n {
                let gram: f64 = rows.iter().map(|x| x[i] * x[j]).sum();
                let ours: f64 = (0..n).map(|k| r.at(k, i) * r.at(k, j)).sum();
                assert!((gram - ours).abs() < 1e-11 * rows.len() as f64, "{i} {j}");
            }
        }
    }

    /// Rows learnt one by one with forgetting are those rows, weighed, taken at once.
    #[test]
    fn learning_is_absorbing_weighed_rows() {
        let (n, N, lambda) = (4, 50, 0.9_f64);
        let entry = |k: usize, j: usize| ((k * (j + 3) + j * j) as f64 * 0.37).sin();
        let mut learnt = Triangle::new(n);
        for k in 0..N {
            learnt.learn(lambda, &mut (0..n).map(|j| entry(k, j)).collect::<Vec<_>>());
        }
        let weight = |k: usize| lambda.powf(0.5 * (N - 1 - k) as f64);
        let rows: Vec<Vec<f64>> = (0..N).map(|k| (0..n).map(|j| weight(k) * entry(k, j)).collect()).collect();
        let r = Triangle::of_rows(n, rows.iter().map(Vec::as_slice));
        for (i, j) in (0..n * n).map(|ij| (ij / n, ij % n)) {
            assert!((learnt.at(i, j).abs() - r.at(i, j).abs()).abs() < 1e-13, "{i} {j}");
        }
    }

    /// Few rows, odd numbers of columns, a column of zeros and rows that come after the triangle was read.
    #[test]
    fn every_shape_keeps_the_gram_matrix() {
        for (n, counts) in
            [(1, [1, 7]), (2, [3, 600]), (3, [256, 0]), (6, [300, 5]), (9, [4, 4]), (12, [513, 256])]
        {
            let entry =
                |k: usize, j: usize| if j == 1 { 0.0 } else { ((k * (j + 3) + j * j) as f64 * 0.37).sin() };
            let rows: Vec<Vec<f64>> =
                (0..counts[0] + counts[1]).map(|k| (0..n).map(|j| entry(k, j)).collect()).collect();
            let (mut r, mut block) = (Triangle::new(n), Block::new(n));
            for part in [&rows[..counts[0]], &rows[counts[0]..]] {
                part.iter().for_each(|row| block.push(row));
                r.absorb(&mut block);
            }
            for (i, j) in (0..n * n).map(|ij| (ij / n, ij % n)) {
                let gram: f64 = rows.iter().map(|x| x[i] * x[j]).sum();
                let ours: f64 = (0..n).map(|k| r.at(k, i) * r.at(k, j)).sum();
                assert!((gram - ours).abs() < 1e-13 * rows.len() as f64, "{n} {i} {j}");
            }
        }
    }
}
