//! Plants whose input is held between samples, one sample at a time.
//!
//! ```text
//! L = m Ts + f:  from t(k) to t(k) + f the input of m + 1 samples ago acts, then that of m samples ago
//! y(k) is read before the input of sample k acts
//! ```
//!
//! A plant starts at rest at the input `u0` and moves from there: `y = y0 + G (v - u0)` with
//! `y0 = G(0) u0 + O`. An integrating plant rests at any input, `y0 = O`: what flows off balances `u0`.
//! Everything is exact at the samples; [`super::state`] says what is known in between. A polynomial model
//! knows its samples only and is drawn straight from one to the next.

use super::arc::Cubic;
use super::indices::Watch;
use super::state::{FirstOrder, General, State};
use crate::error::{Error, Result};
use crate::model::{Fraction, Model, PolyModel, Realisation};
use crate::poly::product;

/// Most samples of delay.
const LONGEST: f64 = 1e7;

/// A plant, one sample at a time.
pub trait Plant {
    /// Output at this sample, before its input acts.
    fn output(&self) -> f64;
    /// Holds the input at `v` until the next sample.
    fn run(&mut self, v: f64, watch: &mut impl Watch);
}

/// Any model as a plant to be stepped.
///
/// ```
/// use plantune_core::model::{Fopdt, Model};
/// use plantune_core::sim::SampledPlant;
///
/// let mut plant = SampledPlant::new(&Model::from(Fopdt { K: 2.0, T: 1.0, L: 0.3 }), 0.1, 0.0, 20.0)?;
/// let y: Vec<f64> = (0..5).map(|_| plant.step(1.0)).collect();
/// assert_eq!(y[..3], [20.0, 20.0, 20.0]);
/// assert!((y[3] - 20.190325163928).abs() < 1e-12);
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub enum SampledPlant {
    /// First order plus dead time.
    First(Delayed<FirstOrder>),
    /// Any other continuous model.
    General(Delayed<General>),
    /// A polynomial model.
    Poly(Difference),
}

impl SampledPlant {
    /// At rest at the input `u0`; `offset` is `O` in `y = G u + O`.
    pub fn new(model: &Model, Ts: f64, u0: f64, offset: f64) -> Result<Self> {
        model.check_Ts(Ts)?;
        model.check()?;
        if model.nu() != 1 {
            return Err(Error::argument("model", format!("of {} inputs", model.nu()), "of one input"));
        }
        let y0 = resting(model, u0, offset);
        if let Some(first) = model.first_order() {
            let state = FirstOrder::new(&first);
            return Ok(SampledPlant::First(Delayed::new(state, first.L, Ts, u0, y0)?));
        }
        Ok(match (model, model.transfer()) {
            (Model::Poly(m), _) => SampledPlant::Poly(Difference::new(m, u0, y0)?),
            (_, Some(G)) => {
                let state = General::new(Realisation::of(&G), G.poles());
                SampledPlant::General(Delayed::new(state, G.L, Ts, u0, y0)?)
            }
            _ => return Err(Error::argument("model", "neither sampled nor continuous", "one of both")),
        })
    }

    /// Output at this sample.
    pub fn output(&self) -> f64 {
        match self {
            SampledPlant::First(p) => p.output(),
            SampledPlant::General(p) => p.output(),
            SampledPlant::Poly(p) => p.output(),
        }
    }

    /// Holds the input at `v` for a sample and returns the output at the next one. Allocates nothing.
    pub fn step(&mut self, v: f64) -> f64 {
        match self {
            SampledPlant::First(p) => p.run(v, &mut ()),
            SampledPlant::General(p) => p.run(v, &mut ()),
            SampledPlant::Poly(p) => p.run(v, &mut ()),
        }
        self.output()
    }
}

/// Output at rest at the input `u0`.
pub fn resting(model: &Model, u0: f64, offset: f64) -> f64 {
    let K = model.dc_gain()[0];
    if K.is_finite() { K * u0 + offset } else { offset }
}

/// Whole samples of delay and the rest, refused where no memory holds them.
pub fn delay_of(L: f64, Ts: f64) -> Result<Fraction> {
    if L / Ts > LONGEST {
        return Err(Error::argument(
            "Ts",
            Ts,
            &format!("at least {:.3e} s for a dead time of {L} s", L / LONGEST),
        ));
    }
    Ok(Fraction::of(L, Ts))
}

/// States behind a dead time.
#[derive(Clone, Debug)]
pub struct Delayed<S: State> {
    state: S,
    /// Stretches under the input of `m + 1` samples ago, and under that of `m` samples ago.
    early: Vec<Stretch<S>>,
    late: Vec<Stretch<S>>,
    /// The last `m + 1` inputs, the oldest at `oldest`.
    past: Vec<f64>,
    oldest: usize,
    direct: f64,
    u0: f64,
    y0: f64,
}

#[derive(Clone, Debug)]
struct Stretch<S: State> {
    h: f64,
    held: S::Move,
}

impl<S: State> Delayed<S> {
    fn new(state: S, L: f64, Ts: f64, u0: f64, y0: f64) -> Result<Self> {
        let Fraction { m, f } = delay_of(L, Ts)?;
        let cut = |total: f64| -> Vec<Stretch<S>> {
            state.cut(total).into_iter().map(|h| Stretch { h, held: state.over(h) }).collect()
        };
        let (early, late) = (cut(f), cut(Ts - f));
        Ok(Delayed { early, late, past: vec![0.0; m + 1], oldest: 0, direct: state.direct(), u0, y0, state })
    }
}

