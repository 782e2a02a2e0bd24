//! The one predictor of the polynomial family, its gradient, and the initial state of every stretch.
//!
//! ```text
//! w_i = B_i/F_i u_i(t - nk_i),   v = A y - sum w_i - d,   eps = D/C v
//!
//! psi = -d eps/d theta:
//!   a_k: -(D/C) y(t-k)                    c_k:  (1/C) eps(t-k)
//!   b_k:  (D/(C F_i)) u_i(t-nk_i-k)       d_k: -(1/C) v(t-k)
//!   d:    (D/C) 1                         f_k: -(D/(C F_i)) w_i(t-k)
//! ```
//!
//! All recursions begin at rest where a stretch begins, so that each signal is filtered once and its lags are the
//! same numbers later. What the rows before the stretch have left enters as impulses from the first residual row
//! on: into every `1/F_i`, and into `1/C`. The error is linear in them, so they are eliminated stretch by stretch
//! ([`Segmented`]).
//! Rows pass in blocks that stay in the cache; no signal of the record's length is made.
//!
//! Ljung 1999, (7.19) and 10.3; source 001, 3.5.7.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::ops::Range;

use super::super::orders::Orders;
use super::super::poly_fit::EXACT;
use super::super::scores::Part;
use super::layout::Layout;
use super::lines::Lines;
use crate::linalg::{
    BLOCK, Block, Gram, MOST_STEPS, Minimum, Residuals, Segmented, TIE, Triangle, minimise, residual_norm2,
    solve_damped, vectorised,
};
use crate::model::PolyModel;
use crate::poly::{is_stable, reflected};
use crate::record::{Record, Scale};
use crate::sim::Start;
use crate::stats::f_tail;

/// Further lags that must not explain anything at a minimum that is believed.
const FURTHER: usize = 2;

/// Least p-value at which they are taken as explaining nothing.
const BY_CHANCE: f64 = 1e-3;

/// Rows from which on a part of them leads to the minimum first: one of [`PART`], in [`PIECES`].
const MANY: usize = 32_000;
const PART: usize = 16;
const PIECES: usize = 8;

/// Steps on the part, which ends elsewhere anyway.
const STEPS_OF_PART: usize = 6;

/// Scaled data, and the signals on their way through a model.
pub(super) struct Predictor<'r, 'a> {
    rec: &'r Record<'a>,
    orders: &'r Orders,
    constant: bool,
    start: Start,
    pub(super) scale_u: Vec<Scale>,
    pub(super) scale_y: Scale,
    u: Vec<Cow<'a, [f64]>>,
    y: Cow<'a, [f64]>,
    /// `u` row by row, and `y`, as far as a start has asked for them.
    scaled: OnceCell<[Vec<f64>; 2]>,
    /// Rows without a break that the model needs whole; residuals begin `history` rows later.
    stretches: Vec<Range<usize>>,
    history: usize,
    /// Initial state of each stretch with which the rows at hand are made.
    x0: Vec<Vec<f64>>,
    /// The best parameters so far.
    best: Option<Best>,
    /// The model that rows pass through.
    model: PolyModel,
    layout: Layout,
    lines: Lines,
    /// First row of the record that the lines hold.
    at: usize,
    /// Rows on their way into a QR, once one was needed.
    block: Option<Block>,
    /// Whether columns have been far enough from dependence for sums of their products.
    by_products: bool,
    most_steps: usize,
}

/// Parameters, their cost, the states used there, and what is left of the states' columns.
struct Best {
    theta: Vec<f64>,
    cost: f64,
    x0: Vec<Vec<f64>>,
    heads: Segmented,
}

impl Best {
    /// The best states for parameters nearby.
    fn x0(&self, theta: &[f64]) -> Vec<Vec<f64>> {
        let mut step: Vec<f64> = theta.iter().zip(&self.theta).map(|(t, own)| t - own).collect();
        step.resize(self.heads.shared(), 0.0); // further columns stand still
        let more = self.heads.locals(&step);
        let sum = |(x, more): (&Vec<f64>, Vec<f64>)| x.iter().zip(more).map(|(x, m)| x + m).collect();
        self.x0.iter().zip(more).map(sum).collect()
    }
}

