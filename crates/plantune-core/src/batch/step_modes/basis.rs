//! The columns `phi_j(t)` of one piece of a record and their slopes along `q`, on any time stamps.
//!
//! ```text
//! r(t + h) = r(t) Phi,   dr(t + h) = dr(t) Phi + r(t) dPhi,   Phi = e^(A h),   r(0) = e_1'
//! ```
//!
//! On a uniform grid the known rows are doubled: `r(t + n h) = r(t) Phi^n` for all of them at once. On uneven
//! stamps each interval is put together from halves of the longest one, and Taylor's sum for the rest.

use super::sections::Sections;
use super::sloped::Sloped;
use crate::linalg::vectorised;

/// Share by which intervals may differ and still be one.
const SAME: f64 = 1e-9;

/// Columns of a piece, for `k` states and `k` parameters.
pub(super) struct Basis {
    k: usize,
    len: usize,
    columns: Vec<f64>, // (1 + k, k, len): values, then their slopes along each parameter
    row: Vec<f64>,     // room for one doubling
}

impl Basis {
    /// Room for `k` columns over `len` rows.
    pub(super) fn new(k: usize, len: usize) -> Self {
        Basis { k, len, columns: vec![0.0; (1 + k) * k * len], row: vec![0.0; len] }
    }

    /// Column `j`: of the values (part 0) or of the slopes along parameter `part - 1`.
    pub(super) fn column(&self, part: usize, j: usize) -> &[f64] {
        &self.columns[(part * self.k + j) * self.len..][..self.len]
    }

    /// The slope of `phi c` along parameter `s`, into `out`.
    pub(super) fn slope_times(&self, s: usize, c: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (j, c) in c.iter().enumerate() {
            out.iter_mut().zip(self.column(1 + s, j)).for_each(|(out, x)| *out += c * x);
        }
    }

    /// Fills the columns for stamps that begin with 0.
    pub(super) fn fill(&mut self, sections: &Sections, t: &[f64]) {
        if self.k == 0 {
            return;
        }
        let A = sections.matrix();
        for part in 0..=self.k {
            for j in 0..self.k {
                self.columns[(part * self.k + j) * self.len] = f64::from(u8::from(part == 0 && j == 0));
            }
        }
        let h = t.get(1).copied().unwrap_or(1.0);
        if t.windows(2).all(|w| (w[1] - w[0] - h).abs() <= SAME * h) {
            vectorised(|| self.double(A.exponential(h)));
        } else {
            self.step(&A, t);
        }
    }

    #[inline(always)]
    fn double(&mut self, mut step: Sloped) {
        let mut known = 1;
        while known < self.len {
            let more = known.min(self.len - known);
            for part in 0..=self.k {
                for j in 0..self.k {
                    self.advance(&step, part, j, known, more);
                }
            }
            known += more;
            if known < self.len {
                step = step.times(&step);
            }
        }
    }

    /// Column `j` of a part, `more` rows from row `known` on, out of the first rows of all columns.
    #[inline(always)]
    fn advance(&mut self, step: &Sloped, part: usize, j: usize, known: usize, more: usize) {
        let (k, len) = (self.k, self.len);
        let row = &mut self.row[..more];
        row.fill(0.0);
        let mut add = |from: usize, by: &[f64]| {
            for l in 0..k {
                let (x, phi) = (&self.columns[(from * k + l) * len..][..more], by[l * k + j]);
                row.iter_mut().zip(x).for_each(|(out, x)| *out += phi * x);
            }
        };
        add(part, step.part(0));
        if part > 0 {
            add(0, step.part(part));
        }
        self.columns[(part * k + j) * len + known..][..more].copy_from_slice(row);
    }

    fn step(&mut self, A: &Sloped, t: &[f64]) {
        let (k, len) = (self.k, self.len);
        let longest = t.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        let strides = Strides::new(A, longest);
        let mut row = vec![0.0; (1 + k) * k];
        let mut room = vec![0.0; 2 * row.len()];
        row[0] = 1.0;
        for n in 1..len {
            strides.advance(&mut row, t[n] - t[n - 1], &mut room);
            for (pj, x) in row.iter().enumerate() {
                self.columns[pj * len + n] = *x;
            }
        }
    }
}

/// Exponentials over halves of an interval, `e^(A h/2)`, `e^(A h/4)`, …, down to where Taylor's sum is short.
struct Strides<'a> {
    A: &'a Sloped,
    powers: Vec<(f64, Sloped)>,
}

/// Norm of `A h` below which [`TERMS`] terms are exact to rounding.
const SHORT: f64 = 1.0 / 16.0;

const TERMS: usize = 9;

impl<'a> Strides<'a> {
    fn new(A: &'a Sloped, longest: f64) -> Self {
        let shortest = SHORT / A.norm();
        let lengths = std::iter::successors(Some(longest), |h| Some(h / 2.0)).take_while(|h| *h > shortest);
        Strides { A, powers: lengths.map(|h| (h, A.exponential(h))).collect() }
    }

    /// `row e^(A h)`, slopes as well.
    fn advance(&self, row: &mut [f64], h: f64, room: &mut [f64]) {
        let (next, term) = room.split_at_mut(row.len());
        let mut left = h;
        for (length, power) in &self.powers {
            if left >= *length {
                power.take(row, next);
                row.copy_from_slice(next);
                left -= length;
            }
        }
        term.copy_from_slice(row);
        for n in 1..=TERMS {
            self.A.take(term, next);
            term.iter_mut().zip(&*next).for_each(|(t, x)| *t = x * left / n as f64);
            row.iter_mut().zip(&*term).for_each(|(r, t)| *r += t);
        }
    }
}
