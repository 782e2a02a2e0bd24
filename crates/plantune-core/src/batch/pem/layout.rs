//! Which line holds which signal of the predictor, and which line, how late, each column of its gradient is.

use std::ops::Range;

use super::super::orders::Orders;
use super::lines::Group;
use crate::sim::Start;

/// Places of all signals. A noise model stands between a signal and its column.
pub(super) struct Layout {
    /// Number of lines.
    pub(super) count: usize,
    /// `-y`, where it has lags.
    pub(super) minus_y: Option<usize>,
    /// `1`, where a constant is estimated.
    pub(super) one: Option<usize>,
    pub(super) v: usize,
    pub(super) paths: Vec<Path>,
    pub(super) noise: Option<Noise>,
    /// Line and lag: `[initial state | a b c d f | constant]`.
    pub(super) columns: Vec<(usize, usize)>,
    /// Columns of the initial state.
    pub(super) states: usize,
}

/// One input on its way to the output.
pub(super) struct Path {
    /// `u(t-nk)`
    pub(super) u: usize,
    /// What is divided by `F`, where there is one.
    pub(super) divided: Option<Divided>,
}

/// Signals that pass `1/F`.
pub(super) struct Divided {
    /// `-w/F`; then what is divided by `F`: `w`, `u(t-nk)` and the impulse.
    pub(super) group: Group,
    /// `u(t-nk)/F`
    pub(super) u: usize,
    /// Where the state is estimated.
    pub(super) impulse: Option<usize>,
}

/// The noise model's share.
pub(super) struct Noise {
    /// `eps/C`; then what is divided by `C`: `eps`, the impulse, what passes through `D/C`, and `-v`.
    pub(super) group: Group,
    /// Where the state is estimated.
    pub(super) impulse: Option<usize>,
    /// What passes through `D/C`: from, to.
    pub(super) passing: Vec<(usize, usize)>,
    /// Where there is a `D`.
    pub(super) minus_v: Option<usize>,
}

/// Hands out lines one after the other.
struct Next(usize);

impl Next {
    fn line(&mut self) -> usize {
        self.0 += 1;
        self.0 - 1
    }

    fn line_if(&mut self, wanted: bool) -> Option<usize> {
        wanted.then(|| self.line())
    }
}

impl Layout {
    pub(super) fn new(orders: &Orders, constant: bool, start: Start) -> Self {
        let free = start == Start::Estimate;
        let mut next = Next(0);
        let mut layout = Layout {
            minus_y: next.line_if(orders.na > 0),
            one: next.line_if(constant),
            v: next.line(),
            paths: orders.nf.iter().map(|&nf| Path::new(&mut next, nf, free)).collect(),
            noise: None,
            columns: Vec::new(),
            states: 0,
            count: 0,
        };
        if orders.nc + orders.nd > 0 {
            layout.noise = Some(Noise::new(&mut next, layout.plain(), orders.nd > 0, free));
        }
        layout.count = next.0;
        layout.states = if free { orders.nf.iter().sum::<usize>() + orders.nc.max(orders.nd) } else { 0 };
        layout.columns = layout.columns(orders);
        layout
    }

    /// `eps`.
    pub(super) fn eps(&self) -> usize {
        self.noise.as_ref().map_or(self.v, |noise| noise.group.first())
    }

    /// Line and lag of `lag` rows more than the model has of every input and of the error.
    pub(super) fn further(&self, orders: &Orders, lag: usize) -> Vec<(usize, usize)> {
        let inputs = self.paths.iter().zip(&orders.nb);
        let inputs = inputs.map(|(path, nb)| (self.behind_noise(path.behind_f()), nb - 1 + lag));
        let errors = self.noise.as_ref().map(|noise| (noise.group.twice(), orders.nc + lag));
        inputs.chain(errors).collect()
    }

    /// Lines of columns before the noise model.
    fn plain(&self) -> Vec<usize> {
        let mut lines: Vec<usize> = self.minus_y.into_iter().chain(self.one).collect();
        for path in &self.paths {
            lines.push(path.behind_f());
            lines.extend(path.divided.iter().flat_map(|d| d.impulse.into_iter().chain([d.group.twice()])));
        }
        lines
    }

    /// Where a signal stands when it has passed the noise model.
    fn behind_noise(&self, line: usize) -> usize {
        let passing = self.noise.iter().flat_map(|noise| &noise.passing);
        passing.into_iter().find(|(from, _)| *from == line).map_or(line, |(_, to)| *to)
    }

    fn columns(&self, orders: &Orders) -> Vec<(usize, usize)> {
        let Orders { nc, nd, nf, nb, .. } = orders;
        let mut columns = Vec::with_capacity(self.states + orders.n() + 1);
        let mut take = |line: usize, lags: Range<usize>| columns.extend(lags.map(|lag| (line, lag)));
        let divided =
            || self.paths.iter().zip(nf).filter_map(|(path, nf)| Some((path.divided.as_ref()?, *nf)));
        for (divided, nf) in divided() {
            divided.impulse.into_iter().for_each(|line| take(self.behind_noise(line), 0..nf));
        }
        if let Some(line) = self.noise.as_ref().and_then(|noise| noise.impulse) {
            take(line, 0..*nc.max(nd));
        }
        if let Some(line) = self.minus_y {
            take(self.behind_noise(line), 1..orders.na + 1);
        }
        for (path, &nb) in self.paths.iter().zip(nb) {
            take(self.behind_noise(path.behind_f()), 0..nb);
        }
        if let Some(noise) = &self.noise {
            take(noise.group.twice(), 1..nc + 1);
            noise.minus_v.into_iter().for_each(|line| take(line, 1..nd + 1));
        }
        for (divided, nf) in divided() {
            take(self.behind_noise(divided.group.twice()), 1..nf + 1);
        }
        if let Some(line) = self.one {
            take(self.behind_noise(line), 0..1);
        }
        columns
    }
}

impl Path {
    fn new(next: &mut Next, nf: usize, free: bool) -> Self {
        let u = next.line();
        let divided = (nf > 0).then(|| {
            let group = Group::new(next.0, 2 + usize::from(free));
            next.0 = group.end();
            Divided { group, u: group.first() + 1, impulse: free.then_some(group.first() + 2) }
        });
        Path { u, divided }
    }

    /// `u(t-nk)/F`
    fn behind_f(&self) -> usize {
        self.divided.as_ref().map_or(self.u, |divided| divided.u)
    }
}

impl Noise {
    fn new(next: &mut Next, plain: Vec<usize>, has_d: bool, free: bool) -> Self {
        let group = Group::new(next.0, 1 + usize::from(free) + plain.len() + usize::from(has_d));
        next.0 = group.first() + 1;
        let noise = Noise {
            group,
            impulse: next.line_if(free),
            passing: plain.into_iter().map(|from| (from, next.line())).collect(),
            minus_v: next.line_if(has_d),
        };
        next.0 = group.end();
        noise
    }
}
