//! The oscillator with the slopes of its state over parameters and initial state, integrated side by side.
//!
//! ```text
//! S' = (df/ds) S + df/dtheta,   S = ds/d(m, c, k, alpha, bg, bd, nu, y0, v0, z0),   s = (y, v, z)
//! ```
//!
//! The rule of Runge and Kutta, applied to both, gives the slopes of its own result to rounding.

use super::{BoucWen, power, sign};

/// Parameters and initial states.
pub(super) const COLUMNS: usize = 10;

/// State and slopes: `y, v, z`, each followed by its slopes.
const SIZE: usize = 3 * (COLUMNS + 1);

/// Where y, v and z begin.
const Y: usize = 0;
const V: usize = COLUMNS + 1;
const Z: usize = 2 * (COLUMNS + 1);

/// State and slopes on their way.
#[derive(Clone)]
pub(super) struct Tangent([f64; SIZE]);

impl Tangent {
    /// At the initial state.
    pub(super) fn new(x0: [f64; 3]) -> Self {
        let mut s = [0.0; SIZE];
        for (i, at) in [Y, V, Z].into_iter().enumerate() {
            s[at] = x0[i];
            s[at + 1 + 7 + i] = 1.0;
        }
        Tangent(s)
    }

    pub(super) fn y(&self) -> f64 {
        self.0[Y]
    }

    /// Slope of y along a column.
    pub(super) fn dy(&self, column: usize) -> f64 {
        self.0[Y + 1 + column]
    }

    /// From one sample to the next, given the force at the ends and the middle of every step.
    pub(super) fn over_sample(&mut self, model: &BoucWen, points: &[f64], Ts: f64) {
        let h = Ts / (points.len() / 2) as f64;
        for u in points.windows(3).step_by(2) {
            let k1 = slope(model, &self.0, u[0]);
            let k2 = slope(model, &along(&self.0, &k1, h / 2.0), u[1]);
            let k3 = slope(model, &along(&self.0, &k2, h / 2.0), u[1]);
            let k4 = slope(model, &along(&self.0, &k3, h), u[2]);
            for i in 0..SIZE {
                self.0[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
            }
        }
    }
}

fn along(s: &[f64; SIZE], k: &[f64; SIZE], h: f64) -> [f64; SIZE] {
    std::array::from_fn(|i| s[i] + h * k[i])
}

fn slope(p: &BoucWen, s: &[f64; SIZE], u: f64) -> [f64; SIZE] {
    let (y, v, z) = (s[Y], s[V], s[Z]);
    let (size, way, side) = (z.abs(), sign(v), sign(z));
    let zeta = power(size, p.nu);
    let drag = p.bg * way * side + p.bd;
    let acceleration = (u - p.c * v - p.k * y - z) / p.m;
    // dz'/dv and dz'/dz; at z = 0 the latter has no one value.
    let A = p.alpha - zeta * drag;
    let B = if size > 0.0 { -p.nu * zeta / size * side * v * drag } else { 0.0 };
    let ln = if size > 0.0 { size.ln() } else { 0.0 };

    let mut out = [0.0; SIZE];
    (out[Y], out[V], out[Z]) = (v, acceleration, v * A);
    for j in 1..=COLUMNS {
        out[Y + j] = s[V + j];
        out[V + j] = -(p.c * s[V + j] + p.k * s[Y + j] + s[Z + j]) / p.m;
        out[Z + j] = A * s[V + j] + B * s[Z + j];
    }
    out[V + 1] -= acceleration / p.m;
    out[V + 2] -= v / p.m;
    out[V + 3] -= y / p.m;
    out[Z + 4] += v;
    out[Z + 5] -= v * zeta * way * side;
    out[Z + 6] -= v * zeta;
    out[Z + 7] -= v * zeta * ln * drag;
    out
}
