//! The gains at which a loop keeps its limits, the shape of the controller given.
//!
//! With `C = k c` and `l = c G` each limit is a quadratic in `k` at every frequency:
//!
//! ```text
//! |1 + k l| >= 1/Ms                 |l|^2 k^2 + 2 Re(l) k + 1 - 1/Ms^2 >= 0
//! |k l| <= Mt |1 + k l|             (1 - 1/Mt^2) |l|^2 k^2 + 2 Re(l) k + 1 >= 0
//! |k c| <= N |1 + k l|              (|l|^2 - |c|^2 / N^2) k^2 + 2 Re(l) k + 1 >= 0
//! ```
//!
//! so the forbidden gains of a frequency are an interval, and the room is what all of them leave. Within a
//! gap of the room the loop does not change its stability: it would have to pass -1, which is forbidden.

use super::open_loop::OpenLoop;
use crate::error::Result;
use crate::linalg::Complex;
use crate::model::{Model, Pid};

/// Phase of the dead time, rad, beyond which the worst phase stands for all of a turn.
const TURNED: f64 = 6.0 * std::f64::consts::PI;

/// Limits that a loop shall keep; absent ones are infinite.
#[derive(Clone, Copy, Debug)]
pub struct Robustness {
    /// Largest sensitivity, above 1.
    pub Ms: f64,
    /// Largest complementary sensitivity, above 1.
    pub Mt: f64,
    /// Largest gain from measurement noise to u, u/y.
    pub noise_gain: f64,
}

/// A plant over the frequencies that matter.
pub struct Plant {
    model: Model,
    w: Vec<f64>,
    G: Vec<Complex<f64>>,
    /// From this frequency on a turn of the dead time is too quick to follow, and any phase is met.
    turns: f64,
    /// Whether small gains are stable with integral action: no pole at 0 nor beyond.
    self_regulating: bool,
    /// Static gain; infinite for an integrating plant.
    gain: f64,
    /// Shortest and longest time that matters, s.
    times: (f64, f64),
}

impl Plant {
    /// Frequencies of a continuous plant, or of one that a controller samples every `Ts`.
    pub fn new(model: &Model, Ts: Option<f64>) -> Result<Self> {
        let gain = model.dc_gain()[0];
        let open = OpenLoop::new(model, &Pid { Ki: 0.0, Ts, ..Pid::pi(1.0, 1.0) })?;
        let (slowest, fastest) = open.span();
        let turns = if open.delay() > 0.0 { TURNED / open.delay() } else { f64::INFINITY };
        let w = open.between(1e-2 * slowest, 30.0 * fastest, turns);
        let G = w.iter().map(|&w| open.at(w)).collect();
        let inside = |(re, im): (f64, f64)| match open.sampled() {
            Some(_) => re.hypot(im) < 1.0 - 1e-9,
            None => re < 0.0,
        };
        let self_regulating = open.plant_poles().into_iter().all(inside);
        let times = (1.0 / fastest, 1.0 / slowest);
        Ok(Plant { model: model.clone(), w, G, turns, self_regulating, gain, times })
    }

    /// Static gain; infinite for an integrating plant.
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// Shortest and longest time that matters, s.
    pub fn times(&self) -> (f64, f64) {
        self.times
    }

    /// Lowest stable gap of gains `k > 0` for the controller `k shape`; empty where there is none.
    pub fn room(&self, shape: &Pid, limits: &Robustness) -> Option<(f64, f64)> {
        if self.gain.is_sign_negative() != (shape.Kp < 0.0) {
            return None; // the controller pushes the wrong way
        }
        let mut forbidden = self.forbidden(shape, limits);
        // Beyond the highest frequency S is 1 and the noise meets the controller alone.
        let most = limits.noise_gain / self.gain_beyond(shape);
        if most.is_finite() {
            forbidden.push((most, f64::INFINITY));
        }
        forbidden.sort_by(|a, b| a.0.total_cmp(&b.0));
        if self.self_regulating {
            let first = forbidden.first().map_or(f64::INFINITY, |f| f.0);
            return (first > 0.0).then_some((0.0, first));
        }
        let mut low = 0.0;
        for &(from, to) in forbidden.iter().chain([&(f64::INFINITY, f64::INFINITY)]) {
            if from > low
                && self.is_stable(shape, if from.is_finite() { 0.5 * (low + from) } else { 2.0 * low + 1.0 })
            {
                return Some((low, from));
            }
            low = f64::max(low, to);
        }
        None
    }

    /// Largest `|c|` above the frequencies of the plant; a filter on y has its peak near `1 / Tf`.
    fn gain_beyond(&self, shape: &Pid) -> f64 {
        let highest = self.w[self.w.len() - 1];
        let reach = (10.0 / (shape.Tf * highest)).max(1.0);
        let peak = |k: i32| shape.freqresp(highest * reach.powf(f64::from(k) / 80.0)).norm();
        let sampled = shape.Ts.is_some();
        if sampled || !reach.is_finite() {
            shape.gain_beyond()
        } else {
            (0..=80).map(peak).fold(shape.gain_beyond(), f64::max)
        }
    }

    /// The intervals that the limits forbid, one for each frequency at most and limit.
    fn forbidden(&self, shape: &Pid, limits: &Robustness) -> Vec<(f64, f64)> {
        let of_S = 1.0 - limits.Ms.powi(-2);
        let of_T = 1.0 - limits.Mt.powi(-2);
        let per_noise = limits.noise_gain.powi(-2);
        let mut found = Vec::new();
        for (&w, &G) in self.w.iter().zip(&self.G) {
            let c = shape.freqresp(w);
            let l = c * G;
            let size = l.norm_sqr();
            let half = if w < self.turns { l.re } else { -size.sqrt() };
            let quadratics = [(size, of_S), (of_T * size, 1.0), (size - per_noise * c.norm_sqr(), 1.0)];
            let wanted = if limits.noise_gain.is_finite() { 3 } else { 2 };
            found.extend(quadratics[..wanted].iter().filter_map(|&(p, r)| below_zero(p, half, r)));
        }
        found
    }

    fn is_stable(&self, shape: &Pid, k: f64) -> bool {
        let pid = Pid { Kp: k * shape.Kp, Ki: k * shape.Ki, ..*shape };
        OpenLoop::new(&self.model, &pid).is_ok_and(|open| open.closes())
    }
}

/// Where `p k^2 + 2 q k + r < 0` for `k > 0`, with `r > 0`.
fn below_zero(p: f64, q: f64, r: f64) -> Option<(f64, f64)> {
    let discriminant = q * q - p * r;
    if p <= 0.0 {
        // r / (sqrt - q) without taking near-equal numbers apart; p = 0 gives r / (-2 q).
        let edge = r / (discriminant.sqrt() - q);
        return (edge.is_finite() && edge > 0.0).then_some((edge, f64::INFINITY));
    }
    (q < 0.0 && discriminant > 0.0).then(|| {
        let larger = (discriminant.sqrt() - q) / p;
        (r / (p * larger), larger)
    })
}
