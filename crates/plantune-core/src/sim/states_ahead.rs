//! Outputs predicted from filtered states.
//!
//! ```text
//! x(t+1|t) = A x + B u + K e,  e = y - O - C x - D u        x(0) by least squares of all e
//! y(t+h|t) = C x(t+h|t) + D u + O,  x(t+h|t) with the errors to come at zero
//! ```
//!
//! An error that does not count is zero. Ljung 1999, (4.84) to (4.87).

use std::ops::Range;

use super::matrix_over_record::Run;
use super::over_record::Start;
use crate::linalg::{Block, Segmented, Triangle};
use crate::model::{StateSpace, add};
use crate::record::Record;

/// All outputs `steps` ahead, on every row of the segments.
pub(super) fn states_ahead(
    model: &StateSpace,
    rec: &Record,
    steps: usize,
    start: Start,
    offset: Vec<f64>,
    segments: &[Range<usize>],
) -> Run {
    let mut run = Run { rows: Vec::new(), yhat: Vec::new(), offset, x0: Vec::new() };
    for s in segments {
        let filter = Filter { model, rec, offset: &run.offset, rows: s.clone() };
        let x0 = if start == Start::Estimate { filter.start() } else { vec![0.0; model.n()] };
        let (states, _) = filter.run(&x0, true);
        for k in 0..s.len() {
            let known = (k + 1).saturating_sub(steps);
            let mut x = states[known].clone();
            (known..k).for_each(|row| x = filter.next(&x, row, true));
            run.rows.push(s.start + k);
            run.yhat.extend(filter.output(&x, k, true).iter().zip(&run.offset).map(|(y, o)| y + o));
        }
        run.x0.push(x0);
    }
    run
}

/// The filter over one segment.
struct Filter<'a> {
    model: &'a StateSpace,
    rec: &'a Record<'a>,
    offset: &'a [f64],
    rows: Range<usize>,
}

impl Filter<'_> {
    fn u(&self, k: usize) -> &[f64] {
        &self.rec.u[(self.rows.start + k) * self.rec.nu..][..self.rec.nu]
    }

    /// `C x + D u`, of the state alone where the signals are not `driven`.
    fn output(&self, x: &[f64], k: usize, driven: bool) -> Vec<f64> {
        let mut y = vec![0.0; self.model.ny()];
        add(&self.model.C, x, &mut y);
        if driven {
            add(&self.model.D, self.u(k), &mut y);
        }
        y
    }

    /// `A x + B u`.
    fn next(&self, x: &[f64], k: usize, driven: bool) -> Vec<f64> {
        let mut next = vec![0.0; x.len()];
        add(&self.model.A, x, &mut next);
        if driven {
            add(&self.model.B, self.u(k), &mut next);
        }
        next
    }

    /// States before each row and errors `(rows, ny)`; without the signals the answer to `x0` alone.
    fn run(&self, x0: &[f64], driven: bool) -> (Vec<Vec<f64>>, Vec<f64>) {
        let (mut x, mut states, mut errors) = (x0.to_vec(), Vec::new(), Vec::new());
        for k in 0..self.rows.len() {
            let t = self.rows.start + k;
            let error = |(i, yhat): (usize, &f64)| {
                let y = if driven { self.rec.y_at(t, i) - self.offset[i] } else { 0.0 };
                if self.rec.is_valid(t, i) { y - yhat } else { 0.0 }
            };
            let e: Vec<f64> = self.output(&x, k, driven).iter().enumerate().map(error).collect();
            let mut next = self.next(&x, k, driven);
            add(&self.model.K, &e, &mut next);
            states.push(std::mem::replace(&mut x, next));
            errors.extend(e);
        }
        (states, errors)
    }

    /// The initial state that leaves the least errors.
    fn start(&self) -> Vec<f64> {
        let n = self.model.n();
        let unit = |j: usize| (0..n).map(|i| f64::from(u8::from(i == j))).collect::<Vec<f64>>();
        let free: Vec<Vec<f64>> = (0..n).map(|j| self.run(&unit(j), false).1).collect();
        let (_, forced) = self.run(&vec![0.0; n], true);
        let (mut triangle, mut block) = (Triangle::new(n + 1), Block::new(n + 1));
        let mut row = vec![0.0; n + 1];
        for (k, e) in forced.iter().enumerate() {
            // forced + free x0 is the error; least squares of free x0 on -forced
            row[..n].iter_mut().zip(&free).for_each(|(x, free)| *x = free[k]);
            row[n] = -e;
            block.push(&row);
        }
        triangle.absorb(&mut block);
        let mut problem = Segmented::new(n, 0);
        problem.push(triangle);
        problem.locals(&[]).swap_remove(0)
    }
}
