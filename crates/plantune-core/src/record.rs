//! A record of inputs and outputs as the core sees it: a checked, borrowed view.
//!
//! `u[k]` acts from `t[k]` to `t[k+1]`; `y[k]` is read at `t[k]`. Gaps and several
//! experiments are the same thing: the first row of each contiguous segment.

use std::borrow::Cow;
use std::ops::Range;

use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::extent;
use crate::note::{Place, rounded};

/// Factor on D15: a step may be off by that much from the median, and the median from `Ts`.
const ODD: f64 = 2.05;

/// Inputs, outputs and what is known about them. Checked when made; see [`Record::new`].
#[derive(Clone, Debug)]
pub struct Record<'a> {
    /// Inputs, row-major `(N, nu)`.
    pub u: &'a [f64],
    /// Outputs, row-major `(N, ny)`.
    pub y: &'a [f64],
    /// Number of inputs.
    pub nu: usize,
    /// Number of outputs.
    pub ny: usize,
    /// Sample time, seconds.
    pub Ts: f64,
    /// Time of the first row, seconds.
    pub t0: f64,
    /// First row of each segment; starts with 0.
    pub starts: Vec<usize>,
    /// Which outputs count, `(N, ny)`; all when absent.
    pub valid: Option<&'a [bool]>,
    /// Square root of how much the error of each row counts; 1 when absent. See [`crate::batch::robust`].
    pub weights: Option<&'a [f64]>, // (N)
    /// Row numbers in the original file; `0..N` when absent.
    pub rows: Option<&'a [i64]>,
    /// Time of each row where it does not follow from `t0`, `Ts` and `rows`.
    pub t: Option<&'a [f64]>,
    /// Names of inputs, then of outputs.
    pub names: Vec<String>,
}

impl<'a> Record<'a> {
    /// One contiguous segment with every output valid.
    pub fn uniform(u: &'a [f64], nu: usize, y: &'a [f64], ny: usize, Ts: f64) -> Result<Self> {
        let numbered = |letter: &str, n: usize| -> Vec<String> {
            if n == 1 { vec![letter.to_owned()] } else { (1..=n).map(|i| format!("{letter}{i}")).collect() }
        };
        let names = [numbered("u", nu), numbered("y", ny)].concat();
        Record {
            u,
            y,
            nu,
            ny,
            Ts,
            t0: 0.0,
            starts: vec![0],
            valid: None,
            weights: None,
            rows: None,
            t: None,
            names,
        }
        .checked(&Limits::default())
    }

    /// The record itself, if its lengths agree and its numbers are finite (D04, D07 to D09).
    pub fn checked(self, limits: &Limits) -> Result<Self> {
        if !(self.Ts > 0.0 && self.Ts.is_finite()) {
            return Err(Error::argument("Ts", self.Ts, "a positive number of seconds"));
        }
        if self.nu == 0 || self.ny == 0 {
            return Err(Error::new("D10", "a record needs at least one input and one output column"));
        }
        let (nu_rows, ny_rows) = (self.u.len() / self.nu, self.y.len() / self.ny);
        if nu_rows != ny_rows {
            return Err(Error::new("D09", format!("u has {nu_rows} rows and y has {ny_rows}"))
                .at(Place { column: self.names[0].clone(), row: Some(nu_rows.min(ny_rows)), time: None })
                .count(nu_rows.abs_diff(ny_rows))
                .remedy("cut both to the rows they share, after finding out which rows those are"));
        }
        if self.N() < 2 {
            return Err(Error::new("D04", format!("the record has {} rows", self.N()))
                .measured(self.N() as f64, 2.0)
                .remedy("give a record with rows of data below the header"));
        }
        self.check_starts()?;
        self.check_ascending()?;
        self.check_lost(limits)?;
        self.check_finite(self.u, self.nu, 0, limits)?;
        self.check_finite(self.y, self.ny, self.nu, limits)?;
        Ok(self)
    }

