//! A controller as it is entered on a faceplate: form, units, filter, sign, weights and digits of its settings.
//!
//! The settings are those of the exact conversion into the faceplate's form. What the faceplate decides itself
//! then takes the place of the design's: a filter that is a fixed share of `Td`, fixed set-point weights, the
//! digits it keeps. Reading the faceplate back gives the controller that will run.
//!
//! A series controller whose lead acts on y alone, `Kp' (b' + 1/(Ti' s)) r`, has `b = b' Kp' / Kp` and `c = 0`.

use super::{Form, Refused, Scale, Settings, d_filter, from_form, no_span, span, to_form};
use crate::error::{Error, Result};
use crate::model::{Filter, Pid};
use crate::note::{Note, Place, rounded};

/// What a setting says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Gain of the form.
    Kp,
    /// Proportional band, 100 % over the gain.
    Pb,
    /// Integral time.
    Ti,
    /// Integral gain.
    Ki,
    /// Derivative time.
    Td,
    /// Derivative gain.
    Kd,
    /// Filter time.
    Tf,
    /// Filter time over derivative time.
    Alpha,
    /// Derivative time over filter time.
    N,
    /// Set-point weight on P.
    B,
    /// Set-point weight on D.
    C,
    /// A constant that changes nothing at its fixed value.
    Constant,
}

/// The unit of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A number, a gain or percent.
    One,
    /// Seconds.
    Second,
    /// Minutes.
    Minute,
    /// Per second, or repeats per second.
    PerSecond,
    /// Per minute, or repeats per minute.
    PerMinute,
    /// Sample times.
    Sample,
    /// Per sample.
    PerSample,
}

/// Digits that a setting keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// Significant digits.
    Digits(usize),
    /// Digits behind the point.
    Decimals(usize),
}

/// What a gain in u/y is multiplied by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GainScale {
    /// 1.
    Engineering,
    /// `100 / op_span`: percent of output per unit of y; without a span u is in percent.
    Output,
    /// `pv_span / op_span`: percent per percent.
    Span,
}

/// One setting of a faceplate.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Its name there; empty for what is built in.
    pub name: String,
    /// What it says.
    pub quantity: Quantity,
    /// In which unit.
    pub unit: Unit,
    /// To which digits.
    pub rounding: Rounding,
    /// Its value, where it is not ours to choose.
    pub fixed: Option<f64>,
    /// Its value where the controller leaves it open.
    pub default: Option<f64>,
    /// The value that means no integral action.
    pub off: Option<f64>,
    /// Lowest and highest value.
    pub range: Option<(f64, f64)>,
}

/// A controller's way to be set.
#[derive(Clone, Debug, PartialEq)]
pub struct Faceplate {
    /// Its form: ideal, parallel or series.
    pub form: Form,
    /// What its gains are scaled by.
    pub gain: GainScale,
    /// Whether a gain may be negative; else the sign is the action, direct or reverse.
    pub signed: bool,
    /// Its settings.
    pub settings: Vec<Setting>,
}

/// A controller as entered.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// One value per setting, rounded.
    pub values: Vec<f64>,
    /// Whether the output rises with y: a negative gain.
    pub direct: bool,
    /// The controller that these values make.
    pub controller: Pid,
    /// The same before rounding.
    pub unrounded: Pid,
    /// Where it departs from the design: filter (P02), weights (P03), range (P04).
    pub notes: Vec<Note>,
}