impl<S: State> Plant for Delayed<S> {
    #[inline(always)]
    fn output(&self) -> f64 {
        self.y0 + (self.state.output() + self.direct * self.past[self.oldest])
    }

    #[inline(always)]
    fn run(&mut self, v: f64, watch: &mut impl Watch) {
        let older = self.past[self.oldest];
        self.past[self.oldest] = v - self.u0;
        self.oldest = if self.oldest + 1 == self.past.len() { 0 } else { self.oldest + 1 };
        let newer = self.past[self.oldest];
        let rest = self.y0 + self.direct * older;
        for Stretch { h, held } in &self.early {
            watch.arc(*h, self.state.hold(held, *h, older, rest));
        }
        let rest = self.y0 + self.direct * newer;
        for Stretch { h, held } in &self.late {
            watch.arc(*h, self.state.hold(held, *h, newer, rest));
        }
    }
}

/// `A F y = B u`, transposed direct form, and the samples of delay beyond one.
#[derive(Clone, Debug)]
pub struct Difference {
    a: Vec<f64>,
    b: Vec<f64>,
    memory: Vec<f64>,
    past: Vec<f64>,
    oldest: usize,
    y: f64,
    Ts: f64,
    u0: f64,
    y0: f64,
}

impl Difference {
    fn new(model: &PolyModel, u0: f64, y0: f64) -> Result<Self> {
        if model.nk[0] == 0 {
            return Err(Error::argument("nk", 0, "at least 1: a controller reads y before it moves u"));
        }
        let (mut a, mut b) = (product(&model.A, &model.F[0]), model.B[0].clone());
        let terms = a.len().max(b.len());
        a.resize(terms, 0.0);
        b.resize(terms, 0.0);
        Ok(Difference {
            memory: vec![0.0; terms],
            past: vec![0.0; model.nk[0]],
            oldest: 0,
            a,
            b,
            y: 0.0,
            Ts: model.Ts,
            u0,
            y0,
        })
    }
}

impl Plant for Difference {
    #[inline]
    fn output(&self) -> f64 {
        self.y0 + self.y
    }

    #[inline]
    fn run(&mut self, v: f64, watch: &mut impl Watch) {
        self.past[self.oldest] = v - self.u0;
        self.oldest = if self.oldest + 1 == self.past.len() { 0 } else { self.oldest + 1 };
        let late = self.past[self.oldest];
        let before = self.output();
        // memory[0] waits to be added to this output, memory[1] to the next, …
        self.y = self.b[0] * late + self.memory[0];
        for k in 1..self.a.len() {
            let later = self.memory.get(k).copied().unwrap_or(0.0);
            self.memory[k - 1] = self.b[k] * late - self.a[k] * self.y + later;
        }
        let slope = (self.output() - before) / self.Ts;
        watch.arc(self.Ts, Cubic::new(self.Ts, (before, slope), (self.output(), slope)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Fopdt, ProcessModel, TransferFunction};

    fn inputs() -> Vec<f64> {
        (0..80).map(|k| f64::from(k / 3 * 37 % 11)).collect()
    }

    fn models() -> Vec<Model> {
        let mut models: Vec<Model> =
            [0.0, 0.11, 0.6, 0.75].iter().map(|&L| Fopdt { K: -2.0, T: 0.7, L }.into()).collect();
        for L in [0.0, 0.11, 0.6, 0.75] {
            models.push(Model::Transfer(TransferFunction {
                num: vec![-0.7, 1.0],
                den: vec![1.0, 0.2, 1.0],
                L,
            }));
            models.push(Model::Process(ProcessModel {
                K: 0.4,
                T: vec![1.0, 1e-3],
                L,
                Tz: 0.0,
                zeta: None,
                integrating: true,
            }));
        }
        let mut poly = PolyModel::arx(vec![1.0, -1.5, 0.7], vec![vec![1.0, 0.5]], vec![3], 0.3);
        poly.F[0] = vec![1.0, -0.4];
        models.push(Model::Poly(poly.clone()));
        models.push(Model::Poly(PolyModel { nk: vec![1], ..poly }));
        models
    }

    #[test]
    fn steps_are_the_simulation_of_the_model() {
        for model in models() {
            let u = inputs();
            let y = model.simulate(&u, 1, 0.3, 0.0).expect("a simulation");
            let mut plant = SampledPlant::new(&model, 0.3, 0.0, 5.0).expect("a plant");
            for (k, y) in y.iter().enumerate() {
                assert!((plant.output() - 5.0 - y).abs() < 1e-9 * (1.0 + y.abs()), "{model:?} row {k}");
                plant.step(u[k]);
            }
        }
    }

    #[test]
    fn a_plant_at_rest_stays_there() {
        for model in models() {
            let mut plant = SampledPlant::new(&model, 0.3, 3.0, 5.0).expect("a plant");
            let rest = plant.output();
            assert_eq!(
                rest,
                if model.dc_gain()[0].is_finite() { model.dc_gain()[0] * 3.0 + 5.0 } else { 5.0 }
            );
            assert!((0..50).all(|_| plant.step(3.0) == rest));
        }
    }

    #[test]
    fn what_answers_at_once_or_remembers_too_much_is_refused() {
        let now = Model::Poly(PolyModel::arx(vec![1.0, -0.5], vec![vec![1.0]], vec![0], 1.0));
        assert_eq!(SampledPlant::new(&now, 1.0, 0.0, 0.0).expect_err("nk 0").code(), "U01");
        let late = Model::from(Fopdt { K: 1.0, T: 1.0, L: 1e9 });
        assert_eq!(SampledPlant::new(&late, 1e-3, 0.0, 0.0).expect_err("1e12 samples").code(), "U01");
    }
}
