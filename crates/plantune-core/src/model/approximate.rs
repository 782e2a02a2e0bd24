//! The dead time of a model replaced by a rational function.
//!
//! ```text
//! Taylor   e^(-L s) = 1 - L s                               source 001, (3.4-3), (3.4-4)
//! Padé     e^(-L s) = (1 - L s / 2) / (1 + L s / 2)         source 001, (3.4-5), (3.4-6)
//! ```
//!
//! Both put a zero into the right half-plane. They are here for the formulas of the source; simulations and
//! margins take the dead time as it is.

use std::borrow::Cow;

use super::{Model, TransferFunction};
use crate::error::{Error, Result};
use crate::poly::product;

/// How the dead time is treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delay {
    /// As it is.
    Exact,
    /// `(1 - L s / 2) / (1 + L s / 2)`.
    Pade,
    /// `1 - L s`.
    Taylor,
}

/// The model with its dead time treated so; only a continuous one can be approximated.
pub fn approximated(model: &Model, delay: Delay) -> Result<Cow<'_, Model>> {
    if delay == Delay::Exact {
        return Ok(Cow::Borrowed(model));
    }
    let Some(G) = model.transfer() else {
        return Err(Error::argument("delay", "an approximation", "\"exact\" for a PolyModel"));
    };
    let G = G.as_ref();
    let (above, below) = match (delay, G.L) {
        (_, 0.0) => (vec![1.0], vec![1.0]),
        (Delay::Taylor, L) => (vec![-L, 1.0], vec![1.0]),
        (_, L) => (vec![-0.5 * L, 1.0], vec![0.5 * L, 1.0]),
    };
    Ok(Cow::Owned(Model::Transfer(TransferFunction {
        num: product(&G.num, &above),
        den: product(&G.den, &below),
        L: 0.0,
    })))
}
