//! A plant with exact dead time in a loop with a PID controller, continuous or sampled.
//!
//! ```text
//! sampled      every Ts:  read y, compute u, hold it; exact at the samples and in between
//! continuous   nodes h apart, u a straight line in between, with jumps at nodes; of order h^2
//! y = G (position(u) + d) + O + dy,   u = controller(r, y + noise) + p
//! ```
//!
//! A loop over a record is [`SampledPid::step`] and [`Plant::run`] in a loop. The plants are
//! [`super::plant`], [`super::ramped`] and [`super::varying`], the controllers [`super::controller`] and
//! [`super::continuous`]. Source 001, 3.4 and 3.7.6, with the exact delay instead of its Taylor and Padé forms.

use super::actuator::{quantised, within};
use super::continuous::ContinuousPid;
use super::controller::SampledPid;
use super::indices::{Course, Indices, Move, Sums};
use super::plant::{Plant, SampledPlant, resting};
use super::ramped::{Affine, Ramped};
use super::settings::{ClosedLoopSettings, InForce, check, nodes_per_step};
use super::state::{FirstOrder, General, State};
use super::varying::{Varying, VaryingPlant};
use crate::error::{Error, Result};
use crate::model::{Model, Pid, Realisation};
use crate::note::{Note, Place};

/// An output as many times larger than its set point and start ends the simulation.
const RUNAWAY: f64 = 1e9;

/// Rows of a response, and what they amount to.
#[derive(Clone, Debug)]
pub struct ClosedLoop {
    /// Plant output without noise, from row 0 to the end of the last step.
    pub y: Vec<f64>,
    /// Controller output from each row on.
    pub u: Vec<f64>,
    /// How it ended.
    pub run: LoopRun,
}

/// What a simulation amounts to.
#[derive(Clone, Debug)]
pub struct LoopRun {
    /// Rows written.
    pub rows: usize,
    /// Indices from true integrals.
    pub indices: Indices,
    /// Controller output that holds the last set point against the last disturbances.
    pub u_final: f64,
    /// Whether the loop ran away.
    pub notes: Vec<Note>,
}

/// The plant of a loop.
#[derive(Clone, Copy, Debug)]
pub enum LoopPlant<'s> {
    /// One model throughout.
    Fixed(&'s Model),
    /// Parameters of every row; the offset is its own.
    Varying(&'s Varying<'s>),
}

/// Simulates the loop over `r.len()` steps.
pub fn closed_loop(model: &Model, pid: &Pid, settings: &ClosedLoopSettings) -> Result<ClosedLoop> {
    let rows = settings.r.len() + 1;
    let (mut y, mut u) = (vec![0.0; rows], vec![0.0; rows]);
    let run = closed_loop_into(LoopPlant::Fixed(model), pid, settings, &mut y, &mut u)?;
    y.truncate(run.rows);
    u.truncate(run.rows);
    Ok(ClosedLoop { y, u, run })
}

/// As [`closed_loop`], into the caller's memory, `r.len() + 1` rows each.
pub fn closed_loop_into(
    plant: LoopPlant,
    pid: &Pid,
    settings: &ClosedLoopSettings,
    y: &mut [f64],
    u: &mut [f64],
) -> Result<LoopRun> {
    let mut rows = Rows::new(plant, pid, settings, y, u)?;
    let (u0, offset) = (settings.u0, settings.offset);
    let written = match (plant, pid.Ts) {
        (LoopPlant::Varying(parameters), Some(Ts)) => {
            rows.sampled(VaryingPlant::new(parameters, settings.r.len(), Ts, u0)?, pid, Ts)
        }
        (LoopPlant::Varying(_), None) => {
            return Err(Error::argument("pid", "continuous", "sampled for a varying plant: give it a Ts"));
        }
        (LoopPlant::Fixed(model), Some(Ts)) => match SampledPlant::new(model, Ts, u0, offset)? {
            SampledPlant::First(plant) => rows.sampled(plant, pid, Ts),
            SampledPlant::General(plant) => rows.sampled(plant, pid, Ts),
            SampledPlant::Poly(plant) => rows.sampled(plant, pid, Ts),
        },
        (LoopPlant::Fixed(model), None) => {
            let stride = nodes_per_step(model, pid, settings)?;
            match (model.first_order(), model.transfer()) {
                (Some(first), _) => rows.continuous(FirstOrder::new(&first), first.L, pid, stride)?,
                (None, Some(G)) => {
                    rows.continuous(General::new(Realisation::of(&G), G.poles()), G.L, pid, stride)?
                }
                (None, None) => {
                    let needed = "sampled for a PolyModel: give it the Ts of the model";
                    return Err(Error::argument("pid", "continuous", needed));
                }
            }
        }
    };
    Ok(rows.finish(written))
}

