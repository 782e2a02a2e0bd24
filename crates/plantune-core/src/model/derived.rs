//! What a person acts on, with its standard deviation: gain, time constants, poles, zeros, step and frequency
//! responses by the delta rule.
//!
//! ```text
//! g(theta):   var g = J P J',   J = dg/dtheta
//!
//! K = B(1)/(A(1) F(1))             G = B/(A F) z^-nk        z = e^(j w Ts)
//! dG/da_k = -G z^-k / A            dG/db_k = z^-(nk+k)/(A F)         dG/df_k = -G z^-k / F
//! d|G| = Re(G* dG)/|G|             d arg G = Im(G* dG)/|G|^2
//! dy/da_k = -y(t-k)/A              dy/db_k = 1(t-nk-k)/(A F)         dy/df_k = -y(t-k)/F
//! p(z) = 0:   dz/dp_k = -z^-k / p'(z)
//! T = -Ts / ln z,   s = ln z / Ts,   w_n = |s|,   zeta = -Re s / |s|
//! ```
//!
//! Of a first order `dK/da = b/(1-a)^2` and `dT/da = Ts/(a ln^2 a)`, `a` being the pole: METHODS 2.4. A root that meets
//! another has no derivative, and an infinite standard deviation. The step response of a process model is
//! differentiated by central differences ([`differences`]). Where the plant may integrate, its slope takes the place of
//! `K` ([`super::integrator`]).

use super::integrator::{integrator, slope};
use super::{Model, PolyModel, ProcessModel};
use crate::linalg::{Complex, congruence};
use crate::poly::{at, divide, product, roots};
use crate::stats::normal_quantile;

type C = Complex<f64>;

/// A curve with its standard deviation, point by point.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Values.
    pub value: Vec<f64>,
    /// Standard deviations.
    pub sd: Vec<f64>,
}

/// A number with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// `K`, `slope`, `T`, `L`, `Tz`, `w_n`, `zeta`, counted where there are several.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard deviation; NaN where the number was chosen and not estimated.
    pub sd: f64,
}

/// A pole or zero: in `z` of a polynomial model, else in 1/s.
#[derive(Clone, Debug)]
pub struct Root {
    /// Where it lies.
    pub z: C,
    /// Derivatives with respect to the parameters.
    pub slope: Vec<C>,
}

/// Covariance of the parameters, and of what follows them; flat.
pub struct Covariance<'p>(pub &'p [f64]);

impl Covariance<'_> {
    /// `J P J'`, row-major.
    pub fn of(&self, rows: &[Vec<f64>]) -> Vec<f64> {
        let size = self.0.len().isqrt();
        congruence(rows, |i, j| self.0[i * size + j])
    }

    pub(super) fn sd(&self, row: &[f64]) -> f64 {
        if row.iter().any(|x| !x.is_finite()) {
            return f64::INFINITY;
        }
        self.of(&[row.to_vec()])[0].max(0.0).sqrt()
    }

    fn curve(&self, value: Vec<f64>, rows: &[Vec<f64>]) -> Curve {
        Curve { value, sd: rows.iter().map(|row| self.sd(row)).collect() }
    }
}

impl Root {
    /// Covariance of real and imaginary part, `[var re, cov, cov, var im]`.
    pub fn covariance(&self, P: &Covariance) -> Vec<f64> {
        if self.slope.iter().any(|s| !(s.re.is_finite() && s.im.is_finite())) {
            return vec![f64::INFINITY, f64::NAN, f64::NAN, f64::INFINITY];
        }
        let part = |of: fn(&C) -> f64| self.slope.iter().map(of).collect();
        P.of(&[part(|s| s.re), part(|s| s.im)])
    }
}

/// Gain of every input, time constants, dead time, natural frequencies and dampings.
pub fn derived(model: &Model, P: &Covariance) -> Vec<Quantity> {
    match model {
        Model::Poly(m) => of_poly(m, P),
        Model::Process(m) => of_process(m, P),
        Model::Transfer(_) => Vec::new(),
    }
}

