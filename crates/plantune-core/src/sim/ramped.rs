//! A plant whose input is a straight line between nodes and may jump at nodes.
//!
//! ```text
//! L = m h + f:  from node k on, the line of node k - m - 1 acts for f seconds, then that of node k - m
//! y(k+1) = y_free + y_gain v(k+1),   int y = area_free + area_gain v(k+1)
//! ```
//!
//! The gains are zero once the delay exceeds a node. The answer to such an input is exact for any delay.

use super::arc::Cubic;
use super::indices::Watch;
use super::plant::delay_of;
use super::state::{State, stretches};
use crate::error::Result;

/// States behind a dead time, at rest at zero when they start.
pub struct Ramped<S: State> {
    state: S,
    stretches: Vec<Stretch<S>>,
    /// How many of them belong to the line of `m + 1` nodes ago.
    early: usize,
    /// Lines from each node to the next, the oldest at `oldest`; the last `m + 2`.
    lines: Vec<(f64, f64)>,
    oldest: usize,
    /// Whether the plant answers to `v(k+1)` at node `k + 1`.
    at_once: bool,
    /// What the end of the interval owes to one unit of `v(k+1)`.
    unit: Interval<S>,
    /// The interval ahead, under an input that arrives at zero.
    ahead: Interval<S>,
}

struct Stretch<S: State> {
    h: f64,
    moved: S::Move,
    /// Place of its ends on the line, as shares.
    from: f64,
    to: f64,
}

#[derive(Clone)]
struct Interval<S> {
    state: S,
    /// Value and slope of y at the beginning and the end of each stretch.
    ends: Vec<[(f64, f64); 2]>,
    area: f64,
}

/// An affine function of the input at the next node.
#[derive(Clone, Copy, Debug)]
pub struct Affine {
    /// Its value at zero.
    pub free: f64,
    /// Its slope.
    pub gain: f64,
}

impl Affine {
    /// Zero.
    pub const NONE: Affine = Affine { free: 0.0, gain: 0.0 };

    /// Its value.
    pub fn at(&self, v: f64) -> f64 {
        self.free + self.gain * v
    }
}

impl<S: State> Ramped<S> {
    /// `h` seconds between nodes.
    pub fn new(state: S, L: f64, h: f64) -> Result<Self> {
        let delay = delay_of(L, h)?;
        let poles = state.poles();
        let cut = |total: f64, start: f64| {
            let mut t = start;
            let stretch = |length: f64| {
                let from = t / h;
                t += length;
                Stretch { h: length, moved: state.over(length), from, to: t / h }
            };
            stretches(total, &poles).into_iter().map(stretch).collect::<Vec<_>>()
        };
        let mut both = cut(delay.f, h - delay.f);
        let early = both.len();
        both.append(&mut cut(h - delay.f, 0.0));
        let none = Interval { state: state.clone(), ends: vec![[(0.0, 0.0); 2]; both.len()], area: 0.0 };
        let mut plant = Ramped {
            early,
            stretches: both,
            lines: vec![(0.0, 0.0); delay.m + 2],
            oldest: 0,
            at_once: delay.m == 0,
            unit: none.clone(),
            ahead: none.clone(),
            state,
        };
        if plant.at_once {
            let [old, new] = plant.two_lines();
            plant.lines[new].1 = 1.0;
            plant.look();
            plant.unit = std::mem::replace(&mut plant.ahead, none);
            (plant.lines[old], plant.lines[new]) = ((0.0, 0.0), (0.0, 0.0));
        }
        Ok(plant)
    }

    /// Where the lines of `m + 1` and of `m` nodes ago lie, before the line of this node is known.
    fn two_lines(&self) -> [usize; 2] {
        [self.oldest, (self.oldest + 1) % self.lines.len()]
    }

    /// Output at this node under the input `v` from here on.
    pub fn now(&self) -> Affine {
        let direct = self.state.direct();
        let [old, new] = self.two_lines();
        let known = if self.early > 0 {
            let (begin, end) = self.lines[old];
            begin + self.stretches[0].from * (end - begin)
        } else if self.at_once {
            return Affine { free: self.state.output(), gain: direct };
        } else {
            self.lines[new].0
        };
        Affine { free: self.state.output() + direct * known, gain: 0.0 }
    }

