//! Time-domain indices of a closed-loop response, from true integrals, piece by piece as it runs.
//!
//! `rise` 10-90 %, `settling` into 2 % of the move, overshoots in percent of the move, `ise iae itae` of
//! `r - y`, `control_energy` the integral of `u^2`, `total_variation` of `u`. Between two nodes a first
//! order is followed exactly; of other plants y is the cubic through values and slopes, which costs
//! `(h / T)^4 / 720` of what a mode of time `T` contributes.
//! Source 001, tables 3.6-2 and 3.6-3, and (3.6-55).

use super::arc::{Arc, Moments};

/// Half width of the band of settling, as a share of the move.
const BAND: f64 = 0.02;
/// A piece whose share of the integrals is less has no sign worth looking for.
const NEGLIGIBLE: f64 = 1e-13;

/// An interval that holds nothing.
const NOWHERE: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);

/// Indices; NaN where the response does not define one (no set-point move, not settled).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Indices {
    /// From 10 to 90 % of the move, s.
    pub rise: f64,
    /// From when on y stays within 2 % of the move, s.
    pub settling: f64,
    /// Beyond the final value, % of the move.
    pub overshoot: f64,
    /// Integral of `e^2`.
    pub ise: f64,
    /// Integral of `|e|`.
    pub iae: f64,
    /// Integral of `t |e|`.
    pub itae: f64,
    /// Of u beyond its final value, % of its move.
    pub control_overshoot: f64,
    /// Integral of `u^2`.
    pub control_energy: f64,
    /// Sum of all moves of u.
    pub total_variation: f64,
}

/// Where a signal starts and where it is to end.
#[derive(Clone, Copy, Debug)]
pub struct Move {
    /// Before time 0.
    pub from: f64,
    /// At rest again.
    pub to: f64,
}

/// What happens between nodes is told to one of these.
pub trait Watch {
    /// For `h` seconds y is smooth.
    fn arc(&mut self, h: f64, y: impl Arc);
}

/// Nobody watches.
impl Watch for () {
    #[inline(always)]
    fn arc(&mut self, _: f64, _: impl Arc) {}
}

/// Indices in the making: what every piece adds to, apart from what few pieces change.
#[derive(Debug)]
pub struct Sums<'c> {
    /// Time reached, s.
    t: f64,
    /// Set point and what is added to the output, until the next step of them.
    r: f64,
    dy: f64,
    ise: f64,
    iae: f64,
    itae: f64,
    energy: f64,
    variation: f64,
    u: f64,
    course: &'c mut Course,
}

/// The way of y and u to where they are to end.
#[derive(Debug)]
pub struct Course {
    /// `progress = scale (y - y0)`; the scale is 0 without a move.
    y0: f64,
    scale: f64,
    /// Outputs among which nothing is left to find, the least and the largest.
    quiet: (f64, f64),
    /// Times at which 10 and 90 % were reached.
    reached: [f64; 2],
    /// Time from which on y has stayed in the band; NaN while it is outside.
    settled: f64,
    peak: f64,
    u0: f64,
    u_scale: f64,
    /// Largest `u_scale (u - u0)`, and the last four nodes, between which straight lines meet in corners.
    u_peak: f64,
    nodes: [f64; 4],
}

impl Course {
    /// At rest, before time 0.
    pub fn new(y: Move, u: Move) -> Self {
        let scale = |x: Move| if x.to == x.from { 0.0 } else { 1.0 / (x.to - x.from) };
        let scale_y = scale(y);
        Course {
            y0: y.from,
            scale: scale_y,
            quiet: if scale_y == 0.0 { (f64::NEG_INFINITY, f64::INFINITY) } else { NOWHERE },
            reached: [f64::NAN; 2],
            settled: 0.0,
            peak: 0.0,
            u0: u.from,
            u_scale: scale(u),
            u_peak: 0.0,
            nodes: [f64::NAN; 4],
        }
    }

    /// The output over `[t, t + h]`.
    #[inline(never)]
    fn follow(&mut self, t: f64, h: f64, y: impl Arc) {
        let progress = y.affine(-self.y0 * self.scale, self.scale);
        let Moments { low, high, .. } = progress.moments();
        for (reached, level) in self.reached.iter_mut().zip([0.1, 0.9]) {
            if reached.is_nan() && high >= level {
                let from = progress.affine(-level, 1.0);
                let at = if from.ends().0 >= 0.0 { Some(0.0) } else { from.first_root() };
                *reached = at.map_or(f64::NAN, |s| t + s * h);
            }
        }
        if high > self.peak {
            self.peak = self.peak.max(progress.largest());
        }
        self.settled = self.settled(t, h, progress, (low, high));
        // In the band, below the peak, past 90 %: as it goes on, nothing changes.
        let done = self.settled.is_finite() && self.reached[1].is_finite();
        let of = |progress: f64| self.y0 + progress / self.scale;
        let (a, b) = (of(1.0 - BAND), of(self.peak.min(1.0 + BAND)));
        self.quiet = if done { (a.min(b), a.max(b)) } else { NOWHERE };
    }

