//! Signals that pass side by side in stretches of rows, with the past that lags and recursions reach.

use std::ops::Range;

use crate::linalg::{BLOCK, Recursion};

/// Beside scaled data this is nothing; what decays ends here, before processors become slow on it.
const NOTHING: f64 = 1e-100;

/// Lines of up to [`BLOCK`] rows, and some before them.
pub(super) struct Lines {
    past: usize,
    data: Vec<f64>, // (count, past + BLOCK)
}

impl Lines {
    /// All zero, with room for lags up to `past`.
    pub(super) fn new(count: usize, past: usize) -> Self {
        Lines { past, data: vec![0.0; count * (past + BLOCK)] }
    }

    /// Forgets the past.
    pub(super) fn clear(&mut self) {
        let past = self.past;
        self.data.chunks_exact_mut(past + BLOCK).for_each(|line| line[..past].fill(0.0));
    }

    /// The rows at hand become past.
    pub(super) fn pass(&mut self, len: usize) {
        let past = self.past;
        for line in self.data.chunks_exact_mut(past + BLOCK) {
            for i in 0..past {
                line[i] = line[len + i];
            }
            if line[..past].iter().all(|x| x.abs() < NOTHING) {
                line[..past].fill(0.0);
            }
        }
    }

    #[inline(always)]
    fn span(&self, line: usize) -> Range<usize> {
        let stride = self.past + BLOCK;
        line * stride..(line + 1) * stride
    }

    /// The rows at hand of a line.
    #[inline(always)]
    pub(super) fn rows(&mut self, line: usize, len: usize) -> &mut [f64] {
        let start = self.span(line).start + self.past;
        &mut self.data[start..][..len]
    }

    /// The rows at hand, each `lag` rows late.
    pub(super) fn late(&self, line: usize, lag: usize, len: usize) -> &[f64] {
        let start = self.span(line).start + self.past - lag;
        &self.data[start..][..len]
    }

    /// What `of` makes of `x` as the last of the rows at hand, zeros before.
    #[inline(always)]
    pub(super) fn take(&mut self, line: usize, of: impl Fn(f64) -> f64, x: &[f64], len: usize) {
        let (before, own) = self.rows(line, len).split_at_mut(len - x.len());
        before.fill(0.0);
        own.iter_mut().zip(x).for_each(|(to, x)| *to = of(*x));
    }

    /// The impulse at row `at` of those at hand.
    #[inline(always)]
    pub(super) fn impulse(&mut self, line: usize, at: Option<usize>, len: usize) {
        let line = self.rows(line, len);
        line.fill(0.0);
        if let Some(at) = at {
            line[at] = 1.0;
        }
    }

    /// `to += c from`, `lag` rows late.
    #[inline(always)]
    pub(super) fn add(&mut self, c: f64, (from, lag): (usize, usize), to: usize, len: usize) {
        self.combine(from, lag, to, len, |to, x| *to += c * x);
    }

    /// `to = p(q) from`
    #[inline(always)]
    pub(super) fn product(&mut self, p: &[f64], from: usize, to: usize, len: usize) {
        self.combine(from, 0, to, len, |to, x| *to = p[0] * x);
        for (lag, &c) in p.iter().enumerate().skip(1) {
            self.add(c, (from, lag), to, len);
        }
    }

    #[inline(always)]
    fn combine(&mut self, from: usize, lag: usize, to: usize, len: usize, with: impl Fn(&mut f64, f64)) {
        let [source, target] = [from, to].map(|line| self.span(line).start + self.past);
        let (head, tail) = self.data.split_at_mut(if from < to { target } else { source - self.past });
        let (x, out) = if from < to {
            (&head[source - lag..][..len], &mut tail[..len])
        } else {
            (&tail[self.past - lag..][..len], &mut head[target..][..len])
        };
        out.iter_mut().zip(x).for_each(|(to, x)| with(to, *x));
    }
}

/// Lines next to each other that are divided by one polynomial: first the one that takes what becomes of the
/// second when it is divided once more, then the others. Idle ones are added so that few sizes of the
/// recursion are compiled.
#[derive(Clone, Copy)]
pub(super) struct Group {
    start: usize,
    count: usize,
}

impl Group {
    /// `count` lines behind the one at `start`.
    pub(super) fn new(start: usize, count: usize) -> Self {
        Group { start, count: count.next_multiple_of(2) }
    }

    /// The first of them, divided twice.
    pub(super) fn twice(&self) -> usize {
        self.start
    }

    /// The first of them.
    pub(super) fn first(&self) -> usize {
        self.start + 1
    }

    /// The line behind the last.
    pub(super) fn end(&self) -> usize {
        self.start + 1 + self.count
    }
}

