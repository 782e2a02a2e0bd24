//! `A(q) y(t) = sum_i B_i(q)/F_i(q) u_i(t - nk_i) + C(q)/D(q) e(t)`, the polynomial family.
//!
//! What is not known of a segment's start enters as impulses into the parts that have memory,
//! so simulations and prediction errors are linear in it.

use super::Response;
use crate::linalg::Complex;
use crate::poly::{at, at_one, divide, impulse, multiply, product, roots};

/// Polynomials in ascending powers of `q^-1`; `A C D F` begin with 1, `B_i` follows the delay `nk_i`.
#[derive(Clone, Debug, PartialEq)]
pub struct PolyModel {
    /// Poles shared by all inputs and the noise.
    pub A: Vec<f64>,
    /// Numerator per input.
    pub B: Vec<Vec<f64>>,
    /// Noise numerator.
    pub C: Vec<f64>,
    /// Noise denominator.
    pub D: Vec<f64>,
    /// Denominator per input.
    pub F: Vec<Vec<f64>>,
    /// Delay per input, samples.
    pub nk: Vec<usize>,
    /// Sample time, s.
    pub Ts: f64,
}

impl PolyModel {
    /// `A y = B u + e`.
    pub fn arx(A: Vec<f64>, B: Vec<Vec<f64>>, nk: Vec<usize>, Ts: f64) -> Self {
        let F = vec![vec![1.0]; B.len()];
        PolyModel { A, B, C: vec![1.0], D: vec![1.0], F, nk, Ts }
    }

    /// Rows until every lag of `A` and `B` lies in the record.
    pub fn history(&self) -> usize {
        let inputs = self.B.iter().zip(&self.nk).map(|(b, nk)| nk + b.len() - 1);
        inputs.chain([self.A.len() - 1]).max().unwrap_or(0)
    }

    /// Order of `A` plus the orders of all `F`.
    pub fn order(&self) -> usize {
        self.A.len() - 1 + self.F.iter().map(|f| f.len() - 1).sum::<usize>()
    }

    /// Free coefficients in the order `a b c d f`.
    pub fn theta(&self) -> Vec<f64> {
        let free = |p: &[f64]| p[1..].to_vec();
        [
            free(&self.A),
            self.B.concat(),
            free(&self.C),
            free(&self.D),
            self.F.iter().flat_map(|f| free(f)).collect(),
        ]
        .concat()
    }

    /// The same orders with other coefficients.
    pub fn with_theta(&self, theta: &[f64]) -> Self {
        let mut model = self.clone();
        model.set_theta(theta);
        model
    }

    /// Takes other coefficients.
    pub fn set_theta(&mut self, theta: &[f64]) {
        let mut values = theta.iter().copied();
        let mut refill = |p: &mut [f64]| p.iter_mut().zip(values.by_ref()).for_each(|(c, v)| *c = v);
        refill(&mut self.A[1..]);
        self.B.iter_mut().for_each(|b| refill(b));
        refill(&mut self.C[1..]);
        refill(&mut self.D[1..]);
        self.F.iter_mut().for_each(|f| refill(&mut f[1..]));
    }

    /// Output from rest.
    pub fn simulate(&self, u: &[f64], nu: usize) -> Vec<f64> {
        let rows = u.len() / nu;
        let mut y = vec![0.0; rows];
        for i in 0..nu {
            let mut w = self.through_b(u, nu, i, 0, rows);
            divide(&self.F[i], &mut w);
            y.iter_mut().zip(&w).for_each(|(y, w)| *y += w);
        }
        divide(&self.A, &mut y);
        y
    }

