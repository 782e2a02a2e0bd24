//! Frequency response of every output from every input, with coherence and discs.
//!
//! ```text
//! G = S_yu S_u^-1,   g2 = S_yu S_u^-1 S_uy / S_y        the share of y that the inputs explain
//! ETFE: no averaging, G = Y(w)/U(w)                                          source 001, (3.5-38)
//! |G_ij^ - G_ij|^2 <= (20^(2/(nu - 2 q)) - 1) (1 - g2) S_y [S_u^-1]_jj        with 95 %
//! E |G_ij^ - G_ij|^2 = 2/(nu - 2 q) (1 - g2) S_y [S_u^-1]_jj
//! ```
//!
//! `q` inputs, `nu` degrees of freedom (2 over the variance ratio of the averaging, [`crate::signal::Spectra`]); the first
//! is `2 q/(nu - 2 q) F(2, nu - 2 q)` in closed form. The discs hold what they promise as long as the window is wide
//! against the plant's memory; what they miss is bias: with stretches of 20 (T + L) they hold 0.95, of 10 (T + L) 0.84
//! on a slow input. So the default goes by [`reach`]: stretches of at least 20 (T + L), where the record has eight of
//! them, and else lines of the whole record averaged over their neighbours. Bendat and Piersol 2010, (9.94); Ljung
//! 1999, 6.4; Welch 1967.

use std::f64::consts::PI;
use std::ops::Range;

use super::column::{short, without_means};
use super::density::{DensityOptions, longest, usual_stretch};
use super::reach;
use crate::error::{Error, Result};
use crate::excitation::check_input_motion;
use crate::limits::Limits;
use crate::linalg::{Complex, hermitian_inverse};
use crate::model::FrequencyResponse;
use crate::note::{Note, Place, rounded};
use crate::record::Record;
use crate::signal::{Spectra, Stretched, blackman_tukey, smoothed, welch};
use crate::stats::normal_quantile;

/// Stretches of Welch's way, and lags of the lag window, per time `T + L`.
const STRETCH: f64 = 20.0;
const LAGS: f64 = 18.0;

/// Stretches of a record of Welch's way.
const STRETCHES: usize = 8;

/// Power of an input against its largest below which a line holds rounding only.
const DARK: f64 = 1e-20;

/// Pivot of the scaled spectrum of the inputs below which they move together.
const TOGETHER: f64 = 1e-3;

/// Share of the frequencies that may lie below a coherence of one half without a word.
const BLANK: f64 = 0.5;

/// Coherence below which a point is blank.
pub const COHERENT: f64 = 0.5;

/// How neighbours in time or frequency are averaged.
#[derive(Clone, Copy, Debug)]
pub enum Way {
    /// Welch's stretches if the record is long enough, else averaged lines.
    Auto,
    /// Welch's stretches.
    Welch(DensityOptions),
    /// Blackman and Tukey's lag window up to lag `M`.
    BlackmanTukey {
        /// Lags.
        M: Option<usize>,
    },
    /// Lines of the longest run, `half` neighbours on either side.
    Lines {
        /// Neighbours; None for as many as the plant's memory allows.
        half: Option<usize>,
    },
}

