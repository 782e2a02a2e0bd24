//! Plans an experiment that will tell K, T and L: which input, how large, how long.
//!
//! ```text
//! worst(A, N)  = max(sd K/|K|, sd T/T, sd L/(T + L)), predicted (information.rs), goes as 1/(A sqrt N)
//! amplitude    A = A0 worst(A0, N) / target          where the time is given
//! time         N = N0 (worst(A, N0) / target)^2      where it is not; A is then the largest allowed
//! allowed      |A| <= room of u,   A peak|y| <= room of y      about the operating point
//! ```
//!
//! Each shape of input ([`Shape`]) is judged at the largest amplitude that the limits allow it; the one that
//! then knows its worst parameter best is chosen. METHODS 1.1 and 8 (pitfall 8); Ljung 1999, 13.

mod information;
mod shapes;

use information::predicted_sd;
pub use information::{Disturbance, Predicted};
pub use shapes::Shape;
use shapes::{Candidate, best, rest};

use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::model::{Fopdt, ProcessModel};
use crate::note::{Note, Place, rounded};

/// Largest share of its value that the worst known parameter may be off, in standard deviations.
pub const MOST: f64 = 0.25;

/// Standard deviations of L within which it cannot be told from 0.
const NEAR_ZERO: f64 = 2.0;

/// Rows after the rest, at least.
const LEAST_ROWS: usize = 20;

/// Rows of an experiment, at most.
const MOST_ROWS: usize = 200_000;

/// Where a signal is, and by how much it may leave that on either side; infinite where nothing is said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Room {
    /// Operating point.
    pub at: f64,
    /// To the nearer limit.
    pub room: f64,
}

impl Room {
    /// From the ends of a signal's travel, and its operating point, which is their middle where not given.
    pub fn new(name: &str, limits: Option<(f64, f64)>, at: Option<f64>) -> Result<Self> {
        let Some((low, high)) = limits else {
            return Ok(Room { at: at.unwrap_or(0.0), room: f64::INFINITY });
        };
        let at = at.unwrap_or((low + high) / 2.0);
        let room = (high - at).min(at - low);
        if !(room > 0.0 && room.is_finite()) {
            let came = format!("({low}, {high}) about {at}");
            return Err(Error::argument(name, came, "finite, on both sides of the operating point"));
        }
        Ok(Room { at, room })
    }
}

/// What is wished.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Sample time, s.
    pub Ts: f64,
    /// Disturbance at the output.
    pub noise: Disturbance,
    /// Time available, s; as much as is needed where absent.
    pub time: Option<f64>,
    /// By how much the input may move.
    pub u: Room,
    /// By how much the output may move.
    pub y: Room,
    /// Wished share of its value to which the worst parameter is known, one standard deviation.
    pub target: f64,
    /// The shape to take; the best where absent.
    pub shape: Option<Shape>,
    /// Of the first sequence tried.
    pub seed: u64,
}

/// A shape at its own amplitude.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Form of the input.
    pub shape: Shape,
    /// Rows from one move to the next.
    pub hold: usize,
    /// Amplitude at which it reaches the target, or the largest allowed.
    pub amplitude: f64,
    /// Whether it reaches the target within the room.
    pub reaches: bool,
    /// Peak of `|y|` about the operating point.
    pub peak: f64,
    /// Of K, T and L.
    pub sd: [f64; 3],
    /// `sd K / |K|`, `sd T / T`, `sd L / (T + L)`.
    pub relative: [f64; 3],
}

/// A planned experiment.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// Input, `(N,)`.
    pub u: Vec<f64>,
    /// Predicted response without noise, `(N,)`.
    pub y: Vec<f64>,
    /// The shape chosen, as in `trials`.
    pub chosen: Trial,
    /// Every shape that could be tried, best first.
    pub trials: Vec<Trial>,
    /// What to know about the numbers.
    pub notes: Vec<Note>,
}

/// Chooses input, amplitude and, where it is not given, time.
pub fn experiment(plant: &Fopdt, plan: &Plan, limits: &Limits) -> Result<Experiment> {
    check(plant, plan, limits)?;
    let N = match plan.rows() {
        Some(N) => N,
        None => enough(plant, plan)?,
    };
    let candidates = candidates(plant, plan, N)?;
    let chosen = candidates[0].trial(plan);
    if !chosen.reaches {
        return Err(out_of_reach(&candidates[0], &chosen, plan, N));
    }
    let scaled = |x: &[f64], at: f64| x.iter().map(|x| at + chosen.amplitude * x).collect();
    Ok(Experiment {
        u: scaled(&candidates[0].u, plan.u.at),
        y: scaled(&candidates[0].predicted.y, plan.y.at),
        trials: candidates.iter().map(|c| c.trial(plan)).collect(),
        notes: notes(plant, &chosen),
        chosen,
    })
}

