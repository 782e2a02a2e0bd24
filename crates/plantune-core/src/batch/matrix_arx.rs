//! ARX of several outputs, `A(q) y(t) = B(q) u(t - nk) + d + e(t)` with matrix polynomials, by least squares.
//!
//! Output `i` is a regression of its own on what all outputs and inputs did before:
//!
//! ```text
//! phi = [-y_j(t-1) … -y_j(t-na) | u_j(t-nk_j) … u_j(t-nk_j-nb+1) | 1]     every output j, every input j
//! y_i(t) = phi' theta_i + e_i(t)
//! Cov(theta_i, theta_j) = sigma_ij G_i^-1 G_ij G_j^-1                     G = sum phi phi'
//! ```
//!
//! where `G_i` sums over the rows at which output `i` counts and `G_ij`, `sigma_ij` over those that `i` and `j`
//! share. Where all rows count one regressor serves all outputs, and this is `Sigma kron (Phi' Phi)^-1`; least
//! squares is then the maximum likelihood estimate for any `Sigma` (Zellner 1962).
//!
//! Source 000, (2.1-7) to (2.1-9).

use std::borrow::Cow;
use std::ops::Range;

use super::arx::not_exciting;
use super::fit::standard_deviations;
use super::least_squares::{digits, rounding};
use super::orders::{Orders, too_short};
use super::poly_fit;
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{Block, Solution, Triangle, congruence, left_divide, solve};
use crate::model::MatrixPoly;
use crate::note::Note;
use crate::record::{Record, Scale};

/// A fitted model of several outputs with its uncertainty.
#[derive(Clone, Debug)]
pub struct MatrixFit {
    /// The model.
    pub model: MatrixPoly,
    /// Parameters of output 1, then of output 2, …; a, then b.
    pub theta: Vec<f64>, // (n)
    /// Covariance of theta, then of the offsets if they were estimated; row-major.
    pub P: Vec<f64>, // (m, m)
    /// One name per parameter: `a1[y1,y2]`.
    pub names: Vec<String>,
    /// `O` in `y = G u + O`.
    pub offset: Vec<f64>, // (ny)
    /// Number of segments; a regression has no initial state.
    pub segments: usize,
    /// Rows at which some output was used.
    pub N: usize,
    /// Mean squared one-step error over all outputs.
    pub loss: f64,
    /// Determinant of the residual covariance.
    pub V: f64,
    /// Decimal digits of each parameter that rounding leaves.
    pub expected_digits: Vec<f64>, // (n)
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Fits one `na` and one `nb` to all outputs of a record; `nk` one per input.
pub fn matrix_arx(
    rec: &Record,
    na: usize,
    nb: usize,
    nk: &[usize],
    offset: bool,
    limits: &Limits,
) -> Result<MatrixFit> {
    let orders = Orders::arx(na, vec![nb; nk.len()], nk.to_vec());
    let mut regression = Rows::new(rec, &orders, offset);
    orders.check_inputs(rec, regression.n, limits)?;
    regression.shared = rec.valid.is_none().then(|| regression.triangle(&[]));
    let equations = regression.equations(limits)?;
    regression.fit(&equations, limits)
}

/// The scaled rows `[phi | y_1 … y_ny]`.
struct Rows<'r, 'a> {
    rec: &'r Record<'a>,
    orders: &'r Orders,
    offset: bool,
    /// Parameters of one output, the constant included.
    n: usize,
    u: Vec<Vec<f64>>,
    y: Vec<Vec<f64>>,
    u_scale: Vec<Scale>,
    y_scale: Vec<Scale>,
    /// The triangle of all rows, where all of them count.
    shared: Option<Triangle>,
}

/// One output's solution, in scaled units.
struct Equation {
    solution: Solution,
    error: Vec<f64>,
    N: usize,
}

impl<'r, 'a> Rows<'r, 'a> {
    fn new(rec: &'r Record<'a>, orders: &'r Orders, offset: bool) -> Self {
        let scaled = |column: &[f64], scale: &Scale| column.iter().map(|x| scale.apply(*x)).collect();
        let (inputs, outputs): (Vec<_>, Vec<_>) =
            ((0..rec.nu).map(|i| rec.input(i)).collect(), (0..rec.ny).map(|i| rec.output_held(i)).collect());
        let u_scale: Vec<Scale> = inputs.iter().map(|x| Scale::of(x, offset)).collect();
        let y_scale: Vec<Scale> = outputs.iter().map(|x| Scale::of(x, offset)).collect();
        Rows {
            rec,
            orders,
            offset,
            n: orders.na * rec.ny + orders.nb.iter().sum::<usize>() + usize::from(offset),
            u: inputs.iter().zip(&u_scale).map(|(x, s)| scaled(x, s)).collect(),
            y: outputs.iter().zip(&y_scale).map(|(x, s)| scaled(x, s)).collect(),
            u_scale,
            y_scale,
            shared: None,
        }
    }

