//! Starts from the minimum of a smaller structure, which the larger one holds: it never ends above.
//!
//! ```text
//! a zero more          Tz = 0
//! a pair for two lags  T = sqrt(T1 T2),  zeta = (T1 + T2)/(2 T)
//! a lag more           T2 short, L shorter by as much
//! ```

use super::code::Code;
use super::problem::{Point, Problem};

/// Further lags to begin with, samples; the first is as good as none.
const SHORT: [f64; 2] = [0.02, 0.5];

impl Problem<'_, '_> {
    /// Points to search from that the smaller structure gives; none where there is no smaller one.
    pub(super) fn smaller_starts(&self) -> Vec<Vec<f64>> {
        let lower: Vec<Code> = self.codes.iter().map(Code::lower).collect();
        if lower == self.codes {
            return Vec::new();
        }
        let smaller = self.with_codes(lower);
        let Some(best) = smaller.minimum() else { return Vec::new() };
        SHORT.iter().map(|&lag| self.enlarged(&smaller, &best, lag)).collect()
    }

    /// The same plants in the coordinates of this structure.
    fn enlarged(&self, smaller: &Problem, best: &Point, lag: f64) -> Vec<f64> {
        let of_input = |i: usize| -> Vec<f64> {
            let (code, own) = (self.codes[i], smaller.codes[i]);
            let p = smaller.natural(best, i);
            let (mut times, rest) = (p[..own.times()].to_vec(), &p[own.times()..]);
            let mut zeta = own.pair.then(|| rest[0]);
            let mut L = own.delay.then(|| rest[rest.len() - 1]);
            if code.pair && !own.pair {
                let (a, b) = (times[0], times[1]);
                times.splice(..2, [(a * b).sqrt()]);
                zeta = Some(0.5 * (a + b) / (a * b).sqrt());
            } else if code.lags > own.lags {
                times.push(lag);
                L = L.map(|L| (L - lag).max(self.bounds.0));
            }
            times.iter().chain(&zeta).map(|x| x.ln()).chain(L).collect()
        };
        (0..self.codes.len()).flat_map(of_input).collect()
    }
}

impl Code {
    /// The structure with a zero, a pair or a lag less, in this order; itself where one lag is left.
    fn lower(&self) -> Code {
        match self {
            code if code.zero && code.states() > 0 => Code { zero: false, ..*code },
            code if code.pair => Code { pair: false, ..*code },
            code if code.lags > 1 => Code { lags: code.lags - 1, ..*code },
            code => *code,
        }
    }
}
