//! The closed loop as transfer functions.
//!
//! ```text
//! Y/R = C_r G / (1 + C G)    Y/P = G / (1 + C G)      Y/D = 1 / (1 + C G)       (3.4-9)
//! U/R = C_r / (1 + C G)                               U/D = -C / (1 + C G)      (3.4-10)
//! E/R = 1 - Y/R                                                                 (3.4-11)
//! ```
//!
//! `P` is added to the plant's input, `D` to its output; `C_r` is the controller as the set point meets it,
//! with its weights `b` and `c`: with `b = c = 1` it is `C`, and the forms are (3.4-12) to (3.4-17) of source
//! 001, as corrected, when the dead time is replaced by its Taylor or Padé form.

use crate::error::{Error, Result};
use crate::model::{Delay, Model, Pid, TransferFunction, approximated, weighted};
use crate::poly::product;

/// From set point, load and output disturbance to output, controller output and error.
pub struct ClosedLoopTransfers {
    /// Set point to output.
    pub y_r: TransferFunction,
    /// Set point to controller output.
    pub u_r: TransferFunction,
    /// Set point to error.
    pub e_r: TransferFunction,
    /// Load at the plant input to output.
    pub y_p: TransferFunction,
    /// Disturbance at the plant output to output.
    pub y_d: TransferFunction,
    /// Disturbance at the plant output to controller output.
    pub u_d: TransferFunction,
}

/// Of a continuous loop whose dead time is replaced by a rational function, or is none.
pub fn closed_loop_transfers(model: &Model, pid: &Pid, delay: Delay) -> Result<ClosedLoopTransfers> {
    pid.check()?;
    model.check()?;
    if pid.Ts.is_some() {
        return Err(Error::argument("pid", "sampled", "continuous (Ts=None)"));
    }
    let model = approximated(model, delay)?;
    let Some(G) = model.transfer() else {
        return Err(Error::argument("model", "a PolyModel", "a ProcessModel or TransferFunction"));
    };
    if G.L > 0.0 {
        return Err(Error::argument(
            "delay",
            "\"exact\"",
            "\"pade\" or \"taylor\" where there is a dead time",
        )
        .remedy("simulate.step and tune.sensitivities take the dead time as it is"));
    }
    let (C, C_r) = (pid.transfer(), pid.set_point_transfer());
    let closed = weighted([(1.0, &product(&C.den, &G.den)), (1.0, &product(&C.num, &G.num))]);
    let of = |num: Vec<f64>| TransferFunction { num, den: closed.clone(), L: 0.0 };
    let y_r = product(&C_r.num, &G.num);
    Ok(ClosedLoopTransfers {
        e_r: of(weighted([(1.0, &closed), (-1.0, &y_r)])),
        y_r: of(y_r),
        u_r: of(product(&C_r.num, &G.den)),
        y_p: of(product(&C.den, &G.num)),
        y_d: of(product(&C.den, &G.den)),
        u_d: of(weighted([(-1.0, &product(&C.num, &G.den))])),
    })
}
