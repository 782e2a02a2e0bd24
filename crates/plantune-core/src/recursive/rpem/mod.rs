//! Recursive prediction errors of the polynomial family,
//! `A(q) y(t) = B(q)/F(q) u(t - nk) + d + C(q)/D(q) e(t)`, one sample at a time.
//!
//! ```text
//! w    = B/F u,  v = A y - w - d,  e = y - phi' theta(t)            a posteriori: of the newest theta
//! eps  = y - phi' theta(t-1)
//! psi  = the gradient of the prediction (RML), or phi (ELS)         regressor.rs
//! theta <- theta + L eps,  C, D, F kept stable                      forgetting.rs, projection.rs
//! ```
//!
//! ARX, ARMAX, OE and BJ are orders of it. `psi = phi` is extended least squares, the pseudo-linear regression: it
//! converges where `1/C - 1/2` is positive real; RML does wherever the search of the batch estimator would.
//! Ljung 1999, 11.4 and 11.5; Söderström and Stoica 1989, chapter 9; source 001, (3.7-7) to (3.7-11).
//!
//! The offset is a parameter, the `1` in `phi`, on data less their first sample; `O` in `y = G u + O` follows from it.
//! Nothing is learnt until every lag lies in the segment ([`Structure::history`]); up to there the noise is taken
//! for zero, `w = A y - d`. The memory of signals moves on whatever happens: while the input rests (gate.rs), and
//! where an output is missing and its prediction stands for it. An alarm (innovation.rs) opens the offset alone.

mod projection;
mod regressor;
mod reports;
mod start;
mod structure;
mod trace;

pub use structure::Structure;
pub use trace::Trace;

use super::forgetting::{Forgetting, Scheme};
use super::gate::Gate;
use super::greater;
use super::innovation::{FIRST, Innovation};
use super::rls::{numbers_of, overflow, resumed};
use super::room::{Room, VECTORS, with_room};
use super::ud::Ud;
use crate::error::{Error, Result};
use regressor::{Newest, Regressor};
use start::{EQUATION, Known, LOOK, SIMULATED};

/// Radius for the roots of `C`: beyond it errors of the start would stay in the gradient.
const RADIUS_C: f64 = 0.98;

/// Radius for the roots of `D` and `F`, which may be slow.
const RADIUS: f64 = 0.999;

/// Halvings of a step that leads outside before it is not taken at all.
const HALVINGS: usize = 30;

/// Innovations judged before any is cut where an output is simulated: early parameters stay in it.
const FIRST_SIMULATED: f64 = 200.0;

/// Samples between one look for signals that have decayed and the next.
const TIDY: u64 = 256;

/// Variance that an alarm gives the constant, in noise variances.
const BUMP: f64 = 1e3;

/// How an estimator of the family learns.
#[derive(Clone, Debug)]
pub struct Settings {
    /// How it forgets.
    pub scheme: Scheme,
    /// Whether `psi` is the gradient (RML) or `phi` (ELS).
    pub gradient: bool,
    /// Covariance of the start, `(n, n)` row-major, in noise variances; none: no knowledge, in any units.
    pub P0: Option<Vec<f64>>,
    /// Coefficients of the start; zero when absent.
    pub theta0: Option<Vec<f64>>,
    /// Most that an entry of `D` of `P = U D U'` may become.
    pub P_max: Option<f64>,
    /// Standard deviations to which innovations are cut.
    pub clip: Option<f64>,
    /// Whether steps of the offset are watched for.
    pub watch: bool,
    /// Gate on the motion of the input.
    pub gate: Option<Gate>,
}

