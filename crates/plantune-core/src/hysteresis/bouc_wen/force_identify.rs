//! The force over a displacement from a record: variable projection of offset, `k` and alpha, from several starts.

use super::doubts;
use super::force::BoucWenForce;
use super::output_error::NU;
use super::projection::Projection;
use crate::error::{Error, Result};
use crate::hysteresis::Operator;
use crate::linalg::{Triangle, congruence, dot, residual_norm2, solve};
use crate::note::{Note, Place};
use crate::stats::f_tail;

/// Slopes that depend on the others by more than this leave a parameter free.
const TOLERANCE: f64 = 1e-9;

/// Chance at which a straight line does as well.
const CHANCE: f64 = 0.01;

/// The fitted model.
#[derive(Clone, Debug)]
pub struct ForceFit {
    /// The model.
    pub model: BoucWenForce,
    /// Standard deviations of `k alpha g d nu offset`; 0 of what was given.
    pub sd: Vec<f64>,
    /// Errors over all rows.
    pub errors: Vec<f64>,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Fits the model to a record that begins at rest at 0.
pub fn identify_force(x: &[f64], y: &[f64], nu: Option<f64>) -> Result<ForceFit> {
    let s = check(x, y, nu)?;
    // A straight way from rest at 0 to the first row.
    let path: Vec<f64> = [0.0].iter().chain(x).map(|x| x / s).collect();
    let rows = path[1..].iter().zip(y).map(|(x, y)| vec![1.0, *x, *y]).collect();
    let mut projection = Projection { rows, path, stride: 1, skip: 1, filter: None, budget: 0, nu };
    let nothing =
        || Error::new("N05", "no parameters reproduce the record").remedy("pass nu=1, or more rows");
    let found = projection.search().ok_or_else(nothing)?;
    let (c, triangle) = projection.full(&found.theta).ok_or_else(nothing)?;
    memory_shows(&triangle, found.cost, y)?;
    let shape = projection.shape(&found.theta);
    let loss = s.powf(-shape.nu);
    let model = BoucWenForce {
        offset: c[0],
        k: c[1] / s,
        alpha: c[2] / s,
        g: shape.g * loss,
        d: shape.d * loss,
        nu: shape.nu,
    };
    model.check()?;
    let errors: Vec<f64> = model.start().run(x).iter().zip(y).map(|(f, y)| y - f).collect();
    let sd = deviations(&triangle, &model, found.cost, s, y.len())?;
    let notes = doubts(&found, y.len(), model.nu, sd[4]);
    Ok(ForceFit { model, sd, errors, notes })
}

/// Standard deviations of `k alpha g d nu offset`; refuses what depends on the rest.
fn deviations(triangle: &Triangle, model: &BoucWenForce, cost: f64, s: f64, N: usize) -> Result<Vec<f64>> {
    let n = triangle.n() - 1;
    let columns: Vec<usize> = (0..n).collect();
    let solution = solve(triangle, &columns, n, TOLERANCE).map_err(|deficient| {
        let names = ["offset", "k", "alpha", "g", "d", "nu"];
        let open: Vec<&str> = deficient.dependent.iter().map(|&j| names[j]).collect();
        Error::new("X02", format!("the record does not tell {} from the rest", open.join(", ")))
            .measured(deficient.ratio, TOLERANCE)
            .remedy("let x swing so far that its loops open, or pass nu")
    })?;
    let variance = cost / N.saturating_sub(n).max(1) as f64;
    let (loss, log) = (s.powf(-model.nu), -s.ln());
    // k, alpha, g, d, nu, offset over the scaled offset, k, alpha, g, d, nu.
    let J = [
        [0.0, 1.0 / s, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0 / s, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, loss, 0.0, model.g * log],
        [0.0, 0.0, 0.0, 0.0, loss, model.d * log],
        [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ];
    let P = congruence(&J.map(|row| row[..n].to_vec()), |i, j| variance * solution.inverse_gram[i * n + j]);
    Ok((0..6).map(|i| P[i * 6 + i].sqrt()).collect())
}

/// Refuses where a straight line is as good, by an F test of zeta and its shape.
fn memory_shows(triangle: &Triangle, cost: f64, y: &[f64]) -> Result<()> {
    let n = triangle.n() - 1;
    let line = residual_norm2(triangle, &[0, 1], n, TOLERANCE);
    let (more, rest) = ((n - 2) as f64, y.len().saturating_sub(n).max(1) as f64);
    let p = f_tail((line - cost).max(0.0) / more / (cost / rest), more, rest);
    if line > 1e-24 * dot(y, y) && p <= CHANCE {
        return Ok(());
    }
    Err(Error::new("X02", "y over x is a straight line: no memory shows")
        .measured(p, CHANCE)
        .remedy("let x swing so far that its loops open"))
}

/// Largest `|x|`.
fn check(x: &[f64], y: &[f64], nu: Option<f64>) -> Result<f64> {
    if x.len() != y.len() {
        return Err(Error::new("D09", format!("x has {} rows and y has {}", x.len(), y.len()))
            .remedy("pass rows of the same instants"));
    }
    if x.len() < 20 {
        return Err(Error::new("X03", format!("{} rows", x.len())).remedy("record 20 rows or more"));
    }
    if let Some(nu) = nu.filter(|nu| !(NU.0..=NU.1).contains(nu)) {
        return Err(Error::argument("nu", nu, &format!("from {} to {}", NU.0, NU.1)));
    }
    let most = x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if most == 0.0 {
        return Err(Error::new("X01", "`x` is 0 throughout")
            .at(Place::column("x"))
            .remedy("record the output over a moving input"));
    }
    Ok(most)
}
