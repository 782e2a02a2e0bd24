//! Whether the parts of a signal have one mean and one variance.
//!
//! ```text
//! z_mean = (mean1 - mean2)/sqrt(var1/N1 + var2/N2),       N_i = N/(1 + 2 sum R(l))
//! z_var  = ln(var1/var2)/sqrt(k1/N1 + k2/N2),  N_i = N/(1 + 2 sum R(l)^2),  k = E x^4/var^2 - 1 (2 of a normal law)
//! ```
//!
//! Each part is compared with the next; the least p-value counts as often as there are pairs. Rows that hang together
//! are fewer than they look: plain F and t tests reject most records of coloured noise that never changed. Below ten
//! independent rows nothing is tested. False alarms at p < 0.01, halves of 1000 rows: 0.013 and 0.007 of white noise,
//! 0.017 and 0.020 at AR(0.9).

use std::ops::Range;

use super::super::column::{Column, short};
use super::Moments;
use super::colour::colour;
use crate::error::{Error, Result};
use crate::stats::normal_tails;

/// Independent rows below which parts are not compared.
pub(super) const FEWEST: f64 = 10.0;

/// Rows of a part below which its correlation is not known.
const ROWS: usize = 16;

/// One part.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its rows of the record.
    pub rows: Range<usize>,
    /// Level and power.
    pub moments: Moments,
    /// Independent rows for its mean.
    pub N_mean: f64,
    /// Independent rows for its variance.
    pub N_var: f64,
    /// `E x^4/var^2 - 1`.
    pub kurtosis: f64,
}

/// The parts, and the chance that they are of one kind.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// In the order of the rows.
    pub parts: Vec<Part>,
    /// p-value of equal means; absent where a part has too few independent rows.
    pub p_mean: Option<f64>,
    /// p-value of equal variances.
    pub p_var: Option<f64>,
}

/// Compares the runs of a signal if there are several, else `count` equal parts, by default two.
pub fn compare(of: &Column, count: Option<usize>) -> Result<Comparison> {
    if let Some(count) = count.filter(|&count| count < 2 || count * ROWS > of.N()) {
        let most = (of.N() / ROWS).max(2);
        return Err(Error::argument("parts", count, &format!("from 2 to {most}: a part needs {ROWS} rows")));
    }
    let runs: Vec<Range<usize>> = of.runs.iter().filter(|run| run.len() >= ROWS).cloned().collect();
    let ranges = match count {
        None if runs.len() > 1 => runs,
        _ => divided(&of.runs, count.unwrap_or(2)),
    };
    let parts = ranges.into_iter().map(|rows| part(of, rows)).collect::<Result<Vec<Part>>>()?;
    let enough = parts.iter().all(|p| p.N_mean.min(p.N_var) >= FEWEST);
    let pairs = parts.len() as f64 - 1.0;
    let least = |z: fn(&Part, &Part) -> f64| {
        let p = parts.windows(2).map(|pair| normal_tails(z(&pair[0], &pair[1]))).fold(1.0, f64::min);
        enough.then_some((p * pairs).min(1.0))
    };
    Ok(Comparison { p_mean: least(means_apart), p_var: least(variances_apart), parts })
}

/// `count` parts of about as many rows each; a part spans the gaps inside it.
fn divided(runs: &[Range<usize>], count: usize) -> Vec<Range<usize>> {
    let rows: Vec<usize> = runs.iter().cloned().flatten().collect();
    let edge = |k: usize| k * rows.len() / count;
    (0..count).map(|k| rows[edge(k)]..rows[edge(k + 1) - 1] + 1).collect()
}

fn part(of: &Column, rows: Range<usize>) -> Result<Part> {
    let inside = |run: &Range<usize>| run.start.max(rows.start)..run.end.min(rows.end);
    let runs: Vec<Range<usize>> = of.runs.iter().map(inside).filter(|run| !run.is_empty()).collect();
    let y: Vec<f64> = runs.iter().flat_map(|run| &of.x[run.clone()]).copied().collect();
    let moments = Moments::of(&y);
    if !(moments.var > 0.0) {
        return Ok(Part { rows, moments, N_mean: 0.0, N_var: 0.0, kurtosis: 2.0 });
    }
    let x: Vec<f64> = of.x.iter().map(|x| x - moments.mean).collect();
    if runs.iter().all(|run| run.len() < 8) {
        return Err(short(&of.name, y.len(), ROWS));
    }
    let colour = colour(&x, &runs, None)?;
    let fourth = y.iter().map(|y| (y - moments.mean).powi(4)).sum::<f64>() / y.len() as f64;
    let kurtosis = (fourth / moments.var.powi(2) - 1.0).max(0.1);
    Ok(Part { rows, moments, N_mean: colour.N_mean, N_var: colour.N_var, kurtosis })
}

fn means_apart(a: &Part, b: &Part) -> f64 {
    let own = |p: &Part| p.moments.var / p.N_mean;
    (a.moments.mean - b.moments.mean) / (own(a) + own(b)).sqrt()
}

fn variances_apart(a: &Part, b: &Part) -> f64 {
    let own = |p: &Part| p.kurtosis / p.N_var;
    (a.moments.var / b.moments.var).ln() / (own(a) + own(b)).sqrt()
}
