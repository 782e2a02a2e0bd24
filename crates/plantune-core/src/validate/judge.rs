//! The polynomial model as judge of the process model: does a richer structure see more?
//!
//! A process model is what a controller is tuned on; the polynomial model that is trusted most is not bound
//! to its shape. Where the latter simulates fresh data clearly better, or needs another delay, the process
//! model is an approximation, and its band is widened by what it leaves unexplained; in closed loop also by
//! what feedback moved ([`Feedback`]).

use super::feedback::{Feedback, biased};
use crate::limits::Limits;
use crate::note::{Note, Place};

/// How a model does on fresh data.
#[derive(Clone, Copy, Debug)]
pub struct Scores {
    /// Simulation fit, %.
    pub fit: f64,
    /// Root mean squared simulation error.
    pub rmse: f64,
    /// Factor by which correlated residuals widen a standard deviation.
    pub widening: f64,
}

/// The polynomial model that judges.
#[derive(Clone, Debug)]
pub struct Rival {
    /// What it is called.
    pub name: String,
    /// How it does on the same rows.
    pub scores: Scores,
    /// Its delay, samples.
    pub nk: usize,
    /// In closed loop, both models on the same rows, if the noise model of this one stays true there.
    pub feedback: Option<Feedback>,
}

/// A delay with its standard deviation and the sample time, seconds.
#[derive(Clone, Copy, Debug)]
pub struct Delay {
    /// Dead time of the process model, s.
    pub L: f64,
    /// Its standard deviation, s.
    pub sd: f64,
    /// Sample time, s.
    pub Ts: f64,
}

/// Factor for the standard deviations of the process model, and why.
pub fn judge(process: &Scores, delay: Delay, rival: Option<&Rival>, limits: &Limits) -> (f64, Vec<Note>) {
    let (seen_more, mut notes) =
        rival.map_or((1.0, Vec::new()), |rival| compared(process, delay, rival, limits));
    let factor = process.widening * seen_more;
    if factor > 1.0 {
        notes.push(
            Note::info(
                "V05",
                format!(
                    "standard deviations are widened {factor:.2} times for what the model leaves unexplained"
                ),
            )
            .measured(factor, 1.0),
        );
    }
    (factor, notes)
}

/// Factor for what the polynomial model sees and the process model does not.
fn compared(process: &Scores, delay: Delay, rival: &Rival, limits: &Limits) -> (f64, Vec<Note>) {
    let Rival { name, scores: poly, nk, feedback } = rival;
    let mut notes = Vec::new();
    let mut factor = 1.0;
    if poly.fit - process.fit > limits.V03 {
        factor *= (process.rmse / poly.rmse).max(1.0);
        notes.push(
            Note::warning(
                "V03",
                format!(
                    "a polynomial model, {name}, simulates fresh data better: {:.1} % against {:.1} %",
                    poly.fit, process.fit
                ),
            )
            .measured(poly.fit - process.fit, limits.V03)
            .remedy("the plant is of higher order, or its level moves: tune with more margin"),
        );
    }
    let apart = (delay.L / delay.Ts - (*nk as f64 - 1.0)).abs();
    let allowed = limits.V04 + 2.0 * delay.sd * process.widening / delay.Ts;
    if apart > allowed {
        let of_polynomial = (*nk as f64 - 1.0) * delay.Ts;
        factor *= 1.0 + (apart - allowed) * delay.Ts / delay.L.max(delay.Ts);
        notes.push(
            Note::warning(
                "V04",
                format!(
                    "a polynomial model, {name}, has another delay: {of_polynomial:.4} s against {:.4} s",
                    delay.L
                ),
            )
            .at(Place::column("L"))
            .measured(apart, allowed)
            .remedy("part of L stands for lags that the process model does not show"),
        );
    }
    let so_far = (process.widening, delay.Ts);
    if let Some((moved, note)) = feedback.as_ref().and_then(|f| biased(f, name, so_far, limits)) {
        factor *= moved;
        notes.push(note);
    }
    (factor, notes)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Scores = Scores { fit: 90.0, rmse: 0.1, widening: 1.0 };
    const DELAY: Delay = Delay { L: 0.4, sd: 0.0, Ts: 0.1 };

    fn judged(process: Scores, poly: Scores, delay: Delay, nk: usize) -> (f64, Vec<&'static str>) {
        let rival = Rival { name: "ARX".into(), scores: poly, nk, feedback: None };
        let (factor, notes) = judge(&process, delay, Some(&rival), &Limits::default());
        (factor, notes.iter().map(|n| n.code).collect())
    }

    #[test]
    fn models_that_agree_change_nothing() {
        assert_eq!(judged(GOOD, GOOD, DELAY, 5), (1.0, vec![]));
    }

    #[test]
    fn a_better_polynomial_widens_by_the_ratio_of_the_errors() {
        let worse = Scores { fit: 60.0, rmse: 0.4, widening: 1.0 };
        let (factor, codes) = judged(worse, GOOD, DELAY, 5);
        assert!((factor - 4.0).abs() < 1e-12);
        assert_eq!(codes, ["V03", "V05"]);
    }

    #[test]
    fn a_worse_polynomial_says_nothing() {
        assert_eq!(judged(GOOD, Scores { fit: 60.0, rmse: 0.4, widening: 3.0 }, DELAY, 5), (1.0, vec![]));
    }

    #[test]
    fn without_a_polynomial_model_the_residuals_alone_widen() {
        let coloured = Scores { widening: 1.7, ..GOOD };
        let (factor, notes) = judge(&coloured, DELAY, None, &Limits::default());
        assert_eq!((factor, notes.len(), notes[0].code), (1.7, 1, "V05"));
    }

    #[test]
    fn the_widening_of_the_residuals_is_kept() {
        let coloured = Scores { widening: 1.7, ..GOOD };
        assert_eq!(judged(coloured, GOOD, DELAY, 5), (1.7, vec!["V05"]));
    }

    #[test]
    fn delays_that_differ_beyond_their_uncertainty_widen() {
        let (factor, codes) = judged(GOOD, GOOD, DELAY, 1);
        assert!(factor > 1.0);
        assert_eq!(codes, ["V04", "V05"]);
        let unsure = Delay { sd: 0.2, ..DELAY };
        assert_eq!(judged(GOOD, GOOD, unsure, 1), (1.0, vec![]));
    }
}