    /// Output at the next node and its integral until there, the input being `v` from here on.
    pub fn ahead(&mut self, v: f64) -> [Affine; 2] {
        let newest = (self.oldest + self.lines.len() - 1) % self.lines.len();
        self.lines[newest] = (v, 0.0);
        self.look();
        let last = self.stretches.len() - 1;
        let (y, gain) = (self.ahead.ends[last][1].0, self.unit.ends[last][1].0);
        [Affine { free: y, gain }, Affine { free: self.ahead.area, gain: self.unit.area }]
    }

    /// Moves to the next node, where the input arrives at `v`.
    pub fn run(&mut self, v: f64, watch: &mut impl Watch, y0: f64) {
        let newest = (self.oldest + self.lines.len() - 1) % self.lines.len();
        self.lines[newest].1 = v;
        if self.at_once {
            self.ahead.state.add(v, &self.unit.state);
            for (ends, unit) in self.ahead.ends.iter_mut().zip(&self.unit.ends) {
                for (end, unit) in ends.iter_mut().zip(unit) {
                    *end = (end.0 + v * unit.0, end.1 + v * unit.1);
                }
            }
        }
        self.state.copy(&self.ahead.state);
        for (stretch, [begin, end]) in self.stretches.iter().zip(&self.ahead.ends) {
            watch.arc(stretch.h, Cubic::new(stretch.h, (y0 + begin.0, begin.1), (y0 + end.0, end.1)));
        }
        self.oldest = (self.oldest + 1) % self.lines.len();
    }

    /// Fills the interval ahead from the lines as they are.
    fn look(&mut self) {
        let lines = self.two_lines().map(|k| self.lines[k]);
        let direct = self.state.direct();
        let mut area = 0.0;
        let state = &mut self.ahead.state;
        state.copy(&self.state);
        for (k, stretch) in self.stretches.iter().enumerate() {
            let (begin, end) = lines[usize::from(k >= self.early)];
            let (v0, v1) = (begin + stretch.from * (end - begin), begin + stretch.to * (end - begin));
            let rise = direct * (v1 - v0) / stretch.h;
            let first = (state.output() + direct * v0, state.slope(v0) + rise);
            state.run(&stretch.moved, v0, v1);
            let last = (state.output() + direct * v1, state.slope(v1) + rise);
            area += stretch.h * (0.5 * (first.0 + last.0) + stretch.h * (first.1 - last.1) / 12.0);
            self.ahead.ends[k] = [first, last];
        }
        self.ahead.area = area;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Realisation, TransferFunction};
    use crate::sim::state::General;

    /// A unit ramp `v = t` that starts with a jump to 1: the step response and its integral.
    #[test]
    fn a_jump_and_a_ramp_are_answered_exactly() {
        for (num, den) in [(vec![1.0], vec![1.0, 1.0]), (vec![0.5, 1.0], vec![1.0, 1.2, 1.0])] {
            for L in [0.0, 0.03, 0.1, 0.27] {
                let G = TransferFunction { num: num.clone(), den: den.clone(), L };
                let ramp = TransferFunction { den: [den.clone(), vec![0.0]].concat(), ..G.clone() };
                let h = 0.1;
                let state = General::new(Realisation::of(&G), G.poles());
                let mut plant = Ramped::new(state, L, h).expect("a plant");
                for k in 0..40 {
                    let t = f64::from(k) * h;
                    let exact = G.step_response(&[t])[0] + ramp.step_response(&[t])[0];
                    let y = plant.now().at(1.0 + t);
                    assert!((y - exact).abs() < 1e-12, "{G:?} at {t}: {y} {exact}");
                    let [next, _] = plant.ahead(1.0 + t);
                    plant.run(1.0 + t + h, &mut (), 0.0);
                    assert!((next.at(1.0 + t + h) - plant.now().at(1.0 + t + h)).abs() < 1e-12);
                }
            }
        }
    }
}
