//! A plant of fewer lags: Skogestad's half rule, and his rules for zeros.
//!
//! ```text
//! the n largest lags are kept, an integrator being the largest of all; with the next one, T,
//!   L + T/2 + the lags beyond + |Tz| of each zero to the right,   T_n + T/2
//! a zero to the left goes with a lag, tau_c = L unless wished otherwise:
//!   (Tz s + 1)/(T s + 1) -> Tz/T                      Tz >= T >= tau_c        (T1)
//!                           Tz/tau_c                  Tz >= tau_c >= T        (T1a)
//!                           1                         tau_c >= Tz >= T        (T1b)
//!                           Tz/T                      T >= Tz >= 5 tau_c      (T2)
//!                           (t/T)/((t - Tz) s + 1)    t = min(T, 5 tau_c)     (T3)
//! ```
//!
//! S. Skogestad, Simple analytic rules for model reduction and PID controller tuning, J. Process Control 13
//! (2003). The lag is the next larger one, but where a smaller one is closer and within a factor of 1.6. The
//! rules for zeros ask for the delay that comes of them; where a short and a long one both agree with
//! themselves, the short one is taken if SIMC on it keeps `Ms` below 2 on the plant. That is ours, and so is a
//! damped pair: it is kept where it is the slowest, else it counts as a delay of `2 zeta T`. Where one lag is asked
//! for, a slowest pair of damping 0.7 on counts as two lags of `zeta T`, which have its first moment.

use super::margins::margins;
use super::rules::{Terms, simc};
use crate::error::{Error, Result};
use crate::model::{Model, ProcessModel, TransferFunction};
use crate::note::rounded;
use crate::poly::product;

/// A smaller lag within this factor of a zero may go with it; what roots lose of 1.6 is left out.
const CLOSE: f64 = 1.599;

/// A pair damped as well as this counts as two equal lags: roots of a polynomial give no more.
const EQUAL: f64 = 0.99;

/// A pair damped as well as this may stand for two lags: its step response overshoots by less than 5 %.
const LAGLIKE: f64 = 0.7;

/// Steps of the delay that the rules for zeros ask for, and give.
const STEPS: usize = 50;

/// Largest `Ms` of SIMC on the plant that speaks for the shorter of two delays.
const SOUND: f64 = 2.0;

/// A plant of one gain and factors of first order, but for one damped pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Factors {
    /// Static gain, or slope of an integrating plant.
    pub K: f64,
    /// Lags, s, the largest first.
    pub lags: Vec<f64>,
    /// Time, s, and damping of a pair of poles.
    pub pair: Option<(f64, f64)>,
    /// Times of the zeros, s; negative to the right.
    pub zeros: Vec<f64>,
    /// Dead time, s.
    pub L: f64,
    /// Whether a pole lies at 0.
    pub integrating: bool,
}

/// A first- or second-order model of any plant; of an integrating one the integrator counts.
pub fn half_rule(model: &Model, order: usize, tau_c: Option<f64>) -> Result<ProcessModel> {
    if !matches!(order, 1 | 2) {
        return Err(Error::argument("order", order, "1 or 2"));
    }
    if tau_c.is_some_and(|tau| !(tau >= 0.0 && tau.is_finite())) {
        return Err(Error::argument("tau_c", format!("{tau_c:?}"), "zero or positive"));
    }
    Factors::of(model)?.reduced(order, tau_c)
}

/// Controllability ratio `L / (T + L)` of the first-order model, 0 of an integrating plant; source 001, (3.4-2).
pub fn controllability_ratio(model: &Model) -> Result<f64> {
    let model = half_rule(model, 1, None)?;
    Ok(model.T.first().map_or(0.0, |T| model.L / (T + model.L)))
}

impl Factors {
    /// Refuses what has no such factors: unstable (M02), two integrators (M01), or no plant (M12).
    pub fn of(model: &Model) -> Result<Self> {
        model.check()?;
        match model {
            Model::Process(m) => Ok(Factors::of_process(m)),
            Model::Transfer(m) => Factors::of_transfer(m),
            Model::Poly(_) => Err(sampled()),
        }
    }

