//! Models as values: one `enum Model`, and what every verb asks of it.

mod convert;
mod lags;
mod pid;
mod poly;
mod process;
mod resonance;

pub use convert::{c2d, check_process, d2c};
pub use lags::lags;
pub use pid::Pid;
pub use poly::PolyModel;
pub use process::{Fraction, ProcessModel};
pub use resonance::{Mode, resonance};

use crate::error::{Error, Result};
use crate::linalg::Complex;

/// A model of one output.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// `A y = (B / F) u + (C / D) e`.
    Poly(PolyModel),
    /// `K e^(-L s) / (T s + 1)`.
    Process(ProcessModel),
}

/// A response over one segment, linear in what is not known of its start:
/// `forced + sum_j x0_j free_j`, from row `history` of the segment on.
pub struct Response {
    /// Response to the known signals.
    pub forced: Vec<f64>,
    /// Response to each unit of the initial state.
    pub free: Vec<Vec<f64>>,
}

impl Model {
    /// Number of inputs.
    pub fn nu(&self) -> usize {
        match self {
            Model::Poly(m) => m.B.len(),
            Model::Process(_) => 1,
        }
    }

    /// Rows at the start of a segment that serve as history only.
    pub fn history(&self, Ts: f64) -> usize {
        match self {
            Model::Poly(m) => m.history(),
            Model::Process(m) => m.history(Ts),
        }
    }

    /// Dimension of the initial state of a simulation.
    pub fn order(&self) -> usize {
        match self {
            Model::Poly(m) => m.order(),
            Model::Process(_) => 1,
        }
    }

    /// Parameters in the order of their names.
    pub fn theta(&self) -> Vec<f64> {
        match self {
            Model::Poly(m) => m.theta(),
            Model::Process(m) => vec![m.K, m.T, m.L],
        }
    }

    /// The same structure with other parameters.
    pub fn with_theta(&self, theta: &[f64]) -> Model {
        match self {
            Model::Poly(m) => Model::Poly(m.with_theta(theta)),
            Model::Process(_) => Model::Process(ProcessModel { K: theta[0], T: theta[1], L: theta[2] }),
        }
    }

    /// Whether the parameters describe a plant at all (a drawn time constant may be negative).
    pub fn is_sound(&self) -> bool {
        match self {
            Model::Poly(_) => true,
            Model::Process(m) => m.T > 0.0 && m.L >= 0.0,
        }
    }

    /// A polynomial model has its own sample time; asking for another is an error.
    pub fn check_Ts(&self, Ts: f64) -> Result<()> {
        match self {
            Model::Poly(m) if (m.Ts - Ts).abs() > 1e-9 * m.Ts => Err(Error::argument(
                "Ts",
                Ts,
                &format!("{} s, the sample time of the model (or convert it with d2c and c2d)", m.Ts),
            )),
            _ if Ts > 0.0 && Ts.is_finite() => Ok(()),
            _ => Err(Error::argument("Ts", Ts, "a positive number of seconds")),
        }
    }

    /// Response from rest at row 0, the input before it being zero; `x0` is the process model's start value.
    pub fn simulate(&self, u: &[f64], nu: usize, Ts: f64, x0: f64) -> Result<Vec<f64>> {
        self.check_Ts(Ts)?;
        if nu != self.nu() {
            return Err(Error::argument("u", format!("{nu} columns"), &format!("{} columns", self.nu())));
        }
        Ok(match self {
            Model::Poly(m) => m.simulate(u, nu),
            Model::Process(m) => m.simulate(u, Ts, x0),
        })
    }

    /// Simulated output over one segment.
    pub fn simulation(&self, u: &[f64], nu: usize, Ts: f64) -> Response {
        match self {
            Model::Poly(m) => m.simulation(u, nu),
            Model::Process(m) => m.simulation(u, Ts),
        }
    }

    /// One-step prediction error over one segment; `y` without its offset.
    pub fn prediction_error(&self, u: &[f64], nu: usize, y: &[f64], Ts: f64) -> Response {
        match self {
            Model::Poly(m) => m.prediction_error(u, nu, y),
            Model::Process(m) => {
                // The noise of a process model is white on the output, so it predicts what it simulates.
                let mut response = m.simulation(u, Ts);
                for (e, y) in response.forced.iter_mut().zip(&y[m.history(Ts)..]) {
                    *e = y - *e;
                }
                response.free.iter_mut().flatten().for_each(|v| *v = -*v);
                response
            }
        }
    }

    /// First `len` terms of the noise model `H(q)`.
    pub fn noise_impulse(&self, len: usize) -> Vec<f64> {
        match self {
            Model::Poly(m) => m.noise_impulse(len),
            Model::Process(_) => (0..len).map(|k| f64::from(u8::from(k == 0))).collect(),
        }
    }

    /// Frequency response from input `i` at `w` rad/s, exact delay.
    pub fn freqresp(&self, i: usize, w: f64) -> Complex<f64> {
        match self {
            Model::Poly(m) => m.freqresp(i, w),
            Model::Process(m) => m.freqresp(w),
        }
    }

    /// Poles: in `z` for a polynomial model, in 1/s for a process model.
    pub fn poles(&self) -> Vec<(f64, f64)> {
        match self {
            Model::Poly(m) => m.poles(),
            Model::Process(m) => vec![(-1.0 / m.T, 0.0)],
        }
    }

    /// Zeros from input `i`, in the plane of the poles.
    pub fn zeros(&self, i: usize) -> Vec<(f64, f64)> {
        match self {
            Model::Poly(m) => crate::poly::roots(&m.B[i]),
            Model::Process(_) => Vec::new(),
        }
    }

    /// Static gain of each input; infinite for an integrator.
    pub fn dc_gain(&self) -> Vec<f64> {
        match self {
            Model::Poly(m) => (0..m.B.len()).map(|i| m.dc_gain(i)).collect(),
            Model::Process(m) => vec![m.K],
        }
    }

    /// Response to a unit step of input `i` at time 0, at the given times.
    pub fn step_response(&self, i: usize, t: &[f64]) -> Vec<f64> {
        match self {
            Model::Poly(m) => m.step_response(i, t),
            Model::Process(m) => t.iter().map(|&t| m.step_response(t)).collect(),
        }
    }
}
