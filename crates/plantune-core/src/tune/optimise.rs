//! The PI or PID of least integrated absolute error that keeps given limits, on one plant or on many.
//!
//! ```text
//! min IAE   subject to  max |S| <= Ms,  max |T| <= Mt,  max |C S| <= N,  stable
//! IAE of a unit load at the plant input, of a unit set-point step, or
//! J = (IAE_load / IAE_load* + IAE_set / IAE_set*) / 2,   * the least that each alone can reach
//! ```
//!
//! Over the shape of the controller (`Ti`; `Ti, Td`; with a noise limit also `Tf`) a simplex searches from
//! the best of a coarse table; the gain of each shape is the largest that keeps the limits ([`super::room`]), or a
//! smaller one where the loop is better for it. On many plants the limits hold for a share of them, and the IAE is
//! that of the first.
//!
//! C. Grimholt and S. Skogestad, Optimal PI-control and verification of the SIMC tuning rule, IFAC PID 2012
//! (the cost `J`); O. Garpinger and T. Hagglund, A software tool for robust PID design, IFAC 2008 (least IAE
//! under Ms and Mt).

use super::margins::margins;
use super::room::{Plant, Robustness};
use super::rules::Terms;
use crate::error::{Error, Result};
use crate::linalg::simplex;
use crate::model::{Filter, Model, Pid};
use crate::sim::{ClosedLoopSettings, closed_loop, load_horizon};

/// What the loop shall answer well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// A load at the plant input.
    Load,
    /// The set point.
    SetPoint,
    /// Both, each measured by the least it can be.
    Both,
}

/// What is wished of the controller.
#[derive(Clone, Copy, Debug)]
pub struct Wish {
    /// Limits to keep.
    pub limits: Robustness,
    /// What the loop shall answer well.
    pub answer: Answer,
    /// Which terms it has.
    pub terms: Terms,
    /// Where it filters.
    pub filter: Filter,
    /// Sample time of a sampled controller, s.
    pub Ts: Option<f64>,
    /// Share of the plants on which the limits must hold.
    pub share: f64,
}

/// The best controller, and what it costs.
#[derive(Clone, Copy, Debug)]
pub struct Optimum {
    /// Settings.
    pub pid: Pid,
    /// The IAE, or `J`, on the first plant.
    pub cost: f64,
    /// Share of the plants on which the limits hold.
    pub held: f64,
}

/// `Tf / Td`, where no limit on the noise gain chooses it.
const FILTER: f64 = 0.1;

/// Steps of the simulation per time scale of the loop while searching.
const COARSE: f64 = 40.0;

/// Most evaluations of one simplex.
const MOST: usize = 160;

/// The optimum on the first of the models that keeps the limits on a share of them all.
pub fn optimise(models: &[Model], wish: &Wish) -> Result<Optimum> {
    check(models, wish)?;
    let search = Search::new(models, wish)?;
    let one = |answer| search.best(answer, [1.0, 1.0]);
    let found = match wish.answer {
        Answer::Both => {
            let least = [Answer::Load, Answer::SetPoint].map(|answer| one(answer).map(|o| o.cost));
            let [load, set] = least;
            search.best(Answer::Both, [load?, set?])
        }
        answer => one(answer),
    }?;
    search.finished(found)
}

fn check(models: &[Model], wish: &Wish) -> Result<()> {
    let Robustness { Ms, Mt, noise_gain } = wish.limits;
    if !(Ms > 1.0) {
        return Err(Error::argument("Ms", Ms, "above 1, such as 1.4 to 2"));
    }
    if !(Mt > 1.0) {
        return Err(Error::argument("Mt", Mt, "above 1: integral action makes it at least 1"));
    }
    if !(noise_gain > 0.0) {
        return Err(Error::argument("noise_gain", noise_gain, "positive, in u/y"));
    }
    if models.is_empty() {
        return Err(Error::argument("model", "nothing", "a model or a fit"));
    }
    Ok(())
}

/// Plants, wishes, and where to look.
struct Search<'m> {
    models: &'m [Model],
    plants: Vec<Plant>,
    wish: &'m Wish,
    /// Shortest and longest time that matters, s.
    times: (f64, f64),
}

impl<'m> Search<'m> {
    fn new(models: &'m [Model], wish: &'m Wish) -> Result<Self> {
        let plants: Vec<Plant> = models.iter().map(|m| Plant::new(m, wish.Ts)).collect::<Result<_>>()?;
        let times = plants[0].times();
        Ok(Search { models, plants, wish, times })
    }

