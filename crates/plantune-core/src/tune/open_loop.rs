//! The open loop `L = C G` with one notion of frequency, and whether the closed loop is stable.
//!
//! ```text
//! stable   all roots of  den_C den_G + num_C num_G  inside, where the loop is rational; with a dead time
//!          1 + L turns by pi/2 for each pole of L at 0 and by pi for each unstable one between zero and
//!          the highest frequency                                        (argument principle)
//! |d ln L / d w| <= sum 1/|j w - r| + dead time,  r the poles and zeros of L
//! ```
//!
//! The last line sets the steps of the grid: nothing that `L` does falls between two frequencies. A sampled
//! controller meets the exact pulse transfer function of the plant, whose roots lie in the plane of z.

use std::f64::consts::PI;

use crate::error::Result;
use crate::linalg::Complex;
use crate::model::{Model, Pid, c2d, weighted};
use crate::poly::{is_hurwitz, is_stable, product, roots};

/// Most that `ln L` changes from one frequency of the grid to the next.
pub const STEP: f64 = 0.05;

/// Most frequencies of a grid.
const MOST: usize = 100_000;

/// Smallest step relative to the frequency: roots on the imaginary axis are passed by.
const SMALLEST: f64 = 1e-9;

/// Closer to the axis or the unit circle than this, relative to its size, a pole lies on it.
const ON_AXIS: f64 = 1e-9;

/// `C G`.
pub struct OpenLoop {
    plant: Model,
    pid: Pid,
    /// Poles and zeros in s, 1/s.
    in_s: Vec<Complex<f64>>,
    /// Poles and zeros in z.
    in_z: Vec<Complex<f64>>,
    /// Dead time, s.
    delay: f64,
    /// Nyquist frequency, if the plant is sampled, and the time of one sample.
    sampled: Option<f64>,
}

impl OpenLoop {
    /// Refuses what is no plant, or another sample time.
    pub fn new(model: &Model, pid: &Pid) -> Result<Self> {
        model.check()?;
        let plant = match (model, model.first_order(), model.transfer(), pid.Ts) {
            (Model::Poly(_), _, _, Some(Ts)) => {
                model.check_Ts(Ts)?;
                model.clone()
            }
            (_, _, Some(_), Some(Ts)) => Model::Poly(c2d(model, Ts)?),
            (_, None, Some(G), None) => Model::Transfer(G.into_owned()),
            _ => model.clone(),
        };
        let complex = |r: Vec<(f64, f64)>| r.into_iter().map(|(re, im)| Complex::new(re, im));
        let mut in_s = Vec::new();
        let mut in_z: Vec<Complex<f64>> = Vec::new();
        let (of_plant, delay, sampled) = match &plant {
            Model::Poly(m) => (&mut in_z, m.nk[0] as f64 * m.Ts, Some(m.Ts)),
            Model::Process(m) => (&mut in_s, m.L, None),
            Model::Transfer(m) => (&mut in_s, m.L, None),
        };
        of_plant.extend(complex(plant.poles()).chain(complex(plant.zeros(0))));
        match pid.Ts {
            None => {
                let C = pid.transfer();
                in_s.extend(complex(C.poles()).chain(complex(C.zeros())));
            }
            Some(Ts) => {
                let (num, den) = pid.pulse_transfer(Ts);
                in_z.extend(complex(roots(&den)).chain(complex(roots(&num))));
            }
        }
        Ok(OpenLoop { plant, pid: *pid, in_s, in_z, delay, sampled })
    }

    /// `L(j w)`.
    pub fn at(&self, w: f64) -> Complex<f64> {
        self.pid.freqresp(w) * self.plant.freqresp(0, w)
    }

    /// `C(j w)`.
    pub fn controller(&self, w: f64) -> Complex<f64> {
        self.pid.freqresp(w)
    }

    /// `|S|, |T|, |C S|` at standstill.
    pub fn standstill(&self) -> [f64; 3] {
        let gain = self.plant.dc_gain()[0];
        if self.pid.Ki != 0.0 || !gain.is_finite() {
            let CS = if self.pid.Ki != 0.0 { 1.0 / gain.abs() } else { 0.0 };
            return [0.0, 1.0, CS];
        }
        let L = self.pid.Kp * gain;
        [1.0, L, self.pid.Kp].map(|x| x.abs() / (1.0 + L).abs())
    }

