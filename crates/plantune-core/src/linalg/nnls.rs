//! Least squares with some unknowns at least zero: `min |R[:, columns] x - R[:, rhs]|`, `x_j >= 0` but for the free.
//!
//! Active sets (Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23): unknowns enter one by one, the
//! one first along which the residual falls fastest; those that would turn negative on the way leave. Columns are
//! scaled to length one. One triangle is kept: a column enters by a reflection and leaves by rotations, so that a
//! step costs `n^2` operations. At the end no gradient points inwards: the minimum is the only one.

use super::qr::Triangle;

/// Columns nearer than this to those that are in bring nothing new.
const NEW: f64 = 1e-10;

/// Gradients below this share of the longest possible are rounding.
const FLAT: f64 = 1e-13;

/// The minimum.
#[derive(Clone, Debug, PartialEq)]
pub struct NonNegative {
    /// Unknowns, in the order of the columns asked for.
    pub x: Vec<f64>, // (n)
    /// Which of them are not held at zero, in the order in which they came in.
    pub inside: Vec<usize>,
    /// Sum of squared residuals.
    pub rss: f64,
}

/// Solves for the chosen columns; `free` says of each whether it may be negative. The search begins with the columns
/// `from`, of a problem much like this one, or none. A free column that depends on other free ones stays at zero.
pub fn nnls(
    triangle: &Triangle,
    columns: &[usize],
    free: &[bool],
    rhs: usize,
    from: &[usize],
) -> NonNegative {
    let mut set = Set::new(triangle, columns, free, rhs);
    let begin = (0..columns.len()).filter(|&j| free[j]).chain(from.iter().copied().filter(|&j| !free[j]));
    for j in begin {
        set.enter(j);
    }
    set.settle();
    let mut useless = vec![false; columns.len()];
    // A step lowers the sum of squares, and there are finitely many sets; the bound is for rounding alone.
    for _ in 0..10 * columns.len() + 10 {
        let Some(j) = set.steepest(&useless) else { break };
        if set.enter(j) && set.solution().last().is_some_and(|&x| x > 0.0) {
            set.settle();
            useless.fill(false);
        } else {
            if set.inside.last() == Some(&j) {
                set.leave(set.inside.len() - 1);
            }
            useless[j] = true;
        }
    }
    set.minimum()
}

/// The columns that are in, as the first ones of a triangle.
pub(super) struct Set<'f> {
    m: usize,
    a: Vec<f64>, // (n + 1, m) by columns, scaled; the last one the right-hand side
    scale: Vec<f64>,
    free: &'f [bool],
    inside: Vec<usize>, // in the order of the triangle
    x: Vec<f64>,        // (n), scaled
    travel: f64,        // length of the right-hand side
}

impl<'f> Set<'f> {
    pub(super) fn new(triangle: &Triangle, columns: &[usize], free: &'f [bool], rhs: usize) -> Self {
        let m = columns.iter().copied().chain([rhs]).max().map_or(0, |c| c + 1);
        let mut a: Vec<f64> =
            columns.iter().chain([&rhs]).flat_map(|&c| (0..m).map(move |i| triangle.at(i, c))).collect();
        let mut scale: Vec<f64> = a.chunks_exact(m).map(norm).collect();
        let travel = scale.pop().unwrap_or(0.0);
        for (column, s) in a.chunks_exact_mut(m).zip(&mut scale) {
            *s = if *s > 0.0 { *s } else { 1.0 };
            column.iter_mut().for_each(|a| *a /= *s);
        }
        Set { m, a, x: vec![0.0; scale.len()], scale, free, inside: Vec::new(), travel }
    }

    fn rhs(&self) -> &[f64] {
        &self.a[self.scale.len() * self.m..]
    }

    fn column(&self, j: usize) -> &[f64] {
        &self.a[j * self.m..][..self.m]
    }

