//! Whether what a linear model leaves depends on where its input turned: a dead band (M05) or hysteresis (M06).
//!
//! The model's own dynamics `G` answer to other inputs beside `u`:
//!
//! ```text
//! y(t) = sum_k g_k (G u)(t - k) + sum_i w_i (G z_i)(t) + O + initial state        k = 0, 1, 2, 4, 8, 16
//! ```
//!
//! where `z_i` are plays of `u`, which remember its turning points, and the lags stand for whatever else is linear. An
//! F test on the rows that the autocorrelation of the errors leaves independent says whether the plays add something.
//! A dead band is looked for with one input in place of `u`: one play (backlash), or a value that stays until the
//! command is off by more (stiction).

use std::ops::Range;

use super::residuals::correlation;
use crate::limits::Limits;
use crate::linalg::{Block, Segmented, Triangle, extent, residual_norm2, solve_damped};
use crate::model::{Model, Response};
use crate::note::{Note, Place};
use crate::record::Record;
use crate::stats::{centred, f_tail};

/// Lags of the model's output that stand for linear dynamics it lacks.
const LAGS: [usize; 6] = [0, 1, 2, 4, 8, 16];

/// The longest of them.
const LONGEST: usize = LAGS[LAGS.len() - 1];

/// Plays, their half widths equal parts of half the travel of `u`.
const PLAYS: usize = 5;

/// Half widths of a dead band that are tried, as shares of half the travel.
const WIDTHS: usize = 20;
const NARROWEST: f64 = 0.01;
const WIDEST: f64 = 0.6;

/// What a dead band leaves may be so many times what the plays leave: it has fewer parameters.
const AS_GOOD: f64 = 1.5;

/// Columns that depend on others to this degree add nothing.
const DEPENDENT: f64 = 1e-9;

/// Largest lag of the errors' autocorrelation.
const LAG_MOST: usize = 500;

/// An input, and the lags at which the model's answer to it takes part.
type Lagged = (Vec<f64>, &'static [usize]);

/// M05 or M06, where one of them explains enough of what the model leaves.
pub(super) fn memory(model: &Model, rec: &Record, limits: &Limits) -> Option<Note> {
    let study = Study::new(model, rec)?;
    let mut linear = study.explained(vec![(rec.u.to_vec(), &LAGS[..])]);
    let plays = (1..=PLAYS).map(|i| i as f64 / (PLAYS + 1) as f64 * study.half);
    let plays = plays.map(|half| (study.passed(Slack::Backlash, half), &LAGS[..1]));
    let mut stack = study.explained([(rec.u.to_vec(), &LAGS[..])].into_iter().chain(plays).collect());
    let (rss, rss_stack, N) = (linear.left(), stack.left(), stack.independent());
    let band = study.dead_band()?;
    let explains = |left: f64, more: usize, least: f64| {
        let rest = N - (LAGS.len() + more) as f64;
        let F = (rss - left) / more as f64 / (left / rest).max(f64::MIN_POSITIVE);
        1.0 - left / rss >= least && rest > 0.0 && f_tail(F, more as f64, rest) <= limits.X04
    };
    if explains(band.left, 2, limits.M05) && band.left <= AS_GOOD * rss_stack {
        return Some(study.dead_band_note(&band, 1.0 - band.left / rss, limits));
    }
    explains(rss_stack, PLAYS, limits.M06).then(|| hysteresis_note(rec, 1.0 - rss_stack / rss, limits))
}

fn hysteresis_note(rec: &Record, share: f64, limits: &Limits) -> Note {
    let (name, percent) = (rec.input_name(0), 100.0 * share);
    Note::warning(
        "M06",
        format!(
            "hysteresis: where {name} turned explains {percent:.0} % of the variance that a linear model leaves"
        ),
    )
    .at(Place::column(name))
    .measured(share, limits.M06)
    .remedy("a model that remembers, and its inverse: pt.hysteresis, plantune identify --model hysteresis")
}

/// What may stand between command and effect.
#[derive(Clone, Copy, PartialEq)]
enum Slack {
    /// The effect follows at a distance.
    Backlash,
    /// The effect stays until the command is off by more.
    Stiction,
}

impl Slack {
    fn next(self, u: f64, half: f64, z: f64) -> f64 {
        match self {
            Slack::Backlash => (u - half).max((u + half).min(z)),
            Slack::Stiction if (u - z).abs() <= half => z,
            Slack::Stiction => u,
        }
    }
}

/// The dead band that explains most.
struct DeadBand {
    slack: Slack,
    half: f64, // half width, units of u
    left: f64, // sum of squares
}

/// A model and a record, beside which other inputs are tried.
struct Study<'a> {
    model: &'a Model,
    rec: &'a Record<'a>,
    history: usize,
    half: f64, // half the travel of u
    segments: Vec<Range<usize>>,
}

