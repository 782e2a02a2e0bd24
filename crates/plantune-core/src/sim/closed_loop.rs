//! A first-order plant with exact dead time in a loop with a PID controller, continuous or sampled.
//!
//! Time runs on nodes `h` apart. Between nodes the plant input is taken as a straight line (a constant
//! when the controller is sampled), with jumps at nodes; the plant's answer to such an input is exact for
//! any dead time. The only approximation is the straight line, of order `h^2`.
//!
//! Source 001, 3.4 and 3.7.6, with the exact delay instead of its Taylor and Padé forms.

use crate::error::{Error, Result};
use crate::model::{Fopdt, Pid};

/// Most nodes of one simulation.
const MOST_NODES: usize = 5_000_000;

/// What the loop is asked to do; all signals are constant over steps of `dt`.
#[derive(Clone, Debug)]
pub struct ClosedLoopSettings<'s> {
    /// Length of a step of `r`, `d` and `noise`, s; the sample time of a sampled controller.
    pub dt: f64,
    /// Set point.
    pub r: &'s [f64],
    /// Disturbance at the plant input; as long as `r`.
    pub d: &'s [f64],
    /// Added to what a sampled controller reads; as long as `r`.
    pub noise: &'s [f64],
    /// `O` in `y = G u + O`.
    pub offset: f64,
    /// Input before time 0, at which the loop was in equilibrium.
    pub u0: f64,
    /// Nodes per time scale of a continuous loop; 1000 is exact to about 1e-6.
    pub fineness: f64,
}

/// Signals on all nodes, `h` apart; `u` may jump at a node.
#[derive(Clone, Debug)]
pub struct ClosedLoop {
    /// Distance of nodes, s.
    pub h: f64,
    /// Nodes per step of the settings.
    pub stride: usize,
    /// Set point from each node on.
    pub r: Vec<f64>,
    /// Plant output, without noise.
    pub y: Vec<f64>,
    /// Controller output before each node's jump.
    pub u_left: Vec<f64>,
    /// Controller output from each node on.
    pub u: Vec<f64>,
    /// Output and input before time 0.
    pub start: (f64, f64),
    /// Controller output that holds the last set point against the last disturbance.
    pub u_final: f64,
}

/// Simulates the loop over `r.len()` steps.
pub fn closed_loop(model: &Fopdt, pid: &Pid, settings: &ClosedLoopSettings) -> Result<ClosedLoop> {
    check(pid, settings)?;
    crate::model::check_fopdt(model)?;
    let stride = nodes_per_step(model, pid, settings.dt, settings.fineness)?;
    let steps = settings.r.len();
    if steps.saturating_mul(stride) > MOST_NODES {
        return Err(Error::argument(
            "t_end",
            settings.dt * steps as f64,
            "shorter: the dead time is too small a part of it",
        ));
    }
    let h = settings.dt / stride as f64;
    let nodes = steps * stride;
    let at = |x: &[f64], k: usize| x[(k / stride).min(steps - 1)];

    let y0 = model.K * settings.u0 + settings.offset;
    let mut plant = Plant::new(model, h, settings.u0, nodes);
    let mut controller = Controller::new(pid, h, y0, settings.u0);
    let mut out = ClosedLoop {
        h,
        stride,
        r: Vec::with_capacity(nodes + 1),
        y: Vec::with_capacity(nodes + 1),
        u_left: Vec::with_capacity(nodes + 1),
        u: Vec::with_capacity(nodes + 1),
        start: (y0, settings.u0),
        u_final: (at(settings.r, nodes) - settings.offset) / model.K - at(settings.d, nodes),
    };
    let mut u_left = settings.u0;
    for k in 0..=nodes {
        let (r, d) = (at(settings.r, k), at(settings.d, k));
        let y = settings.offset + plant.x;
        let u = match pid.Ts {
            Some(Ts) if k % stride == 0 && k < nodes => controller.sample(r, y + at(settings.noise, k), Ts),
            Some(_) => u_left,
            None => controller.jump(r, y),
        };
        out.r.push(r);
        out.y.push(y);
        out.u_left.push(u_left);
        out.u.push(u);
        plant.push_right(u + d);
        if k == nodes {
            break;
        }
        u_left = if pid.Ts.is_some() {
            plant.advance(u + d);
            u
        } else {
            // y(k+1) = free + gain v(k+1) and u(k+1) = open - slope y(k+1): one linear equation.
            let (free, gain) = plant.ahead();
            let (open, slope) = controller.ahead(r);
            let free = free + settings.offset;
            let next = (open - slope * (free + gain * d)) / (1.0 + slope * gain);
            plant.advance(next + d);
            controller.advance(r, settings.offset + plant.x);
            next
        };
    }
    Ok(out)
}

