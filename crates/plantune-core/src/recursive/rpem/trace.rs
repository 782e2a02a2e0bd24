//! `step` over a record, and what it leaves behind.

use super::Rpem;
use crate::error::{Error, Result};
use crate::record::Record;

/// What an estimator thought after each row that was kept.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Rows of the record.
    pub rows: Vec<usize>, // (m)
    /// Coefficients after each.
    pub theta: Vec<f64>, // (m, n)
    /// Their standard deviations.
    pub sd: Vec<f64>, // (m, n)
    /// Offset, in the record's units, and its standard deviation.
    pub offset: Vec<[f64; 2]>, // (m)
    /// Prediction error; NaN where there was none: lags missing, or an output that does not count.
    pub eps: Vec<f64>, // (m)
    /// Whether the row was learnt.
    pub learnt: Vec<bool>, // (m)
    /// Rows at which the offset was seen to step, of all.
    pub alarms: Vec<usize>,
}

impl Rpem {
    /// Learns a record, every segment after a restart: `step` in a loop, to the last bit, and `skip` where the output
    /// does not count. Keeps every `every`th row of what comes of it, and the last.
    ///
    /// A row that is refused leaves those before it learnt.
    pub fn run(&mut self, rec: &Record, every: usize) -> Result<Trace> {
        if rec.nu != 1 || rec.ny != 1 {
            let came = format!("a record with {} inputs and {} outputs", rec.nu, rec.ny);
            return Err(Error::argument("rec", came, "one with a single input and a single output"));
        }
        if every == 0 {
            return Err(Error::argument("every", every, "at least 1"));
        }
        let mut trace = Trace::default();
        let (mut next, last) = (0, rec.N() - 1);
        for segment in rec.segments() {
            self.restart();
            for k in segment {
                let (u, before) = (rec.u[k], self.alarms);
                let learnt = match rec.is_valid(k, 0) {
                    true => self.step(u, rec.y[k]),
                    false => self.skip(u).map(|()| None),
                };
                let eps = learnt.map_err(|error| error.at(rec.place(1, k)))?;
                if self.alarms > before {
                    trace.alarms.push(k);
                }
                if k == next || k == last {
                    trace.keep(self, k, eps);
                    next = next.saturating_add(every);
                }
            }
        }
        Ok(trace)
    }
}

impl Trace {
    fn keep(&mut self, estimator: &Rpem, k: usize, eps: Option<f64>) {
        self.rows.push(k);
        self.theta.extend_from_slice(estimator.theta());
        self.sd.extend(estimator.sd());
        let (O, sd) = estimator.offset();
        self.offset.push([O, sd]);
        self.eps.push(eps.unwrap_or(f64::NAN));
        self.learnt.push(estimator.learnt());
    }
}