impl<'a> Study<'a> {
    /// None where there is not one input that moves, or no segment is long enough.
    fn new(model: &'a Model, rec: &'a Record<'a>) -> Option<Self> {
        let history = model.history(rec.Ts);
        let segments: Vec<_> = rec.segments().filter(|s| s.len() > history + 2 * LONGEST).collect();
        let (low, high) = extent(rec.u);
        let half = 0.5 * (high - low);
        let fits = rec.nu == 1 && rec.ny == 1 && half > 0.0 && !segments.is_empty();
        fits.then_some(Study { model, rec, history, half, segments })
    }

    /// The input behind a slack; where in it a segment begins is not known.
    fn passed(&self, slack: Slack, half: f64) -> Vec<f64> {
        let mut v = self.rec.u.to_vec();
        for s in &self.segments {
            let mut z = v[s.start];
            for u in &mut v[s.clone()] {
                z = slack.next(*u, half, z);
                *u = z;
            }
        }
        v
    }

    fn explained(&self, inputs: Vec<Lagged>) -> Explained<'_> {
        Explained::new(self, &inputs)
    }

    /// None where nothing is left to explain.
    fn dead_band(&self) -> Option<DeadBand> {
        let shares =
            (0..WIDTHS).map(|i| NARROWEST * (WIDEST / NARROWEST).powf(i as f64 / (WIDTHS - 1) as f64));
        let halves: Vec<f64> = shares.map(|share| share * self.half).collect();
        [Slack::Backlash, Slack::Stiction]
            .into_iter()
            .flat_map(|slack| halves.iter().map(move |&half| (slack, half)))
            .map(|(slack, half)| {
                let left = self.explained(vec![(self.passed(slack, half), &LAGS[..])]).left();
                DeadBand { slack, half, left }
            })
            .min_by(|a, b| a.left.total_cmp(&b.left))
            .filter(|band| band.left > 0.0)
    }

    /// Static gains behind the dead band where what passes it rises and where it falls.
    fn gains(&self, band: &DeadBand) -> (f64, f64) {
        let passed = self.passed(band.slack, band.half);
        let part = |keep: fn(f64, f64) -> f64| {
            let mut sum = 0.0;
            let moves = passed.windows(2).map(|v| keep(v[1] - v[0], 0.0));
            [0.0]
                .into_iter()
                .chain(moves)
                .map(|move_| {
                    sum += move_;
                    sum
                })
                .collect::<Vec<f64>>()
        };
        let theta = self.explained(vec![(part(f64::max), &LAGS[..1]), (part(f64::min), &LAGS[..1])]).theta();
        let K = self.model.dc_gain()[0];
        (K * theta[0], K * theta[1])
    }

    fn dead_band_note(&self, band: &DeadBand, share: f64, limits: &Limits) -> Note {
        let name = self.rec.input_name(0);
        let (width, percent) = match band.slack {
            Slack::Backlash => (2.0 * band.half, 100.0 * band.half / self.half),
            Slack::Stiction => (band.half, 50.0 * band.half / self.half),
        };
        let (rising, falling) = self.gains(band);
        let kind = if band.slack == Slack::Backlash { "backlash" } else { "stiction" };
        let text = format!(
            "non-linear, {kind}: {name} acts only after about {width:.3} ({percent:.1} % of its travel); \
             gain {rising:.4} where what passes rises, {falling:.4} where it falls"
        );
        Note::warning("M05", text)
            .at(Place::column(name))
            .measured(share, limits.M05)
            .remedy("look at the valve or the gear; record with moves well beyond the dead band")
    }
}

