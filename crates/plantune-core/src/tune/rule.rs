//! What a tuning rule is: a formula for each class of plant that it serves.
//!
//! ```text
//! first        K e^(-L s) / (T s + 1)
//! second       K (Tz s + 1) e^(-L s) / ((T1 s + 1)(T2 s + 1)), or a damped pair below
//! integrating  K e^(-L s) / (s (T s + 1)), T = 0 for none
//! ```
//!
//! A model of more lags, or with a zero that the rule does not know, is reduced by the half rule to the
//! highest order that the rule serves; the settings then carry the reduced model.

use super::half_rule::Factors;
use crate::error::{Error, Result};
use crate::model::{Fopdt, Model, Pid, ProcessModel, TransferFunction};

/// `K (Tz s + 1) e^(-L s) / (product s^2 + sum s + 1)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Second {
    /// Static gain, y/u.
    pub K: f64,
    /// Of both time constants, s; `2 zeta T` of a pair.
    pub sum: f64,
    /// Of both time constants, s^2; `T^2` of a pair.
    pub product: f64,
    /// Time of the zero, s; 0 without one.
    pub Tz: f64,
    /// Dead time, s.
    pub L: f64,
}

impl Second {
    /// Both time constants, s, the larger first.
    pub fn times(&self) -> (f64, f64) {
        let half = 0.5 * self.sum;
        let large = half + (half * half - self.product).max(0.0).sqrt();
        (large, self.product / large)
    }

    /// As numerator and denominator.
    pub fn transfer(&self) -> TransferFunction {
        let from = |p: [f64; 3]| p.into_iter().skip_while(|&c| c == 0.0).collect();
        TransferFunction {
            num: from([0.0, self.K * self.Tz, self.K]),
            den: from([self.product, self.sum, 1.0]),
            L: self.L,
        }
    }

    /// Whether it is two lags and no more.
    pub fn is_two_lags(&self) -> bool {
        self.Tz == 0.0 && self.sum * self.sum >= (4.0 - 1e-9) * self.product
    }
}

/// `K e^(-L s) / (s (T s + 1))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integrating {
    /// Slope, y/(u s).
    pub K: f64,
    /// Time constant of the lag, s; 0 for none.
    pub T: f64,
    /// Dead time, s.
    pub L: f64,
}

/// Settings and the closed-loop time constant aimed at, s; NaN for none.
pub type Found = Result<(Pid, f64)>;

/// A rule by its formulas.
#[derive(Clone, Copy)]
pub struct Rule<'r> {
    /// As messages name it.
    pub name: &'r str,
    /// One lag.
    pub first: &'r dyn Fn(&Fopdt) -> Found,
    /// Two lags, if it serves them.
    pub second: Option<&'r dyn Fn(&Second) -> Found>,
    /// Which plants of second order: two lags, unless it knows more.
    pub knows: &'r dyn Fn(&Second) -> bool,
    /// An integrator, if it serves one.
    pub integrating: Option<&'r dyn Fn(&Integrating) -> Found>,
    /// Whether that serves a lag as well.
    pub lagging: bool,
}

/// Settings of a rule.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The controller.
    pub pid: Pid,
    /// Closed-loop time constant aimed at, s; NaN for none.
    pub tau_c: f64,
    /// What the rule was computed on, where a process model can say it.
    pub plant: Option<ProcessModel>,
    /// Whether that is less than the model given.
    pub reduced: bool,
}

impl<'r> Rule<'r> {
    /// A rule for first order plus dead time and no more.
    pub fn new(name: &'r str, first: &'r dyn Fn(&Fopdt) -> Found) -> Self {
        Rule { name, first, second: None, knows: &Second::is_two_lags, integrating: None, lagging: false }
    }

    /// Settings for a model; `tau_c` is what [`super::half_rule`] takes.
    ///
    /// Refuses an integrating plant that the rule does not serve (M01), an unstable one (M02), and what is
    /// no plant or has no reduction (M12).
    pub fn on(&self, model: &Model, tau_c: Option<f64>) -> Result<Settings> {
        let plant = Factors::of(model)?;
        let order = match (plant.integrating, self.integrating, self.second) {
            (true, None, _) => return Err(self.settles_only()),
            (true, Some(_), _) => 1 + usize::from(self.lagging),
            (false, _, second) => 1 + usize::from(second.is_some()),
        };
        if let Some(found) = self.formula(&plant) {
            let (pid, tau_c) = found?;
            return Ok(Settings { pid, tau_c, plant: Some(plant.process()), reduced: false });
        }
        let reduced = Factors::of_process(&plant.reduced(order, tau_c)?);
        let (pid, tau_c) = self.formula(&reduced).unwrap_or_else(|| {
            Err(Error::new("M12", format!("{} does not serve a damped pair of poles", self.name))
                .remedy("use imc_pid, which does, or loop shaping"))
        })?;
        Ok(Settings { pid, tau_c, plant: Some(reduced.process()), reduced: true })
    }

    /// The formula for the plant as it stands, if there is one.
    fn formula(&self, plant: &Factors) -> Option<Found> {
        let Factors { K, L, .. } = *plant;
        let zero = match plant.zeros[..] {
            [] => 0.0,
            [Tz] => Tz,
            _ => return None,
        };
        match (plant.integrating, &plant.lags[..], plant.pair) {
            (true, [], None) if zero == 0.0 => self.integrating.map(|f| f(&Integrating { K, T: 0.0, L })),
            (true, &[T], None) if zero == 0.0 && self.lagging => {
                self.integrating.map(|f| f(&Integrating { K, T, L }))
            }
            (false, &[T], None) if zero == 0.0 => Some((self.first)(&Fopdt { K, T, L })),
            (false, &[T], None) => self.two(Second { K, sum: T, product: 0.0, Tz: zero, L }),
            (false, &[T1, T2], None) => self.two(Second { K, sum: T1 + T2, product: T1 * T2, Tz: zero, L }),
            (false, [], Some((T, zeta))) => {
                self.two(Second { K, sum: 2.0 * zeta * T, product: T * T, Tz: zero, L })
            }
            _ => None,
        }
    }

    fn two(&self, plant: Second) -> Option<Found> {
        self.second.filter(|_| (self.knows)(&plant)).map(|f| f(&plant))
    }

    fn settles_only(&self) -> Error {
        let text = format!("the plant integrates: {} is for plants that settle", self.name);
        Error::new("M01", text).remedy("use simc, amigo, lambda_, tyreus_luyben or ziegler_nichols")
    }
}
