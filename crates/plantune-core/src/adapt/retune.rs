//! Settings for an identified plant, and how they do over what the plant may be.
//!
//! ```text
//! IMC-PI        Kp = T / (K (tau_c + L)), Ti = T                  source 001, (3.6-18), (3.6-19), 3.7.5
//! posterior     min IAE over draws of the plant, 95 % of which keep Ms     METHODS 3.3
//! ```
//!
//! The draws come from every minimum of the likelihood in its probability, so that an undecided delay counts.

use crate::error::Result;
use crate::linalg::normal_draws;
use crate::model::{Filter, Fopdt, Model, Pid};
use crate::recursive::Mode;
use crate::stats::quantile;
use crate::tune::{Answer, ImcTarget, Margins, Robustness, Terms, Wish, imc_pi, margins, optimise};

/// Plants drawn for the margins.
const DRAWS: usize = 60;

/// Seed of the draws, so that the same estimate gives the same plants.
const SEED: u64 = 0x001;

/// How settings follow from a plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// IMC-PI with a given margin or closed-loop time constant.
    Imc(ImcTarget),
    /// Least IAE that keeps `Ms` on 95 % of the plants.
    Posterior {
        /// Largest sensitivity.
        Ms: f64,
        /// What the loop shall answer well.
        answer: Answer,
    },
}

/// The present settings and those asked for, over the plants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Over {
    /// 95 % quantile of Ms; infinite where the loop is unstable.
    pub Ms: f64,
    /// 95 % quantile of Ms as a multiple of that of the present settings.
    pub worse: f64,
    /// 5 % quantile of the gain margin, a factor.
    pub gain_margin: f64,
    /// 5 % quantile of the phase margin, degrees.
    pub phase_margin: f64,
}

impl Rule {
    /// Whether it takes a good part of a second.
    pub fn is_dear(&self) -> bool {
        matches!(self, Rule::Posterior { .. })
    }

    /// Settings for a plant, in the form of the present controller.
    pub fn on(&self, plant: &Fopdt, modes: &[Mode], present: &Pid) -> Result<Pid> {
        let pid = match *self {
            Rule::Imc(target) => imc_pi(&(*plant).into(), target)?.pid,
            Rule::Posterior { Ms, answer } => {
                let limits = Robustness { Ms, Mt: f64::INFINITY, noise_gain: f64::INFINITY };
                let terms = Terms::Pi;
                let wish = Wish { limits, answer, terms, filter: Filter::D1, Ts: present.Ts, share: 0.95 };
                let mut models: Vec<Model> = vec![(*plant).into()];
                models.extend(plants(modes).into_iter().map(Model::from));
                optimise(&models, &wish)?.pid
            }
        };
        Ok(Pid { b: present.b, Ts: present.Ts, ..pid })
    }
}

/// Plants in the probabilities of the modes; those with `T <= 0` or `L < 0` are left out.
pub fn plants(modes: &[Mode]) -> Vec<Fopdt> {
    let mut said = 0.0;
    let mut plants = Vec::with_capacity(DRAWS);
    for Mode { model, P, weight } in modes {
        let from = (said * DRAWS as f64).round();
        said += weight;
        let own = ((said * DRAWS as f64).round() - from) as usize;
        let of_model: Vec<f64> = (0..9).map(|ij| P[ij / 3 * 4 + ij % 3]).collect();
        let drawn = normal_draws(&[model.K, model.T, model.L], &of_model, own, SEED);
        plants.extend(drawn.iter().map(|x| Fopdt { K: x[0], T: x[1], L: x[2].max(0.0) }));
    }
    plants.retain(|plant| plant.T > 0.0);
    plants
}

/// What a change from `present` to `wanted` does over the plants.
pub fn over(plants: &[Fopdt], present: &Pid, wanted: &Pid) -> Result<Over> {
    let mut columns: [Vec<f64>; 4] = Default::default();
    for plant in plants {
        let model = Model::from(*plant);
        let of = |pid: &Pid| margins(&model, pid);
        let (new, old) = (of(wanted)?, of(present)?);
        let Ms = |m: &Margins| if m.stable { m.Ms } else { f64::INFINITY };
        let worse = if Ms(&old).is_infinite() { 0.0 } else { Ms(&new) / Ms(&old) };
        let margin = |x: f64| if new.stable { x } else { 0.0 };
        for (column, x) in columns.iter_mut().zip([Ms(&new), worse, margin(new.gain), margin(new.phase_deg)])
        {
            column.push(x);
        }
    }
    columns.iter_mut().for_each(|column| column.sort_by(f64::total_cmp));
    let [Ms, worse, gain, phase] = &columns;
    Ok(Over {
        Ms: quantile(Ms, 0.95),
        worse: quantile(worse, 0.95),
        gain_margin: quantile(gain, 0.05),
        phase_margin: quantile(phase, 0.05),
    })
}
