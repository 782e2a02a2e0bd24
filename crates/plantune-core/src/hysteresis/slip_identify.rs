//! A whole record through the learner of elements in series, and what the record leaves in doubt.
//!
//! ```text
//! sd = sqrt(pi/2) mean |fourth difference of y| / sqrt(70)     the noise; a smooth loop leaves little of itself
//! ```
//!
//! Source 002, 4.5. Its threshold must have about eight standard deviations of the noise, or several exceedances in
//! a row must be asked for: with one, the elements double at four and run into the hundreds at two.

use super::Operator;
use super::series_slip::SeriesSlip;
use super::slip_learner::{SOUND, SlipLearner, SlipSettings, Stretch};
use crate::error::Result;
use crate::note::Note;

/// Elements of one direction that a smooth branch asks for, at most, in units of `sqrt(range / threshold)`.
const MANY: f64 = 1.5;

/// Share of the input's range that a stretch of each direction must cover for a whole cycle.
const WHOLE: f64 = 0.9;

/// A model of the last cycle of a record, and how it fits there.
#[derive(Clone, Debug)]
pub struct LearntSlip {
    /// The model.
    pub model: SeriesSlip,
    /// Rows from the first one of its stretches to the last.
    pub N: usize,
    /// Root mean square of the error over them.
    pub rms: f64,
    /// Largest error.
    pub worst: f64,
    /// Norm of the error over the norm of y.
    pub relative: f64,
    /// Standard deviations of the slopes, rising group first.
    pub sd: Vec<f64>,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Learns a record, sample by sample, with the noise taken from the record where the settings name none.
pub fn identify_slip(x: &[f64], y: &[f64], mut settings: SlipSettings) -> Result<LearntSlip> {
    if settings.noise_sd == 0.0 {
        settings.noise_sd = noise(y);
    }
    let mut learner = SlipLearner::new(settings)?;
    learner.run(x, y)?;
    let model = learner.model()?;
    model.check()?;
    let stretches = [learner.stretch(1.0), learner.stretch(-1.0)];
    let learnt: Vec<&Stretch> = stretches.into_iter().filter(|s| !s.elements.is_empty()).collect();
    let first = learnt.iter().map(|s| s.rows.0).min().unwrap_or(0);
    let last = learnt.iter().map(|s| s.rows.1).max().unwrap_or(0);
    let (x_used, y_used) = (&x[first..=last], &y[first..=last]);
    let errors: Vec<f64> = model.start().run(x_used).iter().zip(y_used).map(|(m, y)| y - m).collect();
    let N = errors.len();
    let (e2, y2) = (sum_of_squares(&errors), sum_of_squares(y_used));
    let rms = (e2 / N as f64).sqrt();
    let sd = learnt.iter().flat_map(|s| &s.P).map(|P| rms * P.sqrt()).collect();
    let notes = doubts(stretches, learner.settings(), x, y);
    let worst = errors.iter().fold(0.0, |most: f64, e| most.max(e.abs()));
    Ok(LearntSlip {
        model,
        N,
        rms,
        worst,
        relative: if e2 > 0.0 { (e2 / y2).sqrt() } else { 0.0 },
        sd,
        notes,
    })
}

/// Standard deviation of the noise of a smooth signal. The mean, since the median of a quantised one is two times off.
fn noise(y: &[f64]) -> f64 {
    let fourth = y.windows(5).map(|w| (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).abs());
    let n = y.len().saturating_sub(4).max(1) as f64;
    fourth.sum::<f64>() / n * (std::f64::consts::FRAC_PI_2 / 70.0).sqrt()
}

fn sum_of_squares(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// Least step between two neighbours that differ.
fn quantum(y: &[f64]) -> f64 {
    let steps = y.windows(2).map(|w| (w[1] - w[0]).abs());
    steps.filter(|&d| d > 0.0).fold(f64::INFINITY, f64::min)
}

fn range(x: &[f64]) -> f64 {
    x.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b)) - x.iter().fold(f64::INFINITY, |a, b| a.min(*b))
}

fn doubts(stretches: [&Stretch; 2], settings: &SlipSettings, x: &[f64], y: &[f64]) -> Vec<Note> {
    let n = stretches.map(|s| s.elements.len()).into_iter().max().unwrap_or(0);
    let all = [below_noise(settings), below_quantum(settings, y), many(n, settings, y), part(stretches, x)];
    all.into_iter().flatten().collect()
}

fn below_noise(settings: &SlipSettings) -> Option<Note> {
    let ratio = settings.threshold / settings.noise_sd;
    (ratio < SOUND && settings.patience() == 1).then(|| {
        let text = format!("the threshold is {ratio:.1} standard deviations of the noise: it opens elements");
        Note::warning("S01", text).measured(ratio, SOUND).remedy("consecutive=3, or a larger threshold")
    })
}

fn below_quantum(settings: &SlipSettings, y: &[f64]) -> Option<Note> {
    let quantum = quantum(y);
    (settings.threshold < quantum && quantum.is_finite()).then(|| {
        let text = format!("y moves in steps of {quantum:.4}, more than the threshold");
        Note::warning("S02", text).measured(quantum, settings.threshold).remedy("take a larger threshold")
    })
}

fn many(n: usize, settings: &SlipSettings, y: &[f64]) -> Option<Note> {
    let most = MANY * (range(y) / settings.threshold).sqrt();
    (n as f64 > most.max(4.0)).then(|| {
        let text = format!("{n} elements in one direction: they follow the noise, or kinks of the loop");
        let note = Note::warning("S03", text).count(n).measured(n as f64, most);
        note.remedy("take a larger threshold, or more consecutive exceedances")
    })
}

fn part(stretches: [&Stretch; 2], x: &[f64]) -> Option<Note> {
    let range = range(x);
    let [up, down] = stretches.map(|s| s.travel / range);
    (up.min(down) < WHOLE).then(|| {
        let text = format!(
            "no whole cycle: the longest rise covers {:.0} % of the input's range, the longest fall {:.0} %",
            100.0 * up,
            100.0 * down
        );
        let note = Note::warning("S04", text).measured(up.min(down), WHOLE);
        note.remedy("record a cycle from the lowest input up and back; give `band` where the input is noisy")
    })
}
