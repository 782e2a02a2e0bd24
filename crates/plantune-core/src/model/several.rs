//! A model of several outputs, whichever way it is written.

use super::{MatrixPoly, StateSpace};
use crate::error::{Error, Result};
use crate::linalg::Complex;

/// Matrix polynomials or states.
#[derive(Clone, Debug, PartialEq)]
pub enum Several {
    /// `A(q) y = B(q) u + e`.
    Poly(MatrixPoly),
    /// `x(t+1) = A x + B u + K e`, `y = C x + D u + e`, sampled.
    States(StateSpace),
}

impl From<MatrixPoly> for Several {
    fn from(model: MatrixPoly) -> Self {
        Several::Poly(model)
    }
}

impl From<StateSpace> for Several {
    fn from(model: StateSpace) -> Self {
        Several::States(model)
    }
}

impl Several {
    /// Number of inputs.
    pub fn nu(&self) -> usize {
        match self {
            Several::Poly(m) => m.nu(),
            Several::States(m) => m.nu(),
        }
    }

    /// Number of outputs.
    pub fn ny(&self) -> usize {
        match self {
            Several::Poly(m) => m.ny,
            Several::States(m) => m.ny(),
        }
    }

    /// Refuses a sample time that is not the model's; a model in continuous time is sampled.
    pub fn at_sample_time(self, Ts: f64) -> Result<Several> {
        let own = match &self {
            Several::Poly(m) => Some(m.Ts),
            Several::States(m) => m.Ts,
        };
        match (self, own) {
            (Several::States(m), None) => Ok(m.sampled(Ts)?.into()),
            (same, Some(own)) if (own - Ts).abs() <= 1e-9 * own => Ok(same),
            _ => {
                let needed = format!("{} s, the sample time of the model", own.unwrap_or(f64::NAN));
                Err(Error::argument("Ts", Ts, &needed))
            }
        }
    }

    /// Refuses inputs that are not the model's.
    pub fn check_inputs(&self, nu: usize) -> Result<()> {
        if nu == self.nu() {
            return Ok(());
        }
        Err(Error::argument("u", format!("{nu} columns"), &format!("{} columns", self.nu())))
    }

    /// Rows at the start of a segment that serve as history only.
    pub fn history(&self) -> usize {
        match self {
            Several::Poly(m) => m.history(),
            Several::States(_) => 0,
        }
    }

    /// Dimension of what is not known of a segment's start.
    pub fn starts(&self) -> usize {
        match self {
            Several::Poly(m) => m.ny * m.na(),
            Several::States(m) => m.n(),
        }
    }

    /// Output `(N, ny)` for the input `(N, nu)` from rest.
    pub fn simulate(&self, u: &[f64]) -> Vec<f64> {
        match self {
            Several::Poly(m) => m.simulate(u),
            Several::States(m) => m.simulate(u, &vec![0.0; m.n()]),
        }
    }

    /// Response of a segment, from its first row with history on, to its inputs alone.
    pub fn forced(&self, u: &[f64]) -> Vec<f64> {
        let Several::Poly(m) = self else { return self.simulate(u) };
        let (ny, history) = (m.ny, m.history());
        let mut y = vec![0.0; u.len() / m.nu() * ny];
        for k in history..y.len() / ny {
            let next = m.next(&y, u, k);
            y[k * ny..][..ny].copy_from_slice(&next);
        }
        y.split_off(history * ny)
    }

    /// Response `(rows, ny)` to each unit of a start: of a state, or of an impulse into `A(q)^-1` at each of the
    /// first rows.
    pub fn free(&self, rows: usize) -> Vec<Vec<f64>> {
        let m = match self {
            Several::States(m) => return m.free(rows),
            Several::Poly(m) => m,
        };
        let (ny, H) = (m.ny, m.noise_impulses(rows));
        let column = |at: usize| {
            let (late, from) = (at / ny, at % ny);
            let entry = |k: usize, i: usize| if k < late { 0.0 } else { H[k - late][i * ny + from] };
            (0..rows * ny).map(|ki| entry(ki / ny, ki % ny)).collect()
        };
        (0..self.starts()).map(column).collect()
    }

    /// `G` at `w` rad/s, `(ny, nu)` row-major.
    pub fn freqresp(&self, w: f64) -> Vec<Complex<f64>> {
        match self {
            Several::Poly(m) => m.freqresp(w),
            Several::States(m) => m.freqresp(w),
        }
    }

    /// Poles in `z`, of a model in continuous time in 1/s.
    pub fn poles(&self) -> Vec<(f64, f64)> {
        match self {
            Several::Poly(m) => m.poles(),
            Several::States(m) => m.poles(),
        }
    }

    /// Static gains, `(ny, nu)` row-major; infinite with a pole there.
    pub fn dc_gain(&self) -> Vec<f64> {
        match self {
            Several::Poly(m) => m.dc_gain(),
            Several::States(m) => m.dc_gain(),
        }
    }

    /// The model by states.
    pub fn state_space(self) -> StateSpace {
        match self {
            Several::Poly(m) => m.state_space(),
            Several::States(m) => m,
        }
    }
}
