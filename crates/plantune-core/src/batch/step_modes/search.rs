//! Variable projection: the sum of modes nearest to the data from one start.
//!
//! ```text
//! min over q of min over beta, c of  sum |y - X beta - phi(t; q) c_i|^2
//! ```
//!
//! `X beta` is what all pieces share, the level and the gain; `c_i` is the initial state of piece i, free. Both
//! follow by QR at every `q`, and Levenberg-Marquardt moves `q` alone, with Kaufman's projected slopes.
//!
//! Only partners of a pair can turn complex. Where two other poles have met, the search stands on a seam of the
//! parameters with no slope across it; paired anew it goes on.
//!
//! Golub and Pereyra, SIAM J. Num. Anal. 10, 1973; Kaufman 1975.

use super::basis::Basis;
use super::sections::{Section, Sections};
use crate::linalg::{Block, Complex, Minimum, Residuals, Segmented, Triangle, minimise, solve};
use crate::stats::median;

/// Rows after one change of the input.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Time of its first row on the record's clock, s.
    pub(super) first: f64,
    /// Stamps from there, s.
    pub(super) t: Vec<f64>,
    /// Output, scaled.
    pub(super) y: Vec<f64>,
    /// What the shared columns hold here: 1 for the level, the input's level for the gain.
    pub(super) shared: Vec<f64>,
}

/// The pieces, and how fast or slow a mode may be.
pub(super) struct Data {
    pub(super) pieces: Vec<Piece>,
    /// Largest and least rate looked for, 1/s.
    pub(super) reach: (f64, f64),
    /// Mean squared error below which a smaller one is rounding or the quantiser, not evidence.
    pub(super) floor: f64,
    /// The part of it that is rounding alone.
    pub(super) rounding: f64,
    /// Sum of squares that is zero but for rounding.
    exact: f64,
}

/// Pivots below this share add nothing.
const RANK_TOLERANCE: f64 = 1e-14;

/// Residual, as a share of y, that is rounding.
const ROUNDING: f64 = 1e-15;

/// Share of the variance of y below which a residual is rounding.
const ROUNDED: f64 = 1e-12;

/// Dampings looked for.
const ZETA: (f64, f64) = (1e-3, 1e2);

/// Steps of one search; those that need more wander along a valley that the noise has made.
const MOST_STEPS: usize = 40;

/// Change of `q` by pairing anew that means other partners.
const REPAIRED: f64 = 1e-3;

/// Searches from poles paired anew.
const MOST_PAIRINGS: usize = 5;

impl Data {
    pub(super) fn new(pieces: Vec<Piece>) -> Self {
        let least = |t: &[f64]| t.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
        let step = pieces.iter().map(|p| least(&p.t)).fold(f64::INFINITY, f64::min);
        let span = pieces.iter().map(|p| p.t[p.t.len() - 1]).fold(0.0, f64::max);
        let square = pieces.iter().flat_map(|p| &p.y).map(|y| y * y).sum::<f64>();
        let rounding = ROUNDED * variance(&pieces);
        let floor = rounding.max(quantum(&pieces).powi(2) / 6.0);
        Data { pieces, reach: (3.0 / step, 0.1 / span), floor, rounding, exact: ROUNDING.powi(2) * square }
    }

    /// Rows of all pieces.
    pub(super) fn N(&self) -> usize {
        self.pieces.iter().map(|p| p.y.len()).sum()
    }

    /// Columns that all pieces share.
    pub(super) fn shared(&self) -> usize {
        self.pieces[0].shared.len()
    }

    /// Each piece as data of its own, its level free.
    pub(super) fn alone(&self) -> impl Iterator<Item = Data> + '_ {
        let one = |p: &Piece| Data::new(vec![Piece { shared: vec![1.0], ..p.clone() }]);
        self.pieces.iter().map(one)
    }

    /// The longest piece, from which starts are made.
    pub(super) fn longest(&self) -> &Piece {
        let longest = self.pieces.iter().max_by_key(|p| p.y.len());
        longest.unwrap_or(&self.pieces[0])
    }

    /// The minimum reached from these poles, and its sum of squares.
    pub(super) fn fit(&self, poles: &[Complex<f64>]) -> Option<(Sections, Minimum)> {
        let mut found = self.search(Sections::of(poles))?;
        for _ in 0..MOST_PAIRINGS {
            let anew = Sections::of(&found.0.poles());
            if anew.q.iter().zip(&found.0.q).all(|(a, b)| (a - b).abs() <= REPAIRED) {
                break;
            }
            let Some(again) = self.search(anew) else { break };
            if again.1.cost >= found.1.cost * (1.0 - 1e-6) {
                break;
            }
            found = again;
        }
        Some(found)
    }

    fn search(&self, start: Sections) -> Option<(Sections, Minimum)> {
        let q = start.q.clone();
        let mut projection = Projection::new(self, start);
        let minimum = minimise(&mut projection, q)?;
        let sections = Sections { q: minimum.theta.clone(), ..projection.sections };
        Some((sections, minimum))
    }
}

