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

use super::rpem::Structure;

/// Below this a decaying signal is over: denormal numbers are slow, and never reach zero.
const DECAYED: f64 = 1e-200;

/// `phi` and `psi` of the sample at hand, and those before it as far as the orders need them.
#[derive(Clone, Debug)]
pub(super) struct Regressor {
    structure: Structure,
    filtered: bool,
    /// Regressor.
    pub(super) phi: Vec<f64>, // (n)
    /// Gradient of the prediction.
    pub(super) psi: Vec<f64>, // (n)
    half: Vec<f64>,  // (n)
    phi_past: Past,  // max(nd, 1)
    half_past: Past, // nc
    psi_past: Past,  // nf
}

/// The newest value of each signal in the regressor.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Newest {
    pub(super) y: f64,
    pub(super) e: f64,
    pub(super) v: f64,
    pub(super) w: f64,
}

impl Regressor {
    /// All zero; `psi` is `phi` itself unless `filtered`.
    pub(super) fn new(structure: Structure, filtered: bool) -> Self {
        let n = structure.n();
        let Structure { nc, nd, nf, .. } = structure;
        let filtered = filtered && nc + nd + nf > 0;
        let past = |rows: usize| Past::new(n, if filtered { rows } else { 0 });
        Regressor {
            structure,
            filtered,
            phi: vec![0.0; n],
            psi: vec![0.0; n],
            half: vec![0.0; n],
            phi_past: Past::new(n, if filtered { nd.max(1) } else { 1 }),
            half_past: past(nc),
            psi_past: past(nf),
        }
    }

    /// Makes `phi` and `psi` of the next sample, `u` the newest input in it; the past stays as it is until
    /// [`Regressor::keep`].
    #[inline(always)]
    pub(super) fn look(&mut self, n: usize, theta: &[f64], newest: Newest, u: f64) {
        let Structure { na, nb, nc, nd, nf, offset, .. } = self.structure;
        let (theta, phi, before) = (&theta[..n], &mut self.phi[..n], &self.phi_past.row(1)[..n]);
        phi[1..n].copy_from_slice(&before[..n - 1]);
        let mut from = 0;
        for (order, head) in [(na, -newest.y), (nb, u), (nc, newest.e), (nd, -newest.v), (nf, -newest.w)] {
            if order > 0 {
                phi[from] = head;
            }
            from += order;
        }
        if offset {
            phi[n - 1] = 1.0;
        }
        let psi = &mut self.psi[..n];
        psi.copy_from_slice(phi);
        if !self.filtered {
            return;
        }
        let (b, c, d, f) = (na, na + nb, na + nb + nc, na + nb + nc + nd);
        for i in 0..nd {
            let (d_i, past) = (theta[d + i], &self.phi_past.row(i + 1)[..n]);
            for k in (0..c).chain(f..n) {
                psi[k] += d_i * past[k];
            }
        }
        for i in 0..nc {
            let (c_i, past) = (theta[c + i], &self.half_past.row(i + 1)[..n]);
            for k in 0..n {
                psi[k] -= c_i * past[k];
            }
        }
        if nf > 0 {
            self.half[..n].copy_from_slice(psi);
        }
        for i in 0..nf {
            let (f_i, past) = (theta[f + i], &self.psi_past.row(i + 1)[..n]);
            for k in (b..c).chain(f..f + nf) {
                psi[k] -= f_i * past[k];
            }
        }
        for x in psi {
            if x.abs() < DECAYED {
                *x = 0.0;
            }
        }
    }

    /// Makes the sample at hand part of the past.
    #[inline(always)]
    pub(super) fn keep(&mut self, n: usize) {
        self.phi_past.push(n, &self.phi);
        if self.filtered {
            let half = if self.structure.nf > 0 { &self.half } else { &self.psi };
            self.half_past.push(n, half);
            self.psi_past.push(n, &self.psi);
        }
    }

    /// Forgets all signals.
    pub(super) fn restart(&mut self) {
        for past in [&mut self.phi_past, &mut self.half_past, &mut self.psi_past] {
            past.data.fill(0.0);
        }
    }

    /// Walks over every number of the state.
    pub(super) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
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
