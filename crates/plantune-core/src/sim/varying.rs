//! A first-order plant whose parameters change from row to row.
//!
//! ```text
//! a1(k) = e^(-Ts/T(k)),   b1(k) = K(k) (1 - a1(k))
//! yD(k) = a1(k) yD(k-1) + b1(k) u(k - 1 - L(k)/Ts),   y(k) = yD(k) + O(k)
//! ```
//!
//! Source 001, (3.7-20) to (3.7-23), with the delay as ERRATA 3.1 puts it right; a fraction of a sample is
//! split as in [`crate::model::Fopdt`], so that constant parameters are that plant. Within a sample the
//! parameters are those of its end, and the offset that of its beginning.

use super::indices::Watch;
use super::live::LivePlant;
use super::plant::Plant;
use crate::error::{Error, Result};
use crate::model::{Fopdt, check_fopdt};

/// Parameters of every row; one value stands for all rows.
#[derive(Clone, Debug)]
pub struct Varying<'s> {
    /// Static gain.
    pub K: &'s [f64],
    /// Time constant, s.
    pub T: &'s [f64],
    /// Dead time, s.
    pub L: &'s [f64],
    /// `O` in `y = G u + O`.
    pub offset: &'s [f64],
}

impl Varying<'_> {
    /// Parameters of a row; the last row goes on.
    pub fn at(&self, row: usize) -> (Fopdt, f64) {
        let of = |x: &[f64]| x[row.min(x.len() - 1)];
        (Fopdt { K: of(self.K), T: of(self.T), L: of(self.L) }, of(self.offset))
    }

    /// Refuses what is no plant in some row, or not `rows` long.
    pub fn check(&self, rows: usize) -> Result<()> {
        for (name, x) in [("K", self.K), ("T", self.T), ("L", self.L), ("offset", self.offset)] {
            if x.len() != rows && x.len() != 1 {
                let needed = format!("one value, or {rows} of them, one per row");
                return Err(Error::argument(name, format!("{} long", x.len()), &needed));
            }
            if x.iter().any(|x| !x.is_finite()) {
                return Err(Error::argument(name, "not finite", "finite in every row"));
            }
        }
        (0..rows).try_for_each(|row| check_fopdt(&self.at(row).0))
    }

    /// Output for the input `u`, row by row, from rest at `u0`.
    pub fn simulate(&self, u: &[f64], Ts: f64, u0: f64) -> Result<Vec<f64>> {
        if u.iter().any(|u| !u.is_finite()) {
            return Err(Error::argument("u", "not finite", "finite"));
        }
        let mut plant = VaryingPlant::new(self, u.len(), Ts, u0)?;
        let now = plant.output();
        Ok(u.iter().scan(now, |y, &u| Some(std::mem::replace(y, plant.step(u)))).collect())
    }
}

/// Such a plant, one sample at a time.
#[derive(Clone, Debug)]
pub struct VaryingPlant<'s> {
    parameters: &'s Varying<'s>,
    row: usize,
    plant: LivePlant,
}

impl<'s> VaryingPlant<'s> {
    /// At rest at the input `u0` under the parameters of row 0.
    pub fn new(parameters: &'s Varying<'s>, rows: usize, Ts: f64, u0: f64) -> Result<Self> {
        parameters.check(rows)?;
        let longest = parameters.L.iter().copied().fold(0.0, f64::max);
        let (first, offset) = parameters.at(0);
        Ok(VaryingPlant { parameters, row: 0, plant: LivePlant::new(&first, offset, longest, Ts, u0)? })
    }

    /// Holds the input at `v` for a sample and returns the output at the next one. Allocates nothing.
    pub fn step(&mut self, v: f64) -> f64 {
        self.run(v, &mut ());
        self.output()
    }
}

impl Plant for VaryingPlant<'_> {
    fn output(&self) -> f64 {
        self.plant.output()
    }

    fn run(&mut self, v: f64, watch: &mut impl Watch) {
        self.row += 1;
        let (plant, offset) = self.parameters.at(self.row);
        self.plant.set_model(plant);
        self.plant.run(v, watch);
        self.plant.set_offset(offset);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_parameters_are_the_first_order_plant() {
        let u: Vec<f64> = (0..120).map(|k| f64::from(k / 7 * 37 % 11)).collect();
        for L in [0.0, 0.013, 0.1, 0.107] {
            let plant = Varying { K: &[-5.939], T: &[0.1491], L: &[L], offset: &[3.0] };
            let y = plant.simulate(&u, 0.02, 0.0).expect("a simulation");
            let known = Fopdt { K: -5.939, T: 0.1491, L }.simulate(&u, 0.02, 0.0);
            assert!(y.iter().zip(&known).all(|(y, x)| (y - 3.0 - x).abs() < 1e-11), "{L}");
        }
    }

    #[test]
    fn rows_that_are_no_plant_are_refused() {
        let T = [1.0, 1.0, -1.0];
        let plant = Varying { K: &[1.0], T: &T, L: &[0.0], offset: &[0.0] };
        assert_eq!(plant.simulate(&[0.0; 3], 0.1, 0.0).expect_err("T < 0").code(), "M12");
        assert_eq!(plant.simulate(&[0.0; 4], 0.1, 0.0).expect_err("three rows").code(), "U01");
    }
}
