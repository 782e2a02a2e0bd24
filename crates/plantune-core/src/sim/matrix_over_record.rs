//! A model of several outputs run over a record: simulated, or predicted some steps ahead.
//!
//! What is not known of a segment's start enters the simulation as its state, or as impulses into `A(q)^-1` at
//! its first rows, estimated by least squares from all outputs, each weighed by its travel. A prediction `k`
//! steps ahead runs the difference equation from the rows measured until `t - k`, or the states from their
//! filter there ([`super::states_ahead`]); a value that does not count is replaced by its one-step prediction.

use std::ops::Range;

use super::over_record::{OverRecord, Start};
use super::states_ahead::states_ahead;
use crate::error::{Error, Result};
use crate::linalg::{Block, Segmented, Triangle, solve};
use crate::model::{MatrixPoly, Several};
use crate::record::{Record, Scale};

/// Runs `model` over `rec`, one answer per output: `horizon = None` simulates.
///
/// `offset = None` estimates the offsets, from the simulation in either case.
pub fn matrix_over_record(
    model: &Several,
    rec: &Record,
    horizon: Option<usize>,
    start: Start,
    offset: Option<&[f64]>,
) -> Result<Vec<OverRecord>> {
    let model = &model.clone().at_sample_time(rec.Ts)?;
    check(model, rec, horizon)?;
    let history = model.history();
    let segments: Vec<Range<usize>> = rec.segments().filter(|s| s.len() > history).collect();
    if segments.is_empty() {
        let text = format!("no segment is longer than the model's {history} rows of history");
        return Err(Error::new("X03", text)
            .measured(rec.N() as f64, history as f64 + 1.0)
            .remedy("give a longer record"));
    }
    let simulated =
        (horizon.is_none() || offset.is_none()).then(|| simulated(model, rec, start, offset, &segments));
    let level = match (&simulated, offset) {
        (_, Some(known)) => known.to_vec(),
        (Some(run), None) => run.offset.clone(),
        (None, None) => vec![0.0; model.ny()],
    };
    let run = match (horizon, simulated) {
        (None, Some(run)) => run,
        (steps, _) => {
            let steps = steps.unwrap_or(1);
            match model {
                Several::Poly(m) => predicted(m, rec, steps, level, &segments),
                Several::States(m) => states_ahead(m, rec, steps, start, level, &segments),
            }
        }
    };
    let column = |i: usize| run.yhat.iter().skip(i).step_by(model.ny()).copied().collect();
    Ok((0..model.ny())
        .map(|i| OverRecord {
            rows: run.rows.clone(),
            yhat: column(i),
            offset: run.offset[i],
            x0: run.x0.clone(),
        })
        .collect())
}

/// All outputs on the rows with history.
pub(super) struct Run {
    pub rows: Vec<usize>,
    pub yhat: Vec<f64>, // (rows, ny)
    pub offset: Vec<f64>,
    pub x0: Vec<Vec<f64>>,
}

fn check(model: &Several, rec: &Record, horizon: Option<usize>) -> Result<()> {
    if (rec.nu, rec.ny) != (model.nu(), model.ny()) {
        return Err(Error::argument(
            "rec",
            format!("a record with {} inputs and {} outputs", rec.nu, rec.ny),
            &format!("one with {} and {}, like the model", model.nu(), model.ny()),
        ));
    }
    if horizon == Some(0) {
        return Err(Error::argument("horizon", 0, "at least 1, or None to simulate"));
    }
    Ok(())
}

