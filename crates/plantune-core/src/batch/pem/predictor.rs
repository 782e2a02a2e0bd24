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
//! All recursions begin at rest at the first residual row of a stretch. What is not known of its start enters
//! as impulses there: into every `1/F_i`, and into `1/C`. The error is linear in them, so they are eliminated
//! stretch by stretch ([`Segmented`]). Lags of `w`, `eps` and `v`, which are zero before, are the same numbers
//! later; lags of the data are not, and are filtered each on its own.
//! Rows pass in blocks that stay in the cache; no signal of the record's length is made.
//!
//! Ljung 1999, (7.19) and 10.3; source 001, 3.5.7.

use std::ops::Range;

use super::super::orders::Orders;
use super::line::{Line, divide, lines, set_product};
use crate::linalg::{Block, Minimum, Residuals, Segmented, TIE, Triangle, dot, residual_norm2};
use crate::model::PolyModel;
use crate::poly::{is_stable, reflected};
use crate::record::{Record, Scale};
use crate::sim::Start;
use crate::stats::f_tail;

/// Further lags that must not explain anything at a minimum that is believed.
const FURTHER: usize = 2;

/// Least p-value at which they are taken as explaining nothing.
const BY_CHANCE: f64 = 1e-3;

/// A signal whose lags are columns.
#[derive(Clone, Copy, PartialEq)]
enum Signal {
    /// `-y(t-k)`.
    MinusY(usize),
    One,
    /// `u_i(t-nk_i-k)/F_i`.
    Input(usize, usize),
    /// `-w_i/F_i`.
    MinusW(usize),
    /// `1/F_i`.
    Impulse(usize),
    /// `1/C`.
    NoiseImpulse,
    /// `eps/C`.
    Eps,
    /// `-v/C`.
    MinusV,
}

/// Scaled data, and the signals on their way through a model.
pub(super) struct Predictor<'r, 'a> {
    rec: &'r Record<'a>,
    orders: &'r Orders,
    constant: bool,
    pub(super) scale_u: Vec<Scale>,
    pub(super) scale_y: Scale,
    u: Vec<Vec<f64>>,
    u_rows: Vec<f64>, // (N, nu)
    y: Vec<f64>,
    /// Rows without a break that the model needs whole; residuals begin `history` rows later.
    stretches: Vec<Range<usize>>,
    history: usize,
    /// Columns of the triangle but the last: first those of the initial state, then `theta` and the constant.
    columns: Vec<(Signal, usize)>,
    states: usize,
    /// Initial state of each stretch with which the rows at hand are made.
    x0: Vec<Vec<f64>>,
    /// The best parameters so far.
    best: Option<Best>,
    /// The model that rows pass through.
    model: PolyModel,
    paths: Vec<Path>,
    output: Output,
    noise: Option<Noise>,
    block: Block,
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

/// One input on its way to the output.
struct Path {
    /// `w_i`, the impulse, and `u_i(t-nk_i-k)` for each b, all divided by `F_i`.
    through: Vec<Line>,
    /// `-w_i/F_i`.
    w: Line,
}

/// `-y(t-k)` for each a, the constant, and `v`.
struct Output {
    minus_y: Vec<Line>,
    one: Line,
    v: Line,
}

/// The noise model's share of the work.
struct Noise {
    /// What passes through `D/C`, beside `v`.
    passing: Vec<Signal>,
    /// `[eps, impulse/C, …, -v/C]`.
    first: Vec<Line>,
    /// `eps/C`.
    eps: Line,
}

impl<'r, 'a> Predictor<'r, 'a> {
    pub(super) fn new(rec: &'r Record<'a>, orders: &'r Orders, constant: bool, start: Start) -> Self {
        // At rest before the record means zero in its own units.
        let centred = constant && start == Start::Estimate;
        let scale_u: Vec<Scale> = (0..rec.nu).map(|i| Scale::of(&rec.input(i), centred)).collect();
        let y = rec.output_held(0);
        let scale_y = Scale::of(&y, centred);
        let scaled = |x: &[f64], s: Scale| x.iter().map(|&x| s.apply(x)).collect::<Vec<f64>>();
        let history = if start == Start::Zero { 0 } else { orders.history() };
        let columns = columns(orders, constant, start);
        let states = columns.len() - orders.n() - usize::from(constant);
        let stretches: Vec<_> =
            stretches(rec, orders).into_iter().filter(|s| s.len() > history + states).collect();
        let most_f = orders.nf.iter().copied().max().unwrap_or(0);
        let past = FURTHER + 1 + [most_f, orders.nc, orders.nd].into_iter().max().unwrap_or(0);
        let line = || Line::new(past);
        let path = |i: usize| Path { through: lines(2 + orders.nb[i], past), w: line() };
        let noise = || {
            let mut passing: Vec<Signal> = columns.iter().map(|c| c.0).collect();
            passing.retain(|s| !matches!(s, Signal::NoiseImpulse | Signal::Eps | Signal::MinusV));
            passing.dedup();
            Noise { first: lines(2 + passing.len() + usize::from(orders.nd > 0), past), eps: line(), passing }
        };
        let rows = rec.u.chunks_exact(rec.nu);
        Predictor {
            u_rows: rows.flat_map(|row| row.iter().zip(&scale_u).map(|(&u, s)| s.apply(u))).collect(),
            u: (0..rec.nu).map(|i| scaled(&rec.input(i), scale_u[i])).collect(),
            y: scaled(&y, scale_y),
            scale_u,
            scale_y,
            x0: vec![vec![0.0; states]; stretches.len()],
            best: None,
            model: orders.model(&vec![0.0; orders.n()], rec.Ts),
            block: Block::new(columns.len() + 1),
            paths: (0..rec.nu).map(path).collect(),
            output: Output { minus_y: vec![line(); orders.na], one: line(), v: line() },
            noise: (orders.nc + orders.nd > 0).then(noise),
            rec,
            orders,
            constant,
            stretches,
            history,
            columns,
            states,
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
        self.states * self.stretches.len()
    }

    /// Initial state of each stretch, in the record's units: impulses into each `1/F_i`, then into `1/C`.
    pub(super) fn x0(&self) -> Vec<Vec<f64>> {
        let x0 = self.best.as_ref().map_or(self.x0.clone(), |best| best.x0(&best.theta));
        x0.into_iter().map(|x| x.into_iter().map(|x| x / self.scale_y.factor).collect()).collect()
    }

    pub(super) fn orders(&self) -> &'r Orders {
        self.orders
    }

