//! Process models by variable projection: `y = sum_i G_i u_i + O + free response + (C / D) e`.
//!
//! ```text
//! G = K (Tz s + 1) e^(-L s) / (s^i prod (T_k s + 1)),   U: the first two lags are T^2 s^2 + 2 zeta T s + 1
//! ```
//!
//! For given `T, zeta, L` the outputs of the unit-gain plants are simulated exactly ([`chain`]); gains, `K Tz`,
//! offset and the states of each segment follow by linear least squares. What is left is a problem in `ln T`,
//! `ln zeta` and `L` for Levenberg-Marquardt with Kaufman's projected Jacobian ([`search`]). Where y answers a
//! move at once with a slope the cost has a kink in `L` at every whole sample and several minima, so each delay
//! sample is searched as a cell of its own, from the best places of a correlation map ([`starts`]). With an
//! integrator the offset is a drift and the level one of the free states.
//!
//! The input before a segment is unknown, so residuals start where the delayed input lies in the segment.
//! A step test that begins at rest is the exception: there the plant starts in equilibrium with the input
//! held before, and no row is given away, for the rest is all that fixes the offset.
//!
//! Golub and Pereyra 1973; Kaufman 1975; source 001, 3.5.6; METHODS 2.2.
mod again;
mod chain;
mod code;
mod information;
mod irregular;
mod lower;
mod noise;
mod problem;
mod profile;
mod relation;
mod search;
mod starts;
mod steps;
mod summary;

pub use self::again::{Known, process_bootstrap, process_sandwich, robust_process};
pub use self::code::Code;
pub use self::information::{Information, information};
use self::problem::{Point, Problem};
use super::fit::{Fit, standard_deviations};
use crate::error::{Error, Result};
use crate::excitation::{LEAST_EXCITATION, check_input_motion, excitation_order, too_poor};
use crate::limits::Limits;
use crate::note::{Note, Place, rounded};
use crate::record::Record;

/// Pivots below this share mean that the data do not tell parameters apart.
const RANK_TOLERANCE: f64 = 1e-13;

/// What may be set.
#[derive(Clone, Debug, Default)]
pub struct ProcessOptions {
    /// Whether an offset is estimated.
    pub offset: bool,
    /// For which rows it is one and the same.
    pub offset_of: OffsetOf,
    /// Range of delays to search, s; a quarter of the longest segment, at most 200 samples, when absent.
    pub L: Option<(f64, f64)>,
    /// Orders of `C` and `D`; (0, 0) for white noise on the output.
    pub noise: (usize, usize),
}

/// Rows of a segment that has an offset of its own.
const LEAST_ROWS: usize = 10;

/// Rows that share an offset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OffsetOf {
    /// The whole record.
    #[default]
    All,
    /// Each segment has its own.
    Segments,
    /// The rows between two load steps, which are searched for.
    Steps,
}

impl OffsetOf {
    /// Rows of new offsets that are known before any search.
    ///
    /// Segments of a few rows share the offset of the one before.
    fn known(self, rec: &Record) -> Vec<usize> {
        let long = rec.segments().filter(|s| s.len() >= LEAST_ROWS);
        if self == OffsetOf::Segments { long.skip(1).map(|s| s.start).collect() } else { Vec::new() }
    }
}

/// Fits `K e^(-L s) / (T s + 1)` to a record with one input and one output.
pub fn p1d(rec: &Record, options: &ProcessOptions, limits: &Limits) -> Result<Fit> {
    process(rec, &[Code::P1D], options, limits)
}

/// Fits the structure of a code per input to the record's only output.
pub fn process(rec: &Record, codes: &[Code], options: &ProcessOptions, limits: &Limits) -> Result<Fit> {
    located(rec, codes, options, limits).map(|found| found.fit)
}

/// A fit, and where it was found.
struct Located<'r, 'a> {
    problem: Problem<'r, 'a>,
    point: Point,
    fit: Fit,
}

fn located<'r, 'a>(
    rec: &'r Record<'a>,
    codes: &[Code],
    options: &ProcessOptions,
    limits: &'r Limits,
) -> Result<Located<'r, 'a>> {
    check(rec, codes, options, limits)?;
    irregular::check(rec, codes, options.noise, limits)?;
    check_input_motion(rec, limits)?;
    let mut problem = Problem::new(rec, codes, options, limits)?;
    for (i, code) in codes.iter().enumerate() {
        let wanted = LEAST_EXCITATION.max(code.nonlinear() + code.linear());
        let supported = excitation_order(rec, i, wanted, limits.X02);
        if supported < LEAST_EXCITATION {
            return Err(too_poor(rec, i, supported, LEAST_EXCITATION, limits));
        }
    }
    let unrelated = |p: &Problem| p.unrelated(1.0);
    let mut drift = None;
    if options.offset_of == OffsetOf::Steps {
        drift = problem.find_steps();
    }
    let mut best = problem.minimum().ok_or_else(|| unrelated(&problem))?;
    if problem.contradicts_rest(&best) {
        problem = problem.without_rest();
        best = problem.minimum().ok_or_else(|| unrelated(&problem))?;
    }
    if options.noise != (0, 0) {
        best = problem.with_noise(options.noise, &best).ok_or_else(|| unrelated(&problem))?;
    }
    if let Some(pair) = problem.as_pair(rec, options, limits, &best) {
        return Ok(pair);
    }
    let mut fit = problem.fit(&best)?;
    fit.notes.extend(drift);
    Ok(Located { problem, point: best, fit })
}