/// An estimator on its way along a record.
#[derive(Clone, Debug)]
pub struct Rpem {
    structure: Structure,
    theta: Vec<f64>, // (n): a b c d f, constant
    P: Ud,
    forgetting: Forgetting,
    innovation: Innovation,
    gate: Option<Gate>,
    regressor: Regressor,
    u: Vec<f64>,      // (nk) inputs on their way, a ring
    next: usize,      // the oldest of them
    history: usize,   // of the structure
    age: usize,       // samples of this segment, up to the history
    wait: usize,      // samples until no output in phi is a prediction
    zero: [f64; 2],   // u and y of the first sample
    travel: [f64; 2], // most that they were away from it
    begun: bool,
    known: Option<Known>, // unless a covariance was given
    closed: usize,        // parameters not in play yet
    seen: Vec<[f64; 2]>,  // u, y while looking; NaN where there was no y
    looking: bool,
    room: Vec<f64>,   // (VECTORS, n)
    before: Vec<f64>, // (n) the parameters before a step, for what is seldom needed
    schur: Vec<f64>,  // a polynomial
    samples: u64,
    alarms: f64,
    learnt: bool,
}

impl Rpem {
    /// At its first sample. U01: settings out of their range.
    pub fn new(structure: Structure, settings: Settings) -> Result<Self> {
        if structure.nb == 0 {
            return Err(Error::argument("nb", 0, "at least 1"));
        }
        let (n, most) = (structure.n(), structure.nk.saturating_add(structure.coefficients()));
        if most > LARGEST_ORDER {
            return Err(Error::argument("nk", structure.nk, "with the orders at most 100000"));
        }
        let mut P = match &settings.P0 {
            Some(P0) => Ud::of_matrix(n, P0)?,
            None => Ud::diagonal(vec![0.0; n]),
        };
        if let Some(most) = settings.P_max {
            if !(most > 0.0) {
                return Err(Error::argument("P_max", most, "positive"));
            }
            P.bound(most);
        }
        if let Some(clip) = settings.clip.filter(|clip| !(*clip > 0.0)) {
            return Err(Error::argument("clip", clip, "a positive number of standard deviations"));
        }
        let mut theta = vec![0.0; n];
        if let Some(theta0) = &settings.theta0 {
            if theta0.len() != structure.coefficients() || theta0.iter().any(|x| !x.is_finite()) {
                let needed = format!("{} finite numbers", structure.coefficients());
                return Err(Error::argument("theta0", format!("{theta0:?}"), &needed));
            }
            theta[..theta0.len()].copy_from_slice(theta0);
        }
        Ok(Rpem {
            structure,
            theta,
            closed: if settings.P0.is_some() { 0 } else { n },
            looking: settings.P0.is_none() && structure.nf > 0,
            seen: Vec::with_capacity(LOOK * n),
            known: match settings.P0 {
                Some(_) => None,
                None if structure.nf > 0 => Some(SIMULATED),
                None => Some(EQUATION),
            },
            P,
            forgetting: Forgetting::new(settings.scheme, n)?,
            innovation: Innovation::new(
                settings.clip,
                settings.watch && structure.offset,
                if structure.nf > 0 { FIRST_SIMULATED } else { FIRST },
            ),
            gate: settings.gate,
            regressor: Regressor::new(structure, settings.gradient),
            u: vec![0.0; structure.nk],
            next: 0,
            history: structure.history(),
            age: 0,
            wait: 0,
            zero: [0.0; 2],
            travel: [0.0; 2],
            begun: false,
            room: vec![0.0; VECTORS * n],
            before: Vec::with_capacity(n),
            schur: Vec::with_capacity(n + 1),
            samples: 0,
            alarms: 0.0,
            learnt: false,
        })
    }

    /// Learns from the output `y` read at `t`; `u` is the input applied from `t` on.
    ///
    /// Returns the prediction error `y - phi' theta(t-1)`; none while lags are missing. Allocates nothing. On error
    /// (U01: not finite; N02: overflow) the state is unchanged.
    #[inline]
    pub fn step(&mut self, u: f64, y: f64) -> Result<Option<f64>> {
        if !y.is_finite() {
            return Err(Error::argument("y", y, "a finite number; skip(u) is for an output that is missing"));
        }
        if self.looking {
            return self.look(u, y);
        }
        with_room!(self.theta.len(), self.room, |n, room| self.step_n(n, room, u, Some(y)))
    }

