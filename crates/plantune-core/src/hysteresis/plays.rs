//! Plays at work, many side by side.
//!
//! ```text
//! z_i(t) = max(x(t) - r_i, min(x(t) + r_i, z_i(t-1)))      y(t) = O + sum_i w_i z_i(t)
//! ```
//!
//! What the processor does, two at a time, is five operations a register of plays: four for `z`, one for the sum. So
//! half widths, weights and states of as many plays as fit stay in registers over a tile of samples; their part of
//! each sum waits in the first-level cache until the other plays have passed over the tile. Left to the compiler the
//! loops over plays and samples come out one way or another, up to eight times apart.
//!
//! The sum runs over the plays of each lane in their order, then over the lanes: the same for one sample as for a
//! record, and on every machine with registers of the same width. An input that is no number moves nothing.

use pulp::{Arch, Simd, WithSimd};

use super::{Operator, PlayStack, copy_state};
use crate::error::Result;
use crate::linalg::Lines;

/// Plays are filled up to whole registers of this many, the widest there are.
const LANES: usize = 8;

/// The most registers of plays whose `r`, `w` and `z` stay in registers.
const TOGETHER: usize = 7;

/// Samples of a tile: their sums take 4 kB.
const TILE: usize = 64;

/// Half widths, weights and states, filled up with plays of no weight.
pub(super) struct Plays {
    n: usize,
    offset: f64,
    r: Lines,
    w: Lines,
    z: Lines,
}

impl Plays {
    /// In the state `z`, one number a play.
    pub(super) fn new(stack: &PlayStack, z: &[f64]) -> Self {
        Plays { n: z.len(), offset: stack.offset, r: filled(&stack.r), w: filled(&stack.w), z: filled(z) }
    }
}

fn filled(values: &[f64]) -> Lines {
    let mut lines = Lines::new(values.len().next_multiple_of(LANES));
    lines[..values.len()].copy_from_slice(values);
    lines
}

impl Operator for Plays {
    fn step(&mut self, x: f64) -> f64 {
        let mut y = [0.0];
        Arch::new().dispatch(Pass { plays: self, x: &[x], y: &mut y });
        y[0]
    }

    fn run(&mut self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        Arch::new().dispatch(Pass { plays: self, x, y: &mut y });
        y
    }

    fn state(&self) -> Vec<f64> {
        self.z[..self.n].to_vec()
    }

    fn resume(&mut self, state: &[f64]) -> Result<()> {
        copy_state(&mut self.z[..self.n], state)
    }
}

/// All plays over all samples.
struct Pass<'p> {
    plays: &'p mut Plays,
    x: &'p [f64],
    y: &'p mut [f64],
}

impl WithSimd for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Pass { plays, x, y } = self;
        let mut sums = [simd.splat_f64s(0.0); TILE];
        for (x, y) in x.chunks(TILE).zip(y.chunks_mut(TILE)) {
            let sums = &mut sums[..x.len()];
            sums.fill(simd.splat_f64s(0.0));
            tile(simd, plays, x, sums);
            for (y, &sum) in y.iter_mut().zip(&*sums) {
                *y = plays.offset + simd.reduce_sum_f64s(sum);
            }
        }
    }
}

/// Adds every play's part to the sums of a tile, as few registers less than [`TOGETHER`] at a time as come out even.
#[inline(always)]
fn tile<S: Simd>(simd: S, plays: &mut Plays, x: &[f64], sums: &mut [S::f64s]) {
    let Plays { r, w, z, .. } = plays;
    let (r, w, z) = (S::as_simd_f64s(r).0, S::as_simd_f64s(w).0, S::as_mut_simd_f64s(z).0);
    let passes = z.len().div_ceil(TOGETHER);
    let mut first = 0;
    for pass in 0..passes {
        let count = (z.len() - first).div_ceil(passes - pass);
        let (r, w, z) = (&r[first..][..count], &w[first..][..count], &mut z[first..][..count]);
        match count {
            1 => together::<S, 1>(simd, r, w, z, x, sums),
            2 => together::<S, 2>(simd, r, w, z, x, sums),
            3 => together::<S, 3>(simd, r, w, z, x, sums),
            4 => together::<S, 4>(simd, r, w, z, x, sums),
            5 => together::<S, 5>(simd, r, w, z, x, sums),
            6 => together::<S, 6>(simd, r, w, z, x, sums),
            _ => together::<S, TOGETHER>(simd, r, w, z, x, sums),
        }
        first += count;
    }
}

/// The plays of `G` registers over a tile.
#[inline(always)]
fn together<S: Simd, const G: usize>(
    simd: S,
    r: &[S::f64s],
    w: &[S::f64s],
    z: &mut [S::f64s],
    x: &[f64],
    sums: &mut [S::f64s],
) {
    let r: [S::f64s; G] = std::array::from_fn(|g| r[g]);
    let w: [S::f64s; G] = std::array::from_fn(|g| w[g]);
    let mut now: [S::f64s; G] = std::array::from_fn(|g| z[g]);
    for (&x, sum) in x.iter().zip(sums) {
        let x = simd.splat_f64s(x);
        for g in 0..G {
            // Of a number that is none the second operand is kept.
            let low = simd.min_f64s(simd.add_f64s(x, r[g]), now[g]);
            now[g] = simd.max_f64s(simd.sub_f64s(x, r[g]), low);
            *sum = simd.mul_add_e_f64s(w[g], now[g], *sum);
        }
    }
    z.copy_from_slice(&now);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    /// One play after the other, as it is written.
    fn plain(stack: &PlayStack, x: &[f64]) -> Vec<f64> {
        let mut z = vec![0.0; stack.r.len()];
        let step = |&x: &f64| {
            let plays = z.iter_mut().zip(&stack.r).zip(&stack.w);
            let part = |((z, r), w): ((&mut f64, &f64), &f64)| {
                *z = (x - r).max((x + r).min(*z));
                w * *z
            };
            stack.offset + plays.map(part).sum::<f64>()
        };
        x.iter().map(step).collect()
    }

    fn stack(n: usize) -> PlayStack {
        let w = white(n, 7);
        PlayStack::virgin((0..n).map(|i| 0.03 * i as f64).collect(), w, -0.5)
    }

    /// Every number of plays that fills registers or does not, and records that fill tiles or do not.
    #[test]
    fn side_by_side_is_one_after_the_other() {
        for n in [1, 2, 7, 8, 9, 15, 16, 57, 64, 100, 129, 300] {
            for N in [1, 63, 64, 65, 500] {
                let mut walk = white(N, n as u64);
                (1..N).for_each(|k| walk[k] += 0.95 * walk[k - 1]);
                let stack = stack(n);
                let ours = Plays::new(&stack, &vec![0.0; n]).run(&walk);
                let theirs = plain(&stack, &walk);
                let off = ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1e-13 * n as f64, "{n} plays, {N} samples: {off}");
            }
        }
    }

    #[test]
    fn a_record_is_its_samples_to_the_last_bit() {
        let (stack, x) = (stack(100), white(200, 3));
        let (mut all, mut each) = (Plays::new(&stack, &[0.0; 100]), Plays::new(&stack, &[0.0; 100]));
        let one: Vec<f64> = x.iter().map(|&x| each.step(x)).collect();
        assert_eq!(all.run(&x), one);
        assert_eq!(all.state(), each.state());
    }

    #[test]
    fn what_is_no_number_moves_nothing() {
        let mut plays = Plays::new(&stack(20), &[0.0; 20]);
        let before = plays.step(1.0);
        assert_eq!(plays.step(f64::NAN), before);
    }
}