impl<'r, 'a> Predictor<'r, 'a> {
    pub(super) fn new(rec: &'r Record<'a>, orders: &'r Orders, constant: bool, start: Start) -> Self {
        // At rest before the record means zero in its own units.
        let centred = constant && start == Start::Estimate;
        let u: Vec<Cow<[f64]>> = (0..rec.nu).map(|i| rec.input(i)).collect();
        let scale_u: Vec<Scale> = u.iter().map(|u| Scale::of(u, centred)).collect();
        let y = rec.output_held(0);
        let scale_y = Scale::of(&y, centred);
        let history = if start == Start::Zero { 0 } else { orders.history() };
        let layout = Layout::new(orders, constant, start);
        let states = layout.states;
        let stretches: Vec<_> =
            stretches(rec, orders).into_iter().filter(|s| s.len() > history + states).collect();
        let most_f = orders.nf.iter().copied().max().unwrap_or(0);
        let most_b = orders.nb.iter().copied().max().unwrap_or(0);
        let most = [orders.na, most_b, most_f, orders.nc, orders.nd].into_iter().max().unwrap_or(0);
        let past = FURTHER + 1 + most;
        Predictor {
            u,
            y,
            scaled: OnceCell::new(),
            scale_u,
            scale_y,
            x0: vec![vec![0.0; states]; stretches.len()],
            best: None,
            model: orders.model(&vec![0.0; orders.n()], rec.Ts),
            at: 0,
            block: None,
            lines: Lines::new(layout.count, past),
            by_products: true,
            most_steps: MOST_STEPS,
            layout,
            rec,
            orders,
            constant,
            start,
            stretches,
            history,
        }
    }

    /// Rows that count.
    pub(super) fn N(&self) -> usize {
        let rows = self.stretches.iter().flat_map(|s| s.start + self.history..s.end);
        if self.rec.valid.is_none() {
            rows.count()
        } else {
            rows.filter(|&k| self.rec.is_valid(k, 0)).count()
        }
    }

    /// Initial states of all stretches.
    pub(super) fn states(&self) -> usize {
        self.layout.states * self.stretches.len()
    }

    /// Initial state of each stretch, in the record's units: impulses into each `1/F_i`, then into `1/C`.
    pub(super) fn x0(&self) -> Vec<Vec<f64>> {
        let x0 = self.best.as_ref().map_or(self.x0.clone(), |best| best.x0(&best.theta));
        x0.into_iter().map(|x| x.into_iter().map(|x| x / self.scale_y.factor).collect()).collect()
    }