/// Seconds until a loop of sound settings has settled many times over.
pub fn default_horizon(model: &Fopdt, pid: &Pid) -> Result<f64> {
    crate::model::check_fopdt(model)?;
    let closed = if pid.Ki != 0.0 { 1.0 / (model.K * pid.Ki).abs() } else { 0.0 };
    Ok(12.0 * (closed + model.T / (1.0 + (model.K * pid.Kp).abs()) + model.L))
}

/// As [`default_horizon`], and until a load has died out: it decays no faster than the integral time.
///
/// The fast part of a loop decides how close the nodes lie, so a very slow recovery is cut short.
pub fn load_horizon(model: &Fopdt, pid: &Pid) -> Result<f64> {
    let settled = default_horizon(model, pid)?;
    let recovered = if pid.Ki != 0.0 { 8.0 * pid.Ti() } else { 0.0 };
    Ok(recovered.max(settled).min(50.0 * settled))
}

fn check(pid: &Pid, settings: &ClosedLoopSettings) -> Result<()> {
    pid.check()?;
    let steps = settings.r.len();
    if steps == 0 || settings.d.len() != steps || settings.noise.len() != steps {
        let lengths = format!("{steps}, {} and {} long", settings.d.len(), settings.noise.len());
        return Err(Error::argument("r, d, noise", lengths, "of the same length, at least 1"));
    }
    if !(settings.dt > 0.0 && settings.dt.is_finite()) {
        return Err(Error::argument("Ts", settings.dt, "a positive number of seconds"));
    }
    match pid.Ts {
        Some(Ts) if (Ts - settings.dt).abs() > 1e-9 * Ts => {
            Err(Error::argument("Ts", settings.dt, &format!("{Ts} s, the sample time of the controller")))
        }
        None if settings.noise.iter().any(|&n| n != 0.0) => Err(Error::argument(
            "noise",
            "given",
            "absent: a continuous controller cannot read white noise; give pid a Ts",
        )),
        None if pid.Td > 0.0 && pid.Tf == 0.0 => {
            Err(Error::argument("Tf", 0, "positive: an unfiltered derivative answers a step with an impulse"))
        }
        _ => Ok(()),
    }
}

/// Nodes so close that the straight line costs about 1e-6 of the indices.
fn nodes_per_step(model: &Fopdt, pid: &Pid, dt: f64, fineness: f64) -> Result<usize> {
    let closed = model.T / (1.0 + (model.K * pid.Kp).abs());
    let scale = if pid.Ts.is_some() {
        40.0 * model.T.min(dt)
    } else if pid.Td > 0.0 {
        closed.max(model.L).min(50.0 * pid.Tf)
    } else {
        closed.max(model.L)
    };
    let stride = (dt / (scale / fineness)).ceil().max(1.0);
    if stride < MOST_NODES as f64 {
        Ok(stride as usize)
    } else {
        Err(Error::argument("Ts", dt, &format!("closer to the loop's own time scale, {scale:.3e} s")))
    }
}

/// The plant between nodes: `T x' = K v(t - L) - x`, `v` linear between nodes.
struct Plant {
    K: f64,
    x: f64,
    node: usize,
    /// Whole nodes of delay.
    m: usize,
    /// Weight of the end value at the point where the delayed window splits an interval.
    split: f64,
    /// The piece before that node, and the piece after it.
    first: Piece,
    second: Piece,
    v_left: Vec<f64>,
    v_right: Vec<f64>,
    v0: f64,
}

/// One linear piece of input: `x <- a x + K (p begin + q end)`.
struct Piece {
    a: f64,
    begin: f64,
    end: f64,
}

impl Piece {
    fn new(length: f64, T: f64) -> Self {
        if length <= 0.0 {
            return Piece { a: 1.0, begin: 0.0, end: 0.0 };
        }
        let a = (-length / T).exp();
        let settled = -(-length / T).exp_m1();
        let end = 1.0 - settled * T / length;
        Piece { a, begin: settled - end, end }
    }
}

