//! Where the oscillator stands at the first row of a record: `y, y', z` by output error over the first rows.
//!
//! A record that does not begin at rest costs 4.6e-5 m over the benchmark's multisine when taken as if it did, and
//! 3.6e-7 m with the state found. The search begins at the first displacement, the slope of a spline through the
//! displacement, and three forces.

use super::BoucWen;
use super::output_error::{OutputError, parted};
use super::spline::slopes;
use crate::error::{Error, Result};
use crate::hysteresis::misfit::rms;
use crate::linalg::minimise;

/// Rows that count, at most.
const ROWS: usize = 200;

/// Rows of the spline.
const SPLINE: usize = 20;

/// `(y, y', z)` at row 0.
pub fn initial_state(model: &BoucWen, u: &[f64], y: &[f64], Ts: f64) -> Result<[f64; 3]> {
    BoucWen { Ts: Some(Ts), ..model.clone() }.check()?;
    let N = u.len().min(y.len()).min(ROWS);
    if N < 6 {
        return Err(Error::new("X03", format!("{N} rows")).remedy("pass 6 rows or more, better 50"));
    }
    let speed = slopes(&y[..N.min(SPLINE)])[0] / Ts;
    let mut best: Option<(f64, [f64; 3])> = None;
    for z in [0.0, 1.0, -1.0] {
        let start = [y[0], speed, z * model.alpha * rms(&y[..N])];
        let mut problem = OutputError::new(&u[..N], &y[..N], Ts, model, start);
        problem.free = vec![7, 8, 9];
        let from = problem.begin();
        let Some(found) = minimise(&mut problem, from) else { continue };
        if best.is_none_or(|(cost, _)| found.cost < cost) {
            best = Some((found.cost, parted(&problem.filled(&found.theta)).1));
        }
    }
    best.map(|(_, x0)| x0).ok_or_else(|| {
        Error::new("N02", "no initial state keeps the output finite")
            .remedy("check the sample time and the units of u")
    })
}
