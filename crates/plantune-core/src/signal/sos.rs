//! Filters as a cascade of second-order sections, run one sample at a time.
//!
//! Each section is `(b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2)` in transposed direct form II:
//! `y = b0 x + s1`, `s1 <- b1 x - a1 y + s2`, `s2 <- b2 x - a2 y`. Source 001, (3.5-34), section by section.

use crate::error::{Error, Result};
use crate::linalg::Complex;

/// What is left of an impulse when it counts as over.
const OVER: f64 = 1e-20;

/// Most rows of a response.
const MOST_ROWS: usize = 100_000_000;

/// One section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// `b0, b1, b2`.
    pub b: [f64; 3],
    /// `a1, a2`.
    pub a: [f64; 2],
}

impl Section {
    /// The section's transfer function at `z`.
    pub fn at(&self, z: Complex<f64>) -> Complex<f64> {
        let w = z.inv();
        let [b0, b1, b2] = self.b;
        let [a1, a2] = self.a;
        ((w * b2 + b1) * w + b0) / ((w * a2 + a1) * w + 1.0)
    }

    /// Poles in z; a section of first order has one at the origin.
    pub fn poles(&self) -> [Complex<f64>; 2] {
        let half = -self.a[0] / 2.0;
        let d = half * half - self.a[1];
        if d < 0.0 {
            return [Complex::new(half, (-d).sqrt()), Complex::new(half, -(-d).sqrt())];
        }
        let larger = half + d.sqrt().copysign(half);
        let smaller = if larger == 0.0 { 0.0 } else { self.a[1] / larger };
        [Complex::new(larger, 0.0), Complex::new(smaller, 0.0)]
    }

    /// Largest magnitude of its poles.
    pub fn largest_pole(&self) -> f64 {
        self.poles()[0].norm()
    }
}

/// A stable filter, as it is designed.
#[derive(Clone, Debug, PartialEq)]
pub struct Sos {
    /// Applied in this order.
    pub sections: Vec<Section>,
    /// Output per constant input: exactly 0 or 1.
    pub dc_gain: f64,
}

impl Sos {
    /// Frequency response at `w Ts`, rad per sample.
    pub fn at(&self, wTs: f64) -> Complex<f64> {
        let z = Complex::from_polar(1.0, wTs);
        self.sections.iter().map(|s| s.at(z)).product()
    }

    /// Poles in z.
    pub fn poles(&self) -> Vec<Complex<f64>> {
        self.sections.iter().flat_map(Section::poles).filter(|p| p.norm_sqr() > 0.0).collect()
    }

    /// The first `n` rows of the response to a unit step at row 0, from zero.
    pub fn step_response(&self, n: usize) -> Result<Vec<f64>> {
        if n > MOST_ROWS {
            return Err(Error::argument("n", n, &format!("at most {MOST_ROWS}")));
        }
        let mut from_zero = Filter::at_rest(self, 0.0);
        Ok((0..n).map(|_| from_zero.next(1.0)).collect())
    }

    /// Row, interpolated, of the last time that the step response is further from its end than `share`
    /// of its own peak.
    pub fn settling(&self, share: f64) -> Result<f64> {
        let response = self.step_response(self.reach())?;
        let peak = response.iter().fold(0.0f64, |peak, y| peak.max(y.abs()));
        let off = |k: usize| (response[k] - self.dc_gain).abs() - share * peak;
        let last = (0..response.len() - 1).rev().find(|&k| off(k) > 0.0);
        Ok(last.map_or(0.0, |last| last as f64 + off(last) / (off(last) - off(last + 1))))
    }

    /// What rows `0 … n-1` still remember of the time before row 0: `m[k] = sum over j > k of |h(j)|`.
    ///
    /// An input that was off by at most 1 before row 0 puts row `k` off by at most `m[k]`.
    pub fn memory(&self, n: usize) -> Vec<f64> {
        let h = self.impulse_magnitudes();
        let mut later: f64 = h.iter().skip(n).sum();
        let mut memory = vec![0.0; n];
        for (m, h) in memory.iter_mut().zip(&h).rev() {
            (*m, later) = (later, later + h);
        }
        memory
    }

    /// Rows until the memory of the time before has fallen to this share.
    pub fn forgets(&self, share: f64) -> usize {
        rows_until(&self.memory(self.reach()), share)
    }

    /// Sum of `|h(j)|`: the largest output for inputs of at most 1.
    pub fn largest_output(&self) -> f64 {
        self.impulse_magnitudes().iter().sum()
    }

    /// `|h(j)|` until it is over.
    fn impulse_magnitudes(&self) -> Vec<f64> {
        let mut from_zero = Filter::at_rest(self, 0.0);
        (0..self.reach()).map(|k| from_zero.next(if k == 0 { 1.0 } else { 0.0 }).abs()).collect()
    }

