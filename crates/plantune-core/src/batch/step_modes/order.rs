//! How many modes the data support, and what each of them is.
//!
//! ```text
//! BIC = N ln max(RSS/N, floor) + (n + 1) ln N,   N counted with the correlation of the residual
//! ```
//!
//! The highest order that beats *every* lower one by 6, which is strong evidence (Kass and Raftery, J. Am. Stat.
//! Ass. 90, 1995); from it downwards to the first whose modes all are known to a factor of 2.7 at 95 %. Without
//! the floor, 1e-12 of the variance of y or a sixth of the square of its resolution, noise-free data would support
//! any order, and stairs of a quantiser some that ring.

use super::deviations::{Candidate, TimeConstant, time_constants, widening};
use super::search::Data;
use super::sections::{Section, Sections};
use super::starts::Starts;
use crate::stats::normal_quantile;

/// Difference of BIC that is strong evidence.
pub(super) const MARGIN: f64 = 6.0;

/// Largest deviation of `ln T`, `ln w` or `ln zeta` of a mode that counts as known.
pub(super) const KNOWN: f64 = 0.5;

/// `ln zeta` that is rounding: time constants within 3e-4 of each other.
const REPEATED: f64 = 1e-8;

/// Deviations that two time constants must be apart from being one, or from being complex.
const SURE: f64 = 1.96;

/// What a mode is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One time constant.
    Lag,
    /// Two that the data do not tell apart, or one that is repeated: `zeta` is 1 within its deviation.
    Pair,
    /// `zeta` clearly below 1.
    Complex,
}

impl Kind {
    /// The word used in Python and in JSON.
    pub fn as_str(self) -> &'static str {
        match self {
            Kind::Lag => "lag",
            Kind::Pair => "pair",
            Kind::Complex => "complex",
        }
    }
}

/// A lag, or two poles that are described together.
#[derive(Clone, Debug)]
pub struct Mode {
    /// What it is.
    pub kind: Kind,
    /// Time constant, `1/w` of a pair, s.
    pub T: f64,
    /// Standard deviation of `ln T`.
    pub sd_ln_T: f64,
    /// Damping of a pair, and the standard deviation of its logarithm.
    pub zeta: Option<(f64, f64)>,
    /// Gradient of `ln T` and of `ln zeta` along the parameters of the sections.
    pub(super) gradients: Vec<Vec<(usize, f64)>>,
}

impl Mode {
    /// The 95 % interval of T, taken on its logarithm.
    pub fn interval(&self) -> (f64, f64) {
        let half = normal_quantile(0.95) * self.sd_ln_T;
        (self.T * (-half).exp(), self.T * half.exp())
    }

    /// The largest deviation.
    pub fn sd(&self) -> f64 {
        self.zeta.map_or(self.sd_ln_T, |(_, sd)| sd.max(self.sd_ln_T))
    }
}

/// The best fits of order 0, 1, …, each with the least residual of all starts; up to the first that leaves nothing
/// to explain, unless one was asked for.
pub(super) fn candidates(data: &Data, highest: usize, asked: bool) -> Vec<Candidate> {
    let starts = Starts::new(data);
    let none = Sections { pattern: Vec::new(), q: Vec::new() };
    let mut all: Vec<Candidate> = Candidate::new(data, none, true).into_iter().collect();
    for k in 1..=highest {
        if !asked && all.last().is_some_and(|c| c.rss <= c.N as f64 * c.floor) {
            break;
        }
        let lower = all.last().map_or(Vec::new(), |c| c.sections.poles());
        let fits = starts.of(k, &lower);
        let best = fits
            .iter()
            .filter_map(|poles| data.fit(poles))
            .min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
            .and_then(|(sections, minimum)| Candidate::new(data, sections, minimum.converged));
        match best {
            Some(candidate) => all.push(candidate),
            None => break,
        }
    }
    all
}

/// Lag-1 correlation of the least coloured residual; 0 within two deviations.
pub(super) fn colour(all: &[Candidate]) -> f64 {
    let least = all.iter().min_by(|a, b| a.r.abs().total_cmp(&b.r.abs()));
    least.map_or(0.0, |c| if c.r > 2.0 / (c.N as f64).sqrt() { c.r } else { 0.0 })
}

/// The criterion; the variance of the errors counts as a parameter too.
pub(super) fn bic(c: &Candidate, r: f64) -> f64 {
    let N = c.N as f64 * (1.0 - r) / (1.0 + r);
    N * (c.rss / c.N as f64).max(c.floor).ln() + (c.n + 1) as f64 * N.ln()
}

/// The highest order that beats every lower one.
pub(super) fn favoured(bics: &[f64]) -> usize {
    let beats = |&k: &usize| bics[..k].iter().all(|lower| bics[k] <= lower - MARGIN);
    (1..bics.len()).rev().find(beats).unwrap_or(0)
}

/// The modes of a fit by rising time constant, their deviations widened by the colour `r`.
pub(super) fn modes(c: &Candidate, r: f64) -> Vec<Mode> {
    let wide = widening(r);
    let mut modes: Vec<Mode> =
        c.sections.places().flat_map(|(s, at)| section_modes(c, s, at, wide)).collect();
    modes.sort_by(|a, b| a.T.total_cmp(&b.T));
    modes
}

fn section_modes(c: &Candidate, section: Section, at: usize, wide: f64) -> Vec<Mode> {
    let sd = |gradient: &[(usize, f64)]| c.deviation(gradient) * wide;
    let lag = |found: TimeConstant| Mode {
        kind: Kind::Lag,
        T: found.T,
        sd_ln_T: sd(&found.gradient),
        zeta: None,
        gradients: vec![found.gradient],
    };
    let ln_zeta = if section == Section::Pair { c.sections.q[at + 1] } else { f64::INFINITY };
    let sd_zeta = if section == Section::Pair { sd(&[(at + 1, 1.0)]) } else { 0.0 };
    let apart = (SURE * sd_zeta).max(REPEATED);
    if section == Section::Lag || ln_zeta > apart {
        return time_constants(&c.sections, section, at).into_iter().map(lag).collect();
    }
    let gradients = vec![vec![(at, -1.0)], vec![(at + 1, 1.0)]];
    vec![Mode {
        kind: if ln_zeta < -apart { Kind::Complex } else { Kind::Pair },
        T: (-c.sections.q[at]).exp(),
        sd_ln_T: sd(&gradients[0]),
        zeta: Some((ln_zeta.exp(), sd_zeta)),
        gradients,
    }]
}
