//! The polynomial model as judge of the process model: does a richer structure see more?
//!
//! A process model is what a controller is tuned on; a polynomial model of free order is not bound to
//! its shape. Where the latter simulates fresh data clearly better, or needs another delay, the process
//! model is an approximation, and its band is widened by what it leaves unexplained.

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
pub fn judge(process: &Scores, poly: &Scores, delay: Delay, nk: usize, limits: &Limits) -> (f64, Vec<Note>) {
    let mut notes = Vec::new();
    let mut factor = process.widening;
    if poly.fit - process.fit > limits.V03 {
        factor *= (process.rmse / poly.rmse).max(1.0);
        notes.push(
            Note::warning(
                "V03",
                format!(
                    "a polynomial model simulates fresh data better: {:.1} % against {:.1} %",
                    poly.fit, process.fit
                ),
            )
            .measured(poly.fit - process.fit, limits.V03)
            .remedy("the plant is not first order: tune with more margin"),
        );
    }
    let apart = (delay.L / delay.Ts - (nk as f64 - 1.0)).abs();
    let allowed = limits.V04 + 2.0 * delay.sd * process.widening / delay.Ts;
    if apart > allowed {
        let of_polynomial = (nk as f64 - 1.0) * delay.Ts;
        factor *= 1.0 + (apart - allowed) * delay.Ts / delay.L.max(delay.Ts);
        notes.push(
            Note::warning(
                "V04",
                format!(
                    "a polynomial model has another delay: {of_polynomial:.4} s against {:.4} s",
                    delay.L
                ),
            )
            .at(Place::column("L"))
            .measured(apart, allowed)
            .remedy("part of L stands for lags that one time constant cannot show"),
        );
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Scores = Scores { fit: 90.0, rmse: 0.1, widening: 1.0 };
    const DELAY: Delay = Delay { L: 0.4, sd: 0.0, Ts: 0.1 };

    fn judged(process: Scores, poly: Scores, delay: Delay, nk: usize) -> (f64, Vec<&'static str>) {
        let (factor, notes) = judge(&process, &poly, delay, nk, &Limits::default());
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