/// Least squares of y on the model's answers to some inputs, an offset and the initial states.
struct Explained<'a> {
    study: &'a Study<'a>,
    lags: Vec<&'static [usize]>, // of each input
    answers: Vec<Vec<Response>>, // per segment and input
    problem: Segmented,
}

impl<'a> Explained<'a> {
    fn new(study: &'a Study<'a>, inputs: &[Lagged]) -> Self {
        let answer = |s: &Range<usize>| -> Vec<Response> {
            inputs.iter().map(|(v, _)| study.model.simulation(&v[s.clone()], 1, study.rec.Ts)).collect()
        };
        let answers: Vec<_> = study.segments.iter().map(answer).collect();
        let lags: Vec<_> = inputs.iter().map(|(_, lags)| *lags).collect();
        let (local, shared) =
            (answers[0][0].free.len(), 1 + lags.iter().map(|lags| lags.len()).sum::<usize>());
        let problem = Segmented::new(local, shared);
        let mut explained = Explained { study, lags, answers, problem };
        for i in 0..study.segments.len() {
            let n = local + shared + 1;
            let (mut triangle, mut block) = (Triangle::new(n), Block::new(n));
            explained.rows(i).for_each(|(row, _)| block.push(&row));
            triangle.absorb(&mut block);
            explained.problem.push(triangle);
        }
        explained
    }

    /// Each row of a segment: initial states, lagged answers, offset, output.
    fn rows(&self, segment: usize) -> impl Iterator<Item = (Vec<f64>, f64)> + '_ {
        let Study { rec, history, segments, .. } = self.study;
        let (s, answers) = (&segments[segment], &self.answers[segment]);
        (s.start + history + LONGEST..s.end).filter(|&row| rec.is_valid(row, 0)).map(move |row| {
            let k = row - s.start - history;
            let y = rec.y_at(row, 0) - rec.y_at(0, 0);
            let free = answers[0].free.iter().map(|free| free[k]);
            let inputs = answers.iter().zip(&self.lags);
            let forced = inputs.flat_map(|(a, lags)| lags.iter().map(move |lag| a.forced[k - lag]));
            (free.chain(forced).chain([1.0, y]).collect(), y)
        })
    }

    /// Sum of squares that is left.
    fn left(&mut self) -> f64 {
        let shared: Vec<usize> = (0..self.problem.shared()).collect();
        residual_norm2(self.problem.common(), &shared, shared.len(), DEPENDENT)
    }

    fn theta(&mut self) -> Vec<f64> {
        let shared: Vec<usize> = (0..self.problem.shared()).collect();
        solve_damped(self.problem.common(), &shared, shared.len(), DEPENDENT * DEPENDENT)
    }

    /// As many rows as the autocorrelation of the errors leaves independent (Bartlett).
    fn independent(&mut self) -> f64 {
        let theta = self.theta();
        let locals = self.problem.locals(&theta);
        let errors = (0..self.answers.len()).flat_map(|i| {
            let parameters: Vec<f64> = locals[i].iter().chain(&theta).copied().collect();
            self.rows(i).map(move |(row, y)| y - row.iter().zip(&parameters).map(|(x, p)| x * p).sum::<f64>())
        });
        let e = centred(errors.collect());
        let r = correlation(&e, &e, (e.len() / 4).min(LAG_MOST));
        e.len() as f64 / (1.0 + 2.0 * r[1..].iter().map(|r| r * r).sum::<f64>())
    }
}
