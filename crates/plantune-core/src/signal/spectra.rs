//! Spectra of several signals at once, one-sided, in units of the signals' product over rad/s; three ways.
//!
//! ```text
//! S_ab(w) ~ mean of A(w) B(w)*,   so that  sum S_aa dw = mean square                    Parseval, (3.5-12)
//!
//! Welch             A = transform of window(t) a(t) over stretches of n rows, overlapping:
//!                   S = c A B* / (w_s sum window^2), c = 2, at 0 and at w_s/2 c = 1       (3.5-14)
//! smoothed lines    A = transform of the whole run, A B* averaged over neighbouring lines with a Hann weight
//! Blackman, Tukey   S(w) = 2/w_s sum_l h(l) R_ab(l) e^(-i w l Ts), R_ab(l) = sum a(t + l) b(t)/N, |l| <= M,
//!                   h(l) = (1 + cos(pi l/M))/2
//! ```
//!
//! `ratio` is the variance of a density over its square, so that `2/ratio` degrees of freedom go into each:
//! for Welch `sum over pairs of stretches (w . w shifted)^2/(w . w)^2 / stretches^2`, for the others the sum of the
//! squared weights. Welch 1967; Ljung 1999, 6.4; Percival and Walden 1993, 6.17; source 001, (3.5-10) to (3.5-14).

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::correlate;
use super::fft::Fourier;
use super::window::Window;
use crate::linalg::{Complex, dot};

/// Power and cross-power of signals over frequency.
#[derive(Clone, Debug)]
pub struct Spectra {
    /// Frequencies, rad/s, from 0 on.
    pub w: Vec<f64>, // (n)
    /// `S_ab` at `w[k]`: `S[(k m + a) m + b]`, of `m` signals.
    pub S: Vec<Complex<f64>>, // (n, m, m)
    /// Number of signals.
    pub m: usize,
    /// Variance of a density over its square.
    pub ratio: f64,
    /// Stretches or lines that were averaged, or lags.
    pub averaged: usize,
}

impl Spectra {
    /// `S_ab` at frequency `k`.
    pub fn at(&self, k: usize, a: usize, b: usize) -> Complex<f64> {
        self.S[(k * self.m + a) * self.m + b]
    }

    /// Density of signal `a`.
    pub fn density(&self, a: usize) -> Vec<f64> {
        (0..self.w.len()).map(|k| self.at(k, a, a).re).collect()
    }
}

/// Stretches of Welch's way.
#[derive(Clone, Copy, Debug)]
pub struct Stretched {
    /// Rows of a stretch.
    pub n: usize,
    /// Rows from the start of a stretch to that of the next.
    pub step: usize,
    /// How it fades in and out.
    pub window: Window,
}

/// Welch's way: stretches within each run; runs that are too short are left out.
///
/// Of signals without their means. None if no run is long enough.
pub fn welch(signals: &[Vec<f64>], runs: &[Range<usize>], way: Stretched, Ts: f64) -> Option<Spectra> {
    let (n, window) = (way.n, way.window.weights(way.n));
    let firsts: Vec<Vec<usize>> = runs
        .iter()
        .map(|run| (run.start..(run.end + 1).saturating_sub(n)).step_by(way.step).collect())
        .collect();
    let averaged = firsts.iter().map(Vec::len).sum::<usize>();
    if averaged == 0 {
        return None;
    }
    let mut transform = Fourier::new(n);
    let mut sum = Products::new(signals.len(), n / 2 + 1);
    for &first in firsts.iter().flatten() {
        let faded = |x: &Vec<f64>| -> Vec<f64> {
            x[first..first + n].iter().zip(&window).map(|(x, w)| x * w).collect()
        };
        sum.add(&signals.iter().map(|x| transform.of(&mut faded(x))).collect::<Vec<_>>());
    }
    let unit = Ts / (TAU * dot(&window, &window) * averaged as f64);
    let sided = |k: usize| if k == 0 || 2 * k == n { unit } else { 2.0 * unit };
    let counts: Vec<usize> = firsts.iter().map(Vec::len).collect();
    Some(Spectra {
        w: (0..=n / 2).map(|k| TAU * k as f64 / (n as f64 * Ts)).collect(),
        S: sum.scaled(sided),
        m: signals.len(),
        ratio: shared(&window, way.step, &counts),
        averaged,
    })
}