impl Problem<'_, '_> {
    /// The minimum with a noise model, from the one without.
    fn with_noise(&mut self, orders: (usize, usize), white: &Point) -> Option<Point> {
        let start = noise::start(&self.residuals(white)?, orders);
        self.noise = orders;
        self.search([white.x.clone(), start].concat())
    }
}

impl<'r, 'a> Problem<'r, 'a> {
    /// The fit of a pair `T^2 s^2 + 2 zeta T s + 1` in place of the two closest lags, if `zeta` is within two
    /// standard deviations of 1 or below: there the deviations of the two lags are without bound, those of `T`
    /// and `zeta` are not.
    fn as_pair(
        &self,
        rec: &'r Record<'a>,
        options: &ProcessOptions,
        limits: &'r Limits,
        best: &Point,
    ) -> Option<Located<'r, 'a>> {
        let [code] = self.codes[..] else { return None };
        if code.pair || code.lags < 2 || self.t.is_some() {
            return None;
        }
        let mut ln_T = best.x[..code.lags].to_vec();
        ln_T.sort_by(f64::total_cmp);
        let close =
            (1..code.lags).min_by(|&i, &j| (ln_T[i] - ln_T[i - 1]).total_cmp(&(ln_T[j] - ln_T[j - 1])))?;
        let (a, b) = (ln_T[close - 1], ln_T[close]);
        ln_T.drain(close - 1..=close);
        let zeta = (0.5 * (b - a)).cosh();
        let x = [&[0.5 * (a + b)], ln_T.as_slice(), &[zeta.ln()], &best.x[code.lags..]].concat();

        let mut problem = Problem::new(rec, &[Code { pair: true, ..code }], options, limits).ok()?;
        if !self.stretches.iter().any(|s| s.at_rest) {
            problem = problem.without_rest();
        }
        problem.noise = self.noise;
        problem.steps.clone_from(&self.steps);
        let point = problem.search(x)?;
        let mut fit = problem.fit(&point).ok()?;
        let k = fit.names.iter().position(|name| name == "zeta")?;
        let sd = standard_deviations(&fit.P, fit.theta.len())[k];
        if fit.theta[k] - 2.0 * sd > 1.0 {
            return None;
        }
        fit.notes.push(Note::warning(
            "X10",
            format!(
                "two lags are not separable: quoted is their pair T^2 s^2 + 2 zeta T s + 1, zeta = {} +- {}, \
                 the sum of the lags is 2 zeta T",
                rounded(fit.theta[k]),
                rounded(sd)
            ),
        ));
        Some(Located { problem, point, fit })
    }
}

fn check(rec: &Record, codes: &[Code], options: &ProcessOptions, limits: &Limits) -> Result<()> {
    if rec.nu != codes.len() || rec.ny != 1 {
        return Err(Error::argument(
            "rec",
            format!("a record with {} inputs and {} outputs", rec.nu, rec.ny),
            &format!("one with {} and a single output", inputs(codes.len())),
        ));
    }
    if options.offset_of != OffsetOf::All && !options.offset {
        return Err(Error::argument("offset", "one for parts of the record", "true where it changes"));
    }
    if options.offset_of != OffsetOf::All && codes.iter().any(|code| code.integrating) {
        return Err(Error::argument(
            "offset",
            "one for parts of the record",
            "one for all where a plant integrates",
        )
        .remedy("offset=True: the drift of an integrating plant is one"));
    }
    let Some((low, high)) = options.L else { return Ok(()) };
    if !(low >= 0.0 && high >= low && high.is_finite()) {
        return Err(Error::argument(
            "L",
            format!("({low}, {high})"),
            "an ascending pair of seconds, at least 0",
        ));
    }
    let longest = limits.X05 * rec.N() as f64 * rec.Ts;
    if high < longest {
        return Ok(());
    }
    Err(Error::new(
        "X05",
        format!("delays up to {high} s are asked of a record of {} s", rec.N() as f64 * rec.Ts),
    )
    .at(Place::column("L"))
    .measured(high, longest)
    .remedy("record at least three times as long as the longest delay"))
}

fn inputs(n: usize) -> String {
    if n == 1 { "a single input".to_owned() } else { format!("{n} inputs, one for each code") }
}
