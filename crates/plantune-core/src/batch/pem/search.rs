//! The least of the minima that many starts lead to.
//!
//! Output errors and ARMAX begin at ARX; only where the minimum leaves something that further lags explain do other
//! starts get their turn. A noise model with a `D` has so many minima that all starts are ranked by their cost,
//! and the best are followed.

use super::predictor::Predictor;
use super::starts;
use crate::linalg::{Minimum, Residuals, minimise};

/// Share by which a cost must be lower to count as another minimum.
const LOWER: f64 = 1e-9;

/// Ranked starts that are followed.
const FOLLOWED: usize = 4;

/// The best parameters, and the initial states that belong to them in the predictor.
pub(super) fn global_minimum(predictor: &mut Predictor) -> Option<Minimum> {
    let mut search = Search { best: None, last: false };
    if !predictor.orders().has_many_minima() {
        for start in starts::METHODS {
            let Some(theta) = start(predictor) else { continue };
            search.follow(predictor, theta);
            if search.explains_all(predictor) {
                return search.end(predictor);
            }
        }
    }
    for theta in ranked(predictor).into_iter().take(FOLLOWED) {
        search.follow(predictor, theta);
    }
    search.end(predictor)
}

/// The other starts, least cost first.
fn ranked(predictor: &mut Predictor) -> Vec<Vec<f64>> {
    let starts = starts::others(predictor);
    let mut costs: Vec<(f64, Vec<f64>)> =
        starts.into_iter().filter_map(|theta| predictor.completed(theta)).collect();
    costs.sort_by(|a, b| a.0.total_cmp(&b.0));
    costs.into_iter().map(|(_, theta)| theta).collect()
}

struct Search {
    best: Option<Minimum>,
    /// Whether the last descent led to it.
    last: bool,
}

impl Search {
    fn follow(&mut self, predictor: &mut Predictor, theta: Vec<f64>) {
        let theta = predictor.approach(theta);
        predictor.restart();
        let Some(minimum) = minimise(predictor, theta) else { return };
        self.last = self.best.as_ref().is_none_or(|best| minimum.cost < best.cost * (1.0 - LOWER));
        if self.last {
            self.best = Some(minimum);
        }
    }

    fn explains_all(&self, predictor: &mut Predictor) -> bool {
        self.best.as_ref().is_some_and(|best| best.converged && predictor.explains_all(best))
    }

    fn end(self, predictor: &mut Predictor) -> Option<Minimum> {
        let best = self.best?;
        if !self.last {
            predictor.restart(); // The states are those of another descent.
            predictor.linearise(&best.theta);
        }
        Some(best)
    }
}
