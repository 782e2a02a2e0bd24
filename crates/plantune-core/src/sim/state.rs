//! The states of a plant without its delay, and how they move while the input is a straight line.
//!
//! ```text
//! first order   T x' = K v - x,  y = x:       x <- a x + begin v0 + end v1,   a = e^(-h/T)
//! general       x' = A x + B v,  y = C x + D v   as in [`crate::model::Realisation`]
//! ```
//!
//! Between the ends of a stretch y is known by its values and slopes. [`stretches`] cuts the time after a jump
//! of the input so that a cubic through these is exact to about 1e-6 of every mode: short at first where a
//! mode is fast, and longer as it dies out.

use super::arc::{Arc, Cubic, Decay, Shape};
use crate::model::{Fopdt, Realisation, Transition};

/// Longest stretch as a share of the time `1/|p|` of a live mode; the cubic costs `FINE^4 / 720`.
const FINE: f64 = 0.15;
/// Most stretches of one interval.
const MOST: usize = 10_000;

/// States of a plant.
pub trait State: Clone {
    /// A stretch of time.
    type Move: Clone + std::fmt::Debug;
    /// What y does meanwhile under an input that is held.
    type Held: Arc;

    /// A stretch of `h` seconds.
    fn over(&self, h: f64) -> Self::Move;
    /// Moves on while the input runs straight from `v0` to `v1`.
    fn run(&mut self, stretch: &Self::Move, v0: f64, v1: f64);
    /// As [`State::run`] under the input `v`; `rest` is added to the output.
    fn hold(&mut self, stretch: &Self::Move, h: f64, v: f64, rest: f64) -> Self::Held;
    /// Lengths that add up to `total`, in each of which [`State::Held`] is what y does.
    fn cut(&self, total: f64) -> Vec<f64>;
    /// Output, the direct share of the input left out.
    fn output(&self) -> f64;
    /// Direct share of the input in the output.
    fn direct(&self) -> f64;
    /// Slope of the output, the direct share left out.
    fn slope(&self, v: f64) -> f64;
    /// Adds `k` times other states.
    fn add(&mut self, k: f64, other: &Self);
    /// Takes over other states of the same plant, allocating nothing.
    fn copy(&mut self, other: &Self);
    /// Poles, 1/s.
    fn poles(&self) -> Vec<(f64, f64)>;
}

/// `K / (T s + 1)`.
#[derive(Clone, Copy, Debug)]
pub struct FirstOrder {
    K: f64,
    /// `1/T`.
    rate: f64,
    x: f64,
}

/// `x <- a x + begin v0 + end v1`.
#[derive(Clone, Copy, Debug)]
pub struct FirstOrderMove {
    a: f64,
    begin: f64,
    end: f64,
    shape: Shape,
}

impl FirstOrder {
    /// At rest at zero.
    pub fn new(plant: &Fopdt) -> Self {
        FirstOrder { K: plant.K, rate: 1.0 / plant.T, x: 0.0 }
    }
}

impl State for FirstOrder {
    type Move = FirstOrderMove;
    type Held = Decay;

    fn over(&self, h: f64) -> FirstOrderMove {
        let steps = h * self.rate;
        let settled = -(-steps).exp_m1();
        let end = if steps > 0.0 { 1.0 - settled / steps } else { 0.0 };
        FirstOrderMove {
            a: (-steps).exp(),
            begin: self.K * (settled - end),
            end: self.K * end,
            shape: Shape::of(steps),
        }
    }

    #[inline(always)]
    fn run(&mut self, stretch: &FirstOrderMove, v0: f64, v1: f64) {
        self.x = stretch.a * self.x + (stretch.begin * v0 + stretch.end * v1);
    }

    #[inline(always)]
    fn hold(&mut self, stretch: &FirstOrderMove, _: f64, v: f64, rest: f64) -> Decay {
        let begin = self.x;
        self.run(stretch, v, v);
        Decay::new(rest + begin, rest + self.x, stretch.shape)
    }

    fn cut(&self, total: f64) -> Vec<f64> {
        if total > 0.0 { vec![total] } else { Vec::new() }
    }

    #[inline(always)]
    fn output(&self) -> f64 {
        self.x
    }

    #[inline(always)]
    fn direct(&self) -> f64 {
        0.0
    }

    #[inline(always)]
    fn slope(&self, v: f64) -> f64 {
        (self.K * v - self.x) * self.rate
    }

    fn add(&mut self, k: f64, other: &Self) {
        self.x += k * other.x;
    }

    fn copy(&mut self, other: &Self) {
        self.x = other.x;
    }

    fn poles(&self) -> Vec<(f64, f64)> {
        vec![(-self.rate, 0.0)]
    }
}

/// Any proper transfer function.
#[derive(Clone, Debug)]
pub struct General {
    plant: Realisation,
    /// States, output and its slope without input: what a stretch gives from what it takes.
    now: Vec<f64>,
    next: Vec<f64>,
    /// Slope of the output per state, and per unit of the input.
    slopes: Vec<f64>,
    jump: f64,
    poles: Vec<(f64, f64)>,
}

/// Rows of `[Phi begin end]`, and below them those of output and slope.
#[derive(Clone, Debug)]
pub struct GeneralMove(Vec<f64>); // (n + 2, n + 2) row-major

