//! Weighted null-space fitting of OE and BJ from a long ARX, `A_n y = sum_i B_n,i u_i + d + e`.
//!
//! Where the long model is exact, `A_n = D/C` and `B_n,i = A_n B_i/F_i`, so that
//!
//! ```text
//! C A_n - D = 0,   F_i B_n,i - B_i A_n = 0                 linear in b, c, d, f
//! ```
//!
//! An error `[da, db_i]` of the long model leaves `[C da, F_i db_i - B_i da]` of them. With `R` the triangle of
//! the long regression, `R [da, db]` is white; so the relations are solved by least squares in
//!
//! ```text
//! da = x_a/C,   db_i = (x_i + B_i da)/F_i,   R [da, db]
//! ```
//!
//! first with `B = 0, C = F = 1`, then again with what came out. OE is `C = D = 1`, whose first relation has no
//! unknowns but takes part in the weighting.
//!
//! Galrinho, Rojas and Hjalmarsson 2019.

use super::super::super::orders::Orders;
use super::super::predictor::Predictor;
use super::{RANK_TOLERANCE, ROWS, reflected_if_needed};
use crate::linalg::{Triangle, solve};
use crate::model::PolyModel;
use crate::poly::{divide, multiply};
use crate::regress::{Column, Regression};

const ROUNDS: usize = 20;

/// `theta` from a long ARX of `n` lags; the constant is left at zero.
pub(super) fn wnsf(predictor: &Predictor, n: usize) -> Option<Vec<f64>> {
    let orders = predictor.orders();
    let data = predictor.data();
    let too_long = data.N() < ROWS * n * (1 + data.nu);
    let too_short = orders.nk.iter().zip(&orders.nb).zip(&orders.nf).any(|((nk, nb), nf)| nk + nb + nf > n);
    if orders.na > 0 || too_long || too_short || orders.nc.max(orders.nd) >= n {
        return None;
    }
    let outputs = (1..=n).map(Column::MinusOutput);
    let inputs = orders.nk.iter().enumerate();
    let inputs = inputs.flat_map(|(i, &nk)| (nk..=n).map(move |lag| Column::Input(i, lag)));
    let ones = predictor.constant().then_some(Column::One);
    let columns: Vec<Column> = ones.into_iter().chain(outputs).chain(inputs).collect();
    let regression = Regression::new(&data, 0, columns);
    let long = Long::new(orders, n, regression.triangle().below(usize::from(predictor.constant())))?;
    let mut model = orders.model(&vec![0.0; orders.n()], 1.0);
    for _ in 0..ROUNDS {
        model.set_theta(&long.solved(&model)?);
        model.C = reflected_if_needed(model.C);
        model.F = model.F.into_iter().map(reflected_if_needed).collect();
    }
    for (b, u) in model.B.iter_mut().zip(&regression.u) {
        b.iter_mut().for_each(|b| *b *= u.factor / regression.y.factor);
    }
    Some(model.theta())
}

/// The long model and the relations to it.
struct Long<'o> {
    orders: &'o Orders,
    n: usize,
    R: Triangle,
    /// `[a_1 … a_n | b_nk … b_n of each input]`: the right-hand side of the relations.
    eta: Vec<f64>,
    /// What each of `b c d f` contributes.
    columns: Vec<Vec<f64>>,
}

impl<'o> Long<'o> {
    fn new(orders: &'o Orders, n: usize, R: Triangle) -> Option<Self> {
        let every: Vec<usize> = (0..R.n() - 1).collect();
        let eta = solve(&R, &every, every.len(), RANK_TOLERANCE).ok()?.theta;
        let mut long = Long { orders, n, R, eta, columns: Vec::new() };
        long.columns = long.relations();
        Some(long)
    }

    /// Where the coefficients of input `i` stand in `eta`.
    fn place(&self, i: usize) -> usize {
        self.n + self.orders.nk[..i].iter().map(|nk| self.n + 1 - nk).sum::<usize>()
    }

    /// ```text
    /// a_k = d_k - sum_j c_j a_(k-j)                              k = 1 … n
    /// b_k = sum_j B_j a_(k-j) - sum_j f_j b_(k-j)                k = nk … n
    /// ```
    fn relations(&self) -> Vec<Vec<f64>> {
        let Orders { nb, nc, nd, nf, nk, .. } = self.orders;
        let a = [&[1.0], &self.eta[..self.n]].concat();
        // `sign x` delayed by `lag` rows of its own, from row `at` on.
        let column = |x: &[f64], at: usize, len: usize, lag: usize, sign: f64| {
            let mut column = vec![0.0; self.eta.len()];
            let own = &mut column[at..at + len];
            own.iter_mut().skip(lag).zip(x).for_each(|(to, x)| *to = sign * x);
            column
        };
        let own = |i: usize| (self.place(i), self.n + 1 - nk[i]);
        let mut columns = Vec::new();
        for (i, &nb) in nb.iter().enumerate() {
            let (at, len) = own(i);
            columns.extend((0..nb).map(|j| column(&a, at, len, j, 1.0)));
        }
        columns.extend((1..=*nc).map(|j| column(&a, 0, self.n, j - 1, -1.0)));
        columns.extend((1..=*nd).map(|j| column(&[1.0], 0, self.n, j - 1, 1.0)));
        for (i, &nf) in nf.iter().enumerate() {
            let (at, len) = own(i);
            columns.extend((1..=nf).map(|j| column(&self.eta[at..at + len], at, len, j, -1.0)));
        }
        columns
    }

    /// The relations by least squares, weighted by those of a model.
    fn solved(&self, model: &PolyModel) -> Option<Vec<f64>> {
        let columns: Vec<Vec<f64>> =
            self.columns.iter().chain([&self.eta]).map(|x| self.white(model, x)).collect();
        let n = self.columns.len();
        let rows: Vec<Vec<f64>> =
            (0..self.eta.len()).map(|k| columns.iter().map(|c| c[k]).collect()).collect();
        let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
        let every: Vec<usize> = (0..n).collect();
        solve(&triangle, &every, n, RANK_TOLERANCE).ok().map(|solution| solution.theta)
    }

    /// `R [da, db]` of what is left of the relations.
    fn white(&self, model: &PolyModel, left: &[f64]) -> Vec<f64> {
        let mut error = left.to_vec();
        let (da, rest) = error.split_at_mut(self.n);
        divide(&model.C, da);
        let before: Vec<f64> = [&[0.0], &*da].concat(); // da_0 = 0: A_n is monic
        let mut rest = rest;
        for (i, &nk) in self.orders.nk.iter().enumerate() {
            let (db, others) = rest.split_at_mut(self.n + 1 - nk);
            let driven = multiply(&model.B[i], &before);
            db.iter_mut().zip(driven).for_each(|(db, x)| *db += x);
            divide(&model.F[i], db);
            rest = others;
        }
        let m = error.len();
        (0..m).map(|i| (i..m).map(|j| self.R.at(i, j) * error[j]).sum()).collect()
    }
}