fn simulated(
    model: &Several,
    rec: &Record,
    start: Start,
    offset: Option<&[f64]>,
    segments: &[Range<usize>],
) -> Run {
    let (ny, history) = (model.ny(), model.history());
    let local = if start == Start::Estimate { model.starts() } else { 0 };
    let shared = if offset.is_none() { ny } else { 0 };
    let known = offset.map_or(vec![0.0; ny], <[f64]>::to_vec);
    let weights: Vec<f64> = (0..ny).map(|i| Scale::of(&rec.output_held(i), true).factor).collect();
    let longest = segments.iter().map(Range::len).max().unwrap_or(0);
    let free = model.free(longest - history);
    let forced: Vec<Vec<f64>> =
        segments.iter().map(|s| model.forced(&rec.u[s.start * rec.nu..s.end * rec.nu])).collect();

    let mut problem = Segmented::new(local, shared);
    for (s, forced) in segments.iter().zip(&forced) {
        let width = local + shared + 1;
        let (mut triangle, mut block) = (Triangle::new(width), Block::new(width));
        for (k, t) in (s.start + history..s.end).enumerate() {
            for i in (0..ny).filter(|&i| rec.is_valid(t, i)) {
                let free = free[..local].iter().map(|free| free[k * ny + i]);
                let unit = (0..shared).map(|j| f64::from(u8::from(i == j)));
                let left = rec.y_at(t, i) - known[i] - forced[k * ny + i];
                let row: Vec<f64> = free.chain(unit).chain([left]).map(|x| weights[i] * x).collect();
                block.push(&row);
            }
        }
        triangle.absorb(&mut block);
        problem.push(triangle);
    }
    let every: Vec<usize> = (0..shared).collect();
    let extra = if shared == 0 {
        Vec::new()
    } else {
        solve(problem.common(), &every, shared, 0.0).map_or_else(|_| vec![0.0; ny], |s| s.theta)
    };
    let x0 = problem.locals(&extra);

    let offset: Vec<f64> = known.iter().enumerate().map(|(i, o)| o + extra.get(i).unwrap_or(&0.0)).collect();
    let mut run = Run { rows: Vec::new(), yhat: Vec::new(), offset, x0 };
    for ((s, forced), x0) in segments.iter().zip(&forced).zip(&run.x0) {
        for (k, t) in (s.start + history..s.end).enumerate() {
            run.rows.push(t);
            for i in 0..ny {
                let own: f64 = x0.iter().zip(&free).map(|(x, free)| x * free[k * ny + i]).sum();
                run.yhat.push(run.offset[i] + forced[k * ny + i] + own);
            }
        }
    }
    run
}

fn predicted(
    model: &MatrixPoly,
    rec: &Record,
    steps: usize,
    offset: Vec<f64>,
    segments: &[Range<usize>],
) -> Run {
    let (ny, history) = (model.ny, model.history());
    let mut run = Run { rows: Vec::new(), yhat: Vec::new(), offset, x0: Vec::new() };
    for s in segments {
        let u = &rec.u[s.start * rec.nu..s.end * rec.nu];
        let measured = filled(model, rec, s.clone(), &run.offset);
        let mut window = measured.clone();
        for k in history..s.len() {
            let known = (k + 1).saturating_sub(steps).max(history);
            for row in known..=k {
                let next = model.next(&window, u, row);
                window[row * ny..][..ny].copy_from_slice(&next);
            }
            run.rows.push(s.start + k);
            run.yhat.extend(window[k * ny..][..ny].iter().zip(&run.offset).map(|(y, o)| y + o));
            window[known * ny..(k + 1) * ny].copy_from_slice(&measured[known * ny..(k + 1) * ny]);
        }
    }
    run
}

/// Outputs of a segment without their offset, one-step predictions in place of what does not count.
fn filled(model: &MatrixPoly, rec: &Record, s: Range<usize>, offset: &[f64]) -> Vec<f64> {
    let ny = model.ny;
    let u = &rec.u[s.start * rec.nu..s.end * rec.nu];
    let mut y: Vec<f64> = rec.y[s.start * ny..s.end * ny]
        .chunks(ny)
        .flat_map(|row| row.iter().zip(offset).map(|(y, o)| y - o).collect::<Vec<f64>>())
        .collect();
    for k in (model.history()..s.len()).filter(|k| (0..ny).any(|i| !rec.is_valid(s.start + k, i))) {
        let next = model.next(&y, u, k);
        for i in (0..ny).filter(|&i| !rec.is_valid(s.start + k, i)) {
            y[k * ny + i] = next[i];
        }
    }
    y
}