/// Rows written, and indices.
type Ended = (usize, Indices);

/// A loop at work: what it is asked, and what has come of it.
struct Rows<'a, 's> {
    s: &'a ClosedLoopSettings<'s>,
    y: &'a mut [f64],
    u: &'a mut [f64],
    course: Course,
    y0: f64,
    u_final: f64,
}

impl<'a, 's> Rows<'a, 's> {
    fn new(
        plant: LoopPlant,
        pid: &Pid,
        s: &'a ClosedLoopSettings<'s>,
        y: &'a mut [f64],
        u: &'a mut [f64],
    ) -> Result<Self> {
        check(pid, s)?;
        if y.len() != s.r.len() + 1 || u.len() != y.len() {
            let came = format!("{} and {} long", y.len(), u.len());
            return Err(Error::argument("y, u", came, &format!("{} long", s.r.len() + 1)));
        }
        let (y0, K, offset) = match plant {
            LoopPlant::Fixed(model) => {
                model.check()?;
                (resting(model, s.u0, s.offset), model.dc_gain()[0], s.offset)
            }
            LoopPlant::Varying(parameters) => {
                parameters.check(s.r.len())?;
                let ((first, offset), (last, end)) = (parameters.at(0), parameters.at(s.r.len() - 1));
                (first.K * s.u0 + offset, last.K, end)
            }
        };
        let end = s.r.len() - 1;
        let (r, d) = (s.r[end], s.of(s.d, end));
        let u_final = if K.is_finite() { (r - s.of(s.dy, end) - offset) / K - d } else { s.u0 - d };
        let course = Course::new(Move { from: y0, to: r }, Move { from: s.u0, to: u_final });
        Ok(Rows { s, y, u, course, y0, u_final })
    }

    /// Every sample: read, compute, hold.
    fn sampled(&mut self, plant: impl Plant, pid: &Pid, Ts: f64) -> Ended {
        let s = self.s;
        let signals = [s.d, s.dy, s.noise, s.p, s.manual];
        let constant = s.settings.is_empty() && s.schedule.is_empty() && s.actuator.follows();
        if signals.iter().all(Option::is_none) && constant && s.y_step == 0.0 {
            self.sample_by_sample::<true>(plant, pid, Ts)
        } else {
            self.sample_by_sample::<false>(plant, pid, Ts)
        }
    }

    /// `PLAIN`: a set point and nothing else.
    fn sample_by_sample<const PLAIN: bool>(&mut self, mut plant: impl Plant, pid: &Pid, Ts: f64) -> Ended {
        let s = self.s;
        let of = |x: Option<&[f64]>, k: usize| if PLAIN { 0.0 } else { s.of(x, k) };
        let mut sums = Sums::new(&mut self.course);
        let mut settings = InForce::new(pid, s);
        let rest = quantised(plant.output(), s.y_step);
        let mut controller = SampledPid::new(&settings.first(), Ts, s.actuator, s.anti_windup, rest, s.u0);
        let (mut position, mut last) = (s.u0, s.u0);
        let rows = s.r.iter().zip(self.y.iter_mut().zip(self.u.iter_mut()));
        for (k, (&r, (y, u))) in rows.enumerate() {
            *y = plant.output() + of(s.dy, k);
            if !(y.abs() < bound(self.y0, r)) {
                *u = last;
                return (k + 1, sums.indices());
            }
            if PLAIN {
                *u = controller.step(r, *y, 0.0);
                position = *u;
            } else {
                if let Some(pid) = settings.change(k) {
                    controller.set(&pid);
                }
                let (read, p) = (quantised(*y + of(s.noise, k), s.y_step), of(s.p, k));
                let wanted = match s.manual {
                    Some(manual) if !manual[k].is_nan() => controller.hold(r, read, p, manual[k]),
                    _ => controller.step(r, read, p),
                };
                (*u, position) = s.actuator.position(wanted, position);
            }
            sums.step(k as f64 * Ts, r, of(s.dy, k));
            sums.held(Ts, *u);
            last = *u;
            plant.run(position + of(s.d, k), &mut sums);
        }
        let end = s.r.len();
        self.y[end] = plant.output() + of(s.dy, end);
        self.u[end] = last;
        (end + 1, sums.indices())
    }

