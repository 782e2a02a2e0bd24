//! `y = O + sum w_i z_i`, `w >= 0`: columns z, 1, y.

use super::{Family, Fitted, deviations, numbered, told_apart};
use crate::error::Result;
use crate::hysteresis::play_states::States;
use crate::hysteresis::{Model, PlayStack};
use crate::linalg::{Triangle, nnls};

pub(super) struct Symmetric {
    states: States,
    offset: bool,
}

impl Symmetric {
    pub(super) fn new(r: Vec<f64>, offset: bool) -> Self {
        Symmetric { states: States::new(r), offset }
    }

    fn n(&self) -> usize {
        self.states.r.len()
    }

    fn columns(&self) -> Vec<usize> {
        (0..self.n() + usize::from(self.offset)).collect()
    }
}

impl Family for Symmetric {
    fn width(&self) -> usize {
        self.n() + 2
    }

    fn row(&mut self, x: f64, y: f64, row: &mut [f64]) {
        let n = self.n();
        row[..n].copy_from_slice(self.states.step(x));
        (row[n], row[n + 1]) = (1.0, y);
    }

    fn check(&self, triangle: &Triangle) -> Result<()> {
        told_apart(triangle, &self.columns(), self.n())
    }

    fn fit(&self, triangle: &Triangle, N: usize) -> Result<Fitted> {
        let (n, columns) = (self.n(), self.columns());
        let free: Vec<bool> = columns.iter().map(|j| *j == n).collect();
        let found = nnls(triangle, &columns, &free, n + 1, &[]);
        let mut sd = deviations(triangle, &columns, &found, N);
        sd.resize(n + 1, 0.0);
        let offset = found.x.get(n).copied().unwrap_or(0.0);
        let stack = PlayStack::virgin(self.states.r.clone(), found.x[..n].to_vec(), offset);
        let names = numbered("w", n).chain(["offset".to_owned()]).collect();
        Ok(Fitted { model: Model::PlayStack(stack), names, sd, merged: 0 })
    }
}
