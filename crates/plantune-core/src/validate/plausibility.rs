//! Poles and zeros that a sampled plant of lags does not have.
//!
//! A lag behind a zero-order hold has its pole in (0, 1). Noise on the regressor moves least squares
//! elsewhere: a pole that alternates in sign and dies out at once takes up the noise, and a zero just
//! outside the unit circle makes the step response start the wrong way. Together they are the pattern of
//! errors in variables, which the printed models of source 000 show.
//!
//! A root `z` of `p(q)` is as sure as the coefficients, `dz/dp_j = -z^-j / (dp/dz)`; only what lies beyond
//! two standard deviations counts. Zeros on the negative real axis are left alone: sampling itself puts
//! them there (Åström, Hagander and Sternby 1984), and so does a delay that is no whole number of samples.

use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::Complex;
use crate::model::{Model, PolyModel};
use crate::note::{Note, Place};
use crate::poly::{at, roots};

/// Standard deviations within which a root may lie elsewhere.
const SURE: f64 = 2.0;

/// A root with the standard deviation of its real part.
pub(super) struct Root {
    pub(super) z: Complex<f64>,
    pub(super) sd: f64,
}

/// Doubts about the roots of a model; `P` is the covariance of its parameters, and possibly more, row-major.
///
/// Of several inputs the one concerned is named, by its number where `inputs` has no name for it.
pub fn plausible(model: &Model, P: Option<&[f64]>, inputs: &[String], limits: &Limits) -> Result<Vec<Note>> {
    let Model::Poly(model) = model else {
        return Ok(Vec::new());
    };
    check(model, P)?;
    let mut notes: Vec<Note> = Vec::new();
    for i in 0..model.B.len() {
        let name = inputs.get(i).cloned().unwrap_or_else(|| format!("input {}", i + 1));
        let of = |note: Note| if model.B.len() > 1 { named(note, &name) } else { note };
        let zero = wrong_way(model, i, P, limits).map(of);
        let pole = alternating(model, i, P, limits);
        let pole = if model.F[i].len() > 1 { pole.map(of) } else { pole };
        let pattern = (zero.is_some() && pole.is_some()).then(errors_in_variables);
        for note in [zero, pole, pattern].into_iter().flatten() {
            // Inputs share the poles of A.
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
    }
    Ok(notes)
}

/// The same note of one input.
fn named(note: Note, input: &str) -> Note {
    let text = format!("from {input}: {}", note.text);
    Note { text, ..note }.at(Place::column(input))
}

fn check(model: &PolyModel, P: Option<&[f64]>) -> Result<()> {
    let Some(P) = P else { return Ok(()) };
    let (n, size) = (model.theta().len(), P.len().isqrt());
    if size < n || size * size != P.len() {
        let came = format!("{} numbers", P.len());
        return Err(Error::argument("P", came, &format!("square, at least {n} by {n}")));
    }
    Ok(())
}

/// V08: both.
fn errors_in_variables() -> Note {
    Note::warning("V08", "poles and zeros are those of least squares on noisy regressors")
        .remedy("fit an output-error model, or filter u and y alike; never y alone")
}

/// V06: a zero surely outside the unit circle near its positive end, and a first sample to show for it.
fn wrong_way(model: &PolyModel, i: usize, P: Option<&[f64]>, limits: &Limits) -> Option<Note> {
    let (first, last) = (model.B[i][0], model.dc_gain(i));
    let share = -first / last;
    let outside = |r: &Root| r.z.im == 0.0 && r.z.re - SURE * r.sd > 1.0;
    let zero = zeros(model, i, P).into_iter().find(outside)?;
    (share > limits.V06).then(|| {
        Note::warning(
            "V06",
            format!(
                "a zero at {:.3}, outside the unit circle: a step first answers {first:.4}, and {last:.4} in the end",
                zero.z.re
            ),
        )
        .measured(share, limits.V06)
        .remedy("doubt the model unless the plant does start the wrong way")
    })
}

/// V07: a pole surely on the left that dies out at once, beside a slower one on the right.
fn alternating(model: &PolyModel, i: usize, P: Option<&[f64]>, limits: &Limits) -> Option<Note> {
    let poles = poles(model, i, P);
    let slowest = poles.iter().map(|r| r.z).max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    // Below the limit it is as good as none; a slow one is a resonance near half the sampling rate.
    let odd = |r: &&Root| {
        r.z.re + SURE * r.sd < 0.0 && r.z.norm() > limits.V07 && r.z.norm() < slowest.norm().powi(FASTER)
    };
    let odd = poles.iter().filter(odd).max_by(|a, b| a.z.norm().total_cmp(&b.z.norm()))?;
    (slowest.re > 0.0).then(|| {
        Note::warning(
            "V07",
            format!(
                "a pole at {} beside one at {}: sampled lags have theirs between 0 and 1",
                written(odd.z),
                written(slowest)
            ),
        )
        .measured(odd.z.norm(), limits.V07)
        .remedy("lower the order, or fit an output-error model")
    })
}

/// How many times as fast as the slowest pole an odd one dies out.
const FASTER: i32 = 3;

fn written(z: Complex<f64>) -> String {
    if z.im == 0.0 { format!("{:.3}", z.re) } else { format!("{:.3} ± {:.3}j", z.re, z.im.abs()) }
}

/// Zeros from input `i`; `theta` holds `a`, then `b` of each input.
pub(super) fn zeros(model: &PolyModel, i: usize, P: Option<&[f64]>) -> Vec<Root> {
    let from = model.A.len() - 1 + model.B[..i].iter().map(Vec::len).sum::<usize>();
    with_sd(&model.B[i], 0, from, P)
}

/// Poles from input `i`: of `A`, and of its own `F`.
pub(super) fn poles(model: &PolyModel, i: usize, P: Option<&[f64]>) -> Vec<Root> {
    let free = |p: &Vec<f64>| p.len() - 1;
    let before = free(&model.A)
        + model.B.iter().map(Vec::len).sum::<usize>()
        + free(&model.C)
        + free(&model.D)
        + model.F[..i].iter().map(free).sum::<usize>();
    let mut poles = with_sd(&model.A, 1, 0, P);
    poles.extend(with_sd(&model.F[i], 1, before, P));
    poles
}

/// Roots of `p`, whose coefficients from `first` on are the parameters from `from` on.
fn with_sd(p: &[f64], first: usize, from: usize, P: Option<&[f64]>) -> Vec<Root> {
    let root = |(re, im): (f64, f64)| {
        let z = Complex::new(re, im);
        Root { z, sd: P.map_or(0.0, |P| deviation(p, first, from, P, z)) }
    };
    roots(p).into_iter().map(root).collect()
}

/// Standard deviation of the real part of a root, to first order.
fn deviation(p: &[f64], first: usize, from: usize, P: &[f64], z: Complex<f64>) -> f64 {
    let size = P.len().isqrt();
    // dp/dz = -sum_j j p_j z^-(j + 1)
    let weighted: Vec<f64> = p.iter().enumerate().map(|(j, c)| -(j as f64) * c).collect();
    let slope = at(&weighted, z) / z;
    let gradient: Vec<f64> = (first..p.len()).map(|j| (-z.powi(-(j as i32)) / slope).re).collect();
    let element = |j: usize, k: usize| P[(from + j) * size + from + k];
    let n = gradient.len();
    let variance: f64 =
        (0..n * n).map(|jk| gradient[jk / n] * gradient[jk % n] * element(jk / n, jk % n)).sum();
    // A double root moves without bound.
    if variance.is_finite() { variance.max(0.0).sqrt() } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The standard deviation of a root against finite differences of the roots.
    #[test]
    fn a_root_is_as_sure_as_its_coefficients() {
        let p = [1.0, -0.8, 0.5, -0.1];
        let h = 1e-6;
        for (k, &(re, im)) in roots(&p).iter().enumerate() {
            for j in 1..4 {
                let mut moved = p;
                moved[j] += h;
                let near = roots(&moved)[k].0 - re;
                let mut P = vec![0.0; 9];
                P[(j - 1) * 4] = 1.0;
                let sd = deviation(&p, 1, 0, &P, Complex::new(re, im));
                assert!((sd - (near / h).abs()).abs() < 1e-4, "root {k}, coefficient {j}");
            }
        }
    }
}