    /// From node to node, `stride` of them per row.
    fn continuous<S: State>(&mut self, state: S, L: f64, pid: &Pid, stride: usize) -> Result<Ended> {
        let (s, y0) = (self.s, self.y0);
        let mut sums = Sums::new(&mut self.course);
        let h = s.dt / stride as f64;
        let mut plant = Ramped::new(state, L, h)?;
        let mut settings = InForce::new(pid, s);
        let mut controller = ContinuousPid::new(&settings.first(), h, s.actuator, s.anti_windup, y0, s.u0);
        let nodes = s.r.len() * stride;
        let mut row = 0;
        for node in 0..=nodes {
            let (starts, k) = (node == row * stride, (node / stride).min(s.r.len() - 1));
            let (r, p, dy) = (s.r[k], s.of(s.p, k), s.of(s.dy, k));
            if starts && let Some(pid) = settings.change(row) {
                controller.set(&pid);
            }
            let manual = s.manual.map(|x| x[k]).filter(|u| !u.is_nan());
            // The plant moves from its rest, y0, by u + d - u0.
            let (base, shift) = (y0 + dy, s.of(s.d, k) - s.u0);
            let of_u = |x: Affine, rest: f64| Affine { free: rest + x.at(shift), gain: x.gain };

            // Just after the node.
            let now = of_u(plant.now(), base);
            let wanted = manual.unwrap_or_else(|| controller.now(r, p).solved(now, Affine::NONE));
            let u = within(wanted, controller.reach(0.0));
            let y = now.at(u);
            controller.begin(r, p, y, u);
            if manual.is_some() {
                controller.hold(u);
            }
            if starts {
                (self.y[row], self.u[row]) = (y, u);
                sums.step(k as f64 * s.dt, r, dy);
                row += 1;
            }
            if !(y.abs() < bound(y0, r)) {
                (self.y[row - 1], self.u[row - 1]) = (y, u);
                break;
            }
            if node == nodes {
                sums.end(u);
                break;
            }

            // Until just before the next one.
            let [end, area] = plant.ahead(u + shift);
            let (end, area) = (of_u(end, base), of_u(area, base * h));
            let wanted = manual.unwrap_or_else(|| controller.ahead().solved(end, area));
            let mut next = within(wanted, controller.reach(h));
            let answer = controller.run(end.at(next), area.at(next));
            if manual.is_some() {
                controller.hold(next);
            } else {
                next = answer;
            }
            plant.run(next + shift, &mut sums, y0);
            sums.line(h, u, next);
        }
        Ok((row, sums.indices()))
    }

    fn finish(self, (rows, indices): Ended) -> LoopRun {
        let mut notes = Vec::new();
        if rows < self.y.len() {
            let t = (rows - 1) as f64 * self.s.dt;
            let text = format!(
                "the loop is unstable: y is {:.1e} after {t:.4} s, where the response ends",
                self.y[rows - 1]
            );
            notes.push(
                Note::warning("M02", text)
                    .at(Place { column: "y".to_owned(), row: Some(rows - 1), time: Some(t) })
                    .measured(self.y[rows - 1].abs(), bound(self.y0, self.s.r[rows - 1]))
                    .remedy("lower the gain, or look at tune.stability"),
            );
        }
        LoopRun { rows, indices, u_final: self.u_final, notes }
    }
}

