//! What innovations say about the noise: its scale, outliers, and steps of the offset.
//!
//! With `eps` the prediction error and `s^2 v` its variance, `v = 1 + q S2/S1` ([`super::Forgetting`]):
//!
//! ```text
//! s^2  exponentially weighted mean of min(eps^2/v, 9 s^2)
//! z    = eps/(s sqrt(v)), cut to +-6 and summed ([`Cusum`])
//! ```
//!
//! Where the prediction is less certain than the noise, `v >= 2`, an innovation speaks of the parameters and not of
//! the noise: nothing is judged and nothing is cut. So it is at the start, and right after an alarm. A single
//! outlier takes the sum to 5.25 and raises no alarm; a step that stays does so at its second sample.
//! METHODS 1.4; the cumulative sum: Page 1954; its use here: Gustafsson 2000, chapter 3.

use super::cusum::Cusum;
use super::greater;

/// Innovations judged before any is cut or summed, unless told otherwise: their scale is then known to a tenth.
pub const FIRST: f64 = 50.0;

/// Innovations over which the scale is taken.
const MEMORY: f64 = 200.0;

/// Standard deviations, squared, to which an innovation counts in the scale.
const ROBUST: f64 = 9.0;

/// Share of the output's travel below which no noise is believed when innovations are judged: what parameters
/// still on their way leave over is neither an outlier nor a step.
const LEAST: f64 = 1e-4;

/// Scale of the noise, and the sums that wait for a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Innovation {
    clip2: f64, // squared; infinite: never cut
    first: f64,
    watch: bool,
    s2: f64,
    rows: f64, // judged
    sums: Cusum,
}

/// What was made of an innovation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// The innovation to learn from.
    pub eps: f64,
    /// `eps^2/(s^2 v)` of it, or 1 where nothing can be said.
    pub surprise: f64,
    /// Whether the offset has moved.
    pub alarm: bool,
    /// Whether the sums still have to take it in.
    waits: bool,
}

impl Judged {
    /// Of which nothing can be said.
    #[inline(always)]
    pub(super) fn of(eps: f64) -> Self {
        Judged { eps, surprise: 1.0, alarm: false, waits: false }
    }
}

impl Innovation {
    /// Cuts at `clip` standard deviations if given, and `watch`es for steps, after the `first` innovations.
    pub fn new(clip: Option<f64>, watch: bool, first: f64) -> Self {
        let clip2 = clip.map_or(f64::INFINITY, |clip| clip * clip);
        Innovation { clip2, watch, first, s2: 0.0, rows: 0.0, sums: Cusum::default() }
    }

    /// Takes in the residuals of a batch.
    pub(super) fn begin(&mut self, rss: f64, degrees: f64) {
        if degrees > 0.0 {
            (self.s2, self.rows) = (rss / degrees, degrees);
        }
    }

    /// Judges an innovation of variance `s^2 v`, of an output that has travelled so far; [`Innovation::sum`] it when
    /// the sample is learnt.
    #[inline(always)]
    pub fn judge(&mut self, eps: f64, v: f64, travel: f64) -> Judged {
        if v >= 2.0 {
            return Judged::of(eps);
        }
        if self.rows < self.first {
            self.rows += 1.0;
            self.s2 += (eps * eps / v - self.s2) / self.rows;
            return Judged::of(eps);
        }
        let s2 = greater(greater(self.s2, (LEAST * travel).powi(2)), f64::MIN_POSITIVE);
        let z2 = eps * eps / (v * s2);
        let waits = self.watch && z2 <= self.clip2 && self.sums.bears(z2);
        if self.watch && !waits && self.sums.step(z2.sqrt().copysign(eps)).is_some() {
            return Judged { alarm: true, ..Judged::of(eps) };
        }
        let change = if z2 < ROBUST { z2 } else { ROBUST } * s2 - self.s2;
        if self.rows < MEMORY {
            self.rows += 1.0;
            self.s2 += change / self.rows;
        } else {
            self.s2 += change * (1.0 / MEMORY);
        }
        if z2 > self.clip2 { self.cut(eps, z2) } else { Judged { eps, surprise: z2, alarm: false, waits } }
    }

    /// Takes an innovation that raises no alarm into the sums. The root of its square is slow, and nothing that is
    /// learnt from the sample needs it: judged before, it would hold up the next sample by a tenth of its time.
    #[inline(always)]
    pub fn sum(&mut self, judged: Judged) {
        if judged.waits {
            self.sums.step(judged.surprise.sqrt().copysign(judged.eps));
        }
    }

    #[cold]
    fn cut(&self, eps: f64, z2: f64) -> Judged {
        Judged { surprise: self.clip2, ..Judged::of(eps * (self.clip2 / z2).sqrt()) }
    }

    /// Variance of the noise; infinite before anything was judged.
    pub fn s2(&self) -> f64 {
        if self.rows > 0.0 { self.s2 } else { f64::INFINITY }
    }

    /// Walks over every number of the state.
    pub(super) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        visit(&mut self.s2);
        visit(&mut self.rows);
        self.sums.numbers(visit);
    }
}

#[cfg(test)]
mod tests {
    use super::super::CLIP;
    use super::*;
    use crate::linalg::white;

    /// A whole sample.
    fn take(innovation: &mut Innovation, eps: f64, v: f64, travel: f64) -> Judged {
        let judged = innovation.judge(eps, v, travel);
        innovation.sum(judged);
        judged
    }

    fn after(rows: usize, scale: f64) -> Innovation {
        let mut innovation = Innovation::new(Some(CLIP), true, FIRST);
        for e in white(rows, 3) {
            assert!(!take(&mut innovation, scale * e, 1.0, scale).alarm);
        }
        innovation
    }

    #[test]
    fn the_scale_is_that_of_the_noise_in_any_unit() {
        for scale in [1e-8, 1.0, 1e8] {
            let s = after(2000, scale).s2().sqrt() / scale;
            assert!((s - 1.0).abs() < 0.1, "{s}");
        }
    }

    #[test]
    fn one_outlier_is_cut_and_two_of_one_sign_are_a_step() {
        let mut innovation = after(500, 1.0);
        let s = innovation.s2().sqrt();
        let first = take(&mut innovation, -60.0, 1.21, 1.0);
        assert!(!first.alarm && (first.eps + 6.0 * 1.1 * s).abs() < 0.02 * s, "{first:?} {s}");
        let mut other = innovation.clone();
        assert!(take(&mut innovation, -60.0, 1.0, 1.0).alarm && !take(&mut other, 60.0, 1.0, 1.0).alarm);
        assert!(innovation.s2() < 1.1 * s * s);
        let uncertain = take(&mut innovation, -60.0, 50.0, 1.0);
        assert_eq!((uncertain.eps, uncertain.alarm), (-60.0, false));
    }

    /// Siegmund's formula for the sum of known scale: one in 415 000 samples. Of a scale over 200: 14 in 3e6.
    #[test]
    fn false_alarms_are_rare() {
        let mut innovation = Innovation::new(Some(CLIP), true, FIRST);
        let alarms =
            white(3_000_000, 5).iter().filter(|e| take(&mut innovation, **e, 1.0, 1.0).alarm).count();
        assert!((3..40).contains(&alarms), "{alarms}");
    }
}
