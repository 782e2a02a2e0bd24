//! One PID controller in the forms that texts and controllers write it in, exact with its filter:
//!
//! ```text
//! ideal      Kp (1 + 1/(Ti s) + Td s / (Tf s + 1))            standard form, as `Pid`
//! parallel   Kp + Ki / s + Kd s / (Tf s + 1)
//! series     Kp (1 + 1/(Ti s)) (Td s + 1) / (Tf s + 1)        interacting; the filter closes the lead
//! pb         ideal, with the proportional band PB = 100 % / Kp
//! velocity   du = d du₋₁ + q0 e + q1 e₋₁ + q2 e₋₂             sampled, incremental
//! ```
//!
//! A filter on y stands before all of these, and D has none: `Tf` is then that of y, and 0 above.
//! The first four hold for a sampled controller as well, with `s = (1 - z^-1) / Ts`.
//! Gains may be scaled to percent of span, `Kp pv_span / op_span`, and times counted in minutes.
//! The set-point weights `b` and `c` are those of the standard form's P and D in every form.
//! K. J. Åström and T. Hägglund, Advanced PID Control, ISA (2006), ch. 3; the algebra with filters is ours.

mod faceplate;
mod series;
mod velocity;

pub use faceplate::{Entry, Faceplate, GainScale, Quantity, Rounding, Setting, Unit, enter};
pub use series::Nearest;

use crate::error::{Error, Result};
use crate::model::{Filter, Pid};
use crate::note::Place;

/// How a controller is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Standard, ISA: `Kp Ti Td Tf`.
    Ideal,
    /// Independent gains: `Kp Ki Kd Tf`.
    Parallel,
    /// Interacting: `Kp Ti Td Tf`.
    Series,
    /// Proportional band in percent: `PB Ti Td Tf`.
    Pb,
    /// Increments of a sampled controller: `q0 q1 q2 d`.
    Velocity,
}

/// Units of the settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// What a gain in u/y is multiplied by: `pv_span / op_span` for percent of span.
    pub gain: f64,
    /// Seconds in the unit of time: 1, or 60 for minutes.
    pub time: f64,
}

/// The four settings of a form, in its order.
pub type Settings = [f64; 4];

/// A conversion that is not possible; with the controller of that form which comes nearest, if one does.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// Why.
    pub error: Error,
    /// What to take instead.
    pub nearest: Option<Nearest>,
}

impl From<Error> for Refused {
    fn from(error: Error) -> Self {
        Refused { error, nearest: None }
    }
}

impl Refused {
    /// The same with the gain of the nearest times `sign`.
    fn times(mut self, sign: f64) -> Self {
        if let Some(nearest) = &mut self.nearest {
            nearest.settings[0] *= sign;
        }
        self
    }
}

impl Scale {
    /// Gains in u/y, times in seconds.
    pub const PLAIN: Scale = Scale { gain: 1.0, time: 1.0 };

    /// Percent of both spans where these are given, and minutes where these are wanted.
    pub fn new(pv_span: Option<f64>, op_span: Option<f64>, minutes: bool) -> Result<Self> {
        let time = if minutes { 60.0 } else { 1.0 };
        let gain = match (pv_span, op_span) {
            (None, None) => 1.0,
            (Some(pv), Some(op)) => span("pv_span", pv)? / span("op_span", op)?,
            (Some(_), None) => return Err(no_span("op_span")),
            (None, Some(_)) => return Err(no_span("pv_span")),
        };
        Ok(Scale { gain, time })
    }
}

fn no_span(name: &str) -> Error {
    Error::new("U01", format!("`{name}` is missing: percent of span needs both spans"))
        .at(Place::column(name))
        .remedy("give pv_span and op_span, high end less low end, in the units of the model")
}

/// A span as given.
fn span(name: &str, span: f64) -> Result<f64> {
    if span.is_finite() && span > 0.0 {
        return Ok(span);
    }
    Err(Error::argument(name, span, "positive, high end less low end"))
}

