//! Impulse response of each input without a model: least squares, or regularised by a prior.
//!
//! ```text
//! y(t) = O + sum_i sum_k g_ik u_i(t-k) + v(t),   D(q) v(t) = e(t)
//! step  s_k = g_1 + … + g_k,   gain  sum_k g_k
//! ```
//!
//! With a kernel ([`Kernel`]) the taps have a prior whose size, decay and number of dead taps have the most
//! evidence ([`evidence`], [`search`]); several inputs have a prior each, found in turns. Errors of a first
//! response give `D`, and both signals are filtered by it once: under coloured noise intervals of the gain
//! covered the truth in 30 % instead of 93 %. Bands come from TC, averaged over the counts of dead taps: those of
//! SS are too narrow where the response dies away (63 to 86 % of 95), those of DC a little.
//!
//! Chen, Ohlsson and Ljung, Automatica 48 (2012); Chen and Ljung, Automatica 49 (2013); METHODS 2.3.

mod evidence;
mod kernels;
mod least_squares;
mod posterior;
mod rows;
mod search;
mod system;

pub use kernels::Kernel;

use self::posterior::{Taps, averaged, posterior};
pub(super) use self::rows::Rows;
use self::system::System;
use crate::batch::{WIDTH, standard_deviations};
use crate::error::{Error, Result};
use crate::excitation::check_input_motion;
use crate::limits::Limits;
use crate::note::{Note, Place};
use crate::record::Record;
use crate::signal::autoregression;

/// Largest order of the noise model.
const MOST_NOISE: usize = 10;

/// Share of the gain that may lie beyond the last tap.
const OPEN: f64 = 0.05;

/// What is asked for.
#[derive(Clone, Debug)]
pub struct ImpulseOptions {
    /// Number of taps.
    pub n: usize,
    /// Prior; least squares without one.
    pub kernel: Option<Kernel>,
    /// Lag of the first tap: 0 where y may jump with u, else 1.
    pub first: usize,
    /// Delay in samples where it is known: taps before it are zero.
    pub nk: Option<usize>,
    /// Whether both signals are filtered so that the errors are white.
    pub whiten: bool,
}

/// The response to an impulse of one input.
#[derive(Clone, Debug)]
pub struct PathResponse {
    /// Taps.
    pub g: Vec<f64>, // (n)
    /// Their standard deviations.
    pub sd: Vec<f64>, // (n)
    /// Their covariance.
    pub P: Vec<f64>, // (n, n)
    /// Their running sum.
    pub step: Vec<f64>, // (n)
    /// Its standard deviations.
    pub step_sd: Vec<f64>, // (n)
    /// Delay in samples with the most weight.
    pub nk: usize,
    /// Weight of each delay, from the first lag on; empty of least squares.
    pub weights: Vec<f64>,
    /// Size of the prior, squared units of `g`; none of least squares.
    pub c: Option<f64>,
    /// Its decay.
    pub lam: Option<f64>,
    /// Its correlation, of DC.
    pub rho: Option<f64>,
}