    /// D15: stamps that are not uniform, where only some estimators can serve.
    pub fn check_uniform(&self, limits: &Limits) -> Result<()> {
        let (Some(t), Some(k)) = (self.t, self.first_odd_step(limits)) else { return Ok(()) };
        let off = ((t[k] - t[k - 1]) / self.Ts - 1.0).abs();
        let text = format!(
            "not uniformly sampled: a step is off by {:.0} % of Ts = {} s",
            100.0 * off,
            rounded(self.Ts)
        );
        Err(Error::new("D15", text)
            .at(Place { column: "time".into(), row: Some(k), time: Some(t[k]) })
            .measured(off, ODD * limits.D15)
            .remedy(format!(
                "prep.resample(rec, {}) first; estimate.process takes such stamps as they are",
                rounded(self.Ts)
            )))
    }

    /// Whether the stamps are not uniform.
    pub fn is_irregular(&self, limits: &Limits) -> bool {
        self.first_odd_step(limits).is_some()
    }

    /// The row behind the first step within a segment that is not one of `Ts`.
    fn first_odd_step(&self, limits: &Limits) -> Option<usize> {
        let t = self.t?;
        let odd = |k: &usize| !(((t[*k] - t[k - 1]) / self.Ts - 1.0).abs() <= ODD * limits.D15);
        self.segments().flat_map(|s| s.start + 1..s.end).find(odd)
    }

    /// Number of rows.
    pub fn N(&self) -> usize {
        self.u.len() / self.nu
    }

    /// Rows of each segment.
    pub fn segments(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        let ends = self.starts.iter().skip(1).copied().chain([self.N()]);
        self.starts.iter().copied().zip(ends).map(|(start, end)| start..end)
    }

    /// Whether output `i` of row `k` counts.
    pub fn is_valid(&self, k: usize, i: usize) -> bool {
        self.valid.is_none_or(|valid| valid[k * self.ny + i])
    }

    /// Runs of rows with `history` rows before them in their segment, at which output `output`
    /// counts at the row itself and at the `na` rows before it.
    pub fn runs(&self, history: usize, na: usize, output: usize) -> Vec<Range<usize>> {
        let whole = self.segments().map(|s| (s.start + history).min(s.end)..s.end);
        if self.valid.is_none() {
            return whole.filter(|run| !run.is_empty()).collect();
        }
        let mut runs = Vec::new();
        for range in whole {
            let usable = |k: usize| (k - na.min(k)..=k).all(|j| self.is_valid(j, output));
            let mut k = range.start;
            while k < range.end {
                let start = k;
                while k < range.end && usable(k) {
                    k += 1;
                }
                if k > start {
                    runs.push(start..k);
                }
                k += 1;
            }
        }
        runs
    }

    /// First and last original row of each stretch of consecutive ones.
    pub fn row_ranges(&self) -> Vec<[i64; 2]> {
        let mut ranges = Vec::new();
        for s in self.segments() {
            let Some(rows) = self.rows.map(|rows| &rows[s.clone()]) else {
                ranges.push([s.start as i64, s.end as i64 - 1]);
                continue;
            };
            let (first, last) = (rows[0], rows[rows.len() - 1]);
            if last - first == rows.len() as i64 - 1 {
                ranges.push([first, last]); // the usual segment is one stretch
                continue;
            }
            ranges.extend(rows.chunk_by(|a, b| b - a == 1).map(|run| [run[0], run[run.len() - 1]]));
        }
        ranges
    }

    /// Where row `k` of a column stands in the original file and in time.
    pub fn place(&self, column: usize, k: usize) -> Place {
        let row = self.rows.map_or(k, |rows| rows[k] as usize);
        let column = self.names.get(column).cloned().unwrap_or_default();
        Place { column, row: Some(row), time: Some(self.time(k)) }
    }

    /// Time of row `k`, seconds.
    pub fn time(&self, k: usize) -> f64 {
        let row = |k: usize| self.rows.map_or(k as f64, |rows| rows[k] as f64);
        self.t.map_or_else(|| self.t0 + (row(k) - row(0)) * self.Ts, |t| t[k])
    }

