//! One signal of a record, an input or an output, over the rows that count.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::linalg::{extent, sum};
use crate::note::Place;
use crate::record::Record;

/// Fewest rows of which a spectrum or a correlation says anything.
const FEWEST: usize = 16;

/// A signal and its runs of rows that count.
pub struct Column {
    /// Every row; where an output does not count, its last value before.
    pub x: Vec<f64>, // (N)
    /// Runs of rows that count, within the segments.
    pub runs: Vec<Range<usize>>,
    /// Name.
    pub name: String,
    /// Sample time, s.
    pub Ts: f64,
}

impl Column {
    /// Signal `column` of the record, inputs counting before outputs. Refuses one that is short (X03) or
    /// stands still (D18).
    pub fn of(rec: &Record, column: usize) -> Result<Self> {
        let runs = if column < rec.nu { rec.segments().collect() } else { rec.runs(0, 0, column - rec.nu) };
        let x =
            if column < rec.nu { rec.input(column) } else { rec.output_held(column - rec.nu) }.into_owned();
        let it = Column { x, runs, name: rec.names[column].clone(), Ts: rec.Ts };
        if it.N() < FEWEST {
            return Err(short(&it.name, it.N(), FEWEST));
        }
        let (low, high) = extent(&it.counted());
        if low < high {
            return Ok(it);
        }
        Err(Error::new("D18", format!("`{}` keeps one value, {low}: there is nothing to analyse", it.name))
            .at(rec.place(column, 0))
            .count(it.N())
            .remedy("choose another signal, or a stretch of the record on which it moves"))
    }

    /// Rows that count.
    pub fn N(&self) -> usize {
        self.runs.iter().map(Range::len).sum()
    }

    /// Values that count, one run behind the other.
    pub fn counted(&self) -> Vec<f64> {
        self.runs.iter().flat_map(|run| &self.x[run.clone()]).copied().collect()
    }

    /// The signal less the mean of each run.
    pub fn without_means(&self) -> Vec<f64> {
        without_means(&self.x, &self.runs)
    }
}

/// A signal less the mean of each run, at the rows of the runs.
pub fn without_means(x: &[f64], runs: &[Range<usize>]) -> Vec<f64> {
    let mut centred = x.to_vec();
    for run in runs {
        let mean = sum(&x[run.clone()]) / run.len() as f64;
        centred[run.clone()].iter_mut().for_each(|x| *x -= mean);
    }
    centred
}

/// X03: too few rows.
pub fn short(name: &str, N: usize, needed: usize) -> Error {
    Error::new("X03", format!("`{name}` has {N} rows in a row that count, {needed} are needed"))
        .at(Place::column(name))
        .count(N)
        .measured(N as f64, needed as f64)
        .remedy("record longer, or ask for a coarser resolution")
}
