//! The regression behind an impulse response, and both signals filtered so that its errors are white.
//!
//! ```text
//! D(q) y(t) = D(q) sum_k g_k u(t-k) + O + e(t),   rows begin where all taps lie in the segment
//! ```
//!
//! What acted before a segment is not known, and rows are dropped rather than filled: filled with the first `u`,
//! gain intervals covered the truth in 60 % instead of 95 %. The constant is the first column of the triangle,
//! so that dropping its row leaves the evidence under a flat prior of the offset. Source 001, (3.5-35);
//! METHODS 2.3 and 8.

use std::ops::Range;

use crate::linalg::Triangle;
use crate::record::{Record, Scale};
use crate::regress::{Column, Regression};
use crate::signal::through;

/// Rows per column from which y may stand on its own past beside all taps.
const ROWS: usize = 3;

/// Signals of one output, filtered by `D`.
pub(in super::super) struct Rows<'r, 'a> {
    rec: &'r Record<'a>,
    pub(in super::super) output: usize,
    /// First lag, and how many.
    pub(in super::super) first: usize,
    pub(in super::super) n: usize,
    /// `D(q)`, monic.
    pub(in super::super) D: Vec<f64>,
    u: Vec<f64>, // (N, nu)
    y: Vec<f64>, // (N)
}

impl<'r, 'a> Rows<'r, 'a> {
    pub(in super::super) fn new(
        rec: &'r Record<'a>,
        output: usize,
        first: usize,
        n: usize,
        D: Vec<f64>,
    ) -> Self {
        let mut u = vec![0.0; rec.u.len()];
        for i in 0..rec.nu {
            let filtered = through(&D, &rec.input(i), rec.segments());
            u.iter_mut().skip(i).step_by(rec.nu).zip(filtered).for_each(|(to, u)| *to = u);
        }
        let y = through(&D, &rec.output_held(output), rec.segments());
        Rows { rec, output, first, n, D, u, y }
    }

    /// The same filtered by another `D`.
    pub(in super::super) fn with(&self, D: Vec<f64>) -> Self {
        Rows::new(self.rec, self.output, self.first, self.n, D)
    }

    /// Filtered input `i`.
    pub(in super::super) fn input(&self, i: usize) -> Vec<f64> {
        self.u.iter().skip(i).step_by(self.rec.nu).copied().collect()
    }

    /// Filtered output.
    pub(in super::super) fn output(&self) -> &[f64] {
        &self.y
    }

    /// Rows with all taps and all of the filter behind them.
    pub(in super::super) fn runs(&self) -> Vec<Range<usize>> {
        let past = self.D.len() - 1;
        self.rec.runs(self.first + self.n - 1 + past, past, self.output)
    }

    /// Number of such rows.
    pub(in super::super) fn N(&self) -> usize {
        self.runs().iter().map(ExactSizeIterator::len).sum()
    }

    /// Rows that must be there, and one more: a constant and every tap.
    pub(in super::super) fn needed(&self) -> usize {
        1 + self.rec.nu * self.n
    }

    /// The most taps that the record has rows for.
    pub(in super::super) fn most_taps(&self) -> usize {
        let fits = |&n: &usize| {
            let rows = Rows { n, u: Vec::new(), y: Vec::new(), D: self.D.clone(), ..*self };
            rows.N() > rows.needed()
        };
        (1..self.n).rev().find(fits).unwrap_or(0)
    }

    /// Triangle of `[1 | taps of input 1 | … | y]`, and for each input the unit of its taps there.
    pub(in super::super) fn triangle(&self) -> (Triangle, Vec<f64>) {
        let rec = self.filtered();
        let regression = Regression::over(&rec, 0, self.columns(rec.nu), self.runs());
        let unit = |u: &Scale| u.factor / regression.y.factor;
        (regression.triangle(), regression.u.iter().map(unit).collect())
    }

    /// `D(q)` from `y = O + sum_k b_k u(t-k) - d_1 y(t-1) - … + e`, its order by AIC; none of few rows.
    ///
    /// The triangle is in the order of its columns, so that what `p` lags of y leave stands below their rows.
    pub(in super::super) fn noise_model(&self, most: usize) -> Option<Vec<f64>> {
        let rec = self.filtered();
        let known = self.needed();
        let runs = self.rec.runs((self.first + self.n - 1).max(most), most, self.output);
        let N: usize = runs.iter().map(ExactSizeIterator::len).sum();
        if N < ROWS * (known + most) {
            return None;
        }
        let own = (1..=most).map(Column::MinusOutput);
        let columns = self.columns(rec.nu).into_iter().chain(own).collect();
        let triangle = Regression::over(&rec, 0, columns, runs).triangle();
        let y = known + most;
        let left = |p: usize| (known + p..=y).map(|k| triangle.at(k, y).powi(2)).sum::<f64>();
        let aic = |p: usize| (N - known) as f64 * left(p).max(f64::MIN_POSITIVE).ln() + 2.0 * p as f64;
        let scores: Vec<f64> = (0..=most).map(aic).collect();
        let p = (0..=most).fold(0, |best, p| if scores[p] < scores[best] { p } else { best });
        let mut D = vec![1.0; 1 + p];
        for i in (1..=p).rev() {
            let row = known + i - 1;
            let later: f64 = (i + 1..=p).map(|j| triangle.at(row, known + j - 1) * D[j]).sum();
            D[i] = (triangle.at(row, y) - later) / triangle.at(row, row);
        }
        D.iter().all(|d| d.is_finite()).then_some(D)
    }

    /// Factor of y in that triangle.
    pub(in super::super) fn y_factor(&self) -> f64 {
        Scale::of(&self.y, true).factor
    }

    /// What the taps of all inputs leave of y without its mean, on the runs; zero elsewhere.
    pub(in super::super) fn residual(&self, g: &[Vec<f64>]) -> Vec<f64> {
        let mut e = vec![0.0; self.y.len()];
        let runs = self.runs();
        let levels: Vec<f64> = (0..self.rec.nu).map(|i| self.u[i]).collect();
        for t in runs.iter().flat_map(Clone::clone) {
            let explained = |(i, g): (usize, &Vec<f64>)| -> f64 {
                let at = |k: usize| self.u[(t - self.first - k) * self.rec.nu + i] - levels[i];
                g.iter().enumerate().map(|(k, g)| g * at(k)).sum()
            };
            e[t] = self.y[t] - self.y[0] - g.iter().enumerate().map(explained).sum::<f64>();
        }
        let mean = runs.iter().flat_map(Clone::clone).map(|t| e[t]).sum::<f64>() / self.N() as f64;
        runs.iter().flat_map(Clone::clone).for_each(|t| e[t] -= mean);
        e
    }

    /// `[1 | taps]`
    fn columns(&self, nu: usize) -> Vec<Column> {
        let lags = self.first..self.first + self.n;
        let taps = (0..nu).flat_map(|i| lags.clone().map(move |lag| Column::Input(i, lag)));
        std::iter::once(Column::One).chain(taps).collect()
    }

    /// The filtered signals as a record of one output.
    fn filtered(&self) -> Record<'_> {
        let names: Vec<String> = self.rec.names[..self.rec.nu]
            .iter()
            .chain([&self.rec.names[self.rec.nu + self.output]])
            .cloned()
            .collect();
        Record { u: &self.u, y: &self.y, ny: 1, names, valid: None, ..self.rec.clone() }
    }
}
