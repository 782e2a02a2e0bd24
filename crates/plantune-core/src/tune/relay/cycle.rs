//! What is measured of a relay test: levels, switching rows, and the mean cycle of the settled periods.

use std::borrow::Cow;
use std::ops::Range;

use super::Known;
use crate::error::{Error, Result};
use crate::excitation::check_input_motion;
use crate::limits::Limits;
use crate::linalg::extent;
use crate::note::{Note, Place, rounded};
use crate::record::Record;
use crate::stats::median;

/// Part of the travel between the levels by which u may miss a level.
const LEVEL: f64 = 0.01;

/// Part of the period by which a half-cycle may differ from the usual one, beside two rows.
const SETTLED: f64 = 0.1;

/// Whole settled periods that are needed.
const LEAST_PERIODS: usize = 2;

/// Part of the usual half-cycle below which another one counts as chatter.
const CHATTER: f64 = 0.25;

/// Part of the cycle's travel by which y may drift before the test and still count as at rest.
const AT_REST: f64 = 0.02;

/// Input and output in equilibrium, and the rows that the output is a mean of; 0 where it is given.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    pub u0: f64,
    pub y0: f64,
    pub rows: usize,
}

/// The relay at work over the longest segment of a record.
pub(super) struct Switching<'r> {
    pub u: Cow<'r, [f64]>,
    pub y: Cow<'r, [f64]>,
    segment: Range<usize>,
    pub low: f64,
    pub high: f64,
    /// Rows before the test and what y does there, if the record begins with them.
    before: Option<Range<usize>>,
    /// First row of each half-cycle; the last is the end of the last one.
    rows: Vec<usize>,
    /// First switching of the settled periods.
    first: usize,
}

/// One half-cycle: how long it lasts, s, and y at its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Half {
    pub t: f64,
    pub from: f64,
    pub to: f64,
}

/// The settled periods, y with the sign that makes the gain positive.
#[derive(Clone, Debug)]
pub(super) struct Cycle {
    pub Ts: f64,
    pub low: f64,
    pub high: f64,
    /// Sign of the gain.
    pub sign: f64,
    /// At `high`, from the bottom up, and at `low`; as many of either.
    pub on: Vec<Half>,
    pub off: Vec<Half>,
    /// y over all rows, and over those at `high`.
    pub mean: f64,
    pub mean_on: f64,
    /// What y moves from the first to the last switching, per row.
    pub drift: f64,
    /// Sum of the squared weights of the rows behind `from` and `to`.
    pub weight: f64,
    /// How the offset is known: from `u0` and `y0`, where `y0` is a mean of so many rows, 0 if it is exact.
    pub known: Known,
    pub u0: f64,
    pub y0: f64,
    pub rest_rows: usize,
}

impl<'r> Switching<'r> {
    pub fn of(rec: &Record<'r>, limits: &Limits) -> Result<Self> {
        check_input_motion(rec, limits)?;
        let segment = rec.segments().max_by_key(|s| s.len()).unwrap_or(0..rec.N());
        let (u, y) = (rec.input(0), rec.output_held(0));
        let Range { start, end } = segment;
        let moved = (start..end).find(|&k| u[k] != u[start]).unwrap_or(start);
        let (low, high) = extent(&u[moved..end]);
        let near = |level: f64, u: f64| (u - level).abs() <= LEVEL * (high - low);
        if let Some(k) = (moved..end).find(|&k| !near(low, u[k]) && !near(high, u[k])) {
            return Err(not_a_relay(rec, k, low, high));
        }
        let before = (!near(low, u[start]) && !near(high, u[start])).then_some(start..moved);
        let middle = 0.5 * (low + high);
        let from = if before.is_some() { moved } else { start };
        let switched = |k: &usize| (u[*k] > middle) != (u[k - 1] > middle);
        // The first ends no half-cycle of the oscillation: what y did before is not known.
        let rows: Vec<usize> = (from + 1..end).filter(switched).skip(1).collect();
        if rows.len() < 2 * LEAST_PERIODS + 1 {
            return Err(too_few(rec, rows.len().saturating_sub(1) / 2));
        }
        let mut switching = Switching { u, y, segment, low, high, before, rows, first: 0 };
        switching.check_chatter(rec)?;
        switching.first = switching.settled(rec)?;
        Ok(switching)
    }

    /// Whether u is `high` in the half-cycle that begins at switching `i`.
    fn is_on(&self, i: usize) -> bool {
        2.0 * self.u[self.rows[i]] > self.low + self.high
    }

