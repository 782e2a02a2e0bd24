//! Whether feedback biases the process model: its gain and time constant beside those of a noise model that
//! stays true in closed loop.
//!
//! In closed loop the input holds past noise, and a model whose errors are not that noise takes part of it
//! for an answer of the plant: output errors and process models are biased, the more the less the loop is
//! driven, and may even simulate better for it. ARX and ARMAX with white errors are not. Of two estimates
//! from the same rows, one of them efficient, the difference has less variance than the worse of them
//! (Hausman 1978), so that one is the yardstick.
//!
//! The time constant of either is that of a first-order lag through 28.3 and 63.2 % of its step response,
//! `T = 1.5 (t63 - t28)`. Source 001, 3.5.6; Ljung 1999, 13.4.

use crate::batch::standard_deviations;
use crate::limits::Limits;
use crate::model::Model;
use crate::note::{Note, Place, rounded};

/// Most rows of a step response.
const MOST_ROWS: usize = 100_000;

/// Time constants of the process model within which the step response is looked at.
const SPAN: f64 = 8.0;

/// Share of a gain or time constant that is too small to be called a bias.
const SMALL: f64 = 0.01;

/// A model with the covariance of its parameters.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// The model.
    pub model: Model,
    /// Covariance, its parameters first.
    pub P: Vec<f64>,
}

/// The process model and the judge `name`, both fitted to the same rows.
#[derive(Clone, Debug)]
pub struct Feedback {
    /// First order plus dead time.
    pub process: Estimated,
    /// A model whose noise feedback does not change.
    pub poly: Estimated,
}

/// V11 and the factor for what feedback moved; `widening` is that of the process model so far.
pub(super) fn biased(
    Feedback { process, poly }: &Feedback,
    name: &str,
    (widening, Ts): (f64, f64),
    limits: &Limits,
) -> Option<(f64, Note)> {
    let times = grid(&process.model, Ts)?;
    let [own, other] = [process, poly].map(|estimated| quantities(estimated, &times));
    let apart = |i: usize| -> Option<(f64, usize)> {
        let ((x, sd), (of_poly, sd_of_poly)) = (own[i]?, other[i]?);
        let sd = (sd * widening).max(sd_of_poly);
        let apart = (x - of_poly).abs();
        (apart > SMALL * of_poly.abs() && sd > 0.0).then_some((apart / sd, i))
    };
    let (apart, i) = (0..2).filter_map(apart).max_by(|a, b| a.0.total_cmp(&b.0))?;
    if !(apart > limits.V11 && apart.is_finite()) {
        return None;
    }
    let (what, column) = [("gain", "K"), ("time constant", "T")][i];
    let [own, of_poly] = [own, other].map(|values| values[i].map_or(f64::NAN, |(x, _)| rounded(x)));
    let note = Note::warning(
        "V11",
        format!(
            "closed loop: the process model is biased, its {what} is {own} against {of_poly} of {name}, \
             whose noise model takes up the feedback"
        ),
    )
    .at(Place::column(column))
    .measured(apart, limits.V11)
    .remedy("move the set point by more, or add steps at the controller's output");
    Some(((1.0 + apart * apart).sqrt(), note))
}

/// Sample times that hold the step response of a process model.
fn grid(process: &Model, Ts: f64) -> Option<Vec<f64>> {
    let Model::Process(m) = process else { return None };
    let rows = ((m.L + SPAN * m.T.iter().sum::<f64>()) / Ts).ceil();
    (rows < MOST_ROWS as f64).then(|| (0..=rows as usize).map(|k| k as f64 * Ts).collect())
}

/// Gain and time constant, each with its standard deviation by the delta rule.
fn quantities(Estimated { model, P }: &Estimated, times: &[f64]) -> [Option<(f64, f64)>; 2] {
    let theta = model.theta();
    let sds = standard_deviations(P, theta.len());
    let (n, size) = (theta.len(), P.len().isqrt());
    let moved = |i: usize, step: f64| {
        let mut theta = theta.clone();
        theta[i] += step;
        values(&model.with_theta(&theta), times)
    };
    let steps: Vec<f64> = sds.iter().map(|sd| 0.01 * sd).collect();
    let around: Vec<_> = (0..n).map(|i| (moved(i, steps[i]), moved(i, -steps[i]))).collect();
    let at = values(model, times);
    [0, 1].map(|which| {
        let slope = |i: usize| Some((around[i].0[which]? - around[i].1[which]?) / (2.0 * steps[i]));
        let gradient: Vec<f64> = (0..n).map(slope).collect::<Option<_>>()?;
        let rows = gradient.iter().enumerate().map(|(i, left)| {
            left * gradient.iter().enumerate().map(|(j, right)| P[i * size + j] * right).sum::<f64>()
        });
        let sd = rows.sum::<f64>().sqrt();
        sd.is_finite().then_some((at[which]?, sd))
    })
}

