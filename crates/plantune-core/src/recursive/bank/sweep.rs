//! All loops of a bank, sample by sample.
//!
//! A single sample goes once through the memory of all estimators, to and fro by turns, so that what the
//! cache still holds from the sample before is used first; while a group learns, the next one is fetched. Of a
//! record, a few groups of loops at a time go through all samples, and their estimators stay in the first cache
//! meanwhile.

use pulp::{Arch, Simd, WithSimd};

use super::Bank;
use super::kernel::{self, Fixed, Judge, Now, Row, W, at};
use crate::linalg::{fetch, sum};

/// Groups of eight columns that go through a record together.
const TOGETHER: usize = 4;

/// Numbers of u, and of y, that are fetched at once before the groups pick theirs: what one group reads lies a row
/// apart, further than the processor looks ahead.
const FETCHED: usize = 32_768;

/// `alpha` and the squared error stay below this, or the loop starts anew.
const HUGE: f64 = 1e60;

/// As long as a sample weighs more in `s2` than this, none is capped or clipped.
const SETTLING: f64 = 0.02;

/// Share of the output's travel below which no noise is believed: rounding is not noise.
const LEAST: f64 = 1e-6;

/// A signal at rest is this. At zero what is filtered from it would decay for ever, among the numbers that are so
/// small that they take ten times as long; the square of this is none of them, and beside any other signal it is
/// nothing.
const REST: f64 = 1e-140;

/// Runs over rows of `u` and `y`, `(N, loops)`.
pub fn run(bank: &mut Bank, u: &[f64], y: &[f64]) {
    Arch::new().dispatch(Sweep { bank, u, y });
}

pub struct Sweep<'a> {
    pub bank: &'a mut Bank,
    pub u: &'a [f64],
    pub y: &'a [f64],
}

impl WithSimd for Sweep<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Sweep { bank, u, y } = self;
        let (groups, rows, loops) = (bank.inputs.len(), bank.high + 1, bank.loops);
        // Columns of one loop may break together, so they go together.
        let (alone, all) = (u.len() == loops, u.len() == loops || bank.copies > 1);
        let together = if all { groups } else { TOGETHER };
        let block = if all { u.len().max(loops) } else { (FETCHED / loops).max(16) * loops };
        let backwards = bank.backwards && alone;
        bank.backwards ^= alone;
        for (u, y) in u.chunks(block).zip(y.chunks(block)) {
            if together < groups {
                std::hint::black_box((sum(u), sum(y)));
            }
            let start = bank.head;
            for first in (0..groups).step_by(together) {
                let last = (first + together).min(groups);
                bank.head = start;
                for (u, y) in u.chunks_exact(loops).zip(y.chunks_exact(loops)) {
                    for i in first..last {
                        let at = |i: usize| if backwards { last - 1 - i } else { i };
                        let next = (alone && i + 1 < last).then(|| at(i + 1));
                        sample(simd, bank, at(i), next, u, y);
                    }
                    if bank.broken {
                        bank.restart();
                    }
                    bank.head = (bank.head + 1) % rows;
                }
            }
        }
    }
}

/// One sample of the group `g`; `next` is the group to fetch meanwhile.
#[inline(always)]
fn sample<S: Simd>(simd: S, bank: &mut Bank, g: usize, next: Option<usize>, u: &[f64], y: &[f64]) {
    let raw = [bank.gather(g, u), bank.gather(g, y)];
    let [mut u, mut y] = bank.centred(g, raw);
    let mut unknown = simd.splat_f64s(0.0);
    for r in 0..W / S::F64_LANES {
        let both = simd.add_f64s(*at::<S>(&mut u, r), *at::<S>(&mut y, r));
        unknown = simd.mul_add_e_f64s(both, simd.splat_f64s(0.0), unknown);
    }
    if bank.attention[g] || simd.reduce_sum_f64s(unknown) != 0.0 {
        attended(simd, bank, g, raw, [u, y]);
    } else {
        bank.store(g, &u);
        estimate::<S, false>(simd, bank, g, next, y, Row::of(1.0));
    }
}

/// The same where a column needs attention.
#[inline(never)]
fn attended<S: Simd>(simd: S, bank: &mut Bank, g: usize, raw: [Row; 2], [mut u, mut y]: [Row; 2]) {
    let learn = bank.attend(g, raw, &mut u, &mut y);
    bank.store(g, &u);
    simd.vectorize(Attended { bank, g, y, learn });
}

