//! What cannot be read is simulated.
//!
//! ```text
//! y(k) = G u + O     from the inputs before sample k, where y is not read
//! u(k) = C(r(k), y(k))                                 where u is not read
//! ```
//!
//! What is read is taken as it is, and the simulation goes along: while y is read, O is what makes the plant
//! agree with the last reading, and while u is read, the controller is in manual at it. So what stops being
//! read goes on from where it was. Source 001, figure 3.7-1, 3.7.2 and 3.7.6.

use crate::error::{Error, Result};
use crate::model::{Fopdt, Pid};
use crate::sim::{LivePlant, LiveSettings, SampledPid};

/// The signals of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filled {
    /// Set point; none where it is not read.
    pub r: Option<f64>,
    /// Input from this sample on.
    pub u: f64,
    /// Output at this sample.
    pub y: f64,
}

/// Simulates what is missing, sample by sample.
///
/// ```
/// use plantune_core::adapt::Fill;
/// use plantune_core::model::{Fopdt, Pid};
/// use plantune_core::sim::LiveSettings;
///
/// let plant = Fopdt { K: 2.0, T: 1.0, L: 0.0 };
/// let mut fill = Fill::new(Some((plant, 0.0)), Some(Pid::pi(0.5, 1.0)), LiveSettings::new(0.1))?;
/// assert_eq!(fill.step(Some(1.0), None, None)?.u, 0.55); // all simulated
/// assert_eq!(fill.step(Some(1.0), Some(0.7), Some(0.2))?.u, 0.7); // all read
/// assert!(fill.step(Some(1.0), Some(0.7), None)?.y > 0.2); // from the last reading on
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Fill {
    plant: Option<LivePlant>,
    pid: Option<Pid>,
    settings: LiveSettings,
    controller: Option<SampledPid>,
    /// The input since the last sample; none before the first.
    u: Option<f64>,
}

impl Fill {
    /// With what is known of the plant, `G` and `O`, and of the controller; what is never missing may be unknown.
    ///
    /// `settings.u0` is the first input where that is not read, and the plant is at rest at the first input.
    pub fn new(plant: Option<(Fopdt, f64)>, pid: Option<Pid>, settings: LiveSettings) -> Result<Self> {
        let LiveSettings { Ts, longest, u0, .. } = settings;
        if !(Ts > 0.0 && Ts.is_finite()) {
            return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
        }
        settings.actuator.check(u0)?;
        settings.anti_windup.check(Some(Ts))?;
        pid.map_or(Ok(()), |pid| pid.check())?;
        let plant = plant.map(|(model, O)| LivePlant::new(&model, O, longest, Ts, u0)).transpose()?;
        Ok(Fill { plant, pid, settings, controller: None, u: None })
    }

    /// Takes what was read at a sample, and returns it with what was not.
    ///
    /// A number that is not finite counts as not read. Allocates nothing. Refuses a missing y without a plant,
    /// and a missing u without a controller or without a set point.
    pub fn step(&mut self, r: Option<f64>, u: Option<f64>, y: Option<f64>) -> Result<Filled> {
        let [r, u, y] = [r, u, y].map(|x| x.filter(|x| x.is_finite()));
        if y.is_none() && self.plant.is_none() {
            return Err(Error::argument("y", "not read", "read, or simulated: give a model"));
        }
        if u.is_none() && (self.pid.is_none() || r.is_none()) {
            return Err(Error::argument("u", "not read", "read, or simulated: give a controller and r"));
        }
        let y = self.output(u, y);
        let u = self.input(r, u, y);
        self.u = Some(u);
        Ok(Filled { r, u, y })
    }

    /// Another `G` and `O`; the output goes on from where it is.
    pub fn set_plant(&mut self, model: &Fopdt, O: f64) -> Result<()> {
        let Some(plant) = &mut self.plant else {
            let needed = "absent: no plant is simulated here";
            return Err(Error::argument("model", "given", needed));
        };
        let y = plant.output();
        plant.set(model, O)?;
        plant.move_to(y);
        Ok(())
    }

    /// Other controller settings, without a bump.
    pub fn set_controller(&mut self, pid: &Pid) -> Result<()> {
        pid.check()?;
        self.pid = Some(*pid);
        if let Some(controller) = &mut self.controller {
            controller.set(pid);
        }
        Ok(())
    }

