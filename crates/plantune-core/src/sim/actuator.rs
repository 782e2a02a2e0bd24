//! What stands between controller and plant: limits, and a valve that does not follow every command.
//!
//! The controller knows the limits and the rate, and keeps its integral within them; it does not know the
//! dead band, nor the steps of the converter.

use crate::error::{Error, Result};

/// What the input of the plant can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Actuator {
    /// Lower limit of u.
    pub low: f64,
    /// Upper limit of u.
    pub high: f64,
    /// Fastest change of u, 1/s.
    pub rate: f64,
    /// The position follows a command only if it is off by more.
    pub dead_band: f64,
    /// Step of u; 0 for none.
    pub step: f64,
}

impl Default for Actuator {
    fn default() -> Self {
        Actuator {
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
            rate: f64::INFINITY,
            dead_band: 0.0,
            step: 0.0,
        }
    }
}

impl Actuator {
    /// Where u may go within `h` seconds from `u`.
    #[inline(always)]
    pub fn reach(&self, u: f64, h: f64) -> (f64, f64) {
        if self.rate == f64::INFINITY {
            return (self.low, self.high);
        }
        let way = self.rate * h;
        (self.low.max(u - way), self.high.min(u + way))
    }

    /// Whether the input follows the command as it is, within its limits.
    pub fn follows(&self) -> bool {
        self.dead_band == 0.0 && self.step == 0.0
    }

    /// The command that leaves the controller, and where it brings the position.
    #[inline(always)]
    pub fn position(&self, u: f64, position: f64) -> (f64, f64) {
        let command = quantised(u, self.step);
        (command, if (command - position).abs() > self.dead_band { command } else { position })
    }

    /// Refuses what is no actuator, or does not hold `u0`.
    pub fn check(&self, u0: f64) -> Result<()> {
        if !(self.low < self.high) {
            return Err(Error::argument("low", self.low, &format!("less than high, {}", self.high)));
        }
        if !(self.low <= u0 && u0 <= self.high) {
            return Err(Error::argument(
                "u0",
                u0,
                &format!("within the limits {} and {}", self.low, self.high),
            ));
        }
        if !(self.rate > 0.0) {
            return Err(Error::argument("rate", self.rate, "positive, in units of u per second"));
        }
        for (name, value) in [("dead_band", self.dead_band), ("step", self.step)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::argument(name, value, "zero or positive"));
            }
        }
        Ok(())
    }
}

/// `u` no further than its limits.
#[inline(always)]
pub fn within(u: f64, (low, high): (f64, f64)) -> f64 {
    if u > high {
        high
    } else if u < low {
        low
    } else {
        u
    }
}

/// `x` in whole steps, halves to the even one; `x` itself for a step of 0.
#[inline(always)]
pub fn quantised(x: f64, step: f64) -> f64 {
    if step == 0.0 { x } else { step * (x / step).round_ties_even() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sticking_valve_moves_once_it_is_off_by_more_than_the_band() {
        let valve = Actuator { dead_band: 0.5, ..Actuator::default() };
        let mut position = 0.0;
        let commands = [0.3, 0.5, 0.6, 0.2, 0.0, -0.1];
        let moved: Vec<f64> = commands
            .iter()
            .map(|&u| {
                (_, position) = valve.position(u, position);
                position
            })
            .collect();
        assert_eq!(moved, [0.0, 0.0, 0.6, 0.6, 0.0, 0.0]);
    }

    #[test]
    fn steps_and_reach() {
        assert_eq!([0.24, 0.26, 0.25, 0.75].map(|x| quantised(x, 0.5)), [0.0, 0.5, 0.0, 1.0]);
        let slow = Actuator { high: 1.0, rate: 2.0, ..Actuator::default() };
        assert_eq!(slow.reach(0.9, 0.1), (0.7, 1.0));
        assert_eq!(Actuator::default().reach(0.0, 0.1), (f64::NEG_INFINITY, f64::INFINITY));
        assert_eq!(Actuator { low: 2.0, high: 1.0, ..slow }.check(1.0).expect_err("empty").code(), "U01");
        assert_eq!(slow.check(1.5).expect_err("u0 outside").code(), "U01");
    }
}