struct Attended<'a> {
    bank: &'a mut Bank,
    g: usize,
    y: Row,
    learn: Row,
}

impl WithSimd for Attended<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Attended { bank, g, y, learn } = self;
        estimate::<S, true>(simd, bank, g, None, y, learn);
        bank.attended(g);
    }
}

/// Hands the sample to all estimators of the group.
#[inline(always)]
fn estimate<S: Simd, const GATED: bool>(
    simd: S,
    bank: &mut Bank,
    g: usize,
    fetched: Option<usize>,
    mut y: Row,
    mut learn: Row,
) {
    let (rows, settings) = (bank.high + 1, &bank.settings);
    let splat = |x: f64| simd.splat_f64s(x);
    let fixed = Fixed {
        one: splat(1.0),
        filter: splat(if settings.rml { -1.0 } else { 0.0 }),
        D_most: splat(settings.D_most()),
        c_most: splat(settings.c_most),
        c_least: splat(-settings.c_most),
    };
    if let Some(g) = fetched {
        fetch(&bank.inputs[g]);
        bank.ring[g * rows..(g + 1) * rows].iter().for_each(fetch);
    }
    let inputs = &mut bank.inputs[g];
    let first = g * bank.per;
    let ring = &mut bank.ring[g * rows..(g + 1) * rows];
    // The row that the first of them reads, and then one further back each.
    let newest = if bank.copies == 1 && bank.per > 1 { bank.head + rows - bank.low } else { bank.head };
    let mut ranges = Row::of(0.0);
    let mut fine = true;
    for r in 0..W / S::F64_LANES {
        let y_now = *at::<S>(&mut y, r);
        let learn = simd.greater_than_f64s(*at::<S>(&mut learn, r), splat(0.0));
        let keep = |new, old| if GATED { simd.select_f64s(learn, new, old) } else { new };
        let y_before = std::mem::replace(at::<S>(&mut inputs.y_before, r), y_now);
        let next = at::<S>(&mut inputs.lambda, r);
        let lambda = *next;
        // Not as a product with rho^t, which would end among the numbers that are slow to compute with.
        let gap = simd.sub_f64s(splat(settings.lambda), lambda);
        *next = keep(simd.negate_mul_add_e_f64s(gap, splat(settings.rho), splat(settings.lambda)), lambda);
        let now = Now::<S> { y: y_now, y_before, lambda, inverse: simd.div_f64s(splat(1.0), lambda), learn };
        let judge = bank.windows.get_mut(g).map(|window| {
            let (weight, travel) = (at::<S>(&mut window.weight, r), at::<S>(&mut window.travel, r));
            *travel = simd.max_f64s(*travel, simd.abs_f64s(y_now));
            let least = simd.mul_f64s(splat(LEAST), *travel);
            let judge = Judge::<S> {
                weight: *weight,
                settled: simd.less_than_f64s(*weight, splat(SETTLING)),
                clip2: settings.clip.map(|clip| splat(clip * clip)),
                floor: simd.mul_f64s(least, least),
                nine: splat(9.0),
            };
            let next = simd.div_f64s(*weight, simd.add_f64s(*weight, splat(1.0)));
            *weight = keep(simd.max_f64s(next, splat(1.0 / settings.memory)), *weight);
            let (sum, squares) = (at::<S>(&mut window.sum, r), at::<S>(&mut window.squares, r));
            let square = simd.mul_f64s(lambda, lambda);
            *sum = keep(simd.mul_add_e_f64s(*sum, lambda, splat(1.0)), *sum);
            *squares = keep(simd.mul_add_e_f64s(*squares, square, splat(1.0)), *squares);
            judge
        });
        let mut range = splat(0.0);
        for k in 0..bank.per {
            if let (Some(g), 0) = (fetched, r) {
                fetch(&bank.lanes[g * bank.per + k]);
                bank.errors.get(g * bank.per + k).map(fetch);
            }
            let (lanes, errors) = (&mut bank.lanes[first + k], bank.errors.get_mut(first + k));
            let row = newest - k;
            let u = *at::<S>(&mut ring[if row >= rows { row - rows } else { row }], r);
            let errors = errors.zip(judge.as_ref());
            range = simd.add_f64s(range, kernel::learn::<S, GATED>(simd, &fixed, &now, u, lanes, r, errors));
        }
        *at::<S>(&mut ranges, r) = range;
        fine &= simd.reduce_sum_f64s(range) < HUGE;
    }
    if !fine {
        bank.note_broken(g, &ranges);
    }
}

