//! The polynomial family by prediction errors: `A y = sum_i B_i/F_i u_i(t - nk_i) + d + C/D e`.
//!
//! One predictor and its gradient ([`predictor`]) serve every structure; output errors (`F` alone) and ARMAX
//! (`A` and `C`) are settings of it. The sum of squared errors is minimised by Levenberg-Marquardt
//! ([`crate::linalg::minimise`]) on the triangle of the gradient's columns: from their products while they are
//! far from dependent, else by QR. `C` and `F` are kept stable by reflection. [`search`] says where the descents
//! begin.
//!
//! Source 001, 3.5.6 and 3.5.7; Ljung 1999, 7.2 and 10.2.

mod layout;
mod lines;
mod predictor;
mod rows;
mod search;
mod starts;

use self::predictor::Predictor;
pub(super) use self::rows::{refit, rows};
use self::search::global_minimum;
use super::cancellation::cancellation;
use super::fit::{Fit, Status};
use super::least_squares::{digits, rounding};
use super::orders::{Orders, copied_input, too_short};
use super::poly_fit::{Scaled, plant_notes};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{Minimum, RankDeficient, Solution, solve};
use crate::note::{Note, Place};
use crate::poly::roots;
use crate::record::Record;
use crate::sim::Start;

/// Modulus of a root from which it lies on the unit circle.
const BESIDE: f64 = 1.0 - 1e-6;

/// What may be set.
#[derive(Clone, Copy, Debug)]
pub struct PemOptions {
    /// Whether an offset is estimated.
    pub offset: bool,
    /// Whether the state before each stretch is estimated, or all signals before it are zero.
    pub start: Start,
}

/// Fits the orders to the record's only output.
///
/// Orders that are too high (X10) are refused with lower ones that the data support, if there are any.
pub fn pem(rec: &Record, orders: &Orders, options: PemOptions, limits: &Limits) -> Result<Fit> {
    orders.check(rec, options.offset, limits)?;
    // Paths of their own poles would be told apart, but not by anything that the record shows.
    copied_input(rec).map_or(Ok(()), Err)?;
    fitted(rec, orders, options, limits).map_err(|refusal| {
        if refusal.code() != "X10" {
            return refusal;
        }
        match orders.lower().find(|lower| fitted(rec, lower, options, limits).is_ok()) {
            Some(lower) => refusal.remedy(format!("ask for {lower}")),
            None => refusal,
        }
    })
}

/// The same without advice.
fn fitted(rec: &Record, orders: &Orders, options: PemOptions, limits: &Limits) -> Result<Fit> {
    let mut predictor = Predictor::new(rec, orders, options.offset, options.start);
    let all = orders.n() + usize::from(options.offset);
    let N = predictor.N();
    if N <= all + predictor.states() {
        return Err(too_short(N, all + predictor.states()));
    }
    let best = global_minimum(&mut predictor).ok_or_else(|| over_ordered(rec, None, limits))?;
    let every: Vec<usize> = (0..all).collect();
    let solution =
        solve(&best.triangle, &every, all, limits.X08).map_err(|e| over_ordered(rec, Some(&e), limits))?;
    let scaled = Scaled {
        theta: &best.theta,
        inverse_gram: &solution.inverse_gram,
        rss: best.cost,
        N,
        states: predictor.states(),
        u: &predictor.scale_u,
        y: predictor.scale_y,
    };
    let mut fit = scaled.fit(orders, rec.Ts, limits);
    fit.notes.extend(cancellation(&fit, orders, false, limits));
    fit.names = orders.names(rec);
    fit.expected_digits = digits(&uncertain_by(&best, &solution)[..orders.n()], &best.theta);
    fit.x0 = predictor.x0();
    let of_plant = plant_notes(rec, &fit, limits);
    fit.notes.extend(of_plant);
    fit.status = if best.converged { Status::Converged } else { Status::NotConverged };
    if !best.converged {
        fit.notes.push(unfinished(&orders.model(&best.theta[..orders.n()], rec.Ts).C));
    }
    fit.finite()
}

/// N05; beside the circle a `C` that goes on would leave no stable predictor.
fn unfinished(C: &[f64]) -> Note {
    if roots(C).iter().any(|(re, im)| re.hypot(*im) > BESIDE) {
        let text =
            "the search stopped where C has a root on the unit circle, beyond which no predictor is stable";
        return Note::warning("N05", text).remedy("ask for a lower nc, or record longer");
    }
    let text = "the search stopped before the gradient test passed";
    Note::warning("N05", text).remedy("ask for lower orders, or record longer")
}

/// What rounding leaves open of each parameter, and the longest step that the slope left at the end allows.
fn uncertain_by(best: &Minimum, step: &Solution) -> Vec<f64> {
    let n = best.theta.len();
    let left = best.slope * best.cost.sqrt();
    let rounding = rounding(&best.triangle, step, &best.theta, best.cost);
    rounding.iter().enumerate().map(|(i, r)| r + left * step.inverse_gram[i * n + i].sqrt()).collect()
}

/// X10: parameters that the data do not tell apart.
fn over_ordered(rec: &Record, refusal: Option<&RankDeficient>, limits: &Limits) -> Error {
    let text = "the orders are too high: poles and zeros cancel, and parameters cannot be told apart";
    let error = Error::new("X10", text).at(Place::column(rec.input_name(0)));
    match refusal {
        Some(refusal) => error.count(refusal.dependent.len()).measured(refusal.ratio, limits.X08),
        None => error, // not even a start was found
    }
    .remedy("ask for lower orders")
}
