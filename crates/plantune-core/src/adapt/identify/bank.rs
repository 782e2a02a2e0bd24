//! Identification by a bank of recursions, one for each delay.
//!
//! ```text
//! u, y -> prefilter -> bank of RML -> delay by posterior or by counters -> K = b/(1-a), T = -Ts/ln a, L = (nk-1) Ts
//! ```
//!
//! With the offset as a parameter and no prefilter this is METHODS 1.2 to 1.5: an alarm on the errors opens the
//! offset alone. With a band-pass, started at zero or at rest, and no offset it is the scheme of source 001,
//! 3.7.4 a to d, whose estimates are wrong until the filter has forgotten the level it began at.

use super::super::alarm::Alarm;
use super::super::delay::{Counters, DelayChoice, Posterior, PosteriorSettings};
use super::{Identified, News};
use crate::error::{Error, Result};
use crate::linalg::congruence;
use crate::model::Fopdt;
use crate::recursive::{Bank, BankSettings, Gate, Mode};
use crate::signal::{Band, Filter, Sos, butter};

/// Variance that an alarm adds to the offset, in units of the noise variance.
const OPENED: f64 = 1e3;

/// Variance of an offset that is none.
const NO_OFFSET: f64 = 1e-12;

/// Probability below which a delay is left out.
const UNLIKELY: f64 = 1e-6;

/// Samples learnt before errors are watched.
const FIRST: usize = 100;

/// A band-pass on u and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prefilter {
    /// Order of the prototype.
    pub order: usize,
    /// Cut-offs, rad/s.
    pub band: (f64, f64),
    /// Whether it starts in equilibrium with the first sample, or at zero.
    pub steady: bool,
}

/// How the delay is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DelayRule {
    /// By probability.
    Posterior(PosteriorSettings),
    /// By counted demand over a moving window.
    Counters {
        /// Samples of the window.
        W: usize,
        /// Counts that demand must exceed.
        hysteresis: usize,
    },
}

/// How a bank identifies.
#[derive(Clone, Debug)]
pub struct BankScheme {
    /// Sample time, s.
    pub Ts: f64,
    /// Delays, samples.
    pub nk: (usize, usize),
    /// The recursions.
    pub bank: BankSettings,
    /// Whether the offset is a parameter.
    pub offset: bool,
    /// What u and y pass before.
    pub prefilter: Option<Prefilter>,
    /// Choice of the delay.
    pub delay: DelayRule,
    /// Samples before the bank opens, for a prefilter to settle.
    pub opens: usize,
}

impl BankScheme {
    /// Rows that forgetting leaves.
    pub fn memory(&self) -> usize {
        (1.0 / (1.0 - self.bank.lambda).max(1e-6)) as usize
    }
}

/// The bank, its prefilter, and the choice among its members.
#[derive(Clone, Debug)]
pub struct BankIdentifier {
    settings: BankScheme,
    bank: Bank,
    sos: Option<Sos>,
    filters: Option<[Filter; 2]>,
    delay: DelayChoice,
    gate: Gate,
    alarm: Alarm,
    eps: Vec<f64>,
    q: Vec<f64>,
    seen: usize,
    learnt: usize,
}

impl BankIdentifier {
    /// Knowing nothing yet.
    pub fn new(settings: &BankScheme) -> Result<Self> {
        let (low, high) = settings.nk;
        if high < low {
            return Err(Error::argument("nk", format!("({low}, {high})"), "an ascending pair of samples"));
        }
        let mut own = BankSettings { errors: true, ..settings.bank.clone() };
        if !settings.offset {
            own.P0[2] = NO_OFFSET;
        }
        let sos = settings.prefilter.map(|f| butter(f.order, Band::Pass(f.band.0, f.band.1), settings.Ts));
        let candidates = high - low + 1;
        let first = candidates / 2;
        let delay = match settings.delay {
            DelayRule::Posterior(rule) => DelayChoice::Posterior(Posterior::new(candidates, first, rule)?),
            DelayRule::Counters { W, hysteresis } => {
                DelayChoice::Counters(Counters::new(candidates, first, W, hysteresis)?)
            }
        };
        let zeros = vec![0.0; candidates];
        Ok(BankIdentifier {
            bank: Bank::new(1, low, high, &own)?,
            sos: sos.transpose()?,
            filters: None,
            delay,
            gate: Gate::new(4 * high.max(10), None)?,
            alarm: Alarm::default(),
            eps: zeros.clone(),
            q: zeros,
            seen: 0,
            learnt: 0,
            settings: settings.clone(),
        })
    }

