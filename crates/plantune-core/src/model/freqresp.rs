//! A frequency response as it was measured: `G(w_k)` of every output from every input, each in a disc.
//!
//! ```text
//! error = G^ - G, circular: E |error|^2 = sd^2, so |error|^2 / sd^2 has the law of exp(1)
//! 95 %:  |error| <= radius = sd sqrt(ln 20)
//! |G| - radius <= |G_true| <= |G| + radius,   |arg G_true - arg G| <= asin(radius / |G|)
//! distance of a model = |G_model - G| / radius: at most 1 inside the disc
//! ```
//!
//! With a sample time `G` belongs to the sampled plant behind a zero-order hold, `G(e^(j w Ts))`, which is what a
//! record shows; without one to `G(j w)`.

use std::f64::consts::PI;

use super::{Model, sampled};
use crate::error::{Error, Result};
use crate::linalg::Complex;
use crate::note::Place;

/// What the 95 % disc is wider than one standard deviation: `sqrt(ln 20)`.
pub fn disc() -> f64 {
    20.0f64.ln().sqrt()
}

/// Points of a frequency response. Checked when made; see [`FrequencyResponse::checked`].
#[derive(Clone, Debug)]
pub struct FrequencyResponse {
    /// Frequencies, rad/s, ascending.
    pub w: Vec<f64>, // (n)
    /// Response of output `i` from input `j` at `w[k]`: `G[(k ny + i) nu + j]`.
    pub G: Vec<Complex<f64>>, // (n, ny, nu)
    /// Radius of the 95 % disc of each; infinite where nothing is known.
    pub radius: Option<Vec<f64>>, // (n, ny, nu)
    /// Number of outputs.
    pub ny: usize,
    /// Number of inputs.
    pub nu: usize,
    /// Sample time, s, of a sampled plant.
    pub Ts: Option<f64>,
}

/// Magnitude, and phase in degrees without jumps, each with the ends of its 95 % band.
#[derive(Clone, Debug)]
pub struct Bode {
    /// `|G|`, low, high.
    pub magnitude: [Vec<f64>; 3],
    /// `arg G`, low, high, degrees.
    pub phase: [Vec<f64>; 3],
}

impl FrequencyResponse {
    /// The same, if its frequencies ascend up to half the sampling rate and its numbers are finite.
    pub fn checked(self) -> Result<Self> {
        let wrong = |came: String, needed: &str| Err(Error::argument("w", came, needed));
        if let Some(k) = (1..self.w.len()).find(|&k| !(self.w[k] > self.w[k - 1])) {
            return wrong(format!("{} behind {}", self.w[k], self.w[k - 1]), "ascending");
        }
        match (self.w.first(), self.w.last()) {
            (Some(low), Some(high)) if *low >= 0.0 && high.is_finite() => {}
            (Some(low), Some(high)) => {
                return wrong(format!("from {low} to {high}"), "zero or positive, and finite");
            }
            _ => return wrong("empty".to_owned(), "at least one frequency"),
        }
        self.check_Ts()?;
        if let Some(at) = self.G.iter().position(|g| !(g.re.is_finite() && g.im.is_finite())) {
            let k = at / (self.ny * self.nu);
            let missing = self.G[at].re.is_nan() || self.G[at].im.is_nan();
            let (code, what) = if missing { ("D07", "missing (NaN)") } else { ("D08", "infinite") };
            return Err(Error::new(code, format!("`G` is {what} at {} rad/s", self.w[k]))
                .at(Place { column: "G".to_owned(), row: Some(k), time: None })
                .count(self.G.iter().filter(|g| !(g.re.is_finite() && g.im.is_finite())).count())
                .remedy("leave these frequencies out"));
        }
        if let Some(r) = self.radius.iter().flatten().find(|r| !(**r >= 0.0)) {
            return Err(Error::argument("radius", r, "zero or positive"));
        }
        Ok(self)
    }

    fn check_Ts(&self) -> Result<()> {
        let Some(Ts) = self.Ts else { return Ok(()) };
        if !(Ts > 0.0 && Ts.is_finite()) {
            return Err(Error::argument("Ts", Ts, "a positive number of seconds, or absent"));
        }
        let (top, nyquist) = (self.w[self.w.len() - 1], PI / Ts);
        if top <= nyquist * (1.0 + 1e-9) {
            return Ok(());
        }
        Err(Error::new("U01", format!("`w` reaches {top} rad/s, half the sampling rate is {nyquist} rad/s"))
            .at(Place::column("w"))
            .measured(top, nyquist)
            .remedy("leave out what lies beyond pi/Ts, or leave out Ts if G belongs to the continuous plant"))
    }