    /// Simulation over a segment; the start enters as impulses into `1/A` and `1/(A F_i)`.
    pub fn simulation(&self, u: &[f64], nu: usize) -> Response {
        let rows = (u.len() / nu).saturating_sub(self.history());
        let mut forced = vec![0.0; rows];
        let mut free = shifts(&impulse(&[1.0], &self.A, rows), self.A.len() - 1);
        for i in 0..nu {
            let mut w = self.through_b(u, nu, i, self.history(), rows);
            divide(&self.F[i], &mut w);
            forced.iter_mut().zip(&w).for_each(|(y, w)| *y += w);
            let denominator = product(&self.A, &self.F[i]);
            free.extend(shifts(&impulse(&[1.0], &denominator, rows), self.F[i].len() - 1));
        }
        divide(&self.A, &mut forced);
        Response { forced, free }
    }

    /// `e = (D/C) (A y - sum B_i/F_i u_i)` over a segment; the start enters as impulses
    /// into `D/(C F_i)` and `1/C`.
    pub fn prediction_error(&self, u: &[f64], nu: usize, y: &[f64]) -> Response {
        let history = self.history();
        let rows = (u.len() / nu).saturating_sub(history);
        let mut e: Vec<f64> = (history..history + rows)
            .map(|k| self.A.iter().enumerate().map(|(j, a)| a * y[k - j]).sum())
            .collect();
        let memory = (self.C.len() - 1).max(self.D.len() - 1);
        let mut free = shifts(&impulse(&[1.0], &self.C, rows), memory);
        for i in 0..nu {
            let mut w = self.through_b(u, nu, i, history, rows);
            divide(&self.F[i], &mut w);
            e.iter_mut().zip(&w).for_each(|(e, w)| *e -= w);
            let denominator = product(&self.C, &self.F[i]);
            free.extend(shifts(&impulse(&self.D, &denominator, rows), self.F[i].len() - 1));
        }
        let mut forced = multiply(&self.D, &e);
        divide(&self.C, &mut forced);
        Response { forced, free }
    }

    /// First `len` terms of `C / (D A)`.
    pub fn noise_impulse(&self, len: usize) -> Vec<f64> {
        impulse(&self.C, &product(&self.D, &self.A), len)
    }

    /// `G_i(e^(j w Ts))`, the pulse transfer function.
    pub fn freqresp(&self, i: usize, w: f64) -> Complex<f64> {
        let z = Complex::from_polar(1.0, w * self.Ts);
        let delay = Complex::from_polar(1.0, -w * self.Ts * self.nk[i] as f64);
        delay * at(&self.B[i], z) / (at(&self.A, z) * at(&self.F[i], z))
    }

    /// Numerator and denominator of `G_i(z)` in descending powers of `z`, the delay as poles at zero.
    pub fn pulse_transfer(&self, i: usize) -> (Vec<f64>, Vec<f64>) {
        let mut num = [vec![0.0; self.nk[i]], self.B[i].clone()].concat();
        let mut den = product(&self.A, &self.F[i]);
        let terms = num.len().max(den.len());
        num.resize(terms, 0.0);
        den.resize(terms, 0.0);
        (num, den)
    }

    /// Roots of `A` and of every `F`.
    pub fn poles(&self) -> Vec<(f64, f64)> {
        self.F.iter().flat_map(|f| roots(f)).chain(roots(&self.A)).collect()
    }

    /// `B_i(1) / (A(1) F_i(1))`; infinite where the denominator vanishes within rounding.
    pub fn dc_gain(&self, i: usize) -> f64 {
        let vanishes = |p: &[f64]| at_one(p).abs() <= 1e-12 * p.iter().map(|c| c.abs()).sum::<f64>();
        if vanishes(&self.A) || vanishes(&self.F[i]) {
            return f64::INFINITY.copysign(at_one(&self.B[i]));
        }
        at_one(&self.B[i]) / (at_one(&self.A) * at_one(&self.F[i]))
    }

