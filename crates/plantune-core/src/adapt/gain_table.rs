//! A gain schedule that learns where the plant was: a table over one to three operating-point signals.
//!
//! ```text
//! v(x) = sum_i w_i(x) v_i                                  read: multilinear, over the nodes around x
//! v_i <- v_i + w_i rate (value - v(x)) / sum_k w_k^2       update: the least change that moves v(x)
//! ```
//!
//! With rate 1 the table then reads `value` at `x`. Nodes that do not surround `x` keep theirs. A node that
//! would leave its bounds stops there, and the others around `x` take the rest: still the least change, now
//! within bounds. Source 001, figure 3.7-1 and 3.7.6; the update is this side of the source.

use crate::error::{Error, Result};
use crate::sim::Table;

/// Most nodes around a point.
const AROUND: usize = 8;

/// A table with bounds on its values.
///
/// ```
/// use plantune_core::adapt::GainTable;
/// use plantune_core::sim::Table;
///
/// let table = Table::new(vec![vec![0.0, 10.0, 20.0]], vec![1.0, 1.0, 1.0])?;
/// let mut gain = GainTable::new(table, 0.0, 5.0)?;
/// gain.update(&[5.0], 2.0, 1.0)?;
/// assert_eq!(gain.at(&[5.0]), 2.0);
/// assert_eq!(gain.table().values(), [2.0, 2.0, 1.0]);
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct GainTable {
    table: Table,
    low: f64,
    high: f64,
}

impl GainTable {
    /// A table whose values are kept between `low` and `high`.
    pub fn new(table: Table, low: f64, high: f64) -> Result<Self> {
        if !(low < high) {
            return Err(Error::argument("low", low, &format!("less than high, {high}")));
        }
        if let Some(v) = table.values().iter().find(|&&v| !(low <= v && v <= high)) {
            return Err(Error::argument("values", v, &format!("between {low} and {high}")));
        }
        Ok(GainTable { table, low, high })
    }

    /// Value at an operating point; NaN where a signal is missing or NaN.
    pub fn at(&self, point: &[f64]) -> f64 {
        self.table.at(point)
    }

    /// The table as it is now.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Moves the value at a point towards `value`, brought within bounds, by the share `rate` in (0, 1].
    ///
    /// Allocates nothing.
    pub fn update(&mut self, point: &[f64], value: f64, rate: f64) -> Result<()> {
        if !self.table.holds(point) {
            let needed = format!("{} numbers, one per axis", self.table.signals());
            return Err(Error::argument("point", format!("{point:?}"), &needed));
        }
        if !value.is_finite() {
            return Err(Error::argument("value", value, "finite"));
        }
        if !(rate > 0.0 && rate <= 1.0) {
            return Err(Error::argument("rate", rate, "in (0, 1]"));
        }
        let mut nodes = [(0, 0.0); AROUND];
        let mut around = 0;
        for corner in self.table.corners(point).filter(|(_, weight)| *weight > 0.0) {
            nodes[around] = corner;
            around += 1;
        }
        let left = rate * (value.clamp(self.low, self.high) - self.table.at(point));
        self.spread(&mut nodes[..around], left);
        Ok(())
    }

    /// Moves the read value by `left` through free nodes; one that meets its bound stays there and is free no more.
    fn spread(&mut self, nodes: &mut [(usize, f64)], mut left: f64) {
        let values = self.table.values_mut();
        loop {
            let norm2: f64 = nodes.iter().map(|(_, w)| w * w).sum();
            if norm2 == 0.0 {
                return;
            }
            let step = left / norm2;
            let mut met = false;
            for (node, weight) in nodes.iter_mut() {
                let wanted = values[*node] + *weight * step;
                let bounded = wanted.clamp(self.low, self.high);
                if *weight > 0.0 && bounded != wanted {
                    left -= *weight * (bounded - values[*node]);
                    values[*node] = bounded;
                    (*weight, met) = (0.0, true);
                }
            }
            if !met {
                nodes.iter().for_each(|(node, weight)| values[*node] += weight * step);
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    fn table(signals: usize, seed: u64) -> Table {
        let axes: Vec<Vec<f64>> =
            (0..signals).map(|i| (0..4 - i).map(|k| (k * k) as f64 - 1.0).collect()).collect();
        let points = axes.iter().map(Vec::len).product();
        Table::new(axes, white(points, seed).iter().map(|x| x.clamp(-2.0, 2.0)).collect()).expect("sound")
    }

    #[test]
    fn after_an_update_the_table_reads_the_value_and_far_nodes_keep_theirs() {
        for signals in 1..=3 {
            let draws = white(5 * 400, 11);
            for (k, draw) in draws.chunks(5).enumerate() {
                let mut gain = GainTable::new(table(signals, k as u64), -2.0, 2.0).expect("sound");
                let point: Vec<f64> = draw[..signals].iter().map(|x| 2.0 + 3.0 * x).collect();
                let (value, rate) = (2.0 * draw[3], if k % 2 == 0 { 1.0 } else { 0.3 });
                let before = gain.clone();
                gain.update(&point, value, rate).expect("sound");
                let goal = before.at(&point) + rate * (value.clamp(-2.0, 2.0) - before.at(&point));
                assert!((gain.at(&point) - goal).abs() < 1e-12, "{signals} {k}");
                let near: Vec<usize> = gain.table.corners(&point).map(|(node, _)| node).collect();
                for (node, (now, was)) in gain.table.values().iter().zip(before.table.values()).enumerate() {
                    assert!((-2.0..=2.0).contains(now));
                    assert!(near.contains(&node) || now == was);
                    assert!((now - was) * (goal - before.at(&point)) >= 0.0);
                }
            }
        }
    }

    /// Without bounds in the way, no smaller change of the nodes moves the value as far.
    #[test]
    fn the_change_is_the_least_one() {
        let mut gain = GainTable::new(table(2, 1), -1e9, 1e9).expect("sound");
        let (point, before) = ([0.7, 1.1], gain.clone());
        gain.update(&point, 5.0, 1.0).expect("sound");
        let change: f64 =
            gain.table.values().iter().zip(before.table.values()).map(|(a, b)| (a - b).powi(2)).sum();
        let norm2: f64 = gain.table.corners(&point).map(|(_, w)| w * w).sum();
        let least = (5.0 - before.at(&point)).powi(2) / norm2;
        assert!((change - least).abs() < 1e-10 * least);
    }

    #[test]
    fn what_is_no_update_is_refused_and_changes_nothing() {
        let mut gain = GainTable::new(table(1, 0), -2.0, 2.0).expect("sound");
        let before = gain.clone();
        for (point, value, rate) in
            [(&[][..], 1.0, 1.0), (&[f64::NAN], 1.0, 1.0), (&[0.0], f64::NAN, 1.0), (&[0.0], 1.0, 1.5)]
        {
            assert_eq!(gain.update(point, value, rate).expect_err("refused").code(), "U01");
        }
        assert_eq!(gain, before);
        assert_eq!(GainTable::new(table(1, 0), -1e-9, 1e-9).expect_err("outside").code(), "U01");
        assert_eq!(GainTable::new(table(1, 0), 2.0, 2.0).expect_err("empty").code(), "U01");
    }
}