    /// Of a sound process model.
    pub fn of_process(m: &ProcessModel) -> Self {
        let mut plant = Factors {
            K: m.K,
            lags: m.T.clone(),
            pair: None,
            zeros: if m.Tz == 0.0 { Vec::new() } else { vec![m.Tz] },
            L: m.L,
            integrating: m.integrating,
        };
        if let Some(zeta) = m.zeta {
            let T = plant.lags.remove(0);
            plant.add_pair(T, zeta);
        }
        plant.sorted()
    }

    fn of_transfer(m: &TransferFunction) -> Result<Self> {
        let low = |p: &[f64]| p.iter().rev().find(|&&c| c != 0.0).copied().unwrap_or(1.0);
        let mut plant = Factors {
            K: low(&m.num) / low(&m.den),
            lags: Vec::new(),
            pair: None,
            zeros: Vec::new(),
            L: m.L,
            integrating: false,
        };
        for (re, im) in m.poles() {
            match (re, im) {
                (0.0, 0.0) if plant.integrating => {
                    return Err(Error::new("M01", "the plant has two integrators: no rule here serves it")
                        .remedy("close an inner loop on its rate first, and tune the outer one"));
                }
                (0.0, 0.0) => plant.integrating = true,
                _ if re >= 0.0 => return Err(unstable(re)),
                (_, 0.0) => plant.lags.push(-1.0 / re),
                _ if im > 0.0 && plant.pair.is_some() => {
                    return Err(unserved("it has more than one damped pair of poles"));
                }
                _ if im > 0.0 => plant.add_pair(1.0 / re.hypot(im), -re / re.hypot(im)),
                _ => {}
            }
        }
        for (re, im) in m.zeros() {
            if re == 0.0 || im != 0.0 && re.abs() < EQUAL * re.hypot(im) {
                return Err(unserved("it has zeros at 0 or a pair of complex ones"));
            }
            plant.zeros.push(-re.signum() / re.hypot(im));
        }
        Ok(plant.sorted())
    }

    /// The process model of these factors; of several zeros it has the first.
    pub fn process(&self) -> ProcessModel {
        let Factors { K, L, pair, integrating, .. } = *self;
        ProcessModel {
            K,
            T: pair.iter().map(|pair| pair.0).chain(self.lags.iter().copied()).collect(),
            L,
            Tz: self.zeros.first().copied().unwrap_or(0.0),
            zeta: pair.map(|pair| pair.1),
            integrating,
        }
    }

    fn add_pair(&mut self, T: f64, zeta: f64) {
        if zeta < EQUAL {
            self.pair = Some((T, zeta));
        } else {
            let apart = (zeta * zeta - 1.0).max(0.0).sqrt();
            // The product is T^2; the difference would cancel.
            self.lags.extend([T * (zeta + apart), T / (zeta + apart)]);
        }
    }

    fn sorted(mut self) -> Self {
        self.lags.sort_by(|a, b| b.total_cmp(a));
        self
    }

    /// The model of `order` lags, the integrator counted.
    pub fn reduced(&self, order: usize, tau_c: Option<f64>) -> Result<ProcessModel> {
        if let Some(tau_c) = tau_c {
            return self.without_left_zeros(tau_c)?.kept(order);
        }
        let right: Vec<f64> = self.zeros.iter().copied().filter(|&Tz| Tz < 0.0).collect();
        let without = Factors { zeros: right, ..self.clone() };
        if without.zeros.len() == self.zeros.len() {
            return without.kept(order);
        }
        let short = self.agreeing(order, self.L - without.zeros.iter().sum::<f64>());
        let long = self.agreeing(order, without.kept(order).map_or(self.L, |model| model.L));
        match (short, long) {
            (Ok(short), Ok(long)) if short.L < (1.0 - 1e-9) * long.L && self.holds(&short, order) => {
                Ok(short)
            }
            (short, long) => long.or(short),
        }
    }

    /// The model for a closed loop as fast as the delay that comes out, from a first guess of that.
    fn agreeing(&self, order: usize, mut tau: f64) -> Result<ProcessModel> {
        let mut model = self.without_left_zeros(tau)?.kept(order)?;
        for _ in 0..STEPS {
            if (model.L - tau).abs() <= 1e-12 * tau {
                break;
            }
            tau = model.L;
            model = self.without_left_zeros(tau)?.kept(order)?;
        }
        Ok(model)
    }