impl General {
    /// At rest at zero.
    pub fn new(plant: Realisation, poles: Vec<(f64, f64)>) -> Self {
        let n = plant.n;
        let unit = |i: usize| (0..n).map(|j| f64::from(u8::from(i == j))).collect::<Vec<f64>>();
        let slopes = (0..n).map(|i| plant.slope(&unit(i), 0.0)).collect();
        let jump = plant.slope(&vec![0.0; n], 1.0);
        General { now: vec![0.0; n + 2], next: vec![0.0; n + 2], slopes, jump, poles, plant }
    }
}

impl State for General {
    type Move = GeneralMove;
    type Held = Cubic;

    fn over(&self, h: f64) -> GeneralMove {
        let n = self.plant.n;
        let Transition { Phi, begin, end } = self.plant.over(h);
        let rows: Vec<Vec<f64>> =
            (0..n).map(|i| [&Phi[i * n..(i + 1) * n], &[begin[i], end[i]]].concat()).collect();
        let combined = |weights: &[f64]| -> Vec<f64> {
            (0..n + 2).map(|j| rows.iter().zip(weights).map(|(row, w)| w * row[j]).sum()).collect()
        };
        let below = [combined(&self.plant.C), combined(&self.slopes)];
        GeneralMove(rows.iter().chain(&below).flatten().copied().collect())
    }

    #[inline(always)]
    fn run(&mut self, stretch: &GeneralMove, v0: f64, v1: f64) {
        let size = self.now.len();
        // The places of output and slope hold the input on the way.
        (self.now[size - 2], self.now[size - 1]) = (v0, v1);
        for (next, row) in self.next.iter_mut().zip(stretch.0.chunks_exact(size)) {
            *next = row.iter().zip(&self.now).fold(0.0, |sum, (weight, x)| sum + weight * x);
        }
        std::mem::swap(&mut self.now, &mut self.next);
    }

    #[inline(always)]
    fn hold(&mut self, stretch: &GeneralMove, h: f64, v: f64, rest: f64) -> Cubic {
        let begin = (rest + self.output(), self.slope(v));
        self.run(stretch, v, v);
        Cubic::new(h, begin, (rest + self.output(), self.slope(v)))
    }

    fn cut(&self, total: f64) -> Vec<f64> {
        stretches(total, &self.poles)
    }

    #[inline(always)]
    fn output(&self) -> f64 {
        self.now[self.now.len() - 2]
    }

    #[inline(always)]
    fn direct(&self) -> f64 {
        self.plant.D
    }

    #[inline(always)]
    fn slope(&self, v: f64) -> f64 {
        self.now[self.now.len() - 1] + self.jump * v
    }

    fn add(&mut self, k: f64, other: &Self) {
        self.now.iter_mut().zip(&other.now).for_each(|(x, other)| *x += k * other);
    }

    fn copy(&mut self, other: &Self) {
        self.now.copy_from_slice(&other.now);
    }

    fn poles(&self) -> Vec<(f64, f64)> {
        self.poles.clone()
    }
}

/// Lengths that add up to `total`, the time after a jump of the input.
pub fn stretches(total: f64, poles: &[(f64, f64)]) -> Vec<f64> {
    let longest = |t: f64| {
        let live = |&(re, im): &(f64, f64)| FINE / re.hypot(im) * (0.25 * (-re).max(0.0) * t).exp();
        poles.iter().map(live).fold(total, f64::min)
    };
    let mut lengths: Vec<f64> = Vec::new();
    let mut t = 0.0;
    while t < total * (1.0 - 1e-12) && lengths.len() < MOST {
        lengths.push(longest(t));
        t += longest(t);
    }
    lengths.iter().map(|h| h * (total / t)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::ProcessModel;

    #[test]
    fn a_first_order_moves_as_its_realisation() {
        let plant = Fopdt { K: -2.0, T: 0.7, L: 0.0 };
        let G = ProcessModel::from(plant).transfer();
        let mut first = FirstOrder::new(&plant);
        let mut general = General::new(Realisation::of(&G), G.poles());
        for (h, v0, v1) in [(0.3, 1.0, 2.0), (5.0, -1.0, 0.5), (1e-6, 3.0, -3.0), (0.9, 0.0, 1.0)] {
            let (a, b) = (first.over(h), general.over(h));
            first.run(&a, v0, v1);
            general.run(&b, v0, v1);
            assert!((first.output() - general.output()).abs() < 1e-13);
            assert!((first.slope(v1) - general.slope(v1)).abs() < 1e-12);
        }
    }

    #[test]
    fn stretches_are_short_where_a_mode_is_live() {
        let of = |total: f64, poles: &[(f64, f64)]| stretches(total, poles);
        assert_eq!(of(0.1, &[(-1.0, 0.0)]), [0.1]);
        assert_eq!(of(3.0, &[(0.0, 0.0)]), [3.0]);
        assert_eq!(of(0.0, &[(-1.0, 0.0)]), [] as [f64; 0]);
        // However fast it is, it dies out.
        let stiff = of(1.0, &[(-1e6, 0.0), (-0.1, 0.0)]);
        assert!(stiff.len() < 40 && (stiff.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{stiff:?}");
        // What rings stays live.
        assert!(of(1.0, &[(-0.01, 30.0), (-0.01, -30.0)]).len() > 190);
    }
}