/// No sound response goes beyond.
#[inline(always)]
fn bound(y0: f64, r: f64) -> f64 {
    RUNAWAY * (1.0 + y0.abs() + r.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Filter, Fopdt, ProcessModel, TransferFunction};
    use crate::sim::{Actuator, AntiWindup};

    fn run(model: &Model, pid: &Pid, settings: ClosedLoopSettings) -> ClosedLoop {
        closed_loop(model, pid, &settings).expect("a sound loop")
    }

    /// With `Ti = T` the loop is `k e^(-L s) / s`: `y' = k (1 - y(t - L))`, solved step by step in `L`.
    #[test]
    fn an_integrating_loop_follows_the_method_of_steps() {
        let (model, k) = (Fopdt { K: -2.0, T: 3.0, L: 1.0 }, 0.6);
        let pid = Pid::pi(k * model.T / model.K, model.T);
        let response = run(&model.into(), &pid, ClosedLoopSettings::new(0.01, &[1.0; 400]));
        for (j, y) in response.y.iter().enumerate() {
            let t = j as f64 * 0.01;
            let ramp = |lags: f64| (t - lags).max(0.0);
            let exact =
                k * ramp(1.0) - k.powi(2) * ramp(2.0).powi(2) / 2.0 + k.powi(3) * ramp(3.0).powi(3) / 6.0;
            // The straight line between nodes costs h^2.
            assert!((y - exact).abs() < 1e-6, "t = {t}: {y} {exact}");
        }
    }

    #[test]
    fn a_loop_in_equilibrium_stays_there() {
        let (offset, u0) = (583.451, 30.9);
        let engine = Fopdt { K: -5.939, T: 0.1491, L: 0.107 };
        let lags = ProcessModel { T: vec![0.1, 0.05], ..ProcessModel::from(engine) };
        let tank = ProcessModel { K: -2.0, integrating: true, ..lags.clone() };
        for model in [Model::from(engine), Model::Process(lags), Model::Process(tank)] {
            let r = [resting(&model, u0, offset); 50];
            for Ts in [None, Some(0.02)] {
                for filter in [Filter::D1, Filter::Y2] {
                    let pid = Pid { Ts, Td: 0.03, Tf: 0.01, b: 0.3, filter, ..Pid::pi(-0.05, 0.15) };
                    let settings = ClosedLoopSettings { offset, u0, ..ClosedLoopSettings::new(0.02, &r) };
                    let response = run(&model, &pid, settings);
                    assert!(response.y.iter().all(|y| (y - r[0]).abs() < 1e-9), "{model:?} {Ts:?}");
                    assert!(response.u.iter().all(|u| (u - u0).abs() < 1e-9), "{model:?} {Ts:?}");
                }
            }
        }
    }

    /// Plant and controller as two recursions by hand, the delay one sample and a half.
    #[test]
    fn a_sampled_loop_is_the_difference_equation_at_the_samples() {
        let (Ts, Kp, Ti) = (0.2, 0.8, 1.5);
        let model = Fopdt { K: 1.5, T: 1.0, L: 0.3 };
        let pid = Pid { Ts: Some(Ts), ..Pid::pi(Kp, Ti) };
        let response = run(&model.into(), &pid, ClosedLoopSettings::new(Ts, &[1.0; 40]));
        let (a, b1, b2, m) = model.sampled(Ts);
        let (mut y, mut u, mut integral) = (vec![0.0], Vec::<f64>::new(), 0.0);
        for k in 0..40 {
            integral += Kp / Ti * Ts * (1.0 - y[k]);
            u.push(Kp * (1.0 - y[k]) + integral);
            let before = |lag: usize| if k >= lag { u[k - lag] } else { 0.0 };
            y.push(a * y[k] + b1 * before(m) + b2 * before(m + 1));
        }
        assert!(y.iter().zip(&response.y).all(|(y, ours)| (ours - y).abs() < 1e-12));
    }

    /// The loop over a record is the steps of plant and controller, to the bit.
    #[test]
    fn a_record_is_its_steps() {
        let Ts = 0.3;
        let r: Vec<f64> = (0..200).map(|k| f64::from(k / 20 * 37 % 11)).collect();
        let limits = Actuator { low: -2.0, high: 3.0, rate: 4.0, ..Actuator::default() };
        for model in [
            Model::from(Fopdt { K: 1.5, T: 2.0, L: 0.7 }),
            Model::Transfer(TransferFunction { num: vec![-0.5, 1.0], den: vec![1.0, 0.8, 1.0], L: 0.4 }),
        ] {
            let pid = Pid { Ts: Some(Ts), Td: 0.2, Tf: 0.1, c: 0.5, ..Pid::pi(0.4, 1.5) };
            let settings =
                ClosedLoopSettings { offset: 2.0, actuator: limits, ..ClosedLoopSettings::new(Ts, &r) };
            let response = run(&model, &pid, settings);
            let mut plant = SampledPlant::new(&model, Ts, 0.0, 2.0).expect("a plant");
            let mut controller = SampledPid::new(&pid, Ts, limits, AntiWindup::Clamping, 2.0, 0.0);
            for (k, &r) in r.iter().enumerate() {
                assert_eq!(response.y[k], plant.output());
                let u = controller.step(r, plant.output(), 0.0);
                assert_eq!(response.u[k], u);
                plant.step(u);
            }
        }
    }

    /// A disturbance at the plant input that is there from the start is what `u0` plus itself would be.
    #[test]
    fn integral_action_removes_an_input_disturbance() {
        let model = Model::from(Fopdt { K: 2.0, T: 1.0, L: 0.2 });
        let (r, d) = (vec![0.0; 3000], vec![0.7; 3000]);
        let settings = ClosedLoopSettings { d: Some(&d), ..ClosedLoopSettings::new(0.01, &r) };
        let response = run(&model, &Pid::pi(1.0, 1.0), settings);
        assert_eq!(response.run.u_final, -0.7);
        assert!(response.y[3000].abs() < 1e-9 && (response.u[3000] + 0.7).abs() < 1e-9);
    }

    #[test]
    fn a_loop_that_runs_away_ends_with_a_note() {
        for Ts in [None, Some(0.1)] {
            let model = Model::from(Fopdt { K: 2.0, T: 1.0, L: 0.5 });
            let pid = Pid { Ts, ..Pid::pi(10.0, 1.0) };
            let response = run(&model, &pid, ClosedLoopSettings::new(0.1, &[1.0; 5000]));
            assert!(response.y.len() < 1000 && response.y.iter().all(|y| y.is_finite()));
            assert_eq!(response.run.notes[0].code, "M02");
        }
    }

    #[test]
    fn what_does_not_go_together_is_refused() {
        let model = Model::from(Fopdt { K: 2.0, T: 1.0, L: 0.2 });
        let (r, short) = ([1.0; 10], [1.0; 9]);
        let pi = Pid::pi(1.0, 1.0);
        let base = || ClosedLoopSettings::new(0.1, &r);
        let stepped = Actuator { step: 0.1, ..Actuator::default() };
        for (name, pid, settings) in [
            ("d", pi, ClosedLoopSettings { d: Some(&short), ..base() }),
            ("noise", pi, ClosedLoopSettings { noise: Some(&r), ..base() }),
            ("dead_band, step, y_step", pi, ClosedLoopSettings { actuator: stepped, ..base() }),
            ("Ts", Pid { Ts: Some(0.2), ..pi }, base()),
            ("Tf", Pid { Td: 1.0, ..pi }, base()),
            ("u0", pi, ClosedLoopSettings { u0: f64::NAN, ..base() }),
            ("r", pi, ClosedLoopSettings::new(0.1, &[])),
            ("t_end", pi, ClosedLoopSettings::new(1e6, &r)),
        ] {
            let error = closed_loop(&model, &pid, &settings).expect_err(name);
            assert_eq!(error.note().place.as_ref().map(|p| p.column.as_str()), Some(name));
        }
    }
}