    pub(super) fn orders(&self) -> &'r Orders {
        self.orders
    }

    /// The same data for other orders.
    pub(super) fn of<'o>(&self, orders: &'o Orders) -> Predictor<'o, 'a>
    where
        'r: 'o,
    {
        Predictor::new(self.rec, orders, self.constant, self.start)
    }

    /// Rows without a break that the model needs whole.
    pub(super) fn stretches(&self) -> &[Range<usize>] {
        &self.stretches
    }

    /// `A`, `B` and the constant of least cost where `C D F` are those of `theta`, and that cost.
    ///
    /// The errors are linear in them.
    pub(super) fn completed(&mut self, mut theta: Vec<f64>) -> Option<(f64, Vec<f64>)> {
        let n = self.orders.n();
        let linear = self.orders.na + self.orders.nb.iter().sum::<usize>();
        theta.resize(n + usize::from(self.constant), 0.0);
        self.project(&mut theta);
        self.restart();
        let triangle = self.linearise(&theta)?;
        let columns: Vec<usize> = (0..linear).chain(n..theta.len()).collect();
        let step = solve_damped(&triangle, &columns, theta.len(), 0.0);
        columns.iter().zip(step).for_each(|(&j, step)| theta[j] += step);
        let cost = residual_norm2(&triangle, &columns, theta.len(), 1e-12);
        cost.is_finite().then_some((cost, theta))
    }

    pub(super) fn constant(&self) -> bool {
        self.constant
    }

    /// The scaled data as a record of its own.
    pub(super) fn data(&self) -> Record<'_> {
        let [u, y] = self.scaled.get_or_init(|| {
            let inputs = self.rec.u.iter().zip(self.scale_u.iter().cycle());
            [
                inputs.map(|(&u, s)| s.apply(u)).collect(),
                self.y.iter().map(|&y| self.scale_y.apply(y)).collect(),
            ]
        });
        Record { u, y, ny: 1, ..self.rec.clone() }
    }

    /// The data as they are.
    pub(super) fn record(&self) -> &'r Record<'a> {
        self.rec
    }

    /// Whether two further lags of every input and of the error lower the cost no more than by chance.
    pub(super) fn explains_all(&mut self, minimum: &Minimum) -> bool {
        if minimum.cost <= self.exact() {
            return true;
        }
        let further: Vec<_> = (1..=FURTHER).flat_map(|lag| self.layout.further(self.orders, lag)).collect();
        let own = self.layout.columns.len();
        self.layout.columns.extend(&further);
        let triangle = self.linearise(&minimum.theta);
        self.layout.columns.truncate(own);
        let Some(triangle) = triangle else { return false };
        let every: Vec<usize> = (0..triangle.n() - 1).collect();
        let left = residual_norm2(&triangle, &every, triangle.n() - 1, 1e-12);
        let (more, freedom) = (further.len() as f64, (self.N() - every.len()) as f64);
        let F = (minimum.cost - left) / more / (left / freedom).max(f64::MIN_POSITIVE);
        f_tail(F, more, freedom) > BY_CHANCE
    }

    /// The rows `[psi | eps]` at `theta` of each stretch, column by column, less what its initial state explains;
    /// and which rows of the record they are.
    pub(super) fn rows(&mut self, theta: &[f64]) -> Option<Vec<Part>> {
        self.restart();
        self.linearise(theta)?;
        self.x0 = self.best.take()?.x0(theta);
        self.linearise(theta)?;
        let shares = self.best.as_ref()?.heads.shares();
        let constant = theta.get(self.orders.n()).copied().unwrap_or(0.0);
        let of = |(s, shares): (usize, &Vec<Vec<f64>>)| {
            let mut columns = vec![Vec::new(); self.layout.columns.len() + 1];
            self.pass(s, constant, |own, rows| {
                let all = columns.iter_mut().enumerate();
                all.for_each(|(j, column)| column.extend_from_slice(own.column(j, rows.clone())));
            });
            let rest = columns.split_off(self.layout.states);
            let less = |(mut column, share): (Vec<f64>, &Vec<f64>)| {
                for (state, share) in columns.iter().zip(share) {
                    column.iter_mut().zip(state).for_each(|(x, state)| *x -= share * state);
                }
                column
            };
            let rows = self.stretches[s].start + self.history..self.stretches[s].end;
            let rows = rows.filter(|&k| self.rec.is_valid(k, 0)).collect();
            (rest.into_iter().zip(shares).map(less).collect(), rows)
        };
        Some(shares.iter().enumerate().map(of).collect())
    }

    /// Starts another descent.
    pub(super) fn restart(&mut self) {
        self.best = None;
        self.by_products = true;
        self.x0 = vec![vec![0.0; self.layout.states]; self.stretches.len()];
    }

    /// Parameters near the minimum, to which a part of a long record leads from `theta` sooner than all rows would.
    pub(super) fn approach(&mut self, theta: Vec<f64>) -> Vec<f64> {
        if self.N() < MANY {
            return theta;
        }
        let part = self.stretches.iter().flat_map(|s| self.pieces(s)).collect();
        let all = std::mem::replace(&mut self.stretches, part);
        self.most_steps = STEPS_OF_PART;
        self.restart();
        let near = minimise(self, theta.clone());
        self.most_steps = MOST_STEPS;
        self.stretches = all;
        near.map_or(theta, |near| near.theta)
    }

    /// A [`PART`] of a stretch: pieces all over it; from rest, its head.
    fn pieces(&self, stretch: &Range<usize>) -> Vec<Range<usize>> {
        let count = if self.start == Start::Zero { 1 } else { PIECES };
        let own = stretch.len() / PART / count;
        let from = |i: usize| stretch.start + stretch.len() * i / count;
        let pieces = (0..count).map(|i| from(i)..from(i) + own);
        pieces.filter(|piece| piece.len() > self.history + 2 * self.layout.states).collect()
    }

    /// Triangle of `[initial state | theta, constant | eps]` of one stretch.
    fn stretch(&mut self, s: usize, constant: f64) -> Triangle {
        let n = self.layout.columns.len() + 1;
        if self.by_products && self.rec.weights.is_none() {
            let mut gram = Gram::new(n);
            self.pass(s, constant, |own, rows| {
                gram.add(|j| own.column(j, rows.clone()));
            });
            if let Some(triangle) = gram.triangle() {
                return triangle;
            }
            self.by_products = false;
        }
        let mut block = self.block.take().filter(|block| block.n() == n).unwrap_or_else(|| Block::new(n));
        self.pass(s, constant, |own, rows| own.fill(&mut block, rows));
        let mut triangle = Triangle::new(n);
        triangle.absorb(&mut block);
        self.block = Some(block);
        triangle
    }

    /// Brings a stretch through the model block by block, and hands on which rows of the lines count.
    fn pass(&mut self, s: usize, constant: f64, mut take: impl FnMut(&mut Self, Range<usize>)) {
        self.lines.clear();
        let Range { start, end } = self.stretches[s];
        let first = start + self.history;
        let mut t = start;
        while t < end {
            let len = BLOCK.min(end - t);
            self.at = t;
            vectorised(
                #[inline(always)]
                || self.run(t..t + len, s, constant),
            );
            let from = first.saturating_sub(t).min(len);
            match self.rec.valid {
                None => take(self, from..len),
                Some(valid) => runs(&valid[t..t + len], from).for_each(|rows| take(self, rows)),
            }
            t += len;
            if t < end {
                self.lines.pass(len);
            }
        }
    }

    /// Some of the rows at hand of a column, the last of which is `eps`.
    fn column(&self, j: usize, rows: Range<usize>) -> &[f64] {
        let (line, lag) = self.layout.columns.get(j).copied().unwrap_or((self.layout.eps(), 0));
        &self.lines.late(line, lag, rows.end)[rows.start..]
    }

    /// Moves rows into the block.
    fn fill(&self, block: &mut Block, rows: Range<usize>) {
        let mut from = rows.start;
        while from < rows.end {
            let to = rows.end.min(from + block.free());
            for j in 0..block.n() {
                block.next_rows(j, to - from).copy_from_slice(self.column(j, from..to));
            }
            if let Some(weights) = self.rec.weights {
                block.weigh(&weights[self.at + from..self.at + to]);
            }
            block.grow(to - from);
            from = to;
        }
    }

    /// Brings all signals through the model over some rows of stretch `s`.
    #[inline(always)]
    fn run(&mut self, rows: Range<usize>, s: usize, constant: f64) {
        let Predictor { lines, layout, model, y, scale_y, .. } = self;
        let len = rows.len();
        if let Some(one) = layout.one {
            lines.rows(one, len).fill(1.0);
        }
        let v = lines.rows(layout.v, len);
        v.iter_mut().zip(&y[rows.clone()]).for_each(|(v, y)| *v = scale_y.apply(*y) - constant);
        if let Some(line) = layout.minus_y {
            lines.take(line, |y| -scale_y.apply(y), &y[rows.clone()], len);
            for (k, a) in model.A.iter().enumerate().skip(1) {
                lines.add(-a, (line, k), layout.v, len);
            }
        }
        let start = self.stretches[s].start;
        let begin = Begin { first: start + self.history, rows: rows.clone() };
        let mut from = 0;
        for i in 0..self.u.len() {
            self.input(i, &rows, start);
            from = self.path(i, len, &begin, (s, from));
        }
        self.noise(len, &begin, (s, from));
    }

    /// `u_i(t - nk_i)`
    #[inline(always)]
    fn input(&mut self, i: usize, rows: &Range<usize>, start: usize) {
        let u = delayed(&self.u[i], self.model.nk[i], rows, start);
        let scale = self.scale_u[i];
        self.lines.take(self.layout.paths[i].u, |u| scale.apply(u), u, rows.len());
    }

    /// Takes `w_i` from `v`; its state begins at `from`, the next one where it says.
    #[inline(always)]
    fn path(&mut self, i: usize, len: usize, begin: &Begin, (s, from): (usize, usize)) -> usize {
        let Predictor { lines, layout, model, x0, .. } = self;
        let path = &layout.paths[i];
        let Some(divided) = &path.divided else {
            for (k, b) in model.B[i].iter().enumerate() {
                lines.add(-b, (path.u, k), layout.v, len);
            }
            return from;
        };
        let (w, mut end) = (divided.group.first(), from);
        lines.product(&model.B[i], path.u, w, len);
        lines.product(&[1.0], path.u, divided.u, len);
        if let Some(impulse) = divided.impulse {
            end += model.F[i].len() - 1;
            lines.impulse(impulse, begin.at(), len);
            begin.add(&x0[s][from..end], 1.0, lines.rows(w, len));
        }
        lines.divide(&model.F[i], divided.group, -1.0, len);
        lines.add(-1.0, (w, 0), layout.v, len);
        end
    }

    /// `eps = D/C v`, and everything else that passes the noise model.
    #[inline(always)]
    fn noise(&mut self, len: usize, begin: &Begin, (s, from): (usize, usize)) {
        let Predictor { lines, layout, model, x0, .. } = self;
        let Some(noise) = &layout.noise else { return };
        let eps = noise.group.first();
        lines.product(&model.D, layout.v, eps, len);
        for &(from, to) in &noise.passing {
            lines.product(&model.D, from, to, len);
        }
        if let Some(minus_v) = noise.minus_v {
            lines.product(&[-1.0], layout.v, minus_v, len);
        }
        if let Some(impulse) = noise.impulse {
            lines.impulse(impulse, begin.at(), len);
            begin.add(&x0[s][from..], -1.0, lines.rows(eps, len));
        }
        lines.divide(&model.C, noise.group, 1.0, len);
    }
}

