//! `A` and `C` from the extended observability matrix by its shift.
//!
//! ```text
//! G = W1^-1 U1 S1^(1/2) = [C; C A; …; C A^(s-1)]
//! C = the first block row of G,   A = (G without the last)^+ (G without the first)
//! ```

use super::weights::Weighted;
use crate::linalg::{Matrix, least_squares};

/// `A`, `C` and what they come from.
pub struct Observability {
    /// `(n, n)`.
    pub A: Matrix,
    /// `(ny, n)`.
    pub C: Matrix,
    /// `(s ny, n)`.
    pub G: Matrix,
}

impl Observability {
    /// Of order `n`; the columns of `G` are scaled by `S1^(1/2)` or left as they are, which changes the basis
    /// of the states alone.
    pub fn of(weighted: &Weighted, n: usize, l: usize, scaled: bool) -> Self {
        let mut G = weighted.U.columns(0, n).into_owned();
        if scaled {
            G.column_iter_mut().zip(&weighted.S).for_each(|(mut column, s)| column *= s.sqrt());
        }
        let G = weighted.back.as_ref().map_or(G.clone(), |back| back * &G);
        let rows = G.nrows();
        let (upper, lower) = (G.rows(0, rows - l).into_owned(), G.rows(l, rows - l).into_owned());
        Observability { A: least_squares(&upper, &lower, 1e-14), C: G.rows(0, l).into_owned(), G }
    }
}