    /// Goes on without an output: it is missing at `t`, or does not count.
    pub fn skip(&mut self, u: f64) -> Result<()> {
        if self.looking {
            return self.look(u, f64::NAN).map(|_| ());
        }
        let (n, mut lent) = (self.theta.len(), std::mem::take(&mut self.room));
        let result = self.step_n(n, &mut Room::of(n, &mut lent), u, None);
        self.room = lent;
        result.map(|_| ())
    }

    /// Forgets all signals, as after a gap; parameters and covariance go on.
    pub fn restart(&mut self) {
        self.regressor.restart();
        self.u.fill(0.0);
        (self.next, self.age, self.wait) = (0, 0, 0);
        self.seen.clear();
        self.gate.iter_mut().for_each(Gate::restart);
    }

    #[inline(always)]
    fn step_n(&mut self, n: usize, room: &mut Room<'_>, u: f64, y: Option<f64>) -> Result<Option<f64>> {
        if !u.is_finite() {
            return Err(Error::argument("u", u, "a finite number"));
        }
        if !self.begun {
            let Some(y) = y else { return Ok(None) };
            self.begin(u, y)?;
        }
        let [u0, y0] = self.zero;
        let (u, y) = (u - u0, y.map(|y| y - y0));
        let delayed = if self.structure.nk == 0 { u } else { self.u[self.next] };
        self.regressor.look(n, room, &self.theta, delayed);
        let predicted = product(n, room.phi, &self.theta);
        let filling = self.age < self.history;
        let (now, eps) = match y {
            Some(y) => (y, y - predicted),
            None if filling => (self.regressor.last_y(), 0.0),
            None => (predicted, 0.0),
        };
        let q = self.P.weigh(n, room);
        if !(u * u + now * now + eps * eps + q).is_finite() {
            return Err(overflow());
        }

        // The sample is accepted; from here on the state changes.
        self.travel = [greater(self.travel[0], u.abs()), greater(self.travel[1], now.abs())];
        let moving = self.gate.as_mut().is_none_or(|gate| gate.look(u));
        self.learnt = moving && !filling && self.wait == 0 && y.is_some();
        let left = if self.learnt { self.learn(n, room, now, eps, q) } else { eps };
        let newest = self.newest(n, room, now, left, filling);
        self.regressor.keep(n, room, newest);
        self.pass(u, y.is_some());
        Ok((y.is_some() && !filling).then_some(eps))
    }

    /// What the first sample fixes.
    #[cold]
    fn begin(&mut self, u: f64, y: f64) -> Result<()> {
        if !(u * u + y * y).is_finite() {
            return Err(overflow());
        }
        self.begun = true;
        if self.structure.offset {
            self.zero = [u, y];
        }
        Ok(())
    }

    /// Brings `theta` and `P` past this sample; returns the error that is left, `y - phi' theta(t)`.
    #[inline(always)]
    fn learn(&mut self, n: usize, room: &mut Room<'_>, y: f64, eps: f64, mut q: f64) -> f64 {
        // What is called from here must not be handed the room, or it could not be registers.
        if self.closed > 0 {
            self.open();
            q = self.P.weigh(n, room);
        }
        let v = 1.0 + q * self.forgetting.spread();
        let judged = self.innovation.judge(eps, v, self.travel[1]);
        if judged.alarm {
            self.open_constant();
            q = self.P.weigh(n, room);
        }
        let scale = self.forgetting.learn(n, &mut self.P, room, q, judged);
        let (theta, before, b) = (&mut self.theta[..n], &mut room.before[..n], &room.b[..n]);
        before.copy_from_slice(theta);
        for k in 0..n {
            theta[k] += b[k] * scale;
        }
        // The second is the first, without waiting for theta.
        let left = if self.project(before) {
            y - product(n, room.phi, &self.theta)
        } else {
            eps - product(n, room.phi, room.b) * scale
        };
        self.innovation.sum(judged);
        left
    }

    /// After an alarm.
    #[cold]
    fn open_constant(&mut self) {
        self.alarms += 1.0;
        self.P.add_to(self.theta.len() - 1, BUMP);
    }

