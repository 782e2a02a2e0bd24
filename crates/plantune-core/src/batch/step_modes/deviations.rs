//! How sure the parameters are, correlated residuals included.
//!
//! ```text
//! P = s^2 (J'J)^-1 of all of [q, shared, c_1, c_2, …],   s^2 = RSS/(N - n)
//! T = (zeta ± root)/w,   d ln T / d ln zeta = ± zeta/root,   d ln T / d ln w = -1,   root = sqrt(zeta^2 - 1)
//! ```
//!
//! This is the Cramér-Rao bound for white errors. With errors of lag-1 correlation r the deviations are
//! `sqrt((1 + r)/(1 - r))` times as large, and N rows count as `N (1 - r)/(1 + r)`.

use super::search::{Data, Linear, Projection};
use super::sections::{Section, Sections};
use crate::linalg::{Triangle, solve};

/// Smallest share of a pivot with which the covariance is believed.
const RANK_TOLERANCE: f64 = 1e-12;

/// The best fit of one order, with its covariance.
pub(super) struct Candidate {
    pub(super) sections: Sections,
    pub(super) linear: Linear,
    pub(super) rss: f64,
    /// Rows.
    pub(super) N: usize,
    /// Parameters: of the sections, shared, and states.
    pub(super) n: usize,
    /// Lag-1 correlation of the residual; 0 where it is rounding.
    pub(super) r: f64,
    /// Covariance for white errors, (n, n) row-major; infinite where the data do not tell parameters apart.
    pub(super) P: Vec<f64>,
    /// Mean squared error that is as good as none.
    pub(super) floor: f64,
    /// Whether the gradient test passed.
    pub(super) converged: bool,
}

impl Candidate {
    pub(super) fn new(data: &Data, sections: Sections, converged: bool) -> Option<Self> {
        let mut projection = Projection::new(data, sections);
        projection.fill();
        let linear = projection.linear()?;
        let J = jacobian(data, &projection, &linear);
        let n = J.n() - 1;
        let (N, floor) = (data.N(), data.floor);
        let (rss, r) = residual(data, &projection, &linear);
        let columns: Vec<usize> = (0..n).collect();
        let P = match solve(&J, &columns, n, RANK_TOLERANCE) {
            Ok(solution) if N > n => solution.inverse_gram.iter().map(|x| x * rss / (N - n) as f64).collect(),
            _ => vec![f64::INFINITY; n * n],
        };
        let r = if rss > N as f64 * floor { r } else { 0.0 };
        let sections = projection.sections;
        // Where nothing but rounding is left, it hides the gradient.
        let converged = converged || rss <= N as f64 * data.rounding;
        Some(Candidate { sections, linear, rss, N, n, r, P, floor, converged })
    }

    /// Poles.
    pub(super) fn order(&self) -> usize {
        self.sections.order()
    }

    /// Where the first shared parameter stands in `P`; the states follow.
    pub(super) fn shared(&self) -> usize {
        self.order()
    }

    /// Where the states of piece `i` stand in `P`.
    pub(super) fn states(&self, i: usize) -> usize {
        self.order() + self.linear.beta.len() + i * self.order()
    }

    /// `g' P g` for a gradient given at a few places.
    pub(super) fn deviation(&self, g: &[(usize, f64)]) -> f64 {
        let sum: f64 = g
            .iter()
            .flat_map(|&(i, a)| g.iter().map(move |&(j, b)| (i, a, j, b)))
            .filter(|(_, a, _, b)| a * b != 0.0)
            .map(|(i, a, j, b)| a * b * self.P[i * self.n + j])
            .sum();
        if sum.is_finite() { sum.max(0.0).sqrt() } else { f64::INFINITY }
    }
}

/// Factor by which correlated errors widen deviations.
pub(super) fn widening(r: f64) -> f64 {
    ((1.0 + r) / (1.0 - r)).sqrt()
}

/// A time constant with the gradient of its logarithm along `q`.
pub(super) struct TimeConstant {
    pub(super) T: f64,
    pub(super) gradient: Vec<(usize, f64)>,
}

/// The time constants of one section; of a complex pair `1/w` twice.
///
/// At a repeated pole the gradient along `ln zeta` is infinite: there `w` and `zeta` are the answer.
pub(super) fn time_constants(sections: &Sections, section: Section, at: usize) -> Vec<TimeConstant> {
    let w = sections.q[at].exp();
    if section == Section::Lag {
        return vec![TimeConstant { T: 1.0 / w, gradient: vec![(at, -1.0)] }];
    }
    let zeta = sections.q[at + 1].exp();
    let root = (zeta * zeta - 1.0).max(0.0).sqrt();
    let of = |sign: f64| {
        let slope = if root > 0.0 { sign * zeta / root } else { 0.0 };
        let T = (zeta + root).powf(sign) / w;
        TimeConstant { T, gradient: vec![(at, -1.0), (at + 1, slope)] }
    };
    vec![of(-1.0), of(1.0)]
}

/// Triangle of `[slopes along q | shared | states of each piece | y]`.
fn jacobian(data: &Data, projection: &Projection, linear: &Linear) -> Triangle {
    let (k, m) = (projection.sections.order(), data.shared());
    let n = k + m + k * data.pieces.len();
    let (mut triangle, mut block) = (Triangle::new(n + 1), crate::linalg::Block::new(n + 1));
    let mut row = vec![0.0; n + 1];
    for (i, (piece, c)) in data.pieces.iter().zip(&linear.c).enumerate() {
        let basis = projection.basis(i);
        row.fill(0.0);
        row[k..k + m].copy_from_slice(&piece.shared);
        for (t, &y) in piece.y.iter().enumerate() {
            for s in 0..k {
                row[s] = (0..k).map(|j| c[j] * basis.column(1 + s, j)[t]).sum();
                row[k + m + i * k + s] = basis.column(0, s)[t];
            }
            row[n] = y;
            block.push(&row);
        }
    }
    triangle.absorb(&mut block);
    triangle
}

/// Sum of squared residuals, and their lag-1 correlation.
fn residual(data: &Data, projection: &Projection, linear: &Linear) -> (f64, f64) {
    let (mut rss, mut product) = (0.0, 0.0);
    for (i, (piece, c)) in data.pieces.iter().zip(&linear.c).enumerate() {
        let level: f64 = piece.shared.iter().zip(&linear.beta).map(|(x, b)| x * b).sum();
        let mut before = 0.0;
        for (t, y) in piece.y.iter().enumerate() {
            let modes: f64 = c.iter().enumerate().map(|(j, c)| c * projection.basis(i).column(0, j)[t]).sum();
            let e = y - level - modes;
            rss += e * e;
            product += e * before;
            before = e;
        }
    }
    (rss, if rss > 0.0 { product / rss } else { 0.0 })
}