/// Refuses a plant that cannot be sampled so, and wishes that make no sense.
fn check(plant: &Fopdt, plan: &Plan, limits: &Limits) -> Result<()> {
    ProcessModel::from(*plant).check()?;
    let Plan { Ts, target, .. } = *plan;
    if !(Ts > 0.0 && Ts.is_finite()) {
        return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
    }
    if Ts > limits.M09 * plant.T {
        return Err(Error::new("M09", format!("a sample time of {Ts} s is too long for T = {} s", plant.T))
            .at(Place::column("Ts"))
            .measured(Ts / plant.T, limits.M09)
            .remedy(format!("sample every {} s", rounded(plant.T / 10.0))));
    }
    if !(target > 0.0 && target <= MOST) {
        let needed = format!("positive and at most {MOST}: beyond it a model is not worth its experiment");
        return Err(Error::argument("target", target, &needed));
    }
    let least = rest(plant, Ts) + LEAST_ROWS;
    if let Some(rows) = plan.rows().filter(|&N| N < least) {
        return Err(Error::new("X03", format!("{rows} rows are too few for a dead time of {} s", plant.L))
            .at(Place::column("time"))
            .measured(rows as f64, least as f64)
            .remedy(format!("take at least {} s", rounded(least as f64 * Ts))));
    }
    if let Some(time) = plan.time.filter(|&time| !(time <= MOST_ROWS as f64 * Ts)) {
        let needed = format!("at most {} s, which is {MOST_ROWS} rows", MOST_ROWS as f64 * Ts);
        return Err(Error::argument("time", time, &needed));
    }
    plan.noise.check()
}

impl Plan {
    /// Rows in the time available.
    fn rows(&self) -> Option<usize> {
        self.time.map(|time| (time / self.Ts * (1.0 + 1e-12)) as usize)
    }

    /// Whether the input or the output has limits.
    fn is_limited(&self) -> bool {
        self.u.room.is_finite() || self.y.room.is_finite()
    }
}

/// The shapes that can be judged, best first.
fn candidates(plant: &Fopdt, plan: &Plan, N: usize) -> Result<Vec<Candidate>> {
    let shapes = plan.shape.map_or(Shape::ALL.to_vec(), |shape| vec![shape]);
    let (mut found, mut refused) = (Vec::new(), None);
    for shape in shapes {
        match best(shape, plant, N, plan.Ts, &plan.noise, plan.seed) {
            Ok(candidate) => found.push(candidate),
            Err(error) => refused = refused.or(Some(error)),
        }
    }
    let worst = |c: &Candidate| c.predicted.worst() / c.compared(plan);
    found.sort_by(|a, b| worst(a).total_cmp(&worst(b)));
    match refused {
        Some(error) if found.is_empty() => Err(error),
        _ => Ok(found),
    }
}

impl Candidate {
    /// Peak of the response to an amplitude of 1.
    fn peak(&self) -> f64 {
        self.predicted.y.iter().fold(0.0, |peak: f64, y| peak.max(y.abs()))
    }

    /// Largest amplitude within the room.
    fn allowed(&self, plan: &Plan) -> f64 {
        plan.u.room.min(plan.y.room / self.peak())
    }

    /// The amplitude at which shapes are compared: the largest allowed, or the same for all.
    fn compared(&self, plan: &Plan) -> f64 {
        if plan.is_limited() { self.allowed(plan) } else { 1.0 }
    }

    /// The shape at the amplitude that it needs, or at the largest allowed.
    fn trial(&self, plan: &Plan) -> Trial {
        let needed = self.predicted.worst() / plan.target;
        let allowed = self.allowed(plan);
        let amplitude = needed.min(allowed);
        Trial {
            shape: self.shape,
            hold: self.hold,
            amplitude,
            reaches: needed <= allowed * (1.0 + 1e-9),
            peak: amplitude * self.peak(),
            sd: self.predicted.sd.map(|sd| sd / amplitude),
            relative: self.predicted.relative.map(|share| share / amplitude),
        }
    }
}