/// Variance of the mean over stretches of one run each `counts` long, over that of one.
fn shared(window: &[f64], step: usize, counts: &[usize]) -> f64 {
    let (n, power) = (window.len(), dot(window, window));
    let stretches = counts.iter().sum::<usize>() as f64;
    let mut pairs = stretches;
    for apart in (1..).take_while(|apart| apart * step < n) {
        let overlap = dot(&window[apart * step..], &window[..n - apart * step]) / power;
        let number = counts.iter().map(|count| count.saturating_sub(apart)).sum::<usize>();
        pairs += 2.0 * number as f64 * overlap * overlap;
    }
    pairs / (stretches * stretches)
}

/// The lines `k = 1 … N/2` of one whole run, each the mean of `half` neighbours on either side with a Hann weight.
///
/// Beyond both ends the lines go on as those of a real signal do. Of signals without their means.
pub fn smoothed(signals: &[Vec<f64>], run: &Range<usize>, half: usize, Ts: f64) -> Spectra {
    let (N, m, reach) = (run.len(), signals.len(), half as i64);
    let mut transform = Fourier::new(N);
    let X: Vec<Vec<Complex<f64>>> =
        signals.iter().map(|x| transform.of(&mut x[run.clone()].to_vec())).collect();
    let weight = |j: i64| 0.5 * (1.0 + (PI * j as f64 / (half + 1) as f64).cos());
    let weights: Vec<f64> = (-reach..=reach).map(weight).collect();
    let total: f64 = weights.iter().sum();
    let line = |x: &[Complex<f64>], k: i64| {
        let k = k.rem_euclid(N as i64) as usize;
        if k <= N / 2 { x[k] } else { x[N - k].conj() }
    };
    let unit = Ts / (TAU * N as f64 * total);
    let mut sum = Products::new(m, N / 2);
    for k in 1..=N / 2 {
        let sided = if 2 * k == N { unit } else { 2.0 * unit };
        for (j, weight) in (-reach..=reach).zip(&weights) {
            let lines: Vec<Complex<f64>> = X.iter().map(|x| line(x, k as i64 + j)).collect();
            sum.add_at(k - 1, &lines, sided * weight);
        }
    }
    Spectra {
        w: (1..=N / 2).map(|k| TAU * k as f64 / (N as f64 * Ts)).collect(),
        S: sum.sums,
        m,
        ratio: dot(&weights, &weights) / (total * total),
        averaged: weights.len(),
    }
}

/// Blackman and Tukey's way at `w` rad/s: a Hann lag window that ends at lag `M`.
///
/// Of signals without their means; sums of lagged products stay within the runs.
pub fn blackman_tukey(
    signals: &[Vec<f64>],
    runs: &[Range<usize>],
    M: usize,
    w: Vec<f64>,
    Ts: f64,
) -> Spectra {
    let (m, N) = (signals.len(), runs.iter().map(Range::len).sum::<usize>() as f64);
    let h: Vec<f64> = (0..=M).map(|l| 0.5 * (1.0 + (PI * l as f64 / M as f64).cos())).collect();
    let lagged = |a: usize, b: usize| -> Vec<f64> {
        let mut R = vec![0.0; M + 1]; // sum a(t + l) b(t)/N
        for run in runs {
            let r = correlate(&signals[b][run.clone()], &signals[a][run.clone()]);
            R.iter_mut().zip(r).for_each(|(R, r)| *R += r / N);
        }
        R
    };
    let R: Vec<Vec<f64>> = (0..m * m).map(|ab| lagged(ab / m, ab % m)).collect();
    let mut S = Vec::with_capacity(w.len() * m * m);
    for w in &w {
        let turns: Vec<Complex<f64>> =
            (0..=M).map(|l| Complex::from_polar(h[l], -w * Ts * l as f64)).collect();
        for ab in 0..m * m {
            let (later, earlier) = (&R[ab], &R[ab % m * m + ab / m]);
            let sum = (1..=M).map(|l| turns[l] * later[l] + turns[l].conj() * earlier[l]);
            S.push((turns[0] * later[0] + sum.sum::<Complex<f64>>()) * (Ts / PI));
        }
    }
    let ratio = (1.0 + 2.0 * dot(&h[1..], &h[1..])) / N;
    Spectra { w, S, m, ratio, averaged: M }
}

