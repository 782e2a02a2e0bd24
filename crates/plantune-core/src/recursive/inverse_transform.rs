//! The inverse digital transform: from the samples of a response back to the input that made it. Source 003.
//!
//! ```text
//! one real root, (5):  x(n) = [y(n) - z y(n-m)] / (1 - z)                          z = e^(p m Ts)
//! a pair, (6):         x(n) = [y(n) - 2 c y(n-m) + q y(n-2m)] / (1 - 2 c + q)      c = Re z,  q = |z|^2
//! ```
//!
//! in a row for any order, (7) and (8); a repeated root is a section repeated. Of a step response whose poles are
//! those of the sections every `x` is the static gain, whatever the initial state. So nothing is assumed of it: the
//! first `J m` values are no numbers.
//!
//! A sample that is no number is refused; after a gap [`InverseTransform::restart`] waits for a full window again.
//!
//! With `z = 1 + p m Ts` it is numerical differentiation, section 3: the same operator for a time constant that is
//! too long by about `m Ts / 2`.

use std::collections::VecDeque;

use crate::error::{Error, Result};
use crate::linalg::Complex;
use crate::poly::product;

/// Most samples that the sections remember.
const MOST: usize = 100_000_000;

/// Parts of conjugates may differ by this share.
const CONJUGATE: f64 = 1e-9;

/// Sections in a row.
#[derive(Clone, Debug)]
pub struct InverseTransform {
    sections: Vec<Section>,
    lag: usize,
    order: usize,
    gain: f64,
    seen: usize,
}

/// `b_0 y(n) + b_1 y(n - m) + b_2 y(n - 2m)`.
#[derive(Clone, Debug)]
struct Section {
    b: [f64; 3],
    past: VecDeque<f64>, // newest first
}

impl Section {
    /// From `1 - a q^-m + b q^-2m`.
    fn new(a: f64, b: f64, reach: usize) -> Option<Self> {
        let sum = 1.0 - a + b;
        let b = [1.0 / sum, -a / sum, b / sum];
        let past = VecDeque::from(vec![0.0; reach]);
        b.iter().all(|b| b.is_finite()).then_some(Section { b, past })
    }

    fn step(&mut self, y: f64, lag: usize) -> f64 {
        let reach = self.past.len();
        let mut x = self.b[0] * y + self.b[1] * self.past[lag - 1];
        if reach > lag {
            x += self.b[2] * self.past[reach - 1];
        }
        self.past.pop_back();
        self.past.push_front(y);
        x
    }
}

impl InverseTransform {
    /// For these poles, 1/s, a complex one with its conjugate; the input comes in units of y over `gain`.
    pub fn new(poles: &[Complex<f64>], Ts: f64, lag: usize, gain: f64) -> Result<Self> {
        Self::of_roots(poles, |p| (p * lag as f64 * Ts).exp(), Ts, lag, gain)
    }

    /// Numerical differentiation for these poles.
    pub fn differentiation(poles: &[Complex<f64>], Ts: f64, lag: usize, gain: f64) -> Result<Self> {
        Self::of_roots(poles, |p| p * lag as f64 * Ts + 1.0, Ts, lag, gain)
    }

    fn of_roots(
        poles: &[Complex<f64>],
        root: impl Fn(Complex<f64>) -> Complex<f64>,
        Ts: f64,
        lag: usize,
        gain: f64,
    ) -> Result<Self> {
        check(poles, Ts, lag, gain)?;
        let mut upper: Vec<Complex<f64>> = poles.iter().copied().filter(|p| p.im > 0.0).collect();
        let mut lower: Vec<Complex<f64>> = poles.iter().copied().filter(|p| p.im < 0.0).collect();
        let order = |a: &Complex<f64>, b: &Complex<f64>| {
            a.re.total_cmp(&b.re).then(a.im.abs().total_cmp(&b.im.abs()))
        };
        upper.sort_by(order);
        lower.sort_by(order);
        let close = |(a, b): (&Complex<f64>, &Complex<f64>)| (a - b.conj()).norm() <= CONJUGATE * a.norm();
        if upper.len() != lower.len() || !upper.iter().zip(&lower).all(close) {
            return Err(Error::argument(
                "poles",
                format!("{poles:?}"),
                "real, or complex with their conjugates",
            ));
        }
        let section = |&p: &Complex<f64>| {
            let z = root(p);
            let section = match p.im {
                0.0 => Section::new(z.re, 0.0, lag),
                _ => Section::new(2.0 * z.re, z.norm_sqr(), 2 * lag),
            };
            section.ok_or_else(|| {
                Error::argument("poles", p, &format!("one whose root at {lag} samples is finite and not 1"))
            })
        };
        let real = poles.iter().filter(|p| p.im == 0.0);
        let sections = real.chain(&upper).map(section).collect::<Result<_>>()?;
        Ok(InverseTransform { sections, lag, order: poles.len(), gain, seen: 0 })
    }