    /// Rows after which the slowest pole is over.
    fn reach(&self) -> usize {
        let slowest = self.sections.iter().map(Section::largest_pole).fold(0.5, f64::max);
        (OVER.ln() / slowest.ln()).ceil() as usize + 2 * self.sections.len()
    }
}

/// Rows until no more than this share is remembered.
pub fn rows_until(memory: &[f64], share: f64) -> usize {
    memory.iter().position(|m| *m <= share).unwrap_or(memory.len())
}

/// A filter on its way along one signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    sections: Vec<Section>,
    dc_gain: f64,
    /// The level it was in equilibrium with before the first sample.
    level: Option<f64>,
    state: Vec<[f64; 2]>, // (sections): s1, s2, of the signal's departure from the level
}

impl Filter {
    /// Will start in equilibrium with the first value that comes.
    pub fn new(sos: &Sos) -> Self {
        let state = vec![[0.0; 2]; sos.sections.len()];
        Filter { sections: sos.sections.clone(), dc_gain: sos.dc_gain, level: None, state }
    }

    /// Starts in equilibrium with this level.
    pub fn at_rest(sos: &Sos, level: f64) -> Self {
        Filter { level: Some(level), ..Filter::new(sos) }
    }

    /// Where it stands: the level it started from, once it has, and `s1, s2` of each section.
    pub fn state(&self) -> (Option<f64>, &[[f64; 2]]) {
        (self.level, &self.state)
    }

    /// Goes on from where another of the same design stood.
    pub fn resume(&mut self, level: Option<f64>, state: Vec<[f64; 2]>) -> Result<()> {
        if state.len() != self.sections.len() {
            return Err(Error::argument("state", format!("of {} sections", state.len()), "of this filter"));
        }
        (self.level, self.state) = (level, state);
        Ok(())
    }

    /// Filters one sample; one that is not finite is refused, the state unchanged.
    pub fn step(&mut self, x: f64) -> Result<f64> {
        if x.is_finite() { Ok(self.next(x)) } else { Err(Error::argument("x", x, "a finite number")) }
    }

    /// `step` for each sample, in place.
    pub fn run(&mut self, x: &mut [f64]) -> Result<()> {
        if let Some(bad) = x.iter().find(|x| !x.is_finite()) {
            return Err(Error::argument("x", bad, "finite in every row"));
        }
        x.iter_mut().for_each(|x| *x = self.next(*x));
        Ok(())
    }

    fn next(&mut self, x: f64) -> f64 {
        // Departures from the equilibrium start from zero, and a large level costs them no digits.
        let level = *self.level.get_or_insert(x);
        let mut v = x - level;
        for (section, [s1, s2]) in self.sections.iter().zip(&mut self.state) {
            let [b0, b1, b2] = section.b;
            let [a1, a2] = section.a;
            let y = b0 * v + *s1;
            *s1 = b1 * v - a1 * y + *s2;
            *s2 = b2 * v - a2 * y;
            v = y;
        }
        v + self.dc_gain * level
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Band, butter};

    #[test]
    fn memory_bounds_what_an_unknown_past_does() {
        let sos = butter(5, Band::Low(20.0), 0.02).expect("a filter");
        let memory = sos.memory(200);
        let past: Vec<f64> = (0..400).map(|k| f64::from(k * k % 7) / 3.0 - 1.0).collect();
        let mut knows = Filter::at_rest(&sos, 0.0);
        past.iter().for_each(|&x| {
            knows.next(x);
        });
        let mut assumes = Filter::new(&sos);
        let ends = 0.4;
        let off: Vec<f64> = (0..200).map(|_| (knows.next(ends) - assumes.next(ends)).abs()).collect();
        // The past departs from the first value by at most 1.4.
        assert!(off.iter().zip(&memory).all(|(off, m)| *off <= 1.4 * m + 1e-15));
        assert!(off[0] > 0.1 && memory[150] < 1e-6);
    }

    #[test]
    fn memory_is_the_tail_of_the_impulse_response() {
        let sos = butter(3, Band::High(5.0), 0.02).expect("a filter");
        let memory = sos.memory(50);
        let total = sos.largest_output();
        let steps = sos.step_response(50).expect("few rows");
        assert!((total - memory[0] - steps[0].abs()).abs() < 1e-13);
        let h9 = (steps[9] - steps[8]).abs();
        assert!((memory[8] - memory[9] - h9).abs() < 1e-13);
        let rows = sos.forgets(0.1);
        let memory = sos.memory(rows + 1);
        assert!(memory[rows] <= 0.1 && memory[rows - 1] > 0.1);
    }

    #[test]
    fn a_sample_that_is_none_changes_nothing() {
        let mut filter = Filter::new(&butter(4, Band::Low(3.0), 0.1).expect("a filter"));
        filter.step(2.0).expect("a sample");
        let before = filter.clone();
        assert!(filter.step(f64::NAN).is_err() && filter == before);
        assert!(filter.run(&mut [1.0, f64::INFINITY]).is_err() && filter == before);
    }
}
