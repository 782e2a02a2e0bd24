//! From the minimum of a process fit to models, intervals and doubts, in the record's units.

use super::super::fit::{Fit, OffsetStep, Status, WIDTH, standard_deviations};
use super::super::orders::too_short;
use super::super::sampling::sampling;
use super::super::settled::of_process;
use super::RANK_TOLERANCE;
use super::problem::{DRIFT_ROWS, Linear, Point, Problem, Stretch};
use super::profile::Interval;
use crate::error::{Error, Result};
use crate::linalg::{RankDeficient, Solution, congruence, solve};
use crate::model::derived::Covariance;
use crate::model::{Model, PolyModel, ProcessModel, sampled};
use crate::note::{Note, Place, rounded};

impl Problem<'_, '_> {
    pub(super) fn fit(&self, best: &Point) -> Result<Fit> {
        let (rss, linear) = self.evaluate(best).ok_or_else(|| self.no_relation(1.0))?;
        let all = self.full(best, &linear).ok_or_else(|| self.no_relation(1.0))?;
        let N = self.rows(best.history);
        let parameters = self.parameters() + self.free_states(best.history);
        if N <= parameters {
            return Err(too_short(N, parameters));
        }
        self.check_relation(&all, rss, N)?;
        let plants = self.plants(best, &linear);
        self.check_colour(&plants)?;
        // Before the solution: of a `T` far below `Ts` nothing is left in the rows.
        let doubt = self.check_sampling(best, &plants, rss, N - parameters)?;
        let every: Vec<usize> = self.told_apart();
        let solution =
            solve(&all, &every, self.parameters(), RANK_TOLERANCE).map_err(|e| self.too_large(&e))?;
        let s2 = rss / (N - parameters) as f64;
        let mut P = self.covariance(&solution, &every, s2, best, &linear);
        let theta: Vec<f64> = plants.iter().zip(&self.codes).flat_map(|(p, c)| c.theta(p)).collect();
        let intervals = self.intervals(best, &theta, &mut P, N - parameters);
        let digits = vec![15.0 + solution.ratio.log10(); theta.len()];
        let sampled = self.sampled(best, &plants);
        let model = match (&sampled, plants.as_slice()) {
            (_, [plant]) => plant.clone().into(),
            (Some(sampled), _) => Model::Poly(sampled.clone()),
            (None, _) => return Err(self.no_relation(1.0)),
        };
        let inverse = inverse_responses(&self.names(), &theta, &P);
        let unsettled = self.unsettled(&plants, &P);
        Fit {
            P,
            names: self.names(),
            steps: self.steps_of(&linear, &solution, s2),
            offset: self.offset_of(&plants, &linear),
            x0: self.stretches(best.history).zip(&linear.x0).map(|s| self.state(s, &plants)).collect(),
            N,
            loss: rss / N as f64 / self.scale_y.factor.powi(2),
            status: best.status,
            expected_digits: digits,
            notes: self
                .notes(&plants, N, best)
                .into_iter()
                .chain(doubt)
                .chain(inverse)
                .chain(unsettled)
                .collect(),
            model,
            theta,
            intervals,
            plants,
            sampled,
        }
        .finite()
    }

    /// X10: parameters that the data do not tell apart, such as a lag that is none.
    fn too_large(&self, refusal: &RankDeficient) -> Error {
        if self.codes.iter().all(|code| code.states() < 2) {
            return self.unrelated(1.0);
        }
        Error::new("X10", "the structure is too large: a smaller one fits as well")
            .at(Place::column(self.rec.input_name(0)))
            .count(refusal.dependent.len())
            .measured(refusal.ratio, RANK_TOLERANCE)
            .remedy("ask for a lag or a zero less")
    }

    /// All inputs and the noise as one difference equation; not needed for one input with white noise.
    fn sampled(&self, best: &Point, plants: &[ProcessModel]) -> Option<PolyModel> {
        if plants.len() == 1 && self.noise == (0, 0) {
            return None;
        }
        let of = |plant: &ProcessModel| sampled(&plant.transfer(), self.rec.Ts);
        let each: Vec<PolyModel> = plants.iter().map(of).collect();
        let (c, d) = best.x[best.x.len() - self.noise.0 - self.noise.1..].split_at(self.noise.0);
        Some(PolyModel {
            A: vec![1.0],
            B: each.iter().map(|m| m.B[0].clone()).collect(),
            C: [&[1.0], c].concat(),
            D: [&[1.0], d].concat(),
            F: each.iter().map(|m| m.A.clone()).collect(),
            nk: each.iter().map(|m| m.nk[0]).collect(),
            Ts: self.rec.Ts,
        })
    }