    /// Takes column `j` in, if it brings something new.
    pub(super) fn enter(&mut self, j: usize) -> bool {
        let p = self.inside.len();
        if p >= self.m || self.inside.contains(&j) {
            return false;
        }
        let rest = norm(&self.column(j)[p..]);
        if rest <= NEW {
            return false;
        }
        // H = I - v v' / (v' v / 2), which leaves -sign(v_0) rest at row p of column j.
        let mut v = self.column(j)[p..].to_vec();
        v[0] += rest.copysign(v[0]);
        let half = 0.5 * v.iter().map(|v| v * v).sum::<f64>();
        for (k, column) in self.a.chunks_exact_mut(self.m).enumerate() {
            if !self.inside.contains(&k) {
                let share = v.iter().zip(&column[p..]).map(|(v, a)| v * a).sum::<f64>() / half;
                v.iter().zip(&mut column[p..]).for_each(|(v, a)| *a -= share * v);
            }
        }
        self.a[j * self.m + p + 1..(j + 1) * self.m].fill(0.0);
        self.inside.push(j);
        true
    }

    /// Lets the column at place `p` of the triangle go.
    fn leave(&mut self, p: usize) {
        let gone = self.inside.remove(p);
        self.x[gone] = 0.0;
        for (k, &j) in self.inside.iter().enumerate().skip(p) {
            let (above, below) = (self.a[j * self.m + k], self.a[j * self.m + k + 1]);
            let length = above.hypot(below);
            let (c, s) = (above / length, below / length);
            for column in self.a.chunks_exact_mut(self.m) {
                let (above, below) = (column[k], column[k + 1]);
                (column[k], column[k + 1]) = (c * above + s * below, c * below - s * above);
            }
            self.a[j * self.m + k + 1] = 0.0;
        }
    }

    /// Least squares on the columns that are in, in their order.
    fn solution(&self) -> Vec<f64> {
        let mut z = self.rhs()[..self.inside.len()].to_vec();
        for k in (0..z.len()).rev() {
            z[k] /= self.column(self.inside[k])[k];
            for i in 0..k {
                z[i] -= self.column(self.inside[k])[i] * z[k];
            }
        }
        z
    }

    /// Moves towards the solution; who would turn negative on the way leaves.
    fn settle(&mut self) {
        loop {
            let z = self.solution();
            // How far each one that ends below zero may go; of one that stands at zero, nowhere.
            let room = |(p, &j): (usize, &usize)| {
                let held = !self.free[j] && z[p] <= 0.0;
                held.then(|| (p, if self.x[j] > 0.0 { self.x[j] / (self.x[j] - z[p]) } else { 0.0 }))
            };
            let first = self.inside.iter().enumerate().filter_map(room).min_by(|a, b| a.1.total_cmp(&b.1));
            let step = first.map_or(1.0, |(_, step)| step);
            for (&j, z) in self.inside.iter().zip(&z) {
                self.x[j] += step * (z - self.x[j]);
            }
            let Some((first, _)) = first else { return };
            self.x[self.inside[first]] = 0.0;
            for p in (0..z.len()).rev() {
                let j = self.inside[p];
                if !self.free[j] && z[p] <= 0.0 && self.x[j] <= 0.0 {
                    self.leave(p);
                }
            }
        }
    }

    /// By how much column `j` would lower the sum of squares; 0 if it brings nothing new.
    pub(super) fn gain(&self, j: usize) -> f64 {
        let p = self.inside.len();
        if p >= self.m || self.inside.contains(&j) {
            return 0.0;
        }
        let (a, b) = (&self.column(j)[p..], &self.rhs()[p..]);
        let rest = norm(a);
        if rest <= NEW { 0.0 } else { (a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / rest).powi(2) }
    }

