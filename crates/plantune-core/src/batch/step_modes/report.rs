//! What is told of a step response: modes, level, gain, delay, zeros and the orders that were tried.

use super::Study;
use super::delay::Curve;
use super::deviations::{Candidate, widening};
use super::order::{KNOWN, Kind, MARGIN, Mode, bic, colour, favoured, modes};
use super::parts::{POINTS, parts, splits};
use super::search::{Piece, Projection};
use super::sections::Sections;
use super::steps::Response;
use super::zeros::numerator;
use crate::batch::fit::Status;
use crate::error::{Error, Result};
use crate::linalg::{Complex, congruence};
use crate::model::{ProcessModel, TransferFunction};
use crate::note::{Note, Place, rounded};
use crate::poly::{product, roots};
use crate::record::Record;
use crate::stats::normal_quantile;

/// Records that a time constant may last, to be told from a ramp.
const LONGEST: f64 = 5.0;

/// Time constants that a record must last after the step.
const SETTLED: f64 = 3.0;

/// One order that was tried.
#[derive(Clone, Debug)]
pub struct Tried {
    /// Number of poles.
    pub order: usize,
    /// Mean squared error, in units of y squared.
    pub loss: f64,
    /// The criterion.
    pub bic: f64,
    /// Why it was taken, or why not.
    pub why: String,
}

/// What each mode adds to the first response.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    /// Times on the record's clock, s.
    pub t: Vec<f64>, // (points)
    /// One curve for each mode, and its standard deviation; none where modes coincide.
    pub y: Vec<Vec<f64>>, // (modes, points)
    /// Standard deviations.
    pub sd: Vec<Vec<f64>>,
}

