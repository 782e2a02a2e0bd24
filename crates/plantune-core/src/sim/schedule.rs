//! Tables over one to three operating-point signals, and settings that follow them.
//!
//! Between its points a table is multilinear; beyond its edges it keeps the value of the edge.
//! Source 001, 3.7.6: model and controller parameters in three-dimensional tables, read by interpolation.

use crate::error::{Error, Result};
use crate::model::Pid;

/// Most signals of a table.
const MOST: usize = 3;

/// Values over a grid of operating points.
///
/// ```
/// use plantune_core::sim::Table;
///
/// let table = Table::new(vec![vec![0.0, 10.0], vec![1.0, 2.0, 4.0]], vec![1.0, 2.0, 3.0, 5.0, 6.0, 7.0])?;
/// assert_eq!(table.at(&[5.0, 1.5]), 3.5);
/// assert_eq!(table.at(&[-3.0, 99.0]), 3.0);
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    axes: Vec<Vec<f64>>,
    values: Vec<f64>, // row-major, the last axis runs fastest
}

impl Table {
    /// Over ascending axes.
    pub fn new(axes: Vec<Vec<f64>>, values: Vec<f64>) -> Result<Self> {
        if axes.is_empty() || axes.len() > MOST {
            return Err(Error::argument("axes", format!("{} signals", axes.len()), "one to three"));
        }
        for axis in &axes {
            let ascending = axis.windows(2).all(|pair| pair[0] < pair[1]);
            if axis.is_empty() || !ascending || axis.iter().any(|x| !x.is_finite()) {
                return Err(Error::argument(
                    "axes",
                    format!("{axis:?}"),
                    "finite and ascending, without repeats",
                ));
            }
        }
        let points: usize = axes.iter().map(Vec::len).product();
        if values.len() != points {
            let came = format!("{} values", values.len());
            return Err(Error::argument("values", came, &format!("one per point of the axes, {points}")));
        }
        if values.iter().any(|x| !x.is_finite()) {
            return Err(Error::argument("values", "not finite", "finite"));
        }
        Ok(Table { axes, values })
    }

    /// Number of signals.
    pub fn signals(&self) -> usize {
        self.axes.len()
    }

    /// Value at an operating point, one number per axis; NaN where one is missing or NaN. Allocates nothing.
    pub fn at(&self, point: &[f64]) -> f64 {
        if !self.holds(point) {
            return f64::NAN;
        }
        self.corners(point).map(|(node, weight)| weight * self.values[node]).sum()
    }

    /// Whether a point has a number for every axis.
    pub fn holds(&self, point: &[f64]) -> bool {
        point.len() == self.axes.len() && point.iter().all(|x| !x.is_nan())
    }

    /// The nodes around a point with their weights, which are of sum 1; a node may come twice, once without weight.
    pub fn corners<'p>(&self, point: &'p [f64]) -> impl Iterator<Item = (usize, f64)> + use<'_, 'p> {
        // Bit i of `corner` says which end of the interval of axis i.
        (0..1usize << self.axes.len()).map(move |corner| {
            let (mut node, mut weight) = (0, 1.0);
            for (i, (axis, &x)) in self.axes.iter().zip(point).enumerate() {
                let (left, share) = place(axis, x);
                let right = corner >> i & 1 == 1;
                weight *= if right { share } else { 1.0 - share };
                node = node * axis.len() + left + usize::from(right && share > 0.0);
            }
            (node, weight)
        })
    }

    /// The points of each signal.
    pub fn axes(&self) -> &[Vec<f64>] {
        &self.axes
    }

    /// Values at the nodes, row-major, the last axis runs fastest.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The same, to be changed; they stay finite.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }
}

/// The interval of `axis` that holds `x`, and how far in it lies.
fn place(axis: &[f64], x: f64) -> (usize, f64) {
    let above = axis.partition_point(|&a| a <= x);
    if above == 0 {
        return (0, 0.0);
    }
    if above == axis.len() {
        return (above - 1, 0.0);
    }
    (above - 1, (x - axis[above - 1]) / (axis[above] - axis[above - 1]))
}

/// Settings that change from row to row; what is absent stays as it is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Schedule<'s> {
    /// Proportional gain.
    pub Kp: Option<&'s [f64]>,
    /// Integral time, s.
    pub Ti: Option<&'s [f64]>,
    /// Integral gain, u/(y s); instead of `Ti`.
    pub Ki: Option<&'s [f64]>,
    /// Derivative time, s.
    pub Td: Option<&'s [f64]>,
}

