//! Weighted plays (Prandtl-Ishlinskii), and their exact inverse.
//!
//! ```text
//! z_i(t) = max(x(t) - r_i, min(x(t) + r_i, z_i(t-1)))     z_i(-1) given, 0 in the virgin state
//! y(t)   = O + sum_i w_i z_i(t)                           0 = r_0 < r_1 < ...
//! ```
//!
//! Inverse, where `W_i = w_0 + ... + w_i` is positive for every i (Krejci and Kuhnen, IEE Proc. Control Theory Appl.
//! 148, 2001):
//!
//! ```text
//! r'_i = sum_(j<=i) w_j (r_i - r_j)                   = r'_(i-1) + W_(i-1) (r_i - r_(i-1))
//! z'_i = sum_(j<=i) w_j z_i + sum_(j>i) w_j z_j       = z'_(i-1) + W_(i-1) (z_i - z_(i-1))
//! w'_0 = 1 / W_0    w'_i = 1 / W_i - 1 / W_(i-1)
//! ```
//!
//! The inverse answers `y - O`. A play moved along both axes is a play begun as far away, so that the inverse is a
//! stack again, with `z'_i + O` and `O' = -O / W_n`.

use super::plays::Plays;
use crate::error::{Error, Result};

/// Half widths, weights and offset.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayStack {
    /// Half widths `r`, ascending from 0 on.
    pub r: Vec<f64>,
    /// Weights.
    pub w: Vec<f64>,
    /// What is added to the sum.
    pub offset: f64,
    /// Where each play begins.
    pub z0: Vec<f64>,
}

/// Partial sums of weights below this share of their magnitudes are rounding, and so are differences of states.
const ROUNDING: f64 = 1e-14;

impl PlayStack {
    /// In the virgin state.
    pub fn virgin(r: Vec<f64>, w: Vec<f64>, offset: f64) -> Self {
        PlayStack { z0: vec![0.0; r.len()], r, w, offset }
    }

    pub(super) fn check(&self) -> Result<()> {
        if self.r.is_empty() || self.r.len() != self.w.len() {
            let came = format!("{} half widths and {} weights", self.r.len(), self.w.len());
            return Err(Error::argument("w", came, "as many as `r`, at least one"));
        }
        let ascending = self.r[0] >= 0.0 && self.r.windows(2).all(|r| r[0] < r[1]);
        if !ascending || self.r.iter().any(|r| !r.is_finite()) {
            return Err(Error::argument("r", format!("{:?}", self.r), "finite, ascending, from 0 on"));
        }
        if self.w.iter().chain([&self.offset]).any(|w| !w.is_finite()) {
            return Err(Error::argument("w", format!("{:?}", self.w), "finite, as is `offset`"));
        }
        if self.z0.len() != self.r.len() || self.z0.iter().any(|z| !z.is_finite()) {
            return Err(Error::argument("z0", format!("{:?}", self.z0), "finite, as many as `r`"));
        }
        Ok(())
    }

    pub(super) fn start(&self) -> Plays {
        Plays::new(self, &self.z0)
    }

    pub(super) fn inverse(&self) -> Result<PlayStack> {
        let W = self.partial_sums()?;
        self.check_reachable()?;
        let last = self.z0.len() - 1;
        // z'_0 = sum w_j z_j, here from the differences, so that a common shift of all z loses no digits.
        let apart: f64 = self.w.iter().zip(&self.z0).map(|(w, z)| w * (z - self.z0[0])).sum();
        let (mut r, mut z, mut before) = (0.0, self.offset + W[last] * self.z0[0] + apart, 0.0);
        let mut inverse = PlayStack::virgin(Vec::new(), Vec::new(), 0.0 - self.offset / W[last]);
        for i in 0..=last {
            if i > 0 {
                r += W[i - 1] * (self.r[i] - self.r[i - 1]);
                z += W[i - 1] * (self.z0[i] - self.z0[i - 1]);
            }
            let slope = 1.0 / W[i];
            // Widths that rounding has made one are one play.
            match inverse.w.last_mut() {
                Some(w) if inverse.r.last() == Some(&r) => *w += slope - before,
                _ => {
                    inverse.r.push(r);
                    inverse.w.push(slope - before);
                    inverse.z0.push(z);
                }
            }
            before = slope;
        }
        Ok(inverse)
    }

    /// `W`, where all of it is positive and the first play has no width: else the output rests while the input moves.
    fn partial_sums(&self) -> Result<Vec<f64>> {
        if self.r[0] != 0.0 {
            let needed = "0 at the first play: after each turn the output would rest, and no inverse exists";
            return Err(Error::argument("r", self.r[0], needed));
        }
        let (mut sum, mut size) = (0.0, 0.0);
        let add = |(i, w): (usize, &f64)| {
            sum += w;
            size += w.abs();
            if sum > ROUNDING * size {
                return Ok(sum);
            }
            let came = format!("{w:.6} at r = {:.6}, with those before {sum:.6}", self.r[i]);
            Err(Error::argument("w", came, "positive in every partial sum, or no inverse exists"))
        };
        self.w.iter().enumerate().map(add).collect()
    }

    /// Refuses states that no input leaves behind: neighbours are no further apart than their widths.
    fn check_reachable(&self) -> Result<()> {
        for (i, (z, r)) in self.z0.windows(2).zip(self.r.windows(2)).enumerate() {
            let (apart, most) = ((z[1] - z[0]).abs(), r[1] - r[0]);
            if apart > most + ROUNDING * 10.0 * (z[0].abs() + z[1].abs() + r[1]) {
                let came = format!("{apart:.6} apart at plays {i} and {}", i + 1);
                return Err(Error::argument("z0", came, &format!("at most {most:.6} apart there, as `r`")));
            }
        }
        Ok(())
    }
}