    /// Whether SIMC on a reduced model leaves the plant itself enough margin.
    fn holds(&self, reduced: &ProcessModel, order: usize) -> bool {
        let terms = if order == 2 { Terms::Pid } else { Terms::Pi };
        simc(&Model::Process(reduced.clone()), None, terms)
            .and_then(|found| margins(&Model::Transfer(self.transfer()), &found.pid))
            .is_ok_and(|m| m.stable && m.Ms < SOUND)
    }

    fn transfer(&self) -> TransferFunction {
        let lag = |p: Vec<f64>, &T: &f64| product(&p, &[T, 1.0]);
        let pair = self.pair.map_or(vec![1.0], |(T, zeta)| vec![T * T, 2.0 * zeta * T, 1.0]);
        let mut den = self.lags.iter().fold(pair, lag);
        den.extend(self.integrating.then_some(0.0));
        TransferFunction { num: self.zeros.iter().fold(vec![self.K], lag), den, L: self.L }
    }

    fn without_left_zeros(&self, tau_c: f64) -> Result<Self> {
        let (mut left, right): (Vec<f64>, _) = self.zeros.iter().copied().partition(|&Tz| Tz > 0.0);
        left.sort_by(|a, b| b.total_cmp(a));
        let mut plant = Factors { zeros: right, ..self.clone() };
        for Tz in left {
            plant.absorb(Tz, tau_c)?;
            plant = plant.sorted();
        }
        Ok(plant)
    }

    /// Takes a zero to the left together with one lag.
    fn absorb(&mut self, Tz: f64, tau_c: f64) -> Result<()> {
        let larger = self.lags.iter().rposition(|&T| T >= Tz);
        let smaller = self.lags.iter().position(|&T| T < Tz);
        let is_close = |a: usize, b: usize| {
            let apart = Tz / self.lags[b];
            apart < CLOSE && apart < self.lags[a] / Tz
        };
        match (larger, smaller) {
            (Some(a), Some(b)) if is_close(a, b) => self.ahead(b, Tz, tau_c),
            (Some(a), _) if Tz >= 5.0 * tau_c => self.K *= Tz / self.lags.remove(a),
            (Some(a), _) => {
                let T = self.lags.remove(a);
                let t = T.min(5.0 * tau_c);
                self.K *= t / T;
                self.lags.extend((t > Tz).then_some(t - Tz));
            }
            (None, Some(b)) => self.ahead(b, Tz, tau_c),
            (None, None) => return Err(unserved("its zero to the left has no lag to go with")),
        }
        Ok(())
    }

    /// A zero slower than its lag: T1, T1a, T1b.
    fn ahead(&mut self, b: usize, Tz: f64, tau_c: f64) {
        self.K *= (Tz / self.lags.remove(b).max(tau_c)).max(1.0);
    }

    fn kept(&self, order: usize) -> Result<ProcessModel> {
        let mut L = self.L - self.zeros.iter().sum::<f64>();
        let slots = order - usize::from(self.integrating).min(order);
        let slowest = self.lags.first().copied().unwrap_or(0.0);
        let of = |lags: Vec<f64>, pair: Option<(f64, f64)>, L: f64| {
            let kept = Factors { lags, pair, zeros: Vec::new(), L, ..*self };
            Ok(kept.sorted().process())
        };
        match self.pair {
            Some((T, zeta)) if T >= slowest && !self.integrating && slots < 2 && zeta >= LAGLIKE => {
                let lags = [self.lags.as_slice(), &[zeta * T; 2]].concat();
                return Factors { pair: None, lags, ..self.clone() }.sorted().kept(order);
            }
            Some((T, _)) if T >= slowest && !self.integrating => {
                if slots < 2 {
                    return Err(unserved("its slowest poles are a damped pair")
                        .remedy("use imc_pid, which serves a pair, or loop shaping"));
                }
                return of(Vec::new(), self.pair, L + self.lags.iter().sum::<f64>());
            }
            Some((T, zeta)) => L += 2.0 * zeta * T,
            None => {}
        }
        let (keep, rest) = self.lags.split_at(slots.min(self.lags.len()));
        let mut keep = keep.to_vec();
        if let Some((next, beyond)) = rest.split_first() {
            L += 0.5 * next + beyond.iter().sum::<f64>();
            keep.iter_mut().rev().take(1).for_each(|T| *T += 0.5 * next);
        }
        if keep.is_empty() && !self.integrating {
            return Err(unserved("it has no lag: it answers at once"));
        }
        of(keep, None, L)
    }
}