/// Poles with their derivatives.
pub fn poles(model: &Model) -> Vec<Root> {
    match model {
        Model::Poly(m) => {
            let layout = Layout::of(m);
            let n = layout.n;
            let mut all = roots_of(&m.A, 1, layout.a, n);
            for (F, &first) in m.F.iter().zip(&layout.f) {
                all.extend(roots_of(F, 1, first, n));
            }
            all
        }
        Model::Process(m) => process_poles(m),
        Model::Transfer(m) => m.poles().into_iter().map(fixed).collect(),
    }
}

/// Zeros from input `i` with their derivatives.
pub fn zeros(model: &Model, i: usize) -> Vec<Root> {
    match model {
        Model::Poly(m) => {
            let layout = Layout::of(m);
            roots_of(&m.B[i], 0, layout.b[i], layout.n)
        }
        Model::Process(m) if m.Tz != 0.0 => {
            let mut slope = vec![C::new(0.0, 0.0); m.theta().len()];
            slope[m.T.len() + 2] = C::new(1.0 / (m.Tz * m.Tz), 0.0);
            vec![Root { z: C::new(-1.0 / m.Tz, 0.0), slope }]
        }
        Model::Process(_) => Vec::new(),
        Model::Transfer(m) => m.zeros().into_iter().map(fixed).collect(),
    }
}

/// Response to a unit step of input `i` at times `t`, seconds.
pub fn step(model: &Model, P: &Covariance, i: usize, t: &[f64]) -> Curve {
    let rows = match model {
        Model::Poly(m) => step_slopes(m, i, t),
        _ => differences(model, P, |m| m.step_response(i, t)),
    };
    P.curve(model.step_response(i, t), &rows)
}

/// Magnitude, and the standard deviation of the phase in degrees, from input `i` at `w` rad/s.
pub fn bode(model: &Model, P: &Covariance, i: usize, w: &[f64]) -> (Curve, Vec<f64>) {
    let (mut magnitudes, mut phases, mut value) = (Vec::new(), Vec::new(), Vec::new());
    for &w in w {
        let (G, slope) = response_slope(model, i, w);
        value.push(G.norm());
        magnitudes.push(slope.iter().map(|d| (G.conj() * d).re / G.norm()).collect());
        phases.push(slope.iter().map(|d| ((G.conj() * d).im / G.norm_sqr()).to_degrees()).collect());
    }
    (P.curve(value, &magnitudes), P.curve(Vec::new(), &phases).sd)
}

/// Central differences of a curve, one row a point; steps are small against the standard deviations, over which the
/// delta rule is linear anyway.
pub fn differences(model: &Model, P: &Covariance, curve: impl Fn(&Model) -> Vec<f64>) -> Vec<Vec<f64>> {
    let theta = model.theta();
    let size = P.0.len().isqrt();
    let slope = |j: usize| -> Vec<f64> {
        let sd = P.0[j * size + j].max(0.0).sqrt();
        let h = (1e-3 * sd).min(0.1 * theta[j].abs()).max(6e-6 * theta[j].abs().max(1e-6));
        let moved = |h: f64| {
            let mut theta = theta.clone();
            theta[j] += h;
            curve(&model.with_theta(&theta))
        };
        moved(h).iter().zip(moved(-h)).map(|(up, down)| (up - down) / (2.0 * h)).collect()
    };
    let columns: Vec<Vec<f64>> = (0..theta.len()).map(slope).collect();
    let points = columns.first().map_or(0, Vec::len);
    (0..points).map(|k| columns.iter().map(|c| c[k]).collect()).collect()
}

/// Where the coefficients of each polynomial stand in `theta`.
pub(super) struct Layout {
    pub(super) a: usize,
    pub(super) b: Vec<usize>,
    pub(super) f: Vec<usize>,
    pub(super) n: usize,
}

impl Layout {
    pub(super) fn of(m: &PolyModel) -> Self {
        let mut next = m.A.len() - 1;
        let mut take = |count: usize| {
            next += count;
            next - count
        };
        let b = m.B.iter().map(|b| take(b.len())).collect();
        take(m.C.len() - 1 + m.D.len() - 1);
        let f = m.F.iter().map(|f| take(f.len() - 1)).collect();
        Layout { a: 0, b, f, n: next }
    }
}

