//! Whether a record shows a response to its end (X07).
//!
//! ```text
//! shown = y_step(D) / K,   D from the first move of the input to the end of its segment, the longest of all
//! ```
//!
//! Below one time constant the beginning of a lag looks like a ramp of slope `K/T`: the ratio is known, `K` and `T`
//! hardly are. The time constant of a process model counts with the upper end of its interval.

use crate::limits::Limits;
use crate::model::derived::{Covariance, gain_per_time};
use crate::model::{Model, PolyModel, ProcessModel};
use crate::note::{Note, Place, rounded};
use crate::record::Record;
use crate::stats::normal_quantile;

/// Of the slowest pole; `50^n e^-50` is rounding for every order in use.
const TIME_CONSTANTS: f64 = 50.0;

/// X07 of a polynomial model, for each input.
pub(super) fn of_poly(rec: &Record, m: &PolyModel, P: &Covariance, limits: &Limits) -> Vec<Note> {
    let model = Model::Poly(m.clone());
    (0..m.B.len()).filter_map(|i| note(rec, i, &model, &model, P, i, limits)).collect()
}

/// X07 of a process model of input `i`; `P` is the covariance of its own parameters.
pub(super) fn of_process(
    rec: &Record,
    i: usize,
    plant: &ProcessModel,
    P: &Covariance,
    limits: &Limits,
) -> Option<Note> {
    if plant.integrating || plant.T.is_empty() {
        return None;
    }
    let n = plant.theta().len();
    let sd = |k: usize| P.0[k * n + k].max(0.0).sqrt();
    let mut slow = plant.clone();
    let slowest = (0..plant.T.len()).max_by(|&a, &b| plant.T[a].total_cmp(&plant.T[b]))?;
    slow.T[slowest] += normal_quantile(0.95) * sd(1 + slowest);
    note(rec, i, &plant.clone().into(), &slow.into(), P, 0, limits)
}

/// `slow` says what is shown, `model` what is told; `path` is the model's own input.
fn note(
    rec: &Record,
    i: usize,
    model: &Model,
    slow: &Model,
    P: &Covariance,
    path: usize,
    limits: &Limits,
) -> Option<Note> {
    let end = shown_for(rec, i).min(settled_after(slow, path));
    let shown = slow.step_response(path, &[end])[0] / slow.dc_gain()[path];
    if !shown.is_finite() || shown >= limits.X07 || shown < 0.0 {
        return None;
    }
    let (ratio, T) = gain_per_time(model, P, path)?;
    let K = model.dc_gain()[path];
    let half = normal_quantile(0.95) * ratio.sd;
    let text = format!(
        "the record may end {:.0} % into the response: K = {} and T = {} s are hardly told apart; K/T = {} is, 95 % {} to {}",
        100.0 * shown,
        rounded(K),
        rounded(T),
        rounded(ratio.value),
        rounded(ratio.value - half),
        rounded(ratio.value + half)
    );
    Some(
        Note::warning("X07", text)
            .at(Place::column(rec.input_name(i)))
            .measured(shown, limits.X07)
            .remedy("record until the output has settled; use K/T alone until then"),
    )
}

/// Seconds from the first move of an input to the end of its segment, the longest.
fn shown_for(rec: &Record, i: usize) -> f64 {
    let of = |s: std::ops::Range<usize>| {
        let first = s.clone().find(|&k| rec.u_at(k, i) != rec.u_at(s.start, i)).unwrap_or(s.end);
        s.end - first
    };
    rec.segments().map(of).max().unwrap_or(0) as f64 * rec.Ts
}

/// Seconds after which a sampled response has settled to rounding: a long one need not be computed to its end.
fn settled_after(model: &Model, path: usize) -> f64 {
    let Model::Poly(m) = model else { return f64::INFINITY };
    let slowest = m.poles().iter().map(|(re, im)| re.hypot(*im)).fold(0.0, f64::max);
    if slowest >= 1.0 {
        return f64::INFINITY;
    }
    (TIME_CONSTANTS / -slowest.ln() + (m.nk[path] + m.B[path].len()) as f64) * m.Ts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step at row 10 of a record of `N` rows, `T = 100` rows.
    fn said(N: usize, sd: f64) -> Option<f64> {
        let u: Vec<f64> = (0..N).map(|k| f64::from(u8::from(k >= 10))).collect();
        let rec = Record::uniform(&u, 1, &u, 1, 0.5).expect("fine");
        let plant = ProcessModel { K: 2.0, T: vec![50.0], L: 0.0, Tz: 0.0, zeta: None, integrating: false };
        let P = [0.01, 0.0, 0.0, 0.0, sd * sd, 0.0, 0.0, 0.0, 0.01];
        of_process(&rec, 0, &plant, &Covariance(&P), &Limits::default()).and_then(|n| n.measured)
    }

    #[test]
    fn less_than_a_time_constant_is_a_doubt() {
        let shown = said(10 + 51, 0.0).expect("a note");
        assert!((shown - (1.0 - (-0.51f64).exp())).abs() < 1e-12, "{shown}");
        assert_eq!(said(10 + 110, 0.0), None);
        assert!(said(10 + 110, 10.0).is_some(), "T may be 70 s");
    }
}
