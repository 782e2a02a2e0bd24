//! A cerebellar model (CMAC): a function of one signal, learnt while it is used.
//!
//! ```text
//! step  = floor((s - low)/(high - low) cells layers)         within 0 ... cells layers - 1
//! met   : in layer l the cell floor((step + l)/layers)       layers of cells, each shifted by one step
//! out   = sum of the weights met
//! learn : w += beta (target - out)/layers on those met
//! ```
//!
//! Neighbours share all cells but a few, so that what is learnt in one place holds nearby. There are two tables, for a
//! rising and for a falling signal: a function of the signal alone cannot undo hysteresis. Source 002, 3.3 and figure
//! 3.3; Albus, J. Dynamic Systems, Measurement and Control 97, 1975.
//!
//! Where the target is the whole output of a loop, the table learns the share of an integral controller again and
//! again, and both run away together. A dead zone is the guard: what is left of `target - out` beyond it is learnt.

use crate::error::{Error, Result};

/// Most cells of a table.
const MOST: usize = 10_000_000;

/// Shape and pace of a memory.
#[derive(Clone, Debug, PartialEq)]
pub struct CmacSettings {
    /// Range of the signal.
    pub range: (f64, f64),
    /// Cells in the range.
    pub cells: usize,
    /// Layers.
    pub layers: usize,
    /// Share of the error that is learnt at once, in (0, 1].
    pub beta: f64,
    /// Errors up to this are not learnt, in units of the target.
    pub dead_zone: f64,
}

/// A memory that learns.
#[derive(Clone, Debug)]
pub struct Cmac {
    settings: CmacSettings,
    w: Vec<f64>, // (2, layers, cells + 1)
    /// Signal, table, step and output of the last recall.
    s: f64,
    table: usize,
    step: usize,
    out: f64,
}

impl Cmac {
    /// Nothing learnt yet.
    pub fn new(settings: CmacSettings) -> Result<Self> {
        let CmacSettings { range: (low, high), cells, layers, beta, dead_zone } = settings;
        if !(low < high && low.is_finite() && high.is_finite()) {
            return Err(Error::argument(
                "range",
                format!("({low}, {high})"),
                "two finite numbers, ascending",
            ));
        }
        let size = cells.saturating_add(1).saturating_mul(layers.saturating_mul(2));
        if cells == 0 || layers == 0 || size > MOST {
            let needed = format!("1 or more each, {MOST} weights at most");
            return Err(Error::argument("cells, layers", format!("{cells}, {layers}"), &needed));
        }
        if !(beta > 0.0 && beta <= 1.0) {
            return Err(Error::argument("beta", beta, "in (0, 1]"));
        }
        if !(dead_zone >= 0.0 && dead_zone.is_finite()) {
            return Err(Error::argument("dead_zone", dead_zone, "0 or positive"));
        }
        let w = vec![0.0; size];
        Ok(Cmac { settings, w, s: f64::NAN, table: 0, step: 0, out: 0.0 })
    }

    /// As made.
    pub fn settings(&self) -> &CmacSettings {
        &self.settings
    }

    /// What was learnt for `s`; a signal that stands goes on in its table.
    pub fn recall(&mut self, s: f64) -> f64 {
        let CmacSettings { range: (low, high), cells, layers, .. } = self.settings;
        if s < self.s {
            self.table = 1;
        } else if s > self.s {
            self.table = 0;
        }
        self.s = s;
        let steps = (cells * layers) as f64;
        self.step = ((s - low) / (high - low) * steps).clamp(0.0, steps - 1.0) as usize;
        self.out = (0..layers).map(|layer| self.w[self.place(layer)]).sum();
        self.out
    }

    /// Learns what should have come out of the last `recall`.
    pub fn learn(&mut self, target: f64) {
        let gap = target - self.out;
        let beyond = (gap.abs() - self.settings.dead_zone).max(0.0).copysign(gap);
        let push = self.settings.beta * beyond / self.settings.layers as f64;
        for layer in 0..self.settings.layers {
            let place = self.place(layer);
            self.w[place] += push;
        }
    }

    /// Of the weight met in a layer.
    fn place(&self, layer: usize) -> usize {
        let CmacSettings { cells, layers, .. } = self.settings;
        (self.table * layers + layer) * (cells + 1) + (self.step + layer) / layers
    }

    /// Weights, (2, layers, cells + 1) row-major: rising, falling.
    pub fn w(&self) -> &[f64] {
        &self.w
    }

    /// All that it remembers: signal, table, step and output of the last recall, then the weights.
    pub fn state(&self) -> Vec<f64> {
        let last = [self.s, self.table as f64, self.step as f64, self.out];
        last.into_iter().chain(self.w.iter().copied()).collect()
    }

    /// Goes on from there.
    pub fn resume(&mut self, state: &[f64]) -> Result<()> {
        let steps = self.settings.cells * self.settings.layers;
        match state {
            [s, table, step, out, w @ ..] if w.len() == self.w.len() && *step < steps as f64 => {
                (self.s, self.table, self.step, self.out) =
                    (*s, usize::from(*table > 0.5), *step as usize, *out);
                self.w.copy_from_slice(w);
                Ok(())
            }
            _ => {
                let needed = format!("{} numbers, as `state` gave", self.w.len() + 4);
                Err(Error::argument("state", format!("{} numbers", state.len()), &needed))
            }
        }
    }
}
