//! From a least-squares solution in scaled units to the fit of a polynomial model in the record's own.
//!
//! The constant comes back as the offset, its covariance by the delta rule.

use super::fit::{Fit, Status, standard_deviations};
use super::orders::Orders;
use super::settled;
use crate::limits::Limits;
use crate::model::derived::Covariance;
use crate::model::{Model, class_notes};
use crate::note::Note;
use crate::record::{Record, Scale};

/// Mean squared residual, of an output of at most one, that is rounding.
pub(super) const EXACT: f64 = 1e-26;

/// A solution on centred and scaled data.
pub(super) struct Scaled<'s> {
    /// Coefficients, then the constant if there is one.
    pub(super) theta: &'s [f64],
    pub(super) inverse_gram: &'s [f64],
    pub(super) rss: f64,
    pub(super) N: usize,
    /// Parameters beside `theta`: initial states.
    pub(super) states: usize,
    pub(super) u: &'s [Scale],
    pub(super) y: Scale,
}

impl Scaled<'_> {
    /// The fit without names and digits, its notes begun.
    pub(super) fn fit(&self, orders: &Orders, Ts: f64, limits: &Limits) -> Fit {
        let (n, all) = (orders.n(), self.theta.len());
        let unit = units(orders, all, self.u, self.y);
        let theta: Vec<f64> = self.theta.iter().zip(&unit).map(|(t, s)| t * s).collect();
        let s2 = self.rss / (self.N - all - self.states) as f64;
        let covariance: Vec<f64> =
            (0..all * all).map(|ij| s2 * self.inverse_gram[ij] * unit[ij / all] * unit[ij % all]).collect();
        let model = orders.model(&theta[..n], Ts);
        let (offset, P) = match theta.get(n) {
            Some(&d) => {
                let u0: Vec<f64> = self.u.iter().map(|u| u.zero).collect();
                let (O, gradient) = model.level(d, &u0, self.y.zero);
                (O, with_offset(&covariance, &gradient, all))
            }
            None => (0.0, covariance),
        };
        let mut fit = Fit {
            model: Model::Poly(model),
            theta: theta[..n].to_vec(),
            P,
            names: Vec::new(),
            offset,
            steps: Vec::new(),
            x0: Vec::new(),
            N: self.N,
            loss: self.rss / self.y.factor.powi(2) / self.N as f64,
            status: Status::Exact,
            expected_digits: Vec::new(),
            notes: Vec::new(),
            intervals: Vec::new(),
            plants: Vec::new(),
            sampled: None,
        };
        let sd = standard_deviations(&fit.P, n);
        let exact = self.rss <= EXACT * self.N as f64;
        fit.notes = doubts(&fit.theta, &sd, n, fit.N, exact, limits);
        fit
    }
}

/// What class the plant may be of (M01, M02), and whether the record shows its response whole (X07).
pub(super) fn plant_notes(rec: &Record, fit: &Fit, limits: &Limits) -> Vec<Note> {
    let Model::Poly(model) = &fit.model else { return Vec::new() };
    let P = Covariance(&fit.P);
    let inputs: Vec<&str> = (0..rec.nu).map(|i| rec.input_name(i)).collect();
    let notes = class_notes(model, &P, &inputs);
    if notes.is_empty() { settled::of_poly(rec, model, &P, limits) } else { notes }
}

/// What one scaled unit of each of `all` parameters is in the record's units.
pub(super) fn units(orders: &Orders, all: usize, u: &[Scale], y: Scale) -> Vec<f64> {
    let mut unit = vec![1.0; all];
    let mut next = orders.na;
    for (u, &nb) in u.iter().zip(&orders.nb) {
        unit[next..next + nb].fill(u.factor / y.factor);
        next += nb;
    }
    if let Some(constant) = unit.get_mut(orders.n()) {
        *constant = 1.0 / y.factor;
    }
    unit
}

/// Covariance of `theta, O` from that of `theta, d`.
pub(super) fn with_offset(covariance: &[f64], gradient: &[f64], all: usize) -> Vec<f64> {
    let n = all - 1;
    let to_offset: Vec<f64> =
        (0..all).map(|i| (0..all).map(|j| covariance[i * all + j] * gradient[j]).sum()).collect();
    let mut P = covariance.to_vec();
    for i in 0..n {
        P[i * all + n] = to_offset[i];
        P[n * all + i] = to_offset[i];
    }
    P[n * all + n] = gradient.iter().zip(&to_offset).map(|(g, c)| g * c).sum();
    P
}

/// What rows, uncertainties and residuals leave in doubt; `n` parameters share `N` rows.
pub(super) fn doubts(
    theta: &[f64],
    sd: &[f64],
    n: usize,
    N: usize,
    exact: bool,
    limits: &Limits,
) -> Vec<Note> {
    let mut notes = Vec::new();
    let per_parameter = N as f64 / n as f64;
    if per_parameter < limits.X03 {
        notes.push(
            Note::warning("X03", format!("{N} rows for {n} parameters: intervals are rough"))
                .count(N)
                .measured(per_parameter, limits.X03)
                .remedy("record longer or ask for lower orders"),
        );
    }
    let uncertain = sd.iter().zip(theta).filter(|(sd, t)| 2.0 * **sd > t.abs()).count();
    if 4 * uncertain >= theta.len() {
        notes.push(
            Note::warning(
                "X02",
                format!("{uncertain} of {} parameters are uncertain by more than their size", theta.len()),
            )
            .count(uncertain)
            .measured(uncertain as f64 / theta.len() as f64, 0.25)
            .remedy("ask for lower orders, or record with more changes of the input"),
        );
    }
    if exact || theta.iter().all(|t| *t == 0.0) {
        let text = "the residual is zero but for rounding: variances, criteria and a noise model say nothing";
        notes.push(Note::warning("N08", text));
    }
    notes
}
