//! Orders of `A(q) y(t) = B(q)/F(q) u(t - nk) + d + C(q)/D(q) e(t)` with one input.

use crate::model::PolyModel;

/// Numbers of free coefficients in the order of `theta`, the delay, and whether there is a constant behind them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Structure {
    /// Of `A`.
    pub na: usize,
    /// Of `B`.
    pub nb: usize,
    /// Of `C`.
    pub nc: usize,
    /// Of `D`.
    pub nd: usize,
    /// Of `F`.
    pub nf: usize,
    /// Delay in samples.
    pub nk: usize,
    /// Whether a constant is estimated.
    pub offset: bool,
}

impl Structure {
    /// Coefficients, and the constant.
    pub fn n(&self) -> usize {
        self.coefficients() + usize::from(self.offset)
    }

    /// Coefficients `a b c d f`.
    pub fn coefficients(&self) -> usize {
        self.na + self.nb + self.nc + self.nd + self.nf
    }

    /// Rows until every lag lies in the segment.
    pub fn history(&self) -> usize {
        self.na.max(self.nf).max(self.nk + self.nb - 1)
    }

    /// `a1 … b1 … c1 … d1 … f1 …`.
    pub fn names(&self) -> Vec<String> {
        let each = |(letter, n): (char, usize)| (1..=n).map(move |k| format!("{letter}{k}"));
        let orders = [('a', self.na), ('b', self.nb), ('c', self.nc), ('d', self.nd), ('f', self.nf)];
        orders.into_iter().flat_map(each).collect()
    }

    /// The model of these coefficients.
    pub fn model(&self, theta: &[f64], Ts: f64) -> PolyModel {
        let ones = |n: usize| [vec![1.0], vec![0.0; n]].concat();
        let mut model = PolyModel {
            A: ones(self.na),
            B: vec![vec![0.0; self.nb]],
            C: ones(self.nc),
            D: ones(self.nd),
            F: vec![ones(self.nf)],
            nk: vec![self.nk],
            Ts,
        };
        model.set_theta(&theta[..self.coefficients()]);
        model
    }
}