/// Roots of `p`, whose coefficients from `from` on are the parameters that begin at `first`.
pub fn roots_of(p: &[f64], from: usize, first: usize, n: usize) -> Vec<Root> {
    let of = |(re, im): (f64, f64)| {
        let z = C::new(re, im);
        let w = z.inv();
        let slope_of_p: C =
            p.iter().enumerate().skip(1).map(|(k, c)| w.powu(k as u32 + 1) * -(k as f64 * c)).sum();
        let mut slope = vec![C::new(0.0, 0.0); n];
        for k in from..p.len() {
            slope[first + k - from] = -w.powu(k as u32) / slope_of_p;
        }
        Root { z, slope }
    };
    roots(p).into_iter().map(of).collect()
}

fn fixed((re, im): (f64, f64)) -> Root {
    Root { z: C::new(re, im), slope: Vec::new() }
}

/// Name, value and derivatives on their way to a quantity.
type Row = (String, f64, Vec<f64>);

fn quantities(rows: Vec<Row>, P: &Covariance) -> Vec<Quantity> {
    rows.into_iter().map(|(name, value, row)| Quantity { name, value, sd: P.sd(&row) }).collect()
}

/// Static gain of input `i`, without a bound where the denominator vanishes.
pub(super) fn gain(m: &PolyModel, P: &Covariance, i: usize) -> Quantity {
    let (G, slope) = response_slope(&Model::Poly(m.clone()), i, 0.0);
    let K = m.dc_gain(i);
    let (value, sd) = if K.is_finite() {
        (G.re, P.sd(&slope.iter().map(|d| d.re).collect::<Vec<f64>>()))
    } else {
        (K, f64::INFINITY)
    };
    Quantity { name: counted("K", i, m.B.len()), value, sd }
}

/// `K/T` with the slowest lag from input `i`, and that `T`; none without one.
pub fn gain_per_time(model: &Model, P: &Covariance, i: usize) -> Option<(Quantity, f64)> {
    let (K, by_K, T, by_T) = match model {
        Model::Poly(m) => {
            let slowest = poles(model)
                .into_iter()
                .filter(|r| r.z.im == 0.0 && 0.0 < r.z.re && r.z.re < 1.0)
                .max_by(|a, b| a.z.re.total_cmp(&b.z.re))?;
            let ln = slowest.z.re.ln();
            let by_T: Vec<f64> =
                slowest.slope.iter().map(|s| m.Ts / (slowest.z.re * ln * ln) * s.re).collect();
            let by_K: Vec<f64> = response_slope(model, i, 0.0).1.iter().map(|d| d.re).collect();
            (m.dc_gain(i), by_K, -m.Ts / ln, by_T)
        }
        Model::Process(m) => {
            let n = m.theta().len();
            let slowest = (0..m.T.len()).max_by(|&a, &b| m.T[a].total_cmp(&m.T[b]))?;
            let unit = |j: usize| (0..n).map(|k| f64::from(u8::from(j == k))).collect::<Vec<f64>>();
            (m.K, unit(0), m.T[slowest], unit(1 + slowest))
        }
        Model::Transfer(_) => return None,
    };
    let row: Vec<f64> = by_K.iter().zip(&by_T).map(|(k, t)| k / T - K / (T * T) * t).collect();
    let sd = P.sd(&row);
    (K / T).is_finite().then(|| (Quantity { name: counted("K/T", i, model.nu()), value: K / T, sd }, T))
}

fn of_poly(m: &PolyModel, P: &Covariance) -> Vec<Quantity> {
    let mut all = Vec::new();
    let mut integrating = false;
    for i in 0..m.B.len() {
        let K = gain(m, P, i);
        let found = integrator(m, P, i, &K);
        integrating |= found.is_some();
        all.push(found.map_or(K, |found| slope(m, P, i, &found)));
    }
    let (lags, times) = times(m, P, integrating);
    all.extend(times);
    if !integrating && m.B.len() == 1 && m.order() == 1 && m.B[0].len() == 1 && m.nk[0] > 0 && lags == 1 {
        let L = (m.nk[0] - 1) as f64 * m.Ts; // chosen, not estimated
        all.push(Quantity { name: "L".into(), value: L, sd: f64::NAN });
    }
    all
}