    /// Takes `u`, which acts from now on, and `y`, which is read now.
    pub fn step(&mut self, u: f64, y: f64) -> News {
        let mut news = News::default();
        let moves = self.gate.look(u);
        let (u, y) = self.filtered(u, y);
        self.seen += 1;
        let open = self.seen > self.settings.opens && (moves || self.sos.is_some());
        if self.bank.gate(0, open).and_then(|()| self.bank.step(&[u], &[y])).is_err() || !self.bank.learnt(0)
        {
            return news;
        }
        self.learnt += 1;
        for k in 0..self.eps.len() {
            (self.eps[k], self.q[k]) = (self.bank.eps(0, k), self.bank.q(0, k));
        }
        let chosen = self.delay.step(&self.eps, &self.q);
        if self.settings.offset && self.learnt > FIRST && self.q[chosen] < 1.0 {
            let s = (self.bank.s2(0, chosen) * (1.0 + self.q[chosen])).sqrt();
            news.alarm = s > 0.0 && self.alarm.step(self.eps[chosen] / s).is_some();
            if news.alarm {
                // The variance is positive: it is not refused.
                let _ = self.bank.open_offset(0, OPENED);
            }
        }
        news.fitted = self.plant(chosen).is_some();
        news
    }

    fn filtered(&mut self, u: f64, y: f64) -> (f64, f64) {
        let (Some(sos), Some(settings)) = (&self.sos, self.settings.prefilter) else { return (u, y) };
        let fresh = || {
            let own = || if settings.steady { Filter::new(sos) } else { Filter::at_rest(sos, 0.0) };
            [own(), own()]
        };
        let [of_u, of_y] = self.filters.get_or_insert_with(fresh);
        (of_u.step(u).unwrap_or(f64::NAN), of_y.step(y).unwrap_or(f64::NAN))
    }

    /// The plant of a member with the covariance of `K, T, L, O`, and `O`.
    fn plant(&self, k: usize) -> Option<(Fopdt, [f64; 16], f64)> {
        let [a, b, d, _] = self.bank.theta(0, k);
        if !(a > 0.0 && a < 1.0 && b != 0.0) {
            return None;
        }
        let (Ts, nk) = (self.settings.Ts, self.settings.nk.0 + k);
        let (K, T) = (b / (1.0 - a), -Ts / a.ln());
        let (K_a, K_b, T_a) = (K / (1.0 - a), 1.0 / (1.0 - a), Ts / (a * a.ln().powi(2)));
        let (u0, y0) = self.bank.origin(0)?;
        let map =
            [[K_a, K_b, 0.0], [T_a, 0.0, 0.0], [0.0, 0.0, 0.0], [d * K_b * K_b - u0 * K_a, -u0 * K_b, K_b]];
        let P = self.bank.P(0, k);
        let s2 = self.bank.sd(0, k)[0].powi(2) / P[0][0];
        let covariance = congruence(&map, |i, j| s2 * P[i][j]);
        let offset = y0 - K * u0 + d * K_b;
        let sound = covariance.iter().chain([&K, &T, &offset]).all(|x| x.is_finite());
        let P = <[f64; 16]>::try_from(covariance).ok()?;
        sound.then_some((Fopdt { K, T, L: (nk - 1) as f64 * Ts }, P, offset))
    }

    /// The last estimate: the member of the chosen delay.
    pub fn identified(&self) -> Option<Identified> {
        let (model, P, offset) = self.plant(self.delay.choice())?;
        let delays = self.delay.probabilities().to_vec();
        let likely = delays.iter().enumerate().filter(|(_, p)| **p > UNLIKELY);
        let mode = |(k, &weight): (usize, &f64)| self.plant(k).map(|(model, P, _)| Mode { model, P, weight });
        let modes = likely.filter_map(mode).collect();
        Some(Identified { model, P, offset, outside: false, modes, delays })
    }

    /// Forgets everything: the plant is another one.
    pub fn reset(&mut self) {
        // Loop 0 exists: it is not refused.
        let _ = self.bank.reset(0);
        self.delay.reset();
        self.alarm.reset();
        self.learnt = 0;
    }

    /// The next sample does not follow the last one.
    pub fn gap(&mut self) {
        // A number that is not finite pauses the bank for as long as it would be remembered.
        let _ = self.bank.step(&[f64::NAN], &[f64::NAN]);
        self.filters = None;
        self.alarm.reset();
    }
}
