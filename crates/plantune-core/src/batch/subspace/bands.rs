//! How far subspace estimates scatter: models fitted to records that could have been.
//!
//! ```text
//! y*(t) = y(t) + H(q) (e*(t) - e(t)),   H = C (q I - A)^-1 K + I
//! e*: blocks of b rows of the one-step errors of all outputs, centred, times sqrt(N/(N - d))
//! ```
//!
//! The entries of `A B C D` have no meaning of their own, so nothing is said of them; what is read off the models
//! drawn is (gain, step, frequency response). Left out: the bias of a too low order or of feedback, and the
//! choice of the order itself. Künsch 1989; the length of a block as in [`super::super::bootstrap`].

use super::{SubspaceFit, SubspaceOptions, subspace};
use crate::batch::BootstrapOptions;
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{Random, dot};
use crate::model::{Several, StateSpace};
use crate::record::Record;
use crate::sim::{Start, matrix_over_record};

/// Fits so many drawn records as the model was fitted; also the rows in a block.
pub fn subspace_bands(
    rec: &Record,
    (model, offset): (&StateSpace, &[f64]),
    options: SubspaceOptions,
    draws: &BootstrapOptions,
    limits: &Limits,
) -> Result<(Vec<SubspaceFit>, usize)> {
    let several = Several::States(model.clone());
    let runs = matrix_over_record(&several, rec, Some(1), Start::Estimate, Some(offset))?;
    let l = rec.ny;
    let rows = &runs[0].rows;
    let error = |k: usize, i: usize| {
        let t = rows[k];
        if rec.is_valid(t, i) { rec.y_at(t, i) - runs[i].yhat[k] } else { 0.0 }
    };
    let e: Vec<Vec<f64>> = (0..l).map(|i| (0..rows.len()).map(|k| error(k, i)).collect()).collect();
    let N = rows.len();
    let block = draws.block.unwrap_or_else(|| e.iter().map(|e| memory(e)).max().unwrap_or(1));
    if !(1..=N).contains(&block) {
        return Err(Error::argument("block", block, &format!("in [1, {N}], the number of residuals")));
    }
    if draws.runs < 2 {
        return Err(Error::argument("runs", draws.runs, "2 or more"));
    }
    let size = (N as f64 / N.saturating_sub(model.parameters(options.direct) / l).max(1) as f64).sqrt();
    let mean: Vec<f64> = e.iter().map(|e| e.iter().sum::<f64>() / N as f64).collect();
    let noise = Noise { model, rec, rows };
    let mut random = Random::new(draws.seed);
    let mut fits = Vec::with_capacity(draws.runs);
    for _ in 0..draws.runs {
        let from = places(N, block, &mut random);
        let change = |k: usize, i: usize| size * (e[i][from[k]] - mean[i]) - e[i][k];
        let y = noise.added((0..N).map(|k| (0..l).map(|i| change(k, i)).collect()).collect());
        let drawn = Record { y: &y, ..rec.clone() };
        fits.extend(subspace(&drawn, Some(model.n()), options, limits).ok());
    }
    if fits.len() < draws.runs.div_ceil(2) {
        return Err(Error::new("N05", "most of the drawn records could not be fitted")
            .count(draws.runs - fits.len())
            .remedy("ask for a lower order"));
    }
    Ok((fits, block))
}

/// Rows in a block: `(sqrt(6) r/(1 - r^2))^(2/3) N^(1/3)`, `r` the correlation of neighbours.
fn memory(e: &[f64]) -> usize {
    let N = e.len();
    let power = dot(e, e);
    let r = if power > 0.0 { (dot(&e[1..], &e[..N - 1]) / power).abs().min(0.99) } else { 0.0 };
    if r <= 2.0 / (N as f64).sqrt() {
        return 1;
    }
    let length = (6f64.sqrt() * r / (1.0 - r * r)).powf(2.0 / 3.0) * (N as f64).cbrt();
    (length.round() as usize).clamp(1, N / 4 + 1)
}

/// Where each residual comes from: blocks that may start anywhere.
fn places(N: usize, block: usize, random: &mut Random) -> Vec<usize> {
    let mut from = Vec::with_capacity(N + block);
    while from.len() < N {
        let first = random.below(N - block + 1);
        from.extend(first..first + block);
    }
    from.truncate(N);
    from
}

/// What the innovations of a model add to a record.
struct Noise<'a> {
    model: &'a StateSpace,
    rec: &'a Record<'a>,
    rows: &'a [usize],
}

impl Noise<'_> {
    /// The outputs with other innovations, the changes `(N, ny)` given.
    fn added(&self, change: Vec<Vec<f64>>) -> Vec<f64> {
        let (n, l) = (self.model.n(), self.rec.ny);
        // Innovations are the inputs of (A, K, C, I).
        let filter = StateSpace {
            B: self.model.K.clone(),
            D: crate::linalg::Matrix::identity(l, l),
            ..self.model.clone()
        };
        let mut y = self.rec.y.to_vec();
        for s in self.rec.segments() {
            let first = self.rows.partition_point(|&t| t < s.start);
            let end = self.rows.partition_point(|&t| t < s.end);
            let added = filter.simulate(&change[first..end].concat(), &vec![0.0; n]);
            for (k, row) in (first..end).zip(added.chunks(l)) {
                let own = &mut y[self.rows[k] * l..][..l];
                own.iter_mut().zip(row).for_each(|(y, x)| *y += x);
            }
        }
        y
    }
}