/// A frequency response from a record.
#[derive(Clone, Debug)]
pub struct Response {
    /// The points and their discs.
    pub value: FrequencyResponse,
    /// Standard deviation of the complex error.
    pub sd: Option<Vec<f64>>, // (n, ny, nu)
    /// Multiple coherence; none without averaging.
    pub coherence: Option<Vec<f64>>, // (n, ny)
    /// Part of a point's information that its neighbours do not hold.
    pub share: f64,
    /// What was averaged, in words.
    pub way: String,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// How much of each output each input explains.
#[derive(Clone, Debug)]
pub struct Coherence {
    /// Frequencies, rad/s.
    pub w: Vec<f64>,
    /// Ordinary coherence of output `i` and input `j`.
    pub pairs: Vec<f64>, // (n, ny, nu)
    /// Ends of its 95 % band.
    pub low: Vec<f64>, // (n, ny, nu)
    /// Upper ends.
    pub high: Vec<f64>, // (n, ny, nu)
    /// Coherence of output `i` with all inputs together.
    pub multiple: Vec<f64>, // (n, ny)
    /// Coherence of a pair that chance exceeds in one case of twenty.
    pub limit: f64,
    /// What was averaged, in words.
    pub way: String,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Estimates the response; `memory` is `T + L` in seconds where it is known.
pub fn response(rec: &Record, way: Way, memory: Option<f64>, limits: &Limits) -> Result<Response> {
    let seen = Seen::of(rec, way, memory, limits)?;
    let (nu, ny, S) = (rec.nu, rec.ny, &seen.S);
    let raw = S.averaged == 1;
    if raw && nu > 1 {
        return Err(Error::argument(
            "half",
            0,
            "at least the number of inputs: one line cannot tell them apart",
        ));
    }
    let dof = 2.0 / S.ratio - 2.0 * nu as f64;
    let mut out = Points::default();
    for k in (0..S.w.len()).filter(|&k| S.w[k] > 0.0) {
        let Some(inverse) = seen.inverse(k) else { continue };
        let turn = Complex::from_polar(1.0, -S.w[k] * rec.Ts * seen.shift as f64);
        out.w.push(S.w[k]);
        for i in 0..ny {
            let g2 = seen.multiple(k, i, &inverse);
            out.coherence.push(g2);
            for j in 0..nu {
                let G: Complex<f64> = (0..nu).map(|b| S.at(k, nu + i, b) * inverse[b * nu + j]).sum();
                let left = (1.0 - g2) * S.at(k, nu + i, nu + i).re * inverse[j * nu + j].re;
                out.G.push(G * turn);
                out.radius.push(if dof > 0.0 {
                    ((20f64.powf(2.0 / dof) - 1.0) * left).sqrt()
                } else {
                    f64::INFINITY
                });
                out.sd.push(if dof > 0.0 { (2.0 / dof * left).sqrt() } else { f64::INFINITY });
            }
        }
    }
    if out.w.is_empty() {
        return Err(together(rec));
    }
    let notes = seen.notes(rec, (!raw).then_some(&out.coherence), out.w.len());
    let known = |x: Vec<f64>| (!raw).then_some(x);
    let value = FrequencyResponse { w: out.w, G: out.G, radius: known(out.radius), ny, nu, Ts: Some(rec.Ts) };
    Ok(Response {
        value,
        sd: known(out.sd),
        coherence: known(out.coherence),
        share: seen.share,
        way: seen.words,
        notes,
    })
}

#[derive(Default)]
struct Points {
    w: Vec<f64>,
    G: Vec<Complex<f64>>,
    radius: Vec<f64>,
    sd: Vec<f64>,
    coherence: Vec<f64>,
}

/// Estimates the coherence, by the way of the response.
pub fn coherence(rec: &Record, way: Way, memory: Option<f64>, limits: &Limits) -> Result<Coherence> {
    let seen = Seen::of(rec, way, memory, limits)?;
    let (nu, S) = (rec.nu, &seen.S);
    if S.averaged == 1 {
        return Err(Error::argument("half", 0, "at least 1: without averaging every coherence is 1"));
    }
    let mut out = Coherence {
        w: Vec::new(),
        pairs: Vec::new(),
        low: Vec::new(),
        high: Vec::new(),
        multiple: Vec::new(),
        limit: 1.0 - 0.05f64.powf(1.0 / (1.0 / S.ratio - 1.0).max(1e-3)),
        way: seen.words.clone(),
        notes: Vec::new(),
    };
    // atanh g has about a normal law of variance 1/nu.
    let wide = normal_quantile(0.95) * (0.5 * S.ratio).sqrt();
    for k in (0..S.w.len()).filter(|&k| S.w[k] > 0.0) {
        let Some(inverse) = seen.inverse(k) else { continue };
        out.w.push(S.w[k]);
        for i in 0..rec.ny {
            out.multiple.push(seen.multiple(k, i, &inverse));
            for j in 0..nu {
                let power = S.at(k, j, j).re * S.at(k, nu + i, nu + i).re;
                let g2 = if power > 0.0 { (S.at(k, nu + i, j).norm_sqr() / power).min(1.0) } else { 0.0 };
                let z = g2.sqrt().min(1.0 - 1e-15).atanh();
                out.pairs.push(g2);
                out.low.push((z - wide).max(0.0).tanh().powi(2));
                out.high.push((z + wide).tanh().powi(2));
            }
        }
    }
    if out.w.is_empty() {
        return Err(together(rec));
    }
    out.notes = seen.notes(rec, Some(&out.multiple), out.w.len());
    Ok(out)
}

/// The spectra of all inputs and outputs, and how they were averaged.
struct Seen {
    S: Spectra, // of the inputs, then the outputs
    nu: usize,
    /// Rows by which the outputs were read later.
    shift: usize,
    words: String,
    dark: Vec<f64>, // (nu)
    runs: usize,
    used: usize,
    /// Rows over twice the averages of all lines, at most 1.
    share: f64,
}

impl Seen {
    fn of(rec: &Record, way: Way, memory: Option<f64>, limits: &Limits) -> Result<Self> {
        check_input_motion(rec, limits)?;
        if let Some(memory) = memory.filter(|m| !(*m > 0.0 && m.is_finite())) {
            return Err(Error::argument("memory", memory, "a positive number of seconds, T + L"));
        }
        let runs = common_runs(rec);
        let N: usize = runs.iter().map(Range::len).sum();
        let run = longest(&runs);
        if run.len() < 16 {
            return Err(short(&rec.names[rec.nu], run.len(), 16));
        }
        let plan = Plan::of(rec, way, memory, N, run.len(), limits)?;
        let shift = plan.shift();
        let signals: Vec<Vec<f64>> =
            (0..rec.nu + rec.ny).map(|column| signal(rec, column, &runs, shift)).collect();
        let cut: Vec<Range<usize>> =
            runs.iter().filter(|r| r.len() > shift + 1).map(|r| r.start..r.end - shift).collect();
        let too_short = || short(&rec.names[rec.nu], run.len(), 16);
        let S = match &plan {
            Plan::Welch(stretch) => welch(&signals, &cut, *stretch, rec.Ts).ok_or_else(too_short)?,
            Plan::Lines(half) => smoothed(&signals, &longest(&cut), *half, rec.Ts),
            Plan::Lags(M, _) => {
                let w = (1..=*M).map(|k| PI * k as f64 / (*M as f64 * rec.Ts)).collect();
                blackman_tukey(&signals, &cut, *M, w, rec.Ts)
            }
        };
        let most = |j: usize| S.density(j).into_iter().fold(0.0, f64::max);
        let dark = (0..rec.nu).map(|j| DARK * most(j)).collect();
        let used = match &plan {
            Plan::Lines(_) => 1,
            Plan::Welch(stretch) => cut.iter().filter(|r| r.len() >= stretch.n).count(),
            Plan::Lags(..) => cut.len(),
        };
        let rows = if used == 1 { longest(&cut).len() } else { N };
        let share = (0.5 * rows as f64 * S.ratio / S.w.len() as f64).min(1.0);
        Ok(Seen { words: plan.words(&S), S, nu: rec.nu, shift, dark, runs: runs.len(), used, share })
    }

