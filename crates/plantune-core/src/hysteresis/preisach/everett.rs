//! The Everett function on a grid of levels: a table, and straight lines between its nodes.
//!
//! ```text
//! E(alpha, beta) = integral of mu over beta <= b <= a <= alpha       E(beta, alpha) = -E(alpha, beta)
//! mu_ij = E_(i+1,j) - E_ij - E_(i+1,j+1) + E_(i,j+1)                 of the cell that holds alpha in [L_i, L_(i+1)]
//!                                                                    and beta in [L_j, L_(j+1)], i >= j
//! ```
//!
//! With the sign turned below the diagonal a rise and a fall are one formula, and the straight lines give what a cell
//! on the diagonal should: E proportional to `alpha - beta`. Mayergoyz, Mathematical Models of Hysteresis and Their
//! Applications, 2003, chapter 1.

/// Buckets per cell of an uneven grid, which say where to begin to look for a level.
const BUCKETS: usize = 4;

/// Levels nearer to an even grid than this share of their range are even.
const EVEN: f64 = 1e-13;

/// Table of E and its grid.
#[derive(Clone, Debug)]
pub struct Everett {
    levels: Vec<f64>, // (n + 1)
    table: Vec<f64>,  // (n + 1, n + 1), E(L_i, L_j) at row j, column i
    per_gap: Vec<f64>,
    first: Vec<u32>, // of each bucket its first cell; empty where the grid is even
    per_bucket: f64, // per cell where the grid is even
}

/// A place on the grid: a cell, and the share of it below.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    cell: usize,
    share: f64,
}

impl Everett {
    /// From weights of cells, (n, n) row-major with row `i` of alpha; above the diagonal nothing counts.
    pub fn of_mu(levels: &[f64], mu: &[f64]) -> Self {
        let n = levels.len() - 1;
        let E = everett_of_mu(n, mu);
        let mut table = vec![0.0; E.len()];
        for a in 0..=n {
            for b in 0..a {
                table[b * (n + 1) + a] = E[a * (n + 1) + b];
                table[a * (n + 1) + b] = -E[a * (n + 1) + b];
            }
        }
        let range = levels[n] - levels[0];
        let even = |k: usize| levels[0] + range * k as f64 / n as f64;
        let buckets =
            if (0..=n).all(|k| (levels[k] - even(k)).abs() <= EVEN * range) { 0 } else { BUCKETS * n };
        let edge = |b: usize| levels[0] + range * b as f64 / buckets as f64;
        Everett {
            levels: levels.to_vec(),
            table,
            per_gap: levels.windows(2).map(|l| 1.0 / (l[1] - l[0])).collect(),
            first: (0..buckets).map(|b| cell_of(levels, edge(b)) as u32).collect(),
            per_bucket: if buckets == 0 { n } else { buckets } as f64 / range,
        }
    }

    /// Lowest and highest level.
    pub fn ends(&self) -> (f64, f64) {
        (self.levels[0], self.levels[self.levels.len() - 1])
    }

    /// The levels.
    pub fn levels(&self) -> &[f64] {
        &self.levels
    }

    /// Where `x` is.
    #[inline(always)]
    pub fn locate(&self, x: f64) -> Spot {
        let place = (x - self.levels[0]) * self.per_bucket;
        if self.first.is_empty() {
            let cell = (place as usize).min(self.levels.len() - 2);
            return Spot { cell, share: place - cell as f64 };
        }
        let mut cell = self.first[(place as usize).min(self.first.len() - 1)] as usize;
        while cell + 2 < self.levels.len() && x >= self.levels[cell + 1] {
            cell += 1;
        }
        Spot { cell, share: (x - self.levels[cell]) * self.per_gap[cell] }
    }

    /// `E(x, turn)`, negative where `x` is the lower one.
    #[inline(always)]
    pub fn between(&self, x: Spot, turn: Spot) -> f64 {
        let (at_level, at_next) = self.beside(x, turn);
        at_level + turn.share * (at_next - at_level)
    }

    /// `-dE(x, turn)/d turn`.
    pub fn slope(&self, x: Spot, turn: Spot) -> f64 {
        let (at_level, at_next) = self.beside(x, turn);
        (at_level - at_next) * self.per_gap[turn.cell]
    }

    /// `E(x, L)` at the levels below and above `turn`.
    #[inline(always)]
    fn beside(&self, x: Spot, turn: Spot) -> (f64, f64) {
        let at = |row: usize| {
            let pair = &self.table[row * self.levels.len() + x.cell..][..2];
            pair[0] + x.share * (pair[1] - pair[0])
        };
        (at(turn.cell), at(turn.cell + 1))
    }

    /// The nearest `x` above (`rising`) or below at which `E(x, turn)` is `target`, where E nowhere falls with `x`;
    /// the end of the range where it does not come so far.
    pub fn seek(&self, target: f64, turn: Spot, rising: bool) -> f64 {
        let n = self.levels.len();
        let at = |i: usize| {
            let (low, high) = (self.table[turn.cell * n + i], self.table[(turn.cell + 1) * n + i]);
            low + turn.share * (high - low)
        };
        // The first level that reaches the target, or the first beyond it.
        let (mut below, mut above) = (0, n);
        while below < above {
            let middle = (below + above) / 2;
            let short = if rising { at(middle) < target } else { at(middle) <= target };
            (below, above) = if short { (middle + 1, above) } else { (below, middle) };
        }
        if above == 0 || above == n {
            return self.levels[if above == 0 { 0 } else { n - 1 }];
        }
        let (low, high) = (at(above - 1), at(above));
        self.levels[above - 1] + (target - low) / (high - low) / self.per_gap[above - 1]
    }
}

/// Largest cell that begins at or below `x`.
fn cell_of(levels: &[f64], x: f64) -> usize {
    (levels.partition_point(|l| *l <= x).max(1) - 1).min(levels.len() - 2)
}

/// E at every pair of `n + 1` levels, row `a` of alpha; 0 where `alpha <= beta`.
pub fn everett_of_mu(n: usize, mu: &[f64]) -> Vec<f64> {
    let mut E = vec![0.0; (n + 1) * (n + 1)];
    for a in 1..=n {
        let mut row = 0.0;
        for b in (0..a).rev() {
            row += mu[(a - 1) * n + b];
            E[a * (n + 1) + b] = E[(a - 1) * (n + 1) + b] + row;
        }
    }
    E
}

/// Weights of the cells of a table of E, row `a` of alpha, of `n + 1` levels.
pub fn mu_of_everett(n: usize, E: &[f64]) -> Vec<f64> {
    let at = |a: usize, b: usize| if a > b { E[a * (n + 1) + b] } else { 0.0 };
    let mut mu = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            mu[i * n + j] = at(i + 1, j) - at(i, j) - at(i + 1, j + 1) + at(i, j + 1);
        }
    }
    mu
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_and_table_are_each_others_inverse() {
        let n = 7;
        let mu: Vec<f64> = (0..n * n).map(|k| if k / n >= k % n { (k as f64).sin() } else { 0.0 }).collect();
        let again = mu_of_everett(n, &everett_of_mu(n, &mu));
        assert!(mu.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-13));
    }

    #[test]
    fn every_level_is_found_on_an_uneven_grid() {
        let levels: Vec<f64> = (0..50).map(|k| (k as f64 / 10.0).exp()).collect();
        let E = Everett::of_mu(&levels, &vec![1.0; 49 * 49]);
        for (i, l) in levels.iter().enumerate() {
            let spot = E.locate(*l);
            assert!((spot.cell as f64 + spot.share - i as f64).abs() < 1e-12);
        }
    }
}
