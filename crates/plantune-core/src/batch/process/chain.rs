//! A process model as lags one behind the other, and how its states move over a sample.
//!
//! ```text
//! T r' = v - x - 2 zeta r,  T x' = r     a pair of poles, first
//! T x' = v - x                           a lag, v the state before it
//!   x' = v                               an integrator, last; time in samples
//! x(t+1) = Phi x(t) + now u(t-m) + before u(t-m-1),     L = m + f samples
//! Gamma(h) = int_0^h e^(A tau) b dtau,  now = Gamma(1 - f),  before = Gamma(1) - Gamma(1 - f)
//! [e^(A h) de^(A h); 0 e^(A h)] = exp [A h  dA h; 0  A h]
//! ```
//!
//! Exact for every delay, and well conditioned for equal lags, whose states differ where their exponentials
//! do not. Van Loan 1978; Najfeld and Havel 1995.

use super::code::Code;
use crate::linalg::exponential;

/// Most states.
pub(super) const MOST: usize = 4;

/// `x' = A x + b v` in samples.
#[derive(Clone)]
struct Plant {
    n: usize,
    A: [[f64; MOST]; MOST],
    b: [f64; MOST],
}

impl Plant {
    fn new(n: usize) -> Self {
        Plant { n, A: [[0.0; MOST]; MOST], b: [0.0; MOST] }
    }

    /// From the nonlinear parameters `p`, in samples.
    fn of(code: Code, p: &[f64]) -> Self {
        let mut plant = Plant::new(code.states());
        for i in 0..plant.n {
            let T = code.time(i).map_or(1.0, |k| p[k]);
            match i {
                0 => plant.b[0] = 1.0 / T,
                _ => plant.A[i][i - 1] = 1.0 / T,
            }
            if i < code.lags && !(code.pair && i < 2) {
                plant.A[i][i] = -1.0 / T;
            }
        }
        if code.pair {
            plant.A[0][0] = -2.0 * p[code.times()] / p[0];
            plant.A[0][1] = -1.0 / p[0];
        }
        plant
    }

    /// Its derivative by `ln p_j`, `j` a time constant or the damping.
    fn slope(&self, code: Code, j: usize) -> Self {
        let mut slope = Plant::new(self.n);
        if j == code.times() {
            slope.A[0][0] = self.A[0][0];
            return slope;
        }
        for i in (0..self.n).filter(|&i| code.time(i) == Some(j)) {
            slope.A[i] = self.A[i].map(|a| -a);
            slope.b[i] = -self.b[i];
        }
        slope
    }

    /// `[A b; 0 0] h`, row-major.
    fn bordered(&self, h: f64) -> Vec<f64> {
        let size = self.n + 1;
        let entry = |i: usize, j: usize| match (i < self.n, j < self.n) {
            (true, true) => self.A[i][j] * h,
            (true, false) => self.b[i] * h,
            _ => 0.0,
        };
        (0..size * size).map(|ij| entry(ij / size, ij % size)).collect()
    }
}

impl Code {
    /// The time constant in the equation of state `i`.
    fn time(&self, i: usize) -> Option<usize> {
        let shared = usize::from(self.pair && i > 0);
        (i < self.lags).then_some(i - shared)
    }
}

/// Over one sample.
#[derive(Clone, Copy, Default)]
pub(super) struct Step {
    pub(super) Phi: [[f64; MOST]; MOST],
    pub(super) now: [f64; MOST],
    pub(super) before: [f64; MOST],
    /// Slope of the last state, `x_n' = slope x + direct v`.
    pub(super) slope: [f64; MOST],
    pub(super) direct: f64,
}

/// How the states of one input's plant move, with the derivatives where asked for.
pub(super) struct Chain {
    pub(super) code: Code,
    /// Nonlinear parameters, in samples.
    pub(super) p: Vec<f64>,
    pub(super) step: Step,
    /// By `ln T …, ln zeta, L`.
    pub(super) slopes: Vec<Step>,
    /// Whole samples of the delay.
    pub(super) m: usize,
    /// Whether a jump of the input arrives within the sample.
    pub(super) late: bool,
}