    /// The column along which the sum of squares falls fastest.
    fn steepest(&self, useless: &[bool]) -> Option<usize> {
        let p = self.inside.len();
        let slope =
            |j: usize| -> f64 { self.column(j)[p..].iter().zip(&self.rhs()[p..]).map(|(a, b)| a * b).sum() };
        (0..self.scale.len())
            .filter(|j| !useless[*j] && !self.inside.contains(j))
            .map(|j| (j, if self.free[j] { slope(j).abs() } else { slope(j) }))
            .filter(|(_, slope)| *slope > FLAT * self.travel)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(j, _)| j)
    }

    fn minimum(self) -> NonNegative {
        let rest = norm(&self.rhs()[self.inside.len()..]);
        let x = self.x.iter().zip(&self.scale).map(|(x, s)| x / s).collect();
        NonNegative { x, rss: rest * rest, inside: self.inside }
    }
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::white;
    use super::*;

    /// Rows `[X, y]` of a problem whose weights are partly negative without the bound.
    fn problem(N: usize, n: usize, seed: u64) -> Triangle {
        let e = white(N * (n + 1), seed);
        let rows: Vec<Vec<f64>> = (0..N)
            .map(|k| {
                let mut row = e[k * (n + 1)..][..n + 1].to_vec();
                // Neighbours look alike, as plays do.
                (1..n).for_each(|j| row[j] += 0.9 * row[j - 1]);
                row[n] += (0..n).map(|j| row[j] * ((j * j) as f64).sin()).sum::<f64>();
                row
            })
            .collect();
        Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice))
    }

    /// Gradient `A'(A x - b)` of each column.
    fn gradient(t: &Triangle, x: &[f64]) -> Vec<f64> {
        let n = x.len();
        let residual: Vec<f64> =
            (0..=n).map(|i| (0..n).map(|j| t.at(i, j) * x[j]).sum::<f64>() - t.at(i, n)).collect();
        (0..n).map(|j| (0..=n).map(|i| t.at(i, j) * residual[i]).sum()).collect()
    }

    /// The conditions of Karush, Kuhn and Tucker, which only the minimum meets.
    #[test]
    fn nothing_can_be_gained_at_the_minimum() {
        for n in [1, 2, 5, 20, 60] {
            for seed in 0..20 {
                let t = problem(3 * n + 10, n, seed);
                let columns: Vec<usize> = (0..n).collect();
                let free: Vec<bool> = (0..n).map(|j| j % 7 == 3).collect();
                let found = nnls(&t, &columns, &free, n, &[]);
                let gradient = gradient(&t, &found.x);
                for j in 0..n {
                    let (x, g) = (found.x[j], gradient[j]);
                    if found.inside.contains(&j) {
                        assert!(g.abs() < 1e-9 * n as f64, "{n} {seed} {j}: {g}");
                        assert!(free[j] || x > 0.0);
                    } else {
                        assert!(x == 0.0 && g > -1e-9 && !free[j], "{n} {seed} {j}: {x} {g}");
                    }
                }
            }
        }
    }

    /// Wherever the search begins, it ends in the same minimum.
    #[test]
    fn a_start_changes_nothing() {
        let t = problem(100, 20, 3);
        let (columns, free) = ((0..20).collect::<Vec<_>>(), [false; 20]);
        let cold = nnls(&t, &columns, &free, 20, &[]);
        for from in [&cold.inside[..], &columns[..], &[1, 2, 3]] {
            let warm = nnls(&t, &columns, &free, 20, from);
            assert!(warm.x.iter().zip(&cold.x).all(|(a, b)| (a - b).abs() < 1e-12));
            assert!((warm.rss - cold.rss).abs() < 1e-12 * cold.rss);
        }
    }

    /// Two columns that are the same share nothing: one of them does it all.
    #[test]
    fn a_column_that_is_there_twice_counts_once() {
        let rows: Vec<[f64; 3]> = (0..10).map(|k| [k as f64, k as f64, 2.0 * k as f64]).collect();
        let t = Triangle::of_rows(3, rows.iter().map(|row| &row[..]));
        let found = nnls(&t, &[0, 1], &[false; 2], 2, &[]);
        assert_eq!(found.inside.len(), 1);
        assert!((found.x[0] + found.x[1] - 2.0).abs() < 1e-14 && found.rss < 1e-20);
    }

    /// Least squares itself where nothing is bounded.
    #[test]
    fn free_unknowns_are_those_of_least_squares() {
        let t = problem(60, 12, 5);
        let columns: Vec<usize> = (0..12).collect();
        let found = nnls(&t, &columns, &[true; 12], 12, &[]);
        let plain = super::super::solve(&t, &columns, 12, 1e-12).expect("of full rank");
        assert!(found.x.iter().zip(&plain.theta).all(|(a, b)| (a - b).abs() < 1e-11));
        assert!((found.rss - plain.rss).abs() < 1e-11 * plain.rss);
    }
}
