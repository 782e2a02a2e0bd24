//! The impulse response by least squares: no prior, every tap for itself.
//!
//! ```text
//! g = R1^-1 R2,  Cov g = s2 (R1'R1)^-1,  s2 = r^2 / (N - nu n - 1)
//! ```

use super::posterior::Taps;
use super::rows::Rows;
use super::{ImpulseResponse, response};
use crate::batch::WIDTH;
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::solve;
use crate::note::Place;

/// The response; X02 where the inputs do not tell the taps apart.
pub(super) fn least_squares(rows: &Rows, limits: &Limits) -> Result<ImpulseResponse> {
    let (triangle, units) = rows.triangle();
    let (n, all, N) = (rows.n, triangle.n() - 1, rows.N());
    let columns: Vec<usize> = (0..all).collect();
    let solution = solve(&triangle, &columns, all, limits.X08).map_err(|deficient| {
        Error::new(
            "X02",
            format!(
                "the inputs do not tell {} taps apart: {} of them depend on others",
                all - 1,
                deficient.dependent.len()
            ),
        )
        .at(Place::column("n"))
        .count(deficient.dependent.len())
        .measured(deficient.ratio, limits.X08)
        .remedy("ask for kernel=\"tc\", which needs less, or for fewer taps")
    })?;
    let s2 = solution.rss / (N - all) as f64;
    let one = |(i, unit): (usize, &f64)| {
        let at = |k: usize| 1 + i * n + k;
        let g: Vec<f64> = (0..n).map(|k| solution.theta[at(k)]).collect();
        let P = (0..n * n).map(|kl| s2 * solution.inverse_gram[at(kl / n) * all + at(kl % n)]).collect();
        let mut found = response(Taps { g, P }, *unit, rows.first);
        let first = (0..n).find(|&k| found.g[k].abs() > 1.5 * WIDTH * found.P[k * n + k].sqrt());
        found.nk += first.unwrap_or(0);
        found
    };
    Ok(ImpulseResponse {
        first: rows.first,
        responses: units.iter().enumerate().map(one).collect(),
        noise_sd: s2.sqrt() / rows.y_factor(),
        D: rows.D.clone(),
        evidence: None,
        N,
        notes: Vec::new(),
    })
}
