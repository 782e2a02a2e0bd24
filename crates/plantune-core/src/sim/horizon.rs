//! How long a loop takes, and how closely it must be looked at: estimates from model and settings.
//!
//! ```text
//! first order   settled = 12 (1/|K Ki| + T/(1 + |K Kp|) + L)
//! other plants  settled = 12 (1/|K Ki| + 1/w_c + tau + L)
//! ```
//!
//! `w_c` is the highest frequency at which `|C G| = 1`, and `tau` the slowest decay of a pole faster than
//! that: slower ones are moved to `w_c` by the loop, faster ones stay where they are.

use crate::error::Result;
use crate::model::{Filter, Model, Pid};
use std::f64::consts::PI;

/// Time constants until nothing is left to see.
const SETTLED: f64 = 12.0;
/// Time scales of a continuous loop, and samples of a sampled one, that are simulated without being asked for.
const MOST_SCALES: f64 = 2000.0;
const MOST_SAMPLES: f64 = 1e6;
/// Frequencies per decade at which a crossover is looked for.
const PER_DECADE: f64 = 20.0;

/// Seconds until a loop of sound settings has settled many times over, within reason.
pub fn default_horizon(model: &Model, pid: &Pid) -> Result<f64> {
    pid.check()?;
    model.check()?;
    Ok(settled(model, pid).min(affordable(model, pid)))
}

/// As [`default_horizon`], and until a load has died out: it decays no faster than the integral time.
///
/// The fast part of a loop decides how close the nodes lie, so a very slow recovery is cut short.
pub fn load_horizon(model: &Model, pid: &Pid) -> Result<f64> {
    let settled = default_horizon(model, pid)?;
    let recovered = if pid.Ki != 0.0 { 8.0 * pid.Ti() } else { 0.0 };
    Ok(recovered.max(settled).min(50.0 * settled).min(affordable(model, pid)))
}

fn settled(model: &Model, pid: &Pid) -> f64 {
    let K = model.dc_gain()[0];
    let integral = if pid.Ki != 0.0 && K.is_finite() { 1.0 / (K * pid.Ki).abs() } else { 0.0 };
    if let Some(plant) = model.first_order() {
        return SETTLED * (integral + plant.T / (1.0 + (plant.K * pid.Kp).abs()) + plant.L);
    }
    let (poles, L) = in_seconds(model);
    let crossover = crossover(model, pid, 1.0).unwrap_or(0.0);
    let tau = poles
        .iter()
        .filter(|(re, im)| *re != 0.0 && re.hypot(*im) >= crossover)
        .map(|(re, _)| 1.0 / re.abs())
        .fold(0.0, f64::max);
    let turn = if crossover > 0.0 { 1.0 / crossover } else { 0.0 };
    let sum = integral + turn + tau + L;
    SETTLED * if sum > 0.0 { sum } else { pid.Ts.unwrap_or(1.0) }
}

fn affordable(model: &Model, pid: &Pid) -> f64 {
    pid.Ts.map_or_else(|| MOST_SCALES * time_scale(model, pid), |Ts| MOST_SAMPLES * Ts)
}

/// Seconds in which a continuous loop changes much; a thousandth of it is a fine step.
pub fn time_scale(model: &Model, pid: &Pid) -> f64 {
    let loops = match model.first_order() {
        Some(plant) => plant.T / (1.0 + (plant.K * pid.Kp).abs()),
        None => crossover(model, pid, 0.5).map_or_else(|| settled(model, pid) / SETTLED, |w| 1.0 / w),
    };
    // A loop that is stable does nothing of note within a thousandth of its dead time, but by a filter.
    let delay = model.transfer().map_or(0.0, |G| G.L);
    let filter = if filters(pid) { 50.0 * pid.Tf } else { f64::INFINITY };
    loops.max(delay).min(filter)
}

/// Whether the filter is in use.
fn filters(pid: &Pid) -> bool {
    pid.Tf > 0.0 && (pid.Td > 0.0 || pid.filter == Filter::Y2)
}

