//! A sampled signal between its samples: a cubic spline, straight lines, or held.
//!
//! ```text
//! s_(t-1) + 4 s_t + s_(t+1) = 3 (u_(t+1) - u_(t-1))      slopes per sample; the third derivative runs through
//! s_0 + 2 s_1 = (5 (u_1 - u_0) + (u_2 - u_1)) / 2        the second sample and the last but one
//! ```
//!
//! de Boor, A Practical Guide to Splines, 1978, chapter IV. A force of 150 Hz, sampled at 750 Hz, costs the
//! benchmark's displacement 7e-6 m by straight lines, 1e-4 m held, and nothing that counts by a spline.

/// How a signal runs between samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// A cubic spline; needs the whole record.
    Spline,
    /// Straight.
    Line,
    /// As at the sample before.
    Zero,
}

/// A signal that can be asked between its samples.
pub(super) struct Between<'u> {
    u: &'u [f64],
    slopes: Vec<f64>, // (N) per sample; of a spline only
    hold: Hold,
}

impl<'u> Between<'u> {
    pub(super) fn new(u: &'u [f64], hold: Hold) -> Self {
        let slopes = if hold == Hold::Spline { slopes(u) } else { Vec::new() };
        Between { u, slopes, hold }
    }

    /// Values from sample `t` to the next one, both included, evenly spaced.
    pub(super) fn fill(&self, t: usize, points: &mut [f64]) {
        let (a, b) = (self.u[t], self.u[t + 1]);
        let Some((s_a, s_b)) = self.slopes.get(t).zip(self.slopes.get(t + 1)) else {
            return fill_plain(a, b, self.hold, points);
        };
        let count = points.len() - 1;
        for (i, point) in points.iter_mut().enumerate() {
            let f = i as f64 / count as f64;
            let g = 1.0 - f;
            // Hermite's form of the cubic.
            *point = g * g * (a + f * (2.0 * a + s_a)) + f * f * (b + g * (2.0 * b - s_b));
        }
    }
}

/// Values of a straight or a held signal.
pub(super) fn fill_plain(a: f64, b: f64, hold: Hold, points: &mut [f64]) {
    let count = points.len() - 1;
    for (i, point) in points.iter_mut().enumerate() {
        *point = if hold == Hold::Zero { a } else { a + (b - a) * (i as f64 / count as f64) };
    }
}

/// Slopes of the spline, per sample.
pub(super) fn slopes(u: &[f64]) -> Vec<f64> {
    let N = u.len();
    if N < 4 {
        return few(u);
    }
    let d = |t: usize| u[t + 1] - u[t];
    let (mut upper, mut s) = (vec![2.0; N], vec![0.0; N]);
    s[0] = 0.5 * (5.0 * d(0) + d(1));
    for t in 1..N - 1 {
        let pivot = 4.0 - upper[t - 1];
        upper[t] = 1.0 / pivot;
        s[t] = (3.0 * (u[t + 1] - u[t - 1]) - s[t - 1]) / pivot;
    }
    s[N - 1] = (0.5 * (5.0 * d(N - 2) + d(N - 3)) - 2.0 * s[N - 2]) / (1.0 - 2.0 * upper[N - 2]);
    for t in (0..N - 1).rev() {
        s[t] -= upper[t] * s[t + 1];
    }
    s
}

/// Slopes of the parabola or the line through so few samples.
fn few(u: &[f64]) -> Vec<f64> {
    match *u {
        [a, b] => vec![b - a; 2],
        [a, b, c] => {
            let (middle, bend) = ((c - a) / 2.0, c - 2.0 * b + a);
            vec![middle - bend, middle, middle + bend]
        }
        _ => vec![0.0; u.len()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cubic is its own spline, to the ends.
    #[test]
    fn a_cubic_comes_back() {
        let cubic = |t: f64| 2.0 - 3.0 * t + 0.7 * t * t - 0.05 * t * t * t;
        for N in [4, 5, 30] {
            let u: Vec<f64> = (0..N).map(|t| cubic(t as f64)).collect();
            let between = Between::new(&u, Hold::Spline);
            let mut points = [0.0; 9];
            for t in 0..N - 1 {
                between.fill(t, &mut points);
                for (i, p) in points.iter().enumerate() {
                    let x = cubic(t as f64 + i as f64 / 8.0);
                    assert!((p - x).abs() < 1e-11 * N.pow(3) as f64, "{N} {t} {i}: {p} {x}");
                }
            }
        }
    }

    #[test]
    fn a_parabola_comes_back_from_three() {
        let u = [1.0, 2.0, 5.0];
        let mut points = [0.0; 3];
        Between::new(&u, Hold::Spline).fill(1, &mut points);
        assert!((points[1] - 3.25).abs() < 1e-15);
    }
}
