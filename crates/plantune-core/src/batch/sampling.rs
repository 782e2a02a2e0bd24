//! Whether a record is sampled at a rate that suits its time constant (M09).
//!
//! A sample time beyond half the time constant leaves hardly a row of the transient: the fit rests on a
//! guess of what happens between the rows, and its controller cannot act in time. So a `T` that lies
//! below `Ts / M09` with its whole 95 % interval is refused, and one whose interval reaches beyond is
//! doubtful. A sample time below a thousandth of `T` puts every pole next to 1, where `1 - a` has lost
//! its digits.

use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::note::{Note, Place};
use crate::stats::normal_quantile;

/// Least sample time as a share of the time constant.
const FASTEST: f64 = 1e-3;

/// Sample time proposed, as a share of the time constant.
const PROPOSED: f64 = 0.1;

/// Refuses a time constant that is clearly too short for `Ts`; a note where one may be, or is too long.
pub fn sampling(T: f64, sd: f64, Ts: f64, limits: &Limits) -> Result<Option<Note>> {
    let place = Place::column("Ts");
    let remedy = format!("record with Ts = {:.1e} s, a tenth of T", PROPOSED * T);
    if Ts > limits.M09 * T {
        let text = format!("sampled too slowly: Ts = {Ts:.4} s, T = {T:.4} ± {sd:.2} s");
        if Ts > limits.M09 * (T + normal_quantile(0.95) * sd) {
            return Err(Error::new("M09", text).at(place).measured(Ts / T, limits.M09).remedy(remedy));
        }
        return Ok(Some(Note::warning("M09", text).at(place).measured(Ts / T, limits.M09).remedy(remedy)));
    }
    let text = format!("sampled too fast: Ts = {Ts:.4e} s, T = {T:.4e} s: the poles cluster at 1");
    let fast = Note::warning("M09", text).at(place).measured(Ts / T, FASTEST).remedy(remedy);
    Ok((Ts < FASTEST * T).then_some(fast))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(T: f64, sd: f64) -> &'static str {
        match sampling(T, sd, 1.0, &Limits::default()) {
            Err(error) => error.code(),
            Ok(Some(_)) => "doubt",
            Ok(None) => "fine",
        }
    }

    #[test]
    fn the_interval_decides() {
        assert_eq!(
            [said(0.6, 0.1), said(0.6, 1.0), said(1.9, 0.1), said(1.9, 0.02)],
            ["M09", "doubt", "doubt", "M09"]
        );
        assert_eq!(
            [said(2.1, 1.0), said(5.0, 0.0), said(999.0, 0.0), said(1001.0, 0.0)],
            ["fine", "fine", "fine", "doubt"]
        );
    }
}
