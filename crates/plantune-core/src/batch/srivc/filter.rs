//! The prefilter `1/A(s)`, `A = a_n s^n + … + a_1 s + 1`, and its derivatives, exact between samples.
//!
//! In companion form with the signal as further states, one step of a sample is one matrix exponential:
//! a held signal contributes the integral of `e^(M t)`, a linear one that of the integral as well. A held
//! signal late by `L = m + 1 - f` samples acts with its newer value over the last `f` of a sample. Time counts
//! in samples.

use super::HIGHEST;
use crate::linalg::exponential;

/// What is left of a unit that has died out.
const DEAD: f64 = 1e-30;

/// The state `z^(n-1) … z`, as far as the order goes.
type State = [f64; HIGHEST];

/// `1/A(s)` over samples.
pub(super) struct Filter<'a> {
    /// `a_1 … a_n`.
    a: &'a [f64],
    step: Vec<f64>, // (n, n), e^M
    held: Vec<f64>, // answer of the state to a unit held over one sample
    ramp: Vec<f64>, // answer to a ramp that rises by one in a sample
}

impl<'a> Filter<'a> {
    /// Nothing where the exponential is not finite.
    pub(super) fn new(a: &'a [f64]) -> Option<Self> {
        let (n, whole) = (a.len(), over(a, 1.0));
        let column = |j: usize| (0..n).map(|i| whole[i * (n + 2) + j]).collect();
        let step = (0..n * n).map(|ij| whole[ij / n * (n + 2) + ij % n]).collect();
        whole.iter().all(|x| x.is_finite()).then(|| Filter { a, step, held: column(n), ramp: column(n + 1) })
    }

    /// `z … z^(n)` of `z = v / A` from rest, `(N, n+1)`; `v` linear between samples.
    pub(super) fn linear(&self, v: &[f64]) -> Vec<f64> {
        let mut x: State = [0.0; HIGHEST];
        let mut rows = Vec::with_capacity(v.len() * (self.a.len() + 1));
        for k in 0..v.len() {
            if k > 0 {
                let (value, rise) = (v[k - 1], v[k] - v[k - 1]);
                x = self.next(x, |i| self.held[i] * value + self.ramp[i] * rise);
            }
            self.push(&mut rows, &x, v[k]);
        }
        rows
    }

    /// The same of a `v` that is held, and late by `L`; before row 0 it has its first value.
    pub(super) fn late(&self, v: &[f64], L: f64) -> Vec<f64> {
        let n = self.a.len();
        let m = (L + 1e-12).floor();
        let f = m + 1.0 - L;
        let newer: Vec<f64> = over(self.a, f).chunks(n + 2).take(n).map(|row| row[n]).collect();
        let at = |k: usize, lag: usize| v[k.saturating_sub(lag)];
        let m = m as usize;
        let mut x: State = [0.0; HIGHEST];
        let mut rows = Vec::with_capacity(v.len() * (n + 1));
        for k in 0..v.len() {
            if k > 0 {
                let (new, old) = (at(k - 1, m), at(k - 1, m + 1));
                x = self.next(x, |i| newer[i] * new + (self.held[i] - newer[i]) * old);
            }
            self.push(&mut rows, &x, if f > 1.0 - 1e-9 { at(k, m) } else { at(k, m + 1) });
        }
        rows
    }

    /// `z` from each unit state, `(N, n)`; nothing once it has died out, for numbers near zero are slow.
    pub(super) fn free(&self, N: usize) -> Vec<f64> {
        let n = self.a.len();
        let mut rows = vec![0.0; N * n];
        for j in 0..n {
            let mut x: State = [0.0; HIGHEST];
            x[j] = 1.0;
            for k in 0..N {
                if x.iter().all(|x| x.abs() < DEAD) {
                    break;
                }
                rows[k * n + j] = x[n - 1];
                x = self.next(x, |_| 0.0);
            }
        }
        rows
    }

    fn next(&self, x: State, drive: impl Fn(usize) -> f64) -> State {
        let n = self.a.len();
        let mut next = [0.0; HIGHEST];
        for (i, row) in self.step.chunks_exact(n).enumerate() {
            next[i] = drive(i) + row.iter().zip(&x).map(|(m, x)| m * x).sum::<f64>();
        }
        next
    }

    /// Appends `z … z^(n)` of the state `z^(n-1) … z`; `a_n z^(n) = v - z - … - a_(n-1) z^(n-1)`.
    fn push(&self, rows: &mut Vec<f64>, x: &State, v: f64) {
        let (first, n) = (rows.len(), self.a.len());
        rows.extend(x[..n].iter().rev());
        let below: f64 = rows[first + 1..].iter().zip(self.a).map(|(z, a)| a * z).sum();
        rows.push((v - rows[first] - below) / self.a[n - 1]);
    }
}

/// Exponential of `[x; v; dv/dt]` over a time, `(n+2, n+2)`.
fn over(a: &[f64], time: f64) -> Vec<f64> {
    let n = a.len();
    let mut big = vec![0.0; (n + 2) * (n + 2)];
    let first = a[n - 1];
    for j in 0..n {
        // x = [z^(n-1) … z]: the coefficient of z^(n-1-j).
        let own = if j + 1 == n { 1.0 } else { a[n - 2 - j] };
        big[j] = -own / first * time;
    }
    (1..n).for_each(|i| big[i * (n + 2) + i - 1] = time);
    big[n] = time / first;
    big[n * (n + 2) + n + 1] = time;
    exponential(&big, n + 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{TransferFunction, sampled};

    #[test]
    fn a_held_and_late_signal_is_filtered_as_the_sampled_plant() {
        let a = [3.0, 2.0, 1.5];
        let plant = TransferFunction { num: vec![1.0], den: vec![1.5, 2.0, 3.0, 1.0], L: 2.3 };
        let v: Vec<f64> = crate::linalg::white(60, 1)
            .into_iter()
            .enumerate()
            .map(|(k, v)| if k < 4 { 0.0 } else { v })
            .collect();
        let z = Filter::new(&a).expect("finite").late(&v, 2.3);
        let y = sampled(&plant, 1.0).simulate(&v, 1);
        assert!((0..60).all(|k| (z[4 * k] - y[k]).abs() < 1e-11));
    }

    /// `z = t - T (1 - e^(-t/T))` for a ramp through a first-order lag.
    #[test]
    fn a_ramp_is_filtered_exactly() {
        let v: Vec<f64> = (0..30).map(f64::from).collect();
        let z = Filter::new(&[4.0]).expect("finite").linear(&v);
        for (k, t) in v.iter().enumerate() {
            let lag = 4.0 * (1.0 - (-t / 4.0).exp());
            assert!((z[2 * k] - (t - lag)).abs() < 1e-12);
            assert!((z[2 * k + 1] - (1.0 - (-t / 4.0).exp())).abs() < 1e-12);
        }
    }
}