/// Enters a controller on a faceplate; `digits` are significant digits to keep instead of its own.
pub fn enter(
    pid: &Pid,
    faceplate: &Faceplate,
    pv_span: Option<f64>,
    op_span: Option<f64>,
    digits: Option<usize>,
) -> std::result::Result<Entry, Refused> {
    pid.check()?;
    check_faceplate(faceplate)?;
    check_samples(pid, faceplate)?;
    let scale = Scale { gain: gain_scale(faceplate.gain, pv_span, op_span)?, time: 1.0 };
    let direct = pid.Kp < 0.0 || pid.Ki < 0.0;
    let sign = if direct && !faceplate.signed { -1.0 } else { 1.0 };
    // What is entered filters D alone.
    let unsigned =
        Pid { Kp: sign * pid.Kp, Ki: sign * pid.Ki, Tf: d_filter(pid), filter: Filter::D1, ..*pid };

    let design = to_form(&unsigned, faceplate.form, &scale).map_err(|refused| refused.times(sign))?;
    let settings = faceplate.own_filter(design);
    let exact = faceplate.show(settings, &unsigned)?;
    let mut values = exact.clone();
    for (value, setting) in values.iter_mut().zip(&faceplate.settings) {
        *value = setting.round(*value, digits)?;
    }
    let signed = |p: Pid| Pid { Kp: sign * p.Kp, Ki: sign * p.Ki, ..p };
    let unrounded = signed(faceplate.read(&exact, &unsigned, &scale)?);
    let controller = signed(faceplate.read(&values, &unsigned, &scale)?);

    let mut notes = faceplate.out_of_range(&values);
    notes.extend(other_filter(pid, design, settings));
    notes.extend(other_weights(pid, &unrounded));
    Ok(Entry { values, direct, controller, unrounded, notes })
}

impl Faceplate {
    /// The form's settings with the filter time that the faceplate gives them.
    fn own_filter(&self, settings: Settings) -> Settings {
        let Td = self.own_Td(settings);
        let [a, b, c, Tf] = settings;
        let Tf = match self.of_filter() {
            None => 0.0,
            _ if Td == 0.0 => 0.0,
            Some(setting) => match setting.quantity {
                Quantity::Tf => setting.of_unit(setting.chosen(setting.in_unit(Tf, None), Tf == 0.0), None),
                Quantity::Alpha => setting.chosen(Tf / Td, Tf == 0.0) * Td,
                _ => Td / setting.chosen(Td / Tf, Tf == 0.0),
            },
        };
        [a, b, c, Tf]
    }

    /// The setting that decides on the filter.
    fn of_filter(&self) -> Option<&Setting> {
        let filters = [Quantity::Tf, Quantity::Alpha, Quantity::N];
        self.settings.iter().find(|setting| filters.contains(&setting.quantity))
    }

    /// Derivative time, s, also of independent gains.
    fn own_Td(&self, [gain, _, third, _]: Settings) -> f64 {
        if self.form == Form::Parallel && third != 0.0 { third / gain } else { third }
    }

    /// The values that stand on the faceplate.
    fn show(&self, settings: Settings, pid: &Pid) -> Result<Vec<f64>> {
        let [gain, second, third, Tf] = settings;
        let Td = self.own_Td(settings);
        let value = |setting: &Setting| match (setting.fixed, setting.quantity) {
            (Some(fixed), _) => Ok(fixed),
            (_, Quantity::Ti) if second.is_infinite() => setting.integral_off(),
            (_, Quantity::Ti | Quantity::Ki) => Ok(setting.in_unit(second, pid.Ts)),
            (_, Quantity::Kp) => Ok(gain),
            (_, Quantity::Pb) if gain == 0.0 => Err(Error::argument("Kp", 0.0, "a gain, to have a band")),
            (_, Quantity::Pb) => Ok(100.0 / gain),
            (_, Quantity::Td | Quantity::Kd) => Ok(setting.in_unit(third, pid.Ts)),
            (_, Quantity::Tf) => Ok(setting.in_unit(Tf, pid.Ts)),
            (_, Quantity::Alpha | Quantity::N) if Td == 0.0 => Ok(setting.default.unwrap_or(0.0)),
            (_, Quantity::Alpha) => Ok(Tf / Td),
            (_, Quantity::N) => Ok(Td / Tf),
            (_, Quantity::B) => Ok(pid.b),
            (_, Quantity::C) => Ok(pid.c),
            (_, Quantity::Constant) => Ok(setting.default.unwrap_or(1.0)),
        };
        self.settings.iter().map(value).collect()
    }