    /// Columns of the full triangle that data can tell apart: not the delay where the output jumps with the
    /// input, for within a sample it changes nothing that gain and zero do not.
    pub(super) fn told_apart(&self) -> Vec<usize> {
        let blind = (0..self.codes.len()).filter(|&i| self.codes[i].jumps());
        let blind: Vec<usize> = blind.filter_map(|i| self.place_of_L(i)).collect();
        let told = |&j: &usize| j < self.linear() || !blind.contains(&(j - self.linear()));
        (0..self.parameters()).filter(told).collect()
    }

    /// Column of the first gain of input `i`.
    fn gain_column(&self, i: usize) -> usize {
        self.codes[..i].iter().map(|c| c.linear()).sum()
    }

    /// Unit of the gain of input `i` in scaled units.
    pub(super) fn gain_unit(&self, i: usize) -> f64 {
        let time = if self.codes[i].integrating { self.rec.Ts } else { 1.0 };
        self.scale_u[i].factor / self.scale_y.factor / time
    }

    pub(super) fn plants(&self, best: &Point, linear: &Linear) -> Vec<ProcessModel> {
        let plant = |i: usize| {
            let own = &linear.theta[self.gain_column(i)..];
            let Tz = if self.codes[i].zero { own[1] / own[0] * self.rec.Ts } else { 0.0 };
            self.codes[i].model(own[0] * self.gain_unit(i), &self.natural(best, i), Tz, self.rec.Ts)
        };
        (0..self.codes.len()).map(plant).collect()
    }

    /// `K`, `T`, … with the input behind where there are several.
    fn names(&self) -> Vec<String> {
        let own = |(i, code): (usize, &super::Code)| {
            let several = self.codes.len() > 1;
            let input = self.rec.input_name(i).to_owned();
            code.names().into_iter().map(move |n| if several { format!("{n}[{input}]") } else { n })
        };
        self.codes.iter().enumerate().flat_map(own).collect()
    }

    /// `O` in `y = sum G u + O`; with an integrator the drift, per second.
    pub(super) fn offset_of(&self, plants: &[ProcessModel], linear: &Linear) -> f64 {
        if !self.offset {
            return 0.0;
        }
        let zero = if self.drifts() { 0.0 } else { self.scale_y.zero };
        let mut offset = zero + linear.theta[self.gains()] * self.offset_unit();
        for i in (0..plants.len()).filter(|&i| self.shifts(i)) {
            offset -= plants[i].K * self.scale_u[i].zero;
        }
        offset
    }

    fn offset_unit(&self) -> f64 {
        let time = if self.drifts() { DRIFT_ROWS * self.rec.Ts } else { 1.0 };
        1.0 / self.scale_y.factor / time
    }

    /// The steps of the offset in the record's units.
    fn steps_of(&self, linear: &Linear, solution: &Solution, s2: f64) -> Vec<OffsetStep> {
        let (first, all) = (self.gains() + usize::from(self.offset), self.told_apart());
        let step = |(i, &row): (usize, &usize)| {
            let j = all.iter().position(|&j| j == first + i).unwrap_or(0);
            let variance = s2 * solution.inverse_gram[j * all.len() + j];
            OffsetStep {
                row,
                size: linear.theta[first + i] / self.scale_y.factor,
                sd: variance.sqrt() / self.scale_y.factor,
            }
        };
        self.steps.iter().enumerate().map(step).collect()
    }

    /// Whether the zero of input `i` is in the offset rather than in a free level.
    fn shifts(&self, i: usize) -> bool {
        self.codes[i].integrating == self.drifts()
    }

    /// Covariance of theta and `O` in the record's units, by the delta rule.
    fn covariance(
        &self,
        solution: &Solution,
        columns: &[usize],
        s2: f64,
        best: &Point,
        linear: &Linear,
    ) -> Vec<f64> {
        let inverse: Vec<f64> = solution.inverse_gram.iter().map(|x| s2 * x).collect();
        self.in_units(&inverse, columns, best, linear)
    }

