//! One output of a model of several, judged on a record: the verdict of a single output, its run being that of
//! the whole model, which uses the other outputs' past.

use super::verdict::{Verdict, judged, related};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::model::Several;
use crate::record::Record;
use crate::sim::{OverRecord, Start, matrix_over_record};

/// Judges output `i` of `model` on `rec`; offsets are estimated when absent.
pub fn check_output(
    model: &Several,
    rec: &Record,
    i: usize,
    (x0, offset, lags): (Start, Option<&[f64]>, usize),
    limits: &Limits,
) -> std::result::Result<Verdict, (Error, Option<Box<Verdict>>)> {
    let run = |horizon| -> Result<OverRecord> {
        let mut runs = matrix_over_record(model, rec, horizon, x0, offset)?;
        if i < runs.len() {
            return Ok(runs.swap_remove(i));
        }
        Err(Error::argument("output", i, &format!("one of {}", runs.len())))
    };
    let (simulated, predicted) = (run(None), run(Some(1)));
    let (simulated, predicted) = (simulated.map_err(|e| (e, None))?, predicted.map_err(|e| (e, None))?);
    let y = rec.output(i);
    let valid: Option<Vec<bool>> =
        rec.valid.map(|valid| valid.iter().skip(i).step_by(rec.ny).copied().collect());
    let mut names = rec.names[..rec.nu].to_vec();
    names.push(rec.names[rec.nu + i].clone());
    let own = Record { y: &y, ny: 1, valid: valid.as_deref(), names, ..rec.clone() };
    related(&own, judged(&own, simulated, &predicted, lags, limits), limits)
}