    /// `|C S|` where the frequency grows beyond all bounds, the plant letting nothing through.
    pub fn noise_gain_beyond(&self) -> f64 {
        match (self.pid.Ts, self.plant.transfer()) {
            (None, Some(G)) if G.num.len() < G.den.len() => self.pid.gain_beyond(),
            _ => 0.0,
        }
    }

    /// Frequencies so close that `L` changes by a twentieth of itself at most, from where it stands still
    /// or an integrator alone rules, until it has died out, or only turns, or to the Nyquist frequency.
    pub fn grid(&self) -> Vec<f64> {
        let (slowest, fastest) = self.span();
        let highest = self.sampled.map_or(f64::INFINITY, |Ts| PI / Ts);
        let mut w = 1e-4 * slowest;
        // A large integral gain crosses over earlier than the loop is slow.
        while self.at(w).norm() < 10.0 && w > 1e-12 * slowest && self.pid.Ki != 0.0 {
            w /= 10.0;
        }
        // What does not die out repeats itself with every turn of the dead time.
        let beyond = self.gain_beyond();
        let mut grid = vec![w];
        while w < highest && grid.len() < MOST {
            w = (w + (STEP / self.rate(w)).max(SMALLEST * w)).min(highest);
            grid.push(w);
            let far = w > 10.0 * fastest && w * self.delay.max(1e-6 / fastest) > 4.0 * PI;
            if far && (self.at(w).norm() - beyond).abs() < 0.01 || w > 1e9 * fastest {
                break;
            }
        }
        grid
    }

    /// Frequencies from `low` to `high`, as close; from `turns` on, where the dead time has turned the phase
    /// so far, as close as the rest of the loop asks for.
    pub fn between(&self, low: f64, high: f64, turns: f64) -> Vec<f64> {
        let high = self.sampled.map_or(high, |Ts| high.min(PI / Ts));
        let mut grid = vec![low];
        let mut w = low;
        while w < high && grid.len() < MOST {
            let rate = if w < turns { self.rate(w) } else { (self.rate(w) - self.delay).max(1.0 / w) };
            w = (w + (STEP / rate).max(SMALLEST * w)).min(high);
            grid.push(w);
        }
        grid
    }

    /// Dead time, s.
    pub fn delay(&self) -> f64 {
        self.delay
    }

    /// Whether the closed loop is stable.
    pub fn closes(&self) -> bool {
        if let Some(stable) = self.rational_is_stable() {
            return stable;
        }
        let grid = self.grid();
        let L: Vec<Complex<f64>> = grid.iter().map(|&w| self.at(w)).collect();
        self.is_stable(&grid, &L)
    }

    /// Poles of the plant, in z if it is sampled.
    pub fn plant_poles(&self) -> Vec<(f64, f64)> {
        self.plant.poles()
    }

    /// Time of one sample of a sampled plant, s.
    pub fn sampled(&self) -> Option<f64> {
        self.sampled
    }

    /// Whether the closed loop is stable; `L` on the grid.
    pub fn is_stable(&self, grid: &[f64], L: &[Complex<f64>]) -> bool {
        if let Some(stable) = self.rational_is_stable() {
            return stable;
        }
        if self.gain_beyond() >= 1.0 {
            return false; // each turn of the dead time encircles -1
        }
        let mut turns = 0.0;
        for k in 0..grid.len() - 1 {
            if crosses_negative_axis(L[k], L[k + 1]) {
                let w = root(grid[k], grid[k + 1], |w| self.at(w).im);
                if self.at(w).re < -1.0 {
                    turns += if L[k].im > 0.0 { 1.0 } else { -1.0 };
                }
            }
        }
        let turned = (1.0 + L[L.len() - 1]).arg() - (1.0 + L[0]).arg() + 2.0 * PI * turns;
        (turned - self.turn_of_a_stable_loop()).abs() < 0.5 * PI
    }

