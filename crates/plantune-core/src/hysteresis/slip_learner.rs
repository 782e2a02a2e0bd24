//! Elements in series learnt on line: a line through each breakpoint, and a new one where it no longer fits.
//!
//! ```text
//! d = x - x_b    e = y - y_b - k d                        against the element in use
//! k <- k + P d e / (1 + P d^2)    P <- P - P^2 d^2 / (1 + P d^2)
//! |y - y_b - k d| > threshold, so many times in a row: the next element
//! ```
//!
//! Source 002, 4.2 to 4.4 and (A13), as corrected: increments from the breakpoint in place of `Y` and `x`, `P_1` of
//! 100 per square unit of x in place of 1, and `k` kept instead of begun at 0. The next element begins at the last
//! sample inside the threshold, and its slope is fitted from there on: no sample is further off than the threshold
//! when it is learnt, where one exceedance is enough. (Begun at the sample beyond, as printed, the error there adds
//! 0.03 to 0.07 um to 0.5 at 200 samples a cycle.)
//!
//! When the input turns, the other group is learnt afresh, from the extreme on: anchors are measured positions, so
//! nothing is summed up, and no number of cycles makes the loop drift. A stretch takes the place of the last one in
//! its direction if it went as far.

use super::series_slip::{Element, SeriesSlip};
use crate::error::{Error, Result};

/// Standard deviations of the noise that the threshold shall have where one exceedance opens an element.
pub(super) const SOUND: f64 = 8.0;

/// Exceedances in a row asked for below that.
const PATIENCE: usize = 3;

/// Share of the travel of a group's stretch that another must reach to take its place.
const AS_FAR: f64 = 0.99;

/// What is asked of the learner.
#[derive(Clone, Debug, PartialEq)]
pub struct SlipSettings {
    /// Error beyond which a new element begins, in units of y.
    pub threshold: f64,
    /// Exceedances in a row that it takes.
    pub consecutive: Option<usize>,
    /// `P` of a new element, 1/x^2.
    pub P0: f64,
    /// Standard deviation of the noise of y.
    pub noise_sd: f64,
    /// How far the input must come back to have turned, in units of x.
    pub band: f64,
}

impl SlipSettings {
    /// Exceedances in a row: those asked for, else one where the threshold has eight standard deviations of the
    /// noise and three where it has not.
    pub fn patience(&self) -> usize {
        let sound = self.threshold >= SOUND * self.noise_sd;
        self.consecutive.unwrap_or(if sound { 1 } else { PATIENCE })
    }

    fn check(&self) -> Result<()> {
        for (name, value) in [("threshold", self.threshold), ("P0", self.P0)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::argument(name, value, "positive and finite"));
            }
        }
        for (name, value) in [("noise_sd", self.noise_sd), ("band", self.band)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::argument(name, value, "0 or positive, and finite"));
            }
        }
        if self.consecutive == Some(0) {
            return Err(Error::argument("consecutive", 0, "at least 1"));
        }
        Ok(())
    }
}

/// A sample.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    x: f64,
    y: f64,
}

/// Elements of one stretch in one direction, the last of them in use; `P` beside each.
#[derive(Clone, Debug, Default)]
pub(super) struct Stretch {
    pub(super) elements: Vec<Element>,
    pub(super) P: Vec<f64>,
    /// First and last sample, counted from 0.
    pub(super) rows: (usize, usize),
    /// How far the input went.
    pub(super) travel: f64,
}

impl Stretch {
    fn begin(&mut self, at: Sample, k: f64, P0: f64) {
        self.elements.push(Element { x_b: at.x, y_b: at.y, k });
        self.P.push(P0);
    }
}

/// The learner on its way along a record.
#[derive(Clone, Debug)]
pub struct SlipLearner {
    settings: SlipSettings,
    count: usize,          // samples seen
    way: f64,              // 0 until the input moves
    extreme: Sample,       // the furthest in this direction
    inside: (Sample, f64), // the last one within the threshold, and the slope then
    beyond: Vec<Sample>,   // those since
    now: Stretch,
    done: [Stretch; 2], // rising, falling
}