    /// Keeps `C`, `D` and `F` stable; whether that changed the parameters.
    #[inline(always)]
    fn project(&mut self, before: &[f64]) -> bool {
        let Structure { na, nb, nc, nd, nf, .. } = self.structure;
        let c = na + nb;
        let mut changed = self.keep_stable(c, nc, RADIUS_C, before);
        if self.regressor.has_paths() {
            changed |= self.keep_stable(c + nc, nd, RADIUS, before);
            changed |= self.keep_stable(c + nc + nd, nf, RADIUS, before);
        }
        changed
    }

    #[inline(always)]
    fn keep_stable(&mut self, from: usize, order: usize, radius: f64, before: &[f64]) -> bool {
        match &mut self.theta[from..from + order] {
            [] => false,
            [p1] => projection::one(p1, radius),
            [p1, p2] => projection::two(p1, p2, radius),
            _ => {
                self.before.clear();
                self.before.extend_from_slice(before);
                self.halve(from, order, radius)
            }
        }
    }

    /// Halves the step of all parameters until the polynomial is stable.
    #[cold]
    fn halve(&mut self, from: usize, order: usize, radius: f64) -> bool {
        for k in 0..=HALVINGS {
            if projection::inside(&self.theta[from..from + order], radius, &mut self.schur) {
                return k > 0;
            }
            let share = if k < HALVINGS { 0.5 } else { 0.0 };
            for (theta, before) in self.theta.iter_mut().zip(&self.before) {
                *theta = before + share * (*theta - before);
            }
        }
        true
    }

    /// What this sample leaves for the regressor of the next: `y`, `e`, `v` and `w` of the newest `theta`.
    #[inline(always)]
    fn newest(&self, n: usize, room: &Room<'_>, y: f64, e: f64, filling: bool) -> Newest {
        let mut newest = Newest { minus_y: -y, e: if filling { 0.0 } else { e }, ..Newest::default() };
        if self.regressor.has_paths() {
            let (w, v) = self.regressor.paths(n, room, &self.theta, y, !filling);
            (newest.minus_w, newest.minus_v) = (-w, -v);
        }
        newest
    }

    /// Moves on to the next sample.
    #[inline(always)]
    fn pass(&mut self, u: f64, counts: bool) {
        let Structure { na, nk, .. } = self.structure;
        if nk > 0 {
            self.u[self.next] = u;
            self.next = if self.next + 1 == nk { 0 } else { self.next + 1 };
        }
        self.age = (self.age + 1).min(self.history);
        self.wait = if counts { self.wait.saturating_sub(1) } else { na };
        self.samples += 1;
        if self.samples.is_multiple_of(TIDY) {
            self.regressor.tidy();
        }
    }

    /// Every number of the state; the settings are not among them.
    pub fn state(&self) -> Vec<f64> {
        numbers_of(self, Rpem::numbers)
    }

    /// Goes on from where another with the same settings stood.
    pub fn resume(&mut self, state: &[f64]) -> Result<()> {
        *self = resumed(self, state, Rpem::numbers)?;
        Ok(())
    }

    fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        self.theta.iter_mut().for_each(&mut *visit);
        self.P.numbers(visit);
        self.forgetting.numbers(visit);
        self.innovation.numbers(visit);
        self.gate.iter_mut().for_each(|gate| gate.numbers(visit));
        self.regressor.numbers(visit);
        self.u.rotate_left(self.next);
        self.next = 0;
        self.u.iter_mut().for_each(&mut *visit);
        let [u0, y0] = &mut self.zero;
        let [most_u, most_y] = &mut self.travel;
        [u0, y0, most_u, most_y, &mut self.alarms].into_iter().for_each(&mut *visit);
        let counts = [self.age, self.wait, self.closed, self.seen.len()].map(|n| n as u64);
        let mut whole = [counts[0], counts[1], counts[2], counts[3], self.samples].map(|n| n as f64);
        whole.iter_mut().for_each(&mut *visit);
        [self.age, self.wait, self.closed] = [whole[0], whole[1], whole[2]].map(|x| x as usize);
        self.samples = whole[4] as u64;
        let full = LOOK * self.theta.len();
        self.seen.reserve_exact(full.saturating_sub(self.seen.len()));
        self.seen.resize((whole[3] as usize).min(full), [0.0; 2]);
        self.seen.iter_mut().flatten().for_each(&mut *visit);
        let mut flags = [self.begun, self.learnt, self.looking].map(|yes| f64::from(u8::from(yes)));
        flags.iter_mut().for_each(&mut *visit);
        [self.begun, self.learnt, self.looking] = flags.map(|x| x != 0.0);
    }
}