/// The modes that a step response supports.
#[derive(Clone, Debug)]
pub struct StepModes {
    /// Number of poles.
    pub order: usize,
    /// By rising time constant.
    pub modes: Vec<Mode>,
    /// Poles by falling rate, 1/s.
    pub poles: Vec<Complex<f64>>,
    /// `T1 …` of lags, `w1 zeta1` of pairs, numbered by mode; then `K` and `L`, or `level`.
    pub names: Vec<String>,
    /// Parameters.
    pub theta: Vec<f64>,
    /// Their covariance, widened by the colour of the residual; row-major.
    pub P: Vec<f64>,
    /// Static gain with its standard deviation; None where it is not separable from the initial state.
    pub gain: Option<(f64, f64)>,
    /// What y ends at after the first step, with its standard deviation.
    pub level: (f64, f64),
    /// y at rest before the step, with its standard deviation.
    pub rest: Option<(f64, f64)>,
    /// Time of the step, s, and the move of the input.
    pub step: Option<(f64, f64)>,
    /// Time from the step to the begin of the response, s.
    pub delay: Option<(f64, f64)>,
    /// Coefficients of the numerator over its last one, in descending powers, with their standard deviations; as
    /// many as the data support.
    pub numerator: Option<(Vec<f64>, Vec<f64>)>,
    /// Zeros that the data support, 1/s.
    pub zeros: Vec<(f64, f64)>,
    /// The plant, where gain and delay are known.
    pub model: Option<crate::model::Model>,
    /// Every order that was tried.
    pub tried: Vec<Tried>,
    /// Lag-1 correlation of the residual.
    pub colour: f64,
    /// Rows used.
    pub N: usize,
    /// Mean squared error, in units of y squared.
    pub loss: f64,
    /// How the search ended.
    pub status: Status,
    /// Times on the record's clock and outputs used; of long responses means of some rows.
    pub rows: (Vec<f64>, Vec<f64>),
    /// The curve at these, and its standard deviation.
    pub curve: (Vec<f64>, Vec<f64>),
    /// What each mode adds.
    pub parts: Parts,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// The 95 % band of a curve with standard deviations.
pub fn band(y: &[f64], sd: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let half = normal_quantile(0.95);
    let edge = |sign: f64| y.iter().zip(sd).map(|(y, sd)| y + sign * half * sd).collect();
    (edge(-1.0), edge(1.0))
}

/// The order that is taken, and what is said of each.
struct Choice {
    order: usize,
    tried: Vec<Tried>,
    colour: f64,
    notes: Vec<Note>,
}

pub(super) fn report(study: &Study) -> Result<StepModes> {
    let choice = choose(study)?;
    let answer = Answer { study, c: &study.all[choice.order], wide: widening(choice.colour) };
    answer.told(choice)
}

/// BIC, then down to the first order whose modes are known; an order that is asked for is kept, with a note.
fn choose(study: &Study) -> Result<Choice> {
    let Study { rec, data, all, scale, .. } = study;
    let asked = study.options.order;
    let r = colour(all);
    let bics: Vec<f64> = all.iter().map(|c| bic(c, r)).collect();
    let top = favoured(&bics);
    let slowest = LONGEST * data.longest().t.last().copied().unwrap_or(0.0);
    let worst = |k: usize| {
        let modes = modes(&all[k], r);
        let doubt = |mode: &Mode| if mode.T < slowest { mode.sd() } else { f64::INFINITY };
        modes.into_iter().max_by(|a, b| doubt(a).total_cmp(&doubt(b)))
    };
    let unknown = |k: usize| worst(k).filter(|mode| !(mode.sd() < KNOWN && mode.T < slowest));
    let supported = (1..=top).rev().find(|&k| unknown(k).is_none()).unwrap_or(0);
    let order = asked.unwrap_or(supported);
    if order == 0 {
        return Err(nothing(rec, &bics, unknown(top)));
    }
    let why = |k: usize| {
        let better = |j: usize| format!("BIC is lower by {:.1} than that of order {j}", bics[j] - bics[k]);
        if k == order && asked.is_some() {
            "asked for".to_owned()
        } else if k == order {
            format!("chosen: {}", better(k - 1))
        } else if k > top {
            let least = (0..k).min_by(|i, j| bics[*i].total_cmp(&bics[*j])).unwrap_or(0);
            let gain = bics[least] - bics[k];
            if gain > 0.0 {
                format!(
                    "refused: BIC gains only {gain:.1} on order {least}, {MARGIN} would be strong evidence"
                )
            } else {
                format!("refused: BIC is higher by {:.1} than that of order {least}", -gain)
            }
        } else if let (true, Some(mode)) = (k > order, unknown(k)) {
            format!("refused: {}", described(&mode))
        } else {
            format!("BIC is higher by {:.1} than that of order {order}", bics[k] - bics[order])
        }
    };
    let tried = all.iter().zip(&bics).enumerate().map(|(k, (c, &bic))| Tried {
        order: k,
        loss: c.rss / c.N as f64 / scale.factor.powi(2),
        bic: bic - 2.0 * c.N as f64 * (1.0 - r) / (1.0 + r) * scale.factor.ln(),
        why: why(k),
    });
    let mut notes = Vec::new();
    if order > supported {
        let sd = worst(order).map_or(f64::INFINITY, |mode| mode.sd());
        let text = format!(
            "order {order} is asked for, the data support {supported}: {}",
            why_not(&unknown, order, top)
        );
        notes.push(Note::warning("X10", text).measured(sd, KNOWN).remedy("take order=\"auto\""));
    }
    Ok(Choice { order, tried: tried.collect(), colour: r, notes })
}

fn why_not(unknown: &impl Fn(usize) -> Option<Mode>, order: usize, top: usize) -> String {
    match unknown(order) {
        Some(mode) => described(&mode),
        None => format!("BIC favours order {top}"),
    }
}

/// What is not known of a mode.
fn described(mode: &Mode) -> String {
    if mode.sd() < KNOWN {
        return format!("T {} s is beyond {LONGEST} times the record", rounded(mode.T));
    }
    let (what, sd) = match mode.zeta {
        Some((zeta, sd)) if sd > mode.sd_ln_T => (format!("zeta {} of a pair", rounded(zeta)), sd),
        _ => (format!("T {} s", rounded(mode.T)), mode.sd_ln_T),
    };
    if sd.is_finite() {
        format!("{what} has a standard deviation of {:.0} %", 100.0 * sd)
    } else {
        format!("{what} cannot be told from the rest")
    }
}

/// X04: no mode stands out.
fn nothing(rec: &Record, bics: &[f64], worst: Option<Mode>) -> Error {
    let name = &rec.names[1];
    let least = bics[1..].iter().copied().fold(f64::INFINITY, f64::min);
    let text = match worst {
        Some(mode) => format!("no time constant can be told: {}", described(&mode)),
        None => format!("no time constant is seen: a constant describes {name} as well"),
    };
    Error::new("X04", text)
        .at(Place::column(name))
        .measured(bics[0] - least, MARGIN)
        .remedy("record from before the step until y has settled, with a larger step or less noise")
}

/// What an answer is made of.
struct Answer<'a> {
    study: &'a Study<'a>,
    c: &'a Candidate,
    wide: f64,
}

