//! Signals that pass in stretches of rows, with the past that lags and recursions reach.

use crate::linalg::{BLOCK, Recursion};

/// Up to [`BLOCK`] rows of a signal, and some before them.
#[derive(Clone)]
pub(super) struct Line {
    past: usize,
    data: Vec<f64>, // (past + BLOCK)
}

impl Line {
    /// All zero, with room for lags up to `past`.
    pub(super) fn new(past: usize) -> Self {
        Line { past, data: vec![0.0; past + BLOCK] }
    }

    /// Forgets the past.
    pub(super) fn clear(&mut self) {
        self.data[..self.past].fill(0.0);
    }

    /// The rows at hand.
    pub(super) fn rows(&mut self, len: usize) -> &mut [f64] {
        &mut self.data[self.past..][..len]
    }

    /// The rows at hand, each `lag` rows late.
    pub(super) fn late(&self, lag: usize, len: usize) -> &[f64] {
        &self.data[self.past - lag..][..len]
    }

    /// `sign` times the rows at hand of another.
    fn set(&mut self, other: &Line, sign: f64, len: usize) {
        self.rows(len).iter_mut().zip(other.late(0, len)).for_each(|(to, x)| *to = sign * x);
    }

    /// `x = x / p(q)`, of any order.
    fn divide(&mut self, p: &[f64], len: usize) {
        for t in self.past..self.past + len {
            let before: f64 = p[1..].iter().enumerate().map(|(i, c)| c * self.data[t - 1 - i]).sum();
            self.data[t] -= before;
        }
    }

    /// The rows at hand become past.
    pub(super) fn pass(&mut self, len: usize) {
        self.data.copy_within(len..len + self.past, 0);
    }
}

/// Lines come in groups of this many, idle ones added, so that few sizes of the recursion are compiled.
pub(super) const GROUP: usize = 4;

/// `count` lines and the idle ones that fill the last group.
pub(super) fn lines(count: usize, past: usize) -> Vec<Line> {
    vec![Line::new(past); count.next_multiple_of(GROUP)]
}

/// `x = x / p(q)` for all lines, and `twice = sign x / p(q)` for what became of the first.
pub(super) fn divide(p: &[f64], all: &mut [Line], twice: &mut Line, sign: f64, len: usize) {
    let first = all.len().min(2 * GROUP);
    let (head, tail) = all.split_at_mut(first);
    by_order(p, head, [twice], sign, len);
    for group in tail.chunks_mut(2 * GROUP) {
        by_order(p, group, [], sign, len);
    }
}

fn by_order<const T: usize>(p: &[f64], group: &mut [Line], twice: [&mut Line; T], sign: f64, len: usize) {
    match *p {
        [_] => twice.map(|twice| twice.set(&group[0], sign, len)),
        [_, c1] => by_size([c1], group, twice, sign, len),
        [_, c1, c2] => by_size([c1, c2], group, twice, sign, len),
        [_, c1, c2, c3] => by_size([c1, c2, c3], group, twice, sign, len),
        [_, c1, c2, c3, c4] => by_size([c1, c2, c3, c4], group, twice, sign, len),
        _ => {
            group.iter_mut().for_each(|line| line.divide(p, len));
            twice.map(|twice| {
                twice.set(&group[0], sign, len);
                twice.divide(p, len);
            })
        }
    };
}

fn by_size<const P: usize, const T: usize>(
    c: [f64; P],
    group: &mut [Line],
    twice: [&mut Line; T],
    sign: f64,
    len: usize,
) -> [(); T] {
    if let Some((lines, _)) = group.split_first_chunk_mut::<{ 2 * GROUP }>() {
        recursion(c, lines.each_mut(), twice, sign, len);
    } else if let Some((lines, _)) = group.split_first_chunk_mut::<GROUP>() {
        recursion(c, lines.each_mut(), twice, sign, len);
    }
    [(); T]
}

fn recursion<const P: usize, const K: usize, const T: usize>(
    c: [f64; P],
    lines: [&mut Line; K],
    twice: [&mut Line; T],
    sign: f64,
    len: usize,
) {
    let before = |line: &Line| std::array::from_fn(|i| line.data[line.past - 1 - i]);
    let past = lines.each_ref().map(|line| before(line));
    let twice_past = twice.each_ref().map(|line| before(line));
    let (rows, twice) = (lines.map(|line| line.rows(len)), twice.map(|line| line.rows(len)));
    Recursion { c, rows, past, twice, twice_past, sign }.run();
}

/// `out = p(q) x`; `p[0]` must be 1.
pub(super) fn set_product(p: &[f64], x: &Line, out: &mut [f64]) {
    let len = out.len();
    out.copy_from_slice(x.late(0, len));
    for (lag, &c) in p.iter().enumerate().skip(1) {
        for (o, x) in out.iter_mut().zip(x.late(lag, len)) {
            *o += c * x;
        }
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
            for count in [1, 4, 7, 8, 13] {
                let (mut lines, mut twice) = (lines(count, 7), Line::new(7));
                let mut both = whole.clone();
                poly::divide(&p, &mut both);
                let mut t = 0;
                for len in [3, 200, 1, 196] {
                    for (k, line) in lines.iter_mut().enumerate() {
                        line.rows(len).copy_from_slice(&x[t..t + len]);
                        line.rows(len).iter_mut().for_each(|v| *v *= k as f64 + 1.0);
                    }
                    divide(&p, &mut lines, &mut twice, -1.0, len);
                    let own = twice.late(0, len).iter().zip(&both[t..]);
                    assert!(own.map(|(a, b)| (a + b).abs()).fold(0.0, f64::max) < 1e-12);
                    twice.pass(len);
                    for (k, line) in lines.iter_mut().enumerate() {
                        let own = line.late(0, len).iter().zip(&whole[t..]);
                        let gap = own.map(|(a, b)| (a / (k as f64 + 1.0) - b).abs()).fold(0.0, f64::max);
                        assert!(gap < 1e-12, "order {order}, line {k} of {count}: {gap}");
                        line.pass(len);
                    }
                    t += len;
                }
            }
        }
    }
}
