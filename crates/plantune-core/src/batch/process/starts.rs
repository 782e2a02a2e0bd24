//! Where to begin: a map of correlations over shapes and delays.

use std::ops::Range;

use super::super::fit::Status;
use super::chain::{Chain, Drive};
use super::code::Code;
use super::problem::{Point, Problem, Stretch};
use crate::linalg::dot;
use crate::stats::centred;

/// Time constants of the map.
const TIMES: u32 = 14;

/// Places of the map that are tried at their true cost.
const TRIED: usize = 12;

/// Starts of one input.
const STARTS: usize = 4;

/// Starts of a first-order plant, whose map is its cost.
const FIRST_ORDER: usize = 3;

/// Delays of the map where stamps are not uniform.
const DELAYS: usize = 40;

/// A place of the map: squared correlation, shape and delay.
type Place = (f64, Vec<f64>, usize);

impl Problem<'_, '_> {
    /// Points to search from, the best places of the map in different delay cells or of other shapes.
    pub(super) fn starts(&self) -> Vec<Vec<f64>> {
        if self.codes == [Code::P1D] {
            return self.places(0, FIRST_ORDER);
        }
        let places: Vec<_> = (0..self.codes.len()).map(|i| self.places(i, TRIED)).collect();
        let mut chosen: Vec<Vec<f64>> = places.iter().map(|p| p[0].clone()).collect();
        let mut ranked = Vec::new();
        // One input after the other, the rest as they are; once more round where there are several.
        for i in (0..2).flat_map(|_| 0..self.codes.len()).take(2 * self.codes.len() - 1) {
            let with = |own: &Vec<f64>| {
                let mut all = chosen.clone();
                all[i].clone_from(own);
                all.concat()
            };
            ranked = places[i].iter().map(|own| (self.cost_at(with(own)), with(own))).collect();
            ranked.sort_by(|a: &(f64, _), b| a.0.total_cmp(&b.0));
            let own = self.own(i);
            chosen[i] = ranked[0].1[own].to_vec();
        }
        ranked.into_iter().take(STARTS).map(|(_, x)| x).collect()
    }

    /// Cost where all delays leave the same rows.
    fn cost_at(&self, x: Vec<f64>) -> f64 {
        let (m, history) = (self.cells_of(&x), self.cells().end() + 1);
        let point = Point { x, m, history, cost: f64::NAN, status: Status::NotConverged };
        self.evaluate(&point).map_or(f64::INFINITY, |(cost, _)| cost)
    }

    /// The best places of the correlation between y and the shaped, shifted input, as coordinates.
    fn places(&self, input: usize, most: usize) -> Vec<Vec<f64>> {
        let code = self.codes[input];
        if self.t.is_some() {
            return self.places_at_stamps(code, most);
        }
        let cells = if code.delay { self.cells() } else { 0..=0 };
        let y = self.without_trend(self.y.clone());
        let (y, mut map) = (Sums::new(&y), Vec::new());
        for shape in self.shapes(code) {
            let shaped = self.without_trend(self.shaped(code, &shape, input));
            let w = Sums::new(&shaped);
            map.extend(cells.clone().map(|m| (self.correlation(&w, &y, m), shape.clone(), m)));
        }
        map.sort_by(|a: &Place, b| b.0.total_cmp(&a.0));
        let mut places: Vec<(Vec<f64>, usize)> = Vec::new();
        for (_, shape, m) in map {
            let apart = shape.first().map_or(2.0, |ln_T| (ln_T.exp() / 2.0).max(2.0));
            let same = |other: &Vec<f64>| code == Code::P1D || *other == shape;
            if places.iter().all(|(other, n)| (*n as f64 - m as f64).abs() > apart || !same(other)) {
                places.push((shape, m));
            }
            if places.len() == most {
                break;
            }
        }
        let within = if code.jumps() { 0.0 } else { 0.5 };
        let with_delay = |(shape, m)| [shape, vec![m as f64 + within; usize::from(code.delay)]].concat();
        places.into_iter().map(with_delay).collect()
    }

    /// The same where a delay is no shift of rows: the response is taken at each.
    fn places_at_stamps(&self, code: Code, most: usize) -> Vec<Vec<f64>> {
        let y = self.without_trend(self.y.clone());
        let whole = |s: &Stretch| s.rows.clone().collect::<Vec<usize>>();
        let rows: Vec<usize> = self.stretches.iter().flat_map(whole).collect();
        let y: Vec<f64> = rows.iter().map(|&k| y[k]).collect();
        let (low, high) = if code.delay { self.bounds } else { (0.0, 0.0) };
        let stride = ((high - low) / DELAYS as f64).max(1.0);
        let delays: Vec<f64> =
            (0..=DELAYS).map(|i| low + 0.5 + i as f64 * stride).take_while(|L| *L < high + 1.0).collect();
        let mut map = Vec::new();
        for shape in self.shapes(code) {
            for &L in &delays {
                let p: Vec<f64> = shape.iter().map(|x| x.exp()).chain(code.delay.then_some(L)).collect();
                let w = centred(self.lag_response(code, &p));
                let (wy, ww) = (dot(&w, &centred(y.clone())), dot(&w, &w));
                let point = [shape.clone(), vec![L.min(high); usize::from(code.delay)]].concat();
                map.push((if ww > 0.0 { wy * wy / ww } else { 0.0 }, point));
            }
        }
        map.sort_by(|a: &(f64, _), b| b.0.total_cmp(&a.0));
        map.into_iter().map(|(_, point)| point).take(most).collect()
    }