impl SlipLearner {
    /// Nothing learnt.
    pub fn new(settings: SlipSettings) -> Result<Self> {
        settings.check()?;
        Ok(SlipLearner {
            beyond: Vec::with_capacity(settings.patience()),
            settings,
            count: 0,
            way: 0.0,
            extreme: Sample::default(),
            inside: (Sample::default(), 0.0),
            now: Stretch::default(),
            done: Default::default(),
        })
    }

    /// Learns one sample and returns the error of the element in use before that.
    ///
    /// On error the state is unchanged.
    pub fn step(&mut self, x: f64, y: f64) -> Result<f64> {
        for (name, value) in [("x", x), ("y", y)] {
            if !value.is_finite() {
                return Err(Error::argument(name, value, "a finite number"));
            }
        }
        if !(x * x + y * y).is_finite() {
            let text = "the numbers of this sample overflow when squared";
            return Err(Error::new("N02", text).remedy("scale the signals to a range near 1"));
        }
        let sample = Sample { x, y };
        self.count += 1;
        if self.count == 1 {
            self.anchor(sample, 0);
            return Ok(0.0);
        }
        let moved = x - self.extreme.x;
        if self.way == 0.0 && moved.abs() > self.settings.band {
            self.way = moved.signum();
        } else if moved * self.way < -self.settings.band {
            self.turn();
        }
        let eps = y - self.element().at(x);
        // Behind the extreme and not yet turned, nothing is learnt.
        if self.way != 0.0 && (x - self.extreme.x) * self.way >= 0.0 {
            self.learn(sample);
            self.judge(sample);
            self.now.travel += (x - self.extreme.x).abs();
            self.now.rows.1 = self.count - 1;
            self.extreme = sample;
        }
        Ok(eps)
    }

    /// `step` for each sample; returns every error. A sample that is refused leaves those before it learnt.
    pub fn run(&mut self, x: &[f64], y: &[f64]) -> Result<Vec<f64>> {
        if x.len() != y.len() {
            let text = format!("x has {} samples, y has {}", x.len(), y.len());
            return Err(Error::new("D09", text).remedy("give one y per x"));
        }
        x.iter().zip(y).map(|(x, y)| self.step(*x, *y)).collect()
    }

    /// What has been learnt: the last stretch of each direction that went as far as the one before it.
    pub fn model(&self) -> Result<SeriesSlip> {
        if self.way == 0.0 {
            return Err(Error::new("X01", "the input has not moved: there is no element yet")
                .remedy("give samples of a rising or falling input"));
        }
        let [up, down] = [1.0, -1.0].map(|way| self.stretch(way).elements.clone());
        Ok(SeriesSlip { up, down })
    }

    /// What is asked of it.
    pub fn settings(&self) -> &SlipSettings {
        &self.settings
    }

    /// The stretch behind a group of the model.
    pub(super) fn stretch(&self, way: f64) -> &Stretch {
        let done = &self.done[index(way)];
        if way == self.way && self.now.travel >= AS_FAR * done.travel { &self.now } else { done }
    }

    fn element(&self) -> &Element {
        &self.now.elements[self.now.elements.len() - 1]
    }

    /// A stretch begins at a sample, with the slope that the last one in its direction began with.
    fn anchor(&mut self, at: Sample, row: usize) {
        let k = self.done[index(self.way)].elements.first().map_or(0.0, |e| e.k);
        self.now.begin(at, k, self.settings.P0);
        self.now.rows = (row, row);
        self.extreme = at;
        self.inside = (at, k);
        self.beyond.clear();
    }

    /// The input has turned: the other group, from the extreme on.
    fn turn(&mut self) {
        let finished = std::mem::take(&mut self.now);
        let row = finished.rows.1;
        let done = &mut self.done[index(self.way)];
        if finished.travel >= AS_FAR * done.travel {
            *done = finished;
        }
        self.way = -self.way;
        self.anchor(self.extreme, row);
    }

