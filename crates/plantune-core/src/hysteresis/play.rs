//! Weighted plays (Prandtl-Ishlinskii), and their exact inverse.
//!
//! ```text
//! z_i(t) = max(x(t) - r_i, min(x(t) + r_i, z_i(t-1)))     z_i(-1) = 0
//! y(t)   = O + sum_i w_i z_i(t)                           0 = r_0 < r_1 < ...
//! ```
//!
//! Inverse, where `w_0 > 0` and no partial sum of the weights falls to zero (Krejci and Kuhnen, IEE Proc. Control
//! Theory Appl. 148, 2001):
//!
//! ```text
//! r'_i = sum_(j<=i) w_j (r_i - r_j)    w'_0 = 1 / w_0    w'_i = 1/(w_0 + ... + w_i) - 1/(w_0 + ... + w_(i-1))
//! ```

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
}

impl PlayStack {
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
        Ok(())
    }

    pub(super) fn start(&self) -> Plays {
        Plays::new(self, &vec![0.0; self.r.len()])
    }

    pub(super) fn inverse(&self) -> Result<PlayStack> {
        if self.r[0] != 0.0 || self.w[0] <= 0.0 {
            let came = format!("{} at r = {}", self.w[0], self.r[0]);
            return Err(Error::argument("w", came, "positive at r = 0, or no inverse exists"));
        }
        let (mut r, mut w) = (Vec::new(), Vec::new());
        let mut sum = 0.0;
        for (i, &w_i) in self.w.iter().enumerate() {
            // From 0.0 on, since the sum of nothing is -0.0.
            r.push(self.r[..i].iter().zip(&self.w).fold(0.0, |r, (r_j, w_j)| r + w_j * (self.r[i] - r_j)));
            let before: f64 = sum;
            sum += w_i;
            w.push(if i == 0 { 1.0 / sum } else { 1.0 / sum - 1.0 / before });
        }
        Ok(PlayStack { r, w, offset: 0.0 })
    }
}
