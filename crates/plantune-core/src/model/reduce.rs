//! Balanced truncation of a stable sampled model.
//!
//! ```text
//! P = A P A' + B B',  Q = A' Q A + C' C,   P = Lp Lp',  Q = Lq Lq',   Lq' Lp = U diag(h) V'
//! T = Lp V_1 h_1^-1/2,  T^+ = h_1^-1/2 U_1' Lq':   A_r = T^+ A T, B_r = T^+ B, C_r = C T
//! max_w |G - G_r| <= 2 (h_(r+1) + … + h_n)
//! ```
//!
//! Moore 1981; Al-Saggaf and Franklin 1987 for the bound in discrete time; Laub et al. 1987 for the factors.

use super::StateSpace;
use crate::error::{Error, Result};
use crate::linalg::{Matrix, Svd, lyapunov, svd, symmetric_powers};

/// A model of fewer states, and what was cut off.
pub struct Reduced {
    /// The model.
    pub model: StateSpace,
    /// Hankel singular values of the whole model, falling.
    pub hankel: Vec<f64>,
    /// Bound on the largest singular value of the error at any frequency.
    pub bound: f64,
}

/// Keeps `r` states.
pub fn reduce(model: &StateSpace, r: usize) -> Result<Reduced> {
    if model.Ts.is_none() {
        return Err(Error::argument("model", "in continuous time", "a sampled one; c2d gives one"));
    }
    if r == 0 || r > model.n() {
        return Err(Error::argument("n", r, &format!("from 1 to {}, the states of the model", model.n())));
    }
    let unstable = || {
        let poles = model.poles();
        let out = poles.iter().filter(|p| p.0.hypot(p.1) >= 1.0 - 1e-12).count();
        Error::new(
            "M02",
            format!("{out} of {} poles on or outside the unit circle have no Gramian", model.n()),
        )
        .count(out)
        .measured(1.0 + model.margin(), 1.0)
        .remedy("reduce the stable part alone, or fit a model of lower order")
    };
    if model.margin() >= -1e-12 {
        return Err(unstable());
    }
    let reached = lyapunov(&model.A, &(&model.B * model.B.transpose())).ok_or_else(unstable)?;
    let seen = lyapunov(&model.A.transpose(), &model.C.tr_mul(&model.C)).ok_or_else(unstable)?;
    // Any factors serve, here the symmetric roots.
    let ([Lp], [Lq]) = (symmetric_powers(&reached, [0.5], 0.0), symmetric_powers(&seen, [0.5], 0.0));
    let Svd { U, S, Vt } = svd(&Lq.tr_mul(&Lp));
    let kept = S.iter().take(r).take_while(|h| **h > 1e-14 * S[0]).count();
    let scale =
        Matrix::from_diagonal(&S.iter().take(kept).map(|h| h.powf(-0.5)).collect::<Vec<f64>>().into());
    let T = Lp * Vt.rows(0, kept).transpose() * &scale;
    let inverse = scale * U.columns(0, kept).transpose() * Lq.transpose();
    Ok(Reduced {
        model: StateSpace {
            A: &inverse * &model.A * &T,
            B: &inverse * &model.B,
            C: &model.C * &T,
            D: model.D.clone(),
            K: &inverse * &model.K,
            Ts: model.Ts,
        },
        bound: 2.0 * S[kept..].iter().sum::<f64>(),
        hankel: S,
    })
}