impl Plant {
    fn new(model: &Fopdt, h: f64, v0: f64, nodes: usize) -> Self {
        let delay = crate::model::Fraction::of(model.L, h);
        Plant {
            K: model.K,
            x: model.K * v0,
            node: 0,
            m: delay.m,
            split: (h - delay.f) / h,
            first: Piece::new(delay.f, model.T),
            second: Piece::new(h - delay.f, model.T),
            v_left: vec![v0],
            v_right: Vec::with_capacity(nodes + 1),
            v0,
        }
    }

    fn push_right(&mut self, v: f64) {
        self.v_right.push(v);
    }

    fn left(&self, node: isize) -> f64 {
        if node < 0 { self.v0 } else { self.v_left[node as usize] }
    }

    fn right(&self, node: isize) -> f64 {
        if node < 0 { self.v0 } else { self.v_right[node as usize] }
    }

    /// `x` at the next node as `free + gain v(next)`; the gain is zero once the delay exceeds a node.
    fn ahead(&self) -> (f64, f64) {
        let j = self.node as isize - self.m as isize;
        let mix = |begin: f64, end: f64| begin + self.split * (end - begin);
        let x = self.first.a * self.x
            + self.K
                * (self.first.begin * mix(self.right(j - 1), self.left(j)) + self.first.end * self.left(j));
        let begin = self.right(j);
        let known = self.second.a * x + self.K * self.second.begin * begin;
        if self.m == 0 {
            let free = known + self.K * self.second.end * (1.0 - self.split) * begin;
            (free, self.K * self.second.end * self.split)
        } else {
            (known + self.K * self.second.end * mix(begin, self.left(j + 1)), 0.0)
        }
    }

    /// Moves to the next node, where the input arrives at `v`.
    fn advance(&mut self, v: f64) {
        let (free, gain) = self.ahead();
        self.x = free + gain * v;
        self.v_left.push(v);
        self.node += 1;
    }
}

/// The controller's memory: integral and derivative filter.
struct Controller<'p> {
    pid: &'p Pid,
    h: f64,
    integral: f64,
    filtered: f64,
    /// Error and filter input just after the last node.
    e: f64,
    w: f64,
    filter: Piece,
}

impl<'p> Controller<'p> {
    fn new(pid: &'p Pid, h: f64, y0: f64, u0: f64) -> Self {
        let w = (pid.c - 1.0) * y0;
        let filter = if pid.Tf > 0.0 { Piece::new(h, pid.Tf) } else { Piece::new(0.0, 1.0) };
        Controller { pid, h, integral: u0 - pid.Kp * (pid.b - 1.0) * y0, filtered: w, e: 0.0, w, filter }
    }

    fn derivative_gain(&self) -> f64 {
        if self.pid.Td > 0.0 { self.pid.Kp * self.pid.Td / self.pid.Tf } else { 0.0 }
    }

    /// Output just after a node, at which `r` may have jumped.
    fn jump(&mut self, r: f64, y: f64) -> f64 {
        self.e = r - y;
        self.w = self.pid.c * r - y;
        self.pid.Kp * (self.pid.b * r - y) + self.integral + self.derivative_gain() * (self.w - self.filtered)
    }

    /// Output at the next node as `open - slope y`, `r` unchanged.
    fn ahead(&self, r: f64) -> (f64, f64) {
        let (Kp, Ki, b, c) = (self.pid.Kp, self.pid.Ki, self.pid.b, self.pid.c);
        let half = 0.5 * self.h * Ki;
        let D = self.derivative_gain();
        let open = Kp * b * r
            + self.integral
            + half * (self.e + r)
            + D * (c * r * (1.0 - self.filter.end)
                - self.filter.a * self.filtered
                - self.filter.begin * self.w);
        (open, Kp + half + D * (1.0 - self.filter.end))
    }

    fn advance(&mut self, r: f64, y: f64) {
        self.integral += 0.5 * self.h * self.pid.Ki * (self.e + r - y);
        let w = self.pid.c * r - y;
        self.filtered = self.filter.a * self.filtered + self.filter.begin * self.w + self.filter.end * w;
    }