    /// The controller that values on the faceplate make.
    fn read(&self, values: &[f64], design: &Pid, scale: &Scale) -> Result<Pid> {
        let mut settings = [0.0, if self.form == Form::Parallel { 0.0 } else { f64::INFINITY }, 0.0, 0.0];
        let mut rest = *design;
        for (setting, &value) in self.settings.iter().zip(values) {
            let seconds = setting.of_unit(value, design.Ts);
            match setting.quantity {
                Quantity::Kp => settings[0] = value,
                Quantity::Pb => settings[0] = 100.0 / value,
                Quantity::Ti if setting.off == Some(value) => settings[1] = f64::INFINITY,
                Quantity::Ti | Quantity::Ki => settings[1] = seconds,
                Quantity::Td | Quantity::Kd => settings[2] = seconds,
                Quantity::Tf => settings[3] = seconds,
                Quantity::B => rest.b = value,
                Quantity::C => rest.c = value,
                Quantity::Alpha | Quantity::N | Quantity::Constant => {}
            }
        }
        let Td = self.own_Td(settings);
        for (setting, &value) in self.settings.iter().zip(values) {
            match setting.quantity {
                Quantity::Alpha => settings[3] = value * Td,
                Quantity::N => settings[3] = Td / value,
                _ => {}
            }
        }
        if Td == 0.0 {
            settings[3] = 0.0;
        }
        let pid = from_form(self.form, settings, &rest, scale)?;
        let lead_on_y = self.form == Form::Series && rest.c == 0.0 && pid.Kp != 0.0;
        let b = if lead_on_y { rest.b * settings[0] / (scale.gain * pid.Kp) } else { rest.b };
        Ok(Pid { b, ..pid })
    }

    fn out_of_range(&self, values: &[f64]) -> Vec<Note> {
        let outside = |(setting, &value): (&Setting, &f64)| {
            let (low, high) = setting.range?;
            let inside = (low..=high).contains(&value) || setting.off == Some(value);
            (!inside).then(|| {
                let text =
                    format!("{} is {}, the controller takes {low} to {high}", setting.name, rounded(value));
                Note::warning("P04", text)
                    .at(Place::column(&setting.name))
                    .measured(value, if value < low { low } else { high })
                    .remedy("design for what can be entered, and judge it by its margins")
            })
        };
        self.settings.iter().zip(values).filter_map(outside).collect()
    }
}

impl Setting {
    /// A share of the filter, or a filter time, as the faceplate can have it; `open` where the design has none.
    fn chosen(&self, wish: f64, open: bool) -> f64 {
        let wish = self.default.filter(|_| open).unwrap_or(wish);
        let (low, high) = self.range.unwrap_or((0.0, f64::INFINITY));
        self.fixed.unwrap_or(wish.clamp(low, high))
    }

    /// Seconds in its unit of time.
    fn seconds(&self, Ts: Option<f64>) -> f64 {
        match self.unit {
            Unit::Minute | Unit::PerMinute => 60.0,
            Unit::Sample | Unit::PerSample => Ts.unwrap_or(1.0),
            Unit::One | Unit::Second | Unit::PerSecond => 1.0,
        }
    }

    fn is_rate(&self) -> bool {
        matches!(self.unit, Unit::PerSecond | Unit::PerMinute | Unit::PerSample)
    }

    /// A time in seconds, or an integral gain per second, in its unit; a time may be asked for in repeats.
    fn in_unit(&self, x: f64, Ts: Option<f64>) -> f64 {
        match (self.is_rate(), self.quantity) {
            (true, Quantity::Ki) => x * self.seconds(Ts),
            (true, _) => self.seconds(Ts) / x,
            (false, _) => x / self.seconds(Ts),
        }
    }

