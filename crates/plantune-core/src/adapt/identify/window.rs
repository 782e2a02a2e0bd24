//! Identification by windowed maximum likelihood: what is shown and tuned on.
//!
//! Every `every` samples the window is fitted. In between its model predicts, and the errors are watched
//! ([`super::super::alarm`]). After an alarm the level is free from where the change began, and two answers compete:
//!
//! ```text
//! same plant, another level     rss of one plant over all rows, a level before and one after
//! another plant                 rss before + rss after, each with a plant of its own
//! D = (rss_same - rss_before - rss_after) / s^2,  chi-squared with 4 or 5 degrees of freedom if it is the same
//! ```
//!
//! Above [`CHANGED`] the rows before are forgotten; once the rows after tell the gain on their own and do not
//! contradict, the alarm was the level's. Until then the estimate is not taken.

use super::super::alarm::Alarm;
use super::{Identified, News};
use crate::error::{Error, Result};
use crate::linalg::extent;
use crate::recursive::{Estimate, Predictor, Window};

/// `D` beyond which it is another plant.
const CHANGED: f64 = 30.0;

/// Relative standard deviation of the gain after the alarm, below which the rows after have said enough.
const SAID: f64 = 0.1;

/// Relative standard deviation of K and of T, and probability of the delay, from which on errors are watched.
const KNOWN: (f64, f64, f64) = (0.05, 0.1, 0.95);

/// Squared errors in the sum from which on their variance is known.
const FEWEST: usize = 60;

/// Rows beyond the longest delay without which a plant is never fitted.
const FEWEST_ROWS: usize = 10;

/// Standard deviations from which on an error does not count.
const OUTLIER: f64 = 5.0;

/// Share of the output's range below which an error is rounding.
const ROUNDING: f64 = 1e-9;

/// Rows with which the predictor recalls its memory.
const MEMORY: usize = 60;

/// Samples after an alarm before the first fit.
const PATIENCE: usize = 6;

/// How an identification is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowSettings {
    /// Sample time, s.
    pub Ts: f64,
    /// Delays searched, samples.
    pub nk: (usize, usize),
    /// Whether a delay may have a fraction of a sample.
    pub fraction: bool,
    /// Rows of the window.
    pub rows: usize,
    /// Samples between fits.
    pub every: usize,
}

/// The window, its model, and the watch on it.
#[derive(Clone, Debug)]
pub struct WindowIdentifier {
    settings: WindowSettings,
    window: Window,
    estimate: Option<Estimate>,
    predictor: Option<Predictor>,
    alarm: Alarm,
    /// Samples until the next fit.
    wait: usize,
    judged: Option<Judged>,
}

/// An alarm on which no judgement is passed yet.
#[derive(Clone, Debug)]
struct Judged {
    /// Rows since the change.
    rows: usize,
    /// Sum of squares and number before it.
    before: Option<(f64, usize)>,
}

impl WindowIdentifier {
    /// An empty window.
    pub fn new(settings: WindowSettings) -> Result<Self> {
        let WindowSettings { Ts, nk, fraction, rows, every } = settings;
        let window = Window::new(Ts, nk.0..=nk.1, fraction, rows)?;
        let least = nk.1 + FEWEST_ROWS;
        if rows < least {
            return Err(Error::argument(
                "rows",
                rows,
                &format!("at least {least}, nk and {FEWEST_ROWS} more"),
            ));
        }
        if every == 0 {
            return Err(Error::argument("every", every, "at least 1 sample"));
        }
        Ok(WindowIdentifier {
            settings,
            window,
            estimate: None,
            predictor: None,
            alarm: Alarm::default(),
            wait: every,
            judged: None,
        })
    }

    /// The last estimate.
    pub fn identified(&self) -> Option<Identified> {
        let Estimate { model, P, offset, outside, modes, delays, .. } = self.estimate.clone()?;
        Some(Identified { model, P, offset, outside, modes, delays })
    }

    /// Rows that are fitted.
    pub fn rows(&self) -> usize {
        self.window.len()
    }

    /// Whether an alarm waits for its judgement.
    pub fn is_judging(&self) -> bool {
        self.judged.is_some()
    }

