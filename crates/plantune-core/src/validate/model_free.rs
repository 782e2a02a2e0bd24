//! The model beside what the record says without one: V16 where its step response is another.
//!
//! ```text
//! v(t) = y(t) - yhat(t)                              errors of the simulation
//! D v(t) = O + sum_b delta_b sum_{k in b} D u(t-k) + e(t),     all delta = 0 where the model is true
//! g = g_model + delta,   s = s_model + sum delta
//! F = (RSS_0 - RSS) / B / (RSS / (N - B - 1)) / (1 + N / N_fit)
//! ```
//!
//! The bins `b` of lags are single ones around the model's delay and grow twofold behind it, until its step response
//! has settled: a dozen numbers stand for the impulse response, whatever the sample time, and cost a
//! fraction of what the simulation does. `1 + N/N_fit` allows for the error of the model itself, fitted on `N_fit` rows.
//! `D` comes from `v(t)` on its own past beside the bins, its order by AIC: then neither coloured noise nor feedback
//! counts as a difference. Lags begin at 1 unless the model answers at once.
//!
//! What is off is the one change of the model that explains most of the difference,
//!
//! ```text
//! gain  delta s = a s_k,   delay  s_{k-m} - s_k,   time constant  s_{nk + (k-nk)/r} - s_k
//! ```
//!
//! or, where none explains most, the shape. Ljung 1999, 16.5 and 16.6; METHODS 2.3.

use std::ops::Range;

use crate::limits::Limits;
use crate::linalg::{Block, Triangle, residual_norm2, solve};
use crate::model::Model;
use crate::note::{Note, Place, rounded};
use crate::record::Record;
use crate::signal::through;
use crate::stats::f_tail;

/// Chance of a false alarm per input.
const CHANCE: f64 = 1e-3;

/// Largest order of the noise model.
const MOST_NOISE: usize = 10;

/// Bins of one lag before and behind the delay.
const BEFORE: usize = 2;
const BEHIND: usize = 2;

/// Share of the final value within which a step response has settled.
const SETTLED: f64 = 0.05;

/// Peak of a step response, as a share of its final value, from which it oscillates.
const OVERSHOOT: f64 = 1.2;

/// Largest lag as a share of the rows, and rows per column.
const REACH: usize = 4;
const ROWS: usize = 5;

/// Columns that depend on others to this degree add nothing.
const DEPENDENT: f64 = 1e-8;

/// Share of the difference that one change must explain to be named.
const NAMED: f64 = 0.7;

/// V16 of each input whose response differs by more than the uncertainty and more than the limit.
///
/// `errors` are those of the simulation, one per row of `rows`; the model was fitted on `fitted` rows.
pub(super) fn model_free(
    model: &Model,
    rec: &Record,
    (rows, errors): (&[usize], &[f64]),
    fitted: Option<usize>,
    limits: &Limits,
) -> Vec<Note> {
    let settles = model.dc_gain().iter().all(|gain| gain.is_finite());
    if !settles || errors.len() < 2 * ROWS * REACH {
        return Vec::new();
    }
    let curve = |i: usize| Curve::of(model, i, rec.Ts, errors.len() / REACH);
    let Some(curves) = (0..rec.nu).map(curve).collect::<Option<Vec<Curve>>>() else { return Vec::new() };
    let study = Study::new(rec, (rows, errors), curves);
    (0..rec.nu).filter_map(|i| study.note(i, fitted, limits)).collect()
}

/// The regression of the errors on the bins of all inputs.
struct Study<'r, 'a> {
    rec: &'r Record<'a>,
    curves: Vec<Curve>,
    /// Errors of the simulation; zero where a row has none.
    v: Vec<f64>, // (N)
    has_error: Vec<bool>, // (N)
    D: Vec<f64>,
    triangle: Triangle, // [1 | bins | D v]
    N: usize,
}

impl<'r, 'a> Study<'r, 'a> {
    fn new(rec: &'r Record<'a>, (rows, errors): (&[usize], &[f64]), curves: Vec<Curve>) -> Self {
        let (mut v, mut has_error) = (vec![0.0; rec.N()], vec![false; rec.N()]);
        for (&t, e) in rows.iter().zip(errors) {
            (v[t], has_error[t]) = (*e, true);
        }
        let triangle = Triangle::new(1);
        let mut study = Study { rec, curves, v, has_error, D: vec![1.0], triangle, N: 0 };
        study.D = study.noise_model();
        (study.triangle, study.N) = study.regression(0);
        study
    }

