//! Preisach relays at work: only the extremes of the input that are still remembered are kept, in a stack.
//!
//! ```text
//! f(t) = f(turn) + 2 E(x, turn)           turn: the extreme that the input left last, f(turn) its output
//! ```
//!
//! An input that goes beyond a remembered extreme wipes it out, together with the opposite one after it: what follows
//! is as if both had never been. A sample costs one look into the table, whatever the grid. Mayergoyz 2003, chapter 1.

use super::everett::{Everett, Spot};
use super::virgin::Virgin;
use super::{Preisach, Start};
use crate::error::{Error, Result};
use crate::hysteresis::Operator;

/// Turns for which there is room from the start.
const ROOM: usize = 256;

/// A remembered extreme and the output there.
#[derive(Clone, Copy, Debug)]
struct Turn {
    x: f64,
    f: f64,
    spot: Spot,
}

/// Relays at work.
pub struct Relays {
    everett: Everett,
    virgin: Option<Virgin>,
    offset: f64,
    /// Both saturations.
    ends: [Turn; 2],
    /// Minima and maxima by turns, never empty.
    turns: Vec<Turn>,
    now: Turn,
    rising: bool,
}

impl Relays {
    pub fn new(model: &Preisach) -> Self {
        let everett = Everett::of_mu(&model.levels, &model.mu);
        let virgin = if model.start == Start::Virgin { Virgin::of(&everett) } else { None };
        let (low, high) = everett.ends();
        let (low, high) = ((low, everett.locate(low)), (high, everett.locate(high)));
        let total = everett.between(high.1, low.1);
        let end = |(x, spot), f| Turn { x, f, spot };
        let ends = [end(low, -total), end(high, total)];
        let now = match &virgin {
            Some(virgin) => Turn { x: 0.0, f: virgin.fallen(&everett, 0.0), spot: everett.locate(0.0) },
            None if model.start == Start::Virgin && high.0 <= 0.0 => ends[1],
            None => ends[0],
        };
        let mut turns = Vec::with_capacity(ROOM);
        turns.push(now);
        Relays { everett, virgin, offset: model.offset, ends, turns, now, rising: true }
    }

    fn turn(&self, x: f64, f: f64) -> Turn {
        Turn { x, f, spot: self.everett.locate(x) }
    }

    /// Forgets what an input `x`, on the way `rising`, has gone beyond.
    #[inline(always)]
    fn wipe_out(&mut self, x: f64, rising: bool) {
        while let [.., before, _] = self.turns[..]
            && beyond(x, before.x, rising)
        {
            if self.turns.len() == 2 {
                return self.begin_anew(x, rising);
            }
            self.turns.truncate(self.turns.len() - 2);
        }
        if self.turns.len() == 1 && self.virgin.is_some() && x.abs() > self.turns[0].x.abs() {
            self.begin_anew(x, rising);
        }
    }

    /// Nothing is remembered but the state before all: the turn from which `x` is reached in one go.
    #[cold]
    fn begin_anew(&mut self, x: f64, rising: bool) {
        let turn = match &self.virgin {
            Some(virgin) if x.abs() < virgin.reach() => {
                let f = if rising {
                    virgin.fallen(&self.everett, x.abs())
                } else {
                    virgin.risen(&self.everett, x.abs())
                };
                self.turn(-x, f)
            }
            _ => self.ends[usize::from(!rising)],
        };
        self.turns.clear();
        self.turns.push(turn);
    }

    /// The nearest input at which the output is `y`, where E nowhere falls; the end of the range beyond saturation.
    pub fn seek(&self, y: f64) -> f64 {
        let f = y - self.offset;
        if f == self.now.f || f.is_nan() {
            return if f.is_nan() { f } else { self.now.x };
        }
        let rising = f > self.now.f;
        let at = |k: usize| self.turns.get(k).copied().unwrap_or(self.now);
        let mut depth = self.turns.len() + usize::from(rising != self.rising);
        while depth > 2 && beyond(f, at(depth - 2).f, rising) {
            depth -= 2;
        }
        let bottom = match depth {
            1 => self.virgin.is_some(),
            2 => beyond(f, at(0).f, rising),
            _ => false,
        };
        let x = if bottom { self.seek_anew(f, rising) } else { self.seek_from(at(depth - 1), f, rising) };
        if rising { x.max(self.now.x) } else { x.min(self.now.x) }
    }

    fn seek_from(&self, turn: Turn, f: f64, rising: bool) -> f64 {
        self.everett.seek(0.5 * (f - turn.f), turn.spot, rising)
    }

    fn seek_anew(&self, f: f64, rising: bool) -> f64 {
        match self.virgin.as_ref().and_then(|v| v.seek(&self.everett, f, rising)) {
            Some(s) => {
                if rising {
                    s
                } else {
                    -s
                }
            }
            None => self.seek_from(self.ends[usize::from(!rising)], f, rising),
        }
    }
}

/// Whether `x` is at or past `mark` on its way.
#[inline(always)]
fn beyond(x: f64, mark: f64, rising: bool) -> bool {
    if rising { x >= mark } else { x <= mark }
}

impl Operator for Relays {
    /// An input that is no number leaves everything as it is.
    #[inline]
    fn step(&mut self, x: f64) -> f64 {
        if x.is_nan() {
            return x;
        }
        let x = x.clamp(self.ends[0].x, self.ends[1].x);
        if x != self.now.x {
            let rising = x > self.now.x;
            if rising != self.rising {
                self.turns.push(self.now);
                self.rising = rising;
            }
            self.wipe_out(x, rising);
            let turn = &self.turns[self.turns.len() - 1];
            let spot = self.everett.locate(x);
            self.now = Turn { x, f: turn.f + 2.0 * self.everett.between(spot, turn.spot), spot };
        }
        self.offset + self.now.f
    }

    /// Input, output, whether it rises, then input and output at each turn.
    fn state(&self) -> Vec<f64> {
        let turns = self.turns.iter().flat_map(|t| [t.x, t.f]);
        [self.now.x, self.now.f, f64::from(u8::from(self.rising))].into_iter().chain(turns).collect()
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        let (low, high) = self.everett.ends();
        let turns = state.get(3..).unwrap_or_default();
        let within = |x: &f64| (low..=high).contains(x);
        let fits = !turns.is_empty()
            && turns.len() % 2 == 0
            && within(&state[0])
            && turns.chunks(2).all(|t| within(&t[0]) && t[1].is_finite());
        if !fits {
            let needed = "what `state` gave: input, output, way, and the turns, within the levels";
            return Err(Error::argument("state", format!("{} numbers", state.len()), needed));
        }
        self.now = self.turn(state[0], state[1]);
        self.rising = state[2] > 0.5;
        self.turns.clear();
        for t in turns.chunks(2) {
            let turn = self.turn(t[0], t[1]);
            self.turns.push(turn);
        }
        Ok(())
    }
}

/// The inverse at work: it seeks the input and remembers it.
pub struct Seeking(pub Relays);

impl Operator for Seeking {
    fn step(&mut self, y: f64) -> f64 {
        let x = self.0.seek(y);
        self.0.step(x);
        x
    }

    fn state(&self) -> Vec<f64> {
        self.0.state()
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        self.0.resume(state)
    }
}
