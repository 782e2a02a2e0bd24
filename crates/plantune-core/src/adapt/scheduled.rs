//! The controller at work: one for all operating points, or a table of `Kp` and one of `Ki`.
//!
//! A change moves the tables where the plant is, and leaves them elsewhere ([`super::gain_table`]).
//! Source 001, figure 3.7-1 and 3.7.6 b.

use super::gain_table::GainTable;
use crate::error::{Error, Result};
use crate::model::Pid;
use crate::sim::Table;

/// Relative difference that is rounding, where a controller keeps single precision.
const ROUNDING: f64 = 1e-6;

/// Settings that may depend on the operating point.
#[derive(Clone, Debug)]
pub struct Scheduled {
    /// At the last sample.
    now: Pid,
    /// What was read back then, beside a table.
    read: Option<Pid>,
    /// Where the plant was then.
    point: Vec<f64>,
    tables: Option<[GainTable; 2]>,
}

impl Scheduled {
    /// `Kp` and `Ki` from tables if there are any, the rest from `pid`.
    pub fn new(pid: &Pid, tables: Option<(Table, Table)>) -> Result<Self> {
        let bounded = |table: Table| {
            let positive = table.values().iter().all(|&v| v > 0.0);
            let negative = table.values().iter().all(|&v| v < 0.0);
            if !positive && !negative {
                return Err(Error::argument("tables", "of both signs, or zero", "gains of one sign"));
            }
            let least = f64::MIN_POSITIVE;
            if positive {
                GainTable::new(table, least, f64::MAX)
            } else {
                GainTable::new(table, f64::MIN, -least)
            }
        };
        let tables = tables.map(|(Kp, Ki)| Ok([bounded(Kp)?, bounded(Ki)?])).transpose()?;
        Ok(Scheduled { now: *pid, read: None, point: Vec::new(), tables })
    }

    /// Settings at an operating point; where that is not known, those of the last one.
    pub fn at(&mut self, point: &[f64]) -> Pid {
        if let Some([Kp, Ki]) = &self.tables {
            let (Kp, Ki) = (Kp.at(point), Ki.at(point));
            if Kp.is_finite() && Ki.is_finite() {
                (self.now.Kp, self.now.Ki) = (Kp, Ki);
                self.point.clear();
                self.point.extend(point);
            }
        }
        self.now
    }

    /// Settings at the last sample.
    pub fn now(&self) -> Pid {
        self.now
    }

    /// Settings that are read back: without a table someone else's are kept; a table says what is wanted.
    pub fn read(&mut self, pid: &Pid) {
        let pid = Pid { b: self.now.b, Ts: self.now.Ts, ..*pid };
        if self.tables.is_some() {
            self.read = Some(pid);
        } else if !is_same(&pid, &self.now) {
            self.now = pid;
        }
    }

    /// Settings at work: what was read back, or else what is wanted.
    pub fn present(&self) -> Pid {
        self.read.unwrap_or(self.now)
    }

    /// Puts others in their place, at the last operating point that was known.
    pub fn set(&mut self, pid: &Pid) -> Result<()> {
        if let Some([Kp, Ki]) = &mut self.tables {
            Kp.update(&self.point, pid.Kp, 1.0)?;
            Ki.update(&self.point, pid.Ki, 1.0)?;
        }
        self.now = *pid;
        Ok(())
    }

    /// The tables of `Kp` and `Ki`, if there are any.
    pub fn tables(&self) -> Option<[&Table; 2]> {
        self.tables.as_ref().map(|[Kp, Ki]| [Kp.table(), Ki.table()])
    }
}

/// Whether settings are the same but for the rounding on their way to the plant and back.
fn is_same(read: &Pid, written: &Pid) -> bool {
    [(read.Kp, written.Kp), (read.Ki, written.Ki), (read.Td, written.Td), (read.Tf, written.Tf)]
        .iter()
        .all(|(x, y)| (x - y).abs() <= ROUNDING * y.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_stays_where_the_plant_was() {
        let table = |v: [f64; 3]| Table::new(vec![vec![0.0, 1.0, 2.0]], v.to_vec()).expect("a table");
        let pid = Pid::pi(1.0, 1.0);
        let mut scheduled =
            Scheduled::new(&pid, Some((table([1.0, 1.0, 3.0]), table([2.0; 3])))).expect("sound");
        assert_eq!(scheduled.at(&[1.5]).Kp, 2.0);
        scheduled.at(&[0.0]);
        scheduled.set(&Pid { Kp: 0.5, Ki: 0.25, ..pid }).expect("sound");
        assert_eq!((scheduled.at(&[0.0]).Kp, scheduled.at(&[0.0]).Ki), (0.5, 0.25));
        assert_eq!((scheduled.at(&[2.0]).Kp, scheduled.at(&[2.0]).Ki), (3.0, 2.0));
        assert_eq!(scheduled.at(&[f64::NAN]).Kp, 3.0);
    }

    #[test]
    fn gains_of_both_signs_are_refused() {
        let table = Table::new(vec![vec![0.0, 1.0]], vec![1.0, -1.0]).expect("a table");
        let refused = Scheduled::new(&Pid::pi(1.0, 1.0), Some((table.clone(), table)));
        assert_eq!(refused.expect_err("both signs").code(), "U01");
    }
}
