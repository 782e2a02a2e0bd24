//! Relay test: `K, T, L` of first order plus dead time from the limit cycle of a relay with two levels.
//!
//! For a positive gain (y changes its sign for a negative one), with `A = K (u_high - u_low)`, and y in its
//! settled cycle at `y_bottom` where u goes to `high` and at `y_top` where it goes to `low`:
//!
//! ```text
//! y_high = K u_high + O,  y_low = K u_low + O        where y would settle
//! p = y_high - y_top,     q = y_bottom - y_low
//! ```
//!
//! After a switching y goes on for L as before, and then to the other end:
//! `p = (A - q e^(-L/T)) e^(-(t_on - L)/T)`, and the same from the top down. That is
//!
//! ```text
//! p e^(t_on/T) + q = A e^(L/T) = q e^(t_off/T) + p                                                 (1)
//! ```
//!
//! or, in the relay's own terms `A = |K| (d1 + d2)`, `p = |K| d1 - h`, `q = |K| d2 - h`,
//! `t_on = T ln[(h/|K| - d2 + e^(L/T) (d1 + d2)) / (d1 - h/|K|)]`, and for `t_off` d1 and d2 exchanged.
//!
//! These are two equations for the four unknowns `K, T, L, O`. A third is the mean over whole periods:
//!
//! ```text
//! y_mean = K u_mean + O                                                                            (2)
//! y_high = y_mean + A t_off/(t_on + t_off),   y_low = y_mean - A t_on/(t_on + t_off)
//! ```
//!
//! so that `p` and `q` hold A alone, and (1) is linear in A for a given T, and then gives L. The last comes from
//! the offset, if an equilibrium `u0, y0` is known, or else from the balance of one half-cycle, that is from
//! `T y' = K u(t - L) + O - y` summed over the rows at `high`:
//!
//! ```text
//! K = (y_mean - y0) / (u_mean - u0) = int(y - y0) / int(u - u0)                                    (3)
//! (y_top - y_bottom) / (1 - e^(-Ts/T)) = (y_high - mean of y at high) t_on/Ts - A late             (4)
//! late = m + (e^(-(Ts-f)/T) - e^(-Ts/T)) / (1 - e^(-Ts/T)),  L = m Ts + f
//! ```
//!
//! For a short Ts (4) is `T (y_top - y_bottom) = (…) t_on - A L`. So all is left to one equation in T, solved by
//! bisection. Where `t_on = t_off`, (1) holds for every T and A: **a symmetric cycle does not tell gain from time
//! constant**, by whichever last equation, and is refused. With a dead time short against T the plant looks
//! like an integrator: (4) then says little of K and T beside their ratio; (3) says more, if the rest was one.
//!
//! A sampled relay switches a little beyond `r ± h`, and its half-cycles differ by a row. So `y_bottom` and `y_top`
//! are those of the record, and each equation is a mean over half-cycles, not one of their mean times: then all
//! four are exact for u held over the rows. Where the relay is faster than the record, its switchings lie up to a
//! sample before their rows, which the deviations include.
//!
//! The asymmetric relay: J. Berner, K. J. Åström and T. Hägglund, Towards a new generation of relay autotuners,
//! IFAC World Congress 2014; (1) inverts exactly what they approximate.
mod cycle;
mod invert;

use std::ops::Range;

use self::cycle::{Cycle, Rest, Switching};
use self::invert::Inversion;
use super::rules::ultimate;
use crate::batch::{Fit, ProcessOptions, p1d, standard_deviations};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::model::{Fopdt, Model};
use crate::note::{Note, Place, Severity, rounded};
use crate::record::Record;
use crate::sim::{Start, over_record};

/// Rows by which the half-cycles must differ in mean length.
const LEAST_ASYMMETRY: f64 = 1.0;

/// Standard deviations by which the inversion and the fit may differ.
const AGREE: f64 = 3.0;

/// Standard deviation, as a part of the value, from which on the inversion says little.
const VAGUE: f64 = 0.5;

/// How the offset is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Known {
    /// From an equilibrium, (3).
    Rest,
    /// From the asymmetry of the cycle, (4).
    Asymmetry,
}