    /// Coarse table, simplex, and a look at smaller gains.
    fn best(&self, answer: Answer, unit: [f64; 2]) -> Result<Optimum> {
        let cost = |x: &[f64]| self.at(x).map_or(f64::INFINITY, |pid| self.cost(&pid, answer, unit));
        let (start, least) = self.best_of_table(answer, unit);
        if !least.is_finite() {
            return Err(self.impossible());
        }
        let (x, value) = simplex(cost, &start, 0.3, 1e-3, MOST);
        let shape = self.shape(&x);
        let full = self.largest_gain(&shape).ok_or_else(|| self.impossible())?;
        let weaker = |x: &[f64]| {
            let shape = self.shape(&x[1..]);
            match self.largest_gain(&shape) {
                Some((low, high)) if x[0] <= 0.0 && x[0].exp() * high > low => {
                    self.cost(&scaled(&shape, x[0].exp() * high), answer, unit)
                }
                _ => f64::INFINITY,
            }
        };
        let start = [vec![-0.04], x.clone()].concat();
        if weaker(&start) < value {
            let (x, value) = simplex(weaker, &start, 0.1, 1e-3, MOST);
            let shape = self.shape(&x[1..]);
            let (_, high) = self.largest_gain(&shape).ok_or_else(|| self.impossible())?;
            return Ok(Optimum { pid: scaled(&shape, x[0].exp() * high), cost: value, held: 1.0 });
        }
        Ok(Optimum { pid: scaled(&shape, full.1), cost: value, held: 1.0 })
    }

    /// The least cost of the table. Where the bound is no better than what is found, nothing is simulated.
    fn best_of_table(&self, answer: Answer, unit: [f64; 2]) -> (Vec<f64>, f64) {
        let entries = self.table().into_iter().filter_map(|x| self.at(&x).map(|pid| (x, pid)));
        let mut entries: Vec<_> = entries.map(|(x, pid)| (self.bound(&pid, answer, unit), x, pid)).collect();
        entries.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best = (Vec::new(), f64::INFINITY);
        for (bound, x, pid) in entries {
            if bound >= best.1 {
                break;
            }
            let cost = self.cost(&pid, answer, unit);
            if cost < best.1 {
                best = (x, cost);
            }
        }
        best
    }

    /// What the cost is at least: the error integrates to `1 / Ki` after a load, to `1 / (K Ki)` after a step.
    fn bound(&self, pid: &Pid, answer: Answer, [of_load, of_set]: [f64; 2]) -> f64 {
        let (load, set) = (1.0 / pid.Ki.abs(), 1.0 / (pid.Ki * self.plants[0].gain()).abs());
        match answer {
            Answer::Load => load / of_load,
            Answer::SetPoint => set / of_set,
            Answer::Both => 0.5 * (load / of_load + set / of_set),
        }
    }

    /// Logarithms of `Ti`, `Td / Ti` and, where the noise gain is limited, `Tf / Td`.
    fn table(&self) -> Vec<Vec<f64>> {
        let (short, long) = self.times;
        let ends = ((0.3 * short).ln(), (8.0 * long).ln());
        let count = (4.0 * (ends.1 - ends.0)).ceil().clamp(6.0, 24.0) as usize;
        let Ti = (0..=count).map(|k| ends.0 + (ends.1 - ends.0) * k as f64 / count as f64);
        match self.wish.terms {
            Terms::Pi if self.filters() => {
                Ti.flat_map(|Ti| [0.03f64, 0.2].map(|f| vec![Ti, f.ln()])).collect()
            }
            Terms::Pi => Ti.map(|Ti| vec![Ti]).collect(),
            Terms::Pid => {
                let rest = |Ti: f64, d: f64| {
                    let filter = self.filters().then_some(FILTER.ln());
                    [Ti, d.ln()].into_iter().chain(filter).collect()
                };
                Ti.flat_map(|Ti| [0.1, 0.3, 0.6].map(|d| rest(Ti, d))).collect()
            }
        }
    }

    /// Whether the filter time is searched as well.
    fn filters(&self) -> bool {
        let has_filter = self.wish.terms == Terms::Pid || self.wish.filter == Filter::Y2;
        has_filter && self.wish.limits.noise_gain.is_finite()
    }

    /// The controller of unit gain.
    fn shape(&self, x: &[f64]) -> Pid {
        let Ti = x[0].exp();
        let base = Pid {
            Ts: self.wish.Ts,
            filter: self.wish.filter,
            ..Pid::pi(1f64.copysign(self.plants[0].gain()), Ti)
        };
        match self.wish.terms {
            Terms::Pi => Pid { Tf: x.get(1).map_or(0.0, |f| f.exp() * Ti), ..base },
            Terms::Pid => {
                let Td = x[1].exp() * Ti;
                Pid { Td, Tf: x.get(2).map_or(FILTER, |f| f.exp()) * Td, ..base }
            }
        }
    }

    fn at(&self, x: &[f64]) -> Option<Pid> {
        let shape = self.shape(x);
        self.largest_gain(&shape).map(|(_, high)| scaled(&shape, high))
    }

    /// The gains between which the limits hold on the share of the plants.
    fn largest_gain(&self, shape: &Pid) -> Option<(f64, f64)> {
        let rooms: Vec<(f64, f64)> =
            self.plants.iter().filter_map(|plant| plant.room(shape, &self.wish.limits)).collect();
        let n = self.plants.len();
        let spare = ((1.0 - self.wish.share) * n as f64 + 1e-9).floor() as usize;
        let lost = n - rooms.len();
        if lost > spare {
            return None;
        }
        let spare = spare - lost;
        let mut high: Vec<f64> = rooms.iter().map(|r| r.1).collect();
        let mut low: Vec<f64> = rooms.iter().map(|r| r.0).collect();
        high.sort_by(f64::total_cmp);
        low.sort_by(|a, b| b.total_cmp(a));
        // Those that the gain is too large for, and those that it is too small for, within the share.
        (0..=spare)
            .rev()
            .map(|j| (low[spare - j], high[j]))
            .find(|(low, high)| low < high && high.is_finite())
    }