impl Trial {
    /// The least known of the three.
    pub fn worst(&self) -> f64 {
        self.relative.iter().copied().fold(0.0, f64::max)
    }
}

/// Rows at which the largest amplitude allowed reaches the target.
fn enough(plant: &Fopdt, plan: &Plan) -> Result<usize> {
    if !plan.is_limited() {
        return Err(Error::argument(
            "time",
            "not given and neither are limits",
            "given, or limits of u or y",
        ));
    }
    let least = rest(plant, plan.Ts) + LEAST_ROWS;
    let dynamics = (5.0 * (plant.T + plant.L) / plan.Ts).ceil() as usize;
    let reaches = |N: usize| {
        candidates(plant, plan, N)
            .is_ok_and(|all| all[0].predicted.worst() <= all[0].allowed(plan) * plan.target)
    };
    let (mut short, mut long) = (least, (rest(plant, plan.Ts) + dynamics).clamp(least, MOST_ROWS));
    while long < MOST_ROWS && !reaches(long) {
        (short, long) = (long, (2 * long).min(MOST_ROWS));
    }
    while long - short > long / 20 {
        let between = short.midpoint(long);
        if reaches(between) { long = between } else { short = between }
    }
    Ok(long)
}

/// X07: what the limits allow in this time is not enough; what would be.
fn out_of_reach(best: &Candidate, trial: &Trial, plan: &Plan, N: usize) -> Error {
    let worst = trial.worst();
    let share = worst / plan.target;
    let rows = N as f64 * share * share;
    let text = format!(
        "more time needed: within the limits, an amplitude of {} over {} s leaves {:.1} % at one standard \
         deviation, not {:.1} %",
        rounded(trial.amplitude),
        rounded(N as f64 * plan.Ts),
        100.0 * worst,
        100.0 * plan.target
    );
    let needed = best.predicted.worst() / plan.target;
    Error::new("X07", text)
        .at(Place::column("time"))
        .count(rows.ceil() as usize)
        .measured(worst, plan.target)
        .remedy(format!(
            "take {} s ({} rows), or an amplitude of {}, or a target of {}",
            (rows.ceil() * plan.Ts).ceil(),
            rows.ceil(),
            rounded(needed),
            rounded(worst)
        ))
}

/// What to know about the predicted numbers.
fn notes(plant: &Fopdt, chosen: &Trial) -> Vec<Note> {
    near_zero(plant, chosen.sd[2]).into_iter().collect()
}

/// X07 where L cannot be told from 0: its interval is one-sided and its spread is smaller than predicted.
pub fn near_zero(plant: &Fopdt, sd: f64) -> Option<Note> {
    (plant.L < NEAR_ZERO * sd).then(|| {
        let text = format!(
            "L = {} s lies within {NEAR_ZERO} standard deviations of 0: its interval will be one-sided, and its \
             spread about half of the predicted {} s at L = 0",
            rounded(plant.L),
            rounded(sd)
        );
        Note::info("X07", text).measured(plant.L / sd, NEAR_ZERO)
    })
}

/// What a given input will tell; refuses one that leaves a parameter unknown (X07).
pub fn judged(plant: &Fopdt, u: &[f64], Ts: f64, noise: &Disturbance) -> Result<Predicted> {
    ProcessModel::from(*plant).check()?;
    if !(Ts > 0.0 && Ts.is_finite()) {
        return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
    }
    let predicted = predicted_sd(plant, u, Ts, noise)?;
    too_little(&predicted, u.len(), Ts).map_or(Ok(predicted), Err)
}

/// X07 where an input will leave a parameter unknown.
fn too_little(predicted: &Predicted, N: usize, Ts: f64) -> Option<Error> {
    let worst = predicted.worst();
    (worst > MOST).then(|| {
        let share = worst / MOST;
        let rows = (N as f64 * share * share).ceil();
        let [K, T, L] = predicted.relative.map(|share| 100.0 * share);
        let text =
            format!("more time needed: K would be known to {K:.0} %, T to {T:.0} %, L to {L:.0} % of T + L");
        let remedy = format!(
            "take {} s ({rows} rows), or {} times the amplitude; end no step before it has settled",
            rounded(rows * Ts),
            rounded(share)
        );
        Error::new("X07", text).count(rows as usize).measured(worst, MOST).remedy(remedy)
    })
}
