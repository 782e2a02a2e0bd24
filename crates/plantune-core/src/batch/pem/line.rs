//! Signals that pass in stretches of rows, with the past that lags and recursions reach.

use crate::linalg::BLOCK;

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

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.data.fill(0.0);
    }

    /// The rows at hand.
    pub(super) fn rows(&mut self, len: usize) -> &mut [f64] {
        &mut self.data[self.past..][..len]
    }

    /// The rows at hand, each `lag` rows late.
    pub(super) fn late(&self, lag: usize, len: usize) -> &[f64] {
        &self.data[self.past - lag..][..len]
    }

    /// Row `k` of the rows at hand; negative before them.
    pub(super) fn at(&self, k: isize) -> f64 {
        self.data[self.past.wrapping_add_signed(k)]
    }

    /// The rows at hand become past.
    pub(super) fn pass(&mut self, len: usize) {
        self.data.copy_within(len..len + self.past, 0);
    }
}

/// `x = x / p(q)` for all lines at once, so that no recursion waits for its own last value.
pub(super) fn divide(p: &[f64], lines: &mut [Line], len: usize) {
    for group in lines.chunks_mut(6) {
        match group {
            [a] => one_order(p, [a], len),
            [a, b] => one_order(p, [a, b], len),
            [a, b, c] => one_order(p, [a, b, c], len),
            [a, b, c, d] => one_order(p, [a, b, c, d], len),
            [a, b, c, d, e] => one_order(p, [a, b, c, d, e], len),
            [a, b, c, d, e, f] => one_order(p, [a, b, c, d, e, f], len),
            _ => {}
        }
    }
}

fn one_order<const K: usize>(p: &[f64], lines: [&mut Line; K], len: usize) {
    match *p {
        [_, c1] => recursion([c1], lines, len),
        [_, c1, c2] => recursion([c1, c2], lines, len),
        [_, c1, c2, c3] => recursion([c1, c2, c3], lines, len),
        [_, c1, c2, c3, c4] => recursion([c1, c2, c3, c4], lines, len),
        _ => {
            for line in lines {
                for t in line.past..line.past + len {
                    let past: f64 = p[1..].iter().enumerate().map(|(i, c)| c * line.data[t - 1 - i]).sum();
                    line.data[t] -= past;
                }
            }
        }
    }
}

/// `y(t) = x(t) - c_1 y(t-1) - … - c_P y(t-P)` in place, the last values in registers.
fn recursion<const P: usize, const K: usize>(c: [f64; P], lines: [&mut Line; K], len: usize) {
    let mut y = [[0.0; P]; K];
    for (y, line) in y.iter_mut().zip(&lines) {
        for (i, y) in y.iter_mut().enumerate() {
            *y = line.at(-1 - i as isize);
        }
    }
    let mut rows = lines.map(|line| line.rows(len));
    for t in 0..len {
        for (y, rows) in y.iter_mut().zip(&mut rows) {
            let mut now = rows[t];
            for i in (0..P).rev() {
                now -= c[i] * y[i]; // the newest last: only this product is waited for
            }
            for i in (1..P).rev() {
                y[i] = y[i - 1];
            }
            y[0] = now;
            rows[t] = now;
        }
    }
}

/// `out = out + p(q) x`.
pub(super) fn add_product(p: &[f64], x: &Line, out: &mut [f64]) {
    let len = out.len();
    for (lag, &c) in p.iter().enumerate() {
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
            for count in [1, 2, 5, 6, 8] {
                let mut lines = vec![Line::new(7); count];
                let mut t = 0;
                for len in [3, 200, 1, 196] {
                    for (k, line) in lines.iter_mut().enumerate() {
                        line.rows(len).copy_from_slice(&x[t..t + len]);
                        line.rows(len).iter_mut().for_each(|v| *v *= k as f64 + 1.0);
                    }
                    divide(&p, &mut lines, len);
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