    /// By the roots of the closed loop, where it has finitely many.
    fn rational_is_stable(&self) -> Option<bool> {
        match (&self.plant, self.pid.Ts) {
            (Model::Poly(m), Some(Ts)) => {
                let (num, den) = self.pid.pulse_transfer(Ts);
                let late = [vec![0.0; m.nk[0]], product(&num, &m.B[0])].concat();
                let closed = sum(&product(&den, &product(&m.A, &m.F[0])), &late);
                Some(closed[0] != 0.0 && is_stable(&closed.iter().map(|c| c / closed[0]).collect::<Vec<_>>()))
            }
            (_, None) if self.delay == 0.0 => {
                let (C, G) = (self.pid.transfer(), self.plant.transfer()?);
                let closed = weighted([(1.0, &product(&C.den, &G.den)), (1.0, &product(&C.num, &G.num))]);
                Some(is_hurwitz(&closed))
            }
            _ => None,
        }
    }

    /// `|L|` where the frequency grows beyond all bounds.
    fn gain_beyond(&self) -> f64 {
        let lead = |p: &[f64], n: usize| if p.len() == n { p[0].abs() } else { 0.0 };
        match self.plant.transfer() {
            Some(G) if self.pid.Ts.is_none() => {
                let C = self.pid.transfer();
                let (num, den) = (product(&C.num, &G.num), product(&C.den, &G.den));
                if num.len() > den.len() { f64::INFINITY } else { lead(&num, den.len()) / den[0].abs() }
            }
            _ => 0.0,
        }
    }

    /// How far `1 + L` turns from zero to the highest frequency when the closed loop has no unstable pole.
    fn turn_of_a_stable_loop(&self) -> f64 {
        let integral = if self.pid.Ki != 0.0 { 0.5 * PI } else { 0.0 };
        let turn = |outside: f64| match outside {
            x if x > ON_AXIS => PI,
            x if x > -ON_AXIS => 0.5 * PI,
            _ => 0.0,
        };
        let of_pole = |&(re, im): &(f64, f64)| match self.sampled {
            Some(_) => turn(re.hypot(im) - 1.0),
            None if re == 0.0 && im == 0.0 => 0.5 * PI,
            None => turn(re / re.hypot(im)),
        };
        integral + self.plant.poles().iter().map(of_pole).sum::<f64>()
    }

    /// Bound of `|d ln L / d w|`, s.
    fn rate(&self, w: f64) -> f64 {
        let s = Complex::new(0.0, w);
        let in_s: f64 = self.in_s.iter().map(|r| 1.0 / (s - r).norm_sqr().sqrt()).sum();
        let in_z = self.sampled.map_or(0.0, |Ts| {
            let z = Complex::from_polar(1.0, w * Ts);
            self.in_z.iter().map(|r| Ts / (z - r).norm_sqr().sqrt()).sum()
        });
        in_s + in_z + self.delay + 1e-3 / w
    }

    /// Lowest and highest frequency at which something happens, rad/s.
    pub fn span(&self) -> (f64, f64) {
        let of_z = |Ts: f64| {
            let size = move |r: &Complex<f64>| {
                let closest = (r.norm() > 1e-3).then(|| (r.ln() / Ts).norm());
                closest.unwrap_or(PI / Ts).max(1e-6 / Ts)
            };
            self.in_z.iter().map(size).chain([PI / Ts]).collect::<Vec<_>>()
        };
        let all: Vec<f64> = self
            .in_s
            .iter()
            .map(|r| r.norm())
            .chain(self.sampled.map(of_z).unwrap_or_default())
            .chain((self.delay > 0.0).then(|| 1.0 / self.delay))
            .filter(|&w| w > 0.0)
            .collect();
        let low = all.iter().copied().fold(f64::INFINITY, f64::min);
        let high = all.iter().copied().fold(0.0, f64::max);
        if high > 0.0 { (low, high) } else { (1.0, 1.0) }
    }
}

/// Whether the curve passes the negative real axis between two of its points.
pub fn crosses_negative_axis(a: Complex<f64>, b: Complex<f64>) -> bool {
    (a.im > 0.0) != (b.im > 0.0) && a.re.min(b.re) < 0.0
}

/// Where `f` changes sign in `[a, b]`, to the last bit, by bisection.
pub fn root(mut a: f64, mut b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let positive = f(a) > 0.0;
    for _ in 0..100 {
        let middle = 0.5 * (a + b);
        if middle <= a || middle >= b {
            break;
        }
        if (f(middle) > 0.0) == positive { a = middle } else { b = middle }
    }
    0.5 * (a + b)
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    let at = |p: &[f64], k: usize| p.get(k).copied().unwrap_or(0.0);
    (0..a.len().max(b.len())).map(|k| at(a, k) + at(b, k)).collect()
}
