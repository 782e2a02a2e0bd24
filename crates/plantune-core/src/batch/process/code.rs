//! What a code such as `P2DU` says: how many lags, and which of delay, zero, integrator and pair of poles.

use crate::error::{Error, Result};
use crate::model::ProcessModel;

/// The structure of the plant of one input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// Time constants, a pair of poles counting as two.
    pub lags: usize,
    /// `D`: a dead time `L`.
    pub delay: bool,
    /// `Z`: a zero at `-1/Tz`.
    pub zero: bool,
    /// `I`: a pole at 0.
    pub integrating: bool,
    /// `U`: the first two poles are a pair `T^2 s^2 + 2 zeta T s + 1`.
    pub pair: bool,
}

impl Code {
    /// `K e^(-L s) / (T s + 1)`.
    pub const P1D: Code = Code { lags: 1, delay: true, zero: false, integrating: false, pair: false };

    /// Reads a code; its letters may stand in any order (U01).
    pub fn read(text: &str) -> Result<Code> {
        let letters = text.get(2..).unwrap_or("");
        let count = |letter: char| letters.matches(letter).count();
        let lags = ["P0", "P1", "P2", "P3"].iter().position(|p| text.starts_with(p));
        let known = letters.chars().all(|c| "DZIU".contains(c) && count(c) == 1);
        let Some(lags) = lags.filter(|_| known) else {
            return Err(unknown(text, "P0, P1, P2 or P3 with any of the letters D, Z, I, U, as in 'P2DU'"));
        };
        let has = |letter| count(letter) == 1;
        let code = Code { lags, delay: has('D'), zero: has('Z'), integrating: has('I'), pair: has('U') };
        if code.pair && lags < 2 {
            return Err(unknown(text, "P2 or P3 where it has a U: a pair of poles counts as two"));
        }
        if code.zero && code.states() == 0 {
            return Err(unknown(text, "of at least one pole where it has a Z"));
        }
        Ok(code)
    }

    /// Number of time constants.
    pub fn times(&self) -> usize {
        self.lags - usize::from(self.pair)
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        self.lags + usize::from(self.integrating)
    }

    /// Parameters in which the output is not linear: times, damping, dead time.
    pub fn nonlinear(&self) -> usize {
        self.times() + usize::from(self.pair) + usize::from(self.delay)
    }

    /// Parameters in which it is: `K` and `K Tz`.
    pub fn linear(&self) -> usize {
        1 + usize::from(self.zero)
    }

    /// Poles more than zeros.
    fn excess(&self) -> usize {
        self.states() - usize::from(self.zero)
    }

    /// Whether the output jumps with the input.
    pub fn jumps(&self) -> bool {
        self.excess() == 0
    }

    /// Whether the slope of the cost jumps where the delay is a whole number of samples.
    pub fn kinked(&self) -> bool {
        self.delay && self.excess() <= 1
    }

    /// Orders `(nc, nd)` of a noise model that can be true if the noise goes through the poles of the plants.
    pub fn arma(codes: &[Code]) -> (usize, usize) {
        let n = codes.iter().map(|c| c.states()).max().unwrap_or(0).max(1);
        (n, n)
    }

    /// Names of the parameters, `L` among them even if it is 0 by the code.
    pub fn names(&self) -> Vec<String> {
        let times = (1..=self.times()).map(|k| if self.times() == 1 { "T".into() } else { format!("T{k}") });
        let last = [("Tz", self.zero), ("zeta", self.pair)].into_iter().filter(|(_, has)| *has);
        std::iter::once("K".into())
            .chain(times)
            .chain(["L".into()])
            .chain(last.map(|(name, _)| name.into()))
            .collect()
    }

    /// Parameters of a model of this structure in the order of their names.
    pub fn theta(&self, plant: &ProcessModel) -> Vec<f64> {
        let zero = self.zero.then_some(plant.Tz);
        [vec![plant.K], plant.T.clone(), vec![plant.L]]
            .concat()
            .into_iter()
            .chain(zero)
            .chain(plant.zeta)
            .collect()
    }

    /// The model of a gain, the nonlinear parameters in samples, and `Tz` in seconds.
    pub fn model(&self, K: f64, p: &[f64], Tz: f64, Ts: f64) -> ProcessModel {
        let n = self.times();
        ProcessModel {
            K,
            T: p[..n].iter().map(|T| T * Ts).collect(),
            L: if self.delay { p[p.len() - 1] * Ts } else { 0.0 },
            Tz: if self.zero { Tz } else { 0.0 },
            zeta: self.pair.then(|| p[n]),
            integrating: self.integrating,
        }
    }
}

fn unknown(text: &str, needed: &str) -> Error {
    Error::new("U01", format!("`code` is {text:?}, must be {needed}")).remedy("process(rec, 'P1D')")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_stand_in_any_order_and_nonsense_is_refused() {
        assert_eq!(Code::read("P1D").expect("a code"), Code::P1D);
        assert_eq!(Code::read("P2DU").expect("a code"), Code::read("P2UD").expect("a code"));
        assert_eq!(Code::read("P3DZU").expect("a code").names(), ["K", "T1", "T2", "L", "Tz", "zeta"]);
        assert_eq!(Code::read("P0DI").expect("a code").states(), 1);
        for wrong in ["", "P", "P4", "p1d", "P1X", "P2DD", "P1U", "P0Z", "ARX"] {
            assert_eq!(Code::read(wrong).expect_err(wrong).code(), "U01", "{wrong}");
        }
    }
}