/// Impulse responses of all inputs to one output.
#[derive(Clone, Debug)]
pub struct ImpulseResponse {
    /// Lag of the first tap.
    pub first: usize,
    /// One per input.
    pub responses: Vec<PathResponse>,
    /// Standard deviation of the white errors.
    pub noise_sd: f64,
    /// `D(q)`, by which both signals were filtered; monic.
    pub D: Vec<f64>,
    /// `-2 ln p` of the outputs up to a constant; none of least squares.
    pub evidence: Option<f64>,
    /// Rows used.
    pub N: usize,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Estimates the impulse responses from all inputs to one output.
pub fn impulse(
    rec: &Record,
    output: usize,
    options: &ImpulseOptions,
    limits: &Limits,
) -> Result<ImpulseResponse> {
    check(rec, output, options)?;
    check_input_motion(rec, limits)?;
    let plain = enough(Rows::new(rec, output, options.first, options.n, vec![1.0]))?;
    let D = if options.whiten { noise_model(&plain) } else { vec![1.0] };
    let rows = if D.len() > 1 { enough(plain.with(D))? } else { plain };
    let mut found = match options.kernel {
        None => least_squares::least_squares(&rows, limits)?,
        Some(kernel) => regularised(&rows, kernel, options),
    };
    found.notes = notes(rec, &found);
    Ok(found)
}

fn check(rec: &Record, output: usize, options: &ImpulseOptions) -> Result<()> {
    if options.n == 0 {
        return Err(Error::argument("n", options.n, "at least 1"));
    }
    if output >= rec.ny {
        return Err(Error::argument("output", output, &format!("below the number of outputs, {}", rec.ny)));
    }
    let last = options.first + options.n - 1;
    match options.nk {
        Some(nk) if nk < options.first || nk > last => {
            Err(Error::argument("nk", nk, &format!("from {} to {last}, the lags of the taps", options.first)))
        }
        _ => Ok(()),
    }
}

/// X03: fewer rows than taps.
fn enough<'r, 'a>(rows: Rows<'r, 'a>) -> Result<Rows<'r, 'a>> {
    let (N, needed) = (rows.N(), rows.needed());
    if N > needed {
        return Ok(rows);
    }
    let fit = rows.most_taps();
    let error = Error::new(
        "X03",
        format!("{N} rows have {} taps behind them, more than {needed} are needed", rows.n),
    )
    .at(Place::column("n"))
    .count(N)
    .measured(N as f64, needed as f64 + 1.0);
    Err(if fit > 0 {
        error.remedy(format!("ask for n = {fit} taps at most, or record longer"))
    } else {
        error.remedy("record longer")
    })
}

/// `D(q)` of the errors: from y on its own past beside all taps, which feedback does not bias; where there are few
/// rows for that, from the errors of a first regularised response.
fn noise_model(rows: &Rows) -> Vec<f64> {
    if let Some(D) = rows.noise_model(MOST_NOISE) {
        return D;
    }
    let (triangle, units) = rows.triangle();
    let system = System::new(triangle, rows.n, rows.N());
    let taps = |(i, unit): (usize, &f64)| -> Vec<f64> {
        posterior(&system.seen(i), &system.priors[i]).g.iter().map(|g| g * unit).collect()
    };
    let g: Vec<Vec<f64>> = units.iter().enumerate().map(taps).collect();
    autoregression(&rows.residual(&g), &rows.runs(), MOST_NOISE)
}

fn regularised(rows: &Rows, kernel: Kernel, options: &ImpulseOptions) -> ImpulseResponse {
    let (triangle, scales) = rows.triangle();
    let mut system = System::new(triangle, rows.n, rows.N());
    let counted = system.by_dead_taps(options.nk.map(|nk| nk - options.first));
    let mut found = ImpulseResponse {
        first: options.first,
        responses: Vec::new(),
        noise_sd: 0.0,
        D: rows.D.clone(),
        evidence: None,
        N: rows.N(),
        notes: Vec::new(),
    };
    for (i, (counted, &unit)) in counted.iter().zip(&scales).enumerate() {
        let (seen, mut prior) = (system.seen(i), system.priors[i]);
        let weights = search::weights(counted);
        let mut taps = averaged(&seen, counted, &weights);
        if kernel != Kernel::Tc {
            prior = search::best(&seen, kernel, prior.dead);
            taps.g = posterior(&seen, &prior).g;
        }
        let mut response = response(taps, unit, options.first + prior.dead);
        response.weights = vec![0.0; counted.last().map_or(0, |last| last.dead + 1)];
        counted.iter().zip(weights).for_each(|(prior, weight)| response.weights[prior.dead] = weight);
        response.lam = Some(prior.lam);
        response.rho = (kernel == Kernel::Dc).then_some(prior.rho);
        response.c = Some(prior.c * prior.s2 * unit * unit);
        found.responses.push(response);
        // In the record's units: y was scaled.
        found.evidence = Some(prior.cost - 2.0 * (rows.N() - 1) as f64 * rows.y_factor().ln());
        found.noise_sd = prior.s2.sqrt() / rows.y_factor();
    }
    found
}

/// Taps in the record's units, and what follows from them.
fn response(taps: Taps, unit: f64, nk: usize) -> PathResponse {
    let n = taps.g.len();
    let g: Vec<f64> = taps.g.iter().map(|g| g * unit).collect();
    let P: Vec<f64> = taps.P.iter().map(|p| p * unit * unit).collect();
    let (mut step, mut step_sd) = (Vec::with_capacity(n), Vec::with_capacity(n));
    let (mut sum, mut variance) = (0.0, 0.0);
    for k in 0..n {
        sum += g[k];
        variance += P[k * n + k] + 2.0 * P[k * n..k * n + k].iter().sum::<f64>();
        step.push(sum);
        step_sd.push(variance.max(0.0).sqrt());
    }
    PathResponse {
        sd: standard_deviations(&P, n),
        g,
        P,
        step,
        step_sd,
        nk,
        weights: Vec::new(),
        c: None,
        lam: None,
        rho: None,
    }
}

/// X07 where a response has not died away, one per input.
fn notes(rec: &Record, found: &ImpulseResponse) -> Vec<Note> {
    let open = |(i, response): (usize, &PathResponse)| {
        let n = response.g.len();
        let (last, sd) = (response.g[n - 1], response.P[n * n - 1].sqrt());
        // What a last tap would still add if it died away as slowly as the prior allows.
        let lam = response.lam?;
        let missing = last.abs() * lam.sqrt() / (1.0 - lam.sqrt());
        let share = missing / response.step[n - 1].abs().max(f64::MIN_POSITIVE);
        (last.abs() > WIDTH * sd && share > OPEN).then(|| {
            let name = rec.input_name(i);
            Note::warning(
                "X07",
                format!(
                    "the response to {name} has not died away after {n} taps: its gain is that of these taps"
                ),
            )
            .at(Place::column(name))
            .count(n)
            .measured(share, OPEN)
            .remedy(format!("ask for more taps: n={}", 2 * n))
        })
    };
    found.responses.iter().enumerate().filter_map(open).collect()
}