    pub(super) fn constant(&self) -> bool {
        self.constant
    }

    /// The scaled data as a record of its own.
    pub(super) fn data(&self) -> Record<'_> {
        Record { u: &self.u_rows, y: &self.y, ny: 1, ..self.rec.clone() }
    }

    /// Whether two further lags of every input and of the error lower the cost no more than by chance.
    pub(super) fn explains_all(&mut self, minimum: &Minimum) -> bool {
        if minimum.cost <= self.exact() {
            return true;
        }
        let own = self.columns.clone();
        let mut further = Vec::new();
        for (i, &nb) in self.orders.nb.iter().enumerate() {
            further.extend((1..=FURTHER).map(|lag| (Signal::Input(i, nb - 1), lag)));
        }
        if self.noise.is_some() {
            further.extend((1..=FURTHER).map(|k| (Signal::Eps, self.orders.nc + k)));
        }
        self.columns.extend(&further);
        let block = std::mem::replace(&mut self.block, Block::new(self.columns.len() + 1));
        let triangle = self.linearise(&minimum.theta);
        (self.columns, self.block) = (own, block);
        let Some(triangle) = triangle else { return false };
        let every: Vec<usize> = (0..triangle.n() - 1).collect();
        let left = residual_norm2(&triangle, &every, triangle.n() - 1, 1e-12);
        let (more, freedom) = (further.len() as f64, (self.N() - every.len()) as f64);
        let F = (minimum.cost - left) / more / (left / freedom).max(f64::MIN_POSITIVE);
        f_tail(F, more, freedom) > BY_CHANCE
    }

    /// Starts another descent.
    pub(super) fn restart(&mut self) {
        self.best = None;
        self.x0.iter_mut().for_each(|x| x.fill(0.0));
    }

    /// Triangle of `[initial state | theta, constant | eps]` of one stretch.
    fn stretch(&mut self, s: usize, constant: f64) -> Triangle {
        let mut triangle = Triangle::new(self.columns.len() + 1);
        self.clear();
        let Range { start, end } = self.stretches[s];
        let first = start + self.history;
        let mut t = first;
        while t < end {
            let len = self.block.free().min(end - t);
            self.run(t..t + len, start, constant, (t == first).then_some(s));
            self.fill(t, len);
            self.pass(len);
            t += len;
        }
        triangle.absorb(&mut self.block);
        triangle
    }

