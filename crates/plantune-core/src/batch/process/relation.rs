//! Whether a process fit is more than chance, and whether its record is sampled at a rate that suits it.

use super::RANK_TOLERANCE;
use super::code::Code;
use super::problem::{MOST_MOVES, Point, Problem, Stretch};
use crate::error::{Error, Result};
use crate::linalg::{Triangle, dot, residual_norm2};
use crate::model::{ProcessModel, sampled};
use crate::note::{Place, listed};
use crate::relation::{beyond, chance, follows_some_later};
use crate::stats::f_tail;

/// p-value below which errors clearly follow the input.
const FOLLOWS: f64 = 1e-4;

impl Problem<'_, '_> {
    /// X04: what y does has nothing to do with u.
    pub(super) fn no_relation(&self, p: f64) -> Error {
        let rec = self.rec;
        let (verb, these) = if rec.nu > 1 { ("explain", "these") } else { ("explains", "these two") };
        let (inputs, output) = (listed(&rec.names[..rec.nu]), &rec.names[rec.nu]);
        Error::new("X04", format!("no relation: {inputs} {verb} nothing of {output} beyond chance"))
            .at(Place::column(&rec.names[rec.nu]))
            .count(rec.N())
            .measured(p, self.limits.X04)
            .remedy(format!(
                "check that {these} columns belong together; record with larger steps of the input"
            ))
    }

    /// Refuses a model that explains no more than the best of as many random inputs would (X04).
    ///
    /// The F test of the plant's parameters, with the p-value multiplied by the number of delays tried.
    pub(super) fn check_relation(&self, all: &Triangle, rss: f64, N: usize) -> Result<()> {
        let own: Vec<usize> = (self.gains()..self.linear()).collect();
        let without = residual_norm2(all, &own, all.n() - 1, RANK_TOLERANCE);
        let plant = (self.parameters() - self.levels()) as f64;
        let freedom = (N - self.parameters()) as f64;
        let F = (without - rss) / plant / (rss / freedom).max(f64::MIN_POSITIVE);
        let p = (self.tried() * f_tail(F, plant, freedom)).min(1.0);
        if p > self.limits.X04 { Err(self.unrelated(p)) } else { Ok(()) }
    }

    /// Number of delays tried.
    fn tried(&self) -> f64 {
        if self.codes.iter().any(|c| c.delay) { self.cells().count() as f64 } else { 1.0 }
    }

    /// The same with the colour of y taken up by an autoregression. A step test moves too seldom for it.
    pub(super) fn check_colour(&self, plants: &[ProcessModel]) -> Result<()> {
        if self.stretches.iter().any(|s| s.moves <= MOST_MOVES) {
            return Ok(());
        }
        let forced = |s: &Stretch| (self.y[s.rows.clone()].to_vec(), self.simulated(plants, s));
        let segments: Vec<_> = self.stretches.iter().map(forced).collect();
        let p = (self.tried() * chance(&segments)).min(1.0);
        if p > self.limits.X04 { Err(self.unrelated(p)) } else { Ok(()) }
    }

    /// Response of all plants to the scaled inputs, from zero.
    fn simulated(&self, plants: &[ProcessModel], s: &Stretch) -> Vec<f64> {
        if self.t.is_some() {
            let plant = &plants[0];
            let p: Vec<f64> = plant.T.iter().chain([&plant.L]).map(|x| x / self.rec.Ts).collect();
            let own = Stretch { at_rest: true, ..s.clone() };
            return self.lag_response_of(&own, Code { delay: true, ..self.codes[0] }, &p);
        }
        let mut sum = vec![0.0; s.rows.len()];
        for ((plant, u), scale) in plants.iter().zip(&self.u).zip(&self.scale_u) {
            let plant = ProcessModel { K: plant.K / scale.factor * self.scale_y.factor, ..plant.clone() };
            let u = &u[s.rows.clone()];
            let y = match plant.first_order() {
                Some(plant) => plant.simulate(u, self.rec.Ts, 0.0),
                None => sampled(&plant.transfer(), self.rec.Ts).simulate(u, 1),
            };
            sum.iter_mut().zip(y).for_each(|(sum, y)| *sum += y);
        }
        sum
    }

    pub(super) fn unrelated(&self, p: f64) -> Error {
        let first = (self.limits.X05 * self.rec.N() as f64) as usize;
        match follows_some_later(self.rec, first) {
            Some((i, lag)) => beyond(self.rec, i, lag, self.limits),
            None => self.no_relation(p),
        }
    }

    /// Upper end of the 95 % interval of the longest time constant, as far as M09 asks, s.
    ///
    /// Of a first order `T` itself where `Ts / M09` is excluded, otherwise that. The standard deviation is no
    /// help there: the rows change so little with a `T` below `Ts` that it grows without bound. So the sum of
    /// squares at `Ts / M09`, with the best of the shorter delays that go with a longer `T`, is compared with
    /// the least one. Of a plant that is no first order, such as a resonance, a short `T` says nothing.
    pub(super) fn upper_T(&self, best: &Point, plant: &ProcessModel, rss: f64, freedom: usize) -> f64 {
        let T = plant.T.iter().copied().fold(0.0, f64::max);
        let limit = self.rec.Ts / self.limits.M09;
        if T >= limit || self.codes != [Code::P1D] {
            return T.max(limit);
        }
        if rss > 1e-20 * dot(&self.y, &self.y) && !self.is_first_order(plant) {
            return limit;
        }
        let (Ts, longest) = (self.rec.Ts, best.x[1]);
        let cost = |L: f64| {
            let m = vec![(L.floor() as usize).min(best.m[0])];
            let mut x = best.x.clone();
            (x[0], x[1]) = ((limit / Ts).ln(), L);
            self.evaluate(&Point { x, m, ..best.clone() }).map_or(f64::INFINITY, |(cost, _)| cost)
        };
        // From the delay of the best down, in tenths of a sample; then in hundredths around the best of these.
        let least = |from: f64, step: f64, count: u32| {
            let delays = (0..=count).map(|i| (from - f64::from(i) * step).max(self.bounds.0).min(longest));
            delays.map(|L| (cost(L), L)).fold((f64::INFINITY, from), |a, b| if b.0 < a.0 { b } else { a })
        };
        let (_, L) = least(longest, 0.1, 30);
        let (least, _) = least(L + 0.1, 0.01, 20);
        let F = (least - rss) / (rss / freedom as f64).max(f64::MIN_POSITIVE);
        if f_tail(F, 1.0, freedom as f64) < 0.05 { T } else { limit }
    }

    /// Whether the errors of a fit with a short `T` no longer follow the delayed input.
    fn is_first_order(&self, plant: &ProcessModel) -> bool {
        let errors = |s: &Stretch| {
            let w = self.simulated(std::slice::from_ref(plant), s);
            (self.y[s.rows.clone()].iter().zip(&w).map(|(y, w)| y - w).collect(), w)
        };
        let segments: Vec<_> = self.stretches.iter().map(errors).collect();
        chance(&segments) > FOLLOWS
    }
}
