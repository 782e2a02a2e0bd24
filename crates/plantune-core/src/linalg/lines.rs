//! Memory that begins on a cache line.

use std::ops::{Deref, DerefMut};

/// Numbers in a cache line.
const LINE: usize = 8;

/// Numbers that begin on a cache line: a register that straddles two loads at half speed.
pub struct Lines {
    data: Vec<f64>,
    start: usize,
}

impl Lines {
    /// Zeros.
    pub fn new(len: usize) -> Self {
        let data = vec![0.0; len + LINE];
        let start = data.as_ptr().align_offset(LINE * size_of::<f64>()).min(LINE);
        Lines { data, start }
    }
}

impl Deref for Lines {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.data[self.start..][..self.data.len() - LINE]
    }
}

impl DerefMut for Lines {
    fn deref_mut(&mut self) -> &mut [f64] {
        let len = self.data.len() - LINE;
        &mut self.data[self.start..][..len]
    }
}