    /// Of the spectrum of the inputs at frequency `k`; None where an input is dark or they move together.
    fn inverse(&self, k: usize) -> Option<Vec<Complex<f64>>> {
        let nu = self.nu;
        if (0..nu).any(|j| !(self.S.at(k, j, j).re > self.dark[j])) {
            return None;
        }
        let own: Vec<Complex<f64>> = (0..nu * nu).map(|ab| self.S.at(k, ab / nu, ab % nu)).collect();
        hermitian_inverse(&own, nu, TOGETHER)
    }

    /// Share of the power of output `i` that all inputs explain.
    fn multiple(&self, k: usize, i: usize, inverse: &[Complex<f64>]) -> f64 {
        let (nu, S) = (self.nu, &self.S);
        let power = S.at(k, nu + i, nu + i).re;
        let mut explained = 0.0;
        for a in 0..nu {
            for b in 0..nu {
                explained += (S.at(k, nu + i, a) * inverse[a * nu + b] * S.at(k, nu + i, b).conj()).re;
            }
        }
        if power > 0.0 { (explained / power).clamp(0.0, 1.0) } else { 0.0 }
    }

    fn notes(&self, rec: &Record, coherence: Option<&Vec<f64>>, kept: usize) -> Vec<Note> {
        let mut notes = Vec::new();
        if let Some(coherence) = coherence {
            let low = coherence.iter().filter(|g2| **g2 < COHERENT).count();
            let share = low as f64 / coherence.len().max(1) as f64;
            if share > BLANK {
                let text =
                    format!("the coherence is below one half at {:.0} % of the frequencies", 100.0 * share);
                notes.push(Note::warning("X04", text).count(low).measured(share, BLANK).remedy(
                    "look at what is left; a faster or larger input, or a longer record, shows more",
                ));
            }
        }
        let all = self.S.w.iter().filter(|w| **w > 0.0).count();
        if kept < all {
            let text = format!(
                "{} of {all} frequencies are left out: there an input has no power, or inputs move together",
                all - kept
            );
            notes.push(Note::info("X11", text).count(all - kept));
        }
        if self.used < self.runs {
            let text = format!(
                "{} of {} stretches of the record are used, the others are too short",
                self.used, self.runs
            );
            notes.push(Note::info("X03", text).at(Place::column(&rec.names[rec.nu])).count(self.used));
        }
        let independent = 1.0 / self.S.ratio;
        if coherence.is_some() && independent < 3.0 {
            let text =
                format!("an average of {} independent values: the discs are wide", rounded(independent));
            notes.push(
                Note::warning("X03", text)
                    .measured(independent, 3.0)
                    .remedy("record longer, or average over more neighbours"),
            );
        }
        notes
    }
}

/// The way with its numbers.
enum Plan {
    Welch(Stretched),
    Lines(usize),
    Lags(usize, usize),
}

impl Plan {
    /// `N` rows in all, `long` in the longest run.
    fn of(
        rec: &Record,
        way: Way,
        memory: Option<f64>,
        N: usize,
        long: usize,
        limits: &Limits,
    ) -> Result<Self> {
        let known = memory.map(|seconds| (seconds / rec.Ts, 0));
        let memory = || known.or_else(|| reach(rec, limits));
        let name = &rec.names[rec.nu];
        Ok(match way {
            Way::Lines { half: Some(half) } if 2 * half + 1 > long / 2 => {
                let most = (long / 2).saturating_sub(1) / 2;
                return Err(Error::argument(
                    "half",
                    half,
                    &format!("from 0 to {most}: a quarter of the record"),
                ));
            }
            Way::Lines { half: Some(half) } => Plan::Lines(half),
            Way::Lines { half: None } => Plan::Lines(lines(long, memory())),
            Way::Welch(options) if options.n.is_some() => {
                Plan::Welch(options.stretched(options.n.unwrap_or(0), name, long)?)
            }
            Way::Welch(options) => Plan::Welch(options.stretched(stretch(N, long, memory()), name, long)?),
            Way::Auto => match memory() {
                Some((rows, _)) if N < STRETCHES * (STRETCH * rows) as usize => {
                    Plan::Lines(lines(long, Some((rows, 0))))
                }
                known => {
                    Plan::Welch(DensityOptions::default().stretched(stretch(N, long, known), name, long)?)
                }
            },
            Way::BlackmanTukey { M } => {
                let found = reach(rec, limits);
                let usual = known.or(found).map_or(N / 10, |(rows, _)| (LAGS * rows) as usize);
                let M = M.unwrap_or_else(|| usual.clamp(8, long / 4));
                if !(4..long / 2).contains(&M) {
                    return Err(Error::argument("M", M, &format!("from 4 to {}: half the record", long / 2)));
                }
                Plan::Lags(M, found.map_or(0, |(_, nk)| nk.min(long / 8)))
            }
        })
    }