/// Delay and orders together.
const LARGEST_ORDER: usize = 100_000;

/// `x' y` of the first `n` entries.
#[inline(always)]
fn product(n: usize, x: &[f64], y: &[f64]) -> f64 {
    let (x, y) = (&x[..n], &y[..n]);
    let mut sum = -0.0;
    for k in 0..n {
        sum += x[k] * y[k];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn armax(lambda: f64, gate: bool) -> Rpem {
        let structure = Structure { na: 1, nb: 1, nc: 1, nk: 2, offset: true, ..Structure::default() };
        let settings = Settings {
            scheme: Scheme::Exponential { lambda, start: 0.95, rho: 0.99 },
            gradient: true,
            P0: None,
            theta0: None,
            P_max: None,
            clip: Some(6.0),
            watch: true,
            gate: gate.then(|| Gate::new(100, None).expect("in range")),
        };
        Rpem::new(structure, settings).expect("in range")
    }

    /// `y = 0.8 y(-1) + 0.5 u(-2) + 1 + noise`; returns the outputs.
    fn feed(rpem: &mut Rpem, u: impl Iterator<Item = f64>, e: impl Iterator<Item = f64>) {
        let (mut y, mut past) = (5.0, [0.0; 2]);
        for (u, e) in u.zip(e) {
            y = 0.8 * y + 0.5 * past[1] + 1.0 + e;
            past = [u, past[0]];
            rpem.step(u, y).expect("a sound sample");
        }
    }

    fn is_sound(rpem: &Rpem) -> bool {
        let P = rpem.P().matrix();
        rpem.theta().iter().chain(&P).all(|x| x.is_finite()) && (0..4).all(|j| P[j * 4 + j] > 0.0)
    }

    #[test]
    fn it_finds_the_plant_and_its_level() {
        let mut rpem = armax(1.0, false);
        let levels = white(4000, 1).into_iter().map(|x| x.signum());
        feed(&mut rpem, levels, white(4000, 2).into_iter().map(|e| 0.05 * e));
        let errors = rpem.theta().iter().zip([-0.8, 0.5, 0.0]).map(|(a, b)| (a - b).abs());
        let (O, sd) = rpem.offset();
        assert!(errors.fold(0.0, f64::max) < 0.02 && (O - 5.0).abs() < 4.0 * sd && sd < 0.02, "{O} {sd}");
    }

    #[test]
    fn a_state_is_restored_wherever_it_was_saved() {
        let (u, y) = (white(60, 3), white(60, 4));
        for at in [0, 1, 2, 3, 59] {
            let mut one = armax(0.99, true);
            let mut other = one.clone();
            for k in 0..at {
                one.step(u[k], y[k]).expect("a sound sample");
            }
            other.resume(&one.state()).expect("of the same settings");
            for k in at..60 {
                assert_eq!(one.step(u[k], y[k]), other.step(u[k], y[k]));
            }
            assert_eq!(one.state(), other.state());
        }
    }

    #[test]
    #[ignore = "20 s"]
    fn a_hundred_million_samples_with_constant_stretches_stay_numbers() {
        for gate in [true, false] {
            let mut rpem = armax(0.98, gate);
            let levels = white(1000, 5);
            let u = (0..50_000_000usize).map(|k| match k % 10_000_000 {
                moving @ ..1000 => levels[moving],
                _ => 1.0,
            });
            feed(&mut rpem, u, std::iter::repeat(0.0));
            assert!(is_sound(&rpem), "{:?}", rpem.theta());
        }
    }
}