/// Refuses a polynomial model.
pub fn sampled() -> Error {
    let needed = "a ProcessModel or TransferFunction (d2c converts first-order PolyModels)";
    Error::argument("model", "a PolyModel", needed)
}

/// Refuses an unstable plant.
pub fn unstable(re: f64) -> Error {
    Error::new("M02", format!("the plant is unstable: it has a pole at {} 1/s", rounded(re)))
        .measured(re, 0.0)
        .remedy("judge settings of your own with tune.margins: no rule here serves it")
}

fn unserved(why: &str) -> Error {
    Error::new("M12", format!("the half rule has no model of this plant: {why}"))
        .remedy("judge settings of your own with tune.margins")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plant(K: f64, lags: &[f64], zeros: &[f64], L: f64, integrating: bool) -> Factors {
        Factors { K, lags: lags.to_vec(), pair: None, zeros: zeros.to_vec(), L, integrating }.sorted()
    }

    fn close(model: &ProcessModel, K: f64, T: &[f64], L: f64) {
        let sizes = [vec![K, L], T.to_vec()].concat();
        let ours = [vec![model.K, model.L], model.T.clone()].concat();
        assert_eq!(ours.len(), sizes.len(), "{model:?}");
        assert!(ours.iter().zip(&sizes).all(|(a, b)| (a - b).abs() < 1e-12), "{model:?} {sizes:?}");
    }

    /// Skogestad 2003, table 4: E2, E3, E5, E12, E13.
    #[test]
    fn printed_reductions_come_out() {
        let e2 = plant(1.0, &[2.0, 1.0, 0.4, 0.2, 0.05, 0.05, 0.05], &[-0.3, 0.08], 0.0, false);
        close(&e2.reduced(1, None).expect("first"), 1.0, &[2.5], 1.47);
        close(&e2.reduced(2, None).expect("second"), 1.0, &[2.0, 1.2], 0.77);
        let e3 = plant(2.0, &[20.0, 1.0, 0.1, 0.1], &[15.0], 0.0, false);
        close(&e3.reduced(1, None).expect("first"), 1.5, &[1.05], 0.15);
        close(&e3.reduced(2, None).expect("second"), 1.5, &[1.0, 0.15], 0.05);
        let e5 = plant(1.0, &[1.0, 0.2, 0.04, 0.008], &[], 0.0, false);
        close(&e5.reduced(1, None).expect("first"), 1.0, &[1.1], 0.148);
        close(&e5.reduced(2, None).expect("second"), 1.0, &[1.0, 0.22], 0.028);
        let e12 = plant(1.0, &[10.0, 8.0, 1.0], &[6.0, 3.0], 0.3, false);
        close(&e12.reduced(1, None).expect("first"), 0.225, &[1.0], 0.3);
        let e13 = plant(1.0, &[10.0, 0.5], &[2.0], 1.0, false);
        close(&e13.reduced(1, None).expect("first"), 0.625, &[4.5], 1.25);
    }

    #[test]
    fn an_integrator_is_the_largest_lag() {
        let e8 = plant(1.0, &[1.0, 1.0], &[], 0.0, true);
        close(&e8.reduced(1, None).expect("first"), 1.0, &[], 1.5);
        close(&e8.reduced(2, None).expect("second"), 1.0, &[1.5], 0.5);
        let e6 = plant(1.0, &[1.0, 1.0, 0.028], &[0.17, 0.17], 0.0, true);
        close(&e6.reduced(2, None).expect("second"), 1.0, &[1.33], 0.358);
    }
}
