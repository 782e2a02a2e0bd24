//! `x(t+1) = A x(t) + B u(t) + K e(t)`, `y(t) = C x(t) + D u(t) + e(t)`; or `x' = A x + B u` in continuous time.
//!
//! ```text
//! G(z) = C (z I - A)^-1 B + D,   H(z) = C (z I - A)^-1 K + I
//! zeros: z = z0 + 1/w,  w an eigenvalue of  -M + M^2 B G(z0)^-1 C,  M = (z0 I - A)^-1
//! ```
//!
//! The zeros hold for as many outputs as inputs and any real `z0` at which `G` is regular; `w = 0` is a zero at
//! infinity. Van Overschee and De Moor 1996, 1.4; Emami-Naeini and Van Dooren 1982 for the map.

use super::PolyModel;
use super::realisation::monic;
use crate::error::{Error, Result};
use crate::linalg::{Complex, Matrix, eigenvalues, exponential, left_divide, logarithm};
use crate::poly::product;

/// A linear model by its states.
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace {
    /// `(n, n)`.
    pub A: Matrix,
    /// `(n, nu)`.
    pub B: Matrix,
    /// `(ny, n)`.
    pub C: Matrix,
    /// `(ny, nu)`.
    pub D: Matrix,
    /// Gain of the innovations, `(n, ny)`; zero where the noise is white on the output.
    pub K: Matrix,
    /// Sample time, s; none in continuous time.
    pub Ts: Option<f64>,
}

impl StateSpace {
    /// Number of states.
    pub fn n(&self) -> usize {
        self.A.nrows()
    }

    /// Number of inputs.
    pub fn nu(&self) -> usize {
        self.D.ncols()
    }

    /// Number of outputs.
    pub fn ny(&self) -> usize {
        self.D.nrows()
    }

    /// Free parameters of a model of this size, whatever the basis of the states.
    pub fn parameters(&self, direct: bool) -> usize {
        self.n() * (self.nu() + self.ny()) + if direct { self.ny() * self.nu() } else { 0 }
    }

    /// The model with another gain of the innovations.
    pub fn with_gain(self, K: Matrix) -> Self {
        StateSpace { K, ..self }
    }

    /// Outputs `(N, ny)` for the inputs `(N, nu)`, row-major, from the state `x0` on.
    pub fn simulate(&self, u: &[f64], x0: &[f64]) -> Vec<f64> {
        let (n, nu, ny) = (self.n(), self.nu(), self.ny());
        let mut x = x0.to_vec();
        let mut next = vec![0.0; n];
        let mut y = vec![0.0; u.len() / nu * ny];
        for (u, y) in u.chunks_exact(nu).zip(y.chunks_exact_mut(ny)) {
            add(&self.C, &x, y);
            add(&self.D, u, y);
            next.fill(0.0);
            add(&self.A, &x, &mut next);
            add(&self.B, u, &mut next);
            std::mem::swap(&mut x, &mut next);
        }
        y
    }

    /// Response of the outputs `(rows, ny)` to each unit of the initial state.
    pub fn free(&self, rows: usize) -> Vec<Vec<f64>> {
        let silent = vec![0.0; rows * self.nu()];
        let unit = |j: usize| (0..self.n()).map(|i| f64::from(u8::from(i == j))).collect::<Vec<f64>>();
        (0..self.n()).map(|j| self.simulate(&silent, &unit(j))).collect()
    }

    /// `G` at a complex `z` (or `s`), `(ny, nu)` row-major; infinite at a pole.
    pub fn at(&self, z: Complex<f64>) -> Vec<Complex<f64>> {
        let (n, nu, ny) = (self.n(), self.nu(), self.ny());
        let real = |x: f64| Complex::new(x, 0.0);
        let less: Vec<Complex<f64>> = entries(&self.A)
            .enumerate()
            .map(|(ij, a)| if ij / n == ij % n { z - a } else { real(-a) })
            .collect();
        let B: Vec<Complex<f64>> = entries(&self.B).map(real).collect();
        let Some(X) = (if n == 0 { Some(B) } else { left_divide(&less, &B, n) }) else {
            return vec![real(f64::INFINITY); ny * nu];
        };
        let entry = |ij: usize| {
            let (i, j) = (ij / nu, ij % nu);
            (0..n).map(|k| X[k * nu + j] * self.C[(i, k)]).sum::<Complex<f64>>() + self.D[(i, j)]
        };
        (0..ny * nu).map(entry).collect()
    }

    /// `G` at `w` rad/s, `(ny, nu)` row-major.
    pub fn freqresp(&self, w: f64) -> Vec<Complex<f64>> {
        self.at(self.Ts.map_or(Complex::new(0.0, w), |Ts| Complex::from_polar(1.0, w * Ts)))
    }

