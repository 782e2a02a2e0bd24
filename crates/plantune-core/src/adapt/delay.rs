//! Which of the candidate delays is right, from the prediction errors of their models.
//!
//! ```text
//! counters    V_k(t) = sum over the last W samples of eps_k^2
//!             i = argmin_k eps_k^2(t),  j = argmin_k V_k(t)
//!             each of i, j above the choice: up + 1, down - 1;  below it: the reverse;  on it: both - 1
//!             up or down > hysteresis: the choice moves ONE candidate that way, both counters begin anew
//!
//! posterior   p_k <- (1 - rho) p_k + rho/m                          the delay may have changed
//!             l_k <- mu ln p_k - 1/2 [ln v_k + eps_k^2/v_k],        v_k = s_k^2 (1 + q_k)
//!             p_k <- exp(l_k) / sum exp(l)
//!             s_k^2 = mean of eps_k^2/(1 + q_k) with forgetting mu, before this sample
//!             the choice moves to the candidate with p_k > need for `dwell` samples on end
//! ```
//!
//! Counters: source 001, 3.7.4 d and figure 3.7-4, where the delay changes continuously. The source does not
//! say how a sample without demand is counted; here it takes demand back, so that what is demanded now and
//! then is never granted. Posterior: a bank of models with a sticky prior; `eps^2/v` counts 36 at most, so that
//! one sample cannot decide. `q_k = psi' P psi` is what the parameters do not know yet.
//!
//! Errors below `1e-10` of the largest one seen are rounding and count as zero: without noise, a choice among
//! models that all predict exactly is no choice, and nothing is divided by zero.

use super::window::WindowSums;
use crate::error::{Error, Result};

/// Variance of what counts as rounding, relative to the largest squared error.
const ROUNDING: f64 = 1e-20;

/// Most that a squared normalised error counts.
const MOST_SURPRISED: f64 = 36.0;

/// Errors from here on overflow when squared.
const LARGEST: f64 = 1e150;

/// Either way to choose.
#[derive(Clone, Debug, PartialEq)]
pub enum DelayChoice {
    /// By counted demand.
    Counters(Counters),
    /// By probability.
    Posterior(Posterior),
}

impl DelayChoice {
    /// Takes the prediction errors of all candidates, with their `q`, and returns the candidate chosen.
    ///
    /// A sample with an error that is no number, or of another number of candidates, changes nothing.
    /// Allocates nothing.
    pub fn step(&mut self, eps: &[f64], q: &[f64]) -> usize {
        match self {
            DelayChoice::Counters(counters) => counters.step(eps),
            DelayChoice::Posterior(posterior) => posterior.step(eps, q),
        }
    }

    /// The candidate chosen.
    pub fn choice(&self) -> usize {
        match self {
            DelayChoice::Counters(counters) => counters.choice,
            DelayChoice::Posterior(posterior) => posterior.choice,
        }
    }

    /// Of each candidate; the counters are sure of their choice.
    pub fn probabilities(&self) -> &[f64] {
        match self {
            DelayChoice::Counters(counters) => &counters.sure,
            DelayChoice::Posterior(posterior) => &posterior.p,
        }
    }

    /// Whether the choice is what the data say now: by the posterior, its probability is above `need`.
    pub fn settled(&self) -> bool {
        match self {
            DelayChoice::Counters(counters) => counters.up == 0 && counters.down == 0,
            DelayChoice::Posterior(posterior) => posterior.p[posterior.choice] > posterior.settings.need,
        }
    }

    /// Forgets all errors; the choice stays.
    pub fn reset(&mut self) {
        match self {
            DelayChoice::Counters(counters) => counters.reset(),
            DelayChoice::Posterior(posterior) => posterior.reset(),
        }
    }
}

/// A moving window and a pair of counters.
///
/// ```
/// use plantune_core::adapt::Counters;
///
/// let mut counters = Counters::new(3, 0, 10, 4)?;
/// let choices: Vec<usize> = (0..8).map(|_| counters.step(&[2.0, 1.0, 0.1])).collect();
/// assert_eq!(choices, [0, 0, 1, 1, 1, 2, 2, 2]); // through its neighbour
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Counters {
    choice: usize,
    hysteresis: usize,
    up: usize,
    down: usize,
    sums: WindowSums,
    largest: f64,
    sure: Vec<f64>,
}