    /// Brings the plant to this sample.
    fn output(&mut self, u: Option<f64>, y: Option<f64>) -> f64 {
        let Some(plant) = &mut self.plant else { return y.unwrap_or(f64::NAN) };
        match self.u {
            Some(before) => plant.step(before),
            None => plant.rest(u.unwrap_or(self.settings.u0)),
        };
        if let Some(y) = y {
            plant.agree(y);
        }
        plant.output()
    }

    fn input(&mut self, r: Option<f64>, u: Option<f64>, y: f64) -> f64 {
        let Some(pid) = self.pid else { return u.unwrap_or(f64::NAN) };
        let LiveSettings { Ts, u0, actuator, anti_windup, .. } = self.settings;
        let rest = || SampledPid::new(&pid, Ts, actuator, anti_windup, y, u.unwrap_or(u0));
        let controller = self.controller.get_or_insert_with(rest);
        match u {
            Some(u) => {
                controller.hold(r.unwrap_or(y), y, 0.0, u);
                u
            }
            None => controller.step(r.unwrap_or(y), y, 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::sim::LiveLoop;

    const PLANT: Fopdt = Fopdt { K: -5.939, T: 0.1491, L: 0.107 };
    const O: f64 = 583.451;

    fn pid() -> Pid {
        Pid::pi(-0.1315, 0.1491)
    }

    fn settings() -> LiveSettings {
        LiveSettings { u0: 30.0, ..LiveSettings::new(0.02) }
    }

    /// The loop that all readings come from.
    fn truth() -> LiveLoop {
        LiveLoop::new(&PLANT, O, &pid(), settings()).expect("a loop")
    }

    /// With the true plant and controller, whatever is simulated is what would have been read.
    #[test]
    fn what_is_simulated_is_what_would_have_been_read() {
        for missing in 0..4 {
            let (mut live, r) = (truth(), white(200, 3));
            let mut fill = Fill::new(Some((PLANT, O)), Some(pid()), settings()).expect("sound");
            // The first input that is read is the one at which the loop rests.
            let of = |k: usize| O + PLANT.K * 30.0 + if k == 0 { 0.0 } else { r[k] };
            for (k, r) in (0..r.len()).map(of).enumerate() {
                let (u, y) = live.step(r, 0.0).expect("sound");
                // Now and then all is read, as a link that comes back.
                let read = |bit: usize, x: f64| (missing & bit == 0 || k % 40 > 30).then_some(x);
                let filled = fill.step(Some(r), read(1, u), read(2, y)).expect("sound");
                assert!((filled.u - u).abs() < 1e-9 && (filled.y - y).abs() < 1e-9, "{missing} {k}");
            }
        }
    }

    #[test]
    fn what_is_read_is_taken_as_it_is() {
        let mut fill = Fill::new(None, None, settings()).expect("sound");
        let filled = fill.step(None, Some(3.0), Some(4.0)).expect("sound");
        assert_eq!(filled, Filled { r: None, u: 3.0, y: 4.0 });
        assert_eq!(fill.step(Some(1.0), None, Some(4.0)).expect_err("no controller").code(), "U01");
        assert_eq!(fill.step(Some(1.0), Some(3.0), Some(f64::NAN)).expect_err("no plant").code(), "U01");
        assert_eq!(fill.set_plant(&PLANT, O).expect_err("no plant").code(), "U01");
        let mut fill = Fill::new(None, Some(pid()), settings()).expect("sound");
        assert_eq!(fill.step(None, None, Some(4.0)).expect_err("no set point").code(), "U01");
    }

    #[test]
    fn new_settings_bring_no_bump() {
        let mut fill = Fill::new(Some((PLANT, O)), Some(pid()), settings()).expect("sound");
        let rest = O + PLANT.K * 30.0;
        for k in 0..20 {
            let filled = fill.step(Some(rest), None, None).expect("sound");
            assert!((filled.u - 30.0).abs() < 1e-9 && (filled.y - rest).abs() < 1e-9, "{k}");
            if k == 10 {
                fill.set_controller(&Pid::pi(-0.05, 0.3)).expect("sound");
                let other = Fopdt { K: -4.0, T: 0.2, L: 0.09 };
                fill.set_plant(&other, rest + 4.0 * 30.0).expect("sound");
            }
        }
    }
}
