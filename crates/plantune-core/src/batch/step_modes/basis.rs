//! The columns `phi_j(t)` of one piece of a record and their slopes along `q`, on any time stamps.
//!
//! ```text
//! r(t + h) = r(t) Phi,   dr(t + h) = dr(t) Phi + r(t) dPhi,   Phi = e^(A h),   r(0) = e_1'
//! ```
//!
//! On a uniform grid the known rows are doubled: `r(t + n h) = r(t) Phi^n` for all of them at once. On uneven
//! stamps each interval has its own `Phi`, found again only where the interval changes.

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
        let (mut h, mut phi) = (0.0, Sloped::zeros(k, k));
        for n in 1..len {
            let interval = t[n] - t[n - 1];
            if (interval - h).abs() > SAME * h {
                (h, phi) = (interval, A.exponential(interval));
            }
            for part in 0..=k {
                for j in 0..k {
                    let before = |from: usize, l: usize| self.columns[(from * k + l) * len + n - 1];
                    let by = |from: usize, p: usize| {
                        (0..k).map(|l| before(from, l) * phi.part(p)[l * k + j]).sum::<f64>()
                    };
                    let own = by(part, 0) + if part > 0 { by(0, part) } else { 0.0 };
                    self.columns[(part * k + j) * len + n] = own;
                }
            }
        }
    }
}