    /// Least squares of the slope, recursively.
    fn learn(&mut self, sample: Sample) {
        let last = self.now.elements.len() - 1;
        let (element, P) = (&mut self.now.elements[last], &mut self.now.P[last]);
        let d = sample.x - element.x_b;
        let gain = *P * d / (1.0 + d * *P * d);
        element.k += gain * (sample.y - element.at(sample.x));
        *P -= gain * d * *P;
    }

    /// Whether the element still fits; if not for so many samples in a row, the next begins.
    fn judge(&mut self, sample: Sample) {
        let element = *self.element();
        if (sample.y - element.at(sample.x)).abs() <= self.settings.threshold {
            self.inside = (sample, element.k);
            self.beyond.clear();
            return;
        }
        self.beyond.push(sample);
        if self.beyond.len() < self.settings.patience() {
            return;
        }
        let moved = |s: &Sample| (s.x - element.x_b) * self.way > 0.0;
        let candidates = std::iter::once(self.inside.0).chain(self.beyond.iter().copied());
        match candidates.enumerate().find(|(_, s)| moved(s)) {
            Some((skipped, start)) => self.open(start, skipped),
            None => drop(self.beyond.remove(0)), // at a standstill
        }
    }

    /// The next element begins at `start`, and learns those beyond but the first `skipped`.
    fn open(&mut self, start: Sample, skipped: usize) {
        let k = self.inside.1;
        if let Some(last) = self.now.elements.last_mut() {
            last.k = k;
        }
        self.now.begin(start, k, self.settings.P0);
        let beyond = std::mem::take(&mut self.beyond);
        beyond[skipped..].iter().for_each(|s| self.learn(*s));
        self.inside = (beyond.last().copied().unwrap_or(start), self.element().k);
        self.beyond = beyond;
        self.beyond.clear();
    }

    /// Every number of the state; the settings are not among them.
    pub fn state(&self) -> Vec<f64> {
        let (at, k) = self.inside;
        let mut all = vec![self.count as f64, self.way, self.extreme.x, self.extreme.y, at.x, at.y, k];
        all.push(self.beyond.len() as f64);
        all.extend(self.beyond.iter().flat_map(|s| [s.x, s.y]));
        for stretch in [&self.now, &self.done[0], &self.done[1]] {
            let Stretch { elements, P, rows, travel } = stretch;
            all.extend([elements.len() as f64, rows.0 as f64, rows.1 as f64, *travel]);
            all.extend(elements.iter().zip(P).flat_map(|(e, P)| [e.x_b, e.y_b, e.k, *P]));
        }
        all
    }

    /// Goes on from where another with the same settings stood.
    pub fn resume(&mut self, state: &[f64]) -> Result<()> {
        let mut numbers = state.iter().copied();
        let other = self.read(&mut numbers).filter(|_| numbers.next().is_none());
        *self = other.ok_or_else(|| {
            Error::argument("state", format!("{} numbers", state.len()), "that of a learner")
        })?;
        Ok(())
    }

    fn read(&self, numbers: &mut impl Iterator<Item = f64>) -> Option<SlipLearner> {
        let mut next = || numbers.next();
        let mut other = SlipLearner::new(self.settings.clone()).ok()?;
        (other.count, other.way) = (next()? as usize, next()?);
        other.extreme = Sample { x: next()?, y: next()? };
        other.inside = (Sample { x: next()?, y: next()? }, next()?);
        for _ in 0..next()? as usize {
            other.beyond.push(Sample { x: next()?, y: next()? });
        }
        for stretch in std::iter::once(&mut other.now).chain(&mut other.done) {
            let n = next()? as usize;
            stretch.rows = (next()? as usize, next()? as usize);
            stretch.travel = next()?;
            for _ in 0..n {
                stretch.elements.push(Element { x_b: next()?, y_b: next()?, k: next()? });
                stretch.P.push(next()?);
            }
        }
        (other.count == 0 || !other.now.elements.is_empty()).then_some(other)
    }
}

/// Of a direction in a pair: rising, falling.
fn index(way: f64) -> usize {
    if way < 0.0 { 1 } else { 0 }
}