impl Counters {
    /// Of `candidates` delays, beginning with `first`, over `W` samples.
    pub fn new(candidates: usize, first: usize, W: usize, hysteresis: usize) -> Result<Self> {
        check(candidates, first)?;
        if W == 0 {
            return Err(Error::argument("W", W, "at least 1 sample"));
        }
        let mut sure = vec![0.0; candidates];
        sure[first] = 1.0;
        let sums = WindowSums::new(candidates, W);
        Ok(Counters { choice: first, hysteresis, up: 0, down: 0, sums, largest: 0.0, sure })
    }

    /// Takes the prediction errors of all candidates and returns the one chosen.
    pub fn step(&mut self, eps: &[f64]) -> usize {
        if !sound(eps, self.sure.len()) {
            return self.choice;
        }
        self.largest = eps.iter().fold(self.largest, |most, eps| most.max(eps * eps));
        let floor = ROUNDING * self.largest;
        self.sums.advance();
        // The choice first: another one has to be better than it.
        let (now, sum) = self.errors(self.choice, eps, floor);
        let choice = self.choice;
        let (mut least_now, mut least_sum) = ((choice, now), (choice, sum));
        for k in (0..eps.len()).filter(|&k| k != choice) {
            let (now, sum) = self.errors(k, eps, floor);
            if now < least_now.1 {
                least_now = (k, now);
            }
            if sum < least_sum.1 {
                least_sum = (k, sum);
            }
        }
        self.demand(least_now.0);
        self.demand(least_sum.0);
        self.grant();
        self.choice
    }

    /// `eps_k^2` and `V_k`.
    fn errors(&mut self, k: usize, eps: &[f64], floor: f64) -> (f64, f64) {
        let square = eps[k] * eps[k];
        let square = if square <= floor { 0.0 } else { square };
        (square, self.sums.add(k, square))
    }

    fn demand(&mut self, candidate: usize) {
        let count =
            |counter: usize, wanted: bool| if wanted { counter + 1 } else { counter.saturating_sub(1) };
        self.up = count(self.up, candidate > self.choice);
        self.down = count(self.down, candidate < self.choice);
    }

    fn grant(&mut self) {
        let next = match (self.up > self.hysteresis, self.down > self.hysteresis) {
            (true, _) => self.choice + 1,
            (_, true) => self.choice - 1,
            _ => return,
        };
        self.sure.swap(self.choice, next);
        (self.choice, self.up, self.down) = (next, 0, 0);
    }

    fn reset(&mut self) {
        self.sums.clear();
        (self.up, self.down, self.largest) = (0, 0, 0.0);
    }
}

/// How the posterior forgets and decides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosteriorSettings {
    /// `mu`: forgetting of likelihoods and variances, in (0, 1).
    pub mu: f64,
    /// `rho`: probability that the delay changes at a sample, in (0, 1).
    pub rho: f64,
    /// Probability that a new choice needs, in (0, 1).
    pub need: f64,
    /// Samples on end for which it must have it.
    pub dwell: usize,
}

impl Default for PosteriorSettings {
    fn default() -> Self {
        PosteriorSettings { mu: 0.99, rho: 1e-3, need: 0.9, dwell: 10 }
    }
}

/// Probabilities of all candidates.
///
/// ```
/// use plantune_core::adapt::{Posterior, PosteriorSettings};
///
/// let mut posterior = Posterior::new(3, 0, PosteriorSettings::default())?;
/// (0..40).for_each(|_| { posterior.step(&[2.0, 1.0, 0.1], &[0.0; 3]); });
/// assert_eq!(posterior.choice(), 2);
/// assert!(posterior.probabilities()[2] > 0.99);
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Posterior {
    settings: PosteriorSettings,
    choice: usize,
    /// The candidate above `need`, and for how many samples.
    leader: (usize, usize),
    p: Vec<f64>,
    /// Logarithms, a work space.
    l: Vec<f64>,
    /// `s_k^2`, and the weight of all samples in it.
    s2: Vec<f64>,
    weight: f64,
    largest: f64,
}

