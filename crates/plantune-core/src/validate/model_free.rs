//! The model beside what the record says without one: V16 where its step response is another.
//!
//! ```text
//! v(t) = y(t) - yhat(t)                              errors of the simulation
//! D v(t) = O + sum_b delta_b sum_{k in b} D u(t-k) + e(t),     D(q) v = e where the model is true
//! g = g_model + delta,   s = s_model + sum delta
//! F = (RSS_0 - RSS) / B / (RSS / (N - B - 1)) / (1 + N / N_fit)
//! ```
//!
//! The bins `b` of lags are single ones around the model's delay and grow twofold behind it, until its step response
//! has settled: a dozen numbers stand for the impulse response, whatever the sample time, and cost a
//! fraction of what the simulation does. `1 + N/N_fit` allows for the error of the model itself, fitted on `N_fit` rows.
//! Both signals pass `D` of what remains, so that neither coloured noise nor feedback counts as a difference: lags
//! begin at 1 unless the model answers at once.
//!
//! What is off is the one of gain, delay and time constant that explains most of the difference,
//!
//! ```text
//! delta = a g,   -a (g_k - g_{k-1}),   -a d/dk ((k - nk) g_k)
//! ```
//!
//! or, where none explains most, the shape. Ljung 1999, 16.5 and 16.6; METHODS 2.3.

use std::ops::Range;

use crate::limits::Limits;
use crate::linalg::{Block, Triangle, residual_norm2, solve};
use crate::model::Model;
use crate::note::{Note, Place, rounded};
use crate::record::Record;
use crate::signal::{autoregression, through};
use crate::stats::f_tail;

/// Chance of a false alarm per input.
const CHANCE: f64 = 1e-3;

/// Largest order of the noise model, and of those bins of one lag around the delay.
const MOST_NOISE: usize = 10;
const BEFORE: usize = 2;
const BEHIND: usize = 2;

/// Share of the final value within which a step response has settled.
const SETTLED: f64 = 0.05;

/// Largest lag as a share of the rows, and rows per bin.
const REACH: usize = 4;
const ROWS: usize = 5;

/// Columns that depend on others to this degree add nothing.
const DEPENDENT: f64 = 1e-8;

/// Share of the difference that one cause must explain to be named.
const NAMED: f64 = 0.7;

/// V16 of each input whose response differs by more than the uncertainty and more than the limit.
///
/// `errors` are those of the simulation, one per row of `rows`.
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
    let responses: Vec<Curve> =
        (0..rec.nu).filter_map(|i| Curve::of(model, i, rec.Ts, errors.len() / REACH)).collect();
    if responses.len() < rec.nu {
        return Vec::new();
    }
    let mut study = Study::new(rec, (rows, errors), responses);
    study.whiten();
    (0..rec.nu).filter_map(|i| study.note(i, fitted, limits)).collect()
}

/// The step response of one input, and its bins of lags.
struct Curve {
    /// `s_0 … s_m`
    s: Vec<f64>,
    gain: f64,
    /// Lag of the first tap that is not zero.
    nk: usize,
    bins: Vec<Range<usize>>,
}

impl Curve {
    /// None of a response that never leaves zero.
    fn of(model: &Model, i: usize, Ts: f64, most: usize) -> Option<Self> {
        let times: Vec<f64> = (0..=most).map(|k| k as f64 * Ts).collect();
        let mut s = model.step_response(i, &times);
        let gain = model.dc_gain()[i];
        let size = s.iter().fold(gain.abs(), |most, s| most.max(s.abs()));
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let nk = s.iter().position(|s| s.abs() > 1e-6 * size)?;
        let settled = s.iter().rposition(|s| (s - gain).abs() > SETTLED * size).unwrap_or(nk);
        let last = (settled + 1).max(nk + 2 * BEHIND).min(most);
        s.truncate(last + 1);
        Some(Curve { bins: bins(nk, last), s, gain, nk })
    }

    /// Mean over each bin of the differences of a step-like curve.
    fn binned(&self, s: impl Fn(usize) -> f64) -> Vec<f64> {
        let before = |k: usize| if k == 0 { 0.0 } else { s(k - 1) };
        self.bins.iter().map(|b| (s(b.end - 1) - before(b.start)) / b.len() as f64).collect()
    }

    /// What a change of gain, delay and time constant does to the taps, per unit of each.
    fn causes(&self) -> [Vec<f64>; 3] {
        let s = |k: usize| self.s[k];
        let g = |k: usize| if k == 0 { self.s[0] } else { self.s[k] - self.s[k - 1] };
        [
            self.binned(s),
            self.binned(|k| -g(k)),
            self.binned(|k| -g(k) * (k as f64 + 1.0 - self.nk as f64).max(0.0)),
        ]
    }
}