/// The number of real lags; their time constants, and natural frequency and damping of the pairs.
///
/// Of an integrating plant without the lag that cannot be told from the integrator.
fn times(m: &PolyModel, P: &Covariance, integrating: bool) -> (usize, Vec<Quantity>) {
    let mut found = poles(&Model::Poly(m.clone()));
    found.sort_by(|a, b| b.z.norm().total_cmp(&a.z.norm()));
    let (pairs, reals): (Vec<Root>, Vec<Root>) =
        found.into_iter().filter(|r| r.z.im >= 0.0).partition(|r| r.z.im > 0.0);
    let mut lags: Vec<Root> = reals.into_iter().filter(|r| 0.0 < r.z.re && r.z.re < 1.0).collect();
    let may_integrate = |lag: &Root| 1.0 - lag.z.re <= normal_quantile(0.95) * lag.covariance(P)[0].sqrt();
    if integrating && lags.first().is_some_and(may_integrate) {
        lags.remove(0);
    }
    let mut rows: Vec<Row> = Vec::new();
    for (k, lag) in lags.iter().enumerate() {
        let (z, ln) = (lag.z.re, lag.z.re.ln());
        let row = lag.slope.iter().map(|s| m.Ts / (z * ln * ln) * s.re).collect();
        rows.push((counted("T", k, lags.len()), -m.Ts / ln, row));
    }
    for (k, pair) in pairs.iter().enumerate() {
        let s = pair.z.ln() / m.Ts;
        let slope: Vec<C> = pair.slope.iter().map(|d| d / pair.z / m.Ts).collect();
        rows.extend(frequency_and_damping(s, &slope, k, pairs.len()));
    }
    (lags.len(), quantities(rows, P))
}

/// `w_n` and `zeta` of a pair at `s`.
fn frequency_and_damping(s: C, slope: &[C], k: usize, count: usize) -> [Row; 2] {
    let w = s.norm();
    let of_w = |d: &C| (s.conj() * d).re / w;
    let of_zeta = |d: &C| -d.re / w + s.re * of_w(d) / (w * w);
    [
        (counted("w_n", k, count), w, slope.iter().map(of_w).collect()),
        (counted("zeta", k, count), -s.re / w, slope.iter().map(of_zeta).collect()),
    ]
}

pub(super) fn counted(name: &str, k: usize, count: usize) -> String {
    if count == 1 { name.to_owned() } else { format!("{name}{}", k + 1) }
}

fn of_process(m: &ProcessModel, P: &Covariance) -> Vec<Quantity> {
    let theta = m.theta();
    let unit = |j: usize| (0..theta.len()).map(|k| f64::from(u8::from(j == k))).collect::<Vec<f64>>();
    let mut rows = vec![("K".to_owned(), m.K, unit(0))];
    let lags = m.T.len() - usize::from(m.zeta.is_some());
    for (k, &T) in m.T.iter().enumerate() {
        let zeta = m.zeta.filter(|_| k == 0);
        if let Some(zeta) = zeta {
            let row = unit(1).iter().map(|one| -one / (T * T)).collect();
            rows.push(("w_n".into(), 1.0 / T, row));
            rows.push(("zeta".into(), zeta, unit(theta.len() - 1)));
        } else {
            rows.push((counted("T", k - usize::from(m.zeta.is_some()), lags), T, unit(1 + k)));
        }
    }
    rows.push(("L".into(), m.L, unit(1 + m.T.len())));
    if m.Tz != 0.0 {
        rows.push(("Tz".into(), m.Tz, unit(2 + m.T.len())));
    }
    quantities(rows, P)
}

fn process_poles(m: &ProcessModel) -> Vec<Root> {
    let n = m.theta().len();
    let none = || vec![C::new(0.0, 0.0); n];
    let mut all = Vec::new();
    for (k, &T) in m.T.iter().enumerate() {
        match m.zeta {
            Some(zeta) if k == 0 => {
                let root = C::new(zeta * zeta - 1.0, 0.0).sqrt();
                for sign in [1.0, -1.0] {
                    let mut slope = none();
                    let s = (root * sign - zeta) / T;
                    slope[1] = -s / T;
                    slope[n - 1] = (root.inv() * (sign * zeta) - 1.0) / T;
                    all.push(Root { z: s, slope });
                }
            }
            _ => {
                let mut slope = none();
                slope[1 + k] = C::new(1.0 / (T * T), 0.0);
                all.push(Root { z: C::new(-1.0 / T, 0.0), slope });
            }
        }
    }
    if m.integrating {
        all.push(Root { z: C::new(0.0, 0.0), slope: none() });
    }
    all
}

