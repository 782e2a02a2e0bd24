//! From the mean cycle to `K, T, L, O` and their deviations; the equations stand in the head of [`super`].

use super::super::open_loop::root;
use super::Known;
use super::cycle::{Cycle, Half};

/// Time constants tried, in periods: from where `e^(-t/T)` is lost in rounding to an integrator.
const SHORTEST: f64 = 1.0 / 40.0;
const LONGEST: f64 = 400.0;
const TRIED: i32 = 300;

/// What is measured of a cycle, and how it moves: two times, then outputs.
const MEASURED: [fn(&mut Cycle, f64); 7] = [
    |c, d| c.on.iter_mut().for_each(|half| half.t += d),
    |c, d| c.off.iter_mut().for_each(|half| half.t += d),
    |c, d| {
        c.on.iter_mut().for_each(|half| half.from += d);
        c.off.iter_mut().for_each(|half| half.to += d);
    },
    |c, d| {
        c.on.iter_mut().for_each(|half| half.to += d);
        c.off.iter_mut().for_each(|half| half.from += d);
    },
    |c, d| c.mean += d,
    |c, d| c.mean_on += d,
    |c, d| c.y0 += d,
];
const TIMES: usize = 2;

/// What solves the equations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inversion {
    pub K: f64,
    pub T: f64,
    pub L: f64,
    pub O: f64,
}

impl Cycle {
    /// All that closes the equations: of several plants with this cycle's numbers one has its waveform.
    pub fn invert(&self) -> Vec<Inversion> {
        let longer = (LONGEST / SHORTEST).powf(1.0 / f64::from(TRIED));
        let tried = (0..=TRIED).map(|i| SHORTEST * self.period() * longer.powi(i));
        let gaps: Vec<(f64, f64)> = tried.filter_map(|T| Some((T, self.gap(T)?))).collect();
        let changes = gaps.windows(2).filter(|w| (w[0].1 > 0.0) != (w[1].1 > 0.0));
        let roots = changes.map(|w| root(w[0].0, w[1].0, |T| self.gap(T).unwrap_or(f64::NAN)));
        roots.filter_map(|T| self.at(T)).collect()
    }

    /// Standard deviations of `K, T, L` where each output row is `sigma` off.
    ///
    /// `gap(T, q) = 0` gives `dT = -(gap_q / gap_T) dq` for what was measured, `q`, and so `dK` and `dL`.
    pub fn deviations(&self, T: f64, sigma: f64) -> Option<[f64; 3]> {
        let all = |c: &Cycle, T: f64| Some([c.gap(T)?, c.at(T)?.K, c.at(T)?.L]);
        let slope =
            |up: [f64; 3], down: [f64; 3], step: f64| [0, 1, 2].map(|i| (up[i] - down[i]) / (2.0 * step));
        let step = 1e-5 * T;
        let by_T = slope(all(self, T + step)?, all(self, T - step)?, step);
        let mut by_q = [[0.0; 3]; 7];
        let travel = self.rise().abs().max((self.mean - self.mean_on).abs());
        for (j, (by, shift)) in by_q.iter_mut().zip(MEASURED).enumerate() {
            let step = 1e-5 * if j < TIMES { self.t_on().min(self.t_off()) } else { travel };
            let moved = |step: f64| {
                let mut cycle = self.clone();
                shift(&mut cycle, step);
                cycle
            };
            let [gap, K, L] = slope(all(&moved(step), T)?, all(&moved(-step), T)?, step);
            let T_by = -gap / by_T[0];
            *by = [K + by_T[1] * T_by, T_by, L + by_T[2] * T_by];
        }
        let P = self.covariance(sigma);
        let variance = |i: usize| -> f64 {
            (0..7).map(|j| (0..7).map(|k| by_q[j][i] * P[j][k] * by_q[k][i]).sum::<f64>()).sum()
        };
        Some([0, 1, 2].map(|i| variance(i).max(0.0).sqrt()))
    }

    /// What follows from (1) and (2) if the time constant is `T`; None where no plant has this cycle.
    fn at(&self, T: f64) -> Option<Inversion> {
        let (A, L) = self.span_and_delay(T)?;
        let K = self.sign * A / (self.high - self.low);
        Some(Inversion { K, T, L, O: self.sign * self.centre(T) - K * self.u_mean() })
    }