    /// Brings all signals through the model over some rows; the first ones of a stretch get its `state`.
    fn run(&mut self, rows: Range<usize>, start: usize, constant: f64, state: Option<usize>) {
        let model = &self.model;
        let (t, len) = (rows.start, rows.len());
        let x0: &[f64] = state.map_or(&[], |s| &self.x0[s]);
        let begins = !x0.is_empty();
        let Output { minus_y, one, v } = &mut self.output;
        if self.constant {
            one.rows(len).fill(1.0);
        }
        let v = v.rows(len);
        v.iter_mut().zip(&self.y[rows]).for_each(|(v, y)| *v = y - constant);
        for (k, minus_y) in minus_y.iter_mut().enumerate() {
            let lag = minus_y.rows(len);
            delayed(&self.y, k + 1, t, start, lag);
            for (v, y) in v.iter_mut().zip(lag) {
                *y = -*y;
                *v -= model.A[k + 1] * *y;
            }
        }
        let mut next = 0;
        for (i, path) in self.paths.iter_mut().enumerate() {
            let [w, impulse, u @ ..] = path.through.as_mut_slice() else { return };
            let w = w.rows(len);
            for (k, (u, b)) in u.iter_mut().zip(&model.B[i]).enumerate() {
                delayed(&self.u[i], model.nk[i] + k, t, start, u.rows(len));
                let terms = w.iter_mut().zip(u.late(0, len));
                terms.for_each(|(w, u)| *w = if k == 0 { b * u } else { *w + b * u });
            }
            let nf = self.orders.nf[i];
            if self.states > 0 {
                impulse.rows(len).fill(0.0);
            }
            if begins {
                w.iter_mut().zip(&x0[next..next + nf]).for_each(|(w, x)| *w += x);
                impulse.rows(len)[0] = 1.0;
            }
            next += nf;
            if nf > 0 {
                divide(&model.F[i], &mut path.through, &mut path.w, -1.0, len);
            }
            v.iter_mut().zip(path.through[0].late(0, len)).for_each(|(v, w)| *v -= w);
        }
        if let Some(noise) = &mut self.noise {
            noise.run(&self.output, &self.paths, model, len, &x0[next.min(x0.len())..], begins);
        }
    }

    /// Moves the rows `t..t+len` that count into the block.
    fn fill(&mut self, t: usize, len: usize) {
        let mut from = 0;
        while from < len {
            let counts = |k: usize| self.rec.is_valid(t + k, 0);
            let run =
                if self.rec.valid.is_none() { len } else { (from..len).take_while(|&k| counts(k)).count() };
            for (j, &(signal, lag)) in self.columns.iter().enumerate() {
                let line = match &self.noise {
                    Some(noise) => noise.signal(signal),
                    None => plain(&self.output, &self.paths, signal),
                };
                let rows = line.late(lag, from + run);
                self.block.next_rows(j, run).copy_from_slice(&rows[from..]);
            }
            let eps = self.noise.as_ref().map_or(&self.output.v, |noise| &noise.first[0]);
            self.block.next_rows(self.columns.len(), run).copy_from_slice(&eps.late(0, from + run)[from..]);
            if run > 0 {
                self.block.grow(run);
            }
            from += run.max(1);
        }
    }

    fn lines(&mut self) -> impl Iterator<Item = &mut Line> {
        let paths = self.paths.iter_mut().flat_map(|p| p.through.iter_mut().chain([&mut p.w]));
        let Output { minus_y, one, v } = &mut self.output;
        let noise = self.noise.iter_mut().flat_map(|n| n.first.iter_mut().chain([&mut n.eps]));
        paths.chain(minus_y).chain([one, v]).chain(noise)
    }

    fn clear(&mut self) {
        self.lines().for_each(Line::clear);
    }

    fn pass(&mut self, len: usize) {
        self.lines().for_each(|line| line.pass(len));
    }
}

