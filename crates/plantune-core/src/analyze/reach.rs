//! How long the plant remembers, in rows: the 63 % time of a quick ARX model's step response, dead time included.
//!
//! It is `(T + L)/Ts` of a first order plus dead time. Windows of a spectrum must be some twenty times as long, and the
//! clock of a test signal about as long.

use super::delay::delay_scan;
use crate::batch::{Orders, arx};
use crate::limits::Limits;
use crate::model::Model;
use crate::record::Record;

/// Longest delay tried, rows.
const DELAYS: usize = 60;

/// Rows and the delay in rows, the longest and the shortest over all pairs; None where no model follows y.
pub fn reach(rec: &Record, limits: &Limits) -> Option<(f64, usize)> {
    let pairs = (0..rec.ny).filter_map(|output| of_output(rec, output, limits));
    pairs.reduce(|a, b| (a.0.max(b.0), a.1.min(b.1)))
}

fn of_output(rec: &Record, output: usize, limits: &Limits) -> Option<(f64, usize)> {
    let y = rec.output(output);
    let valid: Option<Vec<bool>> =
        rec.valid.map(|valid| valid.iter().skip(output).step_by(rec.ny).copied().collect());
    let names = [&rec.names[..rec.nu], &rec.names[rec.nu + output..=rec.nu + output]].concat();
    let one = Record { y: &y, ny: 1, valid: valid.as_deref(), names, ..rec.clone() };
    let most = DELAYS.min(rec.N() / 4);
    let scans: Vec<_> =
        (0..rec.nu).filter_map(|input| delay_scan(&one, input, (0, most), limits).ok()).collect();
    if scans.len() < rec.nu {
        return None;
    }
    let n = scans.iter().map(|scan| scan.order).max()?;
    let nk: Vec<usize> = scans.iter().map(|scan| scan.nk).collect();
    let fit = arx(&one, &Orders::arx(n, vec![n; rec.nu], nk.clone()), true, limits).ok()?;
    let times = (0..rec.nu).filter_map(|input| rise(&fit.model, input, rec));
    Some((times.reduce(f64::max)?, nk.into_iter().min()?))
}

/// Rows until 63 % of the final value; None where it is not reached within a third of the record.
fn rise(model: &Model, input: usize, rec: &Record) -> Option<f64> {
    let gain = model.dc_gain()[input];
    let t: Vec<f64> = (0..=rec.N() / 3).map(|k| k as f64 * rec.Ts).collect();
    let share = 1.0 - (-1.0f64).exp();
    let y = model.step_response(input, &t);
    gain.is_finite().then(|| y.iter().position(|y| y / gain >= share)).flatten().map(|k| k.max(1) as f64)
}
