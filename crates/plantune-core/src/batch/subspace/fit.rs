//! The model in the record's units, its levels and its errors.

use super::super::fit::Status;
use super::data::Signals;
use super::order::{Tried, determinant};
use super::past_states::Matrices;
use crate::error::Result;
use crate::linalg::Matrix;
use crate::model::{Several, StateSpace};
use crate::note::Note;
use crate::record::Record;
use crate::sim::{OverRecord, Start, matrix_over_record};

/// A fitted model of states.
#[derive(Clone, Debug)]
pub struct SubspaceFit {
    /// The model.
    pub model: StateSpace,
    /// `O` in `y = G u + O`.
    pub offset: Vec<f64>, // (ny)
    /// Initial state of each segment.
    pub x0: Vec<Vec<f64>>, // (segments, n)
    /// Rows used.
    pub N: usize,
    /// Mean squared one-step error over all outputs.
    pub loss: f64,
    /// Determinant of the mean products of the one-step errors.
    pub V: f64,
    /// Free parameters, the offset not counted.
    pub parameters: usize,
    /// Singular values that show the order; of one output in its unit, of several in scaled units.
    pub singular_values: Vec<f64>,
    /// Orders tried, if it was not given.
    pub tried: Vec<Tried>,
    /// Block rows used.
    pub rows: usize,
    /// How it ended.
    pub status: Status,
    /// Doubts.
    pub notes: Vec<Note>,
}

impl Default for SubspaceFit {
    fn default() -> Self {
        let none = || Matrix::zeros(0, 0);
        SubspaceFit {
            model: StateSpace { A: none(), B: none(), C: none(), D: none(), K: none(), Ts: None },
            offset: Vec::new(),
            x0: Vec::new(),
            N: 0,
            loss: 0.0,
            V: 0.0,
            parameters: 0,
            singular_values: Vec::new(),
            tried: Vec::new(),
            rows: 0,
            status: Status::Exact,
            notes: Vec::new(),
        }
    }
}

/// The rest of a fit, from its matrices for the scaled signals; where `O` is not known, it and the initial
/// states are those of the simulation, else the states are those of the filter.
pub(super) fn finished(
    rec: &Record,
    signals: &Signals,
    matrices: Matrices,
    (direct, offset): (bool, bool),
    known: Option<Vec<f64>>,
    fit: SubspaceFit,
) -> Result<SubspaceFit> {
    let several = Several::States(unscaled(signals, matrices, rec.Ts));
    let none = (!offset).then(|| vec![0.0; rec.ny]);
    let simulated = match known {
        Some(_) => None,
        None => Some(matrix_over_record(&several, rec, None, Start::Estimate, none.as_deref())?),
    };
    let found = |runs: &Vec<OverRecord>| runs.iter().map(|run| run.offset).collect();
    let level = none.or(known).or(simulated.as_ref().map(found)).unwrap_or_default();
    let predicted = matrix_over_record(&several, rec, Some(1), Start::Estimate, Some(&level))?;
    let errors: Vec<Vec<f64>> = predicted
        .iter()
        .enumerate()
        .map(|(i, run)| {
            let rows = run.rows.iter().zip(&run.yhat).filter(|(t, _)| rec.is_valid(**t, i));
            rows.map(|(t, yhat)| rec.y_at(*t, i) - yhat).collect()
        })
        .collect();
    let mean = |e: &Vec<f64>| e.iter().map(|e| e * e).sum::<f64>() / e.len().max(1) as f64;
    let model = several.state_space();
    Ok(SubspaceFit {
        parameters: model.parameters(direct) + model.n() * rec.ny,
        x0: simulated.as_ref().unwrap_or(&predicted)[0].x0.clone(),
        N: predicted[0].rows.len(),
        loss: errors.iter().map(mean).sum::<f64>() / rec.ny as f64,
        V: determinant(&errors),
        offset: level,
        model,
        ..fit
    })
}

/// `B / u`, `y C`, `y D / u`, `K / y` with the units of the columns.
fn unscaled(signals: &Signals, m: Matrices, Ts: f64) -> StateSpace {
    let (u, y) = (|j: usize| signals.u[j].unit, |i: usize| signals.y[i].unit);
    let K = m.K.unwrap_or_else(|| Matrix::zeros(m.A.nrows(), m.C.nrows()));
    StateSpace {
        B: Matrix::from_fn(m.B.nrows(), m.B.ncols(), |i, j| m.B[(i, j)] / u(j)),
        C: Matrix::from_fn(m.C.nrows(), m.C.ncols(), |i, j| y(i) * m.C[(i, j)]),
        D: Matrix::from_fn(m.D.nrows(), m.D.ncols(), |i, j| y(i) * m.D[(i, j)] / u(j)),
        K: Matrix::from_fn(K.nrows(), K.ncols(), |i, j| K[(i, j)] / y(j)),
        A: m.A,
        Ts: Some(Ts),
    }
}
