//! Whether an output has anything to do with an input, before a model is believed.

use crate::error::Error;
use crate::limits::Limits;
use crate::linalg::{Triangle, dot, residual_norm2};
use crate::note::Place;
use crate::record::Record;
use crate::signal::correlate;
use crate::stats::{f_tail, median, normal_quantile};

/// Autoregression that takes up the colour of the output.
const COLOUR: usize = 4;

/// Chance that the largest correlation of unrelated signals, of all lags searched, passes for an answer.
const FALSE_ALARM: f64 = 1e-3;

/// Changes of u that a lag must leave in the record.
const LEAST_MOVES: f64 = 10.0;

/// p-value of the explanation `w` of the output `y`, both on consecutive rows of one segment each.
///
/// An autoregression stands for the colour of y, so that two slow signals that have nothing to do with each
/// other are not taken as related: `y(t)` on its past and 1, without and with `w(t), w(t-1), w(t-2)`.
pub fn chance(segments: &[(Vec<f64>, Vec<f64>)]) -> f64 {
    let n = COLOUR + 1 + 3;
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (y, w) in segments {
        for t in COLOUR..y.len() {
            let mut row: Vec<f64> = (1..=COLOUR).map(|lag| y[t - lag] - y[0]).collect();
            row.push(1.0);
            row.extend((0..3).map(|lag| w[t - lag] - w[0]));
            row.push(y[t] - y[0]);
            rows.push(row);
        }
    }
    if rows.len() <= n + 1 {
        return 1.0;
    }
    let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
    let own: Vec<usize> = (0..=COLOUR).collect();
    let all: Vec<usize> = (0..n).collect();
    let (without, with) =
        (residual_norm2(&triangle, &own, n, 1e-12), residual_norm2(&triangle, &all, n, 1e-12));
    let freedom = (rows.len() - n) as f64;
    f_tail((without - with) / 3.0 / (with / freedom).max(f64::MIN_POSITIVE), 3.0, freedom)
}

/// A delay from `first` samples on at which changes of y clearly follow changes of u, if there is one.
///
/// The correlation at a lag, times the root of its rows, is about normal where the two are unrelated: of
/// deviation 1 if either is white, of more if both are coloured (Bartlett). As most lags hold no answer,
/// the middle magnitude tells that deviation, and the largest must stand out from as many normal numbers
/// as there are lags.
pub fn follows_later(rec: &Record, input: usize, first: usize) -> Option<usize> {
    late_answer(rec, input, first).map(|(lag, _)| lag)
}

/// The input that y follows most clearly from `first` samples on, and the lag.
pub fn follows_some_later(rec: &Record, first: usize) -> Option<(usize, usize)> {
    let answers = (0..rec.nu).filter_map(|i| Some((i, late_answer(rec, i, first)?)));
    answers.max_by(|a, b| a.1.1.total_cmp(&b.1.1)).map(|(i, (lag, _))| (i, lag))
}

/// The lag, and how many deviations of chance its correlation is.
fn late_answer(rec: &Record, input: usize, first: usize) -> Option<(usize, f64)> {
    let (u, y) = (changes(&rec.input(input)), changes(&rec.output_held(0)));
    let (r, u_size, y_size) = (correlate(&u, &y), sizes(u.iter()), sizes(y.iter().rev()));
    let moves = running(u.iter().map(|x| f64::from(*x != 0.0)));
    let size = |lag: usize| u_size[u.len() - lag] * y_size[u.len() - lag];
    let strength = |lag: usize, r: f64| (r / size(lag)).abs() * ((u.len() - lag) as f64).sqrt();
    let lags = (first..u.len().min(rec.N() - rec.N() / 10))
        .filter(|&lag| moves[u.len() - lag] >= LEAST_MOVES && size(lag) > 0.0);
    let found: Vec<(usize, f64)> = lags.map(|lag| (lag, strength(lag, r[lag]))).collect();
    let &(lag, _) = found.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    // The transform rounds by the whole record, which is much where most of y's motion is before the lag.
    let largest = strength(lag, dot(&u[..u.len() - lag], &y[lag..]));
    let bar = normal_quantile(1.0 - FALSE_ALARM / found.len() as f64);
    let middle = median(found.into_iter().map(|(_, strength)| strength).collect());
    let size = largest / (middle / normal_quantile(0.5)).max(1.0);
    (size > bar).then_some((lag, size))
}