    /// `O` of `y = G u + O`, where `A y = sum B_i/F_i u_i + d` holds for what the signals differ from `u0` and
    /// `y0`, and its gradient with respect to `theta, d`:
    /// `O = y0 + (d - sum B_i(1)/F_i(1) u0_i) / A(1)`; of an integrator the drift, `A(1) O`.
    pub fn level(&self, d: f64, u0: &[f64], y0: f64) -> (f64, Vec<f64>) {
        let A1 = at_one(&self.A);
        let size: f64 = self.A.iter().map(|a| a.abs()).sum();
        let integrating = A1.abs() <= 1e-10 * size;
        let paths = || u0.iter().zip(self.B.iter().zip(&self.F));
        let rest: f64 = d - paths().map(|(u0, (b, f))| at_one(b) / at_one(f) * u0).sum::<f64>();
        let per_d = if integrating { 1.0 } else { 1.0 / A1 };
        let per_a = if integrating { 0.0 } else { -rest / (A1 * A1) };
        let mut gradient = vec![per_a; self.A.len() - 1];
        for (u0, (b, f)) in paths() {
            gradient.extend(b.iter().map(|_| -u0 / at_one(f) * per_d));
        }
        gradient.extend(vec![0.0; self.C.len() + self.D.len() - 2]);
        for (u0, (b, f)) in paths() {
            gradient.extend(f[1..].iter().map(|_| at_one(b) / at_one(f).powi(2) * u0 * per_d));
        }
        gradient.push(per_d);
        (if integrating { A1 * y0 + rest } else { y0 + rest / A1 }, gradient)
    }

    /// Unit step response at the given times, held between samples.
    pub fn step_response(&self, i: usize, t: &[f64]) -> Vec<f64> {
        let last = t.iter().fold(0.0f64, |m, &t| m.max(t));
        let rows = (last / self.Ts).floor() as usize + 2;
        let ones = vec![1.0; rows * self.B.len()];
        let mut y = self.through_b(&ones, self.B.len(), i, 0, rows);
        divide(&self.F[i], &mut y);
        divide(&self.A, &mut y);
        t.iter().map(|&t| if t < 0.0 { 0.0 } else { y[(t / self.Ts + 1e-9).floor() as usize] }).collect()
    }

    /// `B_i(q) u_i(t - nk_i)` on rows `from..from + rows`; the input before row 0 is zero.
    fn through_b(&self, u: &[f64], nu: usize, i: usize, from: usize, rows: usize) -> Vec<f64> {
        let (b, nk) = (&self.B[i], self.nk[i]);
        (from..from + rows)
            .map(|k| {
                b.iter()
                    .enumerate()
                    .filter(|(j, _)| k >= nk + j)
                    .map(|(j, c)| c * u[(k - nk - j) * nu + i])
                    .sum()
            })
            .collect()
    }
}

