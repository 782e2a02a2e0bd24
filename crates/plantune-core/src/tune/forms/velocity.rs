//! Velocity (incremental) form of a sampled controller, backward Euler, from the error `e`:
//!
//! ```text
//! C(z) = (q0 + q1 z^-1 + q2 z^-2) / ((1 - z^-1)(1 - d z^-1)),   d = Tf / (Tf + Ts)
//!
//! q0 = Kp + Ki Ts + h,   q1 = -(1 + d) Kp - d Ki Ts - 2 h,   q2 = d Kp + h,   h = Kd / (Tf + Ts)
//! ```
//!
//! The positional algorithm keeps the sum itself; both give the same output until one of them is limited.
//! Back: `q0 + q1 + q2 = (1 - d) Ki Ts` and `q1 + 2 q2 = -(1 - d) Kp - d Ki Ts`.

use super::Settings;
use crate::error::{Error, Result};
use crate::model::{Filter, Pid};

/// `q0 q1 q2 d` of a sampled controller.
pub fn of_pid(pid: &Pid) -> Result<Settings> {
    let Ts = sample_time(pid)?;
    let Tf = if pid.Kd() == 0.0 { 0.0 } else { pid.Tf };
    let (Kp, each, d, h) = (pid.Kp, pid.Ki * Ts, Tf / (Tf + Ts), pid.Kd() / (Tf + Ts));
    Ok([Kp + each + h, -(1.0 + d) * Kp - d * each - 2.0 * h, d * Kp + h, d])
}

/// The controller of `q0 q1 q2 d`, at the sample time of `rest`.
pub fn to_pid([q0, q1, q2, d]: Settings, rest: &Pid) -> Result<Pid> {
    let Ts = sample_time(rest)?;
    // What cancels to the last bits is no integral, and no derivative.
    let size = 4.0 * f64::EPSILON * (q0.abs() + q1.abs() + q2.abs());
    let cut = |x: f64| if x.abs() <= size { 0.0 } else { x };
    let each = cut(q0 + q1 + q2) / (1.0 - d);
    let Kp = cut(-(q1 + 2.0 * q2) - d * each) / (1.0 - d);
    let h = cut(q2 - d * Kp);
    let Tf = d * Ts / (1.0 - d);
    if Kp == 0.0 && h != 0.0 {
        return Err(Error::argument(
            "q",
            "of no proportional gain",
            "those of a PID: D does not stand alone",
        ));
    }
    let Td = if h == 0.0 { 0.0 } else { h * (Tf + Ts) / Kp };
    Ok(Pid { Kp, Ki: each / Ts, Td, Tf, ..*rest })
}

fn sample_time(pid: &Pid) -> Result<f64> {
    if pid.filter == Filter::Y2 {
        let needed = "\"d1\": the filter on y stands before the increments";
        return Err(Error::argument("filter", "\"y2\"", needed));
    }
    pid.Ts.ok_or_else(|| Error::argument("Ts", "missing", "given: increments belong to a sampled controller"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::Complex;

    #[test]
    fn the_increments_are_the_sampled_controller() {
        let pid = Pid { Td: 0.7, Tf: 0.2, Ts: Some(0.1), ..Pid::pi(-2.0, 3.0) };
        let [q0, q1, q2, d] = of_pid(&pid).expect("increments");
        for w in [0.01, 1.0, 20.0] {
            let q = Complex::from_polar(1.0, -w * 0.1);
            let C = (q * (q * q2 + q1) + q0) / ((-q + 1.0) * (-q * d + 1.0));
            assert!((C / pid.freqresp(w) - 1.0).norm() < 1e-12);
        }
        let back = to_pid([q0, q1, q2, d], &pid).expect("a controller");
        for (a, b) in [(back.Kp, pid.Kp), (back.Ki, pid.Ki), (back.Td, pid.Td), (back.Tf, pid.Tf)] {
            assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn a_proportional_controller_stays_one() {
        let p = Pid { Ki: 0.0, Ts: Some(0.3), ..Pid::pi(0.7, 1.0) };
        assert_eq!(to_pid(of_pid(&p).expect("increments"), &p).expect("a controller"), p);
    }
}