/// `G` and its derivatives.
fn response_slope(model: &Model, i: usize, w: f64) -> (C, Vec<C>) {
    let G = model.freqresp(i, w);
    match model {
        Model::Poly(m) => {
            let layout = Layout::of(m);
            let z = C::from_polar(1.0, w * m.Ts);
            let (A, F) = (at(&m.A, z), at(&m.F[i], z));
            let late = |k: usize| C::from_polar(1.0, -w * m.Ts * k as f64);
            let mut slope = vec![C::new(0.0, 0.0); layout.n];
            (1..m.A.len()).for_each(|k| slope[layout.a + k - 1] = -G * late(k) / A);
            (0..m.B[i].len()).for_each(|k| slope[layout.b[i] + k] = late(m.nk[i] + k) / (A * F));
            (1..m.F[i].len()).for_each(|k| slope[layout.f[i] + k - 1] = -G * late(k) / F);
            (G, slope)
        }
        Model::Process(m) => (G, process_slope(m, G, C::new(0.0, w))),
        Model::Transfer(_) => (G, Vec::new()),
    }
}

fn process_slope(m: &ProcessModel, G: C, s: C) -> Vec<C> {
    let mut slope = vec![G / m.K];
    let pair = m.zeta.map(|zeta| (zeta, s * s * m.T[0] * m.T[0] + s * (2.0 * zeta * m.T[0]) + 1.0));
    for (k, &T) in m.T.iter().enumerate() {
        slope.push(match pair {
            Some((zeta, q)) if k == 0 => -G * (s * s * (2.0 * T) + s * (2.0 * zeta)) / q,
            _ => -G * s / (s * T + 1.0),
        });
    }
    slope.push(-s * G);
    if m.Tz != 0.0 {
        slope.push(G * s / (s * m.Tz + 1.0));
    }
    slope.extend(pair.map(|(_, q)| -G * s * (2.0 * m.T[0]) / q));
    slope
}