/// The first residual row of a stretch, where its initial state enters, beside the rows at hand.
struct Begin {
    first: usize,
    rows: Range<usize>,
}

impl Begin {
    /// Its place in them.
    fn at(&self) -> Option<usize> {
        self.rows.contains(&self.first).then(|| self.first - self.rows.start)
    }

    /// Adds `sign x0` from there on.
    fn add(&self, x0: &[f64], sign: f64, line: &mut [f64]) {
        for (k, x) in (self.first..).zip(x0).filter(|(k, _)| self.rows.contains(k)) {
            line[k - self.rows.start] += sign * x;
        }
    }
}

impl Residuals for Predictor<'_, '_> {
    fn linearise(&mut self, theta: &[f64]) -> Option<Triangle> {
        let n = self.orders.n();
        self.model.set_theta(&theta[..n]);
        let constant = theta.get(n).copied().unwrap_or(0.0);
        if let Some(best) = self.best.as_ref().filter(|_| self.layout.states > 0) {
            self.x0 = best.x0(theta);
        }
        let mut heads = Segmented::new(self.layout.states, self.layout.columns.len() - self.layout.states);
        for s in 0..self.stretches.len() {
            heads.push(self.stretch(s, constant));
        }
        let common = heads.common().clone();
        let cost: f64 = (0..common.n()).map(|i| common.at(i, common.n() - 1).powi(2)).sum();
        if !cost.is_finite() {
            return None;
        }
        if self.best.as_ref().is_none_or(|best| cost <= best.cost * (1.0 + TIE)) {
            self.best = Some(Best { theta: theta.to_vec(), cost, x0: self.x0.clone(), heads });
        }
        Some(common)
    }

