//! Stretches of a long record that say something about the plant, ranked by what they say of `K`, `T` and `L`.
//!
//! ```text
//! 1  variance     the input moves within the window
//! 2  regression   y(t) on its past and Laguerre filters of u: no delay needed           ([`causality`])
//! 3  condition    of the centred, scaled regressor below 100
//! 4  causality    F test that u drives y: p < 1e-6
//! 5  merged       windows that overlap or touch are one stretch
//! 6  information  sd of K, T, L from these rows, a rough plant being known              ([`information`])
//! ```
//!
//! Windows are rows of one segment, a quarter of a window apart. A loop in automatic whose set point rests passes
//! the first test: its input is a filter of past outputs, and the third and fourth tell. Which stretch may be
//! identified is not what the F test says: that only finds candidates; the standard deviations decide, and whether
//! the gain that the rows ask for is that of the rough plant (another one means a load, or another operating
//! point). The rough plant is the best of the fits to the few stretches with the largest F.
//!
//! Bittencourt, Isaksson, Peretzki and Forsman, Processes 2015, 3:357; METHODS 6.

mod causality;

use std::ops::Range;

use self::causality::{LEAST_ROWS, causality};
use super::feedback::p_of_feedback;
use crate::batch::{Information, ProcessOptions, information, p1d};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::extent;
use crate::model::{Fopdt, Model};
use crate::note::{Note, Place, rounded};
use crate::record::Record;

/// Condition number from which on u tells nothing that the past of y does not.
const MOST_CONDITION: f64 = 100.0;

/// Chance below which u drives y.
const DRIVES: f64 = 1e-6;

/// Chance of an error of y moving u as clearly, below which the loop is closed.
const ANSWERS: f64 = 1e-3;

/// Windows overlap by all but this part.
const STRIDE: usize = 4;

/// Stretches that are fitted to find a rough plant.
const FITTED: usize = 6;

/// Largest relative standard deviation of a plant that can be identified.
const SURE: f64 = 0.25;

/// Standard deviations by which the gain of a stretch may differ from that of the rough plant.
const DEVIATIONS: f64 = 3.0;

/// Rows per time constant below which sampling is coarse.
const COARSE: f64 = 5.0;

/// What to look at.
#[derive(Clone, Copy, Debug)]
pub struct InformativeOptions {
    /// Rows of a window.
    pub window: usize,
    /// Which input.
    pub input: usize,
    /// Which output.
    pub output: usize,
}

/// A window and its tests.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Rows of the record.
    pub rows: Range<usize>,
    /// Condition number of the regressor.
    pub condition: f64,
    /// F statistic of u driving y.
    pub F: f64,
    /// Chance of such an F where u does not drive y.
    pub p: f64,
}

/// A stretch in which u drives y.
#[derive(Clone, Debug, PartialEq)]
pub struct InformativeStretch {
    /// Rows of the record.
    pub rows: Range<usize>,
    /// Largest F of its windows.
    pub F: f64,
    /// Least chance of its windows.
    pub p: f64,
    /// Chance of errors of y moving u as clearly as here where they do not.
    pub p_feedback: f64,
    /// What its rows say about the rough plant; none where they tell nothing.
    pub information: Option<Information>,
    /// Largest of `sd K / |K|`, `sd T / T` and `sd L / (T + L)`; infinite without information.
    pub score: f64,
    /// Whether the gain that its rows ask for is that of the rough plant.
    pub agrees: bool,
}

impl InformativeStretch {
    /// Whether `K`, `T` and `L` can be identified from its rows.
    pub fn identifiable(&self) -> bool {
        self.score < SURE && self.agrees
    }

    /// Whether the input answers the output.
    pub fn has_feedback(&self) -> bool {
        self.p_feedback < ANSWERS
    }
}