impl Schedule<'_> {
    /// Whether nothing changes.
    pub fn is_empty(&self) -> bool {
        [self.Kp, self.Ti, self.Ki, self.Td].iter().all(Option::is_none)
    }

    /// How many rows it has.
    pub fn rows(&self) -> usize {
        [self.Kp, self.Ti, self.Ki, self.Td].iter().flatten().map(|x| x.len()).max().unwrap_or(0)
    }

    /// Settings of a row.
    pub fn at(&self, row: usize, pid: &Pid) -> Pid {
        let Kp = self.Kp.map_or(pid.Kp, |x| x[row]);
        let Ki = match (self.Ki, self.Ti) {
            (Some(Ki), _) => Ki[row],
            (None, Some(Ti)) => Kp / Ti[row],
            (None, None) if pid.Kp == 0.0 => pid.Ki,
            (None, None) => pid.Ki * (Kp / pid.Kp),
        };
        Pid { Kp, Ki, Td: self.Td.map_or(pid.Td, |x| x[row]), ..*pid }
    }

    /// Refuses lengths other than `rows`, and settings that are no controller.
    pub fn check(&self, rows: usize, pid: &Pid) -> Result<()> {
        for (name, x) in [("Kp", self.Kp), ("Ti", self.Ti), ("Ki", self.Ki), ("Td", self.Td)] {
            let Some(x) = x else { continue };
            if x.len() != rows {
                return Err(Error::argument(
                    name,
                    format!("{} long", x.len()),
                    &format!("{rows} long, like r"),
                ));
            }
            if let Some(row) = x.iter().position(|&x| x.is_nan() || name == "Ti" && x <= 0.0) {
                let came = format!("{} in row {row} of the schedule", x[row]);
                return Err(Error::argument(name, came, if name == "Ti" { "positive" } else { "a number" }));
            }
        }
        if self.Ti.is_some() && self.Ki.is_some() {
            return Err(Error::argument("Ti, Ki", "both in the schedule", "one of them"));
        }
        (0..if self.is_empty() { 0 } else { rows }).try_for_each(|row| self.at(row, pid).check())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_of_a_multilinear_function_is_that_function() {
        let f = |x: f64, y: f64, z: f64| 1.0 + 2.0 * x - y + 0.5 * z + 3.0 * x * y - x * z + x * y * z;
        let axes = [vec![0.0, 1.0, 4.0], vec![-1.0, 2.0], vec![0.0, 0.5, 1.0, 3.0]];
        let mut values = Vec::new();
        for &x in &axes[0] {
            for &y in &axes[1] {
                values.extend(axes[2].iter().map(|&z| f(x, y, z)));
            }
        }
        let table = Table::new(axes.to_vec(), values).expect("a table");
        for (x, y, z) in [(0.3, 0.0, 0.7), (4.0, 2.0, 3.0), (1.0, -1.0, 0.5), (3.9, 1.9, 0.1)] {
            assert!((table.at(&[x, y, z]) - f(x, y, z)).abs() < 1e-13);
        }
        assert_eq!(table.at(&[9.0, 9.0, 9.0]), f(4.0, 2.0, 3.0));
        assert_eq!(table.at(&[-9.0, -9.0, -9.0]), f(0.0, -1.0, 0.0));
        assert!(table.at(&[1.0, 1.0]).is_nan() && table.at(&[f64::NAN, 1.0, 1.0]).is_nan());
    }

    #[test]
    fn what_is_no_table_is_refused() {
        for (axes, values) in [
            (vec![], vec![1.0]),
            (vec![vec![0.0, 0.0]], vec![1.0, 2.0]),
            (vec![vec![0.0, 1.0]], vec![1.0]),
            (vec![vec![0.0, 1.0]], vec![1.0, f64::NAN]),
            (vec![vec![0.0]; 4], vec![1.0]),
        ] {
            assert_eq!(Table::new(axes, values).expect_err("no table").code(), "U01");
        }
        assert_eq!(Table::new(vec![vec![2.0]], vec![7.0]).expect("one point").at(&[5.0]), 7.0);
    }

    #[test]
    fn a_gain_alone_keeps_the_integral_time() {
        let schedule = Schedule { Kp: Some(&[1.0, 2.0]), ..Schedule::default() };
        let pid = Pid::pi(4.0, 10.0);
        assert_eq!(schedule.at(1, &pid).Ti(), 10.0);
        assert_eq!(schedule.check(3, &pid).expect_err("two rows").code(), "U01");
    }
}
