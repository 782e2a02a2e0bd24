//! Plays on x and on |x|, chosen one by one from two grids: columns play(x), play(|x|), 1, y.
//!
//! Of each side at most n are taken, each time the one that lowers the error most. Signs are free: a butterfly has no
//! inverse that they could spoil, and with `w >= 0` the loops of a piezo stack fit two times worse.

use super::{Family, Fitted, TOLERANCE, numbered};
use crate::error::{Error, Result};
use crate::hysteresis::play_states::States;
use crate::hysteresis::{EvenStack, Model, PlayStack};
use crate::linalg::{Triangle, forward, solve};

pub(super) struct Even {
    odd: States,
    even: States,
    n: usize,
    offset: bool,
}

impl Even {
    pub(super) fn new(r: Vec<f64>, n: usize, offset: bool) -> Self {
        Even { odd: States::new(r.clone()), even: States::new(r), n, offset }
    }

    fn grid(&self) -> usize {
        self.odd.r.len()
    }

    /// Columns chosen, those on x first, both by width.
    fn chosen(&self, triangle: &Triangle) -> (Vec<usize>, Vec<usize>) {
        let grid = self.grid();
        let candidates: Vec<usize> = (0..2 * grid).collect();
        let first: Vec<usize> = if self.offset { vec![2 * grid] } else { Vec::new() };
        let room = |chosen: &[usize], j: usize| {
            chosen.iter().filter(|c| (**c < grid) == (j < grid)).count() < self.n
        };
        let mut all = forward(triangle, &candidates, 2 * grid + 1, &first, room);
        all.sort_unstable();
        all.into_iter().partition(|j| *j < grid)
    }
}

impl Family for Even {
    /// The widest problem that is solved.
    fn width(&self) -> usize {
        2 * self.grid() + 2
    }

    fn row(&mut self, x: f64, y: f64, row: &mut [f64]) {
        let grid = self.grid();
        row[..grid].copy_from_slice(self.odd.step(x));
        row[grid..2 * grid].copy_from_slice(self.even.step(x.abs()));
        (row[2 * grid], row[2 * grid + 1]) = (1.0, y);
    }

    fn check(&self, _: &Triangle) -> Result<()> {
        Ok(()) // of columns that depend on others none is chosen
    }

    fn fit(&self, triangle: &Triangle, N: usize) -> Result<Fitted> {
        let grid = self.grid();
        let (odd, even) = self.chosen(triangle);
        let mut columns = [&odd[..], &even[..]].concat();
        columns.extend(self.offset.then_some(2 * grid));
        let k = columns.len();
        let solution = solve(triangle, &columns, 2 * grid + 1, TOLERANCE).map_err(|_| {
            Error::new("X02", format!("x moves too little to tell {k} plays apart"))
                .remedy("ask for fewer, or record more turning points of different size")
        })?;
        let variance = solution.rss / N.saturating_sub(k).max(1) as f64;
        let mut sd: Vec<f64> = (0..k).map(|p| (variance * solution.inverse_gram[p * k + p]).sqrt()).collect();
        sd.resize(odd.len() + even.len() + 1, 0.0);
        let (w, rest) = solution.theta.split_at(odd.len());
        let (v, offset) = rest.split_at(even.len());
        let widths = |side: &[usize]| side.iter().map(|j| self.odd.r[j % grid]).collect();
        let side =
            |columns: &[usize], w: &[f64], offset| PlayStack::virgin(widths(columns), w.to_vec(), offset);
        let names =
            numbered("w", w.len()).chain(numbered("v", v.len())).chain(["offset".to_owned()]).collect();
        let offset = offset.first().copied().unwrap_or(0.0);
        let model = EvenStack { plays: side(&odd, w, offset), even: side(&even, v, 0.0) };
        Ok(Fitted { model: Model::Even(model), names, sd, merged: 0 })
    }
}