    /// `ln T …, ln zeta` of a grid, in samples.
    fn shapes(&self, code: Code) -> Vec<Vec<f64>> {
        if code.lags == 0 {
            return vec![Vec::new()];
        }
        let (shortest, longest) = (0.3f64, self.rec.segments().map(|s| s.len()).max().unwrap_or(2) as f64);
        let times =
            (0..TIMES).map(|i| shortest * (longest / shortest).powf(f64::from(i) / f64::from(TIMES - 1)));
        let others: &[f64] = if code.times() > 1 { &[0.9, 0.2] } else { &[1.0] };
        let dampings: &[f64] = if code.pair { &[0.2, 0.7] } else { &[1.0] };
        let shape = |T: f64, other: f64, zeta: f64| {
            let mut shape: Vec<f64> = (0..code.times()).map(|k| (T * other.powi(k as i32)).ln()).collect();
            shape.extend(code.pair.then(|| zeta.ln()));
            shape
        };
        times
            .flat_map(|T| others.iter().map(move |&other| (T, other)))
            .flat_map(|(T, other)| dampings.iter().map(move |&zeta| shape(T, other, zeta)))
            .collect()
    }

    /// The response of a shape without delay, from the equilibrium of each segment's first input.
    fn shaped(&self, code: Code, shape: &[f64], input: usize) -> Vec<f64> {
        let undelayed = Code { delay: false, ..code };
        let p: Vec<f64> = shape.iter().map(|x| x.exp()).collect();
        let chain = Chain::new(undelayed, &p, 0, false);
        let mut w = vec![0.0; self.y.len()];
        for s in self.rec.segments() {
            let u = &self.u[input][s.clone()];
            chain.run(Drive { u, first: 0, gain: 1.0 }, chain.rest(u[0]), |k, y, _| w[s.start + k] = y.0);
        }
        w
    }

    /// Of an integrating plant level and drift of each segment are free; the level between steps always is.
    fn without_trend(&self, mut x: Vec<f64>) -> Vec<f64> {
        if !self.steps.is_empty() {
            let edges = [&[0], self.steps.as_slice(), &[x.len()]].concat();
            edges.windows(2).for_each(|w| centre(&mut x[w[0]..w[1]]));
        }
        if !self.drifts() {
            return x;
        }
        for s in self.rec.segments() {
            let (n, middle) = (s.len() as f64, (s.len() as f64 - 1.0) / 2.0);
            let x = &mut x[s];
            let mean = x.iter().sum::<f64>() / n;
            let (mut xt, mut tt) = (0.0, f64::MIN_POSITIVE);
            for (k, x) in x.iter().enumerate() {
                let t = k as f64 - middle;
                (xt, tt) = (xt + x * t, tt + t * t);
            }
            x.iter_mut().enumerate().for_each(|(k, x)| *x -= mean + xt / tt * (k as f64 - middle));
        }
        x
    }

    /// Squared correlation of `y(t)` and `w(t - m)`, means removed.
    fn correlation(&self, w: &Sums, y: &Sums, m: usize) -> f64 {
        let (mut n, mut sw, mut sy, mut sww, mut syy, mut swy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for s in self.rec.segments().filter(|s| s.len() > m + 1) {
            let (earlier, later) = (s.start..s.end - m, s.start + m..s.end);
            n += earlier.len() as f64;
            sw += w.sum(&earlier);
            sy += y.sum(&later);
            sww += w.squares(&earlier);
            syy += y.squares(&later);
            swy += dot(&w.x[earlier], &y.x[later]);
        }
        let (vw, vy, c) = (sww - sw * sw / n, syy - sy * sy / n, swy - sw * sy / n);
        if n > 3.0 && vw > 0.0 && vy > 0.0 { c * c / (vw * vy) * (1.0 - 3.0 / n) } else { 0.0 }
    }
}

fn centre(x: &mut [f64]) {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    x.iter_mut().for_each(|x| *x -= mean);
}

/// A signal with its running sums, so that those of any stretch cost two look-ups.
struct Sums<'x> {
    x: &'x [f64],
    first: Vec<f64>,
    second: Vec<f64>,
}

impl<'x> Sums<'x> {
    fn new(x: &'x [f64]) -> Self {
        let running = |f: fn(f64) -> f64| {
            let mut sum = 0.0;
            let sums = x.iter().map(|&v| {
                sum += f(v);
                sum
            });
            std::iter::once(0.0).chain(sums).collect()
        };
        Sums { x, first: running(|v| v), second: running(|v| v * v) }
    }

    fn sum(&self, rows: &Range<usize>) -> f64 {
        self.first[rows.end] - self.first[rows.start]
    }

    fn squares(&self, rows: &Range<usize>) -> f64 {
        self.second[rows.end] - self.second[rows.start]
    }
}
