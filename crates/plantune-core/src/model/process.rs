//! Process models: lags, a zero, an integrator and a dead time, each where the plant has one.
//!
//! ```text
//! G(s) = K (Tz s + 1) e^(-L s) / (s^i prod_k (T_k s + 1))
//! with zeta, the first time belongs to a pair:  T_1^2 s^2 + 2 zeta T_1 s + 1  in place of  T_1 s + 1
//! ```
//!
//! `i` is 1 for an integrating plant, else 0. A negative `Tz` is an inverse response. The plain
//! first order has its own, faster formulas in [`super::fopdt`].

use super::{Fopdt, TransferFunction};
use crate::error::{Error, Result};
use crate::poly::product;

/// `K (Tz s + 1) e^(-L s) / (s^i prod (T_k s + 1))`.
#[derive(Clone, Debug, PartialEq)]
pub struct ProcessModel {
    /// Static gain, y/u; of an integrating plant its slope, y/(u s).
    pub K: f64,
    /// Time constants, s; none for an integrator alone.
    pub T: Vec<f64>,
    /// Dead time, s.
    pub L: f64,
    /// Time of the zero, s; 0 without one.
    pub Tz: f64,
    /// Damping of the pair of poles to which the first time belongs.
    pub zeta: Option<f64>,
    /// Whether a pole lies at 0.
    pub integrating: bool,
}

impl From<Fopdt> for ProcessModel {
    fn from(Fopdt { K, T, L }: Fopdt) -> Self {
        ProcessModel { K, T: vec![T], L, Tz: 0.0, zeta: None, integrating: false }
    }
}

impl ProcessModel {
    /// The first order plus dead time that this is, if it is no more.
    pub fn first_order(&self) -> Option<Fopdt> {
        match (self.T.as_slice(), self.Tz, self.zeta, self.integrating) {
            (&[T], 0.0, None, false) => Some(Fopdt { K: self.K, T, L: self.L }),
            _ => None,
        }
    }

    /// Whether it is one or two real lags and a dead time, and no more.
    pub fn is_lags(&self) -> bool {
        matches!(self.T.len(), 1 | 2) && self.Tz == 0.0 && self.zeta.is_none() && !self.integrating
    }

    /// Parameters in the order of their names: `K T1 … L Tz zeta`, the last two where they are present.
    pub fn theta(&self) -> Vec<f64> {
        let zero = (self.Tz != 0.0).then_some(self.Tz);
        [vec![self.K], self.T.clone(), vec![self.L]]
            .concat()
            .into_iter()
            .chain(zero)
            .chain(self.zeta)
            .collect()
    }

    /// The same structure with other parameters.
    pub fn with_theta(&self, theta: &[f64]) -> Self {
        let n = self.T.len();
        let mut rest = theta[n + 2..].iter().copied();
        let Tz = if self.Tz != 0.0 { rest.next().unwrap_or(0.0) } else { 0.0 };
        ProcessModel {
            K: theta[0],
            T: theta[1..=n].to_vec(),
            L: theta[n + 1],
            Tz,
            zeta: self.zeta.and_then(|_| rest.next()),
            integrating: self.integrating,
        }
    }

    /// As numerator and denominator.
    pub fn transfer(&self) -> TransferFunction {
        let num = if self.Tz == 0.0 { vec![self.K] } else { vec![self.K * self.Tz, self.K] };
        let factor = |(k, &T): (usize, &f64)| match self.zeta {
            Some(zeta) if k == 0 => vec![T * T, 2.0 * zeta * T, 1.0],
            _ => vec![T, 1.0],
        };
        let mut den = self.T.iter().enumerate().map(factor).fold(vec![1.0], |p, f| product(&p, &f));
        if self.integrating {
            den.push(0.0);
        }
        TransferFunction { num, den, L: self.L }
    }

    /// Refuses what is no plant (M12).
    pub fn check(&self) -> Result<()> {
        let of = |name: &str, value: f64, fine: bool, needed: &str| {
            if value.is_finite() && fine {
                return Ok(());
            }
            Err(Error::new("M12", format!("`{name}` is {value}, must be {needed}"))
                .remedy("a process model needs K != 0, T > 0 and L >= 0"))
        };
        of("K", self.K, self.K != 0.0, "finite and not zero")?;
        self.T.iter().try_for_each(|&T| of("T", T, T > 0.0, "positive"))?;
        of("L", self.L, self.L >= 0.0, "zero or positive")?;
        of("Tz", self.Tz, true, "finite")?;
        match self.zeta {
            Some(zeta) if self.T.is_empty() => {
                Err(Error::argument("zeta", zeta, "absent: there is no time constant to go with it"))
            }
            Some(zeta) => of("zeta", zeta, zeta > 0.0, "positive"),
            None => Ok(()),
        }?;
        self.transfer().check()
    }
}
