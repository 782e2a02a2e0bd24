//! Time stamps: whether they are uniform, and resampling when they are not.

use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::note::{Place, rounded};
use crate::stats::quantile;

/// Steps longer than this many own steps would need a filter first.
const DECIMATION: f64 = 1.5;

/// A step longer than this many medians is a gap.
const GAP: f64 = 1.5;

/// The sample time of uniform stamps; refuses others (D13, D14, D15).
pub fn uniform_step(t: &[f64], limits: &Limits) -> Result<f64> {
    check_ascending(t)?;
    let steps = sorted_steps(t);
    let [p1, median, p99] = quantiles(&steps);
    let mean = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
    let off = |step: f64| (step / median - 1.0).abs();
    // Stamps are rounded decimals: a step at the limit may pass it by a little.
    let allowed = 1.002 * limits.D15;
    let extremes =
        |about: f64| (steps[0] / about - 1.0).abs().max((steps[steps.len() - 1] / about - 1.0).abs());
    let worst = extremes(median);
    if worst.min(extremes(mean)) <= allowed {
        return Ok(mean);
    }
    let places = t.windows(2).enumerate().filter(|(_, w)| off(w[1] - w[0]) > allowed);
    let (count, row) =
        places.fold((0, 0), |(count, row), (k, _)| (count + 1, if count == 0 { k + 1 } else { row }));
    let text = format!(
        "not uniformly sampled: {count} steps are off by up to {:.1} % \
         (median {median:.6} s, 1 % {p1:.6} s, 99 % {p99:.6} s)",
        100.0 * worst
    );
    Err(Error::new("D15", text)
        .at(Place { column: "time".into(), row: Some(row), time: Some(t[row]) })
        .count(count)
        .measured(worst, limits.D15)
        .remedy(format!("resample to a uniform step: resample={}", rounded(median))))
}

/// The steps between time stamps, uniform or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steps {
    /// Median step, s.
    pub step: f64,
    /// Steps below which 1 % and 99 % of all lie, s.
    pub p1: f64,
    /// See `p1`.
    pub p99: f64,
    /// Steps longer than one and a half medians.
    pub gaps: usize,
    /// Steps that are zero or go back.
    pub back: usize,
}

/// What the steps between stamps look like; none where there are fewer than two stamps.
pub fn steps(t: &[f64]) -> Option<Steps> {
    let steps = sorted_steps(t);
    if steps.is_empty() {
        return None;
    }
    let [p1, step, p99] = quantiles(&steps);
    let gaps = steps.iter().filter(|&&d| d > GAP * step).count();
    let back = steps.iter().filter(|&&d| d <= 0.0).count();
    Some(Steps { step, p1, p99, gaps, back })
}

fn sorted_steps(t: &[f64]) -> Vec<f64> {
    let mut steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps
}

/// Values below which 1, 50 and 99 % of all lie.
fn quantiles(sorted: &[f64]) -> [f64; 3] {
    [0.01, 0.5, 0.99].map(|share| quantile(sorted, share))
}

/// Stamps must ascend: D13 where they go back, D14 where they repeat.
fn check_ascending(t: &[f64]) -> Result<()> {
    if t.len() < 2 {
        return Err(Error::new("D04", "fewer than two time stamps").remedy("give at least two rows"));
    }
    let Some(k) = t.windows(2).position(|w| !(w[1] > w[0])) else { return Ok(()) };
    let place = Place { column: "time".into(), row: Some(k + 1), time: Some(t[k + 1]) };
    let repeats = t[k + 1] == t[k];
    let count = t.windows(2).filter(|w| if repeats { w[1] == w[0] } else { w[1] < w[0] }).count();
    Err(if repeats {
        Error::new("D14", format!("{count} time stamps repeat the one before"))
            .remedy("remove the repeated rows")
    } else {
        Error::new("D13", format!("time goes back {count} times, first by {} s", t[k] - t[k + 1]))
            .remedy("sort the rows, or cut the file where the clock was set")
    }
    .at(place)
    .count(count))
}

/// Columns on a uniform grid.
pub struct Resampled {
    /// Grid, s.
    pub t: Vec<f64>,
    /// Columns, row-major.
    pub x: Vec<f64>,
    /// First rows of contiguous stretches: a gap longer than three steps is not bridged.
    pub starts: Vec<usize>,
    /// For each row the original row at or before it.
    pub rows: Vec<i64>,
}

/// Brings the row-major `x (N, held.len())` to the step `Ts`: `held` columns keep their last value
/// (inputs), others are interpolated.
pub fn resample(t: &[f64], x: &[f64], held: &[bool], Ts: f64) -> Result<Resampled> {
    check_ascending(t)?;
    let length = t[t.len() - 1] - t[0];
    let own = length / (t.len() - 1) as f64;
    check_step(Ts, own, length)?;
    let wanted = length / Ts;
    let gap = 3.0 * Ts.max(own);
    let mut out = Resampled { t: Vec::new(), x: Vec::new(), starts: Vec::new(), rows: Vec::new() };
    let row = |k: usize| &x[k * held.len()..(k + 1) * held.len()];
    let (mut k, mut contiguous) = (0, false);
    for i in 0..=(wanted * (1.0 + 1e-12)).floor() as usize {
        let now = t[0] + i as f64 * Ts;
        while k + 1 < t.len() && t[k + 1] <= now + 1e-9 * Ts {
            k += 1;
        }
        let in_gap = k + 1 < t.len() && t[k + 1] - t[k] > gap && now > t[k] + 1e-9 * Ts;
        if in_gap {
            contiguous = false;
            continue;
        }
        if !contiguous {
            out.starts.push(out.t.len());
            contiguous = true;
        }
        out.t.push(now);
        out.rows.push(k as i64);
        let next = (k + 1).min(t.len() - 1);
        let share = if next == k { 0.0 } else { ((now - t[k]) / (t[next] - t[k])).max(0.0) };
        let between = row(k).iter().zip(row(next)).zip(held);
        out.x.extend(between.map(|((a, b), held)| if *held { *a } else { a + share * (b - a) }));
    }
    Ok(out)
}

/// Refuses a step that is none or gives too many rows (U01), and one that needs a filter (M10).
fn check_step(Ts: f64, own: f64, length: f64) -> Result<()> {
    if !(Ts > 0.0 && Ts.is_finite()) {
        return Err(Error::argument("resample", Ts, "a positive number of seconds"));
    }
    if Ts > DECIMATION * own {
        let text = format!(
            "a step of {Ts} s keeps one of {:.1} rows without a filter: \
             fast parts would come back as slow ones",
            Ts / own
        );
        return Err(Error::new("M10", text)
            .at(Place::column("resample"))
            .measured(Ts / own, DECIMATION)
            .remedy(format!(
                "resample to the record's own step, {} s, then to {Ts} s by prep.resample, which filters",
                rounded(own)
            )));
    }
    if length / Ts > 1e8 {
        return Err(Error::argument("resample", Ts, "long enough to give fewer than 1e8 rows"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_resampled_exactly_and_a_gap_cuts() {
        let t = [0.0, 1.02, 1.98, 3.0, 20.0, 21.0, 22.0];
        let y: Vec<f64> = t.iter().map(|t| 2.0 * t).collect();
        let out = resample(&t, &y, &[false], 1.0).expect("resampled");
        assert_eq!(out.starts, vec![0, 4]);
        assert!(out.t.iter().zip(&out.x).all(|(t, y)| (y - 2.0 * t).abs() < 1e-12));
    }
}