    /// Input `i` as a contiguous column.
    pub fn input(&self, i: usize) -> Cow<'a, [f64]> {
        contiguous(self.u, self.nu, i)
    }

    /// Output `i` as a contiguous column.
    pub fn output(&self, i: usize) -> Cow<'a, [f64]> {
        contiguous(self.y, self.ny, i)
    }

    /// Output `i` as a contiguous column, the last counting value held where it does not count.
    pub fn output_held(&self, i: usize) -> Cow<'a, [f64]> {
        if self.valid.is_none() {
            return self.output(i);
        }
        let first = (0..self.N()).find(|&k| self.is_valid(k, i)).unwrap_or(0);
        let mut last = self.y_at(first, i);
        let mut hold = |k: usize| {
            if self.is_valid(k, i) {
                last = self.y_at(k, i);
            }
            last
        };
        (0..self.N()).map(&mut hold).collect()
    }

    /// Input `i` as a name.
    pub fn input_name(&self, i: usize) -> &str {
        &self.names[i]
    }

    /// Row `k` of input `i`.
    pub fn u_at(&self, k: usize, i: usize) -> f64 {
        self.u[k * self.nu + i]
    }

    /// Row `k` of output `i`.
    pub fn y_at(&self, k: usize, i: usize) -> f64 {
        self.y[k * self.ny + i]
    }

    fn check_starts(&self) -> Result<()> {
        let sorted = self.starts.first() == Some(&0)
            && self.starts.windows(2).all(|w| w[0] < w[1])
            && self.starts.last().is_some_and(|&s| s < self.N());
        if sorted {
            Ok(())
        } else {
            Err(Error::argument("starts", format!("{:?}", self.starts), "ascending rows that begin with 0"))
        }
    }

    /// D13: stamps that do not ascend within a segment.
    fn check_ascending(&self) -> Result<()> {
        let Some(t) = self.t else { return Ok(()) };
        let back = |k: &usize| !(t[*k] > t[k - 1]);
        let Some(k) = self.segments().flat_map(|s| s.start + 1..s.end).find(back) else { return Ok(()) };
        Err(Error::new("D13", format!("`t` does not ascend: {} s after {} s", t[k], t[k - 1]))
            .at(Place { column: "t".into(), row: Some(k), time: Some(t[k]) })
            .remedy("sort the rows by their stamps, or begin a segment there: starts"))
    }

    /// D07: too many outputs that do not count.
    fn check_lost(&self, limits: &Limits) -> Result<()> {
        let Some(valid) = self.valid else { return Ok(()) };
        for i in 0..self.ny {
            let lost = valid.iter().skip(i).step_by(self.ny).filter(|v| !**v).count();
            let share = lost as f64 / self.N() as f64;
            if share > limits.D07 {
                let first = (0..self.N()).find(|&k| !self.is_valid(k, i)).unwrap_or(0);
                let place = self.place(self.nu + i, first);
                return Err(Error::new(
                    "D07",
                    format!("{lost} of {} values of `{}` do not count", self.N(), place.column),
                )
                .at(place)
                .count(lost)
                .measured(share, limits.D07)
                .remedy("use a stretch of the record with fewer holes"));
            }
        }
        Ok(())
    }

    /// D07 and D08, column by column, at full speed while all is well.
    fn check_finite(&self, x: &[f64], width: usize, offset: usize, limits: &Limits) -> Result<()> {
        // No early exit: this form compiles to a few vector instructions per cache line.
        if x.iter().fold(true, |fine, v| fine & (v.abs() <= limits.D08)) {
            return Ok(());
        }
        let bad = |v: &f64| !(v.abs() <= limits.D08);
        let first = x.iter().position(bad).unwrap_or(0);
        let (row, column) = (first / width, first % width);
        let same_kind = |v: &&f64| bad(v) && v.is_nan() == x[first].is_nan();
        let count = x.iter().skip(column).step_by(width).filter(same_kind).count();
        let place = self.place(offset + column, row);
        let name = place.column.clone();
        Err(if x[first].is_nan() {
            Error::new("D07", format!("`{name}` is missing (NaN) in {count} of {} rows", self.N()))
                .measured(count as f64 / self.N() as f64, 0.0)
                .remedy("read with missing=\"segments\" to cut the record there, or mark rows in `valid`")
        } else {
            Error::new("D08", format!("`{name}` is infinite or beyond {:e} in {count} rows", limits.D08))
                .measured(x[first].abs(), limits.D08)
                .remedy("remove these rows or change the unit of the column")
        }
        .at(place)
        .count(count))
    }
}