impl Lines {
    /// `x = x / p(q)` for all lines of a group, and `twice = sign x / p(q)` for what became of the first.
    pub(super) fn divide(&mut self, p: &[f64], group: Group, sign: f64, len: usize) {
        let lines = self.span(group.twice()).start..self.span(group.end()).start;
        let (past, stride) = (self.past, self.past + BLOCK);
        let (twice, all) = self.data[lines].split_at_mut(stride);
        let (head, tail) = all.split_at_mut(all.len().min(MOST * stride));
        Division { p, past, len, sign }.of(head, [twice]);
        tail.chunks_mut(MOST * stride).for_each(|part| Division { p, past, len, sign }.of(part, []));
    }
}

/// Most lines that are divided side by side.
const MOST: usize = 8;

/// What all lines of a group share.
struct Division<'p> {
    p: &'p [f64],
    past: usize,
    len: usize,
    sign: f64,
}

impl Division<'_> {
    fn of<const T: usize>(&self, lines: &mut [f64], twice: [&mut [f64]; T]) {
        match *self.p {
            [_] => twice.map(|twice| self.set(twice, lines)),
            [_, c1] => self.by_size([c1], lines, twice),
            [_, c1, c2] => self.by_size([c1, c2], lines, twice),
            // Three values kept in registers are compiled to half the speed of four.
            [_, c1, c2, c3] => self.by_size([c1, c2, c3, 0.0], lines, twice),
            [_, c1, c2, c3, c4] => self.by_size([c1, c2, c3, c4], lines, twice),
            _ => {
                lines.chunks_exact_mut(self.past + BLOCK).for_each(|line| self.one(line));
                twice.map(|twice| {
                    self.set(twice, lines);
                    self.one(twice);
                })
            }
        };
    }

    /// `twice = sign x`.
    fn set(&self, twice: &mut [f64], x: &[f64]) {
        let rows = self.past..self.past + self.len;
        twice[rows.clone()].iter_mut().zip(&x[rows]).for_each(|(to, x)| *to = self.sign * x);
    }

    /// A single line, by a polynomial of any order.
    fn one(&self, line: &mut [f64]) {
        for t in self.past..self.past + self.len {
            let before: f64 = self.p[1..].iter().enumerate().map(|(i, c)| c * line[t - 1 - i]).sum();
            line[t] -= before;
        }
    }

    fn by_size<const P: usize, const T: usize>(
        &self,
        c: [f64; P],
        lines: &mut [f64],
        twice: [&mut [f64]; T],
    ) -> [(); T] {
        match lines.len() / (self.past + BLOCK) {
            2 => self.recursion::<P, 2, T>(c, lines, twice),
            4 => self.recursion::<P, 4, T>(c, lines, twice),
            6 => self.recursion::<P, 6, T>(c, lines, twice),
            _ => self.recursion::<P, MOST, T>(c, lines, twice),
        }
        [(); T]
    }

    fn recursion<const P: usize, const K: usize, const T: usize>(
        &self,
        c: [f64; P],
        lines: &mut [f64],
        twice: [&mut [f64]; T],
    ) {
        let mut lines = lines.chunks_exact_mut(self.past + BLOCK);
        let lines: [&mut [f64]; K] = std::array::from_fn(|_| lines.next().unwrap_or_default());
        let before = |line: &[f64]| std::array::from_fn(|i| line[self.past - 1 - i]);
        let past = lines.each_ref().map(|line| before(line));
        let twice_past = twice.each_ref().map(|line| before(line));
        let rows = lines.map(|line| &mut line[self.past..][..self.len]);
        let twice = twice.map(|line| &mut line[self.past..][..self.len]);
        Recursion { c, rows, past, twice, twice_past, sign: self.sign }.run();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::poly;

    /// However the rows are cut, and for every order and number of lines, the whole signal is divided.
    #[test]
    fn stretches_divide_like_the_whole() {
        let x = white(400, 1);
        for order in 1..7 {
            let p: Vec<f64> = (0..=order).map(|k| 0.6f64.powi(k) * if k == 0 { 1.0 } else { 0.9 }).collect();
            let mut whole = x.clone();
            poly::divide(&p, &mut whole);
            let mut both = whole.clone();
            poly::divide(&p, &mut both);
            for count in [1, 3, 6, 8, 13] {
                let group = Group::new(1, count);
                let mut lines = Lines::new(group.end(), 7);
                let mut t = 0;
                for len in [3, 200, 1, 196] {
                    for k in 0..count {
                        let own = lines.rows(group.first() + k, len);
                        own.iter_mut().zip(&x[t..]).for_each(|(to, x)| *to = x * (k as f64 + 1.0));
                    }
                    lines.divide(&p, group, -1.0, len);
                    let gap = |line: usize, factor: f64, truth: &[f64]| {
                        let own = lines.late(line, 0, len).iter().zip(&truth[t..]);
                        own.map(|(a, b)| (a / factor - b).abs()).fold(0.0, f64::max)
                    };
                    assert!(gap(group.twice(), -1.0, &both) < 1e-12);
                    for k in 0..count {
                        let gap = gap(group.first() + k, k as f64 + 1.0, &whole);
                        assert!(gap < 1e-12, "order {order}, line {k} of {count}: {gap}");
                    }
                    lines.pass(len);
                    t += len;
                }
            }
        }
    }
}
