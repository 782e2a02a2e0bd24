//! Why an estimate or a retuning was not taken, or not as a whole: cause, measured value, limit.
//!
//! Codes of the bad-input catalogue where it has one; those that begin with `A` are the auto-tuner's own.

use std::fmt;
use std::ops::Deref;

use crate::note::{Note, Severity, rounded};

/// Which parameter a reason speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Static gain.
    K,
    /// Time constant, s.
    T,
    /// Dead time, s.
    L,
    /// Proportional gain.
    Kp,
    /// Integral gain.
    Ki,
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

/// What stands in the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The moving window has fewer samples than it needs.
    WindowNotFull,
    /// A parameter is beyond its limits.
    OutOfLimits(Parameter),
    /// A parameter moves too much within the window.
    Unsettled(Parameter),
    /// The delay lies beyond the range that is searched.
    DelayOutside,
    /// The standard deviation of a parameter is too large.
    Uncertain(Parameter),
    /// u or y is missing, and not simulated.
    NotRead,
    /// An alarm is being judged: another level or another plant.
    Judging,
    /// The rule has no settings for this plant.
    NoSettings,
    /// The largest sensitivity is too large over the uncertainty.
    Sensitivity,
    /// The last change of the settings is too recent, s.
    Dwell,
    /// The first move of u in the window is too recent for the plant to have answered, s.
    Unanswered,
    /// The plant is at no operating point.
    NoOperatingPoint,
    /// A controller parameter would change by more than the largest factor: it goes a part of the way.
    LargeChange(Parameter),
    /// A controller parameter is not a number, or of another sign than the present one.
    Sign(Parameter),
    /// The gain margin is too small over the uncertainty.
    GainMargin,
    /// The phase margin is too small over the uncertainty, degrees.
    PhaseMargin,
    /// The share of the window that u spends at a limit is too large.
    Saturated,
    /// The input hardly moves.
    NotExcited,
    /// The output keeps its value while the input moves, samples.
    Stuck,
}

impl Cause {
    /// Code of the catalogue.
    pub fn code(self) -> &'static str {
        match self {
            Cause::WindowNotFull | Cause::Unanswered => "A01",
            Cause::OutOfLimits(_) | Cause::DelayOutside => "A02",
            Cause::Unsettled(_) => "A03",
            Cause::Dwell => "A05",
            Cause::NoOperatingPoint => "A06",
            Cause::Uncertain(_) => "A07",
            Cause::Judging => "A08",
            Cause::NotRead => "D07",
            Cause::NoSettings => "M12",
            Cause::LargeChange(_) => "C01",
            Cause::Sign(_) => "C02",
            Cause::GainMargin | Cause::PhaseMargin | Cause::Sensitivity => "C07",
            Cause::Saturated => "M03",
            Cause::NotExcited => "X01",
            Cause::Stuck => "D18",
        }
    }

    /// Whether it forbids the change; a large change only shortens it.
    pub fn refuses(self) -> bool {
        !matches!(self, Cause::LargeChange(_))
    }
}

/// A cause with its evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reason {
    /// What stands in the way.
    pub cause: Cause,
    /// What was measured.
    pub measured: f64,
    /// What would have been allowed.
    pub limit: f64,
}

impl Reason {
    /// Measured value against its limit.
    pub fn new(cause: Cause, measured: f64, limit: f64) -> Self {
        Reason { cause, measured, limit }
    }

    /// Without numbers.
    pub fn of(cause: Cause) -> Self {
        Reason::new(cause, f64::NAN, f64::NAN)
    }