    /// The input; no number before the window is full. A sample that is refused changes nothing.
    pub fn step(&mut self, y: f64) -> Result<f64> {
        if y.is_finite() { Ok(self.next(y)) } else { Err(Error::argument("y", y, "a finite number")) }
    }

    /// `step` in a loop; nothing is taken in where one is refused.
    pub fn run(&mut self, y: &[f64]) -> Result<Vec<f64>> {
        if let Some(k) = y.iter().position(|y| !y.is_finite()) {
            return Err(Error::argument("y", format!("{} in row {k}", y[k]), "finite in every row"));
        }
        Ok(y.iter().map(|&y| self.next(y)).collect())
    }

    /// Forgets all samples, as after a gap.
    pub fn restart(&mut self) {
        self.seen = 0;
    }

    fn next(&mut self, y: f64) -> f64 {
        let x = self.sections.iter_mut().fold(y / self.gain, |x, section| section.step(x, self.lag));
        self.seen += 1;
        if self.seen > self.order * self.lag { x } else { f64::NAN }
    }

    /// `d` of `x(n) = sum_j d_j y(n - j m) / gain`; they sum to 1.
    pub fn coefficients(&self) -> Vec<f64> {
        let b = |s: &Section| s.b[..1 + s.past.len() / self.lag].to_vec();
        self.sections.iter().map(b).fold(vec![1.0], |d, b| product(&d, &b))
    }

    /// Standard deviation of x over that of white noise on y.
    pub fn noise_gain(&self) -> f64 {
        self.coefficients().iter().map(|d| d * d).sum::<f64>().sqrt() / self.gain.abs()
    }

    /// All that it remembers.
    pub fn state(&self) -> Vec<f64> {
        let past = self.sections.iter().flat_map(|s| s.past.iter().copied());
        std::iter::once(self.seen as f64).chain(past).collect()
    }

    /// Goes on from there.
    pub fn resume(&mut self, state: &[f64]) -> Result<()> {
        let needed = 1 + self.sections.iter().map(|s| s.past.len()).sum::<usize>();
        if state.len() != needed {
            return Err(Error::argument("state", format!("{} numbers", state.len()), &needed.to_string()));
        }
        self.seen = state[0] as usize;
        let mut past = state[1..].iter();
        self.sections.iter_mut().flat_map(|s| &mut s.past).zip(&mut past).for_each(|(own, x)| *own = *x);
        Ok(())
    }
}

fn check(poles: &[Complex<f64>], Ts: f64, lag: usize, gain: f64) -> Result<()> {
    if poles.is_empty() || !poles.iter().all(|p| p.re.is_finite() && p.im.is_finite() && p.norm() > 0.0) {
        return Err(Error::argument(
            "poles",
            format!("{poles:?}"),
            "finite and none of them 0, at least one",
        ));
    }
    if !(Ts > 0.0 && Ts.is_finite()) {
        return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
    }
    if lag == 0 || poles.len().saturating_mul(lag) > MOST {
        return Err(Error::argument("lag", lag, &format!("1 to {}", MOST / poles.len())));
    }
    if gain == 0.0 || !gain.is_finite() {
        return Err(Error::argument("gain", gain, "a finite number other than 0"));
    }
    Ok(())
}