    /// The inverse of `in_unit`.
    fn of_unit(&self, value: f64, Ts: Option<f64>) -> f64 {
        match (self.is_rate(), self.quantity) {
            (true, Quantity::Ki) => value / self.seconds(Ts),
            (true, _) => self.seconds(Ts) / value,
            (false, _) => value * self.seconds(Ts),
        }
    }

    /// The value that switches the integral off.
    fn integral_off(&self) -> Result<f64> {
        match self.off {
            Some(off) => Ok(off),
            None if self.is_rate() => Ok(0.0),
            None => {
                Err(Error::argument("Ti", "inf", "finite: no value of this setting means no integral action"))
            }
        }
    }

    /// The value that is kept.
    fn round(&self, value: f64, digits: Option<usize>) -> Result<f64> {
        if self.fixed.is_some() || !value.is_finite() {
            return Ok(value);
        }
        let kept = match digits.map_or(self.rounding, Rounding::Digits) {
            Rounding::Digits(n) => format!("{value:.*e}", n.max(1) - 1),
            Rounding::Decimals(n) => format!("{value:.n$}"),
        };
        let kept = kept.parse().unwrap_or(value);
        let needed = matches!(self.quantity, Quantity::Kp | Quantity::Pb | Quantity::Ti | Quantity::Ki);
        if kept == 0.0 && value != 0.0 && needed {
            let text = format!("{} is {}, which its digits round to 0", self.name, rounded(value));
            return Err(Error::new("U01", text)
                .at(Place::column(&self.name))
                .remedy("give digits=, or a range of the controller in which it is larger"));
        }
        Ok(kept)
    }
}

fn gain_scale(kind: GainScale, pv_span: Option<f64>, op_span: Option<f64>) -> Result<f64> {
    match kind {
        GainScale::Engineering => Ok(1.0),
        GainScale::Output => Ok(100.0 / span("op_span", op_span.unwrap_or(100.0))?),
        GainScale::Span => match (pv_span, op_span) {
            (Some(pv), Some(op)) => Ok(span("pv_span", pv)? / span("op_span", op)?),
            (None, _) => Err(no_span("pv_span")),
            _ => Err(no_span("op_span")),
        },
    }
}

fn check_faceplate(faceplate: &Faceplate) -> Result<()> {
    match faceplate.form {
        Form::Ideal | Form::Parallel | Form::Series => Ok(()),
        other => Err(Error::argument("form", other.name(), "ideal, parallel or series on a faceplate")),
    }
}

fn check_samples(pid: &Pid, faceplate: &Faceplate) -> Result<()> {
    let sampled = |s: &Setting| matches!(s.unit, Unit::Sample | Unit::PerSample);
    if pid.Ts.is_none() && faceplate.settings.iter().any(sampled) {
        return Err(Error::argument("Ts", "missing", "given: the settings count in samples"));
    }
    Ok(())
}

/// P02 where the controller filters otherwise than the design.
fn other_filter(pid: &Pid, design: Settings, entered: Settings) -> Option<Note> {
    if pid.filter == Filter::Y2 && pid.Tf > 0.0 {
        let text = format!("the design filters y with Tf = {} s; these settings do not", rounded(pid.Tf));
        return Some(
            Note::warning("P02", text).remedy("set a filter of second order on the measurement itself"),
        );
    }
    let (wished, own) = (design[3], entered[3]);
    if (own - wished).abs() <= 1e-9 * wished.max(own) || entered[2] == 0.0 {
        return None;
    }
    let text =
        format!("the controller filters D with {} s, the design with {} s", rounded(own), rounded(wished));
    Some(
        Note::warning("P02", text)
            .measured(own, wished)
            .remedy("judge it by the margins of what was entered, or design with this filter"),
    )
}