fn changes(x: &[f64]) -> Vec<f64> {
    x.windows(2).map(|w| w[1] - w[0]).collect()
}

/// Norm of the first `n` values, for each `n`.
fn sizes<'a>(x: impl Iterator<Item = &'a f64>) -> Vec<f64> {
    running(x.map(|x| x * x)).into_iter().map(f64::sqrt).collect()
}

/// Sum of the first `n` values, for each `n` from 0 on.
fn running(x: impl Iterator<Item = f64>) -> Vec<f64> {
    let sums = x.scan(0.0, |sum, x| {
        *sum += x;
        Some(*sum)
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// X05: y follows u only after more than the allowed share of the record.
pub fn beyond(rec: &Record, input: usize, lag: usize, limits: &Limits) -> Error {
    let name = rec.input_name(input);
    Error::new("X05", format!("y follows {name} only after about {lag} of {} rows", rec.N()))
        .at(Place::column(name))
        .count(rec.N())
        .measured(lag as f64, limits.X05 * rec.N() as f64)
        .remedy("record at least three times as long as the delay")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::poly::divide;
    use crate::signal::prbs;

    /// The lag of the largest correlation by direct sums.
    fn one_by_one(u: &[f64], y: &[f64], first: usize) -> Option<usize> {
        let N = u.len();
        let (u, y) = (changes(u), changes(y));
        let strength = |lag: usize| {
            let (u, y) = (&u[..N - 1 - lag], &y[lag..]);
            (dot(u, y) / (dot(u, u).sqrt() * dot(y, y).sqrt())).abs() * (u.len() as f64).sqrt()
        };
        (first..N - N / 10).max_by(|a, b| strength(*a).total_cmp(&strength(*b)))
    }

    fn found(u: &[f64], y: &[f64], first: usize) -> Option<usize> {
        follows_later(&Record::uniform(u, 1, y, 1, 0.1).expect("fine"), 0, first)
    }

    #[test]
    fn a_late_answer_is_found_as_by_direct_sums() {
        let u = prbs(600, 3, 9, 1).expect("a sequence");
        for (seed, delay) in [(1, 210), (2, 340), (3, 450)] {
            let noise = white(600, seed);
            let late: Vec<f64> =
                (0..600).map(|t| if t < delay { 0.0 } else { u[t - delay] } + 0.05 * noise[t]).collect();
            assert_eq!(found(&u, &late, 200), Some(delay));
            assert_eq!(one_by_one(&u, &late, 200), Some(delay));
            assert_eq!(found(&u, &noise, 200), None);
        }
    }

    /// `x(t) = c1 x(t-1) + c2 x(t-2) + e(t)`.
    fn coloured(N: usize, seed: u64, c1: f64, c2: f64) -> Vec<f64> {
        let mut x = white(N, seed);
        divide(&[1.0, -c1, -c2], &mut x);
        x
    }

    /// A stated rate is a chance for each record: about one of these 2000 may be above the bar.
    #[test]
    fn unrelated_signals_of_any_colour_follow_nothing() {
        let colours = [(0.0, 0.0), (1.0, 0.0), (0.95, 0.0), (1.9, -0.9025), (1.815, -0.9025)];
        let mut alarms = 0;
        for (i, (u1, u2)) in colours.into_iter().enumerate() {
            for (j, (y1, y2)) in colours.into_iter().enumerate() {
                for seed in 0..80 {
                    let seed = (1000 * i + 100 * j) as u64 + seed;
                    let (u, y) = (coloured(600, seed, u1, u2), coloured(600, 10_000 + seed, y1, y2));
                    alarms += usize::from(found(&u, &y, 200).is_some());
                }
            }
        }
        assert!(alarms <= 6, "{alarms}");
    }

    /// Where both are white, their changes are not: the deviation is 1.22, and the largest of many above 6.
    #[test]
    fn long_unrelated_noise_follows_nothing() {
        for seed in [5, 17, 24] {
            assert_eq!(found(&white(100_000, seed), &white(100_000, 100 + seed), 33_333), None);
        }
    }

    #[test]
    fn rounding_of_a_large_early_change_is_no_answer() {
        let u = prbs(600, 3, 9, 1).expect("a sequence");
        let mut y = white(600, 4);
        y[5] = 1e17;
        assert_eq!(found(&u, &y, 200), None);
    }

    #[test]
    fn a_few_rows_follow_nothing() {
        for N in 2..12 {
            assert_eq!(found(&white(N, 1), &white(N, 2), 0), None);
        }
    }
}