impl Chain {
    /// At the nonlinear parameters `p` in samples; the delay lies in the cell `m <= L <= m + 1`.
    pub(super) fn new(code: Code, p: &[f64], m: usize, slopes: bool) -> Self {
        let f = if code.delay { (p[p.len() - 1] - m as f64).clamp(0.0, 1.0) } else { 0.0 };
        let plant = Plant::of(code, p);
        let mut chain =
            Chain { code, p: p.to_vec(), step: Step::default(), slopes: Vec::new(), m, late: f > 0.0 };
        if !slopes {
            let [whole, short] = [1.0, 1.0 - f].map(|h| exponential(&plant.bordered(h), plant.n + 1));
            chain.step = Step::of(&plant, &whole, &short);
            return chain;
        }
        for j in 0..code.times() + usize::from(code.pair) {
            let slope = plant.slope(code, j);
            let [whole, short] = [1.0, 1.0 - f].map(|h| derived(&plant, &slope, h));
            chain.step = Step::of(&plant, &whole.0, &short.0);
            chain.slopes.push(Step::of(&slope, &whole.1, &short.1));
        }
        if code.times() == 0 {
            let [whole, short] = [1.0, 1.0 - f].map(|h| exponential(&plant.bordered(h), plant.n + 1));
            chain.step = Step::of(&plant, &whole, &short);
        }
        if code.delay {
            // d Gamma(1 - f) / df = -e^(A (1 - f)) b
            let moved = exponential(&plant.bordered(1.0 - f), plant.n + 1);
            let size = plant.n + 1;
            let mut slope = Step::default();
            for i in 0..plant.n {
                slope.before[i] = (0..plant.n).map(|j| moved[i * size + j] * plant.b[j]).sum();
                slope.now[i] = -slope.before[i];
            }
            chain.slopes.push(slope);
        }
        chain
    }
}

impl Step {
    /// From the exponentials over the sample and over what of it lies behind the arrival.
    fn of(plant: &Plant, whole: &[f64], short: &[f64]) -> Self {
        let (n, size) = (plant.n, plant.n + 1);
        let mut step = Step::default();
        for i in 0..n {
            step.Phi[i][..n].copy_from_slice(&whole[i * size..][..n]);
            step.now[i] = short[i * size + n];
            step.before[i] = whole[i * size + n] - short[i * size + n];
        }
        if n > 0 {
            step.slope = plant.A[n - 1];
            step.direct = plant.b[n - 1];
        }
        step
    }
}

/// The exponential of a bordered plant and its derivative in the direction of another.
fn derived(plant: &Plant, slope: &Plant, h: f64) -> (Vec<f64>, Vec<f64>) {
    let (size, M, dM) = (plant.n + 1, plant.bordered(h), slope.bordered(h));
    let entry = |i: usize, j: usize| match (i < size, j < size) {
        (true, true) => M[i * size + j],
        (false, false) => M[(i - size) * size + j - size],
        (true, false) => dM[i * size + j - size],
        _ => 0.0,
    };
    let both: Vec<f64> = (0..4 * size * size).map(|ij| entry(ij / (2 * size), ij % (2 * size))).collect();
    let E = exponential(&both, 2 * size);
    let block = |right: usize| -> Vec<f64> {
        (0..size * size).map(|ij| E[ij / size * 2 * size + ij % size + right]).collect()
    };
    (block(0), block(size))
}

/// Share of a response below which nothing of it is left.
const FORGOTTEN: f64 = 1e-60;

/// The input as one chain sees it.
#[derive(Clone, Copy)]
pub(super) struct Drive<'u> {
    /// Rows of the segment; those before it were like the first.
    pub(super) u: &'u [f64],
    /// Row at which the response begins.
    pub(super) first: usize,
    /// What the input is multiplied by.
    pub(super) gain: f64,
}

impl Drive<'_> {
    fn at(&self, k: usize, lag: usize) -> f64 {
        self.gain * self.u[k.saturating_sub(lag)]
    }
}

/// What a chain puts out at one row: the last state and its slope in time, or their derivatives by a parameter.
pub(super) type Output = (f64, f64);

impl Chain {
    /// Number of states.
    pub(super) fn n(&self) -> usize {
        self.code.states()
    }

    /// States in equilibrium with an input that stands still, an integrator at zero.
    pub(super) fn rest(&self, u: f64) -> [f64; MOST] {
        let mut x = [0.0; MOST];
        x[..self.code.lags].fill(u);
        if self.code.pair {
            x[0] = 0.0;
        }
        x
    }

    /// The last state over `column`'s rows from `x0`, without an input.
    pub(super) fn decay(&self, x0: [f64; MOST], column: &mut [f64]) {
        match self.n() {
            0 => {}
            1 => self.decay_with::<1>(x0, column),
            2 => self.decay_with::<2>(x0, column),
            3 => self.decay_with::<3>(x0, column),
            _ => self.decay_with::<MOST>(x0, column),
        }
    }

    fn decay_with<const N: usize>(&self, x0: [f64; MOST], column: &mut [f64]) {
        let mut x: [f64; N] = std::array::from_fn(|i| x0[i]);
        for y in column {
            *y = x[N - 1];
            x = self.step.moved(&x);
            if x.iter().all(|v| v.abs() < FORGOTTEN) {
                return; // numbers next to zero would cost much time
            }
        }
    }

