//! Histogram of a signal: its bins, and the normal law beside it.
//!
//! ```text
//! width = 2 IQR / N^(1/3)                       Freedman and Diaconis 1981
//! bins  = ceil(range / width), equal, from the least value to the greatest
//! ```
//!
//! A signal read in steps `q` has bins of a whole number of steps, with its values in their middle: other bins would
//! hold now one value and now two, and show a comb that is not there. Where the quartiles agree the rule has no
//! width and Sturges' `1 + log2 N` bins are taken. Source 001, 3.5.2 b.

use crate::stats::quantile;

/// More bins than this no picture shows.
const MOST: usize = 200;

/// How the bins were chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// By the quartiles.
    FreedmanDiaconis,
    /// By the same, in whole steps of reading.
    Steps,
    /// By the number of rows.
    Sturges,
}

impl Rule {
    /// In words.
    pub fn as_str(self) -> &'static str {
        match self {
            Rule::FreedmanDiaconis => "Freedman-Diaconis: 2 IQR/N^(1/3) wide",
            Rule::Steps => "Freedman-Diaconis, in whole steps of reading",
            Rule::Sturges => "Sturges: 1 + log2 N bins",
        }
    }
}

/// Counts per bin.
#[derive(Clone, Debug)]
pub struct Histogram {
    /// Ends of the bins.
    pub edges: Vec<f64>, // (bins + 1)
    /// Their middles.
    pub centres: Vec<f64>, // (bins)
    /// Rows in each; a bin holds its lower end, the last one both.
    pub counts: Vec<usize>, // (bins)
    /// Share of the rows per unit of the signal.
    pub density: Vec<f64>, // (bins)
    /// The same of a normal law of that mean and variance, at the middles.
    pub normal: Vec<f64>, // (bins)
    /// How the bins were chosen.
    pub rule: Rule,
}

/// Histogram of values that are not all the same; `quantum` is the step in which they are read.
pub fn histogram(y: &[f64], quantum: Option<f64>) -> Histogram {
    let mut sorted = y.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (rule, edges) = edges(&sorted, quantum);
    let bins = edges.len() - 1;
    let (N, mean) = (y.len() as f64, y.iter().sum::<f64>() / y.len() as f64);
    let var = y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / N;
    let below = |edge: f64| sorted.partition_point(|y| *y < edge);
    let ends: Vec<usize> =
        (0..=bins).map(|k| if k == bins { sorted.len() } else { below(edges[k]) }).collect();
    let counts: Vec<usize> = ends.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let centres: Vec<f64> = edges.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    let law = |x: &f64| (-(x - mean).powi(2) / (2.0 * var)).exp() / (std::f64::consts::TAU * var).sqrt();
    Histogram {
        density: counts.iter().zip(edges.windows(2)).map(|(c, e)| *c as f64 / (N * (e[1] - e[0]))).collect(),
        normal: centres.iter().map(law).collect(),
        edges,
        centres,
        counts,
        rule,
    }
}

fn edges(sorted: &[f64], quantum: Option<f64>) -> (Rule, Vec<f64>) {
    let (low, high, N) = (sorted[0], sorted[sorted.len() - 1], sorted.len() as f64);
    let wish = 2.0 * (quantile(sorted, 0.75) - quantile(sorted, 0.25)) / N.cbrt();
    if let Some(q) = quantum {
        let steps = ((high - low) / q).round();
        let each = (wish / q).round().max(1.0).max((steps / MOST as f64).ceil());
        let bins = (steps / each).floor() as usize + 1;
        return (Rule::Steps, (0..=bins).map(|k| low + q * (each * k as f64 - 0.5)).collect());
    }
    let (rule, bins) = if wish > 0.0 {
        (Rule::FreedmanDiaconis, ((high - low) / wish).ceil())
    } else {
        (Rule::Sturges, (1.0 + N.log2()).ceil())
    };
    let bins = bins.clamp(1.0, MOST as f64);
    (rule, (0..=bins as usize).map(|k| low + (high - low) * k as f64 / bins).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    #[test]
    fn every_row_is_in_one_bin_and_the_area_is_one() {
        let y = white(1000, 5);
        let read: Vec<f64> = y.iter().map(|y| (y / 0.2).round() * 0.2).collect();
        for (y, q) in [(&y, None), (&read, Some(0.2))] {
            let found = histogram(y, q);
            assert_eq!(found.counts.iter().sum::<usize>(), 1000);
            let area: f64 =
                found.density.iter().zip(found.edges.windows(2)).map(|(d, e)| d * (e[1] - e[0])).sum();
            assert!((area - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn steps_of_reading_lie_in_the_middle_of_bins() {
        let y: Vec<f64> = white(1000, 5).iter().map(|y| (y / 0.5).round() * 0.5).collect();
        let found = histogram(&y, Some(0.5));
        assert_eq!(found.rule, Rule::Steps);
        assert!(found.centres.iter().all(|c| ((c / 0.5).round() * 0.5 - c).abs() < 1e-9));
        assert!(found.counts.iter().all(|&c| c > 0), "no comb: {:?}", found.counts);
    }
}
