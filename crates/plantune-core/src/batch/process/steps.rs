//! Load steps within a record: each is one more linear column, `1(t >= c)`, found in what a fit leaves.
//!
//! ```text
//! 1  rough T, L from the map of correlations, blind to levels: in eighths of the record each has its own
//! 2  residuals there, only gains, offset and states fitted            ->  scan for steps
//! 3  all together, each step a column, from the rough start and the last
//! 4  scan what is left of y by the plant alone; until the steps stay where they are, at most eight times
//! ```
//!
//! The order matters. Free `T` and `L` bend to a step that is not seen yet: `T` grows until the free response
//! looks like it; and to take levels off y in turn does not converge. At last a fit with a line in place of the
//! steps is compared by BIC: a drift is no load. The scan is [`crate::signal::offset_steps`].

use super::super::fit::Status;
use super::problem::{Point, Problem};
use crate::note::Note;
use crate::signal::level_steps;

/// Rounds of steps and fit.
const ROUNDS: usize = 8;

/// Parts of the record whose levels the first start does not see.
const PARTS: usize = 8;

impl Problem<'_, '_> {
    /// Finds the steps of the offset; says where it drifts instead.
    pub(super) fn find_steps(&mut self) -> Option<Note> {
        let rough = self.rough_start()?;
        let mut best = self.still(rough.clone())?;
        for _ in 0..ROUNDS {
            let (rows, errors) = self.errors_of_plant(&best)?;
            let found: Vec<usize> = level_steps(&errors).at.into_iter().map(|k| rows[k]).collect();
            if found == self.steps {
                break;
            }
            self.steps = found;
            let starts = [rough.clone(), best.x.clone()];
            let minima = starts.into_iter().chain(self.starts()).filter_map(|x| self.search(x));
            best = self.best(&minima.collect::<Vec<Point>>())?;
        }
        if !self.drifts_along_a_line(&best)? {
            return None;
        }
        self.steps.clear();
        let text = "the offset drifts along a line rather than in steps";
        Some(Note::warning("M08", text).remedy("prep.detrend(rec, by=\"line\") first"))
    }

    /// Whether a fit with a line leaves less than that with the steps, by BIC.
    fn drifts_along_a_line(&mut self, with_steps: &Point) -> Option<bool> {
        if self.steps.is_empty() {
            return Some(false);
        }
        let steps = std::mem::take(&mut self.steps);
        self.line = true;
        let starts = self.starts().into_iter().chain([with_steps.x.clone()]);
        let minima: Vec<Point> = starts.filter_map(|x| self.search(x)).collect();
        let with_line = self.best(&minima);
        (self.line, self.steps) = (false, steps);
        let bic = |point: &Point, n: usize| {
            let N = self.rows(point.history) as f64;
            N * (point.cost / N).max(f64::MIN_POSITIVE).ln() + n as f64 * N.ln()
        };
        Some(bic(&with_line?, 1) < bic(with_steps, 2 * self.steps.len()))
    }

    /// The best place of a map that no level moves.
    fn rough_start(&mut self) -> Option<Vec<f64>> {
        let N = self.y.len();
        self.steps = (1..PARTS).map(|part| part * N / PARTS).collect();
        let start = self.starts().into_iter().next();
        self.steps.clear();
        start
    }

    /// A point that has not moved.
    fn still(&self, x: Vec<f64>) -> Option<Point> {
        let m = self.cells_of(&x);
        let history = m.iter().max().copied().unwrap_or(0) + 1;
        let point = Point { x, m, history, cost: f64::NAN, status: Status::NotConverged };
        let (cost, _) = self.evaluate(&point)?;
        Some(Point { cost, ..point })
    }

    /// Rows that count and the errors of the plant alone there, offset and steps left in them.
    fn errors_of_plant(&self, point: &Point) -> Option<(Vec<usize>, Vec<f64>)> {
        let (_, mut linear) = self.evaluate(point)?;
        linear.theta[self.gains()..].fill(0.0);
        let (mut rows, mut errors) = (Vec::new(), Vec::new());
        for (s, e) in self.stretches(point.history).zip(self.errors_with(point, &linear)) {
            let first = s.first(point.history);
            for k in (first..s.rows.end).filter(|&k| self.rec.is_valid(k, 0)) {
                rows.push(k);
                errors.push(e[k - first]);
            }
        }
        Some((rows, errors))
    }
}