/// What a record holds.
#[derive(Clone, Debug)]
pub struct Informative {
    /// Every window that was tested, in the order of the rows.
    pub windows: Vec<Window>,
    /// Stretches, the one that says most first.
    pub stretches: Vec<InformativeStretch>,
    /// The rough plant; none where no stretch could be fitted.
    pub plant: Option<Fopdt>,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Finds the stretches and ranks them.
pub fn informative(rec: &Record, options: &InformativeOptions, limits: &Limits) -> Result<Informative> {
    let InformativeOptions { window, input, output } = *options;
    if window < LEAST_ROWS {
        return Err(Error::argument("window", window, &format!("at least {LEAST_ROWS} rows")));
    }
    let (u, y) = (rec.input(input), rec.output(output));
    let pair = Record {
        u: &u,
        y: &y,
        nu: 1,
        ny: 1,
        valid: None,
        names: vec![rec.names[input].clone(), rec.names[rec.nu + output].clone()],
        ..rec.clone()
    };
    let windows = tested(&pair, rec.runs(0, 0, output), window, limits)?;
    let mut stretches = merged(&pair, &windows);
    let (plant, refusal) = rough_plant(&pair, &stretches, limits);
    if let Some(plant) = &plant {
        stretches.iter_mut().for_each(|s| s.weigh(&pair, plant, limits));
    }
    stretches.sort_by(|a, b| a.score.total_cmp(&b.score).then(b.F.total_cmp(&a.F)));
    let notes = notes(&pair, &stretches, plant.as_ref(), refusal);
    Ok(Informative { windows, stretches, plant, notes })
}

/// Windows of every run of rows that count, shorter where the run is.
fn tested(rec: &Record, runs: Vec<Range<usize>>, window: usize, limits: &Limits) -> Result<Vec<Window>> {
    let longest = runs.iter().map(Range::len).max().unwrap_or(0);
    if longest < LEAST_ROWS {
        let text = format!("the longest stretch without a gap has {longest} rows, {LEAST_ROWS} are needed");
        return Err(Error::new("X03", text)
            .count(longest)
            .measured(longest as f64, LEAST_ROWS as f64)
            .remedy("record longer, or read short holes with missing=\"mask\""));
    }
    let (low, high) = extent(rec.u);
    let least = limits.X01 * low.abs().max(high.abs());
    let long = runs.into_iter().filter(|run| run.len() >= LEAST_ROWS);
    Ok(long.flat_map(|run| placed(run, window)).map(|rows| test(rec, rows, least)).collect())
}

/// Places of a window in a run: a quarter of it apart, the last one at the end.
fn placed(run: Range<usize>, window: usize) -> Vec<Range<usize>> {
    let window = window.min(run.len());
    let last = run.end - window;
    let mut first: Vec<usize> = (run.start..=last).step_by((window / STRIDE).max(1)).collect();
    if first.last() != Some(&last) {
        first.push(last);
    }
    first.into_iter().map(|k| k..k + window).collect()
}

fn test(rec: &Record, rows: Range<usize>, least: f64) -> Window {
    let (u, y) = (&rec.u[rows.clone()], &rec.y[rows.clone()]);
    let (low, high) = extent(u);
    if high - low <= least {
        return Window { rows, condition: f64::INFINITY, F: 0.0, p: 1.0 };
    }
    let found = causality(u, y);
    Window { rows, condition: found.condition, F: found.F, p: found.p }
}

/// Windows in which u drives y, those that overlap or touch as one.
fn merged(rec: &Record, windows: &[Window]) -> Vec<InformativeStretch> {
    let mut stretches: Vec<InformativeStretch> = Vec::new();
    for w in windows.iter().filter(|w| w.condition < MOST_CONDITION && w.p < DRIVES) {
        match stretches.last_mut() {
            Some(s) if w.rows.start <= s.rows.end && rec.starts.binary_search(&w.rows.start).is_err() => {
                s.rows.end = w.rows.end;
                (s.F, s.p) = (s.F.max(w.F), s.p.min(w.p));
            }
            _ => stretches.push(InformativeStretch {
                rows: w.rows.clone(),
                F: w.F,
                p: w.p,
                p_feedback: 1.0,
                information: None,
                score: f64::INFINITY,
                agrees: false,
            }),
        }
    }
    for s in &mut stretches {
        s.p_feedback = p_of_feedback(&part(rec, &s.rows), 0, false);
    }
    stretches
}

impl InformativeStretch {
    /// Says what its rows hold about a plant.
    fn weigh(&mut self, rec: &Record, plant: &Fopdt, limits: &Limits) {
        self.information = information(&part(rec, &self.rows), plant, limits);
        let Some(found) = &self.information else { return };
        self.score = score(found, plant);
        let apart = (found.K - plant.K).abs();
        self.agrees = apart < SURE * plant.K.abs() || apart < DEVIATIONS * found.sd[0];
    }
}

fn score(found: &Information, plant: &Fopdt) -> f64 {
    let size = [plant.K.abs(), plant.T, plant.T + plant.L];
    found.sd.iter().zip(size).map(|(sd, size)| sd / size).fold(0.0, f64::max)
}

/// The best of the first orders fitted to the stretches with the largest F, and why there is none.
fn rough_plant(
    rec: &Record,
    stretches: &[InformativeStretch],
    limits: &Limits,
) -> (Option<Fopdt>, Option<Error>) {
    let mut by_F: Vec<&InformativeStretch> = stretches.iter().collect();
    by_F.sort_by(|a, b| b.F.total_cmp(&a.F));
    // With a noise model, for most stretches lie in closed loops.
    let options = ProcessOptions { offset: true, noise: (1, 1), ..ProcessOptions::default() };
    let (mut best, mut refusal): (Option<(f64, Fopdt)>, _) = (None, None);
    for s in by_F.into_iter().take(FITTED) {
        let own = part(rec, &s.rows);
        let plant = match p1d(&own, &options, limits) {
            Ok(fit) => match &fit.model {
                Model::Process(plant) => plant.first_order(),
                _ => None,
            },
            Err(error) => {
                refusal.get_or_insert(error);
                None
            }
        };
        let found = plant.and_then(|plant| Some((information(&own, &plant, limits)?, plant)));
        if let Some((found, plant)) = found {
            let score = score(&found, &plant);
            if best.is_none_or(|(least, _)| score < least) {
                best = Some((score, plant));
            }
        }
    }
    (best.map(|(_, plant)| plant), refusal)
}

/// Rows of one segment as a record of their own.
fn part<'a>(rec: &Record<'a>, rows: &Range<usize>) -> Record<'a> {
    Record {
        u: &rec.u[rows.clone()],
        y: &rec.y[rows.clone()],
        t0: rec.time(rows.start),
        starts: vec![0],
        rows: rec.rows.map(|all| &all[rows.clone()]),
        t: rec.t.map(|t| &t[rows.clone()]),
        ..rec.clone()
    }
}

