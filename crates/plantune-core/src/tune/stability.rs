//! Whether a loop is stable, and between which values of each setting it stays so.
//!
//! ```text
//! den_C den_G + (num_0 + x num_x) num_G e^(-L s) = 0,   x one of Kp, Ki, Kd
//! x(w) = -(den_C den_G e^(j w L) + num_0 num_G) / (num_x num_G)   at s = j w
//! ```
//!
//! A root reaches the imaginary axis only where `x(w)` is real, at `w = 0` or beyond all frequencies; these
//! values cut the line of `x` into intervals, each wholly stable or wholly unstable. With the dead time
//! replaced by its Taylor or Padé form the intervals are those of the Routh-Hurwitz conditions, source 001,
//! (3.4-19) to (3.4-30), for either sign of K; with the dead time as it is they are exact. A sampled loop is
//! treated so in the plane of z.

use super::open_loop::{OpenLoop, root};
use crate::error::{Error, Result};
use crate::linalg::Complex;
use crate::model::{Delay, Model, Pid, Terms, approximated, backward_euler, c2d, horner, weighted};
use crate::poly::{at, product};

/// Intervals beside the setting that are looked at.
const CLOSE: usize = 8;

/// A setting of the controller, the others held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// `Kp`, with `Ti` and `Td` held: the gain of the whole controller.
    Kp,
    /// `Ki`, with `Kp` and `Kd` held.
    Ki,
    /// `Kd`, with `Kp` and `Ki` held.
    Kd,
}

/// What is known of the stability of a loop.
pub struct Stability {
    /// Whether it is stable.
    pub stable: bool,
    /// Stable interval of `Kp, Ki, Kd`: the one that holds the setting, else the nearest; NaN without one.
    pub bounds: [(f64, f64); 3],
    /// Integral times of the interval of `Ki`, in s; NaN where none is of the sign of `Kp`.
    pub Ti: (f64, f64),
}

/// Stability of `pid` on input 0 of `model`.
pub fn stability(model: &Model, pid: &Pid, delay: Delay) -> Result<Stability> {
    pid.check()?;
    if delay != Delay::Exact && pid.Ts.is_some() {
        return Err(Error::argument("delay", "an approximation", "\"exact\" for a sampled controller"));
    }
    let model = approximated(model, delay)?;
    let open = OpenLoop::new(&model, pid)?;
    let grid = open.grid();
    let L: Vec<Complex<f64>> = grid.iter().map(|&w| open.at(w)).collect();
    let stable = open.is_stable(&grid, &L);
    let bound = |setting| bounds(&model, pid, setting, &grid, stable);
    let bounds = [bound(Setting::Kp)?, bound(Setting::Ki)?, bound(Setting::Kd)?];
    Ok(Stability { stable, bounds, Ti: integral_times(pid.Kp, bounds[1]) })
}

/// `Ti = Kp / Ki` over an interval of `Ki`, as far as it is positive.
fn integral_times(Kp: f64, (low, high): (f64, f64)) -> (f64, f64) {
    let ends = (low / Kp, high / Kp); // 1 / Ti
    let (slow, fast) = if Kp > 0.0 { ends } else { (ends.1, ends.0) };
    if !(fast > 0.0 && fast > slow) {
        return (f64::NAN, f64::NAN);
    }
    (1.0 / fast, if slow > 0.0 { 1.0 / slow } else { f64::INFINITY })
}

/// The stable interval of one setting alone.
pub fn bounds_of(model: &Model, pid: &Pid, setting: Setting) -> Result<(f64, f64)> {
    let open = OpenLoop::new(model, pid)?;
    bounds(model, pid, setting, &open.grid(), open.closes())
}