    /// Static gains, `(ny, nu)` row-major; infinite with a pole there.
    pub fn dc_gain(&self) -> Vec<f64> {
        self.freqresp(0.0).into_iter().map(|g| g.re).collect()
    }

    /// Eigenvalues of `A`.
    pub fn poles(&self) -> Vec<(f64, f64)> {
        spectrum(&self.A)
    }

    /// The pole farthest beyond the border of stability, and how far beyond, in the plane of the poles.
    pub fn margin(&self) -> f64 {
        let beyond = |&(re, im): &(f64, f64)| if self.Ts.is_some() { re.hypot(im) - 1.0 } else { re };
        self.poles().iter().map(beyond).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Zeros of the whole model; it has to have as many outputs as inputs.
    pub fn zeros(&self) -> Result<Vec<(f64, f64)>> {
        if self.nu() != self.ny() {
            let came = format!("a model of {} inputs and {} outputs", self.nu(), self.ny());
            return Err(Error::argument(
                "model",
                came,
                "square; zeros(input=, output=) are those of one pair",
            ));
        }
        let n = self.n();
        // Off the unit circle and off round numbers, where models have poles and zeros.
        for z0 in [1.618_034, -1.324_718, 2.236_068, 0.577_216] {
            let regular = (Matrix::from_diagonal_element(n, n, z0) - &self.A).try_inverse().and_then(|M| {
                let G = &self.D + &self.C * &M * &self.B;
                let inverse = G.clone().try_inverse()?;
                (inverse.norm() * G.norm() < 1e12).then_some((M, inverse))
            });
            if let Some((M, inverse)) = regular {
                let W = &M * &M * &self.B * inverse * &self.C - &M;
                let back = |(re, im): (f64, f64)| {
                    let z = Complex::new(re, im).inv() + z0;
                    (z.re, z.im)
                };
                let found = spectrum(&W).into_iter().filter(|w| w.0.hypot(w.1) > 1e-7 * W.norm());
                return Ok(found.map(back).collect());
            }
        }
        Ok(Vec::new()) // G is singular everywhere
    }

    /// The model from input `j` to output `i`.
    pub fn pair(&self, i: usize, j: usize) -> StateSpace {
        StateSpace {
            A: self.A.clone(),
            B: self.B.columns(j, 1).into_owned(),
            C: self.C.rows(i, 1).into_owned(),
            D: Matrix::from_element(1, 1, self.D[(i, j)]),
            K: Matrix::zeros(self.n(), 1),
            Ts: self.Ts,
        }
    }

    /// The same plant sampled behind a zero-order hold: `exp [A Ts  B Ts; 0 0] = [A_d B_d; 0 I]`.
    pub fn sampled(&self, Ts: f64) -> Result<StateSpace> {
        if self.Ts.is_some() {
            return Err(Error::argument("model", "a sampled StateSpace", "one in continuous time, Ts=None"));
        }
        let size = self.n() + self.nu();
        let E = exponential(&entries(&(bordered(&self.A, &self.B, 0.0) * Ts)).collect::<Vec<f64>>(), size);
        Ok(self.inside(&Matrix::from_row_slice(size, size, &E), Some(Ts)))
    }

    /// The plant in continuous time of which this is the sampled form, by the logarithm of `[A B; 0 I]`.
    pub fn continuous(&self) -> Result<StateSpace> {
        let Some(Ts) = self.Ts else {
            return Err(Error::argument("model", "a StateSpace in continuous time", "a sampled one"));
        };
        let refused = || {
            let poles = self.poles();
            let low =
                poles.iter().filter(|p| p.1 == 0.0 && p.0 <= 0.0).map(|p| p.0).fold(f64::INFINITY, f64::min);
            let why = if low.is_finite() { format!("a pole at {low:.4}") } else { "its poles".to_owned() };
            Error::new("M12", format!("{why}: no plant behind a hold has it"))
                .remedy("reduce the model, or fit one of lower order")
        };
        if self.poles().iter().any(|p| p.1 == 0.0 && p.0 <= 1e-12) {
            return Err(refused());
        }
        let log = logarithm(&bordered(&self.A, &self.B, 1.0)).ok_or_else(refused)?;
        Ok(self.inside(&(log / Ts), None))
    }

    /// `A` and `B` from the top of a bordered matrix; the noise model belongs to its sample time.
    fn inside(&self, M: &Matrix, Ts: Option<f64>) -> StateSpace {
        let n = self.n();
        StateSpace {
            A: M.view((0, 0), (n, n)).into_owned(),
            B: M.view((0, n), (n, self.nu())).into_owned(),
            K: Matrix::zeros(n, self.ny()),
            Ts,
            ..self.clone()
        }
    }

    /// The polynomial model of the single output: `A = det(I - A q^-1)`, `B_i = A g_i` of the pulse responses,
    /// `C = det(I - (A - K C) q^-1)`; without a noise model `B/F`.
    pub fn polynomial(&self) -> Result<PolyModel> {
        let (Some(Ts), 1) = (self.Ts, self.ny()) else {
            let came = if self.Ts.is_none() {
                "in continuous time".into()
            } else {
                format!("of {} outputs", self.ny())
            };
            return Err(Error::argument(
                "model",
                format!("a StateSpace {came}"),
                "a sampled one of one output",
            ));
        };
        let A = monic(&self.poles());
        let numerator = |j: usize| {
            let impulse: Vec<f64> = (0..=self.n()).map(|k| f64::from(u8::from(k == 0))).collect();
            let g = self.pair(0, j).simulate(&impulse, &vec![0.0; self.n()]);
            let B = product(&A, &g)[..=self.n()].to_vec();
            let most = B.iter().fold(0.0f64, |most, b| most.max(b.abs()));
            let nk = B.iter().position(|b| b.abs() > 1e-12 * most).unwrap_or(0);
            (B[nk..].to_vec(), nk)
        };
        let (B, nk): (Vec<Vec<f64>>, Vec<usize>) = (0..self.nu()).map(numerator).unzip();
        let one = || vec![1.0];
        Ok(if self.K.iter().all(|k| *k == 0.0) {
            PolyModel { F: vec![A; B.len()], A: one(), C: one(), D: one(), B, nk, Ts }
        } else {
            let C = monic(&spectrum(&(&self.A - &self.K * &self.C)));
            PolyModel { C, ..PolyModel::arx(A, B, nk, Ts) }
        })
    }

    /// A polynomial model by states, in observer form over the common denominator `P = A D prod F_i`:
    ///
    /// ```text
    /// x_k(t+1) = x_(k+1) - p_k y + b_k u + c_k e,   y = x_1 + b_0 u + e
    /// ```
    pub fn of_polynomial(m: &PolyModel) -> StateSpace {
        let nu = m.B.len();
        let others = |skip: usize| {
            let each = m.F.iter().enumerate().filter(|(i, _)| *i != skip);
            each.fold(vec![1.0], |p, (_, F)| product(&p, F))
        };
        let P = product(&product(&m.A, &m.D), &others(nu));
        let numerator = |i: usize| {
            let late = [vec![0.0; m.nk[i]], m.B[i].clone()].concat();
            product(&late, &product(&others(i), &m.D))
        };
        let B: Vec<Vec<f64>> = (0..nu).map(numerator).collect();
        let noise = product(&m.C, &others(nu));
        let n = B.iter().chain([&P, &noise]).map(|p| p.len() - 1).max().unwrap_or(0);
        let of = |p: &[f64], k: usize| p.get(k).copied().unwrap_or(0.0);
        let mut A = Matrix::zeros(n, n);
        (0..n).for_each(|k| A[(k, 0)] = -of(&P, k + 1));
        (1..n).for_each(|k| A[(k - 1, k)] = 1.0);
        StateSpace {
            A,
            B: Matrix::from_fn(n, nu, |k, i| of(&B[i], k + 1) - of(&P, k + 1) * of(&B[i], 0)),
            C: Matrix::from_fn(1, n, |_, k| f64::from(u8::from(k == 0))),
            D: Matrix::from_fn(1, nu, |_, i| of(&B[i], 0)),
            K: Matrix::from_fn(n, 1, |k, _| of(&noise, k + 1) - of(&P, k + 1)),
            Ts: Some(m.Ts),
        }
    }
}

/// `y += M x`.
pub fn add(M: &Matrix, x: &[f64], y: &mut [f64]) {
    // Columns lie one after the other in memory.
    for (column, x) in M.as_slice().chunks_exact(y.len().max(1)).zip(x) {
        y.iter_mut().zip(column).for_each(|(y, m)| *y += m * x);
    }
}

/// Entries row by row.
pub fn entries(M: &Matrix) -> impl Iterator<Item = f64> + '_ {
    (0..M.nrows()).flat_map(move |i| (0..M.ncols()).map(move |j| M[(i, j)]))
}

/// Eigenvalues.
pub fn spectrum(A: &Matrix) -> Vec<(f64, f64)> {
    eigenvalues(&entries(A).collect::<Vec<f64>>(), A.nrows())
}

/// `[A B; 0 c I]`.
fn bordered(A: &Matrix, B: &Matrix, c: f64) -> Matrix {
    let (n, m) = (A.nrows(), B.ncols());
    let mut M = Matrix::zeros(n + m, n + m);
    M.view_mut((0, 0), (n, n)).copy_from(A);
    M.view_mut((0, n), (n, m)).copy_from(B);
    (n..n + m).for_each(|i| M[(i, i)] = c);
    M
}