impl Noise {
    fn run(
        &mut self,
        output: &Output,
        paths: &[Path],
        model: &PolyModel,
        len: usize,
        x0: &[f64],
        begins: bool,
    ) {
        let [eps, impulse, passing @ ..] = self.first.as_mut_slice() else { return };
        set_product(&model.D, &output.v, eps.rows(len));
        impulse.rows(len).fill(0.0);
        if begins {
            eps.rows(len).iter_mut().zip(x0).for_each(|(eps, x)| *eps -= x);
            impulse.rows(len)[0] = 1.0;
        }
        for (line, &signal) in passing.iter_mut().zip(&self.passing) {
            set_product(&model.D, plain(output, paths, signal), line.rows(len));
        }
        if let Some(minus_v) = passing.get_mut(self.passing.len()) {
            minus_v.rows(len).iter_mut().zip(output.v.late(0, len)).for_each(|(to, v)| *to = -v);
        }
        divide(&model.C, &mut self.first, &mut self.eps, 1.0, len);
    }

    fn signal(&self, signal: Signal) -> &Line {
        match signal {
            Signal::NoiseImpulse => &self.first[1],
            Signal::Eps => &self.eps,
            Signal::MinusV => &self.first[2 + self.passing.len()],
            other => &self.first[2 + self.passing.iter().position(|s| *s == other).unwrap_or(0)],
        }
    }
}

/// A signal before the noise model.
fn plain<'s>(output: &'s Output, paths: &'s [Path], signal: Signal) -> &'s Line {
    match signal {
        Signal::MinusY(k) => &output.minus_y[k - 1],
        Signal::Input(i, k) => &paths[i].through[2 + k],
        Signal::Impulse(i) => &paths[i].through[1],
        Signal::MinusW(i) => &paths[i].w,
        Signal::One => &output.one,
        Signal::NoiseImpulse | Signal::Eps | Signal::MinusV => &output.v, // only behind a noise model
    }
}

impl Residuals for Predictor<'_, '_> {
    fn linearise(&mut self, theta: &[f64]) -> Option<Triangle> {
        let n = self.orders.n();
        self.model.set_theta(&theta[..n]);
        let constant = theta.get(n).copied().unwrap_or(0.0);
        if let Some(best) = &self.best {
            self.x0 = best.x0(theta);
        }
        let mut heads = Segmented::new(self.states, self.columns.len() - self.states);
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

    /// `C` and every `F` with their roots inside the unit circle.
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
        1e-26 * dot(&self.y, &self.y)
    }
}

/// `[initial state | a b c d f | constant]`.
fn columns(orders: &Orders, constant: bool, start: Start) -> Vec<(Signal, usize)> {
    let mut columns = Vec::new();
    if start == Start::Estimate {
        for (i, &nf) in orders.nf.iter().enumerate() {
            columns.extend((0..nf).map(|lag| (Signal::Impulse(i), lag)));
        }
        columns.extend((0..orders.nc.max(orders.nd)).map(|lag| (Signal::NoiseImpulse, lag)));
    }
    columns.extend((1..=orders.na).map(|k| (Signal::MinusY(k), 0)));
    for (i, &nb) in orders.nb.iter().enumerate() {
        columns.extend((0..nb).map(|k| (Signal::Input(i, k), 0)));
    }
    columns.extend((1..=orders.nc).map(|lag| (Signal::Eps, lag)));
    columns.extend((1..=orders.nd).map(|lag| (Signal::MinusV, lag)));
    for (i, &nf) in orders.nf.iter().enumerate() {
        columns.extend((1..=nf).map(|lag| (Signal::MinusW(i), lag)));
    }
    columns.extend(constant.then_some((Signal::One, 0)));
    columns
}

/// Rows that a model needs whole: the segments where only the simulated output is remembered, for it passes
/// over holes; else their runs of valid outputs.
fn stretches(rec: &Record, orders: &Orders) -> Vec<Range<usize>> {
    let remembers_y = orders.na + orders.nc + orders.nd > 0;
    if remembers_y { rec.runs(0, 0, 0) } else { rec.segments().collect() }
}

/// `u(t - nk)` on rows `t..`, zero before the stretch.
fn delayed(u: &[f64], nk: usize, t: usize, start: usize, out: &mut [f64]) {
    let missing = (start + nk).saturating_sub(t).min(out.len());
    out[..missing].fill(0.0);
    let len = out.len() - missing;
    out[missing..].copy_from_slice(&u[t + missing - nk..][..len]);
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