    /// V16 of input `i`.
    fn note(&self, i: usize, fitted: Option<usize>, limits: &Limits) -> Option<Note> {
        let curve = &self.curves[i];
        let n = self.triangle.n() - 1;
        let first = 1 + self.curves[..i].iter().map(|c| c.bins.len()).sum::<usize>();
        let own = first..first + curve.bins.len();
        let all = independent(&self.triangle, n);
        let others: Vec<usize> = all.iter().copied().filter(|j| !own.contains(j)).collect();
        let (B, freedom) = (all.len() - others.len(), self.N.saturating_sub(all.len()));
        if B == 0 || freedom < ROWS * all.len() {
            return None;
        }
        let rss = |columns: &[usize]| residual_norm2(&self.triangle, columns, n, 0.0);
        let (without, with) = (rss(&others), rss(&all));
        let of_model = 1.0 + fitted.map_or(0.0, |rows| self.N as f64 / rows as f64);
        let (B, freedom) = (B as f64, freedom as f64);
        let F = (without - with) / B / (with / freedom).max(f64::MIN_POSITIVE) / of_model;
        if f_tail(F, B, freedom) > CHANCE {
            return None;
        }
        let theta = solve(&self.triangle, &all, n, 0.0).ok()?.theta;
        let mut delta = vec![0.0; curve.bins.len()];
        all.iter().zip(theta).filter(|(j, _)| own.contains(j)).for_each(|(j, b)| delta[j - first] = b);
        let (lag, apart) = curve.furthest(&delta);
        let share = apart.abs() / curve.size;
        let what = self.what_is_off(i, own, &others, without - with);
        (share > limits.V16).then(|| self.said(i, (lag, apart), &what).measured(share, limits.V16))
    }

    fn said(&self, i: usize, (lag, apart): (usize, f64), what: &str) -> Note {
        let (name, model) = (self.rec.input_name(i), self.curves[i].at(lag as f64));
        let text = format!(
            "the record's own step response to {name} is another{what}: {} at lag {lag}, the model's {}",
            rounded(model + apart),
            rounded(model)
        );
        Note::warning("V16", text)
            .at(Place::column(name))
            .count(self.N)
            .remedy("look at both in plot.impulse; try another delay or a higher order")
    }

    /// `D` from the errors on their own past, beside the bins.
    fn noise_model(&self) -> Vec<f64> {
        let (triangle, N) = self.regression(MOST_NOISE);
        let n = triangle.n() - 1;
        let bins = n - MOST_NOISE;
        let aic = |p: usize| {
            let columns: Vec<usize> = (0..bins + p).collect();
            let rss = residual_norm2(&triangle, &columns, n, DEPENDENT).max(f64::MIN_POSITIVE);
            N as f64 * rss.ln() + 2.0 * p as f64
        };
        let scores: Vec<f64> = (0..=MOST_NOISE).map(aic).collect();
        let p = (0..=MOST_NOISE).fold(0, |best, p| if scores[p] < scores[best] { p } else { best });
        let mut D = vec![1.0];
        if N > ROWS * n {
            D.resize(1 + p, 0.0);
            let kept = independent(&triangle, bins + p);
            let theta = solve(&triangle, &kept, n, 0.0).map(|s| s.theta).unwrap_or_default();
            let own = kept.iter().zip(theta).filter(|(j, _)| **j >= bins);
            own.for_each(|(j, d)| D[1 + j - bins] = d);
        }
        D
    }

    /// Triangle of `[1 | bins | -D v(t-1) … | D v(t)]` with `own` lags of the errors, and its rows.
    fn regression(&self, own: usize) -> (Triangle, usize) {
        let past = self.D.len() - 1;
        let reach = self.curves.iter().map(|c| c.last).max().unwrap_or(0).max(own) + past;
        let v = through(&self.D, &self.v, self.rec.segments());
        let sums: Vec<Vec<f64>> = (0..self.rec.nu).map(|i| self.running_sum(i)).collect();
        let usable = |t: usize| (t - own - past..=t).all(|k| self.has_error[k]);
        let width = 2 + own + self.curves.iter().map(|c| c.bins.len()).sum::<usize>();
        let (mut triangle, mut block, mut N) = (Triangle::new(width), Block::new(width), 0);
        for s in self.rec.segments() {
            let rows: Vec<usize> =
                (s.start + reach..s.end.max(s.start + reach)).filter(|&t| usable(t)).collect();
            for run in rows.chunk_by(|a, b| b - a == 1) {
                let mut columns = self.bins(run, &sums);
                columns.extend((1..=own).map(|lag| run.iter().map(|t| -v[t - lag]).collect()));
                columns.push(run.iter().map(|&t| v[t]).collect());
                fill(&mut block, &columns);
                N += run.len();
            }
        }
        triangle.absorb(&mut block);
        (triangle, N)
    }