    fn lengths(&self) -> Vec<usize> {
        self.rows.windows(2).map(|w| w[1] - w[0]).collect()
    }

    /// X04: noise switches the relay, so that some half-cycles are far shorter than the others.
    fn check_chatter(&self, rec: &Record) -> Result<()> {
        let lengths = self.lengths();
        let usual = |odd: usize| {
            let mut kind: Vec<usize> = lengths.iter().skip(odd).step_by(2).copied().collect();
            kind.sort_unstable();
            kind[kind.len() * 9 / 10] as f64
        };
        let usual = [usual(0), usual(1)];
        let short = |(i, n): (usize, &usize)| (*n as f64) < CHATTER * usual[i % 2] - 1.0;
        let count = lengths.iter().enumerate().filter(|&(i, n)| short((i, n))).count();
        let Some(first) = lengths.iter().enumerate().position(short) else { return Ok(()) };
        let text = format!("the relay chatters: {count} of {} half-cycles are cut short", lengths.len());
        Err(Error::new("X04", text)
            .at(rec.place(0, self.rows[first]))
            .count(count)
            .measured(lengths[first] as f64 / usual[first % 2], CHATTER)
            .remedy("take a hysteresis of three standard deviations of the noise, or larger levels"))
    }

    /// Periods as (first switching, rows high, rows low); the last one ends at the last switching.
    fn periods(&self) -> Vec<(usize, usize, usize)> {
        let lengths = self.lengths();
        (lengths.len() % 2..lengths.len())
            .step_by(2)
            .map(|i| {
                let (one, two) = (lengths[i], lengths[i + 1]);
                if self.is_on(i) { (i, one, two) } else { (i, two, one) }
            })
            .collect()
    }

    /// First switching from which on the half-cycles are those of the second half of the record.
    fn settled(&self, rec: &Record) -> Result<usize> {
        let periods = self.periods();
        let later = &periods[periods.len() / 2..];
        let usual =
            |f: fn(&(usize, usize, usize)) -> usize| median(later.iter().map(|p| f(p) as f64).collect());
        let (on, off) = (usual(|p| p.1), usual(|p| p.2));
        let allowed = (SETTLED * (on + off)).max(2.0);
        let away = |p: &&(usize, usize, usize)| (p.1 as f64 - on).abs().max((p.2 as f64 - off).abs());
        let fits = |p: &(usize, usize, usize)| away(&p) <= allowed;
        let begin = periods.iter().position(fits).unwrap_or(periods.len());
        let strays = periods[begin..].iter().filter(|p| !fits(p)).count();
        if 4 * strays > periods.len() - begin || begin + LEAST_PERIODS > periods.len() {
            let worst = later.iter().map(|p| away(&p)).fold(0.0, f64::max);
            let text = "the oscillation has not settled: its half-cycles differ from period to period";
            return Err(Error::new("X07", text)
                .at(rec.place(0, self.rows[periods[0].0]))
                .count(strays.max(begin))
                .measured(worst / (on + off), SETTLED)
                .remedy("run the relay longer, without a load or set-point change; widen its hysteresis"));
        }
        Ok(periods[begin].0)
    }

    /// Rows of the settled periods.
    pub fn span(&self) -> Range<usize> {
        self.rows[self.first]..self.rows[self.rows.len() - 1]
    }

    /// Periods before the oscillation had settled.
    pub fn left_out(&self) -> usize {
        self.first / 2
    }

    /// The settled periods; y at a switching comes from a parabola through `reach` rows on either side.
    pub fn cycle(&self, Ts: f64, rest: Option<Rest>, reach: usize) -> Cycle {
        let ends = &self.rows[self.first..];
        let y: Vec<f64> = ends.iter().map(|&row| self.smooth(row, reach)).collect();
        let (mut on, mut off) = (Vec::new(), Vec::new());
        let (mut sums, mut rows) = ([0.0, 0.0], [0.0, 0.0]);
        for (i, w) in ends.windows(2).enumerate() {
            let is_on = self.is_on(self.first + i);
            let half = Half { t: (w[1] - w[0]) as f64 * Ts, from: y[i], to: y[i + 1] };
            if is_on {
                on.push(half)
            } else {
                off.push(half)
            }
            sums[usize::from(is_on)] += self.y[w[0]..w[1]].iter().sum::<f64>();
            rows[usize::from(is_on)] += (w[1] - w[0]) as f64;
        }
        let rise = on.iter().map(|half| half.to - half.from).sum::<f64>() / on.len() as f64;
        // High drives a plant of positive gain from the bottom up, after it has gone on down for the delay.
        let sign = (rise + sums[0] / rows[0] - sums[1] / rows[1]).signum();
        for half in on.iter_mut().chain(&mut off) {
            (half.from, half.to) = (sign * half.from, sign * half.to);
        }
        Cycle {
            Ts,
            low: self.low,
            high: self.high,
            sign,
            on,
            off,
            mean: sign * (sums[0] + sums[1]) / (rows[0] + rows[1]),
            mean_on: sign * sums[1] / rows[1],
            drift: sign * (y[y.len() - 1] - y[0]) / (rows[0] + rows[1]),
            weight: parabola(reach).iter().map(|w| w * w).sum(),
            known: if rest.is_some() { Known::Rest } else { Known::Asymmetry },
            u0: rest.map_or(0.0, |r| r.u0),
            y0: rest.map_or(0.0, |r| sign * r.y0),
            rest_rows: rest.map_or(0, |r| r.rows),
        }
    }