impl Bank {
    /// The numbers of eight columns.
    #[inline(always)]
    fn gather(&self, g: usize, x: &[f64]) -> Row {
        if self.copies == 1
            && let Some(Ok(row)) = x.get(g * W..(g + 1) * W).map(<[f64; W]>::try_from)
        {
            return Row(row);
        }
        if self.loops == 1 {
            return Row::of(x[0]);
        }
        Row(std::array::from_fn(|s| self.columns[g * W + s].source.map_or(0.0, |k| x[k])))
    }

    /// Counts u and y from their origins, and never quite reaches them.
    #[inline(always)]
    fn centred(&self, g: usize, [mut u, mut y]: [Row; 2]) -> [Row; 2] {
        let inputs = &self.inputs[g];
        for s in 0..W {
            u[s] = u[s] - inputs.u_zero[s] + REST;
            y[s] = y[s] - inputs.y_zero[s] + REST;
        }
        if let Some(factors) = self.factors.get(g) {
            for s in 0..W {
                u[s] *= factors[0][s];
                y[s] *= factors[1][s];
            }
        }
        [u, y]
    }

    /// Keeps `u(t)` for when it will be needed.
    #[inline(always)]
    fn store(&mut self, g: usize, u: &Row) {
        let rows = self.high + 1;
        let ring = &mut self.ring[g * rows..(g + 1) * rows];
        if self.copies == 1 && self.per > 1 {
            ring[self.head] = *u;
        } else {
            for (s, column) in self.columns[g * W..(g + 1) * W].iter().enumerate() {
                let row = self.head + column.lag;
                ring[if row >= rows { row - rows } else { row }][s] = u[s];
            }
        }
    }

    /// Starts what has not started, holds what is missing, and tells which columns learn, by 1.
    #[cold]
    fn attend(&mut self, g: usize, raw: [Row; 2], u: &mut Row, y: &mut Row) -> Row {
        let rows = self.high + 1;
        let inputs = &mut self.inputs[g];
        Row(std::array::from_fn(|s| {
            let column = &mut self.columns[g * W + s];
            let known = (u[s].is_finite(), y[s].is_finite());
            if !column.started && known == (true, true) {
                // Before the first sample u was something else: its delays must have passed.
                column.started = true;
                column.blind = self.high;
                (inputs.u_zero[s], inputs.y_zero[s]) = (raw[0][s], raw[1][s]);
                (u[s], y[s]) = (0.0, 0.0);
                self.ring[g * rows..(g + 1) * rows].iter_mut().for_each(|row| row[s] = 0.0);
            } else if !column.started {
                (u[s], y[s]) = (0.0, 0.0);
            } else {
                let before = (self.head + self.high + column.lag) % rows;
                if !known.0 {
                    u[s] = self.ring[g * rows + before][s];
                    column.blind = self.high + 1;
                }
                if !known.1 {
                    y[s] = inputs.y_before[s];
                    column.blind = column.blind.max(2);
                }
            }
            column.was_blind = !column.started || column.blind > 0;
            column.blind = column.blind.saturating_sub(1);
            if column.learnt() { 1.0 } else { 0.0 }
        }))
    }

    /// Where something was unknown, the error is as well: zero is expected.
    #[cold]
    fn attended(&mut self, g: usize) {
        let columns = &self.columns[g * W..(g + 1) * W];
        for lanes in &mut self.lanes[g * self.per..(g + 1) * self.per] {
            for (ebar, column) in lanes.ebar.iter_mut().zip(columns) {
                if column.was_blind {
                    *ebar = 0.0;
                }
            }
        }
        self.attention[g] = columns.iter().any(|column| !column.plain());
    }

    #[cold]
    fn note_broken(&mut self, g: usize, ranges: &Row) {
        for (column, range) in self.columns[g * W..(g + 1) * W].iter_mut().zip(ranges.iter()) {
            column.broken = !(*range < HUGE);
        }
        self.broken = true;
    }

    /// Starts anew the loops of which a number has overflowed.
    #[cold]
    fn restart(&mut self) {
        self.broken = false;
        for c in 0..self.columns.len() {
            if !std::mem::take(&mut self.columns[c].broken) {
                continue;
            }
            // All columns of its loop, but where a register is not full.
            for c in self.columns[c].source.map_or(c..c + 1, |index| self.columns_of(index)) {
                self.columns[c].broken = false;
                self.columns[c].restarts += 1;
                self.clear(c);
            }
        }
    }
}
