//! The signals of a bank: what is held of them, and when nothing may be learnt from them.
//!
//! A column is the signals of one loop on their way to estimators: of all its delays, or of one.

use super::kernel::Row;

/// What eight columns remember of their signals.
#[derive(Clone, Debug, PartialEq)]
pub struct Inputs {
    /// Origins.
    pub u_zero: Row,
    pub y_zero: Row,
    /// `y(t-1)`.
    pub y_before: Row,
    /// `lambda(t)` of the next sample that is learnt.
    pub lambda: Row,
}

impl Inputs {
    pub const ROWS: usize = 4;

    /// As before the first sample.
    pub fn new(lambda0: f64) -> Self {
        let zero = Row::of(0.0);
        Inputs { u_zero: zero, y_zero: zero, y_before: zero, lambda: Row::of(lambda0) }
    }

    /// The same for one of them.
    pub fn clear(&mut self, slot: usize, lambda0: f64) {
        self.rows_mut().into_iter().zip([0.0, 0.0, 0.0, lambda0]).for_each(|(row, x)| row[slot] = x);
    }

    pub fn rows(&self) -> [&Row; 4] {
        [&self.u_zero, &self.y_zero, &self.y_before, &self.lambda]
    }

    pub fn rows_mut(&mut self) -> [&mut Row; 4] {
        [&mut self.u_zero, &mut self.y_zero, &mut self.y_before, &mut self.lambda]
    }
}

/// What eight columns have behind them, where errors are kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Weight of the next sample in `s2`: 1, 1/2, 1/3 … down to one over its memory.
    pub weight: Row,
    /// Sum of `lambda^k`.
    pub sum: Row,
    /// Sum of `lambda^2k`.
    pub squares: Row,
    /// Largest `|y|`.
    pub travel: Row,
}

impl Default for Window {
    fn default() -> Self {
        let zero = Row::of(0.0);
        Window { weight: Row::of(1.0), sum: zero, squares: zero, travel: zero }
    }
}

impl Window {
    pub const ROWS: usize = 4;

    pub fn rows(&self) -> [&Row; 4] {
        [&self.weight, &self.sum, &self.squares, &self.travel]
    }

    pub fn rows_mut(&mut self) -> [&mut Row; 4] {
        [&mut self.weight, &mut self.sum, &mut self.squares, &mut self.travel]
    }

    /// As before the first sample.
    pub fn clear(&mut self, slot: usize) {
        self.rows_mut()
            .into_iter()
            .zip(Window::default().rows())
            .for_each(|(row, fresh)| row[slot] = fresh[slot]);
    }

    /// The part of `s2 P` that is the covariance.
    pub fn share(&self, slot: usize) -> f64 {
        if self.sum[slot] > 0.0 { self.squares[slot] / self.sum[slot] } else { 1.0 }
    }
}

/// Where a column stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    /// Its loop; none, where a register is not full.
    pub source: Option<usize>,
    /// Samples by which its input is late already when it is stored.
    pub lag: usize,
    /// Whether its first sample has come.
    pub started: bool,
    /// Whether its gate is closed.
    pub gated: bool,
    /// Samples to come that see something unknown.
    pub blind: usize,
    /// Whether the last sample saw something unknown.
    pub was_blind: bool,
    /// Whether its numbers have just overflowed.
    pub broken: bool,
    /// How often they have.
    pub restarts: u32,
}

impl Column {
    pub const NUMBERS: usize = 5;

    pub fn learnt(&self) -> bool {
        self.started && !self.gated && !self.was_blind
    }

    /// What is not fixed by the size of the bank.
    pub fn numbers(&self) -> [f64; 5] {
        let of = |x: bool| f64::from(u8::from(x));
        let Column { started, gated, was_blind, .. } = *self;
        [of(started), of(gated), of(was_blind), self.blind as f64, f64::from(self.restarts)]
    }

    pub fn set_numbers(&mut self, [started, gated, was_blind, blind, restarts]: [f64; 5]) {
        self.started = started != 0.0;
        self.gated = gated != 0.0;
        self.was_blind = was_blind != 0.0;
        self.blind = blind as usize;
        self.restarts = restarts as u32;
    }

    /// Whether it is like any other: started, and learning.
    pub fn plain(&self) -> bool {
        self.started && !self.gated && self.blind == 0 && !self.was_blind
    }
}
