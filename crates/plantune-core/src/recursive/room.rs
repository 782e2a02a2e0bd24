//! Room for the vectors of one sample.
//!
//! Where `n` is small they live on the stack, all loops over them unroll, and in the end they are registers; a
//! number written into a vector and read back as part of a pair would cost more than the arithmetic. Larger ones
//! are lent by the estimator, so that nothing is allocated.

/// Vectors of size `n`.
pub struct Room<'r> {
    /// Regressor.
    pub phi: &'r mut [f64],
    /// Gradient.
    pub psi: &'r mut [f64],
    /// On the way from one to the other.
    pub half: &'r mut [f64],
    /// `U' psi`.
    pub f: &'r mut [f64],
    /// Sums of `D_j f_j^2` up to `j`.
    pub q: &'r mut [f64],
    /// `1 / (1 + g q_j)`.
    pub inverse: &'r mut [f64],
    /// `P psi`.
    pub b: &'r mut [f64],
    /// Parameters before the sample.
    pub before: &'r mut [f64],
}

/// Vectors in it.
pub const VECTORS: usize = 8;

impl<'r> Room<'r> {
    /// Divides `VECTORS n` numbers.
    #[inline(always)]
    pub fn of(n: usize, all: &'r mut [f64]) -> Self {
        let (phi, all) = all.split_at_mut(n);
        let (psi, all) = all.split_at_mut(n);
        let (half, all) = all.split_at_mut(n);
        let (f, all) = all.split_at_mut(n);
        let (q, all) = all.split_at_mut(n);
        let (inverse, all) = all.split_at_mut(n);
        let (b, all) = all.split_at_mut(n);
        Room { phi, psi, half, f, q, inverse, b, before: &mut all[..n] }
    }
}

/// The expression, compiled for each small `n` with room on the stack, and once for any other with the room lent.
macro_rules! with_room {
    ($n:expr, $lent:expr, |$name:ident, $room:ident| $body:expr) => {
        match $n {
            1 => with_room!(small 1, $name, $room, $body),
            2 => with_room!(small 2, $name, $room, $body),
            3 => with_room!(small 3, $name, $room, $body),
            4 => with_room!(small 4, $name, $room, $body),
            5 => with_room!(small 5, $name, $room, $body),
            6 => with_room!(small 6, $name, $room, $body),
            $name => {
                let mut lent = std::mem::take(&mut $lent);
                let $room = &mut Room::of($name, &mut lent);
                let result = $body;
                $lent = lent;
                result
            }
        }
    };
    (small $size:literal, $name:ident, $room:ident, $body:expr) => {{
        let $name = $size;
        // Each its own: what keeps one of them from being registers leaves the others.
        let [mut phi, mut psi, mut half, mut f] = [[0.0; $size]; 4];
        let [mut q, mut inverse, mut b, mut before] = [[0.0; $size]; 4];
        let $room = &mut Room {
            phi: &mut phi,
            psi: &mut psi,
            half: &mut half,
            f: &mut f,
            q: &mut q,
            inverse: &mut inverse,
            b: &mut b,
            before: &mut before,
        };
        $body
    }};
}
pub(super) use with_room;