    /// Backward Euler, once per sample.
    fn sample(&mut self, r: f64, y: f64, Ts: f64) -> f64 {
        self.integral += self.pid.Ki * Ts * (r - y);
        let w = self.pid.c * r - y;
        let derivative = self.pid.Kp * self.pid.Td / (self.pid.Tf + Ts) * (w - self.filtered);
        self.filtered += Ts / (self.pid.Tf + Ts) * (w - self.filtered);
        self.pid.Kp * (self.pid.b * r - y) + self.integral + derivative
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(model: &Fopdt, pid: &Pid, dt: f64, r: &[f64], offset: f64, u0: f64) -> ClosedLoop {
        let zero = vec![0.0; r.len()];
        let settings = ClosedLoopSettings { dt, r, d: &zero, noise: &zero, offset, u0, fineness: 1000.0 };
        closed_loop(model, pid, &settings).expect("a sound loop")
    }

    /// With `Ti = T` the loop is `k e^(-L s) / s`: `y' = k (1 - y(t - L))`, solved step by step in `L`.
    #[test]
    fn an_integrating_loop_follows_the_method_of_steps() {
        let (model, k) = (Fopdt { K: -2.0, T: 3.0, L: 1.0 }, 0.6);
        let response = run(&model, &Pid::pi(k * model.T / model.K, model.T), 0.01, &[1.0; 400], 0.0, 0.0);
        for (j, y) in response.y.iter().enumerate() {
            let t = j as f64 * response.h;
            let ramp = |lags: f64| (t - lags).max(0.0);
            let exact =
                k * ramp(1.0) - k.powi(2) * ramp(2.0).powi(2) / 2.0 + k.powi(3) * ramp(3.0).powi(3) / 6.0;
            // The straight line between nodes costs h^2.
            assert!((y - exact).abs() < 1e-6, "t = {t}: {y} {exact}");
        }
    }

    #[test]
    fn a_loop_in_equilibrium_stays_there() {
        let model = Fopdt { K: -5.939, T: 0.1491, L: 0.107 };
        let (offset, u0) = (583.451, 30.9);
        let r = [model.K * u0 + offset; 50];
        for Ts in [None, Some(0.02)] {
            let pid = Pid { Ts, ..Pid::pi(-0.13, 0.15) };
            let response = run(&model, &pid, 0.02, &r, offset, u0);
            assert!(response.y.iter().all(|y| (y - r[0]).abs() < 1e-10), "{Ts:?}");
            assert!(response.u.iter().all(|u| (u - u0).abs() < 1e-10), "{Ts:?}");
        }
    }

    /// Plant and controller as two recursions by hand, the delay one sample and a half.
    #[test]
    fn a_sampled_loop_is_the_difference_equation_at_the_samples() {
        let (Ts, Kp, Ti) = (0.2, 0.8, 1.5);
        let model = Fopdt { K: 1.5, T: 1.0, L: 0.3 };
        let pid = Pid { Ts: Some(Ts), ..Pid::pi(Kp, Ti) };
        let response = run(&model, &pid, Ts, &[1.0; 40], 0.0, 0.0);
        let (a, b1, b2, m) = model.sampled(Ts);
        let (mut y, mut u, mut integral) = (vec![0.0], Vec::<f64>::new(), 0.0);
        for k in 0..40 {
            integral += Kp / Ti * Ts * (1.0 - y[k]);
            u.push(Kp * (1.0 - y[k]) + integral);
            let before = |lag: usize| if k >= lag { u[k - lag] } else { 0.0 };
            y.push(a * y[k] + b1 * before(m) + b2 * before(m + 1));
        }
        for (k, y) in y.iter().enumerate() {
            let ours = response.y[k * response.stride];
            assert!((ours - y).abs() < 1e-12, "row {k}: {ours} {y}");
        }
    }

    /// A disturbance at the plant input that is there from the start is what `u0` plus itself would be.
    #[test]
    fn integral_action_removes_an_input_disturbance() {
        let model = Fopdt { K: 2.0, T: 1.0, L: 0.2 };
        let (r, d) = (vec![0.0; 3000], vec![0.7; 3000]);
        let settings =
            ClosedLoopSettings { dt: 0.01, r: &r, d: &d, noise: &r, offset: 0.0, u0: 0.0, fineness: 1000.0 };
        let response = closed_loop(&model, &Pid::pi(1.0, 1.0), &settings).expect("a sound loop");
        let last = response.y.len() - 1;
        assert_eq!(response.u_final, -0.7);
        assert!(response.y[last].abs() < 1e-9 && (response.u[last] + 0.7).abs() < 1e-9);
    }
}