/// The interval of one setting.
fn bounds(model: &Model, pid: &Pid, setting: Setting, grid: &[f64], stable: bool) -> Result<(f64, f64)> {
    let now = match setting {
        Setting::Kp => pid.Kp,
        Setting::Ki => pid.Ki,
        Setting::Kd => pid.Kd(),
    };
    if setting == Setting::Kp && now == 0.0 || setting == Setting::Kd && pid.Kp == 0.0 {
        return Ok((f64::NAN, f64::NAN)); // an integral controller has no gain to scale and no Td
    }
    let mut cuts = Boundary::new(model, pid, setting)?.values(grid);
    cuts.extend([f64::NEG_INFINITY, f64::INFINITY]);
    cuts.sort_by(f64::total_cmp);
    let intervals = cuts.windows(2).map(|ends| (ends[0], ends[1])).filter(|(low, high)| low < high);
    let distance = |&(low, high): &(f64, f64)| (low - now).max(now - high).max(0.0);
    let mut nearest: Vec<(f64, f64)> = intervals.collect();
    nearest.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    if stable {
        return Ok(nearest[0]);
    }
    // A stable interval lies near, or begins where the setting is none: not each of hundreds needs a look.
    let at_none = |&(low, high): &(f64, f64)| low <= 0.0 && high >= 0.0;
    let promising = nearest.iter().enumerate().filter(|(k, interval)| *k < CLOSE || at_none(interval));
    for (_, &interval) in promising {
        let inside = with(pid, setting, middle(interval));
        if OpenLoop::new(model, &inside)?.closes() {
            return Ok(interval);
        }
    }
    Ok((f64::NAN, f64::NAN))
}

/// A value well inside.
fn middle((low, high): (f64, f64)) -> f64 {
    match (low.is_finite(), high.is_finite()) {
        (true, true) => 0.5 * (low + high),
        (true, false) => low + low.abs().max(1.0),
        (false, true) => high - high.abs().max(1.0),
        (false, false) => 0.0,
    }
}

/// The controller with another value of one setting.
fn with(pid: &Pid, setting: Setting, x: f64) -> Pid {
    match setting {
        Setting::Kp => Pid { Kp: x, Ki: pid.Ki * (x / pid.Kp), ..*pid },
        Setting::Ki => Pid { Ki: x, ..*pid },
        Setting::Kd => Pid { Td: x / pid.Kp, ..*pid },
    }
}

/// Where a root reaches the edge of stability.
struct Boundary {
    /// `den_C den_G`, `num_0 num_G` and `num_x num_G`, in descending powers of s or in `q^-1`.
    den: Vec<f64>,
    rest: Vec<f64>,
    own: Vec<f64>,
    delay: f64,
    Ts: Option<f64>,
}

impl Boundary {
    fn new(model: &Model, pid: &Pid, setting: Setting) -> Result<Self> {
        // The derivative has its filter, whatever its gain is now.
        let Td = if setting == Setting::Kd { 1.0 } else { pid.Td };
        let Terms { p, i, d, den, .. } = Pid { Td, ..*pid }.terms();
        let (Kp, Ki, Kd) = (pid.Kp, pid.Ki, pid.Kd());
        let (rest, own) = match setting {
            Setting::Kp => (vec![0.0], weighted([(1.0, &p), (Ki / Kp, &i), (Kd / Kp, &d)])),
            Setting::Ki => (weighted([(Kp, &p), (Kd, &d)]), i),
            Setting::Kd => (weighted([(Kp, &p), (Ki, &i)]), d),
        };
        // What keeps a root at 0 for every value of the setting is no part of the loop.
        let without = Ki == 0.0 && setting != Setting::Ki;
        let cut = |p: Vec<f64>| if without && p.len() > 1 { p[..p.len() - 1].to_vec() } else { p };
        let rest = if setting == Setting::Kp { rest } else { cut(rest) };
        let (own, den) = (cut(own), cut(den));
        if let Some(Ts) = pid.Ts {
            let plant = match model {
                Model::Poly(m) => m.clone(),
                continuous => c2d(continuous, Ts)?,
            };
            let n = [&rest, &own, &den].map(Vec::len).into_iter().max().unwrap_or(1) - 1;
            let held = |p: &[f64]| backward_euler(p, Ts, n);
            let late = [vec![0.0; plant.nk[0]], plant.B[0].clone()].concat();
            return Ok(Boundary {
                den: product(&held(&den), &product(&plant.A, &plant.F[0])),
                rest: product(&held(&rest), &late),
                own: product(&held(&own), &late),
                delay: 0.0,
                Ts: Some(Ts),
            });
        }
        let G = match model.transfer() {
            Some(G) => G.into_owned(),
            None => return Err(Error::argument("Ts", "absent from the controller", "that of the PolyModel")),
        };
        Ok(Boundary {
            den: product(&den, &G.den),
            rest: product(&rest, &G.num),
            own: product(&own, &G.num),
            delay: G.L,
            Ts: None,
        })
    }

