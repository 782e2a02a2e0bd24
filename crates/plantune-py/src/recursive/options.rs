//! Keywords that the estimators share.

use numpy::{AllowTypeChange, PyArrayLike1, PyArrayLike2, PyUntypedArrayMethods};
use plantune_core::Error;
use plantune_core::recursive::{CLIP, Gate, Scheme, Settings, Structure};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::bank::is_rml;
use crate::error::Outcome;

/// A scalar is times identity.
#[derive(FromPyObject)]
pub enum Covariance<'py> {
    Scalar(f64),
    Matrix(PyArrayLike2<'py, f64, AllowTypeChange>),
}

impl Covariance<'_> {
    /// `(n, n)`, row-major.
    pub fn matrix(&self, n: usize) -> Outcome<Vec<f64>> {
        match self {
            Covariance::Scalar(P0) if *P0 > 0.0 && *P0 <= 1e100 => {
                Ok((0..n * n).map(|k| if k / n == k % n { *P0 } else { 0.0 }).collect())
            }
            Covariance::Scalar(P0) => Err(Error::argument("P0", P0, "positive, and at most 1e100").into()),
            Covariance::Matrix(P0) if P0.shape() == [n, n] => Ok(P0.as_array().iter().copied().collect()),
            Covariance::Matrix(P0) => {
                let needed = format!("a number, or of shape ({n}, {n})");
                Err(Error::argument("P0", format!("of shape {:?}", P0.shape()), &needed).into())
            }
        }
    }
}

/// One number for all parameters, or one for each.
#[derive(FromPyObject, IntoPyObject, Clone)]
pub enum Each {
    One(f64),
    All(Vec<f64>),
}

/// Yes, no, or at which standard deviation.
#[derive(FromPyObject, IntoPyObject, Clone, Copy)]
pub enum At {
    Flag(bool),
    Level(f64),
}

/// How an estimator forgets.
#[derive(Clone)]
pub struct Forget {
    pub forgetting: String,
    pub lam: f64,
    pub lam0: Option<f64>,
    pub rho: Option<f64>,
    pub R1: Option<Each>,
    pub R2: f64,
}

impl Forget {
    /// The scheme for `n` parameters; `growing` is what a factor begins with and how it grows, unless told.
    pub fn scheme(&self, n: usize, growing: (f64, f64)) -> Outcome<Scheme> {
        let lambda = self.lam;
        let only = |name: &str, whose: &str| {
            Error::argument(name, "given", &format!("left out but with forgetting=\"{whose}\""))
        };
        if self.forgetting != "exponential" && (self.lam0.is_some() || self.rho.is_some()) {
            return Err(only("lam0, rho", "exponential").into());
        }
        if self.forgetting != "kalman" && (self.R1.is_some() || self.R2 != 1.0) {
            return Err(only("R1, R2", "kalman").into());
        }
        Ok(match self.forgetting.as_str() {
            "exponential" => {
                let start = self.lam0.unwrap_or(growing.0.min(lambda));
                Scheme::Exponential { lambda, start, rho: self.rho.unwrap_or(growing.1) }
            }
            "directional" => Scheme::Directional { lambda },
            "variable" => Scheme::Variable { lambda },
            "kalman" if lambda == 1.0 => {
                let R1 = match &self.R1 {
                    None => vec![0.0; n],
                    Some(Each::One(R1)) => vec![*R1; n],
                    Some(Each::All(R1)) => R1.clone(),
                };
                Scheme::Kalman { R1, R2: self.R2 }
            }
            "kalman" => return Err(Error::argument("lam", lambda, "1 with a random walk: R1 forgets").into()),
            other => {
                let needed = "\"exponential\", \"directional\", \"variable\" or \"kalman\"";
                return Err(Error::argument("forgetting", format!("\"{other}\""), needed).into());
            }
        })
    }
}

/// Keywords of the family, but for where it starts.
#[derive(Clone, IntoPyObject)]
pub struct Options {
    method: Option<String>,
    lam: f64,
    offset: bool,
    Ts: Option<f64>,
    forgetting: String,
    lam0: Option<f64>,
    rho: Option<f64>,
    R1: Option<Each>,
    R2: f64,
    clip: Option<f64>,
    alarm: bool,
    gate: Option<At>,
    window: Option<usize>,
    P_max: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            method: None,
            lam: 1.0,
            offset: true,
            Ts: None,
            forgetting: "exponential".to_owned(),
            lam0: None,
            rho: None,
            R1: None,
            R2: 1.0,
            clip: Some(CLIP),
            alarm: true,
            gate: None,
            window: None,
            P_max: None,
        }
    }
}

/// Where an estimator starts.
#[derive(Default)]
pub struct Start<'py> {
    P0: Option<Covariance<'py>>,
    theta0: Option<PyArrayLike1<'py, f64, AllowTypeChange>>,
}