    /// `[1 | sum_{k in b} D u(t-k)]` on a run of rows, column by column.
    fn bins(&self, run: &[usize], sums: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut columns = vec![vec![1.0; run.len()]];
        for (curve, sum) in self.curves.iter().zip(sums) {
            let before = |k: usize| if k == 0 { 0.0 } else { sum[k - 1] };
            let bin =
                |b: &Range<usize>| run.iter().map(|t| sum[t - b.start] - before(t + 1 - b.end)).collect();
            columns.extend(curve.bins.iter().map(bin));
        }
        columns
    }

    /// `sum_{j <= t} D u_i(j)`.
    fn running_sum(&self, i: usize) -> Vec<f64> {
        let mut u = through(&self.D, &self.rec.input(i), self.rec.segments());
        let mut sum = 0.0;
        u.iter_mut().for_each(|u| {
            sum += *u;
            *u = sum;
        });
        u
    }

    /// The one change that explains most of what all bins explain, in words.
    fn what_is_off(&self, i: usize, own: Range<usize>, others: &[usize], explained: f64) -> String {
        let alone = |(change, direction): (Change, Vec<f64>)| {
            let (fall, by) = self.along(own.clone(), &direction, others);
            (fall / explained.max(f64::MIN_POSITIVE), change, by)
        };
        let tried = self.curves[i].changes().into_iter().map(alone);
        match tried.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((share, change, by)) if share >= NAMED => change.text(by),
            _ => " in its shape".to_owned(),
        }
    }

    /// Fall of the squared errors by one direction in the bins `own`, and how far along it.
    fn along(&self, own: Range<usize>, direction: &[f64], others: &[usize]) -> (f64, f64) {
        let (n, m) = (self.triangle.n() - 1, others.len());
        let row = |k: usize| {
            let along = own.clone().zip(direction).map(|(j, d)| self.triangle.at(k, j) * d).sum::<f64>();
            let rest = others.iter().map(|&j| self.triangle.at(k, j));
            rest.chain([along, self.triangle.at(k, n)]).collect::<Vec<f64>>()
        };
        let rows: Vec<Vec<f64>> = (0..=n).map(row).collect();
        let triangle = Triangle::of_rows(m + 2, rows.iter().map(Vec::as_slice));
        let (without, with): (Vec<usize>, Vec<usize>) = ((0..m).collect(), (0..=m).collect());
        let left = |columns: &[usize]| residual_norm2(&triangle, columns, m + 1, 0.0);
        let by = solve(&triangle, &with, m + 1, 0.0).map_or(0.0, |s| s.theta[m]);
        (left(&without) - left(&with), by)
    }
}

/// The first `count` columns without those that depend on others.
fn independent(triangle: &Triangle, count: usize) -> Vec<usize> {
    let columns: Vec<usize> = (0..count).collect();
    match solve(triangle, &columns, triangle.n() - 1, DEPENDENT) {
        Ok(_) => columns,
        Err(e) => columns.into_iter().filter(|k| !e.dependent.contains(k)).collect(),
    }
}

/// Rows behind columns, into a block.
fn fill(block: &mut Block, columns: &[Vec<f64>]) {
    let rows = columns[0].len();
    let mut t = 0;
    while t < rows {
        let len = block.free().min(rows - t);
        for (j, column) in columns.iter().enumerate() {
            block.next_rows(j, len).copy_from_slice(&column[t..t + len]);
        }
        block.grow(len);
        t += len;
    }
}

/// The model's step response to one input, and its bins of lags.
struct Curve {
    /// `s_0 … s_m`, beyond the last bin.
    s: Vec<f64>,
    gain: f64,
    /// The largest of them.
    size: f64,
    /// Lag of the first that is not zero.
    nk: usize,
    /// Lag at which it has settled.
    last: usize,
    bins: Vec<Range<usize>>,
}

impl Curve {
    /// None of a response that never leaves zero.
    fn of(model: &Model, i: usize, Ts: f64, most: usize) -> Option<Self> {
        let times: Vec<f64> = (0..=most).map(|k| k as f64 * Ts).collect();
        let s = model.step_response(i, &times);
        let gain = model.dc_gain()[i];
        let size = s.iter().fold(gain.abs(), |most, s| most.max(s.abs()));
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let nk = s.iter().position(|s| s.abs() > 1e-6 * size)?;
        let settled = s.iter().rposition(|s| (s - gain).abs() > SETTLED * size).unwrap_or(nk);
        let last = (settled + 1).max(nk + 2 * BEHIND).min(most);
        Some(Curve { bins: bins(nk, last), s, gain, size, nk, last })
    }