    fn span_and_delay(&self, T: f64) -> Option<(f64, f64)> {
        let (duty, centre) = (self.duty(), self.centre(T));
        let (on, off) = (Means::of(&self.on, T, centre), Means::of(&self.off, T, centre));
        let A = (on.ends + on.moves + off.ends + off.moves) / ((1.0 - duty) * on.grows - duty * off.grows);
        let L = T * ((1.0 - duty) * on.grows - (on.ends + on.moves) / A).ln_1p();
        // Less than none by a sample is none, as far as rows tell.
        (A > 0.0 && A.is_finite() && L > -self.Ts && L.is_finite()).then_some((A, L))
    }

    /// What is left of the last equation at `T`, as a part of `A`.
    fn gap(&self, T: f64) -> Option<f64> {
        let (A, L) = self.span_and_delay(T)?;
        let centre = self.centre(T);
        if self.known == Known::Rest {
            let moved = (self.u_mean() - self.u0) / (self.high - self.low);
            return Some(1.0 - (centre - self.y0) / (moved * A));
        }
        let m = (L / self.Ts).floor();
        let f = L - m * self.Ts;
        let late = m - (-(self.Ts - f) / T).exp() * (-f / T).exp_m1() / self.settles(T);
        let rows = self.t_on() / self.Ts;
        let driven = (centre + A * (1.0 - self.duty()) - self.mean_on) * rows - A * late;
        Some((self.rise() / self.settles(T) - driven) / (A * rows))
    }

    /// `y_mean`: that of the rows, and what the plant still stores of it in the move from end to end.
    fn centre(&self, T: f64) -> f64 {
        self.mean + self.drift / self.settles(T)
    }

    /// What the plant does in one row of its way to where it would settle.
    fn settles(&self, T: f64) -> f64 {
        -(-self.Ts / T).exp_m1()
    }

    /// y where u goes to `high`, and where it goes to `low`.
    pub fn thresholds(&self) -> (f64, f64) {
        (self.sign * mean(&self.on, |half| half.from), self.sign * mean(&self.on, |half| half.to))
    }

    fn rise(&self) -> f64 {
        mean(&self.on, |half| half.to - half.from)
    }

    pub fn t_on(&self) -> f64 {
        mean(&self.on, |half| half.t)
    }

    pub fn t_off(&self) -> f64 {
        mean(&self.off, |half| half.t)
    }

    fn period(&self) -> f64 {
        self.t_on() + self.t_off()
    }

    /// Share of the period at `high`.
    fn duty(&self) -> f64 {
        self.t_on() / self.period()
    }

    fn u_mean(&self) -> f64 {
        self.low + self.duty() * (self.high - self.low)
    }

    /// Covariance of what is measured.
    ///
    /// A switching counts as uniform over the sample before its row, and as equally far off in each period.
    fn covariance(&self, sigma: f64) -> [[f64; 7]; 7] {
        let instant = self.Ts * self.Ts / 12.0;
        let row = sigma * sigma;
        let periods = self.on.len() as f64;
        let rows = |time: f64| periods * time / self.Ts;
        let mut P = [[0.0; 7]; 7];
        // Each half-cycle ends where the other begins.
        (P[0][0], P[1][1], P[0][1], P[1][0]) = (2.0 * instant, 2.0 * instant, -instant, -instant);
        (P[2][2], P[3][3]) = (row * self.weight / periods, row * self.weight / periods);
        (P[4][4], P[5][5]) = (row / rows(self.period()), row / rows(self.t_on()));
        (P[4][5], P[5][4]) = (P[4][4], P[4][4]);
        P[6][6] = if self.rest_rows > 0 { row / self.rest_rows as f64 } else { 0.0 };
        P
    }
}

/// Means over half-cycles, y from the centre: of `e^(t/T) - 1`, of `y_end (e^(t/T) - 1)`, of `y_end - y_begin`.
struct Means {
    grows: f64,
    ends: f64,
    moves: f64,
}

impl Means {
    fn of(halves: &[Half], T: f64, centre: f64) -> Self {
        let grows = |half: &Half| (half.t / T).exp_m1();
        Means {
            grows: mean(halves, grows),
            ends: mean(halves, |half| (half.to - centre) * grows(half)),
            moves: mean(halves, |half| half.to - half.from),
        }
    }
}

fn mean(halves: &[Half], f: impl Fn(&Half) -> f64) -> f64 {
    halves.iter().map(f).sum::<f64>() / halves.len() as f64
}