    /// Rows at which all of `outputs` count, and every output at the `na` rows before.
    fn rows(&self, outputs: &[usize]) -> impl Iterator<Item = usize> + '_ {
        let outputs = outputs.to_vec();
        let (history, na, rec) = (self.orders.history(), self.orders.na, self.rec);
        let all = |t: usize| (0..rec.ny).all(|i| rec.is_valid(t, i));
        let begin = move |s: Range<usize>| (s.start + history).min(s.end)..s.end;
        self.rec.segments().flat_map(begin).filter(move |&t| {
            rec.valid.is_none() || outputs.iter().all(|&i| rec.is_valid(t, i)) && (t - na..t).all(all)
        })
    }

    /// Triangle of the rows that some outputs share; there is only one where all rows count.
    fn shared_by(&self, outputs: &[usize]) -> Cow<'_, Triangle> {
        self.shared.as_ref().map_or_else(|| Cow::Owned(self.triangle(outputs)), Cow::Borrowed)
    }

    fn triangle(&self, outputs: &[usize]) -> Triangle {
        let width = self.n + self.rec.ny;
        let (mut triangle, mut block) = (Triangle::new(width), Block::new(width));
        let mut row = Vec::with_capacity(width);
        for t in self.rows(outputs) {
            row.clear();
            self.y.iter().for_each(|y| row.extend((1..=self.orders.na).map(|lag| -y[t - lag])));
            for ((u, nk), nb) in self.u.iter().zip(&self.orders.nk).zip(&self.orders.nb) {
                row.extend((0..*nb).map(|j| u[t - nk - j]));
            }
            row.extend(self.offset.then_some(1.0));
            row.extend(self.y.iter().map(|y| y[t]));
            block.push(&row);
        }
        triangle.absorb(&mut block);
        triangle
    }

    /// The solution of every output on its own rows.
    fn equations(&self, limits: &Limits) -> Result<Vec<Equation>> {
        let every: Vec<usize> = (0..self.n).collect();
        let one = |i: usize| {
            let N = self.rows(&[i]).count();
            if N <= self.n {
                return Err(too_short(N, self.n));
            }
            let triangle = self.shared_by(&[i]);
            let solution = solve(&triangle, &every, self.n + i, limits.X08)
                .map_err(|e| not_exciting(self.rec, &e, limits))?;
            let error = rounding(&triangle, &solution, &solution.theta, solution.rss);
            Ok(Equation { solution, error, N })
        };
        (0..self.rec.ny).map(one).collect()
    }

    fn fit(&self, equations: &[Equation], limits: &Limits) -> Result<MatrixFit> {
        let ny = self.rec.ny;
        let (blocks, products) = self.covariance(equations);
        let N = self.used();
        let model = self.model(equations);
        let (offset, P) = self.levels(&model, equations, &blocks);
        let mean =
            |i: usize| equations[i].solution.rss / self.y_scale[i].factor.powi(2) / equations[i].N as f64;
        let per_output = self.n - usize::from(self.offset);
        let theta: Vec<f64> = (0..ny).flat_map(|i| self.theta(equations, i)[..per_output].to_vec()).collect();
        let mut fit = MatrixFit {
            V: determinant(&products, ny),
            loss: (0..ny).map(mean).sum::<f64>() / ny as f64,
            names: self.names(),
            expected_digits: equations
                .iter()
                .flat_map(|e| digits(&e.error[..per_output], &e.solution.theta[..per_output]))
                .collect(),
            segments: self.rec.starts.len(),
            notes: Vec::new(),
            model,
            theta,
            P,
            offset,
            N,
        };
        let exact = equations.iter().any(|e| e.solution.rss <= poly_fit::EXACT * e.N as f64);
        let sd = standard_deviations(&fit.P, fit.theta.len());
        fit.notes = poly_fit::doubts(&fit.theta, &sd, self.n, fit.N, exact, limits);
        fit.finite()
    }

    /// Rows at which some output was used.
    fn used(&self) -> usize {
        let mut used = vec![false; self.rec.N()];
        (0..self.rec.ny).for_each(|i| self.rows(&[i]).for_each(|t| used[t] = true));
        used.iter().filter(|used| **used).count()
    }

    /// Covariance of all parameters and constants in scaled units, `(ny n, ny n)`, and that of the errors in the
    /// record's, `(ny, ny)`, as their mean products.
    fn covariance(&self, equations: &[Equation]) -> (Vec<f64>, Vec<f64>) {
        let (n, ny) = (self.n, self.rec.ny);
        let (mut P, mut products) = (vec![0.0; ny * n * ny * n], vec![0.0; ny * ny]);
        for i in 0..ny {
            for j in i..ny {
                let triangle = self.shared_by(&[i, j]);
                let rows = self.rows(&[i, j]).count();
                let product = inner(&self.left(&triangle, equations, i), &self.left(&triangle, equations, j));
                let mean = product / rows.max(1) as f64;
                let unit = self.y_scale[i].factor * self.y_scale[j].factor;
                products[i * ny + j] = mean / unit;
                products[j * ny + i] = mean / unit;
                let sigma = product / rows.saturating_sub(n).max(1) as f64;
                let block = if i == j || self.shared.is_some() {
                    equations[i].solution.inverse_gram.clone()
                } else {
                    between(&equations[i], &triangle, &equations[j], n)
                };
                for (kl, value) in block.iter().enumerate() {
                    let (k, l) = (i * n + kl / n, j * n + kl % n);
                    P[k * ny * n + l] = sigma * value;
                    P[l * ny * n + k] = sigma * value;
                }
            }
        }
        (P, products)
    }

    /// `R [-theta_i; 1_i]`, whose inner products are those of the errors.
    fn left(&self, triangle: &Triangle, equations: &[Equation], i: usize) -> Vec<f64> {
        let theta = &equations[i].solution.theta;
        let row = |k: usize| triangle.at(k, self.n + i) - inner(&triangle.row(k)[..self.n], theta);
        (0..triangle.n()).map(row).collect()
    }

    /// What one scaled unit of each parameter of output `i` is in the record's units.
    fn units(&self, i: usize) -> Vec<f64> {
        let own = self.y_scale[i].factor;
        let outputs = self.y_scale.iter().flat_map(|y| vec![y.factor / own; self.orders.na]);
        let inputs = self.u_scale.iter().zip(&self.orders.nb);
        let inputs = inputs.flat_map(|(u, nb)| vec![u.factor / own; *nb]);
        outputs.chain(inputs).chain(self.offset.then_some(1.0 / own)).collect()
    }

    /// Parameters of output `i`, then the constant, in the record's units.
    fn theta(&self, equations: &[Equation], i: usize) -> Vec<f64> {
        equations[i].solution.theta.iter().zip(self.units(i)).map(|(t, unit)| t * unit).collect()
    }

    fn model(&self, equations: &[Equation]) -> MatrixPoly {
        let (ny, nu, na) = (self.rec.ny, self.rec.nu, self.orders.na);
        let nb = self.orders.nb[0];
        let mut model = MatrixPoly {
            A: vec![vec![0.0; ny * ny]; na + 1],
            B: vec![vec![0.0; ny * nu]; nb],
            nk: self.orders.nk.clone(),
            ny,
            Ts: self.rec.Ts,
        };
        for i in 0..ny {
            let theta = self.theta(equations, i);
            model.A[0][i * ny + i] = 1.0;
            for (at, value) in theta[..ny * na].iter().enumerate() {
                model.A[1 + at % na][i * ny + at / na] = *value;
            }
            for (at, value) in theta[ny * na..][..nu * nb].iter().enumerate() {
                model.B[at % nb][i * nu + at / nb] = *value;
            }
        }
        model
    }

    /// Offsets `O = y(0) + A(1)^-1 (d - B(1) u(0))`, and the covariance of `theta, O` by the delta rule:
    ///
    /// ```text
    /// dO = A(1)^-1 (dd - dA(1) (O - y(0)) - dB(1) u(0))
    /// ```
    fn levels(&self, model: &MatrixPoly, equations: &[Equation], blocks: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (n, ny, nu, na) = (self.n, self.rec.ny, self.rec.nu, self.orders.na);
        let unit: Vec<f64> = (0..ny).flat_map(|i| self.units(i)).collect();
        let P = |k: usize, l: usize| blocks[k * ny * n + l] * unit[k] * unit[l];
        let per_output = n - usize::from(self.offset);
        let mut map: Vec<Vec<f64>> = Vec::new();
        for k in (0..ny * n).filter(|k| k % n < per_output) {
            map.push(vec![0.0; ny * n]);
            map.last_mut().into_iter().for_each(|row| row[k] = 1.0);
        }
        if !self.offset {
            return (vec![0.0; ny], congruence(&map, P));
        }
        let (u0, y0): (Vec<f64>, Vec<f64>) =
            (self.u_scale.iter().map(|s| s.zero).collect(), self.y_scale.iter().map(|s| s.zero).collect());
        let B1 = model.B1();
        let rest: Vec<f64> =
            (0..ny).map(|i| self.theta(equations, i)[per_output] - inner(&B1[i * nu..][..nu], &u0)).collect();
        let mut identity = vec![0.0; ny * ny];
        (0..ny).for_each(|i| identity[i * ny + i] = 1.0);
        // Of an integrator there is no level: what is left is the drift, as of one output.
        let inverse = left_divide(&model.A1(), &identity, ny).unwrap_or(identity);
        let x: Vec<f64> = (0..ny).map(|i| inner(&inverse[i * ny..][..ny], &rest)).collect();
        for i in 0..ny {
            let mut row = Vec::with_capacity(ny * n);
            for gain in &inverse[i * ny..][..ny] {
                row.extend(x.iter().flat_map(|x| vec![-gain * x; na]));
                row.extend(u0.iter().zip(&self.orders.nb).flat_map(|(u, nb)| vec![-gain * u; *nb]));
                row.push(*gain);
            }
            map.push(row);
        }
        (y0.iter().zip(&x).map(|(y, x)| y + x).collect(), congruence(&map, P))
    }

    /// `a1[y1,y1] … b1[y1,u1] …`, output by output.
    fn names(&self) -> Vec<String> {
        let (nu, ny) = (self.rec.nu, self.rec.ny);
        let all = |letter: char, to: usize, from: Range<usize>, n: usize| {
            let (to, names) = (&self.rec.names[nu + to], &self.rec.names[from]);
            let one = move |from: &String| {
                (1..=n).map(|k| format!("{letter}{k}[{to},{from}]")).collect::<Vec<String>>()
            };
            names.iter().flat_map(one).collect::<Vec<String>>()
        };
        let of = |i: usize| {
            let a = all('a', i, nu..nu + ny, self.orders.na);
            a.into_iter().chain(all('b', i, 0..nu, self.orders.nb[0])).collect::<Vec<String>>()
        };
        (0..ny).flat_map(of).collect()
    }
}

