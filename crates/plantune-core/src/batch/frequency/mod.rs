//! Models fitted to a frequency response: `min sum_k |G_k - G(w_k; theta)|^2 / sd_k^2`.
//!
//! ```text
//! process      K (Tz s + 1) e^(-L s) / (s^i prod (T s + 1)), sampled behind a hold where the data are, L any number
//! polynomials  B(q)/F(q) q^-nk of sampled data;  (b0 + b1 s + …)/(1 + a1 s + …) e^(-L s) of continuous data
//! ```
//!
//! Real and imaginary part each make a row, with half the variance of the point. Levenberg and Marquardt's way from
//! several starts ([`process`], [`rational`]), for the cost has a minimum at every turn of the phase that a delay can
//! make. `P = s^2 (psi' psi)^-1 / share`, `s^2` the mean squared residual, `share` the part of a point's information
//! that its neighbours do not hold: averaged spectra overlap. Ljung 1999, 7.7; Pintelon and Schoukens 2012, 7 to 9.

mod process;
mod rational;

use self::process::Process;
use self::rational::Rational;
use super::fit::{Fit, Status, standard_deviations};
use super::process::Code;
use crate::error::{Error, Result};
use crate::linalg::{Complex, Minimum, Residuals, Triangle, congruence, minimise, solve};
use crate::model::{FrequencyResponse, Model};
use crate::note::{Note, Place};

/// Pivots below this share mean that the points do not tell parameters apart.
const RANK_TOLERANCE: f64 = 1e-12;

/// Dead times tried at most.
const DELAYS: usize = 400;

/// What is to be fitted.
#[derive(Clone, Copy, Debug)]
pub enum Structure {
    /// A process model by its code.
    Process(Code),
    /// A ratio of polynomials.
    Rational {
        /// Coefficients of the numerator.
        nb: usize,
        /// Poles.
        nf: usize,
        /// Delay in samples, of sampled data.
        nk: usize,
        /// Whether a dead time is estimated, of continuous data.
        delay: bool,
    },
}

/// One output over one input: points, the weight of each, and how they were measured.
struct Points {
    w: Vec<f64>,
    G: Vec<Complex<f64>>,
    /// `sqrt(2)/sd`, so that each part of a point has variance one.
    weight: Vec<f64>,
    Ts: Option<f64>,
}

/// A family of models with a parameter vector of its own.
trait Family {
    /// Response at every point and its derivative with respect to each parameter; None where there is no model.
    fn response(&self, x: &[f64]) -> Option<(Vec<Complex<f64>>, Vec<Vec<Complex<f64>>>)>;
    /// Brings `x` to where a model is allowed.
    fn project(&self, x: &mut [f64]);
    /// Places to search from, best first.
    fn starts(&self) -> Vec<Vec<f64>>;
    /// The model, its parameters by name, and their derivatives with respect to `x`, a row each.
    fn named(&self, x: &[f64]) -> (Model, Vec<(String, f64)>, Vec<Vec<f64>>);
    /// Parameters that no point tells (`L` of a code without `D`).
    fn points(&self) -> &Points;
}

/// Fits a structure to output `i` over input `j`; `share` as [`crate::analyze::Response`] has it.
pub fn frequency(
    data: &FrequencyResponse,
    i: usize,
    j: usize,
    structure: Structure,
    share: f64,
) -> Result<Fit> {
    let points = Points::of(data, i, j, structure)?;
    match structure {
        Structure::Process(code) => fitted(&Process { code, points }, share),
        Structure::Rational { nb, nf, nk, delay } => {
            if nb == 0 {
                return Err(Error::argument("nb", nb, "at least 1"));
            }
            if points.Ts.is_none() && nb > nf + 1 {
                return Err(Error::argument("nb", nb, "at most nf + 1: no plant has more zeros than poles"));
            }
            let sampled = points.Ts.is_some();
            fitted(&Rational::new(nb, nf, if sampled { nk } else { 0 }, delay && !sampled, points), share)
        }
    }
}

impl Points {
    fn of(data: &FrequencyResponse, i: usize, j: usize, structure: Structure) -> Result<Self> {
        if i >= data.ny || j >= data.nu {
            let has = format!("below {} and {}", data.ny, data.nu);
            return Err(Error::argument("output, input", format!("{i}, {j}"), &has));
        }
        let (G, radius) = data.column(i, j);
        let integrating = matches!(structure, Structure::Process(code) if code.integrating);
        let known = |k: &usize| radius.as_ref().is_none_or(|r| r[*k].is_finite());
        let kept: Vec<usize> =
            (0..G.len()).filter(|k| known(k) && !(integrating && data.w[*k] == 0.0)).collect();
        let sds: Option<Vec<f64>> = radius.map(|r| kept.iter().map(|&k| r[k]).collect());
        // A disc without extent would weigh without bound.
        let least = sds.iter().flatten().fold(0.0f64, |a, b| a.max(*b)) * 1e-6;
        let weight = match sds.filter(|_| least > 0.0) {
            Some(sds) => sds.iter().map(|r| crate::model::disc() * 2f64.sqrt() / r.max(least)).collect(),
            None => vec![1.0; kept.len()],
        };
        let pick = |k: &usize| G[*k];
        Ok(Points {
            w: kept.iter().map(|&k| data.w[k]).collect(),
            G: kept.iter().map(pick).collect(),
            weight,
            Ts: data.Ts,
        })
    }

    /// Weighted squared distance of a response.
    fn cost(&self, G: &[Complex<f64>]) -> f64 {
        self.G.iter().zip(G).zip(&self.weight).map(|((a, b), w)| (a - b).norm_sqr() * w * w).sum()
    }

