//! The record as block Hankel matrices, compressed by QR.
//!
//! ```text
//! [1; Uf; Up; Yp; Yf] = L Q,    x_p, x_f: rows 0 … s-1 and s … 2s-1 of  [x(t) … x(t+2s-1)]'
//! ```
//!
//! One column for every `t` whose `2s` rows lie in one stretch without a gap. The first row, of ones, takes the
//! constants out of all others and is then left away, and everything that follows works in the coordinates of
//! `Q`: no step sees the record again, but the regressions that say so. Verhaegen 1994; SLICOT IB01MD.

use std::ops::Range;

use crate::linalg::{Matrix, Triangle, lower, triangle_of};
use crate::record::Record;

/// Rows reflected at once, in numbers of columns: memory stays bounded, and the triangle above costs a quarter.
const PART: usize = 4;

/// A column of the record in units of its own.
pub struct Column {
    /// Scaled values.
    pub x: Vec<f64>,
    /// What is zero.
    pub zero: f64,
    /// How much is one.
    pub unit: f64,
}

/// The record scaled, and its stretches.
pub struct Signals {
    /// Inputs.
    pub u: Vec<Column>,
    /// Outputs.
    pub y: Vec<Column>,
    /// Rows of each stretch at which every output counts.
    pub stretches: Vec<Range<usize>>,
}

/// `L` with the sizes of its blocks.
pub struct Factor {
    /// Block rows.
    pub s: usize,
    /// Inputs and outputs.
    pub m: usize,
    /// Outputs.
    pub l: usize,
    /// Lower triangle over `Uf, Up, Yp, Yf`.
    pub L: Matrix,
}

impl Column {
    /// About its mean, if `centred`, and in root mean squares of what is left.
    fn of(x: &[f64], centred: bool) -> Self {
        let mean = |f: &dyn Fn(&f64) -> f64| x.iter().map(f).sum::<f64>() / x.len() as f64;
        let zero = if centred { x[0] + mean(&|value| value - x[0]) } else { 0.0 };
        let unit = mean(&|x| (x - zero).powi(2)).sqrt();
        let unit = if unit > 0.0 { unit } else { 1.0 };
        Column { x: x.iter().map(|x| (x - zero) / unit).collect(), zero, unit }
    }
}

impl Signals {
    /// Each column scaled, about its mean where there is an offset.
    pub fn of(rec: &Record, offset: bool) -> Self {
        Signals {
            u: (0..rec.nu).map(|i| Column::of(&rec.input(i), offset)).collect(),
            y: (0..rec.ny).map(|i| Column::of(&rec.output_held(i), offset)).collect(),
            stretches: stretches(rec),
        }
    }

    /// Columns of a Hankel matrix of `2 s` rows.
    pub fn columns(&self, s: usize) -> usize {
        self.columns_of(2 * s)
    }

    /// Columns of a Hankel matrix of so many rows.
    pub fn columns_of(&self, span: usize) -> usize {
        self.stretches.iter().map(|r| (r.len() + 1).saturating_sub(span)).sum()
    }

    /// The most block rows, up to `wanted`, that leave at least twice as many columns as the past has rows; at
    /// least `least`.
    pub fn block_rows(&self, wanted: usize, least: usize) -> Option<usize> {
        let wide = self.u.len() + self.y.len();
        let enough = |s: &usize| self.columns(*s) > 2 * s * wide;
        (least..=wanted).rev().find(enough)
    }

    /// The compressed Hankel matrix.
    pub fn factor(&self, s: usize, offset: bool) -> Factor {
        let (m, l) = (self.u.len(), self.y.len());
        let blocks =
            [rows(&self.u, s..2 * s), rows(&self.u, 0..s), rows(&self.y, 0..s), rows(&self.y, s..2 * s)];
        Factor { s, m, l, L: lower(&self.triangle(&blocks.concat(), 2 * s, offset)) }
    }

    /// Triangle of the columns `x(t + row)` for every `t` whose `span` rows lie in one stretch, without their
    /// constants where there is an offset.
    pub fn triangle(&self, rows: &[(&[f64], usize)], span: usize, offset: bool) -> Triangle {
        let one = usize::from(offset);
        let width = one + rows.len();
        let mut triangle = Triangle::new(width);
        let columns: Vec<usize> =
            self.stretches.iter().flat_map(|s| s.start..(s.end + 1).saturating_sub(span)).collect();
        for part in columns.chunks(PART * width) {
            let above = if part[0] == columns[0] { 0 } else { width };
            let mut M = Matrix::zeros(above + part.len(), width);
            (0..above).for_each(|i| (i..width).for_each(|j| M[(i, j)] = triangle.at(i, j)));
            if offset {
                M.view_mut((above, 0), (part.len(), 1)).fill(1.0);
            }
            for (j, (x, row)) in rows.iter().enumerate() {
                let height = M.nrows();
                M.as_mut_slice()[(one + j) * height..][above..height]
                    .iter_mut()
                    .zip(part)
                    .for_each(|(entry, t)| *entry = x[t + row]);
            }
            triangle = triangle_of(M);
        }
        triangle.below(one)
    }
}

/// The block rows of some signals: row after row, all signals in each.
pub fn rows(signals: &[Column], range: Range<usize>) -> Vec<(&[f64], usize)> {
    range.flat_map(|row| signals.iter().map(move |x| (&x.x[..], row))).collect()
}

impl Factor {
    /// Rows of `Uf`.
    pub fn future(&self) -> usize {
        self.s * self.m
    }

    /// Rows of `Uf, Up, Yp`, those of `Yf` follow.
    pub fn known(&self) -> usize {
        self.s * (2 * self.m + self.l)
    }

    /// A block by its rows and columns.
    pub fn block(&self, rows: Range<usize>, columns: Range<usize>) -> Matrix {
        self.L.view((rows.start, columns.start), (rows.len(), columns.len())).into_owned()
    }

    /// All rows.
    pub fn all(&self) -> usize {
        self.L.nrows()
    }
}

/// Runs of rows inside a segment at which every output counts.
fn stretches(rec: &Record) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    for s in rec.segments() {
        let counts = |k: &usize| (0..rec.ny).all(|i| rec.is_valid(*k, i));
        let rows: Vec<usize> = s.filter(counts).collect();
        found.extend(rows.chunk_by(|a, b| a + 1 == *b).map(|run| run[0]..run[run.len() - 1] + 1));
    }
    found
}
