//! Whether a record is sampled at a rate that suits its time constant (M09).
//!
//! A sample time beyond half the time constant leaves hardly a row of the transient: the fit rests on a
//! guess of what happens between the rows, and its controller cannot act in time. So a `T` that lies
//! below `Ts / M09` with its whole 95 % interval is refused, and one whose interval reaches there is
//! doubtful. A sample time below a thousandth of `T` puts every pole next to 1, where `1 - a` has lost
//! its digits.

use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::note::{Note, Place, rounded};

/// Least sample time as a share of the time constant.
const FASTEST: f64 = 1e-3;

/// Sample time proposed, as a share of the time constant.
const PROPOSED: f64 = 0.1;

/// Refuses a time constant clearly too short for `Ts`; a note where it may be, or is very long.
/// `upper` is the upper end of the interval of `T`.
pub fn sampling(T: f64, upper: f64, Ts: f64, limits: &Limits) -> Result<Option<Note>> {
    let place = Place::column("Ts");
    let remedy = format!("record with Ts = {} s, a tenth of T", rounded(PROPOSED * T));
    if Ts > limits.M09 * T {
        let short = format!("T = {} s is short against Ts = {Ts} s", rounded(T));
        return if Ts > limits.M09 * upper {
            let text = format!("sampled too slowly: {short}");
            Err(Error::new("M09", text).at(place).measured(Ts / T, limits.M09).remedy(remedy))
        } else {
            let text = format!("{short}: sampled too slowly, or the plant is not first order");
            Ok(Some(Note::warning("M09", text).at(place).measured(Ts / T, limits.M09).remedy(remedy)))
        };
    }
    let text = format!("sampled too fast: Ts = {Ts} s, T = {} s: poles clustered at 1", rounded(T));
    let fast = Note::warning("M09", text).at(place).measured(Ts / T, FASTEST).remedy(remedy);
    Ok((Ts < FASTEST * T).then_some(fast))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(T: f64, upper: f64) -> &'static str {
        match sampling(T, upper, 1.0, &Limits::default()) {
            Err(error) => error.code(),
            Ok(Some(_)) => "doubt",
            Ok(None) => "fine",
        }
    }

    #[test]
    fn the_interval_decides() {
        let slow = [said(0.6, 0.7), said(0.6, 2.5), said(1.9, 1.95), said(1.9, 2.1)];
        assert_eq!(slow, ["M09", "doubt", "M09", "doubt"]);
        let others = [said(2.1, 2.2), said(5.0, 5.0), said(999.0, 999.0), said(1001.0, 1001.0)];
        assert_eq!(others, ["fine", "fine", "fine", "doubt"]);
    }
}