impl Form {
    /// Its letters, in order.
    pub fn letters(self) -> [&'static str; 4] {
        match self {
            Form::Ideal | Form::Series => ["Kp", "Ti", "Td", "Tf"],
            Form::Parallel => ["Kp", "Ki", "Kd", "Tf"],
            Form::Pb => ["PB", "Ti", "Td", "Tf"],
            Form::Velocity => ["q0", "q1", "q2", "d"],
        }
    }

    /// Its word.
    pub fn name(self) -> &'static str {
        match self {
            Form::Ideal => "ideal",
            Form::Parallel => "parallel",
            Form::Series => "series",
            Form::Pb => "pb",
            Form::Velocity => "velocity",
        }
    }
}

/// The settings of a controller in a form; U01 where it has none there.
pub fn to_form(pid: &Pid, form: Form, scale: &Scale) -> std::result::Result<Settings, Refused> {
    pid.check()?;
    let settings = match form {
        Form::Parallel => [pid.Kp, pid.Ki, pid.Kd(), pid.Tf],
        Form::Velocity => velocity::of_pid(pid)?,
        _ if pid.Kp == 0.0 && pid.Ki != 0.0 => return Err(only_integral(form).into()),
        Form::Ideal => [pid.Kp, pid.Ti(), pid.Td, pid.Tf],
        Form::Pb if pid.Kp == 0.0 => return Err(Error::argument("Kp", 0.0, "a gain, to have a band").into()),
        Form::Pb => [100.0 / pid.Kp, pid.Ti(), pid.Td, pid.Tf],
        Form::Series => series::of_pid(pid).map_err(|nearest| {
            let nearest = Nearest { settings: scaled(nearest.settings, form, scale), ..nearest };
            Refused { error: series::refusal(pid, &nearest), nearest: Some(nearest) }
        })?,
    };
    Ok(scaled(settings, form, scale))
}

/// The controller that settings of a form make; `rest` has its weights, filter and sample time.
pub fn from_form(form: Form, settings: Settings, rest: &Pid, scale: &Scale) -> Result<Pid> {
    check_letters(form, &settings)?;
    let inverse = Scale { gain: 1.0 / scale.gain, time: 1.0 / scale.time };
    let settings = scaled(settings, form, &inverse);
    let [gain, second, third, Tf] = settings;
    let ideal = |Kp| Pid { Kp, Ki: Kp / second, Td: third, Tf, ..*rest };
    let pid = match form {
        Form::Ideal => ideal(gain),
        Form::Pb => ideal(100.0 / gain),
        Form::Parallel if gain == 0.0 && third != 0.0 => {
            return Err(Error::argument("Kp", 0.0, "a gain beside Kd: no standard form has D alone"));
        }
        Form::Parallel => {
            Pid { Kp: gain, Ki: second, Td: if third == 0.0 { 0.0 } else { third / gain }, Tf, ..*rest }
        }
        Form::Series => series::to_pid(settings, rest)?,
        Form::Velocity => velocity::to_pid(settings, rest)?,
    };
    pid.check()?;
    Ok(pid)
}

/// Settings in other units: gains times `scale.gain`, times over `scale.time`.
fn scaled([a, b, c, d]: Settings, form: Form, &Scale { gain, time }: &Scale) -> Settings {
    match form {
        Form::Ideal | Form::Series => [a * gain, b / time, c / time, d / time],
        Form::Pb => [a / gain, b / time, c / time, d / time],
        Form::Parallel => [a * gain, b * gain * time, c * gain / time, d / time],
        Form::Velocity => [a * gain, b * gain, c * gain, d],
    }
}

