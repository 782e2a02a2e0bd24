//! Plays and their creep from a record: non-negative least squares on every play and every play through every time
//! constant.
//!
//! ```text
//! min over w >= 0, c >= 0, O:   sum (y - O - sum w_i z_i - sum c_ki s_ki)^2
//! r_i = i max|x| / n            tau_k evenly spaced in log t from 4 Ts to half the record
//! ```
//!
//! How many time constants there are is judged on the half of the rows not used.

use super::{Creep, Creeping, check_Ts};
use crate::error::{Error, Result};
use crate::hysteresis::misfit::rms;
use crate::linalg::{Block, Triangle, nnls, solve};

/// Pivots below this share of the largest do not count.
const TOLERANCE: f64 = 1e-12;

/// How to fit.
#[derive(Clone, Debug)]
pub struct CreepSettings {
    /// Half widths of the plays; or none, and then `n`.
    pub r: Option<Vec<f64>>,
    /// Number of plays, evenly spaced up to the largest `|x|`.
    pub n: usize,
    /// Time constants, s; or none, and then as many as the record supports.
    pub tau: Option<Vec<f64>>,
    /// Sample time, s.
    pub Ts: f64,
    /// Whether O is fitted.
    pub offset: bool,
}

/// The fitted model and how far it is off.
#[derive(Clone, Debug)]
pub struct CreepFit {
    /// The model.
    pub model: Creep,
    /// Standard deviations: `w`, `c` row by row, offset; 0 of what stands at 0.
    pub sd: Vec<f64>,
    /// Numbers of time constants tried, and the rms error of each on rows not used.
    pub tried: Vec<(usize, f64)>,
    /// Errors over all rows.
    pub errors: Vec<f64>,
}

/// Fits the model to a record that begins at rest at 0.
pub fn identify_creep(x: &[f64], y: &[f64], settings: &CreepSettings) -> Result<CreepFit> {
    let most = check(x, y, settings)?;
    let even = || (0..settings.n).map(|i| i as f64 * most / settings.n as f64).collect();
    let r: Vec<f64> = settings.r.clone().unwrap_or_else(even);
    let mut tried = Vec::new();
    let tau = match &settings.tau {
        Some(tau) => tau.clone(),
        None => {
            let half = x.len() / 2;
            for tau in rows_of_tau(x.len(), settings.Ts) {
                let (model, _) = fit(&x[..half], &y[..half], &r, &tau, settings)?;
                tried.push((tau, rms(&errors(&model, x, y)[half..])));
            }
            tried.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(Vec::new(), |best| best.0.clone())
        }
    };
    let (model, sd) = fit(x, y, &r, &tau, settings)?;
    let tried = tried.into_iter().map(|(tau, rms)| (tau.len(), rms)).collect();
    Ok(CreepFit { errors: errors(&model, x, y), model, sd, tried })
}

/// Largest `|x|`.
fn check(x: &[f64], y: &[f64], settings: &CreepSettings) -> Result<f64> {
    check_Ts(settings.Ts)?;
    if x.len() != y.len() {
        return Err(Error::argument("y", format!("of {} rows", y.len()), &format!("of {}, as `x`", x.len())));
    }
    if settings.r.is_none() && settings.n == 0 {
        return Err(Error::argument("n", 0, "1 or more"));
    }
    if x.len() < 20 {
        return Err(Error::new("X03", format!("{} rows", x.len())).remedy("record 20 rows or more"));
    }
    let most = x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if most == 0.0 {
        return Err(Error::new("X01", "`x` is 0 throughout").remedy("record the output over a moving input"));
    }
    Ok(most)
}

/// None, one, two, ... up to two per decade.
fn rows_of_tau(N: usize, Ts: f64) -> Vec<Vec<f64>> {
    let (fastest, slowest) = (4.0 * Ts, 0.5 * N as f64 * Ts);
    let most = (2.0 * (slowest / fastest).log10()).ceil() as usize + 1;
    let spaced = |n: usize| -> Vec<f64> {
        let part = |k: usize| if n == 1 { 0.5 } else { k as f64 / (n - 1) as f64 };
        (0..n).map(|k| fastest * (slowest / fastest).powf(part(k))).collect()
    };
    (0..=most.max(1)).map(spaced).collect()
}

fn fit(x: &[f64], y: &[f64], r: &[f64], tau: &[f64], settings: &CreepSettings) -> Result<(Creep, Vec<f64>)> {
    let (n, all) = (r.len(), r.len() * (tau.len() + 1));
    let zero = |n| vec![0.0; n];
    let empty = Creep {
        r: r.to_vec(),
        w: zero(n),
        tau: tau.to_vec(),
        c: zero(all - n),
        Ts: settings.Ts,
        offset: 0.0,
    };
    empty.check()?;
    let triangle = triangle(x, y, &empty);
    let columns: Vec<usize> = (0..all + usize::from(settings.offset)).collect();
    let free: Vec<bool> = columns.iter().map(|c| *c == all).collect();
    let found = nnls(&triangle, &columns, &free, all + 1, &[]);
    let mut sd = vec![0.0; all + 1];
    if let Ok(inside) = solve(&triangle, &found.inside, all + 1, TOLERANCE) {
        let k = found.inside.len();
        let variance = found.rss / x.len().saturating_sub(k).max(1) as f64;
        for (p, &j) in found.inside.iter().enumerate() {
            sd[j] = (variance * inside.inverse_gram[p * k + p]).sqrt();
        }
    }
    let offset = if settings.offset { found.x[all] } else { 0.0 };
    Ok((Creep { w: found.x[..n].to_vec(), c: found.x[n..all].to_vec(), offset, ..empty }, sd))
}

/// Columns: z (n), s (K, n), 1, y.
fn triangle(x: &[f64], y: &[f64], empty: &Creep) -> Triangle {
    let mut at_work = Creeping::new(empty);
    let (n, all) = (empty.r.len(), at_work.state.len());
    let (mut triangle, mut block) = (Triangle::new(all + 2), Block::new(all + 2));
    let mut row = vec![0.0; all + 2];
    for (&x, &y) in x.iter().zip(y) {
        row[n..all].copy_from_slice(&at_work.state[n..]);
        at_work.play(x);
        row[..n].copy_from_slice(&at_work.state[..n]);
        (row[all], row[all + 1]) = (1.0, y);
        at_work.creep();
        block.push(&row);
    }
    triangle.absorb(&mut block);
    triangle
}

fn errors(model: &Creep, x: &[f64], y: &[f64]) -> Vec<f64> {
    model.start().run(x).iter().zip(y).map(|(f, y)| y - f).collect()
}