/// Gain and time constant of the sampled step response.
fn values(model: &Model, times: &[f64]) -> [Option<f64>; 2] {
    let gain = model.dc_gain()[0];
    if !gain.is_finite() {
        return [None, None];
    }
    let y = model.step_response(0, times);
    let reaches = |share: f64| {
        let k = y.iter().position(|y| y / gain >= share)?.checked_sub(1)?;
        let part = (share * gain - y[k]) / (y[k + 1] - y[k]);
        Some(times[k] + part * (times[k + 1] - times[k]))
    };
    let T = || Some(1.5 * (reaches(1.0 - (-1.0_f64).exp())? - reaches(1.0 - (-1.0_f64 / 3.0).exp())?));
    [Some(gain), T()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Fopdt, PolyModel};

    const TS: f64 = 0.1;

    fn process(K: f64, T: f64, sd: f64) -> Estimated {
        let model = Model::from(Fopdt { K, T, L: 0.2 });
        Estimated { model, P: vec![sd * sd, 0.0, 0.0, 0.0, sd * sd, 0.0, 0.0, 0.0, 1e-6] }
    }

    /// `2 / (1.5 s + 1)` sampled, with `sd` on both parameters.
    fn poly(sd: f64) -> Estimated {
        let a = (-TS / 1.5_f64).exp();
        let model = PolyModel::arx(vec![1.0, -a], vec![vec![2.0 * (1.0 - a)]], vec![3], TS);
        Estimated { model: Model::Poly(model), P: vec![sd * sd, 0.0, 0.0, sd * sd] }
    }

    fn judged(process: Estimated, poly: Estimated, widening: f64) -> Option<(f64, &'static str)> {
        let found = biased(&Feedback { process, poly }, "ARX", (widening, TS), &Limits::default());
        found.map(|(factor, note)| (factor, if note.text.contains("its gain") { "K" } else { "T" }))
    }

    #[test]
    fn a_time_constant_and_its_deviation_are_those_of_the_lag() {
        let times = grid(&process(2.0, 1.5, 0.1).model, TS).expect("short");
        let [gain, T] = quantities(&process(2.0, 1.5, 0.1), &times).map(|q| q.expect("a lag"));
        assert!((gain.0 - 2.0).abs() < 1e-12 && (gain.1 - 0.1).abs() < 1e-9, "{gain:?}");
        // Linear between the samples.
        assert!((T.0 - 1.5).abs() < 2e-3 && (T.1 - 0.1).abs() < 2e-3, "{T:?}");
        // K = b/(1 + a1): dK/da1 = -K/(1 + a1), dK/db = 1/(1 + a1); T = -Ts/ln a: dT/da = Ts/(a ln^2 a).
        let a = (-TS / 1.5_f64).exp();
        let [gain, T] = quantities(&poly(1e-3), &times).map(|q| q.expect("a lag"));
        assert!((gain.1 - 1e-3 * 5.0_f64.sqrt() / (1.0 - a)).abs() < 1e-4 * gain.1, "{gain:?}");
        let sd = 1e-3 * TS / (a * a.ln().powi(2));
        assert!((T.0 - 1.5).abs() < 2e-3 && (T.1 - sd).abs() < 0.05 * sd, "{T:?}");
    }

    #[test]
    fn models_that_agree_are_not_called_biased() {
        assert_eq!(judged(process(2.0, 1.5, 1e-9), poly(1e-9), 1.0), None);
        assert_eq!(judged(process(2.0 * 1.005, 1.5, 1e-9), poly(1e-9), 1.0), None);
    }

    #[test]
    fn the_quantity_further_apart_is_named_and_widens() {
        let (factor, what) = judged(process(1.7, 1.5, 0.1), poly(1e-4), 1.0).expect("3 sd");
        assert_eq!(what, "K");
        assert!((factor - 10.0_f64.sqrt()).abs() < 1e-6, "{factor}");
        assert_eq!(judged(process(2.1, 1.2, 0.1), poly(1e-4), 1.0).expect("3 sd").1, "T");
    }

    #[test]
    fn what_either_does_not_know_is_no_bias() {
        assert_eq!(judged(process(1.7, 1.5, 0.1), poly(1e-4), 2.0), None);
        assert_eq!(judged(process(1.7, 1.5, 0.1), poly(6e-3), 1.0), None);
        let integrator = PolyModel::arx(vec![1.0, -1.0], vec![vec![0.1]], vec![1], TS);
        let poly = Estimated { model: Model::Poly(integrator), P: vec![1e-6; 4] };
        assert_eq!(judged(process(1.7, 1.5, 0.1), poly, 1.0), None);
    }
}