    /// The covariance of theta and `O` from that of `columns` of the full triangle.
    pub(super) fn in_units(&self, P: &[f64], columns: &[usize], best: &Point, linear: &Linear) -> Vec<f64> {
        let place: Vec<Option<usize>> =
            (0..self.parameters()).map(|j| columns.iter().position(|c| *c == j)).collect();
        congruence(&self.derivatives_of_theta(best, linear), |i, j| match (place[i], place[j]) {
            (Some(i), Some(j)) => P[i * columns.len() + j],
            _ => 0.0,
        })
    }

    /// Rows of derivatives of theta and `O` by the columns of the full triangle.
    fn derivatives_of_theta(&self, best: &Point, linear: &Linear) -> Vec<Vec<f64>> {
        let (all, Ts) = (self.parameters(), self.rec.Ts);
        let row = |entries: &[(usize, f64)]| {
            let mut row = vec![0.0; all];
            entries.iter().for_each(|&(j, x)| row[j] = x);
            row
        };
        let mut map = Vec::new();
        for (i, code) in self.codes.iter().enumerate() {
            let (gain, own, p) = (self.gain_column(i), self.own(i), self.natural(best, i));
            let at = |k: usize| self.linear() + own.start + k;
            map.push(row(&[(gain, self.gain_unit(i))]));
            map.extend((0..code.times()).map(|k| row(&[(at(k), p[k] * Ts)])));
            map.push(if code.delay { row(&[(at(p.len() - 1), Ts)]) } else { row(&[]) });
            if code.zero {
                let (K, slope) = (linear.theta[gain], linear.theta[gain + 1]);
                map.push(row(&[(gain, -slope / K / K * Ts), (gain + 1, Ts / K)]));
            }
            map.extend(code.pair.then(|| row(&[(at(code.times()), p[code.times()])])));
        }
        if self.offset {
            let shift = |i: usize| (self.gain_column(i), -self.gain_unit(i) * self.scale_u[i].zero);
            let mut entries: Vec<_> = (0..self.codes.len()).filter(|&i| self.shifts(i)).map(shift).collect();
            entries.push((self.gains(), self.offset_unit()));
            map.push(row(&entries));
        }
        map
    }

    /// Intervals by the profile where the delta rule does not hold; `P` is brought to their widths.
    fn intervals(
        &self,
        best: &Point,
        theta: &[f64],
        P: &mut [f64],
        freedom: usize,
    ) -> Vec<(String, f64, f64)> {
        let (names, width, Ts) = (self.names(), P.len().isqrt(), self.rec.Ts);
        let mut intervals = Vec::new();
        let mut start = 0;
        for (i, code) in self.codes.iter().enumerate() {
            let own = self.own(i);
            let L = start + 1 + code.times();
            let delay = self.place_of_L(i).filter(|_| !code.pair && !code.jumps()).map(|j| (L, j, Ts));
            let lag = (self.kinked(i) && !code.jumps() && code.lags == 1 && !code.integrating)
                .then(|| (start + 1, own.start, theta[start + 1]));
            if code.delay && code.jumps() {
                // Known to the sample in which the jump is seen.
                P[L * width + L] = Ts * Ts / 12.0;
                intervals.push((names[L].clone(), (theta[L] - Ts).max(0.0), theta[L]));
            }
            for (k, j, unit) in delay.into_iter().chain(lag) {
                let sd = P[k * width + k].sqrt();
                let Some(Interval { low, high }) = self.profile(best, j, sd / unit, freedom) else {
                    continue;
                };
                let ends = if k == L { [low * Ts, high * Ts] } else { [low.exp() * Ts, high.exp() * Ts] };
                let cut = k == L && (low <= self.bounds.0 || high >= self.bounds.1);
                let half = if cut {
                    (theta[k] - ends[0]).max(ends[1] - theta[k])
                } else {
                    0.5 * (ends[1] - ends[0])
                };
                scale(P, width, k, half / WIDTH / sd);
                intervals.push((names[k].clone(), ends[0], ends[1]));
            }
            start += code.names().len();
        }
        intervals
    }

