//! The simplex search of Nelder and Mead, for a handful of variables and no derivatives.
//!
//! J. A. Nelder and R. Mead, A simplex method for function minimization, Computer Journal 7 (1965), with
//! reflection 1, expansion 2, contraction and shrinkage 1/2.

/// Where `f` is least, and its value there; from `start`, whose simplex has edges of `step`.
///
/// Ends when all corners lie within `tolerance` of the best, or after `most` evaluations. An infinite value
/// is a wall.
pub fn simplex(
    mut f: impl FnMut(&[f64]) -> f64,
    start: &[f64],
    step: f64,
    tolerance: f64,
    most: usize,
) -> (Vec<f64>, f64) {
    let n = start.len();
    let mut corners: Vec<(Vec<f64>, f64)> = (0..=n)
        .map(|i| {
            let mut x = start.to_vec();
            if i > 0 {
                x[i - 1] += step;
            }
            let value = f(&x);
            (x, value)
        })
        .collect();
    let mut spent = n + 1;
    loop {
        corners.sort_by(|a, b| a.1.total_cmp(&b.1));
        let size = corners[1..]
            .iter()
            .flat_map(|(x, _)| x.iter().zip(&corners[0].0).map(|(a, b)| (a - b).abs()))
            .fold(0.0, f64::max);
        if size < tolerance || spent >= most {
            return corners.swap_remove(0);
        }
        let worst = corners[n].0.clone();
        let centre: Vec<f64> =
            (0..n).map(|j| corners[..n].iter().map(|(x, _)| x[j]).sum::<f64>() / n as f64).collect();
        let beyond =
            |by: f64| -> Vec<f64> { centre.iter().zip(&worst).map(|(c, w)| c + by * (c - w)).collect() };
        let mut at = |x: Vec<f64>| {
            let value = f(&x);
            spent += 1;
            (x, value)
        };
        let reflected = at(beyond(1.0));
        let next = if reflected.1 < corners[0].1 {
            let expanded = at(beyond(2.0));
            Some(if expanded.1 < reflected.1 { expanded } else { reflected })
        } else if reflected.1 < corners[n - 1].1 {
            Some(reflected)
        } else {
            let limit = corners[n].1.min(reflected.1);
            let contracted = at(beyond(if reflected.1 < corners[n].1 { 0.5 } else { -0.5 }));
            (contracted.1 < limit).then_some(contracted)
        };
        match next {
            Some(better) => corners[n] = better,
            None => {
                let best = corners[0].0.clone();
                for corner in &mut corners[1..] {
                    let x = corner.0.iter().zip(&best).map(|(x, b)| 0.5 * (x + b)).collect();
                    *corner = at(x);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The banana valley of Rosenbrock, least at (1, 1).
    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let valley = |x: &[f64]| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2);
        let (x, value) = simplex(valley, &[-1.2, 1.0], 0.5, 1e-9, 1000);
        assert!((x[0] - 1.0).abs() < 1e-7 && (x[1] - 1.0).abs() < 1e-7 && value < 1e-14, "{x:?}");
    }

    #[test]
    fn a_wall_is_not_crossed() {
        let walled = |x: &[f64]| if x[0] < 2.0 { f64::INFINITY } else { x[0] + x[1] * x[1] };
        let (x, _) = simplex(walled, &[3.0, 1.0], 0.3, 1e-9, 1000);
        assert!((x[0] - 2.0).abs() < 1e-6 && x[1].abs() < 1e-3, "{x:?}");
    }
}
