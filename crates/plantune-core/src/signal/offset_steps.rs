//! Steps of the level of a signal: where a load came on, and how large it is.
//!
//! ```text
//! S(c) = (n1 n2 / N) (mean2 - mean1)^2 / s2     what one step at c takes from the sum of squares  Hinkley 1970
//! split at the largest S while it is above 2 ln N + 3, then both parts again                      Vostrikova 1981
//! coloured noise: S divided by r = 1 + 2 sum R(l), long-run variance over variance, R of the signal without
//! the steps found, up to its first value below 1/sqrt(N); three rounds, for each needs the other
//! sd of a step: sqrt(s2 r (1/n1 + 1/n2)), n1 and n2 the rows on its two sides up to the next step
//! ```
//!
//! In white noise the limit makes a false step in about one of 300 signals. A ramp would be cut into stairs;
//! where a straight line explains more than the steps found, for its fewer parameters, it is said instead.

use std::ops::Range;

use super::correlate;

/// Rows between two steps, and from either end.
const LEAST_ROWS: usize = 10;

/// What the limit is above `2 ln N`.
const MARGIN: f64 = 3.0;

/// Most steps.
const MOST: usize = 20;

/// Rounds of steps and colour.
const ROUNDS: usize = 3;

/// Lags of the long-run variance.
const LAGS: usize = 200;

/// What the level of a signal does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OffsetSteps {
    /// First row of each new level, ascending.
    pub at: Vec<usize>,
    /// How much the level changes there.
    pub sizes: Vec<f64>,
    /// Standard deviation of each size.
    pub sd: Vec<f64>,
    /// Level of each part, one more than there are steps.
    pub levels: Vec<f64>,
    /// Long-run variance over variance.
    pub ratio: f64,
    /// Slope per row, where a straight line explains more than a step; there are no steps then.
    pub slope: Option<f64>,
}

/// Finds the steps of a signal, or its line.
pub fn offset_steps(e: &[f64]) -> OffsetSteps {
    let steps = level_steps(e);
    match line(e, &steps).filter(|_| !steps.at.is_empty()) {
        Some(slope) => OffsetSteps { slope: Some(slope), ..measured(e, Vec::new(), steps.ratio) },
        None => steps,
    }
}

/// The steps of a signal that is known to have no line.
pub fn level_steps(e: &[f64]) -> OffsetSteps {
    let N = e.len();
    let limit = 2.0 * (N.max(2) as f64).ln() + MARGIN;
    let (mut at, mut ratio): (Vec<usize>, f64) = (Vec::new(), 1.0);
    for _ in 0..ROUNDS {
        let mut found = Vec::new();
        split(e, 0, ratio * limit, &mut found);
        found.truncate(MOST);
        let same = found == at;
        at = found;
        let next = long_run_ratio(e, &at);
        if same && (next - ratio).abs() <= 1e-6 * ratio {
            break;
        }
        ratio = next;
    }
    measured(e, at, ratio)
}

/// The steps of one part and of the parts of it, in order.
fn split(e: &[f64], first: usize, limit: f64, found: &mut Vec<usize>) {
    let Some((c, _)) = best(e).filter(|(_, S)| *S >= limit) else { return };
    split(&e[..c], first, limit, found);
    found.push(first + c);
    split(&e[c..], first + c, limit, found);
}

/// The row at which one step takes most of the sum of squares, and how much, over the variance left.
fn best(e: &[f64]) -> Option<(usize, f64)> {
    let N = e.len();
    if N < 2 * LEAST_ROWS {
        return None;
    }
    let middle = mean(e);
    let rss: f64 = e.iter().map(|e| (e - middle).powi(2)).sum();
    if rss == 0.0 {
        return None;
    }
    let (mut before, mut best) = (0.0, None);
    for (c, e) in (1..N).zip(e) {
        before += e - middle;
        if c < LEAST_ROWS || c + LEAST_ROWS > N {
            continue;
        }
        // Centred sums of both sides are opposite: (n1 n2/N) (mean2 - mean1)^2 = before^2 N/(n1 n2).
        let gain = before * before * N as f64 / (c as f64 * (N - c) as f64);
        let S = gain / ((rss - gain).max(1e-12 * rss) / (N - 2) as f64);
        if best.is_none_or(|(_, most)| S > most) {
            best = Some((c, S));
        }
    }
    best
}

