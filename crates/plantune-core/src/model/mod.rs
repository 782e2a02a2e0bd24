//! Models as values: one `enum Model`, and what every verb asks of it.

mod approximate;
mod at_stamps;
mod convert;
pub mod derived;
mod fopdt;
mod freqresp;
mod horizon;
mod integrator;
mod matrix_poly;
mod pid;
mod poly;
mod process;
mod realisation;
mod reduce;
mod resonance;
mod several;
mod state_space;
mod term_model;
mod terms;
mod transfer;

pub use approximate::{Delay, approximated};
pub use at_stamps::{AtStamps, Stamped, States};
pub use convert::{c2d, check_fopdt, d2c};
pub use fopdt::{Fopdt, Fraction};
pub use freqresp::{Bode, FrequencyResponse, disc, seen};
pub use horizon::horizon;
pub use integrator::class_notes;
pub use matrix_poly::MatrixPoly;
pub use pid::{Filter, Pid, Terms, backward_euler, weighted};
pub use poly::PolyModel;
pub use process::ProcessModel;
pub use realisation::{Realisation, Transition, sampled};
pub use reduce::{Reduced, reduce};
pub use resonance::{Mode, resonance};
pub use several::Several;
pub use state_space::{StateSpace, add, entries, spectrum};
pub use term_model::TermModel;
pub use terms::{Lagged, Own, Term, longest_lag};
pub use transfer::{TransferFunction, horner};

use std::borrow::Cow;

use crate::error::{Error, Result};
use crate::linalg::Complex;
use crate::note::rounded;

/// Outputs from here on are no numbers of a plant.
const OVERFLOW: f64 = 1e150;

/// A model of one output.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// `A y = (B / F) u + (C / D) e`.
    Poly(PolyModel),
    /// `K (Tz s + 1) e^(-L s) / (s^i prod (T_k s + 1))`.
    Process(ProcessModel),
    /// `num(s) / den(s) e^(-L s)`.
    Transfer(TransferFunction),
}

/// A response over one segment, linear in what is not known of its start:
/// `forced + sum_j x0_j free_j`, from row `history` of the segment on.
pub struct Response {
    /// Response to the known signals.
    pub forced: Vec<f64>,
    /// Response to each unit of the initial state.
    pub free: Vec<Vec<f64>>,
}

/// How a model runs over samples.
enum Sampled<'m> {
    /// Its own formulas, exact.
    First(Fopdt),
    /// A difference equation.
    Poly(Cow<'m, PolyModel>),
}

impl From<Fopdt> for Model {
    fn from(plant: Fopdt) -> Self {
        Model::Process(plant.into())
    }
}

impl From<PolyModel> for Model {
    fn from(model: PolyModel) -> Self {
        Model::Poly(model)
    }
}

impl From<ProcessModel> for Model {
    fn from(plant: ProcessModel) -> Self {
        Model::Process(plant)
    }
}

impl From<TransferFunction> for Model {
    fn from(plant: TransferFunction) -> Self {
        Model::Transfer(plant)
    }
}

impl Model {
    /// Number of inputs.
    pub fn nu(&self) -> usize {
        match self {
            Model::Poly(m) => m.B.len(),
            Model::Process(_) | Model::Transfer(_) => 1,
        }
    }

