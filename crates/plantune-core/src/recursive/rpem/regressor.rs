//! The regressor and the gradient of the prediction of
//! `A(q) y(t) = B(q)/F(q) u(t - nk) + d + C(q)/D(q) e(t)`, and what they remember.
//!
//! ```text
//! phi  = [-y(t-1) … | u(t-nk) … | e(t-1) … | -v(t-1) … | -w(t-1) … | 1]
//! half = phi - sum_i c_i half(t-i), and + sum_i d_i phi(t-i) of all but c and d
//! psi  = half,                     and - sum_i f_i psi(t-i)  of b and f
//! ```
//!
//! so that `psi` is `D/C phi` for a and the constant, `D/(C F) phi` for b and f, `1/C phi` for c and d.
//! Ljung 1999, (10.53) and 11.4; source 001, (3.7-10).

use super::super::room::Room;
use super::Structure;

/// Below this a decaying signal is over: denormal numbers are slow, and never reach zero.
const DECAYED: f64 = 1e-200;

/// What `phi` and `psi` remember of the samples before.
#[derive(Clone, Debug)]
pub(super) struct Regressor {
    structure: Structure,
    filtered: bool,
    paths: bool,      // whether there is a D or an F
    from: Vec<usize>, // (n) where each entry of phi stands in the pool
    D: Vec<f64>,      // (n) 1 where D filters: all but c and d
    F: Vec<f64>,      // (n) 1 where 1/F does: b and f
    /// The newest `-y, u, e, -v, -w` and 1, then the last `phi`.
    pool: Vec<f64>, // (6 + n)
    phi_past: Past,   // nd
    half_past: Past,  // nc
    psi_past: Past,   // nf
}

/// The newest value of each signal, as it enters `phi`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Newest {
    pub(super) minus_y: f64,
    pub(super) e: f64,
    pub(super) minus_v: f64,
    pub(super) minus_w: f64,
}

/// Number of them, with the input and the constant.
const SIGNALS: usize = 6;

/// Which of them the input is; it comes with the sample itself.
const INPUT: usize = 1;

impl Regressor {
    /// All zero; `psi` is `phi` itself unless `filtered`.
    pub(super) fn new(structure: Structure, filtered: bool) -> Self {
        let n = structure.n();
        let Structure { na, nb, nc, nd, nf, offset, .. } = structure;
        let filtered = filtered && nc + nd + nf > 0;
        let past = |rows: usize| Past::new(n, if filtered { rows } else { 0 });
        let (mut from, mut D, mut F) = (Vec::with_capacity(n), Vec::with_capacity(n), Vec::with_capacity(n));
        let orders = [na, nb, nc, nd, nf, usize::from(offset)];
        let by_D = [1.0, 1.0, 0.0, 0.0, 1.0, 1.0];
        let by_F = [0.0, 1.0, 0.0, 0.0, 1.0, 0.0];
        for (signal, &order) in orders.iter().enumerate() {
            let first = from.len();
            from.extend((0..order).map(|k| if k == 0 { signal } else { SIGNALS + first + k - 1 }));
            D.extend(vec![by_D[signal]; order]);
            F.extend(vec![by_F[signal]; order]);
        }
        let mut pool = vec![0.0; SIGNALS + n];
        pool[SIGNALS - 1] = 1.0;
        Regressor {
            structure,
            filtered,
            paths: nd + nf > 0,
            from,
            D,
            F,
            pool,
            phi_past: past(nd),
            half_past: past(nc),
            psi_past: past(nf),
        }
    }

    /// Makes `phi` and `psi` of the next sample, `u` the newest input in it; the past stays as it is until [`Regressor::keep`].
    #[inline(always)]
    pub(super) fn look(&mut self, n: usize, room: &mut Room<'_>, theta: &[f64], u: f64) {
        let Structure { na, nb, nc, nd, nf, .. } = self.structure;
        let (theta, from, pool) = (&theta[..n], &self.from[..n], &mut self.pool[..SIGNALS + n]);
        let (phi, psi, half) = (&mut room.phi[..n], &mut room.psi[..n], &mut room.half[..n]);
        pool[INPUT] = u;
        for k in 0..n {
            phi[k] = pool[from[k]];
            psi[k] = phi[k];
        }
        if !self.filtered {
            return;
        }
        if self.paths {
            let d = na + nb + nc;
            for i in 0..nd {
                let (d_i, past, D) = (theta[d + i], &self.phi_past.row(i + 1)[..n], &self.D[..n]);
                for k in 0..n {
                    psi[k] += d_i * D[k] * past[k];
                }
            }
        }
        let c = na + nb;
        for i in 0..nc {
            let (c_i, past) = (theta[c + i], &self.half_past.row(i + 1)[..n]);
            for k in 0..n {
                psi[k] -= c_i * past[k];
            }
        }
        if self.paths {
            let f = na + nb + nc + nd;
            half.copy_from_slice(psi);
            for i in 0..nf {
                let (f_i, past, F) = (theta[f + i], &self.psi_past.row(i + 1)[..n], &self.F[..n]);
                for k in 0..n {
                    psi[k] -= f_i * F[k] * past[k];
                }
            }
        }
    }