impl MatrixFit {
    /// The fit, if all its numbers are (N02).
    fn finite(self) -> Result<Self> {
        let numbers = self.theta.iter().chain(&self.P).chain(&self.offset).chain([&self.loss, &self.V]);
        if numbers.into_iter().all(|x| x.is_finite()) {
            return Ok(self);
        }
        Err(Error::new("N02", "the numbers of this record overflow or vanish when squared")
            .remedy("change the units so that inputs and outputs are nearer to one"))
    }
}

/// `G_i^-1 G_ij G_j^-1` with `G_ij = R' R` of the rows that both share.
fn between(i: &Equation, triangle: &Triangle, j: &Equation, n: usize) -> Vec<f64> {
    let gram =
        |k: usize, l: usize| (0..=k.min(l)).map(|r| triangle.at(r, k) * triangle.at(r, l)).sum::<f64>();
    let G: Vec<f64> = (0..n * n).map(|kl| gram(kl / n, kl % n)).collect();
    product(&product(&i.solution.inverse_gram, &G, n), &j.solution.inverse_gram, n)
}

/// Product of square matrices.
fn product(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    (0..n * n).map(|ij| (0..n).map(|k| a[ij / n * n + k] * b[k * n + ij % n]).sum()).collect()
}

/// Of a covariance, by Cholesky's rule; zero where it is singular.
fn determinant(S: &[f64], n: usize) -> f64 {
    let mut a = S.to_vec();
    let mut det = 1.0;
    for k in 0..n {
        let pivot = a[k * n + k].max(0.0);
        det *= pivot;
        for i in (k + 1..n).filter(|_| pivot > 0.0) {
            let factor = a[i * n + k] / pivot;
            (k..n).for_each(|j| a[i * n + j] -= factor * a[k * n + j]);
        }
    }
    det
}

fn inner(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}
