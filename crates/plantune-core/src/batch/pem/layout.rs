//! Which line holds which signal of the predictor, and which line, how late, each column of its gradient is.

use std::ops::Range;

use super::super::orders::Orders;
use super::lines::Group;
use crate::sim::Start;

/// Places of all signals. A noise model stands between a signal and its column.
pub(super) struct Layout {
    /// Number of lines.
    pub(super) count: usize,
    /// `-y(t-k)` for each a.
    pub(super) minus_y: Range<usize>,
    pub(super) one: usize,
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
    /// `-w/F`; then what is divided by `F`: `w`, the impulse and the lags of u.
    pub(super) group: Group,
    /// Where the state is estimated.
    pub(super) impulse: Option<usize>,
    /// `u(t-nk-k)` for each b.
    pub(super) u: Range<usize>,
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

impl Layout {
    pub(super) fn new(orders: &Orders, constant: bool, start: Start) -> Self {
        let free = start == Start::Estimate;
        let one = orders.na;
        let mut count = one + 2;
        let mut paths = Vec::with_capacity(orders.nb.len());
        for (&nb, &nf) in orders.nb.iter().zip(&orders.nf) {
            let impulse = (free && nf > 0).then_some(count + 2);
            let u = count + 2 + usize::from(impulse.is_some());
            let path = Path { group: Group::new(count, u + nb - count - 1), impulse, u: u..u + nb };
            count = path.group.end();
            paths.push(path);
        }
        let mut layout = Layout {
            count,
            minus_y: 0..orders.na,
            one,
            v: one + 1,
            paths,
            noise: None,
            columns: Vec::new(),
            states: 0,
        };
        if orders.nc + orders.nd > 0 {
            let noise = Noise::new(count, layout.plain(orders, constant), orders.nd > 0, free);
            layout.count = noise.group.end();
            layout.noise = Some(noise);
        }
        layout.states = if free { orders.nf.iter().sum::<usize>() + orders.nc.max(orders.nd) } else { 0 };
        layout.columns = layout.columns(orders, constant);
        layout
    }

    /// `eps`.
    pub(super) fn eps(&self) -> usize {
        self.noise.as_ref().map_or(self.v, |noise| noise.group.first())
    }

    /// Line and lag of `lag` rows more than the model has of every input and of the error.
    pub(super) fn further(&self, orders: &Orders, lag: usize) -> Vec<(usize, usize)> {
        let inputs = self.paths.iter().map(|path| (self.behind_noise(path.u.end - 1), lag));
        let errors = self.noise.as_ref().map(|noise| (noise.group.twice(), orders.nc + lag));
        inputs.chain(errors).collect()
    }

    /// Lines of columns before the noise model.
    fn plain(&self, orders: &Orders, constant: bool) -> Vec<usize> {
        let mut lines: Vec<usize> = self.minus_y.clone().collect();
        lines.extend(constant.then_some(self.one));
        for (path, &nf) in self.paths.iter().zip(&orders.nf) {
            lines.extend((nf > 0).then_some(path.group.twice()));
            lines.extend(path.impulse.into_iter().chain(path.u.clone()));
        }
        lines
    }

    /// Where a signal stands when it has passed the noise model.
    fn behind_noise(&self, line: usize) -> usize {
        let passing = self.noise.iter().flat_map(|noise| &noise.passing);
        passing.into_iter().find(|(from, _)| *from == line).map_or(line, |(_, to)| *to)
    }

    fn columns(&self, orders: &Orders, constant: bool) -> Vec<(usize, usize)> {
        let Orders { nc, nd, nf, .. } = orders;
        let own = |line: usize| self.behind_noise(line);
        let mut columns = Vec::with_capacity(self.states + orders.n() + 1);
        for (path, &nf) in self.paths.iter().zip(nf) {
            columns.extend(path.impulse.iter().flat_map(|&line| (0..nf).map(move |lag| (own(line), lag))));
        }
        if let Some(line) = self.noise.as_ref().and_then(|noise| noise.impulse) {
            columns.extend((0..*nc.max(nd)).map(|lag| (line, lag)));
        }
        columns.extend(self.minus_y.clone().map(|line| (own(line), 0)));
        for path in &self.paths {
            columns.extend(path.u.clone().map(|line| (own(line), 0)));
        }
        if let Some(noise) = &self.noise {
            columns.extend((1..=*nc).map(|lag| (noise.group.twice(), lag)));
            columns.extend(noise.minus_v.iter().flat_map(|&line| (1..=*nd).map(move |lag| (line, lag))));
        }
        for (path, &nf) in self.paths.iter().zip(nf) {
            columns.extend((1..=nf).map(|lag| (own(path.group.twice()), lag)));
        }
        columns.extend(constant.then_some((own(self.one), 0)));
        columns
    }
}

impl Noise {
    fn new(start: usize, plain: Vec<usize>, has_d: bool, free: bool) -> Self {
        let first = start + 2 + usize::from(free);
        let passing: Vec<(usize, usize)> = plain.into_iter().zip(first..).collect();
        let end = first + passing.len();
        Noise {
            group: Group::new(start, end + usize::from(has_d) - start - 1),
            impulse: free.then_some(start + 2),
            passing,
            minus_v: has_d.then_some(end),
        }
    }
}