/// Sums of `A B*` of each pair of signals at each frequency.
struct Products {
    m: usize,
    sums: Vec<Complex<f64>>, // (n, m, m)
}

impl Products {
    fn new(m: usize, n: usize) -> Self {
        Products { m, sums: vec![Complex::new(0.0, 0.0); n * m * m] }
    }

    fn add(&mut self, X: &[Vec<Complex<f64>>]) {
        for k in 0..X[0].len() {
            let lines: Vec<Complex<f64>> = X.iter().map(|x| x[k]).collect();
            self.add_at(k, &lines, 1.0);
        }
    }

    fn add_at(&mut self, k: usize, lines: &[Complex<f64>], weight: f64) {
        let sums = &mut self.sums[k * self.m * self.m..][..self.m * self.m];
        for (ab, sum) in sums.iter_mut().enumerate() {
            *sum += lines[ab / self.m] * lines[ab % self.m].conj() * weight;
        }
    }

    fn scaled(mut self, factor: impl Fn(usize) -> f64) -> Vec<Complex<f64>> {
        let size = self.m * self.m;
        self.sums.iter_mut().enumerate().for_each(|(at, sum)| *sum *= factor(at / size));
        self.sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    /// Parseval: the rectangular stretch of a whole signal holds all of its power, for even and odd lengths.
    #[test]
    fn the_densities_sum_to_the_mean_square() {
        for N in [2, 3, 50, 51, 128] {
            let x = white(N, 7);
            let way = Stretched { n: N, step: N, window: Window::Rectangular };
            let S = welch(&[x.clone()], &[0..N], way, 0.2).expect("one stretch");
            let sum: f64 = S.density(0).iter().map(|P| P * TAU / (N as f64 * 0.2)).sum();
            assert!((sum * N as f64 / dot(&x, &x) - 1.0).abs() < 1e-13, "{N}");
        }
    }

    #[test]
    fn half_overlapping_hann_stretches_count_19_18ths() {
        let ratio = shared(&Window::Hann.weights(64), 32, &[400]);
        assert!((ratio * 400.0 - 19.0 / 18.0).abs() < 1e-3, "{}", ratio * 400.0);
    }

    /// The three ways see the same gain and delay of `y(t) = 2 u(t - 3)`.
    #[test]
    fn three_ways_agree_on_a_delay() {
        let u = white(4000, 1);
        let y: Vec<f64> = (0..4000usize).map(|k| k.checked_sub(3).map_or(0.0, |k| 2.0 * u[k])).collect();
        let signals = [u, y];
        let way = Stretched { n: 128, step: 64, window: Window::Hann };
        let grid = vec![0.3, 1.0, 2.5];
        let spectra = [
            welch(&signals, &[0..4000], way, 1.0).expect("long enough"),
            smoothed(&signals, &(0..4000), 40, 1.0),
            blackman_tukey(&signals, &[0..4000], 60, grid.clone(), 1.0),
        ];
        for S in &spectra {
            for w in &grid {
                let near = |k: &usize| (S.w[*k] - w).abs();
                let k = (0..S.w.len()).min_by(|a, b| near(a).total_cmp(&near(b))).expect("some");
                let G = S.at(k, 1, 0) / S.at(k, 0, 0);
                let truth = Complex::from_polar(2.0, -3.0 * S.w[k]);
                assert!((G - truth).norm() < 0.1, "{w}: {G} {truth}");
            }
        }
    }
}