/// Single lags around the delay, wider ones on both sides.
fn bins(nk: usize, last: usize) -> Vec<Range<usize>> {
    let first = nk.min(1); // without a direct term from 1 on
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

/// The regression of the errors on the bins of all inputs.
struct Study<'r, 'a> {
    rec: &'r Record<'a>,
    curves: Vec<Curve>,
    /// Errors of the simulation; zero where a row has none.
    v: Vec<f64>,
    has_error: Vec<bool>,
    D: Vec<f64>,
    /// Filtered errors.
    filtered: Vec<f64>,
    triangle: Triangle, // [1 | bins | D v]
    N: usize,
}

impl<'r, 'a> Study<'r, 'a> {
    fn new(rec: &'r Record<'a>, (rows, errors): (&[usize], &[f64]), curves: Vec<Curve>) -> Self {
        let (mut v, mut has_error) = (vec![0.0; rec.N()], vec![false; rec.N()]);
        for (&t, e) in rows.iter().zip(errors) {
            (v[t], has_error[t]) = (*e, true);
        }
        let none = Triangle::new(1);
        Study { rec, curves, v, has_error, D: vec![1.0], filtered: Vec::new(), triangle: none, N: 0 }
    }

    /// Filters by what the bins leave of the errors, once.
    fn whiten(&mut self) {
        let rows = self.regress();
        let left = self.left(&rows);
        let mut e = vec![0.0; self.rec.N()];
        rows.iter().flat_map(|(t, _)| t.clone()).zip(left).for_each(|(t, x)| e[t] = x);
        let stretches: Vec<Range<usize>> = rows.into_iter().map(|(t, _)| t).collect();
        if stretches.is_empty() {
            return;
        }
        self.D = autoregression(&e, &stretches, MOST_NOISE);
        if self.D.len() > 1 {
            self.regress();
        }
    }

    /// Rows `[1 | bins | D v]`, column by column, of each stretch, and their triangle.
    fn regress(&mut self) -> Vec<(Range<usize>, Vec<Vec<f64>>)> {
        let past = self.D.len() - 1;
        let reach = self.curves.iter().map(|c| c.s.len() - 1).max().unwrap_or(0) + past;
        self.filtered = through(&self.D, &self.v, self.rec.segments());
        let sums: Vec<Vec<f64>> = (0..self.rec.nu).map(|i| self.running_sum(i)).collect();
        let usable = |t: usize| (t - past..=t).all(|k| self.has_error[k]);
        let mut all = Vec::new();
        for s in self.rec.segments() {
            let first = s.start + reach;
            let rows: Vec<usize> = (first..s.end.max(first)).filter(|&t| usable(t)).collect();
            for run in rows.chunk_by(|a, b| b - a == 1) {
                let run = run[0]..run[run.len() - 1] + 1;
                all.push((run.clone(), self.columns(&run, &sums)));
            }
        }
        let width = 2 + self.curves.iter().map(|c| c.bins.len()).sum::<usize>();
        self.triangle = triangle(width, all.iter().map(|(_, columns)| columns));
        self.N = all.iter().map(|(run, _)| run.len()).sum();
        all
    }

    /// `sum_{j <= t} D u_i(j)`, anew in each segment.
    fn running_sum(&self, i: usize) -> Vec<f64> {
        let mut u = through(&self.D, &self.rec.input(i), self.rec.segments());
        for s in self.rec.segments() {
            let mut sum = 0.0;
            u[s].iter_mut().for_each(|u| {
                sum += *u;
                *u = sum;
            });
        }
        u
    }

    fn columns(&self, run: &Range<usize>, sums: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut columns = vec![vec![1.0; run.len()]];
        for (curve, sum) in self.curves.iter().zip(sums) {
            // u(t-k) for k in the bin: the sum up to t - start, without that up to t - end.
            let bin = |b: &Range<usize>| {
                let before = |t: usize| if t >= b.end { sum[t - b.end] } else { 0.0 };
                run.clone().map(|t| sum[t - b.start] - before(t)).collect::<Vec<f64>>()
            };
            columns.extend(curve.bins.iter().map(bin));
        }
        columns.push(self.filtered[run.clone()].to_vec());
        columns
    }

    /// What all bins leave of the errors.
    fn left(&self, rows: &[(Range<usize>, Vec<Vec<f64>>)]) -> Vec<f64> {
        let n = self.triangle.n() - 1;
        let kept = self.independent(&(0..n).collect::<Vec<usize>>());
        let theta = solve(&self.triangle, &kept, n, 0.0).map(|s| s.theta).unwrap_or_default();
        let row = |columns: &[Vec<f64>], t: usize| {
            columns[n][t] - kept.iter().zip(&theta).map(|(&j, b)| b * columns[j][t]).sum::<f64>()
        };
        rows.iter().flat_map(|(run, columns)| (0..run.len()).map(move |t| row(columns, t))).collect()
    }

    /// Those of the columns that do not depend on others.
    fn independent(&self, columns: &[usize]) -> Vec<usize> {
        match solve(&self.triangle, columns, self.triangle.n() - 1, DEPENDENT) {
            Ok(_) => columns.to_vec(),
            Err(e) => {
                let drop = |k: &usize| !e.dependent.contains(k);
                (0..columns.len()).filter(drop).map(|k| columns[k]).collect()
            }
        }
    }

    /// V16 of input `i`.
    fn note(&self, i: usize, fitted: Option<usize>, limits: &Limits) -> Option<Note> {
        let curve = &self.curves[i];
        let n = self.triangle.n() - 1;
        let first = 1 + self.curves[..i].iter().map(|c| c.bins.len()).sum::<usize>();
        let own = first..first + curve.bins.len();
        let all = self.independent(&(0..n).collect::<Vec<usize>>());
        let others: Vec<usize> = all.iter().copied().filter(|j| !own.contains(j)).collect();
        let B = (all.len() - others.len()) as f64;
        let freedom = self.N as f64 - all.len() as f64;
        if B == 0.0 || freedom < ROWS as f64 * all.len() as f64 {
            return None;
        }
        let rss = |columns: &[usize]| residual_norm2(&self.triangle, columns, n, 0.0);
        let (without, with) = (rss(&others), rss(&all));
        let known = 1.0 + fitted.map_or(0.0, |rows| self.N as f64 / rows as f64);
        let F = (without - with) / B / (with / freedom).max(f64::MIN_POSITIVE) / known;
        if f_tail(F, B, freedom) > CHANCE {
            return None;
        }
        let theta = solve(&self.triangle, &all, n, 0.0).ok()?.theta;
        let mut delta = vec![0.0; curve.bins.len()];
        all.iter().zip(theta).filter(|(j, _)| own.contains(j)).for_each(|(j, b)| delta[j - first] = b);
        let (lag, apart) = curve.furthest(&delta);
        let size = curve.s.iter().fold(curve.gain.abs(), |most, s| most.max(s.abs()));
        if apart.abs() / size <= limits.V16 {
            return None;
        }
        let name = self.rec.input_name(i);
        let what = self.cause(i, own, &others, without - with);
        let (model, free) = (rounded(curve.s[lag]), rounded(curve.s[lag] + apart));
        let text = format!(
            "the step response to {name} is another than the record's own{what}: {model} against {free} after {lag} samples"
        );
        Some(
            Note::warning("V16", text)
                .at(Place::column(name))
                .count(self.N)
                .measured(apart.abs() / size, limits.V16)
                .remedy("look at plot.impulse with both; try another delay or a higher order"),
        )
    }

    /// The one cause that explains most of what all bins explain, in words.
    fn cause(&self, i: usize, own: Range<usize>, others: &[usize], explained: f64) -> String {
        let n = self.triangle.n() - 1;
        let tried = self.curves[i].causes().map(|direction| {
            let rows = (0..=n).map(|k| {
                let along: f64 = own.clone().zip(&direction).map(|(j, d)| self.triangle.at(k, j) * d).sum();
                let mut row: Vec<f64> = others.iter().map(|&j| self.triangle.at(k, j)).collect();
                row.extend([along, self.triangle.at(k, n)]);
                row
            });
            let rows: Vec<Vec<f64>> = rows.collect();
            let m = others.len() + 1;
            let alone = Triangle::of_rows(m + 1, rows.iter().map(Vec::as_slice));
            let every: Vec<usize> = (0..m).collect();
            let by = solve(&alone, &every, m, 0.0).map_or(0.0, |s| s.theta[m - 1]);
            let own = &every[..m - 1];
            let drop = residual_norm2(&alone, own, m, 0.0) - residual_norm2(&alone, &every, m, 0.0);
            (drop / explained.max(f64::MIN_POSITIVE), by)
        });
        let best = (0..3).fold(0, |best, k| if tried[k].0 > tried[best].0 { k } else { best });
        let (share, by) = tried[best];
        if share < NAMED {
            return " in its shape".to_owned();
        }
        let percent =
            |by: f64| format!("{:.0} % {}", 100.0 * by.abs(), if by > 0.0 { "larger" } else { "smaller" });
        match best {
            0 => format!(", whose gain is {}", percent(by)),
            1 => format!(
                ", which comes about {:.1} samples {}",
                by.abs(),
                if by > 0.0 { "later" } else { "earlier" }
            ),
            _ => format!(", whose time constant is about {}", percent(by)),
        }
    }
}

impl Curve {
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

/// Triangle of the rows behind columns.
fn triangle<'x>(width: usize, parts: impl Iterator<Item = &'x Vec<Vec<f64>>>) -> Triangle {
    let (mut triangle, mut block) = (Triangle::new(width), Block::new(width));
    for columns in parts {
        let mut t = 0;
        while t < columns[0].len() {
            let len = block.free().min(columns[0].len() - t);
            for (j, column) in columns.iter().enumerate() {
                block.next_rows(j, len).copy_from_slice(&column[t..t + len]);
            }
            block.grow(len);
            t += len;
        }
    }
    triangle.absorb(&mut block);
    triangle
}