    /// The states without the offset, at the first residual row of a segment.
    fn state(&self, (s, x): (&Stretch, &Vec<f64>), plants: &[ProcessModel]) -> Vec<f64> {
        let mut states: Vec<f64> = x.iter().map(|x| x / self.scale_y.factor).collect();
        let mut start = 0;
        for (i, code) in self.codes.iter().enumerate() {
            let held = if s.at_rest { self.rec.u_at(s.rows.start, i) } else { self.scale_u[i].zero };
            for k in usize::from(code.pair)..code.lags {
                states[start + k] += if code.integrating { 0.0 } else { plants[i].K * held };
            }
            start += code.states();
        }
        states
    }

    fn check_sampling(
        &self,
        best: &Point,
        plants: &[ProcessModel],
        rss: f64,
        freedom: usize,
    ) -> Result<Option<Note>> {
        for plant in plants.iter().filter(|p| !p.T.is_empty()) {
            let T = plant.T.iter().copied().fold(0.0, f64::max);
            let upper = self.upper_T(best, plant, rss, freedom);
            if let Some(note) = sampling(T, upper, self.rec.Ts, self.limits)? {
                return Ok(Some(note));
            }
        }
        Ok(None)
    }

    fn notes(&self, plants: &[ProcessModel], N: usize, best: &Point) -> Vec<Note> {
        let mut notes = Vec::new();
        let count = self.parameters() + usize::from(!self.offset);
        if (N as f64) < self.limits.X03 * count as f64 {
            notes.push(
                Note::warning("X03", format!("{N} rows for {count} parameters: intervals are rough"))
                    .count(N)
                    .measured(N as f64 / count as f64, self.limits.X03)
                    .remedy("record longer"),
            );
        }
        if self.stretches(best.history).any(|s| s.at_rest) {
            notes.push(Note::info(
                "X07",
                "a step test that begins at rest: the plant is taken as in equilibrium before it",
            ));
        }
        if best.status != Status::Converged {
            notes.push(
                Note::warning("N05", "the search stopped before the gradient test passed")
                    .remedy("give a range of delays: L=(low, high)"),
            );
        }
        notes.extend(
            plants.iter().zip(&self.codes).filter(|(_, c)| c.delay).filter_map(|(p, _)| self.at_end(p.L)),
        );
        if !self.steps.is_empty() {
            let text = format!("the offset changes {} times: see `steps`", self.steps.len());
            let place = self.rec.place(self.rec.nu, self.steps[0]);
            notes.push(Note::info("M08", text).at(place).count(self.steps.len()));
        }
        if self.drifts() {
            notes.push(Note::info("M01", "integrating: K is a slope, there is no steady-state gain"));
        }
        notes
    }

    /// X07 of each input whose response the record does not show whole.
    fn unsettled(&self, plants: &[ProcessModel], P: &[f64]) -> Vec<Note> {
        let (width, mut start) = (P.len().isqrt(), 0);
        let mut notes = Vec::new();
        for (i, plant) in plants.iter().enumerate() {
            let n = plant.theta().len();
            let own: Vec<f64> = (0..n * n).map(|jk| P[(start + jk / n) * width + start + jk % n]).collect();
            notes.extend(of_process(self.rec, i, plant, &Covariance(&own), self.limits));
            start += self.codes[i].names().len();
        }
        notes
    }

    fn at_end(&self, L: f64) -> Option<Note> {
        let (Ts, end) = (self.rec.Ts, self.bounds.1 * self.rec.Ts);
        let text = format!("the delay lies at the end of the range searched, {end:.4} s");
        let note = Note::warning("X05", text).at(Place::column("L")).measured(L, end);
        (L >= end - 0.25 * Ts).then(|| note.remedy("search a wider range: L=(low, high)"))
    }
}

/// A zero clearly to the right: the answer begins against its end (X12).
fn inverse_responses(names: &[String], theta: &[f64], P: &[f64]) -> Vec<Note> {
    let sd = standard_deviations(P, theta.len());
    let all = names.iter().zip(theta).zip(&sd);
    let right = all.filter(|((name, Tz), sd)| name.starts_with("Tz") && **Tz + WIDTH * **sd < 0.0);
    right
        .map(|((name, Tz), _)| {
            let text = format!("inverse response: {name} = {} s, y begins against its end", rounded(*Tz));
            Note::info("X12", text).at(Place::column(name))
        })
        .collect()
}

/// Makes the standard deviation of parameter `k` `factor` times as large, correlations as they are.
fn scale(P: &mut [f64], width: usize, k: usize, factor: f64) {
    for j in 0..width {
        P[k * width + j] *= factor;
        P[j * width + k] *= factor;
    }
}
