//! The prior with the most evidence: decay, correlation and the number of dead taps.
//!
//! The decay `lam` first on a grid of `1 - lam` from 0.5 to 0.005, then by golden sections of its logit; `rho`
//! of DC on a grid, then by a simplex. The dead taps are counted up, each count with its own best decay,
//! until the evidence is lost: a tap that is alive costs more than any count before it could gain.
//! `exp(-cost/2)`, scaled to sum 1, is the posterior of the delay. There are no starting values to choose.

use super::evidence::{Prior, Seen};
use super::kernels::Kernel;
use crate::linalg::{golden, simplex};

/// Decays on the grid.
const DECAYS: usize = 16;

/// Half the interval of `logit lam` around the best of them, and its sections.
const AROUND: f64 = 0.4;
const SECTIONS: usize = 8;

/// Correlations of DC on the grid.
const CORRELATIONS: [f64; 8] = [-0.5, 0.0, 0.3, 0.6, 0.8, 0.9, 0.97, 0.99];

/// Cost above the best at which a count of dead taps has no weight, and counts in a row that end the search.
const LOST: f64 = 60.0;
const IN_A_ROW: usize = 2;

/// Living taps at least.
const ALIVE: usize = 5;

/// The best prior of a kernel after `dead` taps.
pub(super) fn best(seen: &Seen, kernel: Kernel, dead: usize) -> Prior {
    let decays = (0..DECAYS).map(|k| 1.0 - 0.5 * 0.01f64.powf(k as f64 / (DECAYS - 1) as f64));
    let rhos: &[f64] = if kernel == Kernel::Dc { &CORRELATIONS } else { &[0.0] };
    let every = decays.flat_map(|lam| rhos.iter().map(move |&rho| (lam, rho)));
    let tried: Vec<Prior> = every.map(|(lam, rho)| seen.best_scale(kernel, dead, lam, rho)).collect();
    let coarse = most_likely(&tried);
    let fine = if kernel == Kernel::Dc { in_both(seen, coarse) } else { in_decay(seen, coarse, SECTIONS) };
    if fine.cost < coarse.cost { fine } else { coarse }
}

/// One prior per count of dead taps, from 0 on; as many as have weight, at most `most`.
pub(super) fn by_dead_taps(seen: &Seen, kernel: Kernel, most: usize) -> Vec<Prior> {
    let mut all = vec![best(seen, kernel, 0)];
    let mut least = all[0].cost;
    let most = most.min(seen.n().saturating_sub(ALIVE));
    while all.len() <= most {
        let last = all[all.len() - 1];
        let next = nearby(seen, Prior { dead: all.len(), ..last });
        least = least.min(next.cost);
        all.push(next);
        let lost = all.iter().rev().take_while(|p| p.cost > least + LOST).count();
        if lost >= IN_A_ROW {
            break;
        }
    }
    all
}

/// The one with the most evidence.
pub(super) fn most_likely(priors: &[Prior]) -> Prior {
    let best = priors[1..].iter().fold(&priors[0], |best, p| if p.cost < best.cost { p } else { best });
    *best
}

/// Weights of the priors, which sum to 1.
pub(super) fn weights(priors: &[Prior]) -> Vec<f64> {
    let least = priors.iter().map(|p| p.cost).fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> = priors.iter().map(|p| (-0.5 * (p.cost - least)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| w / sum).collect()
}

fn logit(x: f64) -> f64 {
    (x / (1.0 - x)).ln()
}

fn expit(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

fn in_decay(seen: &Seen, start: Prior, sections: usize) -> Prior {
    let at = logit(start.lam);
    let mut cost = |x: f64| seen.best_scale(start.kernel, start.dead, expit(x), start.rho).cost;
    let (x, _) = golden(&mut cost, at - AROUND, at + AROUND, sections);
    seen.best_scale(start.kernel, start.dead, expit(x), start.rho)
}

/// The vertex of a parabola through three decays around that of the count before.
fn nearby(seen: &Seen, start: Prior) -> Prior {
    let of = |x: f64| seen.best_scale(start.kernel, start.dead, expit(x), start.rho);
    let mut x = logit(start.lam);
    let [mut low, mut middle, mut high] = [x - AROUND, x, x + AROUND].map(of);
    for _ in 0..4 {
        if low.cost < middle.cost {
            x -= AROUND;
            (low, middle, high) = (of(x - AROUND), low, middle);
        } else if high.cost < middle.cost {
            x += AROUND;
            (low, middle, high) = (middle, high, of(x + AROUND));
        } else {
            break;
        }
    }
    let bend = low.cost - 2.0 * middle.cost + high.cost;
    if !(bend > 0.0) {
        return [low, middle, high].into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).unwrap_or(middle);
    }
    let vertex = of(x + (0.5 * AROUND * (low.cost - high.cost) / bend).clamp(-AROUND, AROUND));
    [low, vertex, high].into_iter().fold(middle, |best, p| if p.cost < best.cost { p } else { best })
}

/// Decay and correlation of DC together.
fn in_both(seen: &Seen, start: Prior) -> Prior {
    let of = |x: &[f64]| seen.best_scale(start.kernel, start.dead, expit(x[0]), x[1].tanh());
    let (x, _) = simplex(|x| of(x).cost, &[logit(start.lam), start.rho.atanh()], 0.2, 0.02, 40);
    of(&x)
}
