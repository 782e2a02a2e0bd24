//! Columns chosen one by one, each time the one that lowers the sum of squared residuals most.
//!
//! ```text
//! next = argmax (a_j' e)^2 / a_j' a_j        a_j: column j without what those chosen explain, e: the residual
//! ```
//!
//! Orthogonal least squares (Chen, Billings and Luo, Int. J. Control 50, 1989). One triangle is kept, as in `nnls`.

use super::nnls::Set;
use super::qr::Triangle;

/// Chooses out of the columns for which `open` holds, given those chosen so far, until none is open or brings
/// anything; `first` are in from the beginning and not listed.
pub fn forward(
    triangle: &Triangle,
    columns: &[usize],
    rhs: usize,
    first: &[usize],
    open: impl Fn(&[usize], usize) -> bool,
) -> Vec<usize> {
    let all: Vec<usize> = first.iter().chain(columns).copied().collect();
    let free = vec![true; all.len()];
    let mut set = Set::new(triangle, &all, &free, rhs);
    for j in 0..first.len() {
        set.enter(j);
    }
    let mut chosen: Vec<usize> = Vec::new();
    loop {
        let next = (first.len()..all.len())
            .filter(|&j| !chosen.contains(&all[j]) && open(&chosen, all[j]))
            .map(|j| (j, set.gain(j)))
            .filter(|(_, gain)| *gain > 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1));
        match next {
            Some((j, _)) if set.enter(j) => chosen.push(all[j]),
            _ => return chosen,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{residual_norm2, white};
    use super::*;

    /// Each step is the best of all single steps, tried one by one.
    #[test]
    fn no_other_column_would_have_lowered_the_residual_more() {
        let (N, n) = (60, 9);
        let e = white(N * (n + 1), 4);
        let rows: Vec<&[f64]> = e.chunks_exact(n + 1).collect();
        let t = Triangle::of_rows(n + 1, rows.into_iter());
        let columns: Vec<usize> = (1..n).collect();
        let chosen = forward(&t, &columns, n, &[0], |chosen, j| chosen.len() < 4 && j != 5);
        assert_eq!(chosen.len(), 4);
        for k in 0..4 {
            let loss = |j: usize| {
                let tried: Vec<usize> = [0].iter().chain(&chosen[..k]).copied().chain([j]).collect();
                residual_norm2(&t, &tried, n, 1e-12)
            };
            let others = columns.iter().filter(|j| **j != 5 && !chosen[..k].contains(j));
            assert!(others.copied().all(|j| loss(chosen[k]) <= loss(j) * (1.0 + 1e-12)));
        }
    }
}
