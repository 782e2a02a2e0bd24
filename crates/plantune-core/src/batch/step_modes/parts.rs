//! What each mode adds to the response: the sum of sections in parallel that is the row of them.
//!
//! ```text
//! e_1' e^(A t) c = sum_m e_1' e^(A_m t) d_m,   from   e_1' A^n c = sum_m e_1' A_m^n d_m,   n = 0 … k - 1
//! ```
//!
//! `A_m` is `[-1/T]` of a lag and two by two of a pair. Close modes have large parts of opposite sign, and their
//! bands say so.

use super::basis::Basis;
use super::order::{Kind, Mode};
use super::sections::{Section, Sections};
use super::sloped::Sloped;
use crate::linalg::{Triangle, solve};

/// Points over the response.
pub(super) const POINTS: usize = 101;

/// The sections in parallel, by rising time constant, `split` of a pair into two lags where it is two modes.
fn parallel(sections: &Sections, split: &[bool]) -> Vec<Sections> {
    let mut parts = Vec::new();
    for ((section, at), split) in sections.places().zip(split) {
        let own = &sections.q[at..at + section.order()];
        if section == Section::Pair && *split {
            let (w, zeta) = (own[0].exp(), own[1].exp());
            let fast = w * (zeta + (zeta * zeta - 1.0).max(0.0).sqrt());
            parts.extend(
                [fast, w * w / fast].map(|w| Sections { pattern: vec![Section::Lag], q: vec![w.ln()] }),
            );
        } else {
            parts.push(Sections { pattern: vec![section], q: own.to_vec() });
        }
    }
    parts.sort_by(|a, b| b.q[0].total_cmp(&a.q[0]));
    parts
}

/// Which sections are two modes.
pub(super) fn splits(sections: &Sections, modes: &[Mode]) -> Vec<bool> {
    let joined = |at: usize| {
        let T = (-sections.q[at]).exp();
        modes.iter().any(|m| m.kind != Kind::Lag && (m.T / T - 1.0).abs() < 1e-9)
    };
    sections.places().map(|(section, at)| section == Section::Pair && !joined(at)).collect()
}

/// The part of each mode on a grid of [`POINTS`] up to `end`, from states `c`; None where modes coincide.
pub(super) fn parts(sections: &Sections, split: &[bool], c: &[f64], end: f64) -> Option<Vec<Vec<f64>>> {
    let k = sections.order();
    let parallel = parallel(sections, split);
    let rate = sections.poles().iter().map(|p| p.norm()).product::<f64>().powf(1.0 / k as f64);
    let whole = moments(sections.matrix(), k, rate);
    let own: Vec<Vec<f64>> = parallel.iter().map(|s| moments(s.matrix(), k, rate)).collect();
    let rows: Vec<Vec<f64>> = (0..k)
        .map(|n| {
            let of = |(s, m): (&Sections, &Vec<f64>)| m[n * s.order()..][..s.order()].to_vec();
            let left: Vec<f64> = parallel.iter().zip(&own).flat_map(of).collect();
            let right = (0..k).map(|j| whole[n * k + j] * c[j]).sum();
            [left, vec![right]].concat()
        })
        .collect();
    let triangle = Triangle::of_rows(k + 1, rows.iter().map(Vec::as_slice));
    let d = solve(&triangle, &(0..k).collect::<Vec<_>>(), k, 1e-13).ok()?.theta;
    let t: Vec<f64> = (0..POINTS).map(|i| end * i as f64 / (POINTS - 1) as f64).collect();
    let mut from = 0;
    let curve = |s: &Sections| {
        let mut basis = Basis::new(s.order(), POINTS);
        basis.fill(s, &t);
        let d = &d[from..from + s.order()];
        from += s.order();
        (0..POINTS).map(|i| d.iter().enumerate().map(|(j, d)| d * basis.column(0, j)[i]).sum()).collect()
    };
    Some(parallel.iter().map(curve).collect())
}

/// First rows of `(A/rate)^n`, `n = 0 … count - 1`.
fn moments(A: Sloped, count: usize, rate: f64) -> Vec<f64> {
    let A = A.part(0);
    let n = A.len().isqrt();
    let mut row = vec![0.0; n];
    row[0] = 1.0;
    let mut out = Vec::with_capacity(count * n);
    for _ in 0..count {
        out.extend(&row);
        row = (0..n).map(|j| (0..n).map(|i| row[i] * A[i * n + j] / rate).sum()).collect();
    }
    out
}
