//! Regressions on a record's lagged columns, produced block by block and never held.

use std::ops::Range;

use crate::linalg::{Block, Triangle, scale_into};
use crate::record::{Record, Scale};

/// One column of a regressor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Column {
    /// `-y(t - lag)` of the output.
    MinusOutput(usize),
    /// `u_i(t - lag)`: input, lag.
    Input(usize, usize),
    /// The constant 1.
    One,
}

/// The rows `[columns | y(t)]` of one output of a record, centred and scaled.
pub struct Regression<'r, 'a> {
    rec: &'r Record<'a>,
    output: usize,
    columns: Vec<Column>,
    runs: Vec<Range<usize>>,
    /// Shift and scale of each input.
    pub u: Vec<Scale>,
    /// Shift and scale of the output.
    pub y: Scale,
}

impl<'r, 'a> Regression<'r, 'a> {
    /// Rows start where all lagged data exist; centred on the first row if a constant can take up the shift.
    pub fn new(rec: &'r Record<'a>, output: usize, columns: Vec<Column>) -> Self {
        let na = columns.iter().map(|c| if let Column::MinusOutput(lag) = c { *lag } else { 0 }).max();
        let history = columns
            .iter()
            .map(|c| match c {
                Column::MinusOutput(lag) | Column::Input(_, lag) => *lag,
                Column::One => 0,
            })
            .max();
        let runs = rec.runs(history.unwrap_or(0), na.unwrap_or(0), output);
        Regression::over(rec, output, columns, runs)
    }

    /// On these rows, which have all lagged data.
    pub fn over(rec: &'r Record<'a>, output: usize, columns: Vec<Column>, runs: Vec<Range<usize>>) -> Self {
        let centred = columns.contains(&Column::One);
        let u = (0..rec.nu).map(|i| Scale::of(&rec.input(i), centred)).collect();
        let y = Scale::of(&rec.output_held(output), centred);
        Regression { rec, output, columns, runs, u, y }
    }

    /// Number of rows.
    pub fn N(&self) -> usize {
        self.runs.iter().map(Range::len).sum()
    }

    /// Rows that count, each range without a break.
    pub fn runs(&self) -> &[Range<usize>] {
        &self.runs
    }

    /// The rows `[columns | y]` of such a range, column by column.
    pub fn rows(&self, run: &Range<usize>) -> Vec<Vec<f64>> {
        let mut all = vec![vec![0.0; run.len()]; self.columns.len() + 1];
        let (y, columns) = all.split_last_mut().expect("y at least");
        columns.iter_mut().zip(&self.columns).for_each(|(to, &column)| self.fill(column, run.start, to));
        self.fill_output(0, run.start, 1.0, y);
        all
    }

    /// Triangle of `[columns | y]` over all rows.
    pub fn triangle(&self) -> Triangle {
        let n = self.columns.len();
        let mut triangle = Triangle::new(n + 1);
        let mut block = Block::new(n + 1);
        for run in &self.runs {
            let mut t = run.start;
            while t < run.end {
                let len = block.free().min(run.end - t);
                for (j, &column) in self.columns.iter().enumerate() {
                    self.fill(column, t, block.next_rows(j, len));
                }
                self.fill_output(0, t, 1.0, block.next_rows(n, len));
                if let Some(weights) = self.rec.weights {
                    block.weigh(&weights[t..t + len]);
                }
                block.grow(len);
                t += len;
            }
        }
        triangle.absorb(&mut block);
        triangle
    }

    /// Rows of the record, and `[columns | y]` on them, row-major.
    pub fn all_rows(&self) -> (Vec<usize>, Vec<f64>) {
        let width = self.columns.len() + 1;
        let at: Vec<usize> = self.runs.iter().flat_map(Clone::clone).collect();
        let mut rows = vec![0.0; at.len() * width];
        let mut column = Vec::new();
        let mut from = 0;
        for run in &self.runs {
            column.resize(run.len(), 0.0);
            for j in 0..width {
                match self.columns.get(j) {
                    Some(&lagged) => self.fill(lagged, run.start, &mut column),
                    None => self.fill_output(0, run.start, 1.0, &mut column),
                }
                let own = rows[from * width..].iter_mut().skip(j).step_by(width);
                own.zip(&column).for_each(|(to, x)| *to = *x);
            }
            from += run.len();
        }
        (at, rows)
    }

    fn fill(&self, column: Column, t: usize, out: &mut [f64]) {
        match column {
            Column::One => out.fill(1.0),
            Column::MinusOutput(lag) => self.fill_output(lag, t, -1.0, out),
            Column::Input(i, lag) => {
                copy_scaled(self.rec.u, self.rec.nu, i, t - lag, self.u[i], 1.0, out);
            }
        }
    }

    fn fill_output(&self, lag: usize, t: usize, sign: f64, out: &mut [f64]) {
        copy_scaled(self.rec.y, self.rec.ny, self.output, t - lag, self.y, sign, out);
    }
}

/// Column `i` of the row-major `x` from row `t` on, shifted and scaled.
fn copy_scaled(x: &[f64], width: usize, i: usize, t: usize, scale: Scale, sign: f64, out: &mut [f64]) {
    let factor = sign * scale.factor;
    if width == 1 {
        scale_into(out, &x[t..], scale.zero, factor);
    } else {
        for (o, v) in out.iter_mut().zip(x[t * width + i..].iter().step_by(width)) {
            *o = (v - scale.zero) * factor;
        }
    }
}