impl Posterior {
    /// Of `candidates` delays, all alike probable, beginning with `first`.
    pub fn new(candidates: usize, first: usize, settings: PosteriorSettings) -> Result<Self> {
        check(candidates, first)?;
        for (name, x) in [("mu", settings.mu), ("rho", settings.rho), ("need", settings.need)] {
            if !(x > 0.0 && x < 1.0) {
                return Err(Error::argument(name, x, "in (0, 1)"));
            }
        }
        let (p, zeros) = (vec![1.0 / candidates as f64; candidates], vec![0.0; candidates]);
        let leader = (first, 0);
        Ok(Posterior {
            settings,
            choice: first,
            leader,
            p,
            l: zeros.clone(),
            s2: zeros,
            weight: 0.0,
            largest: 0.0,
        })
    }

    /// Takes the prediction errors of all candidates, with their `q`, and returns the one chosen.
    pub fn step(&mut self, eps: &[f64], q: &[f64]) -> usize {
        if sound(eps, self.p.len()) && sound(q, self.p.len()) {
            self.learn(eps, q);
            self.decide();
        }
        self.choice
    }

    /// The candidate chosen.
    pub fn choice(&self) -> usize {
        self.choice
    }

    /// Of each candidate.
    pub fn probabilities(&self) -> &[f64] {
        &self.p
    }

    fn learn(&mut self, eps: &[f64], q: &[f64]) {
        let PosteriorSettings { mu, rho, .. } = self.settings;
        let m = eps.len() as f64;
        let known = self.weight > 0.0;
        self.weight = mu * self.weight + 1.0;
        let squares = eps.iter().zip(q).map(|(eps, q)| eps * eps / (1.0 + q.max(0.0)));
        self.largest = squares.clone().fold(self.largest, f64::max);
        let floor = (ROUNDING * self.largest).max(f64::MIN_POSITIVE);
        for (k, (square, q)) in squares.zip(q).enumerate() {
            self.l[k] = mu * ((1.0 - rho) * self.p[k] + rho / m).ln();
            if known {
                let s2 = self.s2[k].max(floor);
                self.l[k] -= 0.5 * (s2.ln() + q.max(0.0).ln_1p() + (square / s2).min(MOST_SURPRISED));
            }
            self.s2[k] += (square - self.s2[k]) / self.weight;
        }
        let most = self.l.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut sum = 0.0;
        for (p, l) in self.p.iter_mut().zip(&self.l) {
            *p = (l - most).exp();
            sum += *p;
        }
        self.p.iter_mut().for_each(|p| *p /= sum);
    }

    fn decide(&mut self) {
        let PosteriorSettings { need, dwell, .. } = self.settings;
        let likely = (0..self.p.len()).find(|&k| self.p[k] > need);
        self.leader = match likely {
            Some(k) if k == self.leader.0 => (k, self.leader.1 + 1),
            Some(k) => (k, 1),
            None => (self.choice, 0),
        };
        if self.leader.1 >= dwell.max(1) {
            self.choice = self.leader.0;
        }
    }

    fn reset(&mut self) {
        let m = self.p.len() as f64;
        self.p.fill(1.0 / m);
        self.s2.fill(0.0);
        (self.weight, self.largest, self.leader) = (0.0, 0.0, (self.choice, 0));
    }
}

/// Numbers of `m` candidates whose squares do not overflow.
fn sound(x: &[f64], m: usize) -> bool {
    x.len() == m && x.iter().all(|x| x.abs() < LARGEST)
}