    /// `C` and every `F` with their roots inside the unit circle: then the predictor is stable (Ljung 1999, lemma
    /// 4.2). `A` and `D` may have theirs anywhere: plants and disturbances that drift or grow.
    fn project(&self, theta: &mut [f64]) {
        let Orders { na, nb, nc, nd, nf, .. } = self.orders;
        let mut from = na + nb.iter().sum::<usize>();
        for (n, skip) in std::iter::once((*nc, *nd)).chain(nf.iter().map(|&nf| (nf, 0))) {
            let own = &mut theta[from..from + n];
            let p = [&[1.0], &*own].concat();
            if !is_stable(&p) {
                own.copy_from_slice(&reflected(&p)[1..]);
            }
            from += n + skip;
        }
    }

    fn exact(&self) -> f64 {
        EXACT * self.N() as f64
    }

    fn most_steps(&self) -> usize {
        self.most_steps
    }

    fn has_states(&self) -> bool {
        self.layout.states > 0
    }
}

/// Rows that a model needs whole: the segments where only the simulated output is remembered, for it passes
/// over holes; else their runs of valid outputs.
fn stretches(rec: &Record, orders: &Orders) -> Vec<Range<usize>> {
    let remembers_y = orders.na + orders.nc + orders.nd > 0;
    if remembers_y { rec.runs(0, 0, 0) } else { rec.segments().collect() }
}

