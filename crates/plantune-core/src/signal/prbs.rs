//! Pseudo-random binary sequence of maximum length from a feedback shift register.

use crate::error::{Error, Result};

/// Feedback taps that give the maximum length `2^bits - 1`, for 3 to 20 bits
/// (Golomb, Shift Register Sequences, 1967).
const TAPS: [(u32, u32); 18] = [
    (3, 0x6),
    (4, 0xC),
    (5, 0x14),
    (6, 0x30),
    (7, 0x60),
    (8, 0xB8),
    (9, 0x110),
    (10, 0x240),
    (11, 0x500),
    (12, 0xE08),
    (13, 0x1C80),
    (14, 0x3802),
    (15, 0x6000),
    (16, 0xD008),
    (17, 0x12000),
    (18, 0x20400),
    (19, 0x72000),
    (20, 0x90000),
];

/// `n` rows of -1 and +1, each value held for `hold` rows; the seed picks the start of the sequence.
pub fn prbs(n: usize, hold: usize, bits: u32, seed: u64) -> Result<Vec<f64>> {
    if hold == 0 {
        return Err(Error::argument("hold", 0, "at least 1"));
    }
    let Some(&(_, taps)) = TAPS.iter().find(|(b, _)| *b == bits) else {
        return Err(Error::argument("bits", bits, "from 3 to 20"));
    };
    let length = (1u64 << bits) - 1;
    let mut register = (seed % length + 1) as u32;
    let mut out = Vec::with_capacity(n);
    while out.len() < n {
        let value = if register & 1 == 1 { 1.0 } else { -1.0 };
        let rows = hold.min(n - out.len());
        out.extend(std::iter::repeat_n(value, rows));
        register = (register >> 1) ^ (if register & 1 == 1 { taps } else { 0 });
    }
    Ok(out)
}

/// Fewest bits with which `n` rows do not repeat, 20 at most.
pub fn register_bits(n: usize, hold: usize) -> u32 {
    let longest = |bits: u32| ((1usize << bits) - 1).saturating_mul(hold);
    (3..20).find(|&bits| longest(bits) >= n).unwrap_or(20)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over one period every maximum-length sequence has one more +1 than -1, and repeats only then.
    #[test]
    fn every_register_has_maximum_length() {
        for (bits, _) in TAPS {
            let period = (1usize << bits) - 1;
            let x = prbs(2 * period, 1, bits, 7).expect("a sequence");
            assert_eq!(x[..period].iter().sum::<f64>(), 1.0, "{bits} bits");
            assert_eq!(x[..period], x[period..], "{bits} bits");
        }
    }
}
