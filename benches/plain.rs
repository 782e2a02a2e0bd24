//! The yardstick of `recursive.py`: one stream, first-order RML with offset, the whole matrix, plain code.
//!
//! ```text
//! y(t) = a y(t-1) + b u(t-nk) + d + e(t) + c e(t-1)
//! ```
//!
//! No factors, no bounds, no gate, nothing checked: what a reader would write first. Only the upper triangle of
//! `P` is kept. Built by the bench with `rustc -O`, for the processor at hand.

/// Runs `lanes` estimators one after the other over `n` samples; the estimator `k` reads column
/// `k / delays` of `u` and `y`, `(n, loops)`, at the delay `low + k % delays`. Writes their theta.
///
/// # Safety
/// `u`, `y` hold `n loops` numbers, `theta` holds `4 loops delays`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plain(
    n: usize,
    loops: usize,
    low: usize,
    delays: usize,
    u: *const f64,
    y: *const f64,
    theta: *mut f64,
) {
    let (u, y, theta) = unsafe {
        (
            std::slice::from_raw_parts(u, n * loops),
            std::slice::from_raw_parts(y, n * loops),
            std::slice::from_raw_parts_mut(theta, 4 * loops * delays),
        )
    };
    for (lane, theta) in theta.chunks_exact_mut(4).enumerate() {
        let (index, nk) = (lane / delays, low + lane % delays);
        theta.copy_from_slice(&stream(u, y, loops, index, nk, low + delays - 1));
    }
}

fn stream(u: &[f64], y: &[f64], loops: usize, index: usize, nk: usize, high: usize) -> [f64; 4] {
    let (mut theta, mut P, mut psi, mut ebar) = ([0.0; 4], [[0.0; 4]; 4], [0.0; 4], 0.0);
    (0..4).for_each(|i| P[i][i] = 1e6);
    let (u0, y0, mut gap) = (u[index], y[index], 0.995 - 0.95);
    for t in high..y.len() / loops {
        let at = |x: &[f64], lag: usize| x[(t - lag) * loops + index];
        let phi = [at(y, 1) - y0, at(u, nk) - u0, 1.0, ebar];
        let lambda = 0.995 - gap;
        gap *= 0.99;
        for i in 0..4 {
            psi[i] = phi[i] - theta[3] * psi[i];
        }
        let mut gain = [0.0; 4];
        for i in 0..4 {
            for j in 0..4 {
                gain[i] += if i <= j { P[i][j] } else { P[j][i] } * psi[j];
            }
        }
        let scale = 1.0 / (lambda + dot(&gain, &psi));
        let y = at(y, 0) - y0;
        let step = (y - dot(&phi, &theta)) * scale;
        let inverse = 1.0 / lambda;
        for i in 0..4 {
            theta[i] += gain[i] * step;
            for j in i..4 {
                P[i][j] = (P[i][j] - gain[i] * gain[j] * scale) * inverse;
            }
        }
        theta[3] = theta[3].clamp(-0.97, 0.97);
        ebar = y - dot(&phi, &theta);
    }
    theta
}

fn dot(x: &[f64; 4], y: &[f64; 4]) -> f64 {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2] + x[3] * y[3]
}