    /// Code of the catalogue.
    pub fn code(&self) -> &'static str {
        self.cause.code()
    }

    /// As a finding, with its sentence and what to do.
    pub fn note(&self) -> Note {
        let severity = if self.cause.refuses() { Severity::Warning } else { Severity::Info };
        let note = Note::new(self.code(), severity, self.to_string()).remedy(self.remedy());
        if self.limit.is_nan() { note } else { note.measured(self.measured, self.limit) }
    }

    fn remedy(&self) -> &'static str {
        match self.cause {
            Cause::WindowNotFull | Cause::Dwell | Cause::LargeChange(_) => "wait; nothing is wrong",
            Cause::OutOfLimits(Parameter::K) => "check its limits, and the action of the loop",
            Cause::OutOfLimits(_) => "check the limits, or the plant",
            Cause::Unanswered => "wait; where it does not end, fit more rows",
            Cause::NotRead => "look after the link, or simulate what cannot be read",
            Cause::DelayOutside => "search more delays: nk",
            Cause::Judging => "wait; a few time constants decide it",
            Cause::NoSettings => "check the wished margins, or take another rule",
            Cause::Unsettled(_) | Cause::Uncertain(_) => "move the set point or the input more, or longer",
            Cause::NoOperatingPoint => "wait until the plant is at one, or widen the margins",
            Cause::Sign(_) => "check the action of the loop",
            Cause::GainMargin | Cause::PhaseMargin | Cause::Sensitivity => {
                "ask for a slower loop or more margin, or sample faster"
            }
            Cause::Saturated => "keep u off its limits while tuning",
            Cause::NotExcited => "move the set point, or add a dither",
            Cause::Stuck => "look after the sensor or its link",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (x, limit) = (rounded(self.measured), rounded(self.limit));
        match self.cause {
            Cause::WindowNotFull => write!(f, "{x} of {limit} samples in the window"),
            Cause::OutOfLimits(p) if self.limit.abs() <= f64::MIN_POSITIVE => {
                write!(f, "{p} is {x}, must be {}", if self.limit > 0.0 { "positive" } else { "negative" })
            }
            Cause::OutOfLimits(p) => write!(f, "{p} is {x}, beyond its limit {limit}"),
            Cause::Unsettled(p) => write!(f, "{p} moves by {x} within the window, limit {limit}"),
            Cause::DelayOutside => write!(f, "the delay lies beyond its range, which ends at {x} s"),
            Cause::Uncertain(p) => write!(f, "{p} is known to a share of {x}, needs {limit}"),
            Cause::NotRead => write!(f, "u or y is not read: the sample is left out"),
            Cause::Judging => write!(f, "an alarm is judged: another level or another plant"),
            Cause::NoSettings => write!(f, "the rule has no settings for this plant"),
            Cause::Sensitivity => write!(f, "Ms is {x} over the uncertainty, at most {limit}"),
            Cause::Dwell => write!(f, "{x} s since the last change, needs {limit} s"),
            Cause::Unanswered => write!(f, "{x} s since u first moved, the plant needs {limit} s to answer"),
            Cause::NoOperatingPoint => write!(f, "at no operating point"),
            Cause::LargeChange(p) => write!(f, "{p} changes by a factor {x}, at most {limit} per step"),
            Cause::Sign(p) => {
                write!(f, "{p} would be {x} where {limit} is at work: of another sign, or no number")
            }
            Cause::GainMargin => write!(f, "gain margin {x} over the uncertainty, at least {limit}"),
            Cause::PhaseMargin => write!(f, "phase margin {x} deg over the uncertainty, at least {limit}"),
            Cause::Saturated => write!(f, "u at a limit in a share {x} of the window, at most {limit}"),
            Cause::NotExcited => write!(f, "u moves by {x} within the window, at least {limit}"),
            Cause::Stuck => write!(f, "y unchanged for {x} samples while u moves, limit {limit}"),
        }
    }
}

/// Most reasons of one decision.
const MOST: usize = 12;

/// The reasons of one decision, kept in place.
///
/// ```
/// use plantune_core::adapt::{Cause, Reason, Reasons};
///
/// let mut reasons = Reasons::default();
/// reasons.push(Reason::new(Cause::Dwell, 0.4, 1.2));
/// assert_eq!((reasons.len(), reasons[0].code(), reasons.refuse()), (1, "A05", true));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Reasons {
    list: [Reason; MOST],
    len: usize,
}

impl Default for Reasons {
    fn default() -> Self {
        Reasons { list: [Reason::new(Cause::WindowNotFull, 0.0, 0.0); MOST], len: 0 }
    }
}

impl Reasons {
    /// Adds one; what does not fit any more is left out.
    pub fn push(&mut self, reason: Reason) {
        if self.len < MOST {
            self.list[self.len] = reason;
            self.len += 1;
        }
    }

    /// Whether one of them forbids the change.
    pub fn refuse(&self) -> bool {
        self.iter().any(|reason| reason.cause.refuses())
    }
}

impl Deref for Reasons {
    type Target = [Reason];

    fn deref(&self) -> &[Reason] {
        &self.list[..self.len]
    }
}

impl PartialEq for Reasons {
    fn eq(&self, other: &Self) -> bool {
        self[..] == other[..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_speak_and_stay_bounded() {
        let reason = Reason::new(Cause::OutOfLimits(Parameter::K), -61.23456, -60.0);
        assert_eq!(reason.to_string(), "K is -61.23, beyond its limit -60");
        assert_eq!((reason.note().code, reason.note().measured), ("A02", Some(-61.23456)));
        let reason = Reason::new(Cause::OutOfLimits(Parameter::K), -6.0, f64::MIN_POSITIVE);
        assert_eq!(reason.to_string(), "K is -6, must be positive");
        let mut reasons = Reasons::default();
        (0..40).for_each(|_| reasons.push(reason));
        assert_eq!(reasons.len(), MOST);
    }

    #[test]
    fn a_large_change_alone_does_not_refuse() {
        let mut reasons = Reasons::default();
        reasons.push(Reason::new(Cause::LargeChange(Parameter::Kp), 7.0, 2.0));
        assert!(!reasons.refuse());
    }
}
