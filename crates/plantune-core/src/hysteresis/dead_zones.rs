//! A monotone curve without memory: dead zones of one side each, superposed.
//!
//! ```text
//! S(h) = O + s_c h + sum_(d_k >= 0) (s_(k+1) - s_k) max(h - d_k, 0) + sum_(d_k < 0) (s_k - s_(k+1)) min(h - d_k, 0)
//!      = O + integral from 0 to h of the slope:  s_0 below knot d_0, s_1 from d_0 to d_1, ...      c where 0 lies
//! ```
//!
//! Its inverse is such a curve: knots `S(d_k)`, slopes `1/s_k`. Kuhnen, European Journal of Control 9, 2003.

use crate::error::{Error, Result};

/// Knots, slopes between them, and the value at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct DeadZones {
    /// Where the slope changes, ascending.
    pub knots: Vec<f64>, // (m - 1)
    /// Slope below the first knot, between each two, above the last.
    pub slopes: Vec<f64>, // (m)
    /// `S(0)`.
    pub offset: f64,
}

impl DeadZones {
    pub(super) fn check(&self) -> Result<()> {
        if self.slopes.len() != self.knots.len() + 1 {
            let came = format!("{} for {} knots", self.slopes.len(), self.knots.len());
            return Err(Error::argument("slopes", came, "one more than `knots`"));
        }
        let ascending = self.knots.windows(2).all(|d| d[0] < d[1]);
        if !ascending || self.knots.iter().any(|d| !d.is_finite()) {
            return Err(Error::argument("knots", format!("{:?}", self.knots), "finite and ascending"));
        }
        if !self.slopes.iter().all(|s| *s > 0.0 && s.is_finite()) {
            let needed = "positive and finite: the curve rises throughout";
            return Err(Error::argument("slopes", format!("{:?}", self.slopes), needed));
        }
        if !self.offset.is_finite() {
            return Err(Error::argument("offset", self.offset, "finite"));
        }
        Ok(())
    }

    /// The curve, ready to be read.
    pub(super) fn curve(&self) -> Curve {
        let d = &self.knots;
        let mut at = vec![self.offset; d.len()];
        // Outwards from 0, on both sides.
        let c = d.partition_point(|d| *d < 0.0);
        for k in c..d.len() {
            let (from, S) = if k == c { (0.0, self.offset) } else { (d[k - 1], at[k - 1]) };
            at[k] = S + self.slopes[k] * (d[k] - from);
        }
        for k in (0..c).rev() {
            let (from, S) = if k + 1 == c { (0.0, self.offset) } else { (d[k + 1], at[k + 1]) };
            at[k] = S + self.slopes[k + 1] * (d[k] - from);
        }
        Curve { zones: self.clone(), at }
    }

    /// The curve with its axes exchanged.
    pub(super) fn inverse(&self) -> DeadZones {
        let Curve { at, .. } = self.curve();
        let mut inverse = DeadZones { knots: Vec::new(), slopes: vec![1.0 / self.slopes[0]], offset: 0.0 };
        for (S, s) in at.iter().zip(&self.slopes[1..]) {
            // Of knots that rounding has made one, the piece between them goes.
            if inverse.knots.last().is_some_and(|last| last >= S) {
                inverse.slopes.pop();
            } else {
                inverse.knots.push(*S);
            }
            inverse.slopes.push(1.0 / s);
        }
        // It passes through (S(d_0), d_0), or through (O, 0).
        inverse.offset = match inverse.curve().at.first() {
            Some(at) => self.knots[0] - at,
            None => -self.offset * inverse.slopes[0],
        };
        inverse
    }
}

/// A curve and its values at the knots.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    zones: DeadZones,
    at: Vec<f64>,
}

impl Curve {
    /// `S(h)`.
    pub(super) fn at(&self, h: f64) -> f64 {
        let DeadZones { knots, slopes, offset } = &self.zones;
        let k = knots.partition_point(|d| *d < h);
        let near = k.saturating_sub(1);
        let (d, S) = match knots.get(near).zip(self.at.get(near)) {
            Some((d, S)) => (*d, *S),
            None => (0.0, *offset),
        };
        S + slopes[k] * (h - d)
    }
}
