//! Elements in series, one group for a rising and one for a falling input: the improved Maxwell slip model.
//!
//! ```text
//! y(t) = y_b + k (x(t) - x_b)     of the last element whose x_b lies behind x(t) in the present direction
//! y(t) = y(t-1)                   before the first of them
//! ```
//!
//! Source 002, (8a), (8b), with its table 4.1 read as it must be: `F_i` there is the position `y_b` at the
//! breakpoint, not a limit of friction. As printed, the sums of both groups differ, and the loop drifts by 2.2 um a
//! cycle; anchored at `(x_b, y_b)` none does. Breakpoints are absolute: nothing remembers a minor loop.
//!
//! Inverse, where every `k > 0`: the branches with their axes exchanged, elements `(y_b, x_b, 1/k)` again.
//!
//! ```text
//! a gap before the next x_b      (y_end, x_b, 0), then the next: x stays at x_b while y crosses the gap
//! an overlap                     the earlier element to its end, then the next from there: x skips a piece
//! ```

use super::{Operator, copy_state};
use crate::error::{Error, Result};

/// A gap smaller than this share of the output is rounding.
const ROUNDING: f64 = 1e-12;

/// Breakpoint, output there, slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// Input at which it begins.
    pub x_b: f64,
    /// Output there.
    pub y_b: f64,
    /// Slope, y/x.
    pub k: f64,
}

impl Element {
    /// `y_b + k (x - x_b)`.
    pub fn at(&self, x: f64) -> f64 {
        self.y_b + self.k * (x - self.x_b)
    }
}

/// Both groups, each in the order in which the input passes them.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesSlip {
    /// For a rising input, breakpoints ascending.
    pub up: Vec<Element>,
    /// For a falling input, breakpoints descending.
    pub down: Vec<Element>,
}

impl SeriesSlip {
    pub(super) fn check(&self) -> Result<()> {
        if self.up.is_empty() && self.down.is_empty() {
            return Err(Error::argument(
                "up",
                "empty, as is `down`",
                "at least one element (x_b, y_b, slope)",
            ));
        }
        for (name, group, way, order) in
            [("up", &self.up, 1.0, "ascending"), ("down", &self.down, -1.0, "descending")]
        {
            if group.iter().any(|e| !(e.x_b + e.y_b + e.k).is_finite()) {
                return Err(Error::argument(name, format!("{:?}", rows(group)), "rows of finite numbers"));
            }
            if let Some(pair) = group.windows(2).find(|e| !((e[1].x_b - e[0].x_b) * way > 0.0)) {
                let came = format!("a group in which {} comes before {}", pair[0].x_b, pair[1].x_b);
                return Err(Error::argument(name, came, &format!("rows of {order} breakpoints")));
            }
        }
        Ok(())
    }

    pub(super) fn start(&self) -> Slip {
        let first = self.up.first().or(self.down.first());
        let y = first.map_or(0.0, |e| e.y_b);
        // An input from below: whatever comes first has risen.
        Slip { model: self.clone(), x: f64::NEG_INFINITY, way: 1.0, y }
    }

    /// The group in use while the input moves `way`, +1 or -1.
    pub(super) fn group(&self, way: f64) -> &[Element] {
        if way > 0.0 { &self.up } else { &self.down }
    }

    pub(super) fn inverse(&self) -> Result<SeriesSlip> {
        if let Some(e) = self.up.iter().chain(&self.down).find(|e| !(e.k > 0.0)) {
            let came = format!("{} at the breakpoint {}", e.k, e.x_b);
            return Err(Error::argument("slope", came, "positive in every element, or no inverse exists"));
        }
        Ok(SeriesSlip { up: exchanged(&self.up, 1.0), down: exchanged(&self.down, -1.0) })
    }

    /// The loop whose elements meet: chords from breakpoint to breakpoint, the last of a group to the first of the
    /// other.
    ///
    /// No jump is left, hence no gap for the inverse, and both groups sum up to nothing over a cycle.
    pub fn closed(&self) -> Result<SeriesSlip> {
        self.check()?;
        let ends = [self.up.first(), self.up.last(), self.down.first(), self.down.last()];
        let [Some(bottom), Some(up), Some(top), Some(down)] = ends else {
            return Err(Error::argument("down", "empty, or `up` is", "a group of its own to close the loop"));
        };
        if !(up.x_b < top.x_b && bottom.x_b < down.x_b) {
            let came = format!("from {} on, and `up` from {} on", top.x_b, bottom.x_b);
            return Err(Error::argument("down", came, "beyond the last of `up`, and back before its first"));
        }
        Ok(SeriesSlip { up: chords(&self.up, top), down: chords(&self.down, bottom) })
    }