/// A result with its gradient along the parameters of the search, those of the level at rest last.
struct Known {
    value: f64,
    gradient: Vec<(usize, f64)>,
}

impl Answer<'_> {
    fn told(&self, choice: Choice) -> Result<StepModes> {
        let (c, scale) = (self.c, self.study.scale);
        let modes = modes(c, choice.colour);
        let level = self.level();
        let gain = self.gain(&level);
        let (delay, excess) = self.delay().unzip();
        let mut known: Vec<(String, Known)> = modes.iter().enumerate().flat_map(named).collect();
        match (&gain, &delay) {
            (Some(K), delay) => {
                if self.study.options.gain.is_none() {
                    known.push(("K".to_owned(), K.copy()));
                }
                known.extend(delay.as_ref().map(|L| ("L".to_owned(), L.copy())));
            }
            (None, _) => known.push(("level".to_owned(), level.copy())),
        }
        let numerator = delay.as_ref().and_then(|L| self.numerator(L.value, excess.unwrap_or(0)));
        let zeros = numerator.as_ref().map_or(Vec::new(), |n| roots(&n.0));
        let told = |k: &Known| (k.value, self.sd(&k.gradient));
        let result = StepModes {
            order: c.order(),
            poles: c.sections.poles(),
            names: known.iter().map(|(name, _)| name.clone()).collect(),
            theta: known.iter().map(|(_, k)| k.value).collect(),
            P: self.covariance(&known),
            model: self.model(gain.as_ref(), delay.as_ref(), numerator.as_ref(), &modes),
            gain: gain.as_ref().map(told),
            level: told(&level),
            rest: self.study.steps.rest.map(|rest| (rest.y, rest.sd)),
            step: self
                .study
                .steps
                .row
                .map(|row| (self.study.rec.time(row), self.study.steps.rest.map_or(0.0, |rest| rest.du))),
            delay: delay.as_ref().map(told),
            numerator,
            zeros,
            colour: choice.colour,
            N: c.N,
            loss: c.rss / c.N as f64 / scale.factor.powi(2),
            status: if c.converged { Status::Converged } else { Status::NotConverged },
            rows: self.rows(),
            curve: self.curve(),
            parts: self.parts(&modes).unwrap_or_default(),
            notes: [choice.notes, self.notes(&modes)].concat(),
            tried: choice.tried,
            modes,
        };
        finite(result)
    }

    /// Where the level at rest stands in a gradient, after all parameters of the search.
    fn at_rest(&self) -> usize {
        self.c.n
    }

    /// Entry of the covariance of all parameters, in scaled units, the level at rest last.
    fn entry(&self, i: usize, j: usize) -> f64 {
        let n = self.c.n;
        if i < n && j < n {
            self.c.P[i * n + j] * self.wide.powi(2)
        } else if i == j {
            self.study.steps.rest.map_or(0.0, |rest| (rest.sd * self.study.scale.factor).powi(2))
        } else {
            0.0
        }
    }

    fn sd(&self, g: &[(usize, f64)]) -> f64 {
        let mut sum = 0.0;
        for &(i, a) in g.iter().filter(|(_, a)| *a != 0.0) {
            for &(j, b) in g.iter().filter(|(_, b)| *b != 0.0) {
                sum += a * b * self.entry(i, j);
            }
        }
        if sum.is_finite() { sum.max(0.0).sqrt() } else { f64::INFINITY }
    }

    fn covariance(&self, known: &[(String, Known)]) -> Vec<f64> {
        let all = self.c.n + 1;
        let map: Vec<Vec<f64>> = known
            .iter()
            .map(|(_, k)| {
                let mut row = vec![0.0; all];
                k.gradient.iter().for_each(|&(i, g)| row[i] += g);
                row
            })
            .collect();
        congruence(&map, |i, j| self.entry(i, j))
    }

    /// y far after the first step.
    fn level(&self) -> Known {
        let f = self.study.scale.factor;
        let first = &self.study.steps.responses[0];
        let known = super::known_level(self.study.steps, first.u, self.study.options.gain);
        match (self.study.data.shared(), known) {
            (0, known) => Known { value: known.unwrap_or(0.0), gradient: Vec::new() },
            (_, known) => Known {
                value: known.unwrap_or(self.study.scale.zero) + self.c.linear.beta[0] / f,
                gradient: vec![(self.c.shared(), 1.0 / f)],
            },
        }
    }

    /// The static gain: given, from the levels of several steps, or from the rest before one.
    fn gain(&self, level: &Known) -> Option<Known> {
        let f = self.study.scale.factor;
        if let Some(K) = self.study.options.gain {
            return Some(Known { value: K, gradient: Vec::new() });
        }
        if self.study.data.shared() > 1 {
            let gradient = vec![(self.c.shared() + 1, 1.0 / f)];
            return Some(Known { value: self.c.linear.beta[1] / f, gradient });
        }
        let rest = self.study.steps.rest.filter(|rest| rest.du != 0.0)?;
        let mut gradient: Vec<(usize, f64)> = level.gradient.iter().map(|(i, g)| (*i, g / rest.du)).collect();
        gradient.push((self.at_rest(), -1.0 / (rest.du * f)));
        Some(Known { value: (level.value - rest.y) / rest.du, gradient })
    }

    /// y at rest as the curve of the search counts it.
    fn scaled_rest(&self) -> Option<f64> {
        let rest = self.study.steps.rest?;
        let first = self.study.steps.responses[0].u;
        let known = super::known_level(self.study.steps, first, self.study.options.gain);
        Some(known.map_or(self.study.scale.apply(rest.y), |level| (rest.y - level) * self.study.scale.factor))
    }

    /// The delay, and by how many the poles exceed the zeros.
    fn delay(&self) -> Option<(Known, usize)> {
        let (row, y0) = (self.study.steps.row?, self.scaled_rest()?);
        let back = self.study.rec.time(row) - self.study.data.pieces[0].first;
        let curve = Curve::new(self.c, &self.study.data.pieces[0].shared, y0, self.at_rest());
        let begin = curve.begin(back, |i, j| self.entry(i, j));
        Some((Known { value: begin.t - back, gradient: begin.gradient }, begin.conditions))
    }

    /// The numerator when the response begins `L` after the step, by central differences.
    fn numerator(&self, L: f64, excess: usize) -> Option<(Vec<f64>, Vec<f64>)> {
        let (row, y0) = (self.study.steps.row?, self.scaled_rest()?);
        let (c, k, m) = (self.c, self.c.order(), self.study.data.shared());
        let t = self.study.rec.time(row) + L - self.study.data.pieces[0].first;
        let shared = &self.study.data.pieces[0].shared;
        let of = |p: &[f64]| {
            let sections = Sections { pattern: c.sections.pattern.clone(), q: p[..k].to_vec() };
            let phi = sections.matrix().exponential(t);
            let state = |i: usize| (0..k).map(|j| phi.part(0)[i * k + j] * p[k + m + j]).sum::<f64>();
            let level: f64 = shared.iter().zip(&p[k..]).map(|(x, b)| x * b).sum();
            numerator(&sections, level - p[k + m + k], &(0..k).map(state).collect::<Vec<f64>>())
        };
        let p: Vec<f64> = [&c.sections.q, &c.linear.beta, &c.linear.c[0]]
            .into_iter()
            .flatten()
            .copied()
            .chain([y0])
            .collect();
        let place = |i: usize| if i < k + m + k { i } else { self.at_rest() };
        let slopes = slopes(&p, of);
        let sd = |j: usize| self.sd(&(0..p.len()).map(|i| (place(i), slopes[i][j])).collect::<Vec<_>>());
        let values = of(&p);
        values
            .iter()
            .all(|x| x.is_finite())
            .then(|| (values[excess..].to_vec(), (excess..=k).map(sd).collect()))
    }

    /// What each mode adds to the first response, with deviations by central differences.
    fn parts(&self, modes: &[Mode]) -> Option<Parts> {
        let (c, k, f) = (self.c, self.c.order(), self.study.scale.factor);
        let piece = &self.study.data.pieces[0];
        let (split, end) = (splits(&c.sections, modes), piece.t[piece.t.len() - 1]);
        let of = |p: &[f64]| {
            let sections = Sections { pattern: c.sections.pattern.clone(), q: p[..k].to_vec() };
            parts(&sections, &split, &p[k..], end).map_or(Vec::new(), |parts| parts.concat())
        };
        let p: Vec<f64> = c.sections.q.iter().chain(&c.linear.c[0]).copied().collect();
        let values = of(&p);
        let slopes = slopes(&p, of);
        if values.is_empty() || slopes.iter().any(|s| s.len() < values.len()) {
            return None;
        }
        let place = |i: usize| if i < k { i } else { c.states(0) + i - k };
        let sd = |j: usize| self.sd(&(0..p.len()).map(|i| (place(i), slopes[i][j])).collect::<Vec<_>>()) / f;
        let by_mode = |x: Vec<f64>| x.chunks_exact(POINTS).map(<[f64]>::to_vec).collect::<Vec<_>>();
        let first = self.study.data.pieces[0].first;
        Some(Parts {
            t: (0..POINTS).map(|i| first + end * i as f64 / (POINTS - 1) as f64).collect(),
            sd: by_mode((0..values.len()).map(sd).collect()),
            y: by_mode(values.iter().map(|y| y / f).collect()),
        })
    }

    /// A process model where that is enough, else a transfer function.
    fn model(
        &self,
        gain: Option<&Known>,
        delay: Option<&Known>,
        numerator: Option<&(Vec<f64>, Vec<f64>)>,
        modes: &[Mode],
    ) -> Option<crate::model::Model> {
        let K = gain?.value;
        let (L, num) = match (delay, numerator) {
            (Some(L), Some(numerator)) => (L.value, numerator.0.clone()),
            // A record that starts on its step shows neither delay nor zeros.
            _ => (0.0, vec![1.0]),
        };
        let (zeta, rest): (Vec<&Mode>, Vec<&Mode>) = modes.iter().partition(|m| m.kind != Kind::Lag);
        if self.c.order() <= 2 && num.len() <= 2 {
            let T: Vec<f64> = zeta.iter().chain(&rest).map(|m| m.T).collect();
            let zeta = zeta.first().and_then(|m| m.zeta).map(|z| z.0);
            let Tz = if num.len() == 2 { num[0] } else { 0.0 };
            return Some(ProcessModel { K, T, L, Tz, zeta, integrating: false }.into());
        }
        let factor = |m: &Mode| match m.zeta {
            Some((zeta, _)) => vec![m.T * m.T, 2.0 * zeta * m.T, 1.0],
            None => vec![m.T, 1.0],
        };
        let den = modes.iter().map(factor).fold(vec![1.0], |p, f| product(&p, &f));
        Some(TransferFunction { num: num.iter().map(|b| K * b).collect(), den, L }.into())
    }

    fn rows(&self) -> (Vec<f64>, Vec<f64>) {
        let pieces = self.study.data.pieces.iter().zip(&self.study.steps.responses);
        let of = |(piece, r): (&Piece, &Response)| {
            let known = super::known_level(self.study.steps, r.u, self.study.options.gain);
            let zero = known.unwrap_or(self.study.scale.zero);
            let row = |(t, y): (&f64, &f64)| (piece.first + t, zero + y / self.study.scale.factor);
            piece.t.iter().zip(&piece.y).map(row).collect::<Vec<_>>()
        };
        pieces.flat_map(of).unzip()
    }

    /// The fitted curve at the rows used, and its standard deviation.
    fn curve(&self) -> (Vec<f64>, Vec<f64>) {
        let (c, k, m, f) = (self.c, self.c.order(), self.study.data.shared(), self.study.scale.factor);
        let mut projection = Projection::new(&self.study.data, c.sections.clone());
        projection.fill();
        let (mut values, mut sds) = (Vec::with_capacity(c.N), Vec::with_capacity(c.N));
        for (i, (piece, r)) in self.study.data.pieces.iter().zip(&self.study.steps.responses).enumerate() {
            let (basis, states) = (projection.basis(i), &c.linear.c[i]);
            let known = super::known_level(self.study.steps, r.u, self.study.options.gain);
            let level: f64 = piece.shared.iter().zip(&c.linear.beta).map(|(x, b)| x * b).sum();
            for t in 0..piece.t.len() {
                let times = |part: usize| (0..k).map(|j| states[j] * basis.column(part, j)[t]).sum::<f64>();
                let mut g: Vec<(usize, f64)> = (0..k).map(|s| (s, times(1 + s))).collect();
                g.extend((0..m).map(|j| (k + j, piece.shared[j])));
                g.extend((0..k).map(|j| (c.states(i) + j, basis.column(0, j)[t])));
                values.push(known.unwrap_or(self.study.scale.zero) + (level + times(0)) / f);
                sds.push(self.sd(&g) / f);
            }
        }
        (values, sds)
    }

    fn notes(&self, modes: &[Mode]) -> Vec<Note> {
        let (c, rec, limits) = (self.c, self.study.rec, self.study.limits);
        let mut notes = Vec::new();
        let parameters = c.n as f64;
        if (c.N as f64) < limits.X03 * parameters {
            let text = format!("{} rows for {} parameters: intervals are rough", c.N, c.n);
            let ratio = c.N as f64 / parameters;
            notes.push(
                Note::warning("X03", text).count(c.N).measured(ratio, limits.X03).remedy("record longer"),
            );
        }
        let longest = self.study.data.longest();
        let (span, T) = (longest.t[longest.t.len() - 1], modes.last().map_or(0.0, |m| m.T));
        if span < SETTLED * T {
            let text = format!(
                "the record ends {} s after the response began, {:.2} of the longest time constant: level and \
                 time constant lean on each other",
                rounded(span),
                span / T
            );
            notes.push(
                Note::warning("X07", text).measured(span / T, SETTLED).remedy("record until y has settled"),
            );
        }
        notes.extend(self.study.steps.start(rec));
        let each = self.study.steps.each();
        if each > 1 {
            let text =
                format!("{} means of {each} rows each are looked at: the record is sampled finely", c.N);
            notes.push(Note::info("M09", text).count(c.N));
        }
        if !c.converged {
            notes.push(
                Note::warning("N05", "the search stopped before the gradient test passed")
                    .remedy("ask for a lower order"),
            );
        }
        notes
    }
}