/// A response and its delays by 1, …, `count - 1` samples.
fn shifts(response: &[f64], count: usize) -> Vec<Vec<f64>> {
    (0..count)
        .map(|j| {
            let kept = response.len().saturating_sub(j);
            let zeros = vec![0.0; response.len() - kept];
            [zeros, response[..kept].to_vec()].concat()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{Triangle, residual_norm2, white};

    /// Two inputs, every polynomial of order one or more.
    fn model() -> PolyModel {
        PolyModel {
            A: vec![1.0, -0.9],
            B: vec![vec![0.5, 0.2], vec![-0.3]],
            C: vec![1.0, 0.6],
            D: vec![1.0, -0.4, 0.1],
            F: vec![vec![1.0, -0.5], vec![1.0, -1.1, 0.4]],
            nk: vec![2, 1],
            Ts: 0.1,
        }
    }

    /// One input of an interleaved pair, delayed, through a polynomial.
    fn through(p: &[f64], u: &[f64], i: usize, delay: usize) -> Vec<f64> {
        let own = u.iter().skip(i).step_by(2).copied();
        let late: Vec<f64> = std::iter::repeat_n(0.0, delay).chain(own).take(u.len() / 2).collect();
        multiply(p, &late)
    }

    /// Share of `target` that no combination of `columns` explains.
    fn unexplained(columns: &[Vec<f64>], target: &[f64]) -> f64 {
        let n = columns.len();
        let rows: Vec<Vec<f64>> =
            (0..target.len()).map(|k| columns.iter().map(|c| c[k]).chain([target[k]]).collect()).collect();
        let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
        let every: Vec<usize> = (0..n).collect();
        let left = residual_norm2(&triangle, &every, n, 1e-12);
        (left / target.iter().map(|x| x * x).sum::<f64>()).sqrt()
    }

    fn largest_gap(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn simulation_from_rest_solves_the_difference_equation() {
        let (m, u) = (model(), white(120, 1));
        let y = m.simulate(&u, 2);
        let left = multiply(&product(&m.A, &product(&m.F[0], &m.F[1])), &y);
        let first = through(&product(&m.B[0], &m.F[1]), &u, 0, 2);
        let second = through(&product(&m.B[1], &m.F[0]), &u, 1, 1);
        let right: Vec<f64> = first.iter().zip(&second).map(|(a, b)| a + b).collect();
        assert!(largest_gap(&left, &right) < 1e-13);
    }

    #[test]
    fn a_segment_is_its_forced_response_and_a_combination_of_the_free_ones() {
        let (m, u) = (model(), white(400, 2));
        let y = m.simulate(&u, 2);
        let segment = m.simulation(&u[2 * 60..], 2);
        let rest: Vec<f64> = y[60 + m.history()..].iter().zip(&segment.forced).map(|(y, f)| y - f).collect();
        assert_eq!(segment.free.len(), m.order());
        assert!(unexplained(&segment.free, &rest) < 1e-10);
        assert!(unexplained(&segment.free[1..], &rest) > 1e-3);
    }

    #[test]
    fn prediction_errors_are_the_noise_but_for_the_start() {
        let (m, u, e) = (model(), white(400, 3), white(200, 4));
        let mut disturbance = multiply(&m.C, &e);
        divide(&product(&m.D, &m.A), &mut disturbance);
        let y: Vec<f64> = m.simulate(&u, 2).iter().zip(&disturbance).map(|(y, v)| y + v).collect();
        let segment = m.prediction_error(&u[2 * 60..], 2, &y[60..]);
        let gap: Vec<f64> =
            segment.forced.iter().zip(&e[60 + m.history()..]).map(|(ours, e)| ours - e).collect();
        assert!(unexplained(&segment.free, &gap) < 1e-10);
    }

    #[test]
    fn frequency_response_is_the_sum_of_the_impulse_response() {
        let m = model();
        let mut u = vec![0.0; 800];
        u[0] = 1.0;
        let g = m.simulate(&u, 2);
        for w in [0.0, 3.0, 25.0] {
            let sum: Complex<f64> =
                g.iter().enumerate().map(|(k, g)| Complex::from_polar(*g, -w * m.Ts * k as f64)).sum();
            assert!((m.freqresp(0, w) - sum).norm() < 1e-12, "{w} rad/s");
        }
    }

    #[test]
    fn the_pulse_transfer_function_is_the_frequency_response() {
        let m = model();
        for (i, w) in [(0, 0.0), (0, 3.0), (1, 25.0)] {
            let z = Complex::from_polar(1.0, w * m.Ts);
            let horner = |p: &[f64]| p.iter().fold(Complex::new(0.0, 0.0), |sum, c| sum * z + *c);
            let (num, den) = m.pulse_transfer(i);
            assert!((horner(&num) / horner(&den) - m.freqresp(i, w)).norm() < 1e-12, "{w} rad/s");
        }
    }

    #[test]
    fn the_step_response_ends_at_the_static_gain() {
        let m = model();
        assert!((m.step_response(0, &[40.0])[0] - m.dc_gain(0)).abs() < 1e-12);
        assert_eq!(
            PolyModel::arx(vec![1.0, -1.0], vec![vec![-0.2]], vec![1], 1.0).dc_gain(0),
            f64::NEG_INFINITY
        );
    }

    #[test]
    fn theta_fills_the_same_model_again() {
        let m = model();
        assert_eq!(m.with_theta(&m.theta()), m);
    }
}
