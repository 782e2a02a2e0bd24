//! A first-order plant with exact dead time under a sampled relay with hysteresis.
//!
//! ```text
//! u(t) = low   once  sign(K) (y(t) - r) >  h
//!        high  once  sign(K) (y(t) - r) < -h
//!        u(t-1)      between
//! y(t+1) = a y(t) + b1 u(t-m) + b2 u(t-m-1) + (1 - a) O      exact, see `model::process`
//! ```
//!
//! The plant rests at the set point until the relay takes over. It switches at sample instants only, so `y`
//! passes the thresholds by what it moves within one sample.

use crate::error::{Error, Result};
use crate::model::{Fopdt, check_fopdt};

/// The relay and what it meets.
#[derive(Clone, Debug)]
pub struct RelaySettings<'s> {
    /// Lower level of u.
    pub low: f64,
    /// Upper level of u.
    pub high: f64,
    /// `h`: y passes the set point by so much before the relay switches, at least 0.
    pub hysteresis: f64,
    /// Sample time, s.
    pub Ts: f64,
    /// Set point.
    pub r: f64,
    /// `O` in `y = G u + O`.
    pub offset: f64,
    /// Rows at rest before the relay takes over.
    pub rest: usize,
    /// Added to each measured output, which the relay reads; as many rows as are wanted.
    pub noise: &'s [f64],
}

/// Input and measured output, one value per row.
pub fn relay(model: &Fopdt, settings: &RelaySettings) -> Result<(Vec<f64>, Vec<f64>)> {
    check_fopdt(model)?;
    check(settings)?;
    let RelaySettings { low, high, hysteresis, Ts, r, offset, rest, noise } = *settings;
    let u0 = (r - offset) / model.K;
    if !(low < u0 && u0 < high) {
        let needed = format!("levels on either side of {u0}, which holds y at r");
        return Err(Error::argument("low, high", format!("({low}, {high})"), &needed));
    }
    let (a, b1, b2, m) = model.sampled(Ts);
    let mut u: Vec<f64> = Vec::with_capacity(noise.len());
    let mut y = Vec::with_capacity(noise.len());
    let (mut x, mut state) = (r - offset, high);
    for (k, e) in noise.iter().enumerate() {
        if k > 0 {
            let lagged = |lag: usize| if k >= lag { u[k - lag] } else { u0 };
            x = a * x + b1 * lagged(m + 1) + b2 * lagged(m + 2);
        }
        y.push(offset + x + e);
        let ahead = model.K.signum() * (y[k] - r);
        if k >= rest && ahead.abs() > hysteresis {
            state = if ahead > 0.0 { low } else { high };
        }
        u.push(if k < rest { u0 } else { state });
    }
    Ok((u, y))
}

fn check(settings: &RelaySettings) -> Result<()> {
    let RelaySettings { low, high, hysteresis, Ts, r, offset, noise, .. } = *settings;
    if !(hysteresis >= 0.0 && hysteresis.is_finite()) {
        return Err(Error::argument("hysteresis", hysteresis, "zero or positive"));
    }
    if !(Ts > 0.0 && Ts.is_finite()) {
        return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
    }
    let named = [("low", low), ("high", high), ("r", r), ("offset", offset)];
    if let Some((name, value)) = named.into_iter().find(|(_, value)| !value.is_finite()) {
        return Err(Error::argument(name, value, "finite"));
    }
    if noise.iter().any(|e| !e.is_finite()) {
        return Err(Error::argument("noise", "not finite", "finite"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANT: Fopdt = Fopdt { K: -2.0, T: 3.0, L: 1.03 };

    fn settings(noise: &[f64]) -> RelaySettings<'_> {
        RelaySettings { low: 0.0, high: 5.0, hysteresis: 0.2, Ts: 0.1, r: 3.0, offset: 7.0, rest: 4, noise }
    }

    /// The output is the plant's own answer to the input that the relay gave.
    #[test]
    fn the_relay_drives_the_plant_that_the_model_simulates() {
        let (u, y) = relay(&PLANT, &settings(&[0.0; 300])).expect("a sound relay");
        // From u0 = 2 on, in changes of u.
        let moves: Vec<f64> = u.iter().map(|u| u - 2.0).collect();
        for (y, x) in y.iter().zip(PLANT.simulate(&moves, 0.1, 0.0)) {
            assert!((y - 3.0 - x).abs() < 1e-12);
        }
        assert_eq!(&u[..5], [2.0, 2.0, 2.0, 2.0, 5.0]);
    }

    #[test]
    fn it_switches_once_the_output_has_passed_a_threshold() {
        let (u, y) = relay(&PLANT, &settings(&[0.0; 300])).expect("a sound relay");
        let mut switches = 0;
        for k in 5..300 {
            let moved = u[k] != u[k - 1];
            switches += usize::from(moved);
            // K < 0: high drives y down, so it ends below r - h.
            let passed = if u[k - 1] == 5.0 { 3.0 - y[k] } else { y[k] - 3.0 };
            assert_eq!(moved, passed > 0.2, "row {k}");
        }
        assert!(switches > 8);
    }

    #[test]
    fn levels_that_cannot_hold_the_set_point_are_refused() {
        let error = relay(&PLANT, &RelaySettings { high: 1.9, ..settings(&[0.0; 3]) }).expect_err("too low");
        assert_eq!(error.note().place.as_ref().map(|p| p.column.as_str()), Some("low, high"));
        let error = relay(&PLANT, &RelaySettings { hysteresis: -1.0, ..settings(&[0.0; 3]) });
        assert_eq!(error.expect_err("negative").code(), "U01");
    }
}