/// Settings must be numbers of the kind that their letters say.
fn check_letters(form: Form, settings: &Settings) -> Result<()> {
    for (name, &value) in form.letters().into_iter().zip(settings) {
        let (fine, needed) = match name {
            "Ti" => (value > 0.0, "positive, or inf"),
            "Td" | "Tf" => (value.is_finite() && value >= 0.0, "zero or positive"),
            "PB" => (value.is_finite() && value != 0.0, "a band, not zero"),
            "d" => ((0.0..1.0).contains(&value), "in [0, 1)"),
            _ => (value.is_finite(), "finite"),
        };
        if !fine {
            return Err(Error::argument(name, value, needed));
        }
    }
    Ok(())
}

/// Filter time of the derivative.
fn d_filter(pid: &Pid) -> f64 {
    if pid.filter == Filter::D1 { pid.Tf } else { 0.0 }
}

fn only_integral(form: Form) -> Error {
    Error::new("U01", format!("an integral controller has no {} form: its gain Kp is 0", form.name()))
        .remedy("take the parallel form, which has Ki")
}

#[cfg(test)]
mod tests {
    use super::*;

    const VECTOR: [(Form, Settings); 4] = [
        (Form::Series, [2.0, 10.0, 2.0, 0.0]),
        (Form::Ideal, [2.4, 12.0, 5.0 / 3.0, 0.0]),
        (Form::Parallel, [2.4, 0.2, 4.0, 0.0]),
        (Form::Pb, [125.0 / 3.0, 12.0, 5.0 / 3.0, 0.0]),
    ];

    fn close(a: Settings, b: Settings) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-14 * b.abs())
    }

    #[test]
    fn each_form_of_one_controller_becomes_each_other() {
        for (from, settings) in VECTOR {
            let pid = from_form(from, settings, &Pid::pi(1.0, 1.0), &Scale::PLAIN).expect("a controller");
            for (to, expected) in VECTOR {
                let found = to_form(&pid, to, &Scale::PLAIN).expect("settings");
                assert!(close(found, expected), "{from:?} to {to:?}: {found:?}");
            }
        }
    }

    #[test]
    fn minutes_and_spans_scale_each_letter() {
        let pid =
            from_form(Form::Ideal, VECTOR[1].1, &Pid::pi(1.0, 1.0), &Scale::PLAIN).expect("a controller");
        let scale = Scale::new(Some(200.0), Some(50.0), true).expect("a scale");
        let of = |form| to_form(&pid, form, &scale).expect("settings");
        assert!(close(of(Form::Ideal), [9.6, 0.2, 1.0 / 36.0, 0.0]));
        assert!(close(of(Form::Parallel), [9.6, 48.0, 4.0 / 15.0, 0.0]));
        assert!(close(of(Form::Pb), [125.0 / 12.0, 0.2, 1.0 / 36.0, 0.0]));
    }

    #[test]
    fn what_no_form_can_say_is_refused() {
        let integral = Pid { Kp: 0.0, Ki: 0.5, ..Pid::pi(1.0, 1.0) };
        for form in [Form::Ideal, Form::Series, Form::Pb] {
            assert_eq!(to_form(&integral, form, &Scale::PLAIN).expect_err("a refusal").error.code(), "U01");
        }
        let whole = to_form(&integral, Form::Parallel, &Scale::PLAIN).expect("settings");
        assert_eq!(
            from_form(Form::Parallel, whole, &integral, &Scale::PLAIN).expect("a controller"),
            integral
        );
        for (form, settings) in [
            (Form::Ideal, [1.0, 0.0, 0.0, 0.0]),
            (Form::Pb, [0.0, 1.0, 0.0, 0.0]),
            (Form::Parallel, [0.0, 1.0, 1.0, 0.0]),
            (Form::Parallel, [1.0, -1.0, 0.0, 0.0]),
            (Form::Series, [1.0, 2.0, 0.1, 0.5]),
        ] {
            let refused = from_form(form, settings, &integral, &Scale::PLAIN);
            assert_eq!(refused.expect_err("a refusal").code(), "U01", "{form:?} {settings:?}");
        }
        assert!(Scale::new(Some(100.0), None, false).is_err());
        assert!(Scale::new(Some(100.0), Some(0.0), false).is_err());
    }
}