    /// Of a continuous model numerator, denominator and dead time.
    pub fn transfer(&self) -> Option<Cow<'_, TransferFunction>> {
        match self {
            Model::Poly(_) => None,
            Model::Process(m) => Some(Cow::Owned(m.transfer())),
            Model::Transfer(m) => Some(Cow::Borrowed(m)),
        }
    }

    /// The first order plus dead time that this is, if it is one.
    pub fn first_order(&self) -> Option<Fopdt> {
        match self {
            Model::Process(m) => m.first_order(),
            _ => None,
        }
    }

    /// Refuses what is no plant (M12).
    pub fn check(&self) -> Result<()> {
        match self {
            Model::Poly(_) => Ok(()),
            Model::Process(m) => m.check(),
            Model::Transfer(m) => m.check(),
        }
    }

    fn sampled(&self, Ts: f64) -> Sampled<'_> {
        match (self, self.first_order()) {
            (_, Some(plant)) => Sampled::First(plant),
            (Model::Poly(m), _) => Sampled::Poly(Cow::Borrowed(m)),
            (Model::Process(m), _) => Sampled::Poly(Cow::Owned(sampled(&m.transfer(), Ts))),
            (Model::Transfer(m), _) => Sampled::Poly(Cow::Owned(sampled(m, Ts))),
        }
    }

    /// Rows at the start of a segment that serve as history only.
    pub fn history(&self, Ts: f64) -> usize {
        match self.sampled(Ts) {
            Sampled::First(m) => m.history(Ts),
            Sampled::Poly(m) => m.history(),
        }
    }

    /// Dimension of the initial state of a simulation.
    pub fn order(&self) -> usize {
        match self {
            Model::Poly(m) => m.order(),
            Model::Process(m) => m.transfer().den.len() - 1,
            Model::Transfer(m) => m.den.len() - 1,
        }
    }

    /// Parameters in the order of their names.
    pub fn theta(&self) -> Vec<f64> {
        match self {
            Model::Poly(m) => m.theta(),
            Model::Process(m) => m.theta(),
            Model::Transfer(m) => m.theta(),
        }
    }

    /// The same structure with other parameters.
    pub fn with_theta(&self, theta: &[f64]) -> Model {
        match self {
            Model::Poly(m) => Model::Poly(m.with_theta(theta)),
            Model::Process(m) => Model::Process(m.with_theta(theta)),
            Model::Transfer(m) => Model::Transfer(m.with_theta(theta)),
        }
    }

    /// Whether the parameters describe a plant at all (a drawn time constant may be negative).
    pub fn is_sound(&self) -> bool {
        match self {
            Model::Poly(_) => true,
            Model::Process(m) => m.T.iter().all(|&T| T > 0.0) && m.L >= 0.0,
            Model::Transfer(m) => m.L >= 0.0,
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

    /// Response from rest at row 0, the input before it being zero; `x0` is the start value of a first-order
    /// process model.
    pub fn simulate(&self, u: &[f64], nu: usize, Ts: f64, x0: f64) -> Result<Vec<f64>> {
        self.check_Ts(Ts)?;
        self.check()?;
        if nu != self.nu() {
            return Err(Error::argument("u", format!("{nu} columns"), &format!("{} columns", self.nu())));
        }
        let y = match self.sampled(Ts) {
            Sampled::First(m) => m.simulate(u, Ts, x0),
            Sampled::Poly(m) if x0 == 0.0 => m.simulate(u, nu),
            Sampled::Poly(_) => {
                return Err(Error::argument("x0", x0, "0 but for a first-order process model"));
            }
        };
        self.overflow(&y).map_or(Ok(y), Err)
    }

    /// M02 where an unstable model has left every scale.
    fn overflow(&self, y: &[f64]) -> Option<Error> {
        let row = y.iter().position(|y| !(y.abs() < OVERFLOW))?;
        let pole = self.unstable_pole()?;
        Some(
            Error::new(
                "M02",
                format!("unstable, a pole at {pole}: from row {row} on the simulation overflows"),
            )
            .count(y.len() - row)
            .measured(y.len() as f64, row as f64)
            .remedy(format!("simulate less than {row} rows, or the loop: simulate.closed_loop")),
        )
    }

    /// The pole farthest beyond the border of stability, in words.
    fn unstable_pole(&self) -> Option<String> {
        let beyond = |&(re, im): &(f64, f64)| match self {
            Model::Poly(_) => f64::hypot(re, im) - 1.0,
            _ => re,
        };
        let poles = self.poles();
        let worst =
            poles.iter().max_by(|a, b| beyond(a).total_cmp(&beyond(b))).filter(|p| beyond(p) > 0.0)?;
        let (re, im) = (rounded(worst.0), rounded(worst.1.abs()));
        Some(if im == 0.0 { format!("{re}") } else { format!("{re} ± {im}j") })
    }

    /// The same with the offset `O`; of an integrating process model `O` is the drift per second.
    pub fn simulate_with(&self, u: &[f64], nu: usize, Ts: f64, x0: f64, offset: f64) -> Result<Vec<f64>> {
        let drifts = matches!(self, Model::Process(m) if m.integrating);
        let level = |k: usize| if drifts { offset * Ts * k as f64 } else { offset };
        let y = self.simulate(u, nu, Ts, x0)?;
        Ok(y.into_iter().enumerate().map(|(k, y)| y + level(k)).collect())
    }

    /// Simulated output over one segment.
    pub fn simulation(&self, u: &[f64], nu: usize, Ts: f64) -> Response {
        match self.sampled(Ts) {
            Sampled::First(m) => m.simulation(u, Ts),
            Sampled::Poly(m) => m.simulation(u, nu),
        }
    }

    /// One-step prediction error over one segment; `y` without its offset.
    pub fn prediction_error(&self, u: &[f64], nu: usize, y: &[f64], Ts: f64) -> Response {
        if let Model::Poly(m) = self {
            return m.prediction_error(u, nu, y);
        }
        // The noise of a continuous model is white on the output, so it predicts what it simulates.
        let mut response = self.simulation(u, nu, Ts);
        for (e, y) in response.forced.iter_mut().zip(&y[self.history(Ts)..]) {
            *e = y - *e;
        }
        response.free.iter_mut().flatten().for_each(|v| *v = -*v);
        response
    }

    /// First `len` terms of the noise model `H(q)`.
    pub fn noise_impulse(&self, len: usize) -> Vec<f64> {
        match self {
            Model::Poly(m) => m.noise_impulse(len),
            _ => (0..len).map(|k| f64::from(u8::from(k == 0))).collect(),
        }
    }

    /// Frequency response from input `i` at `w` rad/s, exact delay.
    pub fn freqresp(&self, i: usize, w: f64) -> Complex<f64> {
        match (self, self.first_order()) {
            (_, Some(m)) => m.freqresp(w),
            (Model::Poly(m), _) => m.freqresp(i, w),
            (Model::Process(m), _) => m.transfer().freqresp(w),
            (Model::Transfer(m), _) => m.freqresp(w),
        }
    }

    /// Poles: in `z` for a polynomial model, else in 1/s.
    pub fn poles(&self) -> Vec<(f64, f64)> {
        match self {
            Model::Poly(m) => m.poles(),
            Model::Process(m) => m.transfer().poles(),
            Model::Transfer(m) => m.poles(),
        }
    }

    /// Zeros from input `i`, in the plane of the poles.
    pub fn zeros(&self, i: usize) -> Vec<(f64, f64)> {
        match self {
            Model::Poly(m) => crate::poly::roots(&m.B[i]),
            Model::Process(m) => m.transfer().zeros(),
            Model::Transfer(m) => m.zeros(),
        }
    }

    /// Static gain of each input; infinite for an integrator.
    pub fn dc_gain(&self) -> Vec<f64> {
        match self {
            Model::Poly(m) => (0..m.B.len()).map(|i| m.dc_gain(i)).collect(),
            Model::Process(m) => vec![m.transfer().dc_gain()],
            Model::Transfer(m) => vec![m.dc_gain()],
        }
    }

    /// Response to a unit step of input `i` at time 0, at the given times.
    pub fn step_response(&self, i: usize, t: &[f64]) -> Vec<f64> {
        match (self, self.first_order()) {
            (_, Some(m)) => t.iter().map(|&t| m.step_response(t)).collect(),
            (Model::Poly(m), _) => m.step_response(i, t),
            (Model::Process(m), _) => m.transfer().step_response(t),
            (Model::Transfer(m), _) => m.step_response(t),
        }
    }
}