    /// The same model moved by one constant, so that the branch `way` passes `(x, y)`: a second cycle starts where
    /// drift and creep have left the first.
    pub fn through(&self, x: f64, y: f64, way: f64) -> Result<SeriesSlip> {
        self.check()?;
        if !(x + y).is_finite() {
            return Err(Error::argument("x", format!("{x}, and `y` {y}"), "two finite numbers"));
        }
        let there = passed(self.group(way), x, way).or(self.group(way).first());
        let Some(element) = there else {
            return Err(Error::argument("direction", "one without elements", "the other one"));
        };
        let by = y - if (x - element.x_b) * way >= 0.0 { element.at(x) } else { element.y_b };
        let moved = |e: &Element| Element { y_b: e.y_b + by, ..*e };
        Ok(SeriesSlip {
            up: self.up.iter().map(moved).collect(),
            down: self.down.iter().map(moved).collect(),
        })
    }
}

/// Rows `(x_b, y_b, k)`, for print.
fn rows(group: &[Element]) -> Vec<[f64; 3]> {
    group.iter().map(|e| [e.x_b, e.y_b, e.k]).collect()
}

/// The last element whose breakpoint lies behind `x`.
fn passed(group: &[Element], x: f64, way: f64) -> Option<&Element> {
    let behind = group.partition_point(|e| (x - e.x_b) * way >= 0.0);
    behind.checked_sub(1).map(|last| &group[last])
}

/// A branch as x over y.
fn exchanged(group: &[Element], way: f64) -> Vec<Element> {
    let mut branch: Vec<Element> = Vec::new();
    let mut reached = f64::NEG_INFINITY; // of y in this direction: what the elements before serve
    for (n, e) in group.iter().enumerate() {
        let end = group.get(n + 1).map_or(f64::INFINITY, |next| way * e.at(next.x_b));
        if end <= reached {
            continue; // wholly within the overlap
        }
        let begin = way * e.y_b;
        let meets = (begin - reached).abs() <= ROUNDING * begin.abs();
        if n > 0 && reached < begin && !meets {
            branch.push(Element { x_b: way * reached, y_b: e.x_b, k: 0.0 });
        }
        let x_b = if meets { e.y_b } else { way * reached.max(begin) };
        branch.push(Element { x_b, y_b: e.x_b + (x_b - e.y_b) / e.k, k: 1.0 / e.k });
        reached = end;
    }
    branch
}

/// Slopes that lead each element to the next one's breakpoint, and the last to `end`.
fn chords(group: &[Element], end: &Element) -> Vec<Element> {
    let next = group.iter().skip(1).chain([end]);
    group.iter().zip(next).map(|(e, n)| Element { k: (n.y_b - e.y_b) / (n.x_b - e.x_b), ..*e }).collect()
}

/// A model at work: input and output of the last sample, and the direction between the last two that differ.
pub(super) struct Slip {
    model: SeriesSlip,
    x: f64,
    way: f64,
    y: f64,
}

impl Operator for Slip {
    fn step(&mut self, x: f64) -> f64 {
        if !x.is_finite() {
            return self.y; // not a reading: the output holds
        }
        if x != self.x {
            self.way = if x > self.x { 1.0 } else { -1.0 };
        }
        self.x = x;
        if let Some(element) = passed(self.model.group(self.way), x, self.way) {
            self.y = element.at(x);
        }
        self.y
    }

    fn state(&self) -> Vec<f64> {
        vec![self.x, self.way, self.y]
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        let mut own = [0.0; 3];
        copy_state(&mut own, state)?;
        [self.x, self.way, self.y] = own;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn elements<const N: usize>(rows: [[f64; 3]; N]) -> Vec<Element> {
        rows.map(|[x_b, y_b, k]| Element { x_b, y_b, k }).to_vec()
    }

    #[test]
    fn a_gap_is_crossed_at_its_breakpoint_and_an_overlap_by_the_earlier_element() {
        let up = elements([[0.0, 0.0, 1.0], [2.0, 3.0, 2.0], [3.0, 4.0, 0.5], [5.0, 5.5, 1.0]]);
        let found = exchanged(&up, 1.0);
        // A gap from 2 to 3 at x = 2; the second ends at 5 where the third began at 4: x skips from 3 to 5, and
        // the third is left out, for it ends at 5; then a gap from 5 to 5.5 at x = 5.
        let rows = [[0.0, 0.0, 1.0], [2.0, 2.0, 0.0], [3.0, 2.0, 0.5], [5.0, 5.0, 0.0], [5.5, 5.0, 1.0]];
        assert_eq!(found, elements(rows));
    }

    #[test]
    fn a_falling_branch_mirrors_a_rising_one() {
        let up = elements([[-9.0, -8.0, 0.5], [-4.0, -5.0, 0.8], [1.0, -2.0, 0.3]]);
        let mirrored = |group: &[Element]| -> Vec<Element> {
            group.iter().map(|e| Element { x_b: -e.x_b, y_b: -e.y_b, k: e.k }).collect()
        };
        assert_eq!(mirrored(&exchanged(&up, 1.0)), exchanged(&mirrored(&up), -1.0));
    }
}
