//! Tail probabilities and quantiles behind the tests.

use statrs::function::beta::beta_reg;
use statrs::function::erf::erfc_inv;
use statrs::function::gamma::gamma_ur;

/// `P(F > f)` for the F distribution with `d1, d2` degrees of freedom.
pub fn f_tail(f: f64, d1: f64, d2: f64) -> f64 {
    if !(f > 0.0) {
        return 1.0;
    }
    beta_reg(d2 / 2.0, d1 / 2.0, d2 / (d2 + d1 * f))
}

/// `P(x > q)` for the chi-square distribution with `d` degrees of freedom.
pub fn chi2_tail(q: f64, d: f64) -> f64 {
    if q > 0.0 && d > 0.0 { gamma_ur(d / 2.0, q / 2.0) } else { 1.0 }
}

/// The number that chi-square with `d` degrees of freedom exceeds with probability `p`, by halving.
pub fn chi2_quantile(p: f64, d: f64) -> f64 {
    let (mut low, mut high) = (0.0, d.max(1.0));
    while chi2_tail(high, d) > p {
        high *= 2.0;
    }
    while high - low > 4.0 * f64::EPSILON * high {
        let middle = 0.5 * (low + high);
        if middle == low || middle == high {
            break;
        }
        if chi2_tail(middle, d) > p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// `P(|x| > z)` for a standard normal.
pub fn normal_tails(z: f64) -> f64 {
    chi2_tail(z * z, 1.0)
}

/// The number that a standard normal exceeds in magnitude with probability `1 - level`.
pub fn normal_quantile(level: f64) -> f64 {
    std::f64::consts::SQRT_2 * erfc_inv(1.0 - level)
}

/// The `share` quantile of values in ascending order, interpolated; infinities are kept.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share * (sorted.len() - 1) as f64;
    let (low, high) = (at.floor() as usize, at.ceil() as usize);
    if low == high || sorted[low] == sorted[high] {
        return sorted[low];
    }
    sorted[low] + (at - low as f64) * (sorted[high] - sorted[low])
}

/// `x` without its mean.
pub fn centred(mut x: Vec<f64>) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    for v in &mut x {
        *v -= mean;
    }
    x
}

/// Standard deviation about the mean, `sqrt(sum (x - m)^2 / (n - 1))`.
pub fn deviation(x: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = x.clone().count() as f64;
    let mean = x.clone().sum::<f64>() / n;
    (x.map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
}

/// The middle value, the upper one of two; 0 of none.
pub fn median(mut x: Vec<f64>) -> f64 {
    let middle = x.len() / 2;
    if x.is_empty() { 0.0 } else { *x.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_printed_ones() {
        assert!((normal_quantile(0.95) - 1.959_963_984_540_054).abs() < 1e-12);
        assert!((normal_quantile(0.99) - 2.575_829_303_548_901).abs() < 1e-12);
        // F(1, n) is the square of Student's t: P(F > 4.9646) = 0.05 for n = 10.
        // With two degrees of freedom the tail is exp(-q/2).
        assert!((chi2_quantile(0.05, 10.0) - 18.307_038_053_275_14).abs() < 1e-9);
        assert!((chi2_quantile(0.975, 3.5) - 0.338_873_384_303).abs() < 1e-9);
        assert!((normal_tails(-1.959_963_984_540_054) - 0.05).abs() < 1e-11);
        assert!((chi2_tail(3.0, 2.0) - (-1.5_f64).exp()).abs() < 1e-12);
        assert!((f_tail(4.964_602_743_730_711, 1.0, 10.0) - 0.05).abs() < 1e-12);
    }
}