    /// y at a row by a parabola through as many rows around it as there are, up to `reach` on either side.
    fn smooth(&self, row: usize, reach: usize) -> f64 {
        let reach = reach.min(row - self.segment.start).min(self.segment.end - 1 - row);
        parabola(reach).iter().zip(&self.y[row - reach..]).map(|(w, y)| w * y).sum()
    }

    /// Input and output before the test, or why they are no equilibrium.
    pub fn rest(&self) -> Option<std::result::Result<Rest, Note>> {
        let before = self.before.clone()?;
        let y = &self.y[before.start..=before.end]; // the relay's first move acts on the next row only
        let mean = |y: &[f64]| y.iter().sum::<f64>() / y.len() as f64;
        let y0 = mean(y);
        let drift = mean(&y[y.len() / 2..]) - mean(&y[..y.len() / 2]);
        let variance = y.iter().map(|y| (y - y0).powi(2)).sum::<f64>() / y.len() as f64;
        let (low, high) = extent(&self.y[self.span()]);
        // A drift is in the variance as well; 6 standard deviations of a mean are more than it makes there.
        let allowed = AT_REST * (high - low) + 6.0 * (variance / y.len() as f64).sqrt();
        if drift.abs() <= allowed {
            return Some(Ok(Rest { u0: self.u[before.start], y0, rows: y.len() }));
        }
        let text = format!("y moves by {} before the test: it is not at rest there", rounded(drift));
        Some(Err(Note::warning("X07", text)
            .count(y.len())
            .measured(drift.abs(), allowed)
            .remedy("let the plant settle before the relay takes over, or give rest=(u0, y0)")))
    }
}

/// Weights of the rows `-w … w` in the value at 0 of the parabola of least squares through them.
fn parabola(w: usize) -> Vec<f64> {
    if w == 0 {
        return vec![1.0];
    }
    let n = w as f64;
    let scale = (2.0 * n - 1.0) * (2.0 * n + 1.0) * (2.0 * n + 3.0);
    (0..=2 * w).map(|i| 3.0 * (3.0 * n * n + 3.0 * n - 1.0 - 5.0 * (i as f64 - n).powi(2)) / scale).collect()
}

fn not_a_relay(rec: &Record, row: usize, low: f64, high: f64) -> Error {
    let place = rec.place(0, row);
    let (low, high) = (rounded(low), rounded(high));
    let came = format!("a record whose {} is neither {low} nor {high} at row {row}", place.column);
    Error::argument("rec", came, "that of a relay, which switches between two levels")
        .at(place)
        .remedy("cut out the relay test: rec.between(start, stop)")
}

fn too_few(rec: &Record, periods: usize) -> Error {
    let text = format!("{periods} whole periods of the relay, {LEAST_PERIODS} are needed");
    Error::new("X03", text)
        .at(Place::column(rec.input_name(0)))
        .count(periods)
        .measured(periods as f64, LEAST_PERIODS as f64)
        .remedy("run the relay longer; if y does not oscillate, take levels on either side of the set point")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weights_give_back_a_cubic_at_its_middle() {
        for w in [0, 1, 2, 7] {
            let cubic = |x: f64| 2.0 - 3.0 * x + 0.5 * x * x + 0.1 * x * x * x;
            let there = (0..=2 * w).map(|i| cubic(i as f64 - w as f64));
            let middle: f64 = parabola(w).iter().zip(there).map(|(weight, y)| weight * y).sum();
            assert!((middle - 2.0).abs() < 1e-12, "{w}: {middle}");
        }
    }
}