/// Derivatives of the step response of a polynomial model, one row a time.
fn step_slopes(m: &PolyModel, i: usize, t: &[f64]) -> Vec<Vec<f64>> {
    let last = t.iter().fold(0.0f64, |last, &t| last.max(t));
    let rows = (last / m.Ts).floor() as usize + 2;
    let layout = Layout::of(m);
    let through = |x: &[f64], p: &[f64]| {
        let mut x = x.to_vec();
        divide(p, &mut x);
        x
    };
    let late =
        |x: &[f64], k: usize| -> Vec<f64> { (0..rows).map(|t| if t < k { 0.0 } else { x[t - k] }).collect() };
    let unit = through(&vec![1.0; rows], &product(&m.A, &m.F[i]));
    let mut y = vec![0.0; rows];
    let mut columns = vec![vec![0.0; rows]; layout.n];
    for (k, b) in m.B[i].iter().enumerate() {
        let own = late(&unit, m.nk[i] + k);
        y.iter_mut().zip(&own).for_each(|(y, x)| *y += b * x);
        columns[layout.b[i] + k] = own;
    }
    let (by_a, by_f) = (through(&y, &m.A), through(&y, &m.F[i]));
    let minus = |x: Vec<f64>| x.into_iter().map(|x| -x).collect::<Vec<f64>>();
    (1..m.A.len()).for_each(|k| columns[layout.a + k - 1] = minus(late(&by_a, k)));
    (1..m.F[i].len()).for_each(|k| columns[layout.f[i] + k - 1] = minus(late(&by_f, k)));
    let row = |&t: &f64| {
        let k = (t / m.Ts + 1e-9).floor();
        columns.iter().map(|c| if t < 0.0 { 0.0 } else { c[k as usize] }).collect()
    };
    t.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, what: &str) {
        assert!((a - b).abs() <= 2e-6 * (1.0 + a.abs().max(b.abs())), "{what}: {a} {b}");
    }

    fn box_jenkins() -> Model {
        Model::Poly(PolyModel {
            A: vec![1.0, -0.5],
            B: vec![vec![0.5, 0.2], vec![-0.3]],
            C: vec![1.0, 0.4],
            D: vec![1.0, -0.6],
            F: vec![vec![1.0, -1.5, 0.7], vec![1.0, -0.9]],
            nk: vec![2, 0],
            Ts: 0.5,
        })
    }

    fn pair_with_zero() -> Model {
        let T = vec![0.4, 1.5];
        Model::Process(ProcessModel { K: 2.0, T, L: 0.3, Tz: -0.2, zeta: Some(0.4), integrating: false })
    }

    /// All analytic derivatives are central differences.
    #[test]
    fn slopes_are_differences() {
        for model in [box_jenkins(), pair_with_zero()] {
            let n = model.theta().len();
            // Standard deviations of 0.01, so steps of 1e-5.
            let P: Vec<f64> = (0..n * n).map(|ij| 1e-4 * f64::from(u8::from(ij / n == ij % n))).collect();
            let P = Covariance(&P);
            for i in 0..model.nu() {
                for w in [0.3, 1.7] {
                    let (_, slope) = response_slope(&model, i, w);
                    let numeric = differences(&model, &P, |m| {
                        let G = m.freqresp(i, w);
                        vec![G.re, G.im]
                    });
                    for (j, s) in slope.iter().enumerate() {
                        close(s.re, numeric[0][j], "re");
                        close(s.im, numeric[1][j], "im");
                    }
                }
                if let Model::Poly(m) = &model {
                    let t = [-1.0, 0.0, 0.5, 3.2, 11.0];
                    let numeric = differences(&model, &P, |m| m.step_response(i, &t));
                    for (ours, numeric) in step_slopes(m, i, &t).iter().zip(&numeric) {
                        ours.iter().zip(numeric).for_each(|(a, b)| close(*a, *b, "step"));
                    }
                }
            }
            for all in [poles as fn(&Model) -> Vec<Root>, |m| zeros(m, 0)] {
                for (k, root) in all(&model).iter().enumerate() {
                    let numeric = differences(&model, &P, |m| {
                        let near = all(m).into_iter().map(|r| r.z);
                        let z = near.min_by(|a, b| (a - root.z).norm().total_cmp(&(b - root.z).norm()));
                        z.map_or(vec![], |z| vec![z.re, z.im])
                    });
                    for (j, s) in root.slope.iter().enumerate() {
                        close(s.re, numeric[0][j], &format!("root {k} {j}"));
                        close(s.im, numeric[1][j], &format!("root {k} {j}"));
                    }
                }
            }
            for (k, quantity) in derived(&model, &P).iter().enumerate() {
                let numeric = differences(&model, &P, |m| vec![derived(m, &P)[k].value]);
                let sd = 0.01 * numeric[0].iter().map(|x| x * x).sum::<f64>().sqrt();
                close(quantity.sd / sd, 1.0, &quantity.name);
            }
        }
    }

    /// `dK/da = b/(1-a)^2`, `dT/da = Ts/(a ln^2 a)`: METHODS 2.4.
    #[test]
    fn a_first_order_has_the_printed_slopes() {
        let (a, b, Ts): (f64, f64, f64) = (0.9, 0.4, 0.1);
        let model = Model::Poly(PolyModel::arx(vec![1.0, -a], vec![vec![b]], vec![3], Ts));
        let of_a = derived(&model, &Covariance(&[1e-6, 0.0, 0.0, 0.0]));
        let names: Vec<&str> = of_a.iter().map(|q| q.name.as_str()).collect();
        assert_eq!(names, ["K", "T", "L"]);
        close(1e3 * of_a[0].sd, b / (1.0 - a).powi(2), "K");
        close(1e3 * of_a[1].sd, Ts / (a * a.ln().powi(2)), "T");
        assert!((of_a[2].value - 0.2).abs() < 1e-15 && of_a[2].sd.is_nan());
        let of_b = derived(&model, &Covariance(&[0.0, 0.0, 0.0, 1.0]));
        close(of_b[0].sd, 1.0 / (1.0 - a), "K");
    }

    #[test]
    fn poles_that_meet_have_no_standard_deviation() {
        let model = Model::Poly(PolyModel::arx(vec![1.0, -1.0, 0.25], vec![vec![1.0]], vec![1], 1.0));
        let P = vec![1e-6; 9];
        let worst = poles(&model)[0].covariance(&Covariance(&P))[0];
        assert!(worst > 1.0, "{worst}");
    }
}