    /// Number of frequencies.
    pub fn n(&self) -> usize {
        self.w.len()
    }

    /// Points and discs of output `i` from input `j`.
    pub fn column(&self, i: usize, j: usize) -> (Vec<Complex<f64>>, Option<Vec<f64>>) {
        let at = |k: usize| (k * self.ny + i) * self.nu + j;
        let G = (0..self.n()).map(|k| self.G[at(k)]).collect();
        (G, self.radius.as_ref().map(|r| (0..self.n()).map(|k| r[at(k)]).collect()))
    }

    /// Magnitude and phase of output `i` from input `j` over the frequencies to `keep`; NaN at the others.
    pub fn bode(&self, i: usize, j: usize, keep: &[bool]) -> Bode {
        let (G, radius) = self.column(i, j);
        let radius = radius.unwrap_or_else(|| vec![f64::NAN; G.len()]);
        let blank = || [0; 3].map(|_| vec![f64::NAN; G.len()]);
        let mut bode = Bode { magnitude: blank(), phase: blank() };
        let mut last: Option<f64> = None;
        for k in (0..G.len()).filter(|&k| keep[k]) {
            let (size, r) = (G[k].norm(), radius[k]);
            let principal = G[k].arg().to_degrees();
            let phase =
                last.map_or(principal, |last| principal - 360.0 * ((principal - last) / 360.0).round());
            last = Some(phase);
            let turn = if r < size { (r / size).asin().to_degrees() } else { 180.0 };
            let turn = if r.is_nan() { f64::NAN } else { turn };
            let put = |to: &mut [Vec<f64>; 3], values: [f64; 3]| {
                to.iter_mut().zip(values).for_each(|(column, x)| column[k] = x);
            };
            put(&mut bode.magnitude, [size, if r.is_nan() { r } else { (size - r).max(0.0) }, size + r]);
            put(&mut bode.phase, [phase, phase - turn, phase + turn]);
        }
        bode
    }
}

/// Response of a model from input `j` as data with this sample time show it: a continuous model is sampled behind a
/// zero-order hold, its delay exact.
pub fn seen(model: &Model, j: usize, Ts: Option<f64>, w: &[f64]) -> Vec<Complex<f64>> {
    let held = match (Ts, model.transfer()) {
        (Some(Ts), Some(G)) => Model::Poly(sampled(&G, Ts)),
        _ => model.clone(),
    };
    w.iter().map(|&w| held.freqresp(j, w)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Fopdt;

    fn of(w: &[f64], G: &[Complex<f64>], Ts: Option<f64>) -> Result<FrequencyResponse> {
        FrequencyResponse { w: w.to_vec(), G: G.to_vec(), radius: None, ny: 1, nu: 1, Ts }.checked()
    }

    #[test]
    fn what_is_no_response_is_refused() {
        let one = Complex::new(1.0, 0.0);
        assert_eq!(of(&[1.0, 1.0], &[one; 2], None).expect_err("twice").code(), "U01");
        assert_eq!(of(&[-1.0, 1.0], &[one; 2], None).expect_err("negative").code(), "U01");
        assert_eq!(of(&[1.0, 4.0], &[one; 2], Some(1.0)).expect_err("beyond pi").code(), "U01");
        assert_eq!(of(&[1.0], &[Complex::new(f64::NAN, 0.0)], None).expect_err("NaN").code(), "D07");
    }

    /// `(1 - a) / (z - a)` is the sampled first order, one delay of half a sample more turns both parts.
    #[test]
    fn data_show_the_sampled_plant() {
        let (Ts, a) = (0.5, (-0.25f64).exp());
        let model: Model = Fopdt { K: 3.0, T: 2.0, L: 0.0 }.into();
        for w in [0.1, 1.0, 6.0] {
            let z = Complex::from_polar(1.0, w * Ts);
            let G = seen(&model, 0, Some(Ts), &[w])[0];
            assert!((G - (1.0 - a) * 3.0 / (z - a)).norm() < 1e-13);
        }
    }

    #[test]
    fn the_phase_runs_on_where_it_would_jump() {
        let w: Vec<f64> = (1..200).map(|k| 0.02 * f64::from(k)).collect();
        let G: Vec<Complex<f64>> = w.iter().map(|w| Complex::from_polar(1.0, -5.0 * w)).collect();
        let bode = of(&w, &G, None).expect("fine").bode(0, 0, &vec![true; w.len()]);
        for (phase, w) in bode.phase[0].iter().zip(&w) {
            assert!((phase + (5.0 * w).to_degrees()).abs() < 1e-9);
        }
    }
}