    /// The last state over `column`'s rows from `x0`, and its slope in time where there is room for it.
    pub(super) fn response(&self, drive: Drive<'_>, x0: [f64; MOST], column: &mut [f64], slope: &mut [f64]) {
        let first = drive.first;
        if !slope.is_empty() || self.n() == 0 || self.m + 2 > first {
            return self.run(drive, x0, |k, y, _| {
                column[k - first] = y.0;
                if let Some(slope) = slope.get_mut(k - first) {
                    *slope = y.1;
                }
            });
        }
        match self.n() {
            1 => self.response_with::<1>(drive, x0, column),
            2 => self.response_with::<2>(drive, x0, column),
            3 => self.response_with::<3>(drive, x0, column),
            _ => self.response_with::<MOST>(drive, x0, column),
        }
    }

    /// With all inputs inside the segment.
    fn response_with<const N: usize>(&self, drive: Drive<'_>, x0: [f64; MOST], column: &mut [f64]) {
        let mut x: [f64; N] = std::array::from_fn(|i| x0[i]);
        let Some((begin, rest)) = column.split_first_mut() else { return };
        *begin = x[N - 1];
        let arriving = drive.u[drive.first - self.m - 1..].windows(2);
        for (y, u) in rest.iter_mut().zip(arriving) {
            let moved = self.step.moved(&x);
            x = std::array::from_fn(|i| moved[i] + (self.step.now[i] * u[1] + self.step.before[i] * u[0]));
            *y = x[N - 1];
        }
    }

    /// Runs from the states `x0`; `take` gets the row, the output and its derivatives.
    pub(super) fn run(&self, drive: Drive<'_>, x0: [f64; MOST], take: impl FnMut(usize, Output, &[Output])) {
        match self.n() {
            0 => self.pass(drive, take),
            1 => self.run_with::<1>(drive, x0, take),
            2 => self.run_with::<2>(drive, x0, take),
            3 => self.run_with::<3>(drive, x0, take),
            _ => self.run_with::<MOST>(drive, x0, take),
        }
    }

    /// Without states the output is the delayed input.
    fn pass(&self, drive: Drive<'_>, mut take: impl FnMut(usize, Output, &[Output])) {
        let none = [(0.0, 0.0)];
        for k in drive.first..drive.u.len() {
            take(k, (self.arrived(&drive, k), 0.0), &none[..self.slopes.len()]);
        }
    }

    /// The delayed input right of its jump.
    fn arrived(&self, drive: &Drive<'_>, k: usize) -> f64 {
        drive.at(k, self.m + usize::from(self.late))
    }

    fn run_with<const N: usize>(
        &self,
        drive: Drive<'_>,
        x0: [f64; MOST],
        mut take: impl FnMut(usize, Output, &[Output]),
    ) {
        let mut x: [f64; N] = std::array::from_fn(|i| x0[i]);
        let mut dx = [[0.0; N]; MOST + 1];
        let dx = &mut dx[..self.slopes.len()];
        let mut outputs = [(0.0, 0.0); MOST + 1];
        let outputs = &mut outputs[..self.slopes.len()];
        let own = &self.step;
        for k in drive.first..drive.u.len() {
            if k > drive.first {
                let (now, before) = (drive.at(k, self.m + 1), drive.at(k, self.m + 2));
                for (dx, slope) in dx.iter_mut().zip(&self.slopes) {
                    let (moved, more) = (own.moved(dx), slope.moved(&x));
                    *dx = std::array::from_fn(|i| {
                        moved[i] + more[i] + slope.now[i] * now + slope.before[i] * before
                    });
                }
                let moved = own.moved(&x);
                x = std::array::from_fn(|i| moved[i] + own.now[i] * now + own.before[i] * before);
            }
            let v = self.arrived(&drive, k);
            for ((dx, slope), output) in dx.iter().zip(&self.slopes).zip(outputs.iter_mut()) {
                let steeper = own.dot(dx) + slope.dot(&x) + slope.direct * v;
                *output = (dx[N - 1], steeper);
            }
            take(k, (x[N - 1], own.dot(&x) + own.direct * v), outputs);
        }
    }
}

impl Step {
    #[inline(always)]
    fn moved<const N: usize>(&self, x: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|i| (0..N).map(|j| self.Phi[i][j] * x[j]).sum())
    }

    #[inline(always)]
    fn dot<const N: usize>(&self, x: &[f64; N]) -> f64 {
        (0..N).map(|j| self.slope[j] * x[j]).sum()
    }
}
