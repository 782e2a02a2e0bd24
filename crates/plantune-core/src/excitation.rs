//! How much an input moves, and how many parameters of a linear model its motion supports.

use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{dot, extent, sum, symmetric_eigenvalues};
use crate::note::Place;
use crate::record::Record;

/// Refuses a record with an input that stands still (X01).
///
/// The travel is compared with the largest magnitude: a constant with a ripple in its last
/// digits has full rank, but it does not move.
pub fn check_input_motion(rec: &Record, limits: &Limits) -> Result<()> {
    for i in 0..rec.nu {
        let (low, high) = extent(&rec.input(i));
        let travel = high - low;
        let size = low.abs().max(high.abs());
        if travel <= limits.X01 * size {
            let name = rec.input_name(i);
            let t1 = rec.t0 + (rec.N() - 1) as f64 * rec.Ts;
            return Err(Error::new(
                "X01",
                format!("not exciting: {name} stays at {low} from {} s to {t1} s", rec.t0),
            )
            .at(rec.place(i, 0))
            .count(rec.N())
            .measured(if size > 0.0 { travel / size } else { 0.0 }, limits.X01)
            .remedy("record again with a step or a PRBS on the input"));
        }
    }
    Ok(())
}

/// Parameters that an input must support for a gain, a lag and a delay; one sinusoid supports two.
pub const LEAST_EXCITATION: usize = 3;

/// X02: the input's motion supports fewer parameters than are wanted.
pub fn too_poor(rec: &Record, i: usize, supported: usize, wanted: usize, limits: &Limits) -> Error {
    let name = rec.input_name(i);
    Error::new(
        "X02",
        format!("{name} supports {supported} parameters of a linear model, {wanted} are needed"),
    )
    .at(Place::column(name))
    .count(supported)
    .measured(excitation_ratio(rec, i, wanted), limits.X02)
    .remedy(format!("ask for at most {supported} parameters, or record with a PRBS or several steps"))
}

/// `sigma_min / sigma_max` of the Hankel matrix of `p` columns.
fn excitation_ratio(rec: &Record, i: usize, p: usize) -> f64 {
    singular_ratio(&hankel_gram(rec, i, p), p, p)
}

/// The largest `p <= most` for which the centred, column-scaled Hankel matrix
/// `[u(t) … u(t-p+1)]` of input `i` has `sigma_min / sigma_max` above `limit`.
pub fn excitation_order(rec: &Record, i: usize, most: usize, limit: f64) -> usize {
    let gram = hankel_gram(rec, i, most);
    (1..=most).take_while(|&p| singular_ratio(&gram, most, p) > limit).last().unwrap_or(0)
}

/// `sigma_min / sigma_max` of the leading `p` columns, scaled to unit length.
fn singular_ratio(gram: &[f64], most: usize, p: usize) -> f64 {
    let length = |j: usize| gram[j * most + j].max(0.0).sqrt();
    if (0..p).any(|j| length(j) == 0.0) {
        return 0.0;
    }
    let scaled: Vec<f64> =
        (0..p * p).map(|ij| gram[ij / p * most + ij % p] / (length(ij / p) * length(ij % p))).collect();
    let values = symmetric_eigenvalues(&scaled, p);
    (values[0].max(0.0) / values[p - 1]).sqrt()
}

/// Gram matrix of the Hankel matrix, each column centred on its own mean (so that a sinusoid cut
/// anywhere has rank two), from its first row by the shift of one sample:
/// `G[i+1][j+1] = G[i][j] + (row that enters) - (row that leaves)`.
fn hankel_gram(rec: &Record, i: usize, p: usize) -> Vec<f64> {
    let column = rec.input(i);
    let mean = sum(&column) / column.len() as f64;
    let (mut gram, mut sums, mut rows) = (vec![0.0; p * p], vec![0.0; p], 0.0);
    for s in rec.segments().filter(|s| s.len() > p) {
        let column = &column[s];
        let n = column.len();
        let u = |k: usize| column[k] - mean;
        rows += (n - p + 1) as f64;
        let mut own = first_row(column, mean, p);
        let mut moving = sum(&column[p - 1..]) - (n - p + 1) as f64 * mean;
        for (j, sum) in sums.iter_mut().enumerate() {
            *sum += moving;
            if j + 1 < p {
                moving += u(p - 2 - j) - u(n - 1 - j);
            }
        }
        for r in 1..p {
            for c in r..p {
                own[r * p + c] = own[(r - 1) * p + c - 1] + u(p - 1 - r) * u(p - 1 - c) - u(n - r) * u(n - c);
            }
        }
        for r in 0..p {
            for c in 0..p {
                gram[r * p + c] += own[r.min(c) * p + r.max(c)];
            }
        }
    }
    (0..p * p).map(|rc| gram[rc] - sums[rc / p] * sums[rc % p] / rows).collect()
}

/// `sum_t u(t) u(t-j)` of the column without its mean, for `j = 0 … p-1`; in stretches that stay in
/// the cache.
fn first_row(column: &[f64], mean: f64, p: usize) -> Vec<f64> {
    let mut row = vec![0.0; p * p];
    let mut u = Vec::with_capacity(2048 + p);
    let mut start = p - 1;
    while start < column.len() {
        let end = (start + 2048).min(column.len());
        u.clear();
        u.extend(column[start + 1 - p..end].iter().map(|x| x - mean));
        for (j, entry) in row[..p].iter_mut().enumerate() {
            *entry += dot(&u[p - 1..], &u[p - 1 - j..u.len() - j]);
        }
        start = end;
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order_of(u: &[f64]) -> usize {
        let y = vec![0.0; u.len()];
        let rec = Record::uniform(u, 1, &y, 1, 0.1).expect("fine");
        excitation_order(&rec, 0, 8, Limits::default().X02)
    }

    #[test]
    fn each_sinusoid_supports_two_parameters() {
        let wave = |w: f64| (0..1000).map(move |k| (w * f64::from(k)).sin());
        let one: Vec<f64> = wave(0.3).collect();
        let two: Vec<f64> = wave(0.3).zip(wave(1.1)).map(|(a, b)| a + b).collect();
        assert_eq!((order_of(&one), order_of(&two)), (2, 4));
    }

    #[test]
    fn white_noise_supports_all() {
        let mut state = 1u32;
        let u: Vec<f64> = (0..1000)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 31)
            })
            .collect();
        assert_eq!(order_of(&u), 8);
    }
}