/// Share of the memory that the window of the gate is.
const MEMORIES: f64 = 2.0;

/// The window of the gate is not shorter than this, nor longer than that.
const WINDOW: (f64, f64) = (20.0, 10_000.0);

impl Options {
    /// From keywords; U01 for one that the class `kind` does not know.
    pub fn read<'py>(kind: &str, keywords: Option<&Bound<'py, PyDict>>) -> Outcome<(Self, Start<'py>)> {
        let (mut o, mut start) = (Options::default(), Start::default());
        for (name, value) in keywords.into_iter().flatten() {
            let name: String = name.extract()?;
            let wrong = |needed: &str| Error::argument(&name, &value, needed);
            let number = || value.extract::<f64>().map_err(|_| wrong("a number"));
            let or_none = || value.extract::<Option<f64>>().map_err(|_| wrong("a number or None"));
            let flag = || value.extract::<bool>().map_err(|_| wrong("True or False"));
            let word = || value.extract::<String>().map_err(|_| wrong("a word"));
            match name.as_str() {
                "method" if kind == "ARMAX" => o.method = value.extract().map_err(|_| wrong("a word"))?,
                "lam" => o.lam = number()?,
                "offset" => o.offset = flag()?,
                "Ts" => o.Ts = or_none()?,
                "forgetting" => o.forgetting = word()?,
                "lam0" => o.lam0 = or_none()?,
                "rho" => o.rho = or_none()?,
                "R1" => o.R1 = value.extract().map_err(|_| wrong("a number, or one per parameter"))?,
                "R2" => o.R2 = number()?,
                "clip" => o.clip = or_none()?,
                "alarm" => o.alarm = flag()?,
                "gate" => o.gate = value.extract().map_err(|_| wrong("True, False or a number"))?,
                "window" => o.window = value.extract().map_err(|_| wrong("a number of samples"))?,
                "P_max" => o.P_max = or_none()?,
                "P0" => start.P0 = value.extract().map_err(|_| wrong("a number or a matrix"))?,
                "theta0" => start.theta0 = value.extract().map_err(|_| wrong("an array"))?,
                "regressors" if kind == "ARX" => {
                    let text = "ARX takes no regressors of one's own";
                    return Err(Error::new("U01", text).remedy("recursive.TermARX takes them").into());
                }
                _ => {
                    let text = format!("{kind} has no keyword `{name}`");
                    return Err(Error::new("U01", text).remedy(format!("see help(recursive.{kind})")).into());
                }
            }
        }
        if let Some(Ts) = o.Ts.filter(|Ts| !(*Ts > 0.0 && Ts.is_finite())) {
            return Err(Error::argument("Ts", Ts, "a positive number of seconds").into());
        }
        Ok((o, start))
    }

    pub fn offset(&self) -> bool {
        self.offset
    }

    pub fn Ts(&self) -> Option<f64> {
        self.Ts
    }

    /// The core's settings for these orders.
    pub fn settings(&self, structure: Structure, start: &Start<'_>) -> Outcome<Settings> {
        let n = structure.n();
        let Options { forgetting, lam, lam0, rho, R1, R2, .. } = self.clone();
        let growing = match structure {
            Structure { nc: 0, nd: 0, nf: 0, .. } => (1.0, 0.99),
            Structure { nf: 0, .. } => (0.95, 0.99),
            _ => (0.9, 0.995),
        };
        let scheme = Forget { forgetting, lam, lam0, rho, R1, R2 }.scheme(n, growing)?;
        let gradient = self.method.as_deref().map_or(Ok(true), is_rml)?;
        Ok(Settings {
            gradient,
            P0: start.P0.as_ref().map(|P0| P0.matrix(n)).transpose()?,
            theta0: start.theta0.as_ref().map(|theta| theta.as_array().to_vec()),
            P_max: self.P_max,
            clip: self.clip,
            watch: self.alarm,
            gate: self.gate(structure, &scheme)?,
            scheme,
        })
    }

    /// The gate, which is closed by default only to what forgets.
    fn gate(&self, structure: Structure, scheme: &Scheme) -> Outcome<Option<Gate>> {
        let level = match self.gate {
            None if !scheme.forgets() => return Ok(None),
            Some(At::Flag(false)) => return Ok(None),
            None | Some(At::Flag(true)) => None,
            Some(At::Level(level)) => Some(level),
        };
        let memory = MEMORIES / (1.0 - scheme.lambda());
        let lags = structure.nk + structure.nb;
        let window = memory.clamp(WINDOW.0, WINDOW.1) as usize + lags;
        Ok(Some(Gate::new(self.window.unwrap_or(window), level)?))
    }
}