/// Highest frequency at which `|C G|` is at least `level`, or at least that share of its largest value.
fn crossover(model: &Model, pid: &Pid, level: f64) -> Option<f64> {
    let model = model.transfer().map_or_else(|| model.clone(), |G| Model::Transfer(G.into_owned()));
    let gain = |w: f64| (pid.freqresp(w) * model.freqresp(0, w)).norm();
    let (poles, L) = in_seconds(&model);
    let Tf = if filters(pid) { pid.Tf } else { 0.0 };
    let own = [L, Tf, pid.Td, pid.Ti(), pid.Ts.unwrap_or(0.0)].map(|t| 1.0 / t);
    let corners = poles.iter().map(|(re, im)| re.hypot(*im)).chain(own);
    let corners: Vec<f64> = corners.filter(|w| w.is_finite() && *w > 0.0).collect();
    let nyquist = match (&model, pid.Ts) {
        (Model::Poly(m), _) => PI / m.Ts,
        (_, Some(Ts)) => PI / Ts,
        _ => f64::INFINITY,
    };
    let low = 1e-3 * corners.iter().copied().fold(f64::INFINITY, f64::min);
    let top = (10.0 * corners.iter().copied().fold(0.0, f64::max)).min(nyquist);
    if !low.is_finite() {
        return None;
    }
    let mut high = top;
    while high < nyquist && high < 1e12 * top && gain(high) >= level {
        high = (10.0 * high).min(nyquist);
    }
    let step = 10f64.powf(1.0 / PER_DECADE);
    let down = std::iter::successors(Some(high), |w| Some(w / step)).take_while(|&w| w > low);
    let mut grid: Vec<f64> = down.chain(corners.into_iter().filter(|&w| w < high)).collect();
    grid.sort_by(|a, b| b.total_cmp(a));
    let gains: Vec<f64> = grid.iter().map(|&w| gain(w)).collect();
    let level = if level < 1.0 { level * gains.iter().copied().fold(0.0, f64::max).min(1.0) } else { level };
    let first = gains.iter().position(|&g| g >= level)?;
    // Gain that never falls off leaves the plant's own corners.
    Some(if first == 0 && high > top { top } else { grid[first] })
}

/// Poles in 1/s and dead time in s, of a polynomial model as well.
fn in_seconds(model: &Model) -> (Vec<(f64, f64)>, f64) {
    let poles = model.poles();
    match model {
        Model::Poly(m) => {
            let log = |(re, im): (f64, f64)| (re.hypot(im).max(1e-6).ln() / m.Ts, im.atan2(re) / m.Ts);
            let near_one = |(re, im): &(f64, f64)| re.abs() * m.Ts > 1e-9 || *im != 0.0;
            (poles.into_iter().map(log).filter(near_one).collect(), m.nk[0] as f64 * m.Ts)
        }
        Model::Process(m) => (poles, m.L),
        Model::Transfer(m) => (poles, m.L),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Fopdt, ProcessModel};

    /// A lag so short that it does not matter leaves the first order's horizon within a factor.
    #[test]
    fn plants_alike_take_alike() {
        for (T, L, Kp, Ti) in [(1.0, 1.0, 0.5, 1.0), (100.0, 1.0, 50.0, 4.0), (1.0, 30.0, 0.02, 1.0)] {
            let one = Model::from(Fopdt { K: 1.0, T, L });
            let more = Model::Process(ProcessModel {
                T: vec![T, 1e-3 * T],
                ..ProcessModel::from(Fopdt { K: 1.0, T, L })
            });
            let pid = Pid::pi(Kp, Ti);
            let times = [&one, &more].map(|m| default_horizon(m, &pid).expect("a horizon"));
            assert!((0.5..2.0).contains(&(times[1] / times[0])), "{times:?}");
            let scales = [&one, &more].map(|m| time_scale(m, &pid));
            assert!((0.2..5.0).contains(&(scales[1] / scales[0])), "{scales:?}");
        }
    }

    #[test]
    fn a_plant_that_rings_beyond_the_crossover_is_waited_for() {
        let ringing = ProcessModel {
            T: vec![0.1],
            zeta: Some(0.01),
            ..ProcessModel::from(Fopdt { K: 1.0, T: 0.1, L: 0.0 })
        };
        let t = default_horizon(&Model::Process(ringing), &Pid::pi(0.01, 0.1)).expect("a horizon");
        assert!(t > 12.0 * 0.1 / 0.01, "{t}");
    }
}