fn notes(
    rec: &Record,
    stretches: &[InformativeStretch],
    plant: Option<&Fopdt>,
    refusal: Option<Error>,
) -> Vec<Note> {
    let mut notes = Vec::new();
    if stretches.is_empty() {
        let text = format!("nowhere does {} clearly drive {}", rec.names[0], rec.names[1]);
        notes.push(
            Note::warning("X02", text)
                .remedy("record a few steps of the set point, or of the input in manual"),
        );
    } else if plant.is_none() {
        notes.extend(refusal.map(|error| error.note().clone()));
    } else if !stretches.iter().any(InformativeStretch::identifiable) {
        let text = "no stretch says enough about gain, time constant and delay".to_owned();
        let note = Note::warning("X02", text).measured(rounded(stretches[0].score), SURE);
        notes.push(note.remedy("record more and larger moves, or join the best stretches"));
    }
    notes.extend(plant.and_then(|plant| coarse(rec, plant)));
    let answered: Vec<&InformativeStretch> = stretches.iter().filter(|s| s.has_feedback()).collect();
    if let Some(first) = answered.first() {
        let text = format!(
            "{} answers {} in {} of {} stretches: the loop is closed",
            rec.names[0],
            rec.names[1],
            answered.len(),
            stretches.len()
        );
        let note = Note::info("X09", text).at(rec.place(0, first.rows.start)).count(answered.len());
        notes.push(note.remedy("fit with a noise model: process(rec, noise=\"arma\"), armax or bj"));
    }
    notes
}

/// M09 as a remark: few rows in a time constant.
fn coarse(rec: &Record, plant: &Fopdt) -> Option<Note> {
    let (T, Ts) = (plant.T, rec.Ts);
    let text =
        format!("sampled coarsely: {} rows in a time constant of about {} s", rounded(T / Ts), rounded(T));
    let note = Note::info("M09", text).at(Place::column("Ts")).measured(rounded(T / Ts), COARSE);
    (T < COARSE * Ts).then(|| note.remedy(format!("record with Ts = {} s, a tenth of T", rounded(0.1 * T))))
}