fn contiguous(x: &[f64], width: usize, i: usize) -> Cow<'_, [f64]> {
    if width == 1 { Cow::Borrowed(x) } else { x.iter().skip(i).step_by(width).copied().collect() }
}

/// Shift and power-of-two scale that bring a column to unit size without rounding its steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The column's first value.
    pub zero: f64,
    /// Factor applied after the shift.
    pub factor: f64,
}

impl Scale {
    /// Centred on the first value, if `centred`, and at most one in magnitude.
    pub fn of(column: &[f64], centred: bool) -> Self {
        let zero = if centred { column.first().copied().unwrap_or(0.0) } else { 0.0 };
        let (low, high) = extent(column);
        let travel = (high - zero).max(zero - low);
        let factor =
            if travel > 0.0 { 2f64.powi(-(travel.log2().ceil() as i32).clamp(-1000, 1000)) } else { 1.0 };
        Scale { zero, factor }
    }

    /// The scaled value.
    pub fn apply(&self, x: f64) -> f64 {
        (x - self.zero) * self.factor
    }
}

/// Mean step between stamps that follow each other within a segment; none where no two do.
pub fn mean_step(t: &[f64], starts: &[usize]) -> Option<f64> {
    let within = |k: &usize| starts.binary_search(k).is_err();
    let steps = (1..t.len()).filter(within).map(|k| t[k] - t[k - 1]);
    let (sum, count) = steps.fold((0.0, 0usize), |(sum, n), d| (sum + d, n + 1));
    (count > 0).then(|| sum / count as f64)
}

/// Fingerprint of a record's numbers, sample time and segments: 32 hexadecimal digits.
pub fn fingerprint(rec: &Record) -> String {
    let mut hash = xxhash_rust::xxh3::Xxh3::new();
    let mut feed = |x: &[f64]| {
        let mut bytes = [0u8; 8 * 512];
        for chunk in x.chunks(512) {
            for (b, v) in bytes.chunks_exact_mut(8).zip(chunk) {
                b.copy_from_slice(&v.to_le_bytes());
            }
            hash.update(&bytes[..chunk.len() * 8]);
        }
    };
    feed(&[rec.nu as f64, rec.ny as f64, rec.Ts, rec.t0]);
    feed(rec.u);
    feed(rec.y);
    rec.starts.iter().for_each(|&s| feed(&[s as f64]));
    if let Some(t) = rec.t.filter(|_| rec.is_irregular(&Limits::default())) {
        feed(t);
    }
    if let Some(valid) = rec.valid {
        valid.iter().enumerate().filter(|(_, v)| !**v).for_each(|(k, _)| feed(&[k as f64]));
    }
    format!("{:032x}", hash.digest128())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_skip_history_and_invalid_outputs() {
        let (u, y) = ([0.0; 10], [1.0; 10]);
        let mut rec = Record::uniform(&u, 1, &y, 1, 0.1).expect("fine");
        rec.starts = vec![0, 6];
        assert_eq!(rec.runs(2, 1, 0), vec![2..6, 8..10]);
        let mut valid = [true; 10];
        valid[3] = false;
        rec.valid = Some(&valid);
        assert_eq!(rec.runs(2, 1, 0), vec![2..3, 5..6, 8..10]);
    }

    #[test]
    fn a_missing_value_is_named_with_row_and_count() {
        let (u, mut y) = ([0.0; 10], [1.0; 10]);
        y[4] = f64::NAN;
        y[7] = f64::NAN;
        let error = Record::uniform(&u, 1, &y, 1, 0.5).expect_err("NaN");
        let place = error.note().place.clone().expect("a place");
        assert_eq!((error.code(), place.row, place.time), ("D07", Some(4), Some(2.0)));
        assert_eq!(error.note().count, Some(2));
    }
}