fn check(candidates: usize, first: usize) -> Result<()> {
    if first >= candidates {
        return Err(Error::argument("first", first, &format!("one of the {candidates} candidates")));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn both(m: usize, first: usize) -> [DelayChoice; 2] {
        let settings = PosteriorSettings::default();
        [
            DelayChoice::Counters(Counters::new(m, first, 50, 20).expect("sound")),
            DelayChoice::Posterior(Posterior::new(m, first, settings).expect("sound")),
        ]
    }

    /// Errors of a bank whose candidate `right` predicts up to the noise, the others worse by their distance.
    fn errors(m: usize, right: usize, noise: f64, x: &[f64]) -> Vec<f64> {
        (0..m).map(|k| noise * x[0] + (k as f64 - right as f64) * x[1]).collect()
    }

    #[test]
    fn both_find_the_right_delay_and_follow_a_change() {
        for noise in [0.0, 1e-14, 0.5] {
            for mut choice in both(7, 0) {
                let x = white(2 * 1200, 5);
                for (k, x) in x.chunks(2).enumerate() {
                    let right = if k < 600 { 5 } else { 2 };
                    let chosen = choice.step(&errors(7, right, noise, x), &[0.1; 7]);
                    let p = choice.probabilities();
                    assert!(p.iter().all(|p| p.is_finite()) && (p.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                    assert!(k % 600 < 400 || chosen == right, "{noise} {k} {chosen} {p:?}");
                }
                assert!(choice.settled());
            }
        }
    }

    /// All predict alike, exactly or up to rounding: nothing speaks for another delay.
    #[test]
    fn without_excitation_the_choice_stays() {
        for mut choice in both(5, 3) {
            let x = white(5 * 3000, 2);
            choice.step(&[100.0, 100.0, 100.0, 100.0, 100.0], &[1e6; 5]);
            for (k, x) in x.chunks(5).enumerate() {
                let eps: Vec<f64> = x.iter().map(|x| if k % 3 == 0 { 0.0 } else { 1e-13 * x }).collect();
                assert_eq!(choice.step(&eps, &[0.0; 5]), 3);
            }
            assert_eq!(choice.step(&[0.0; 5], &[0.0; 5]), 3);
        }
    }

    #[test]
    fn a_sample_that_is_none_changes_nothing() {
        for mut choice in both(3, 1) {
            (0..100).for_each(|_| {
                choice.step(&[1.0, 0.2, 0.4], &[0.0; 3]);
            });
            let before = choice.clone();
            choice.step(&[f64::NAN, 1.0, 1.0], &[0.0; 3]);
            choice.step(&[1.0; 2], &[0.0; 2]);
            assert_eq!(choice, before);
            choice.reset();
            assert_eq!(choice.choice(), 1);
        }
    }

    /// The posterior against Bayes' rule written out for known variances: without forgetting and change.
    #[test]
    fn the_posterior_is_bayes_rule() {
        let settings = PosteriorSettings { mu: 1.0 - 1e-12, rho: 1e-12, ..PosteriorSettings::default() };
        let mut posterior = Posterior::new(3, 0, settings).expect("sound");
        let x = white(60, 9);
        let mut log_p = [0.0; 3];
        let mut s2 = [0.0; 3];
        for (t, x) in x.iter().enumerate() {
            let (eps, q) = ([x + 0.02, x + 0.05, x - 0.01], [0.3, 0.1, 0.2]);
            for k in 0..3 {
                let z2 = eps[k] * eps[k] / (1.0 + q[k]);
                if t > 0 {
                    let v: f64 = s2[k] * (1.0 + q[k]);
                    log_p[k] -= 0.5 * (v.ln() + (z2 / s2[k]).min(MOST_SURPRISED));
                }
                s2[k] = (t as f64 * s2[k] + z2) / (t + 1) as f64;
            }
            posterior.step(&eps, &q);
        }
        let sum: f64 = log_p.iter().map(|l| l.exp()).sum();
        for (p, l) in posterior.probabilities().iter().zip(log_p) {
            assert!((p - l.exp() / sum).abs() < 1e-9);
        }
    }

    #[test]
    fn what_is_no_choice_is_refused() {
        assert_eq!(Counters::new(0, 0, 5, 5).expect_err("no candidate").code(), "U01");
        assert_eq!(Counters::new(3, 3, 5, 5).expect_err("not among them").code(), "U01");
        assert_eq!(Counters::new(3, 0, 0, 5).expect_err("no window").code(), "U01");
        let settings = PosteriorSettings { need: 1.0, ..PosteriorSettings::default() };
        assert_eq!(Posterior::new(3, 0, settings).expect_err("never").code(), "U01");
    }
}
