//! Poles from repeated integrals, by one linear regression and on any time stamps.
//!
//! ```text
//! y = a_1 I y + … + a_k I^k y + polynomial of degree k,   poles = roots of s^k - a_1 s^(k-1) - … - a_k
//! ```
//!
//! The sum of modes obeys a differential equation of order k with a constant right side; k integrals make it
//! free of derivatives, and the polynomial holds the initial state and the level. Without noise as exact as the
//! integrals (the cubic through each four neighbours); under noise the best of the starts.

use crate::linalg::{Complex, Triangle, solve};
use crate::poly::roots;

/// The k poles; None where the columns do not tell them apart.
pub(super) fn integrals(t: &[f64], y: &[f64], k: usize) -> Option<Vec<Complex<f64>>> {
    let span = t[t.len() - 1];
    let x: Vec<f64> = t.iter().map(|t| t / span).collect();
    let mut columns: Vec<Vec<f64>> = Vec::with_capacity(k);
    for j in 0..k {
        columns.push(integral(&x, if j == 0 { y } else { &columns[j - 1] }));
    }
    let mut row = vec![0.0; 2 * k + 2];
    let mut triangle = crate::linalg::Block::new(row.len());
    let mut whole = Triangle::new(row.len());
    for n in 0..y.len() {
        row.iter_mut().zip(&columns).for_each(|(out, column)| *out = column[n]);
        legendre(2.0 * x[n] - 1.0, &mut row[k..=2 * k]);
        row[2 * k + 1] = y[n];
        triangle.push(&row);
    }
    whole.absorb(&mut triangle);
    let all: Vec<usize> = (0..=2 * k).collect();
    let a = solve(&whole, &all, 2 * k + 1, 1e-14).ok()?.theta;
    let p: Vec<f64> = std::iter::once(1.0).chain(a[..k].iter().map(|a| -a)).collect();
    let mut poles: Vec<Complex<f64>> = roots(&p).iter().map(|r| Complex::new(r.0, r.1) / span).collect();
    poles.resize(k, Complex::new(0.0, 0.0));
    Some(poles)
}

/// Legendre's polynomials of degree 0, 1, … at `x`.
fn legendre(x: f64, out: &mut [f64]) {
    for n in 0..out.len() {
        let m = n as f64;
        out[n] = match n {
            0 => 1.0,
            1 => x,
            _ => ((2.0 * m - 1.0) * x * out[n - 1] - (m - 1.0) * out[n - 2]) / m,
        };
    }
}

/// The integral of y from `x[0]` to each x: of the cubic through four neighbours, by two Gauss points.
pub(super) fn integral(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let mut sum = 0.0;
    let mut out = vec![0.0; n];
    for i in 0..n - 1 {
        let half = (x[i + 1] - x[i]) / 2.0;
        sum += if n < 4 {
            half * (y[i] + y[i + 1])
        } else {
            let first = i.saturating_sub(1).min(n - 4);
            let (nodes, values) = (&x[first..first + 4], &y[first..first + 4]);
            let middle = x[i] + half;
            let gauss = half / 3f64.sqrt();
            half * (cubic(nodes, values, middle - gauss) + cubic(nodes, values, middle + gauss))
        };
        out[i + 1] = sum;
    }
    out
}

/// Lagrange's interpolation.
fn cubic(nodes: &[f64], values: &[f64], at: f64) -> f64 {
    let weight = |i: usize| {
        let others = (0..nodes.len()).filter(|&j| j != i);
        others.map(|j| (at - nodes[j]) / (nodes[i] - nodes[j])).product::<f64>()
    };
    (0..nodes.len()).map(|i| weight(i) * values[i]).sum()
}
