//! Numbers that stand for a missing value: -9999, 65535 and the like (D19).
//!
//! Such a number is one of a list of codes, and lies further from all other values of its column than
//! these lie from each other. A converter that saturates at 32767, or a counter that passes 9999, comes
//! there by steps and is none; nor is a level of an input that has no other two.

use crate::linalg::extent;
use crate::note::Note;
use crate::record::Record;

/// What loggers write for a missing value: nines, and the ends of whole numbers of 16 and 32 bits.
const CODES: [f64; 12] = [
    -9999.0,
    9999.0,
    -999.0,
    999.0,
    -99999.0,
    99999.0,
    65535.0,
    32767.0,
    -32768.0,
    4_294_967_295.0,
    2_147_483_647.0,
    -2_147_483_648.0,
];

/// A code among the values of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sentinel {
    /// Inputs count first, then outputs.
    pub column: usize,
    /// The code.
    pub value: f64,
    /// First row that holds it.
    pub row: usize,
    /// Rows that hold it.
    pub count: usize,
    /// Least and greatest of the other values.
    pub rest: (f64, f64),
}

/// The codes in every input and in the outputs that count.
pub fn sentinels(rec: &Record) -> Vec<Sentinel> {
    let inputs = (0..rec.nu).flat_map(|i| in_column(&rec.input(i), i));
    let counting = |i: usize| -> Vec<f64> {
        (0..rec.N()).map(|k| if rec.is_valid(k, i) { rec.y_at(k, i) } else { f64::NAN }).collect()
    };
    let outputs = (0..rec.ny).flat_map(|i| in_column(&counting(i), rec.nu + i));
    inputs.chain(outputs).collect()
}

/// NaN stands for a row that does not count.
fn in_column(x: &[f64], column: usize) -> Vec<Sentinel> {
    let rest: Vec<f64> = x.iter().copied().filter(|v| v.is_finite() && !CODES.contains(v)).collect();
    let rest = extent(&rest);
    let far = |v: f64| (rest.0 - v).max(v - rest.1) > rest.1 - rest.0 && rest.1 > rest.0;
    CODES
        .iter()
        .filter(|&&value| far(value))
        .filter_map(|&value| {
            let row = x.iter().position(|&v| v == value)?;
            let count = x.iter().filter(|&&v| v == value).count();
            Some(Sentinel { column, value, row, count, rest })
        })
        .collect()
}

/// D19, as an error: the code, where, how often, and how to read the file without it.
pub(super) fn sentinels_note(rec: &Record, s: &Sentinel) -> Note {
    let (low, high) = s.rest;
    let place = rec.place(s.column, s.row);
    let text = format!(
        "`{}` holds {} in {} of {} rows, the rest lies from {low} to {high}: a code for a missing value",
        place.column,
        s.value,
        s.count,
        rec.N()
    );
    Note::error("D19", text)
        .at(place)
        .count(s.count)
        .measured((low - s.value).max(s.value - high), high - low)
        .remedy(format!("read it as missing: read(..., sentinels=({},))", s.value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(x: &[f64]) -> Vec<(f64, usize)> {
        in_column(x, 0).iter().map(|s| (s.value, s.count)).collect()
    }

    #[test]
    fn codes_far_from_the_rest_are_found() {
        let mut x: Vec<f64> = (0..100).map(|k| 20.0 + f64::from(k % 13)).collect();
        (x[3], x[4], x[70]) = (-9999.0, -9999.0, 65535.0);
        assert_eq!(values(&x), [(-9999.0, 2), (65535.0, 1)]);
    }

    #[test]
    fn a_range_that_ends_at_a_code_is_none() {
        let saturated: Vec<f64> = (0..100).map(|k| (1000.0 * f64::from(k)).min(32767.0)).collect();
        let two_levels = [0.0, 65535.0, 0.0, 65535.0];
        let signed = [-32768.0, 32767.0, -32768.0];
        let staircase = [0.0, 16384.0, 32768.0, 49152.0, 65535.0];
        for x in [&saturated[..], &two_levels, &signed, &staircase] {
            assert_eq!(values(x), []);
        }
    }
}
