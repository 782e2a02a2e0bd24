//! QR of a tall matrix that arrives in blocks of rows; only the triangle is kept.
//!
//! Each block is stacked below the triangle and reflected into it (Householder), so the
//! result has the accuracy of a QR of the whole matrix while memory stays at one block.
//! Householder QR is invariant to column scaling, so scaling and pivoting wait until
//! the triangle is solved ([`super::solve`]).

/// Rows of a block: ten columns of it fit into the first-level cache, and no two of them begin 4096 bytes
/// apart, which would hold up loads behind stores.
pub const BLOCK: usize = 264;

/// Numbers in a cache line.
const LINE: usize = 8;

/// A block of rows, column by column, each column [`BLOCK`] long; unused rows are zero.
pub struct Block {
    data: Vec<f64>, // (BLOCK, n) column-major, behind `start`
    start: usize,
    rows: usize,
}

impl Block {
    /// Room for `n` columns, each beginning on a cache line: unaligned registers load at half speed.
    pub fn new(n: usize) -> Self {
        let data = vec![0.0; BLOCK * n + LINE];
        let start = data.as_ptr().align_offset(LINE * size_of::<f64>()).min(LINE);
        Block { data, start, rows: 0 }
    }

    /// Rows still free.
    pub fn free(&self) -> usize {
        BLOCK - self.rows
    }

    /// Column `j` of the next `len` rows, to be filled before [`Block::grow`].
    pub fn next_rows(&mut self, j: usize, len: usize) -> &mut [f64] {
        let first = self.start + j * BLOCK + self.rows;
        &mut self.data[first..first + len]
    }

    /// Declares `len` filled rows as part of the block.
    pub fn grow(&mut self, len: usize) {
        self.rows += len;
    }

    /// Appends one row.
    pub fn push(&mut self, row: &[f64]) {
        let columns = self.data[self.start..].chunks_exact_mut(BLOCK);
        for (column, &x) in columns.zip(row) {
            column[self.rows] = x;
        }
        self.rows += 1;
    }

    /// The columns, rows not filled set to zero.
    fn columns(&mut self, n: usize) -> &mut [f64] {
        let columns = &mut self.data[self.start..self.start + BLOCK * n];
        for column in columns.chunks_exact_mut(BLOCK) {
            column[self.rows..].fill(0.0);
        }
        columns
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

    /// Reflects the rows of `block` into the triangle and empties it.
    pub fn absorb(&mut self, block: &mut Block) {
        if block.rows == 0 {
            return;
        }
        super::kernel::absorb(&mut self.r, self.n, block.columns(self.n));
        block.rows = 0;
    }

    /// Absorbs every row that `rows` pushes into the block it is given.
    pub fn of_rows<'r>(n: usize, rows: impl Iterator<Item = &'r [f64]>) -> Self {
        let mut triangle = Triangle::new(n);
        let mut block = Block::new(n);
        for row in rows {
            block.push(row);
            if block.free() == 0 {
                triangle.absorb(&mut block);
            }
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
}