impl Known {
    /// The word used in Python and in JSON.
    pub fn as_str(self) -> &'static str {
        match self {
            Known::Rest => "rest",
            Known::Asymmetry => "asymmetry",
        }
    }
}

/// What a relay test says.
#[derive(Clone, Debug)]
pub struct RelayTest {
    /// From the inversion.
    pub model: Fopdt,
    /// Standard deviations of its `K, T, L`.
    pub sd: [f64; 3],
    /// `O` in `y = G u + O`.
    pub offset: f64,
    /// How it is known.
    pub known: Known,
    /// The same plant from every row of the record; absent where that is refused, which a note says.
    pub fit: Option<Fit>,
    /// Ultimate gain, with the sign of `K`, and ultimate period of the model, s; NaN without dead time.
    pub ultimate: (f64, f64),
    /// Mean time at the upper and at the lower level, s.
    pub t_on: f64,
    /// See `t_on`.
    pub t_off: f64,
    /// Settled periods that were used.
    pub periods: usize,
    /// Their rows.
    pub rows: Range<usize>,
    /// Output of `model` on these rows.
    pub yhat: Vec<f64>,
    /// Output at which u went to the upper, and to the lower level.
    pub thresholds: (f64, f64),
    /// Lower and upper level of u.
    pub levels: (f64, f64),
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Inverts the limit cycle of a relay test and fits the same record; `rest` is an equilibrium `(u0, y0)`.
pub fn relay(rec: &Record, rest: Option<(f64, f64)>, limits: &Limits) -> Result<RelayTest> {
    check(rec, rest)?;
    let switching = Switching::of(rec, limits)?;
    let mut notes = Vec::new();
    let rest = match (rest, switching.rest()) {
        (Some((u0, y0)), _) => Some(Rest { u0, y0, rows: 0 }),
        (None, Some(Ok(rest))) => Some(rest),
        (None, Some(Err(drift))) => {
            notes.push(drift);
            None
        }
        (None, None) => None,
    };
    let (cycle, found) = inverted(rec, &switching, rest)?;
    let Inverted { model, offset, rows, yhat, sigma } = found;
    let sd = cycle.deviations(model.T, sigma).ok_or_else(|| not_first_order(rec, &cycle))?;
    let options = ProcessOptions {
        offset: true,
        L: Some(delays(rec, &cycle, limits)),
        noise: (0, 0),
        ..ProcessOptions::default()
    };
    let fit = p1d(rec, &options, limits).map_err(|error| notes.push(unfitted(&error))).ok();
    notes.extend(left_out(&switching));
    notes.extend(vague(&model, sd, cycle.known));
    notes.extend(fit.as_ref().and_then(|fit| disagreement(&model, sd, fit)));
    Ok(RelayTest {
        model,
        sd,
        offset,
        known: cycle.known,
        fit,
        ultimate: if model.L > 0.0 { ultimate(&model) } else { (f64::NAN, f64::NAN) },
        t_on: cycle.t_on(),
        t_off: cycle.t_off(),
        periods: cycle.on.len(),
        rows,
        yhat,
        thresholds: cycle.thresholds(),
        levels: (cycle.low, cycle.high),
        notes,
    })
}

fn check(rec: &Record, rest: Option<(f64, f64)>) -> Result<()> {
    if rec.nu != 1 || rec.ny != 1 {
        let came = format!("a record with {} inputs and {} outputs", rec.nu, rec.ny);
        return Err(Error::argument("rec", came, "one with a single input and a single output"));
    }
    match rest {
        Some((u0, y0)) if !(u0.is_finite() && y0.is_finite()) => {
            Err(Error::argument("rest", format!("({u0}, {y0})"), "input and output in equilibrium"))
        }
        _ => Ok(()),
    }
}

/// The inversion, and what it makes of y over the settled periods.
struct Inverted {
    model: Fopdt,
    offset: f64,
    rows: Range<usize>,
    yhat: Vec<f64>,
    /// Root mean square of what it leaves.
    sigma: f64,
}

/// The cycle and its inversion: first with the switching rows as they are, which tells how many rows around
/// them lie on one smooth piece of y, and then with these.
fn inverted(rec: &Record, switching: &Switching, rest: Option<Rest>) -> Result<(Cycle, Inverted)> {
    let rough = switching.cycle(rec.Ts, rest, 0);
    check_asymmetry(rec, &rough)?;
    let Fopdt { T, L, .. } = best(rec, switching, &rough)?.model;
    let smooth = L.min(rough.t_on() - L).min(rough.t_off() - L).min(T);
    let reach = (smooth / 3.0 / rec.Ts).max(0.0) as usize;
    let cycle = switching.cycle(rec.Ts, rest, reach);
    let found = best(rec, switching, &cycle)?;
    Ok((cycle, found))
}

/// Of all that closes the equations, what leaves least of y.
fn best(rec: &Record, switching: &Switching, cycle: &Cycle) -> Result<Inverted> {
    let mut all = Vec::new();
    for found in cycle.invert() {
        all.push(simulated(rec, switching, &found)?);
    }
    all.into_iter().min_by(|a, b| a.sigma.total_cmp(&b.sigma)).ok_or_else(|| not_first_order(rec, cycle))
}

/// The state before the settled periods is estimated.
fn simulated(rec: &Record, switching: &Switching, found: &Inversion) -> Result<Inverted> {
    let model = Fopdt { K: found.K, T: found.T, L: found.L.max(0.0) };
    let run = over_record(&Model::from(model), rec, None, Start::Estimate, Some(found.O))?;
    let span = switching.span();
    let settled = run.rows.iter().zip(run.yhat).filter(|(row, _)| span.contains(*row));
    let yhat: Vec<f64> = settled.map(|(_, yhat)| yhat).collect();
    let rows = span.end - yhat.len()..span.end;
    let squares = rows.clone().zip(&yhat).map(|(k, yhat)| (rec.y_at(k, 0) - yhat).powi(2));
    let sigma = (squares.sum::<f64>() / rows.len() as f64).sqrt();
    Ok(Inverted { model, offset: found.O, rows, yhat, sigma })
}

/// The dead time is shorter than either half-cycle.
fn delays(rec: &Record, cycle: &Cycle, limits: &Limits) -> (f64, f64) {
    let longest = 0.99 * limits.X05 * rec.N() as f64 * rec.Ts;
    (0.0, cycle.t_on().min(cycle.t_off()).min(longest))
}

/// X02: a symmetric cycle.
///
/// A fit of its waveform has the whole of y, but half a period more of dead time with the other sign of gain does
/// as well.
fn check_asymmetry(rec: &Record, cycle: &Cycle) -> Result<()> {
    let differ = (cycle.t_on() - cycle.t_off()).abs() / rec.Ts;
    if differ >= LEAST_ASYMMETRY {
        return Ok(());
    }
    let (t_on, t_off) = (rounded(cycle.t_on()), rounded(cycle.t_off()));
    let text =
        format!("a symmetric cycle, {t_on} s high and {t_off} s low, does not tell gain from time constant");
    Err(Error::new("X02", text)
        .at(Place::column(rec.input_name(0)))
        .measured(differ, LEAST_ASYMMETRY)
        .remedy(format!(
            "put the levels 1:2 around the input at rest; or fit: process(rec, \"P1D\", L=(0, {}))",
            rounded(t_on.min(t_off))
        )))
}

/// M12: no first-order plant has such a cycle.
fn not_first_order(rec: &Record, cycle: &Cycle) -> Error {
    let (t_on, t_off) = (rounded(cycle.t_on()), rounded(cycle.t_off()));
    let text =
        format!("{t_on} s high and {t_off} s low, as measured, fit no first-order plant with dead time");
    let remedy = match cycle.known {
        Known::Rest => {
            "is u0, y0 an equilibrium, and was no load on the way? or make the levels less symmetric"
        }
        Known::Asymmetry => {
            "begin at rest, or give rest=(u0, y0); make the levels less symmetric; or sample faster"
        }
    };
    Error::new("M12", text).at(Place::column(&rec.names[1])).count(cycle.on.len()).remedy(remedy)
}

/// The fit's refusal, beside an inversion that stands.
///
/// A periodic y foretells itself, so that u may add nothing (X04) unless the record holds more than the cycle.
fn unfitted(error: &Error) -> Note {
    let text = format!("the fit is refused: {}", error.note().text);
    let remedy =
        "the cycle alone speaks; for a fit record its start from rest as well, or some steps".to_owned();
    Note { severity: Severity::Warning, text, remedy, ..error.note().clone() }
}

fn left_out(switching: &Switching) -> Option<Note> {
    let count = switching.left_out();
    let text = format!("the first {count} periods are left out: the oscillation had not settled");
    (count > 0).then(|| Note::info("X07", text).count(count))
}

/// X02 where the cycle says little of `K` or `T`.
fn vague(model: &Fopdt, sd: [f64; 3], known: Known) -> Option<Note> {
    let part = (sd[0] / model.K.abs()).max(sd[1] / model.T);
    let text = format!("the cycle says little of gain and time constant, ± {:.0} %", 100.0 * part);
    let remedy = match known {
        Known::Rest => "make the levels less symmetric, or sample faster",
        Known::Asymmetry => "begin at rest, or give rest=(u0, y0); make the levels less symmetric",
    };
    (part > VAGUE).then(|| Note::warning("X02", text).measured(part, VAGUE).remedy(remedy))
}

/// T03 where inversion and fit are farther apart than their deviations allow.
fn disagreement(model: &Fopdt, sd: [f64; 3], fit: &Fit) -> Option<Note> {
    let spread = standard_deviations(&fit.P, 3);
    let apart = |i: usize| {
        let ours = [model.K, model.T, model.L][i];
        ((ours - fit.theta[i]).abs() / sd[i].hypot(spread[i]), i, ours)
    };
    let (worst, i, ours) = (0..3).map(apart).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let (name, theirs) = (["K", "T", "L"][i], fit.theta[i]);
    let text = format!(
        "cycle and fit disagree: {name} = {} ± {} against {} ± {}",
        rounded(ours),
        rounded(sd[i]),
        rounded(theirs),
        rounded(spread[i]),
    );
    (worst > AGREE).then(|| {
        Note::warning("T03", text).at(Place::column(name)).measured(worst, AGREE).remedy(
            "the plant is no first order with dead time, or a load came; from a true rest trust the cycle's gain",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::{self, RelaySettings};

    fn record(model: &Fopdt, low: f64, rest: usize, noise: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let settings =
            RelaySettings { low, high: 2.0, hysteresis: 0.1, Ts: 0.05, r: 3.0, offset: 3.0, rest, noise };
        sim::relay(model, &settings).expect("a sound relay")
    }

    fn test(model: &Fopdt, low: f64, rest: usize) -> Result<RelayTest> {
        let (u, y) = record(model, low, rest, &[0.0; 1500]);
        relay(&Record::uniform(&u, 1, &y, 1, 0.05).expect("finite"), None, &Limits::default())
    }

    /// Half-cycles of a sampled relay differ by a row; the equations hold for each.
    #[test]
    fn the_cycle_of_a_sampled_relay_gives_back_its_plant() {
        for (T, L) in [(6.0, 0.631), (1.3, 1.17), (0.4, 1.83)] {
            for K in [2.0, -0.7] {
                for (rest, known) in [(0, Known::Asymmetry), (20, Known::Rest)] {
                    let found = test(&Fopdt { K, T, L }, -1.0, rest).expect("a sound test");
                    let Fopdt { K: k, T: t, L: l } = found.model;
                    // The parabola through the rows around a switching costs up to 1e-6.
                    let errors = [k / K - 1.0, t / T - 1.0, l / L - 1.0, found.offset - 3.0];
                    assert!(errors.iter().all(|e| e.abs() < 1e-5), "{K} {T} {L} {known:?}: {errors:?}");
                    assert_eq!(found.known, known);
                    assert_eq!(found.rows.len(), found.yhat.len());
                }
            }
        }
    }

    #[test]
    fn a_symmetric_cycle_is_refused() {
        let error = test(&Fopdt { K: 2.0, T: 3.0, L: 1.0 }, -2.0, 20).expect_err("symmetric");
        assert_eq!(error.code(), "X02");
    }
}
