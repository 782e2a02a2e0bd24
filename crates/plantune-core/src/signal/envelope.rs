//! Fewer points for drawing, without losing a peak.

use std::ops::Range;

/// Rows that keep the first, last, least and greatest value of each of `buckets` equal stretches of `range`.
pub fn envelope(y: &[f64], range: Range<usize>, buckets: usize) -> Vec<usize> {
    let n = range.len();
    if n <= 4 * buckets {
        return range.collect();
    }
    let mut rows = Vec::with_capacity(4 * buckets);
    for b in 0..buckets {
        let bucket = range.start + b * n / buckets..range.start + (b + 1) * n / buckets;
        let by_value = |i: &usize, j: &usize| y[*i].total_cmp(&y[*j]);
        let mut kept: Vec<usize> = [
            Some(bucket.start),
            bucket.clone().min_by(by_value),
            bucket.clone().max_by(by_value),
            Some(bucket.end - 1),
        ]
        .into_iter()
        .flatten()
        .collect();
        kept.sort_unstable();
        kept.dedup();
        rows.extend(kept);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_spike_survives() {
        let mut y = vec![0.0; 100_000];
        y[54_321] = 9.0;
        let rows = envelope(&y, 0..y.len(), 100);
        assert!(rows.contains(&54_321) && rows.len() <= 400);
    }
}