fn variance(pieces: &[Piece]) -> f64 {
    let y = || pieces.iter().flat_map(|p| &p.y);
    let N = y().count() as f64;
    let mean = y().sum::<f64>() / N;
    y().map(|y| (y - mean).powi(2)).sum::<f64>() / N
}

/// The usual distance of one plateau to the next, 0 where y has none.
///
/// A slow response behind a quantiser climbs in stairs, which modes that ring can follow; its errors are below
/// twice `quantum^2/12`. Where plateaus are chance among noise, that lies below the variance of the noise.
fn quantum(pieces: &[Piece]) -> f64 {
    let mut stairs = Vec::new();
    for piece in pieces {
        let flat = piece.y.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]);
        let levels: Vec<f64> = flat.collect();
        stairs.extend(levels.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0));
    }
    median(stairs)
}

/// The problem in `q`, with room for its columns.
pub(super) struct Projection<'d> {
    data: &'d Data,
    pub(super) sections: Sections,
    basis: Vec<Basis>,
}

/// What is linear: the shared parameters, and the initial state of each piece.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    pub(super) beta: Vec<f64>,
    pub(super) c: Vec<Vec<f64>>,
}

impl<'d> Projection<'d> {
    pub(super) fn new(data: &'d Data, sections: Sections) -> Self {
        let k = sections.order();
        let basis = data.pieces.iter().map(|p| Basis::new(k, p.y.len())).collect();
        Projection { data, sections, basis }
    }

    /// Fills the columns at the present parameters.
    pub(super) fn fill(&mut self) {
        for (basis, piece) in self.basis.iter_mut().zip(&self.data.pieces) {
            basis.fill(&self.sections, &piece.t);
        }
    }

    /// Columns of piece `i`.
    pub(super) fn basis(&self, i: usize) -> &Basis {
        &self.basis[i]
    }

    /// The linear parameters at the columns filled last.
    pub(super) fn linear(&self) -> Option<Linear> {
        let m = self.data.shared();
        let mut problem = Segmented::new(self.sections.order(), m);
        (0..self.basis.len()).for_each(|i| problem.push(self.triangle(i, None)));
        let columns: Vec<usize> = (0..m).collect();
        let beta = solve(problem.common(), &columns, m, RANK_TOLERANCE).ok()?.theta;
        let c = problem.locals(&beta);
        c.iter().flatten().chain(&beta).all(|x| x.is_finite()).then_some(Linear { beta, c })
    }

    /// Triangle of piece `i`: `[phi | shared | slopes of phi c | y]`, slopes where `c` is given.
    fn triangle(&self, i: usize, c: Option<&[f64]>) -> Triangle {
        let (piece, basis) = (&self.data.pieces[i], &self.basis[i]);
        let (k, m) = (self.sections.order(), piece.shared.len());
        let slopes = if c.is_some() { k } else { 0 };
        let n = k + m + slopes + 1;
        let (mut triangle, mut block) = (Triangle::new(n), Block::new(n));
        let mut slope = vec![0.0; if c.is_some() { piece.y.len() } else { 0 }];
        let mut from = 0;
        let columns: Vec<Vec<f64>> = (0..slopes)
            .map(|s| {
                basis.slope_times(s, c.unwrap_or(&[]), &mut slope);
                slope.clone()
            })
            .collect();
        while from < piece.y.len() {
            let rows = from..(from + block.free()).min(piece.y.len());
            let len = rows.len();
            (0..k).for_each(|j| block.next_rows(j, len).copy_from_slice(&basis.column(0, j)[rows.clone()]));
            (0..m).for_each(|j| block.next_rows(k + j, len).fill(piece.shared[j]));
            for (s, column) in columns.iter().enumerate() {
                block.next_rows(k + m + s, len).copy_from_slice(&column[rows.clone()]);
            }
            block.next_rows(n - 1, len).copy_from_slice(&piece.y[rows.clone()]);
            block.grow(len);
            from = rows.end;
        }
        triangle.absorb(&mut block);
        triangle
    }
}

impl Residuals for Projection<'_> {
    fn linearise(&mut self, q: &[f64]) -> Option<Triangle> {
        self.sections.q.copy_from_slice(q);
        self.fill();
        let linear = self.linear()?;
        let (k, m) = (q.len(), self.data.shared());
        let mut problem = Segmented::new(k, m + k);
        for (i, c) in linear.c.iter().enumerate() {
            problem.push(self.triangle(i, Some(c)));
        }
        let triangle = problem.common().below(m);
        let finite = (0..=k).all(|i| triangle.row(i).iter().all(|x| x.is_finite()));
        finite.then_some(triangle)
    }

    fn project(&self, q: &mut [f64]) {
        let (fast, slow) = self.data.reach;
        for (section, at) in self.sections.places() {
            q[at] = q[at].clamp(slow.ln(), fast.ln());
            if section == Section::Pair {
                q[at + 1] = q[at + 1].clamp(ZETA.0.ln(), ZETA.1.ln());
            }
        }
    }

    fn exact(&self) -> f64 {
        self.data.exact
    }

    fn most_steps(&self) -> usize {
        MOST_STEPS
    }
}
