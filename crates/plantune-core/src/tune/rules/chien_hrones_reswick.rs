//! Chien-Hrones-Reswick settings for first order plus dead time.
//!
//! ```text
//! a = K L / T            load                              set point
//!                 PI             PID                 PI             PID
//! overshoot 0 %   0.6/a  4 L     0.95/a  2.4 L  0.42 L   0.35/a  1.2 T    0.6/a   T      0.5 L
//! overshoot 20 %  0.7/a  2.3 L   1.2/a   2 L    0.42 L   0.6/a   T        0.95/a  1.4 T  0.47 L
//! ```
//!
//! Each entry is `Kp, Ti` or `Kp, Ti, Td`; `Tf = Td / 10` is ours. K. L. Chien, J. A. Hrones and J. B.
//! Reswick, On the automatic control of generalized passive systems, Trans. ASME 74 (1952). All twelve entries
//! stand so in two independent public copies of the table; others print 2.38 L, 1.16 T and 1.36 T unrounded.
//! The range of `L / T` that the verb notes, 1/9 to 1, is in neither of them. A negative gain gives a negative
//! `Kp`.

use super::{Terms, check_delayed, pid};
use crate::error::Result;
use crate::model::{Fopdt, Model};
use crate::tune::rule::{Found, Rule, Settings};

/// What the loop shall answer well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// A load at the plant input.
    Load,
    /// The set point.
    SetPoint,
}

/// How far the answer may overshoot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overshoot {
    /// Not at all.
    Zero,
    /// By 20 %.
    Twenty,
}

/// Settings; the plant must settle and have a dead time.
pub fn chien_hrones_reswick(
    model: &Model,
    step: Step,
    overshoot: Overshoot,
    terms: Terms,
) -> Result<Settings> {
    Rule::new("Chien-Hrones-Reswick", &|plant| first(plant, step, overshoot, terms)).on(model, None)
}

fn first(&Fopdt { K, T, L }: &Fopdt, step: Step, overshoot: Overshoot, terms: Terms) -> Found {
    use Overshoot::{Twenty, Zero};
    check_delayed(L, "Chien-Hrones-Reswick")?;
    let (Kp, Ti, Td) = match (step, overshoot, terms) {
        (Step::Load, Zero, Terms::Pi) => (0.6, 4.0 * L, 0.0),
        (Step::Load, Zero, Terms::Pid) => (0.95, 2.4 * L, 0.42),
        (Step::Load, Twenty, Terms::Pi) => (0.7, 2.3 * L, 0.0),
        (Step::Load, Twenty, Terms::Pid) => (1.2, 2.0 * L, 0.42),
        (Step::SetPoint, Zero, Terms::Pi) => (0.35, 1.2 * T, 0.0),
        (Step::SetPoint, Zero, Terms::Pid) => (0.6, T, 0.5),
        (Step::SetPoint, Twenty, Terms::Pi) => (0.6, T, 0.0),
        (Step::SetPoint, Twenty, Terms::Pid) => (0.95, 1.4 * T, 0.47),
    };
    Ok((pid(Kp * T / (K * L), Ti, Td * L), f64::NAN))
}