/// Slopes of `of` along each of `p`, by central differences.
fn slopes(p: &[f64], of: impl Fn(&[f64]) -> Vec<f64>) -> Vec<Vec<f64>> {
    let along = |i: usize| {
        let h = 1e-6 * (1.0 + p[i].abs());
        let moved = |by: f64| {
            let mut p = p.to_vec();
            p[i] += by;
            of(&p)
        };
        moved(h).iter().zip(moved(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
    };
    (0..p.len()).map(along).collect()
}

impl Known {
    fn copy(&self) -> Known {
        Known { value: self.value, gradient: self.gradient.clone() }
    }
}

/// The parameters of mode `i`, with gradients of themselves, not of their logarithms.
fn named((i, mode): (usize, &Mode)) -> Vec<(String, Known)> {
    let scaled = |by: f64, g: &[(usize, f64)]| g.iter().map(|(j, x)| (*j, by * x)).collect();
    match mode.zeta {
        None => {
            let gradient = scaled(mode.T, &mode.gradients[0]);
            vec![(format!("T{}", i + 1), Known { value: mode.T, gradient })]
        }
        Some((zeta, _)) => {
            let w = 1.0 / mode.T;
            let of_w = Known { value: w, gradient: scaled(-w, &mode.gradients[0]) };
            let of_zeta = Known { value: zeta, gradient: scaled(zeta, &mode.gradients[1]) };
            vec![(format!("w{}", i + 1), of_w), (format!("zeta{}", i + 1), of_zeta)]
        }
    }
}

/// The result, if its numbers are; units far from one can overflow their squares (N02).
fn finite(result: StepModes) -> Result<StepModes> {
    let fine = result.theta.iter().chain([&result.loss]).all(|x| x.is_finite());
    if fine {
        return Ok(result);
    }
    Err(Error::new("N02", "the numbers of this record overflow or vanish when squared")
        .remedy("change the units so that the output is nearer to one"))
}