    /// Every value of the setting at which a root lies on the edge.
    fn values(&self, grid: &[f64]) -> Vec<f64> {
        let x: Vec<Complex<f64>> = grid.iter().map(|&w| self.at(w)).collect();
        let mut found = self.at_the_ends();
        for k in 0..grid.len() - 1 {
            if (x[k].im > 0.0) != (x[k + 1].im > 0.0) {
                found.push(self.at(root(grid[k], grid[k + 1], |w| self.at(w).im)).re);
            }
        }
        found.retain(|x| x.is_finite());
        found.iter().map(|x| x + 0.0).collect() // no -0
    }

    fn at(&self, w: f64) -> Complex<f64> {
        let value = |p: &[f64]| match self.Ts {
            None => horner(p, Complex::new(0.0, w)),
            Some(Ts) => at(p, Complex::from_polar(1.0, w * Ts)),
        };
        let turn = Complex::from_polar(1.0, w * self.delay);
        -(value(&self.den) * turn + value(&self.rest)) / value(&self.own)
    }

    /// A root at 0, and one that comes from beyond all frequencies.
    fn at_the_ends(&self) -> Vec<f64> {
        if self.Ts.is_some() {
            // An integrator makes the sum at 1 vanish but for rounding.
            let size = |p: &[f64]| p.iter().map(|c| c.abs()).sum::<f64>();
            let round = |x: f64| if x.abs() < 1e-13 * (size(&self.den) + size(&self.rest)) { 0.0 } else { x };
            let edge = |z: f64| {
                let value = |p: &[f64]| at(p, Complex::new(z, 0.0)).re;
                -round(value(&self.den) + value(&self.rest)) / value(&self.own)
            };
            return vec![edge(1.0), edge(-1.0)];
        }
        let constant = |p: &[f64]| p.last().copied().unwrap_or(0.0);
        let n = self.den.len().max(self.own.len()).max(self.rest.len());
        let lead = |p: &[f64]| if p.len() >= n { p[p.len() - n] } else { 0.0 };
        let at_zero = -(constant(&self.den) + constant(&self.rest)) / constant(&self.own);
        let beyond = |sign: f64| -(sign * lead(&self.den) + lead(&self.rest)) / lead(&self.own);
        // With a dead time the highest frequencies come with any phase.
        if self.delay > 0.0 { vec![at_zero, beyond(1.0), beyond(-1.0)] } else { vec![at_zero, beyond(1.0)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integral_times_are_the_inverse_of_gains_of_their_sign() {
        let close = |(a, b): (f64, f64), (c, d): (f64, f64)| {
            (a - c).abs() < 1e-15 && (b == d || (b - d).abs() < 1e-15)
        };
        assert!(close(integral_times(2.0, (0.5, 4.0)), (0.5, 4.0)));
        assert!(close(integral_times(-2.0, (-4.0, -0.5)), (0.5, 4.0)));
        assert!(close(integral_times(2.0, (-1.0, 4.0)), (0.5, f64::INFINITY)));
        assert!(close(integral_times(-2.0, (f64::NEG_INFINITY, 0.0)), (0.0, f64::INFINITY)));
        for (Kp, Ki) in [(2.0, (-4.0, -1.0)), (2.0, (f64::NAN, f64::NAN)), (0.0, (0.0, 1.0))] {
            let (low, high) = integral_times(Kp, Ki);
            assert!(low.is_nan() && high.is_nan(), "{Kp} {Ki:?}: {low} {high}");
        }
    }
}