    fn shift(&self) -> usize {
        if let Plan::Lags(_, shift) = self { *shift } else { 0 }
    }

    fn words(&self, S: &Spectra) -> String {
        match self {
            Plan::Welch(way) => format!(
                "Welch: {} stretches of {} rows, {} window, {:.0} % overlap",
                S.averaged,
                way.n,
                way.window.name(),
                100.0 * (1.0 - way.step as f64 / way.n as f64)
            ),
            Plan::Lines(0) => "ETFE: Y/U, not smoothed".to_owned(),
            Plan::Lines(_) => format!("ETFE smoothed over {} lines, Hann weights", S.averaged),
            Plan::Lags(M, 0) => format!("Blackman-Tukey: Hann lag window up to {M} lags"),
            Plan::Lags(M, nk) => {
                format!("Blackman-Tukey: Hann lag window up to {M} lags, centred on the delay of {nk}")
            }
        }
    }
}

/// Rows of a stretch: the power of two from `20 (T + L)` on, at most an eighth of the rows.
fn stretch(N: usize, long: usize, memory: Option<(f64, usize)>) -> usize {
    let most = usual_stretch(N, long);
    let Some((rows, _)) = memory else { return most };
    ((STRETCH * rows).ceil() as usize).next_power_of_two().clamp(16.min(most), most)
}

/// Neighbours on either side: as many as fit into a twentieth of `1/(T + L)`, at least two.
fn lines(long: usize, memory: Option<(f64, usize)>) -> usize {
    let most = (long / 2).saturating_sub(1) / 2;
    memory.map_or(5, |(rows, _)| (long as f64 / (STRETCH * rows)) as usize).max(2).min(most)
}

/// X11: no frequency at which the inputs can be told apart.
fn together(rec: &Record) -> Error {
    let names = rec.names[..rec.nu].join(" and ");
    Error::new("X11", format!("{names} move together at every frequency"))
        .at(Place::column(&rec.names[0]))
        .count(rec.nu)
        .remedy("leave one of them out, or move them apart in an experiment")
}

/// Runs of rows at which every output counts.
fn common_runs(rec: &Record) -> Vec<Range<usize>> {
    let Some(_) = rec.valid else { return rec.segments().collect() };
    let counts = |k: &usize| (0..rec.ny).all(|i| rec.is_valid(*k, i));
    rec.segments()
        .flat_map(|segment| {
            let rows: Vec<usize> = segment.filter(counts).collect();
            rows.chunk_by(|a, b| b - a == 1).map(|run| run[0]..run[run.len() - 1] + 1).collect::<Vec<_>>()
        })
        .collect()
}

/// A column without the means of its runs; outputs are read `shift` rows later.
fn signal(rec: &Record, column: usize, runs: &[Range<usize>], shift: usize) -> Vec<f64> {
    if column < rec.nu {
        return without_means(&rec.input(column), runs);
    }
    let mut y = without_means(&rec.output_held(column - rec.nu), runs);
    y.rotate_left(shift);
    y
}