/// P03 where the set point acts otherwise than in the design.
fn other_weights(pid: &Pid, entered: &Pid) -> Option<Note> {
    let differ = |a: f64, b: f64| (a - b).abs() > 1e-9;
    let on_D = entered.Td > 0.0 && differ(pid.c, entered.c);
    if !differ(pid.b, entered.b) && !on_D {
        return None;
    }
    let text = format!(
        "the set point acts with b = {}, c = {}, in the design with {}, {}",
        rounded(entered.b),
        rounded(entered.c),
        rounded(pid.b),
        rounded(pid.c)
    );
    Some(Note::info("P03", text).remedy("expect another set-point response; loads are answered alike"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(name: &str, quantity: Quantity, unit: Unit) -> Setting {
        Setting {
            name: name.to_owned(),
            quantity,
            unit,
            rounding: Rounding::Digits(17),
            fixed: None,
            default: None,
            off: None,
            range: None,
        }
    }

    fn ideal() -> Pid {
        Pid { Td: 5.0 / 3.0, ..Pid::pi(-2.4, 12.0) }
    }

    fn faceplate(form: Form, settings: Vec<Setting>) -> Faceplate {
        Faceplate { form, gain: GainScale::Span, signed: false, settings }
    }

    #[test]
    fn a_negative_gain_is_an_action_and_times_have_their_units() {
        let face = faceplate(
            Form::Parallel,
            vec![
                setting("P", Quantity::Kp, Unit::One),
                setting("I", Quantity::Ki, Unit::PerMinute),
                setting("D", Quantity::Kd, Unit::Minute),
            ],
        );
        let entry = enter(&ideal(), &face, Some(200.0), Some(100.0), None).expect("an entry");
        assert!(entry.direct);
        for (found, expected) in entry.values.iter().zip([4.8, 24.0, 2.0 / 15.0]) {
            assert!((found / expected - 1.0).abs() < 1e-14, "{found}");
        }
        assert!((entry.controller.Kp + 2.4).abs() < 1e-14 && (entry.controller.Ti() - 12.0).abs() < 1e-12);
        assert_eq!(enter(&ideal(), &face, None, None, None).expect_err("a refusal").error.code(), "U01");
    }

    #[test]
    fn a_built_in_filter_takes_the_place_of_the_designs() {
        let filter = Setting { fixed: Some(0.1), ..setting("", Quantity::Alpha, Unit::One) };
        let face = faceplate(
            Form::Series,
            vec![
                setting("PB", Quantity::Pb, Unit::One),
                setting("reset", Quantity::Ti, Unit::PerMinute),
                setting("rate", Quantity::Td, Unit::Second),
                filter,
            ],
        );
        let entry = enter(&ideal(), &face, Some(1.0), Some(1.0), None).expect("an entry");
        for (found, expected) in entry.values.iter().zip([50.0, 6.0, 2.0, 0.1]) {
            assert!((found / expected - 1.0).abs() < 1e-14, "{found}");
        }
        assert!((entry.controller.Tf - 0.2).abs() < 1e-14);
        // Ti = Ti' + Td' - Tf' of the entered controller.
        assert!((entry.controller.Ti() - 11.8).abs() < 1e-12);
        let codes: Vec<_> = entry.notes.iter().map(|n| n.code).collect();
        assert_eq!(codes, ["P02", "P03"]);
    }

    #[test]
    fn what_rounds_to_nothing_is_refused() {
        let mut time = setting("I", Quantity::Ti, Unit::Minute);
        time.rounding = Rounding::Decimals(1);
        let face = faceplate(Form::Ideal, vec![setting("P", Quantity::Kp, Unit::One), time]);
        let fast = Pid::pi(1.0, 2.0);
        let entered = |digits| enter(&fast, &face, Some(1.0), Some(1.0), digits);
        assert_eq!(entered(None).expect_err("a refusal").error.code(), "U01");
        assert!(entered(Some(2)).is_ok());
    }
}