/// Slope per row, where a straight line explains more than the steps do: by BIC, a line for one parameter and
/// a step for two, with as many rows as the colour leaves.
fn line(e: &[f64], steps: &OffsetSteps) -> Option<f64> {
    let (middle, level) = ((e.len() as f64 - 1.0) / 2.0, mean(e));
    let (mut te, mut tt, mut rss) = (0.0, 0.0, 0.0);
    for (k, e) in e.iter().enumerate() {
        let t = k as f64 - middle;
        (te, tt, rss) = (te + t * e, tt + t * t, rss + (e - level).powi(2));
    }
    let left = rss - te * te / tt;
    let N = e.len() as f64;
    let bic = |left: f64, n: usize| N / steps.ratio * (left / rss).max(1e-12).ln() + n as f64 * N.ln();
    (bic(left, 1) < bic(rss_of(e, steps), 2 * steps.at.len())).then_some(te / tt)
}

/// Sum of squares that the steps leave.
fn rss_of(e: &[f64], steps: &OffsetSteps) -> f64 {
    let of_part =
        |(part, level): (Range<usize>, &f64)| -> f64 { e[part].iter().map(|e| (e - level).powi(2)).sum() };
    parts(&steps.at, e.len()).into_iter().zip(&steps.levels).map(of_part).sum()
}

/// Long-run variance over variance of the signal without its steps, at least 1.
fn long_run_ratio(e: &[f64], at: &[usize]) -> f64 {
    let mut rest = e.to_vec();
    for part in parts(at, e.len()) {
        let level = mean(&e[part.clone()]);
        rest[part].iter_mut().for_each(|e| *e -= level);
    }
    let R = correlate(&rest, &rest);
    let (most, small) = (LAGS.min(e.len() / 4), 1.0 / (e.len() as f64).sqrt());
    if !(R.first().is_some_and(|r| *r > 0.0)) {
        return 1.0;
    }
    let lags = R[1..].iter().take(most).map(|r| r / R[0]).take_while(|r| *r >= small);
    (1.0 + 2.0 * lags.sum::<f64>()).max(1.0)
}

/// Sizes and their standard deviations.
fn measured(e: &[f64], at: Vec<usize>, ratio: f64) -> OffsetSteps {
    let parts = parts(&at, e.len());
    let levels: Vec<f64> = parts.iter().map(|part| mean(&e[part.clone()])).collect();
    let sizes = levels.windows(2).map(|w| w[1] - w[0]).collect();
    let mut steps = OffsetSteps { at, sizes, levels, ratio, ..OffsetSteps::default() };
    let s2 = rss_of(e, &steps) / e.len().saturating_sub(parts.len()).max(1) as f64;
    let sd = |w: &[Range<usize>]| (s2 * ratio * (1.0 / w[0].len() as f64 + 1.0 / w[1].len() as f64)).sqrt();
    steps.sd = parts.windows(2).map(sd).collect();
    steps
}

/// Rows between steps.
fn parts(at: &[usize], N: usize) -> Vec<Range<usize>> {
    let edges = [&[0], at, &[N]].concat();
    edges.windows(2).map(|w| w[0]..w[1]).collect()
}

fn mean(e: &[f64]) -> f64 {
    e.iter().sum::<f64>() / e.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    #[test]
    fn steps_are_found_and_not_invented() {
        let mut found = 0;
        for seed in 0..40 {
            let mut e = white(1000, seed);
            assert!(offset_steps(&e).at.is_empty(), "{seed}");
            e[400..].iter_mut().for_each(|e| *e += 2.0);
            let steps = offset_steps(&e);
            found += usize::from(matches!(steps.at[..], [c] if c.abs_diff(400) <= 5));
        }
        assert!(found >= 38, "{found}");
    }

    #[test]
    fn a_ramp_is_a_line() {
        let e: Vec<f64> = white(1000, 7).iter().enumerate().map(|(k, e)| e + 0.003 * k as f64).collect();
        let found = offset_steps(&e);
        assert!(found.at.is_empty());
        assert!((found.slope.expect("a line") - 0.003).abs() < 5e-4);
    }

    #[test]
    fn a_signal_without_noise_or_motion_has_exact_steps_or_none() {
        let stairs: Vec<f64> = (0..90).map(|k| f64::from(k / 30)).collect();
        assert_eq!(offset_steps(&stairs).sizes, [1.0, 1.0]);
        assert_eq!(offset_steps(&stairs).at, [30, 60]);
        assert!(offset_steps(&[3.0; 50]).at.is_empty());
        assert!(offset_steps(&[]).at.is_empty());
    }
}