    /// IAE on the first plant.
    fn cost(&self, pid: &Pid, answer: Answer, [of_load, of_set]: [f64; 2]) -> f64 {
        let iae = |r, d| iae(&self.models[0], pid, r, d, COARSE).unwrap_or(f64::INFINITY);
        match answer {
            Answer::Load => iae(0.0, 1.0) / of_load,
            Answer::SetPoint => iae(1.0, 0.0) / of_set,
            Answer::Both => 0.5 * (iae(0.0, 1.0) / of_load + iae(1.0, 0.0) / of_set),
        }
    }

    /// The optimum with its limits exactly kept: the frequencies of the search have steps.
    fn finished(&self, mut found: Optimum) -> Result<Optimum> {
        let enough = |k: f64| -> Result<Option<f64>> {
            let held = self.held(&scaled(&found.pid, k))?;
            Ok((held >= self.wish.share - 1e-12).then_some(held))
        };
        // Over many models a step of half a percent is close enough.
        let (step, close) = if self.models.len() > 1 { (0.995, 1.0) } else { (0.99, 1e-5) };
        let (mut k, mut kept, mut high) = (1.0, enough(1.0)?, 1.0);
        while kept.is_none() {
            if k < 0.8 {
                return Err(self.impossible());
            }
            high = k;
            k *= step;
            kept = enough(k)?;
        }
        while high - k > close {
            let middle = 0.5 * (k + high);
            match enough(middle)? {
                Some(held) => (k, kept) = (middle, Some(held)),
                None => high = middle,
            }
        }
        found.held = kept.unwrap_or(0.0);
        found.pid = scaled(&found.pid, k);
        Ok(found)
    }

    /// Share of the models on which the limits hold.
    fn held(&self, pid: &Pid) -> Result<f64> {
        let Robustness { Ms, Mt, noise_gain } = self.wish.limits;
        let mut held = 0;
        for model in self.models {
            let m = margins(model, pid)?;
            held += usize::from(
                m.stable && m.Ms <= Ms && m.Mt <= Mt.max(1.0 + 1e-9) && m.noise_gain <= noise_gain,
            );
        }
        Ok(held as f64 / self.models.len() as f64)
    }

    fn impossible(&self) -> Error {
        if self.plants.len() > 1 {
            let share = 100.0 * self.wish.share;
            return Error::new(
                "X13",
                format!(
                    "no controller keeps the limits on {share:.0} % of the models that the data leave open"
                ),
            )
            .remedy("record longer or with larger steps of the input, or allow a larger Ms");
        }
        Error::new("M12", "no gain of any controller keeps the limits, or every gain does".to_owned()).remedy(
            "a plant without dead time or further lags needs a limit on the noise gain, or a sample time; \
             an unstable one may need a larger Ms",
        )
    }
}

/// `k` times the controller.
fn scaled(pid: &Pid, k: f64) -> Pid {
    Pid { Kp: k * pid.Kp, Ki: k * pid.Ki, ..*pid }
}

/// Integrated absolute error after a set-point step `r` and a load `d` at time 0.
pub fn iae(model: &Model, pid: &Pid, r: f64, d: f64, fineness: f64) -> Result<f64> {
    let t_end = load_horizon(model, pid)?;
    let dt = pid.Ts.unwrap_or(t_end / 100.0);
    let steps = (t_end / dt).ceil().max(1.0) as usize;
    let (r, d) = (vec![r; steps], vec![d; steps]);
    let settings = ClosedLoopSettings { d: Some(&d), fineness, ..ClosedLoopSettings::new(dt, &r) };
    Ok(closed_loop(model, pid, &settings)?.run.indices.iae)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Fopdt;

    fn wish(Ms: f64, answer: Answer, terms: Terms) -> Wish {
        let limits = Robustness { Ms, Mt: f64::INFINITY, noise_gain: f64::INFINITY };
        Wish { limits, answer, terms, filter: Filter::D1, Ts: None, share: 0.95 }
    }

    /// METHODS 3.1: `Kp = 0.1213, Ki = 0.855`, load IAE 1.17 at `Ms = 1.59`.
    #[test]
    fn the_engine_loop_has_its_known_optimum() {
        let engine = Model::from(Fopdt { K: -5.939, T: 0.1491, L: 0.1 });
        let found = optimise(std::slice::from_ref(&engine), &wish(1.59, Answer::Load, Terms::Pi))
            .expect("an optimum");
        let iae = iae(&engine, &found.pid, 0.0, 1.0, 1000.0).expect("a response");
        assert!(iae < 1.175 && margins(&engine, &found.pid).expect("margins").Ms <= 1.59, "{iae} {found:?}");
    }
}