    /// Makes the sample in the room part of the past, with what is newest after it.
    #[inline(always)]
    pub(super) fn keep(&mut self, n: usize, room: &Room<'_>, newest: Newest) {
        let Newest { minus_y, e, minus_v, minus_w } = newest;
        let pool = &mut self.pool[..SIGNALS + n];
        (pool[0], pool[2], pool[3], pool[4]) = (minus_y, e, minus_v, minus_w);
        pool[SIGNALS..].copy_from_slice(&room.phi[..n]);
        if self.filtered {
            if self.paths {
                self.phi_past.push(n, room.phi);
                self.half_past.push(n, room.half);
                self.psi_past.push(n, room.psi);
            } else {
                self.half_past.push(n, room.psi); // where nothing more is filtered
            }
        }
    }

    /// Whether `w` and `v` are remembered.
    #[inline(always)]
    pub(super) fn has_paths(&self) -> bool {
        self.paths
    }

    /// `w` and `v` of the sample in the room: `w = B/F u` and `v = A y - w - d`, or `v = 0` of a `w` not known.
    #[inline(always)]
    pub(super) fn paths(&self, n: usize, room: &Room<'_>, theta: &[f64], y: f64, known: bool) -> (f64, f64) {
        let (phi, theta, D, F) = (&room.phi[..n], &theta[..n], &self.D[..n], &self.F[..n]);
        let (mut w, mut rest) = (0.0, y);
        for k in 0..n {
            let part = phi[k] * theta[k];
            w += F[k] * part;
            rest -= (D[k] - F[k]) * part; // a and the constant
        }
        if known { (w, rest - w) } else { (rest, 0.0) }
    }

    /// The output of the sample before.
    #[inline(always)]
    pub(super) fn last_y(&self) -> f64 {
        -self.pool[0]
    }

    /// Ends signals that have decayed.
    #[cold]
    pub(super) fn tidy(&mut self) {
        let pasts = [&mut self.phi_past, &mut self.half_past, &mut self.psi_past].map(|past| &mut past.data);
        for x in pasts.into_iter().flatten().chain(&mut self.pool).filter(|x| x.abs() < DECAYED) {
            *x = 0.0;
        }
    }

    /// Forgets all signals.
    pub(super) fn restart(&mut self) {
        for past in [&mut self.phi_past, &mut self.half_past, &mut self.psi_past] {
            past.data.fill(0.0);
        }
        self.pool.fill(0.0);
        self.pool[SIGNALS - 1] = 1.0;
    }

    /// Walks over every number of the state.
    pub(super) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        self.pool[INPUT] = 0.0;
        self.pool.iter_mut().for_each(&mut *visit);
        for past in [&mut self.phi_past, &mut self.half_past, &mut self.psi_past] {
            past.in_order();
            past.data.iter_mut().for_each(&mut *visit);
        }
    }
}

/// Rows of before, the oldest of which the next one replaces.
#[derive(Clone, Debug)]
struct Past {
    n: usize,
    rows: usize,
    newest: usize,
    data: Vec<f64>, // (rows, n)
}

impl Past {
    fn new(n: usize, rows: usize) -> Self {
        Past { n, rows, newest: 0, data: vec![0.0; n * rows] }
    }

    /// The row `back` samples ago, `1 <= back <= rows`.
    #[inline(always)]
    fn row(&self, back: usize) -> &[f64] {
        let k = self.newest + back - 1;
        let k = if k >= self.rows { k - self.rows } else { k };
        &self.data[k * self.n..]
    }

    #[inline(always)]
    fn push(&mut self, n: usize, row: &[f64]) {
        if self.rows > 0 {
            self.newest = if self.newest == 0 { self.rows - 1 } else { self.newest - 1 };
            self.data[self.newest * n..][..n].copy_from_slice(&row[..n]);
        }
    }

    /// Moves the newest row to the front.
    fn in_order(&mut self) {
        self.data.rotate_left(self.newest * self.n);
        self.newest = 0;
    }
}