/// Runs of true values, the first `from` left out.
fn runs(valid: &[bool], from: usize) -> impl Iterator<Item = Range<usize>> {
    let mut end = from;
    valid[from..].chunk_by(|a, b| a == b).filter_map(move |run| {
        let rows = end..end + run.len();
        end = rows.end;
        run[0].then_some(rows)
    })
}

/// `x(t - lag)` on those of the rows where it is not before the stretch.
#[inline(always)]
fn delayed<'x>(x: &'x [f64], lag: usize, rows: &Range<usize>, start: usize) -> &'x [f64] {
    let first = rows.start.max(start + lag).min(rows.end);
    &x[first.saturating_sub(lag)..rows.end.saturating_sub(lag)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    /// `-2 psi' eps` against central differences of the cost, for every polynomial, two inputs with delays,
    /// stretches of any length, and holes where the structure passes over them.
    #[test]
    fn the_gradient_is_the_slope_of_the_cost() {
        let (u, y) = (white(2 * 700, 1), white(700, 2));
        let mut valid = vec![true; 700];
        valid[150] = false;
        valid[420] = false;
        let all = Orders { na: 1, nb: vec![2, 1], nc: 2, nd: 1, nf: vec![1, 2], nk: vec![3, 0] };
        let theta_of_all = [-0.6, 0.5, 0.2, -0.3, 0.5, 0.2, -0.4, -0.5, -1.1, 0.4, 0.3];
        let oe = Orders { na: 0, nc: 0, nd: 0, ..all.clone() };
        let armax = Orders { nd: 0, nf: vec![0, 0], ..all.clone() };
        for (orders, theta) in [
            (all, theta_of_all.to_vec()),
            (oe, [&theta_of_all[1..4], &theta_of_all[7..]].concat()),
            (armax, [&theta_of_all[..6], &[0.3]].concat()),
        ] {
            for start in [Start::Estimate, Start::Zero] {
                let mut rec = Record::uniform(&u, 2, &y, 1, 1.0).expect("fine");
                rec.starts = vec![0, 290, 296, 600];
                rec.valid = Some(&valid);
                let mut predictor = Predictor::new(&rec, &orders, true, start);
                let mut cost = |theta: &[f64]| {
                    predictor.restart();
                    predictor.linearise(theta).expect("finite"); // the second time with the states at their best
                    let triangle = predictor.linearise(theta).expect("finite");
                    let n = triangle.n() - 1;
                    let cost = (0..=n).map(|i| triangle.at(i, n).powi(2)).sum::<f64>();
                    let product =
                        |j: usize| (0..=j).map(|i| triangle.at(i, j) * triangle.at(i, n)).sum::<f64>();
                    (cost, (0..n).map(product).collect::<Vec<f64>>())
                };
                let (_, product) = cost(&theta);
                for (j, product) in product.iter().enumerate() {
                    let moved = |h: f64| {
                        let mut theta = theta.clone();
                        theta[j] += h;
                        theta
                    };
                    let slope = (cost(&moved(1e-6)).0 - cost(&moved(-1e-6)).0) / 2e-6;
                    let gap = (slope + 2.0 * product).abs();
                    assert!(gap < 1e-5 * (1.0 + slope.abs()), "{orders:?} {start:?} {j}: {slope} {product}");
                }
            }
        }
    }
}