    fn settled(&self, t: f64, h: f64, progress: impl Arc, (low, high): (f64, f64)) -> f64 {
        let out = |p: f64| (p - 1.0).abs() > BAND;
        let (begin, end) = progress.ends();
        if out(end) {
            return f64::NAN;
        }
        let edges = [(high > 1.0 + BAND, 1.0 + BAND), (low < 1.0 - BAND, 1.0 - BAND)];
        let beyond = edges.into_iter().filter(|(is, _)| *is);
        let last =
            beyond.filter_map(|(_, edge)| progress.affine(-edge, 1.0).last_root()).fold(f64::NAN, f64::max);
        match self.settled {
            _ if last.is_finite() => t + last * h,
            before if before.is_nan() || out(begin) => t,
            before => before,
        }
    }

    /// The controller output at a node.
    fn node(&mut self, u: f64) {
        let [_, a, b, c] = self.nodes;
        let d = (u - self.u0) * self.u_scale;
        self.nodes = [a, b, c, d];
        if b >= self.u_peak || c >= self.u_peak {
            // The lines through (a, b) and (d, c).
            let (rise, fall) = (b - a, c - d);
            let at = (c + fall - b) / (rise + fall);
            if rise > 0.0 && fall > 0.0 && (0.0..=1.0).contains(&at) {
                self.u_peak = self.u_peak.max(b + rise * at);
            }
        }
        self.u_peak = self.u_peak.max(d);
    }
}

impl<'c> Sums<'c> {
    /// At time 0.
    pub fn new(course: &'c mut Course) -> Self {
        let (r, u) = (course.y0, course.u0);
        Sums { t: 0.0, r, dy: 0.0, ise: 0.0, iae: 0.0, itae: 0.0, energy: 0.0, variation: 0.0, u, course }
    }

    /// From time `t` on, `r` is the set point and `dy` is added to the output.
    #[inline(always)]
    pub fn step(&mut self, t: f64, r: f64, dy: f64) {
        (self.t, self.r, self.dy) = (t, r, dy);
    }

    /// The controller output is held at `u` for `h` seconds.
    #[inline(always)]
    pub fn held(&mut self, h: f64, u: f64) {
        self.energy += h * (u * u);
        if u != self.u {
            self.variation += (u - self.u).abs();
            self.u = u;
            let moved = (u - self.course.u0) * self.course.u_scale;
            if moved > self.course.u_peak {
                self.course.u_peak = moved;
            }
        }
    }

    /// The controller output runs straight from `u0` to `u1` within `h` seconds.
    pub fn line(&mut self, h: f64, u0: f64, u1: f64) {
        self.energy += h * (u0 * u0 + u0 * u1 + u1 * u1) / 3.0;
        self.variation += (u0 - self.u).abs() + (u1 - u0).abs();
        self.u = u1;
        self.course.node(u0);
    }

    /// The controller output at the end.
    pub fn end(&mut self, u: f64) {
        self.variation += (u - self.u).abs();
        self.course.node(u);
    }

    /// All that was asked for.
    pub fn indices(&self) -> Indices {
        let c = &self.course;
        let defined = |scale: f64, x: f64| if scale == 0.0 { f64::NAN } else { x };
        let [low, high] = c.reached;
        Indices {
            rise: high - low,
            settling: defined(c.scale, c.settled),
            overshoot: defined(c.scale, 100.0 * (c.peak - 1.0).max(0.0)),
            ise: self.ise,
            iae: self.iae,
            itae: self.itae,
            control_overshoot: defined(c.u_scale, 100.0 * (c.u_peak - 1.0).max(0.0)),
            control_energy: self.energy,
            total_variation: self.variation,
        }
    }
}

impl Watch for Sums<'_> {
    #[inline(always)]
    fn arc(&mut self, h: f64, y: impl Arc) {
        let e = y.affine(self.r - self.dy, -1.0);
        let Moments { mean, first, square, low, high } = e.moments();
        let (mut mean, mut first) = (mean.abs(), first.abs());
        if low * high < 0.0 && h * (high - low) > NEGLIGIBLE * self.iae {
            (mean, first) = e.absolute_moments();
        }
        self.ise += h * square;
        self.iae += h * mean;
        self.itae += h * (self.t * mean + h * first);
        if self.r - high < self.course.quiet.0 || self.r - low > self.course.quiet.1 {
            self.course.follow(self.t, h, y.affine(self.dy, 1.0));
        }
        self.t += h;
    }
}
