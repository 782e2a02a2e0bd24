//! A start without knowledge, in whatever units the signals are.
//!
//! The covariance of a start is in units of the noise over those of a signal, and neither is known. With an equation
//! error each parameter comes into play when its signal has first moved, so little known that the first samples
//! decide. An output error is looked at for a while, and learnt once it is seen how far its signals go.

use super::super::rls::overflow;
use super::{Rpem, Structure};
use crate::error::{Error, Result};

/// What a start without knowledge knows of the coefficients of the path and of the noise, `D_j = known/travel^2`: a
/// sample in which the signal has gone as far as it went before weighs so many noise variances against the start.
/// With an equation error the first samples may decide; `C` had better wait until there are errors to speak of.
pub(super) const EQUATION: Known = Known { path: 1e6, noise: 10.0 };

/// From nowhere a simulated output leads anywhere, and `C/D` takes the errors of an unknown path for noise that
/// wanders: the first samples may not decide, and the noise waits longest.
pub(super) const SIMULATED: Known = Known { path: 10.0, noise: 1.0 };

/// The same for what is forgotten later.
const LEAST_KNOWN: f64 = 1e6;

/// Samples per parameter that are looked at before anything is simulated, to see how far signals go; then they are
/// learnt all at once.
pub(super) const LOOK: usize = 20;

/// Of the path and of the noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    path: f64,
    noise: f64,
}

impl Rpem {
    /// Looks at a sample (NaN: no output) until there are enough and the input has moved; then learns them all.
    #[cold]
    pub(super) fn look(&mut self, u: f64, y: f64) -> Result<Option<f64>> {
        if !u.is_finite() {
            return Err(Error::argument("u", u, "a finite number"));
        }
        if !(u * u + if y.is_nan() { 0.0 } else { y * y }).is_finite() {
            return Err(overflow());
        }
        if self.seen.is_empty() && y.is_nan() {
            return Ok(None);
        }
        let full = LOOK * self.theta.len();
        if self.seen.len() == full {
            self.seen.remove(0);
        }
        self.seen.push([u, y]);
        self.samples += 1;
        let [u0, y0] = self.seen[0];
        let far = |i: usize, zero: f64| self.seen.iter().map(|s| (s[i] - zero).abs()).fold(0.0, f64::max);
        let travel =
            if self.structure.offset { [far(0, u0), far(1, y0)] } else { [far(0, 0.0), far(1, 0.0)] };
        if self.seen.len() < full || travel[0] == 0.0 {
            return Ok(None);
        }
        (self.looking, self.travel) = (false, travel);
        self.samples -= full as u64;
        self.open();
        let seen = std::mem::take(&mut self.seen);
        let mut last = None;
        for &[u, y] in &seen {
            last = if y.is_nan() { self.skip(u).map(|()| None)? } else { self.step(u, y)? };
        }
        Ok(last)
    }

    /// Of a start without knowledge, brings parameters into play once their signals have moved.
    #[cold]
    pub(super) fn open(&mut self) {
        let Some(known) = self.known else { return };
        let Structure { na, nb, nc, nd, .. } = self.structure;
        let (a, c, f) = (na, na + nb, na + nb + nc + nd);
        for j in 0..self.theta.len() {
            let (known, travel) = if j == self.structure.coefficients() {
                (known.path, 1.0)
            } else if (a..c).contains(&j) {
                (known.path, self.travel[0])
            } else {
                (if (c..f).contains(&j) { known.noise } else { known.path }, self.travel[1])
            };
            let per = 1.0 / (travel * travel);
            if self.P.factors().1[j] == 0.0 && per.is_finite() {
                self.P.open(j, known * per, LEAST_KNOWN * per);
                self.closed -= 1;
            }
        }
    }
}
