//! The weighted block whose singular values show the order.
//!
//! ```text
//! Wp = [Up; Yp]
//! MOESP   L32                       Yf on Wp, both without Uf                  Verhaegen 1994
//! N4SID   L32 L22^+ [L21 L22]       Yf on Wp along Uf (oblique)                Van Overschee, De Moor 1994
//! CVA     W1 L32,  W1 = (L32 L32' + L33 L33')^-1/2                             Larimore 1990
//! ```

use super::data::Factor;
use crate::linalg::{Matrix, left_singular, over_triangle, symmetric_powers};

/// Which weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Past and output without the future input.
    Moesp,
    /// Oblique projection along the future input.
    N4sid,
    /// Canonical variates.
    Cva,
}

/// Singular vectors and values of the weighted block.
pub struct Weighted {
    /// `W1`; the identity where there is none.
    pub W1: Option<Matrix>,
    /// `W1^-1`.
    pub back: Option<Matrix>,
    /// Left singular vectors.
    pub U: Matrix,
    /// Singular values.
    pub S: Vec<f64>,
}

/// What lies below this share of the largest singular value of the past is rounding.
pub const TOLERANCE: f64 = 1e-12;
/// Smallest share of an eigenvalue that CVA divides by.
const FLOOR: f64 = 1e-14;

/// The block of one method.
pub fn weighted(factor: &Factor, method: Method) -> Weighted {
    let (a, b, all) = (factor.future(), factor.known(), factor.all());
    let L32 = factor.block(b..all, a..b);
    match method {
        Method::Moesp => plain(L32),
        Method::N4sid => {
            let past = factor.block(a..b, 0..b);
            plain(over_triangle(&L32, &factor.block(a..b, a..b), TOLERANCE) * past)
        }
        Method::Cva => {
            let L33 = factor.block(b..all, b..all);
            let future = &L32 * L32.transpose() + &L33 * L33.transpose();
            let [W1, back] = symmetric_powers(&future, [-0.5, 0.5], FLOOR);
            let (U, S) = left_singular(&(&W1 * L32));
            Weighted { W1: Some(W1), back: Some(back), U, S }
        }
    }
}

fn plain(block: Matrix) -> Weighted {
    let (U, S) = left_singular(&block);
    Weighted { W1: None, back: None, U, S }
}
