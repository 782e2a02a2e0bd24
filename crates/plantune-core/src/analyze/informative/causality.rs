//! Whether one signal drives another over a window of rows, whatever the delay between them.
//!
//! ```text
//! y(t) = -a1 y(t-1) - a2 y(t-2) + sum_k g_k L_k(q) u(t) + d + e(t),    k = 1 … 6
//! L_1 = sqrt(1 - al^2) / (q - al),    L_k = L_(k-1) (1 - al q) / (q - al)
//! F = ((RSS_0 - RSS) / 6) / (RSS / (N - 9)),    RSS_0 with all g_k = 0
//! ```
//!
//! Six Laguerre filters stand for the response: unlike lagged inputs they reach back over several time
//! constants without knowing the delay. The condition number is that of the centred columns, each scaled to
//! length one: where a controller at rest makes u of past y, the columns of u are nearly those of y.
//!
//! Granger 1969; Bittencourt, Isaksson, Peretzki and Forsman, Processes 2015, 3:357.

use crate::linalg::{Block, Singular, Triangle, residual_norm2};
use crate::stats::f_tail;

/// Lags of the driven signal.
const OWN: usize = 2;

/// Laguerre filters.
const FILTERS: usize = 6;

/// Their pole; 0.7 to 0.9 find the same stretches within 5 %.
const POLE: f64 = 0.8;

/// Rows after which the unknown past of the filters is forgotten: `3 / (1 - al)`.
const SKIPPED: usize = 15;

/// Columns besides the constant, and the constant.
const COLUMNS: usize = OWN + FILTERS;

/// Rows that a window needs to say anything.
pub(super) const LEAST_ROWS: usize = 3 * (COLUMNS + 1) + SKIPPED;

/// What a window says of one signal driving another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Causality {
    /// Condition number of the regressor; infinite where a column is constant.
    pub(super) condition: f64,
    /// F statistic of the filters.
    pub(super) F: f64,
    /// Chance of one as large where nothing drives.
    pub(super) p: f64,
}

/// What `cause`, strictly before, does to `effect`.
pub(super) fn causality(cause: &[f64], effect: &[f64]) -> Causality {
    let triangle = regression(cause, effect);
    let N = effect.len() - SKIPPED;
    let nothing = Causality { condition: f64::INFINITY, F: 0.0, p: 1.0 };
    let lengths: Vec<f64> =
        (0..COLUMNS).map(|j| (0..=j).map(|i| triangle.at(i, j).powi(2)).sum::<f64>().sqrt()).collect();
    if lengths.contains(&0.0) {
        return nothing;
    }
    let values = Singular::of(&triangle, &lengths).values;
    let (largest, least) = (values[0], values[COLUMNS - 1]);
    if least < 1e-13 * largest {
        return nothing;
    }
    let rss =
        |columns: usize| residual_norm2(&triangle, &(0..columns).collect::<Vec<usize>>(), COLUMNS, 1e-13);
    let (without, with, freedom) = (rss(OWN), rss(COLUMNS), (N - COLUMNS - 1) as f64);
    let F = (without - with) / FILTERS as f64 / (with / freedom).max(f64::MIN_POSITIVE);
    Causality { condition: largest / least, F, p: f_tail(F, FILTERS as f64, freedom) }
}

/// Triangle of the centred columns `[y(t-1), y(t-2), L_1 u … L_6 u | y(t)]`.
fn regression(cause: &[f64], effect: &[f64]) -> Triangle {
    let (mut triangle, mut block) = (Triangle::new(COLUMNS + 2), Block::new(COLUMNS + 2));
    let mut filters = Laguerre::default();
    let from = |k: usize| cause[k] - cause[0];
    for t in 0..effect.len() {
        if t > 0 {
            filters.step(from(t - 1));
        }
        if t < SKIPPED {
            continue;
        }
        let y = |lag: usize| effect[t - lag] - effect[0];
        let mut row = [1.0; COLUMNS + 2];
        (row[1], row[2]) = (y(1), y(2));
        row[1 + OWN..1 + COLUMNS].copy_from_slice(&filters.x);
        row[1 + COLUMNS] = y(0);
        block.push(&row);
    }
    triangle.absorb(&mut block);
    triangle.below(1) // the rows that the constant leaves: centred columns
}

/// The outputs of the filters, at rest before the first input.
#[derive(Default)]
struct Laguerre {
    x: [f64; FILTERS],
}

impl Laguerre {
    /// Takes the input of the row before.
    fn step(&mut self, u: f64) {
        let mut behind = self.x[0];
        self.x[0] = POLE * self.x[0] + (1.0 - POLE * POLE).sqrt() * u;
        for k in 1..FILTERS {
            let own = self.x[k];
            self.x[k] = POLE * own - POLE * self.x[k - 1] + behind;
            behind = own;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{dot, white};

    #[test]
    fn laguerre_responses_are_orthonormal() {
        let mut filters = Laguerre::default();
        let mut columns = vec![Vec::new(); FILTERS];
        for t in 0..600 {
            filters.step(f64::from(u8::from(t == 0)));
            columns.iter_mut().zip(filters.x).for_each(|(column, x)| column.push(x));
        }
        for i in 0..FILTERS {
            for j in 0..=i {
                let expected = f64::from(u8::from(i == j));
                assert!((dot(&columns[i], &columns[j]) - expected).abs() < 1e-12, "{i} {j}");
            }
        }
    }

    #[test]
    fn what_drives_is_told_from_what_is_driven() {
        let (u, e) = (white(200, 3), white(200, 4));
        let mut y = vec![0.0; 200];
        for t in 5..200 {
            y[t] = 0.8 * y[t - 1] + 0.5 * u[t - 5] + 0.3 * e[t];
        }
        assert!(causality(&u, &y).p < 1e-6);
        assert!(causality(&y, &u).p > 1e-3);
    }

    #[test]
    fn a_signal_that_rests_drives_nothing() {
        let still = causality(&[2.0; 100], &white(100, 1));
        assert_eq!((still.F, still.p, still.condition), (0.0, 1.0, f64::INFINITY));
    }
}
