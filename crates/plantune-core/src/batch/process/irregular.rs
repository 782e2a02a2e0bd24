//! Stamps that are not uniform: the columns of one or two lags from stamp to stamp.
//!
//! Time counts in mean steps, as samples do elsewhere. Delays have kinks wherever a move of u arrives at a stamp
//! of y: so many that the cost is searched as if it were smooth, without cells. The derivatives by `ln T` are
//! central differences of the exact response, that by `L` is exact; [`crate::model::AtStamps`].

use super::chain::Chain;
use super::code::Code;
use super::problem::{Linear, Problem, Stretch};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::model::{AtStamps, Stamped};
use crate::record::Record;

/// Step of the differences in `ln T`.
const STEP: f64 = 1e-5;

/// Columns of the states, and of the responses.
type Columns = (Vec<Vec<f64>>, Vec<Vec<f64>>);

/// Stamps in mean steps, where they are not uniform.
pub(super) fn in_steps(rec: &Record, limits: &Limits) -> Option<Vec<f64>> {
    let t = rec.t.filter(|_| rec.is_irregular(limits))?;
    Some(t.iter().map(|t_k| (t_k - t[0]) / rec.Ts).collect())
}

/// Rows of a segment before its first `h` steps are over, for `h` up to the longest history.
pub(super) fn within(t: &[f64], longest: f64) -> Vec<usize> {
    let Some(&start) = t.first() else { return Vec::new() };
    (0..=longest.ceil() as usize + 2).map(|h| t.partition_point(|t_k| *t_k < start + h as f64)).collect()
}

/// D15: what has no exact transition here.
pub(super) fn check(rec: &Record, codes: &[Code], noise: (usize, usize), limits: &Limits) -> Result<()> {
    let served = |c: &Code| matches!(c.lags, 1 | 2) && !c.zero && !c.integrating && !c.pair;
    if !rec.is_irregular(limits) || (codes.len() == 1 && served(&codes[0]) && noise == (0, 0)) {
        return Ok(());
    }
    let text = "not uniformly sampled: from stamp to stamp only P1D and P2D of one input, with white noise, are exact";
    Err(Error::new("D15", text)
        .remedy("ask for P1D or P2D with noise=\"white\", or prep.resample(rec, Ts) first"))
}

impl Problem<'_, '_> {
    /// Whether the cost has kinks in the delay of input `i` only at whole samples.
    pub(super) fn kinked(&self, i: usize) -> bool {
        self.t.is_none() && self.codes[i].kinked()
    }

    fn stamped<'s>(&'s self, s: &Stretch, first: usize) -> Option<Stamped<'s>> {
        let t = self.t.as_ref()?;
        Some(Stamped { t: &t[s.rows.clone()], u: &self.u[0][s.rows.clone()], first })
    }

    /// Free states and response of the only input.
    pub(super) fn lag_regressors(&self, s: &Stretch, first: usize, chains: &[Chain]) -> Option<Columns> {
        let (on, p) = (self.stamped(s, first)?, &chains[0].p);
        let lags = lags(chains[0].code, p);
        let column = |i: usize| match s.at_rest {
            true => vec![0.0; on.t.len() - first],
            false => lags.decay(&on.t[first..], std::array::from_fn(|j| f64::from(u8::from(i == j)))),
        };
        let begin = if s.at_rest { [on.u[0]; 2] } else { [0.0; 2] };
        Some(((0..lags.n()).map(column).collect(), vec![lags.response(on, begin)]))
    }

    /// Derivatives of the output by `ln T …, L`.
    pub(super) fn lag_derivatives(
        &self,
        s: &Stretch,
        first: usize,
        chains: &[Chain],
        linear: &Linear,
        x0: &[f64],
    ) -> Option<Vec<Vec<f64>>> {
        let (on, code, p) = (self.stamped(s, first)?, chains[0].code, &chains[0].p);
        let gain = linear.theta[0];
        let begin = |i: usize| {
            let rest = if s.at_rest { on.u[0] } else { 0.0 };
            rest + x0.get(i).map_or(0.0, |x| x / gain)
        };
        let begin = [begin(0), begin(1)];
        let by_time = |i: usize| -> Vec<f64> {
            let at = |sign: f64| {
                let mut p = p.clone();
                p[i] *= (sign * STEP).exp();
                lags(code, &p).response(on, begin)
            };
            at(1.0).iter().zip(at(-1.0)).map(|(a, b)| gain * (a - b) / (2.0 * STEP)).collect()
        };
        let mut columns: Vec<Vec<f64>> = (0..code.lags).map(by_time).collect();
        if code.delay {
            columns.push(lags(code, p).by_delay(on).into_iter().map(|x| gain * x).collect());
        }
        Some(columns)
    }

    /// Response of a shape and a delay over all segments, each from the equilibrium of its first input.
    pub(super) fn lag_response(&self, code: Code, p: &[f64]) -> Vec<f64> {
        self.stretches.iter().flat_map(|s| self.lag_response_of(s, code, p)).collect()
    }

    /// The same over one segment.
    pub(super) fn lag_response_of(&self, s: &Stretch, code: Code, p: &[f64]) -> Vec<f64> {
        let on = self.stamped(s, 0);
        on.map_or_else(Vec::new, |on| lags(code, p).response(on, [on.u[0]; 2]))
    }
}

fn lags(code: Code, p: &[f64]) -> AtStamps<'_> {
    AtStamps { T: &p[..code.lags], L: if code.delay { p[p.len() - 1] } else { 0.0 } }
}