    /// `s` between its samples, before its first and behind its last.
    fn at(&self, k: f64) -> f64 {
        if k < 0.0 {
            return 0.0;
        }
        let (low, part) = (k.floor() as usize, k.fract());
        let s = |k: usize| self.s.get(k).copied().unwrap_or(self.gain);
        s(low) + part * (s(low + 1) - s(low))
    }

    /// Taps of each bin that change the step response by `delta`: its rise over the bin, per lag.
    fn taps(&self, delta: impl Fn(f64) -> f64) -> Vec<f64> {
        let rise = |b: &Range<usize>| delta(b.end as f64 - 1.0) - delta(b.start as f64 - 1.0);
        self.bins.iter().map(|b| rise(b) / b.len() as f64).collect()
    }

    /// Changes of the model that are tried, with what each does to the taps.
    fn changes(&self) -> Vec<(Change, Vec<f64>)> {
        let later = |m: f64| (Change::Delay(m), self.taps(|k| self.at(k - m) - self.at(k)));
        let before = self.nk as f64 - 1.0; // the last lag at rest
        let stretched = |k: f64, r: f64| if k < before { 0.0 } else { self.at(before + (k - before) / r) };
        let slower = |r: f64| (Change::Lag(r - 1.0), self.taps(|k| stretched(k, r) - self.at(k)));
        // An oscillation has no time constant to be off.
        let lags = if self.size > OVERSHOOT * self.gain.abs() {
            Vec::new()
        } else {
            [0.5, 0.67, 0.8, 1.25, 1.5, 2.0].map(slower).to_vec()
        };
        let gain = (Change::Gain, self.taps(|k| self.at(k)));
        let delays = [-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0].map(later);
        [gain].into_iter().chain(delays).chain(lags).collect()
    }

    /// Lag at which the step response is furthest off, and by how much.
    fn furthest(&self, delta: &[f64]) -> (usize, f64) {
        let (mut sum, mut best) = (0.0, (0, 0.0f64));
        for (b, d) in self.bins.iter().zip(delta) {
            sum += d * b.len() as f64;
            if sum.abs() > best.1.abs() {
                best = (b.end - 1, sum);
            }
        }
        best
    }
}

/// Single lags around the delay, wider bins on both sides.
fn bins(nk: usize, last: usize) -> Vec<Range<usize>> {
    let first = nk.min(1); // from 1 on, unless the model has a direct term
    let mut edges = vec![first];
    if nk > first + BEFORE + 1 {
        edges.push((first + nk - BEFORE) / 2);
    }
    edges.extend(nk.saturating_sub(BEFORE).max(first)..=nk + BEHIND);
    let (mut end, mut width) = (nk + BEHIND, 1);
    while end <= last {
        end = (end + width).min(last + 1);
        width *= 2;
        edges.push(end);
    }
    edges.retain(|&e| e <= last + 1);
    edges.dedup();
    edges.windows(2).map(|e| e[0]..e[1]).collect()
}

/// What may be off, by so many samples or such a share.
#[derive(Clone, Copy)]
enum Change {
    Gain,
    Delay(f64),
    Lag(f64),
}

impl Change {
    /// `by` times this change, in words.
    fn text(self, by: f64) -> String {
        let percent =
            |by: f64| format!("{:.0} % {}", 100.0 * by.abs(), if by > 0.0 { "larger" } else { "smaller" });
        match self {
            Change::Gain => format!(", its gain {}", percent(by)),
            Change::Delay(m) => {
                let later = if m * by > 0.0 { "later" } else { "earlier" };
                format!(", about {:.1} samples {later}", (m * by).abs())
            }
            Change::Lag(share) => format!(", its time constant about {}", percent(share * by)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_are_fine_around_the_delay_and_leave_no_gap() {
        for (nk, last) in [(0, 6), (1, 5), (2, 30), (6, 40), (30, 300), (3, 7)] {
            let bins = bins(nk, last);
            assert_eq!(bins[0].start, nk.min(1));
            assert_eq!(bins.last().map(|b| b.end), Some(last + 1));
            assert!(bins.windows(2).all(|b| b[0].end == b[1].start && !b[0].is_empty()));
            assert!(bins.contains(&(nk..nk + 1)) && bins.len() < 20, "{bins:?}");
        }
    }
}