    /// Forgets everything: the plant is another one.
    pub fn reset(&mut self) {
        self.window.keep(0);
        (self.estimate, self.predictor, self.judged) = (None, None, None);
        self.alarm.reset();
        self.wait = self.settings.every;
    }

    /// The next sample does not follow the last one.
    pub fn gap(&mut self) {
        self.window.gap();
        self.predictor = None;
        self.alarm.reset();
    }

    /// Takes `u`, which acts from now on, and `y`, which is read now.
    pub fn step(&mut self, u: f64, y: f64) -> News {
        let mut news = News::default();
        let z = self.error(y);
        self.window.push(u, y, z.is_none_or(|z| z.abs() < OUTLIER));
        if let Some(judged) = &mut self.judged {
            judged.rows += 1;
        }
        if let Some(ago) = z.and_then(|z| self.alarm.step(z)) {
            news.alarm = true;
            self.open_level(ago);
        }
        self.wait = self.wait.saturating_sub(1);
        if self.wait == 0 {
            news.changed = self.fit();
            news.fitted = self.estimate.is_some();
            self.wait = self.settings.every;
        }
        news
    }

    /// The standardised error of `y`.
    fn error(&mut self, y: f64) -> Option<f64> {
        let predictor = self.predictor.as_mut()?;
        let (u, y_before) = self.window.last(predictor.history());
        (y_before.len() >= predictor.history()).then(|| predictor.step(u, y_before, y))
    }

    fn open_level(&mut self, ago: usize) {
        let all = self.window.len();
        let before = self.window.fit_rows(0..all - ago.min(all)).map(|e| (e.rss, e.N));
        self.window.new_level(ago);
        self.judged = Some(Judged { rows: ago, before });
        self.predictor = None; // blind until the new level is known
        self.wait = PATIENCE;
    }

    /// Fits, judges an alarm, and says whether the plant is another one.
    fn fit(&mut self) -> bool {
        let mut changed = false;
        let mut found = self.window.fit();
        if let Some(Judged { rows, before }) = self.judged.clone() {
            let all = self.window.len();
            let after = self.window.fit_rows(all - rows.min(all)..all);
            match (&found, &after, before) {
                (_, _, None) => {
                    // Nothing was known before.
                    self.window.keep(rows);
                    (found, self.judged, changed) = (after, None, true);
                }
                (Some(same), Some(after), Some((rss, N))) => {
                    let s2 = (rss + after.rss) / (N + after.N).saturating_sub(10).max(1) as f64;
                    let (low, high) = extent(self.window.last(all).1);
                    let s2 = s2.max((ROUNDING * (high - low)).powi(2));
                    if same.rss - rss - after.rss > CHANGED * s2 {
                        self.window.keep(rows);
                        (found, self.judged, changed) = (Some(after.clone()), None, true);
                    } else if after.sd()[0] < SAID * after.model.K.abs() {
                        self.judged = None;
                    }
                }
                _ => {}
            }
        }
        if found.is_some() {
            self.estimate = found;
            self.recall();
        }
        changed
    }

    /// The predictor of the estimate, its memory that of the last rows.
    fn recall(&mut self) {
        let Some(estimate) = &self.estimate else { return };
        if self.judged.is_some() || !is_known(estimate) {
            self.predictor = None;
            return;
        }
        let mut predictor = estimate.predictor.clone();
        // At another level its errors are none of the model's, and its memory would call them an alarm.
        let level = self.window.level_len().saturating_sub(1) + predictor.history();
        let (u, y) = self.window.last(MEMORY.max(predictor.history() + 1).min(level));
        predictor.warm(u, y);
        self.predictor = Some(predictor);
    }
}

/// Whether errors of this model are those of the noise, and not its own.
fn is_known(estimate: &Estimate) -> bool {
    let (K, T, delay) = KNOWN;
    let sd = estimate.sd();
    let surest = estimate.delays.iter().copied().fold(0.0, f64::max);
    estimate.N >= FEWEST
        && sd[0] < K * estimate.model.K.abs()
        && sd[1] < T * estimate.model.T
        && surest >= delay
}