    /// Frequency at which the points weigh, rad/s.
    fn centre(&self) -> f64 {
        let power = |k: usize| self.G[k].norm_sqr() * self.weight[k].powi(2);
        let (sum, moment) = (0..self.w.len())
            .fold((0.0, 0.0), |(s, m), k| (s + power(k), m + power(k) * self.w[k] * self.w[k]));
        (moment / sum).sqrt()
    }

    /// Dead times to try, s: half a radian apart at the highest frequency that weighs a twentieth of the most, later
    /// ones a share apart, up to where the phase between neighbours turns by pi.
    fn delays(&self) -> Vec<f64> {
        let size = |k: usize| self.G[k].norm() * self.weight[k];
        let n = self.w.len();
        let most = (0..n).map(size).fold(0.0, f64::max);
        let top = (0..n).rev().find(|&k| size(k) >= 0.05 * most).map_or(1.0, |k| self.w[k]);
        let apart = (self.w[n - 1] - self.w[0]) / (n.max(2) - 1) as f64;
        let longest = std::f64::consts::PI / apart;
        let next = |L: &f64| Some(L + (0.5 / top).max(0.03 * L)).filter(|L| *L < longest);
        std::iter::successors(Some(0.0), next).take(DELAYS).collect()
    }
}

/// The problem of a family for the descent.
struct Search<'f, F>(&'f F);

impl<F: Family> Residuals for Search<'_, F> {
    fn linearise(&mut self, x: &[f64]) -> Option<Triangle> {
        let (G, columns) = self.0.response(x)?;
        let (points, n) = (self.0.points(), x.len());
        let rows = (0..G.len()).flat_map(|k| {
            let weight = points.weight[k];
            let left = points.G[k] - G[k];
            let row = |part: fn(&Complex<f64>) -> f64| -> Vec<f64> {
                columns.iter().map(|c| part(&c[k]) * weight).chain([part(&left) * weight]).collect()
            };
            [row(|z| z.re), row(|z| z.im)]
        });
        let rows: Vec<Vec<f64>> = rows.collect();
        Some(Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice)))
    }

    fn project(&self, x: &mut [f64]) {
        self.0.project(x);
    }

    fn exact(&self) -> f64 {
        let points = self.0.points();
        1e-26 * points.G.iter().zip(&points.weight).map(|(g, w)| g.norm_sqr() * w * w).sum::<f64>()
    }
}

fn fitted<F: Family>(family: &F, share: f64) -> Result<Fit> {
    let points = family.points();
    let starts = family.starts();
    let (n, rows) = (starts.first().map_or(1, Vec::len), 2 * points.w.len());
    if rows <= n {
        return Err(Error::new("X03", format!("{} points are fitted by {n} parameters", points.w.len()))
            .measured(points.w.len() as f64, 0.5 * n as f64)
            .remedy("give more frequencies, or fit fewer parameters"));
    }
    let ends = starts.into_iter().filter_map(|x| minimise(&mut Search(family), x));
    let best = ends.min_by(|a, b| a.cost.total_cmp(&b.cost)).ok_or_else(no_model)?;
    summary(family, &best, rows, share)
}

fn summary<F: Family>(family: &F, best: &Minimum, rows: usize, share: f64) -> Result<Fit> {
    let n = best.theta.len();
    let columns: Vec<usize> = (0..n).collect();
    let solution = solve(&best.triangle, &columns, n, RANK_TOLERANCE).map_err(|e| {
        Error::new("X10", "the structure is too large: a smaller one fits these points as well")
            .at(Place::column("G"))
            .count(e.dependent.len())
            .measured(e.ratio, RANK_TOLERANCE)
            .remedy("ask for a lag, a zero or a coefficient less, or measure over more frequencies")
    })?;
    let s2 = best.cost / (rows - n) as f64 / share;
    let (model, named, J) = family.named(&best.theta);
    let P = congruence(&J, |a, b| solution.inverse_gram[a * n + b] * s2);
    let (names, theta): (Vec<String>, Vec<f64>) = named.into_iter().unzip();
    let sd = standard_deviations(&P, theta.len());
    Fit {
        notes: doubts(&model, &names, &theta, &sd),
        expected_digits: vec![15.0 + solution.ratio.log10(); theta.len()],
        model,
        theta,
        P,
        names,
        offset: 0.0,
        x0: Vec::new(),
        N: rows / 2,
        loss: best.cost / rows as f64,
        status: if best.converged { Status::Converged } else { Status::NotConverged },
        intervals: Vec::new(),
        plants: Vec::new(),
        sampled: None,
    }
    .finite()
}

fn doubts(model: &Model, names: &[String], theta: &[f64], sd: &[f64]) -> Vec<Note> {
    let unstable = model.poles().into_iter().any(|(re, im)| match model {
        Model::Poly(_) => re.hypot(im) > 1.0,
        _ => re > 0.0,
    });
    let unsure = |k: usize| theta[k] != 0.0 && sd[k] > theta[k].abs();
    let unsure: Vec<String> = (0..theta.len()).filter(|&k| unsure(k)).map(|k| names[k].clone()).collect();
    let unstable = unstable.then(|| {
        Note::warning("M02", "the fitted model has an unstable pole")
            .remedy("ask for fewer coefficients, or weigh fewer frequencies")
    });
    let unsure = (!unsure.is_empty()).then(|| {
        Note::warning("X10", format!("less sure than their size: {}", unsure.join(", ")))
            .count(unsure.len())
            .remedy("a smaller structure, or more frequencies around the corner")
    });
    unstable.into_iter().chain(unsure).collect()
}

fn no_model() -> Error {
    Error::new("N05", "no model of this structure comes near the points")
        .remedy("look at them with plot.frequency, or ask for another structure")
}
