//! `A(q) y(t) = sum_i B_i(q) u_i(t - nk_i) + sum_m g_m x_m(t) + d + e(t)`, with regressors `x_m` of one's own.
//!
//! Linear in its coefficients and in nothing else: there is no transfer function and no level `O`, so the constant
//! `d` belongs to the model. A prediction `k` steps ahead runs the equation on from what was measured, without noise.
//!
//! Source 000, chapter 4 (other friction to the left than to the right); Ljung 1999, 5.2 and (5.16).

use super::terms::{Lagged, Own, longest_lag};
use crate::error::{Error, Result};
use crate::record::Record;

/// Beyond this a run has left all bounds.
const LARGEST: f64 = 1e100;

/// An ARX model with further regressors.
#[derive(Clone, Debug, PartialEq)]
pub struct TermModel {
    /// Begins with 1.
    pub A: Vec<f64>,
    /// Numerator per input; it may be empty.
    pub B: Vec<Vec<f64>>,
    /// Delay per input, samples.
    pub nk: Vec<usize>,
    /// The regressors.
    pub own: Vec<Own>,
    /// Their coefficients.
    pub g: Vec<f64>,
    /// The constant.
    pub d: f64,
}

impl TermModel {
    /// Rows until every lag lies in the record.
    pub fn history(&self) -> usize {
        let inputs =
            self.B.iter().zip(&self.nk).filter(|(b, _)| !b.is_empty()).map(|(b, nk)| nk + b.len() - 1);
        inputs.chain([self.A.len() - 1, longest_lag(&self.own)]).max().unwrap_or(0)
    }

    /// `y(t)` without noise, of what lies before it and of the given columns at `t`.
    fn next(&self, at: &impl Fn(Lagged) -> f64, given: &[f64]) -> f64 {
        let outputs: f64 = self.A.iter().enumerate().skip(1).map(|(j, a)| a * at(Lagged::Output(j))).sum();
        let paths = self.B.iter().zip(&self.nk).enumerate();
        let inputs: f64 = paths
            .flat_map(|(i, (b, nk))| b.iter().enumerate().map(move |(j, c)| (c, Lagged::Input(i, nk + j))))
            .map(|(c, lagged)| c * at(lagged))
            .sum();
        let own: f64 = self.own.iter().zip(&self.g).map(|(x, g)| g * x.value(at, given)).sum();
        self.d - outputs + inputs + own
    }

    /// Runs on from the outputs `y` that are known, to the end of `u`; before row 0 all signals are zero.
    pub fn simulate(&self, u: &[f64], given: &[f64], mut y: Vec<f64>) -> Result<Vec<f64>> {
        let nu = self.B.len();
        let (N, width) = (u.len() / nu, given.len() / (u.len() / nu).max(1));
        for t in y.len()..N {
            let at = |s: Lagged| match s {
                Lagged::Input(i, lag) if lag <= t => u[(t - lag) * nu + i],
                Lagged::Output(lag) if lag <= t => y[t - lag],
                _ => 0.0,
            };
            let next = self.next(&at, &given[t * width..(t + 1) * width]);
            if !(next.abs() < LARGEST) {
                return Err(left(t));
            }
            y.push(next);
        }
        Ok(y)
    }

    /// Rows with history, and the output predicted there `horizon` steps ahead; `None` simulates from the first
    /// rows of each segment. Where a given column has no value there is no prediction, and further ones go on from
    /// what was measured there.
    pub fn over_record(
        &self,
        rec: &Record,
        given: &[f64],
        horizon: Option<usize>,
    ) -> Result<(Vec<usize>, Vec<f64>)> {
        self.check(rec, horizon)?;
        let (history, width) = (self.history(), given.len() / rec.N());
        let known = |t: usize| given[t * width..(t + 1) * width].iter().all(|x| x.is_finite());
        let (mut rows, mut yhat) = (Vec::new(), Vec::new());
        for s in rec.segments().filter(|s| s.len() > history) {
            let first = s.start + history;
            let mut run = Run { model: self, rec, given, start: s.start, from: first, y: Vec::new() };
            for t in first..s.end {
                if let Some(steps) = horizon {
                    run.begin((t + 1).saturating_sub(steps).max(first));
                }
                run.go_on(t, known)?;
                if known(t) {
                    rows.push(t);
                    yhat.push(run.y[t - run.from]);
                }
            }
        }
        Ok((rows, yhat))
    }

    fn check(&self, rec: &Record, horizon: Option<usize>) -> Result<()> {
        if rec.nu != self.B.len() || rec.ny != 1 {
            let came = format!("a record with {} inputs and {} outputs", rec.nu, rec.ny);
            return Err(Error::argument(
                "rec",
                came,
                &format!("one with {} inputs and one output", self.B.len()),
            ));
        }
        if horizon == Some(0) {
            return Err(Error::argument("horizon", 0, "at least 1"));
        }
        Ok(())
    }
}

/// Outputs of the model from row `from` of a segment on, those before it as measured.
struct Run<'r, 'a> {
    model: &'r TermModel,
    rec: &'r Record<'a>,
    given: &'r [f64],
    start: usize,
    from: usize,
    y: Vec<f64>,
}

impl Run<'_, '_> {
    fn begin(&mut self, from: usize) {
        self.from = from;
        self.y.clear();
    }

    /// Up to row `t`; a row that is not `known` is taken as measured.
    fn go_on(&mut self, t: usize, known: impl Fn(usize) -> bool) -> Result<()> {
        let Run { model, rec, given, start, from, y } = self;
        let width = given.len() / rec.N();
        for k in *from + y.len()..=t {
            let at = |s: Lagged| match s {
                Lagged::Input(i, lag) if k >= *start + lag => rec.u_at(k - lag, i),
                Lagged::Output(lag) if k >= *from + lag => y[k - lag - *from],
                Lagged::Output(lag) if k >= *start + lag => rec.y_at(k - lag, 0),
                _ => 0.0,
            };
            let next =
                if known(k) { model.next(&at, &given[k * width..(k + 1) * width]) } else { rec.y_at(k, 0) };
            if !(next.abs() < LARGEST) {
                return Err(left(k));
            }
            y.push(next);
        }
        Ok(())
    }
}

fn left(t: usize) -> Error {
    Error::new("N02", format!("the model leaves all bounds at row {t}: its own terms feed on each other"))
        .remedy("predict a few steps ahead instead of simulating, or fit other regressors")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::model::Term;

    fn model(texts: &[&str], g: &[f64]) -> TermModel {
        let names = ["u".to_owned(), "y".to_owned()];
        let own = texts.iter().map(|text| Own::Term(Term::parse(text, &names).expect(text))).collect();
        TermModel { A: vec![1.0, -0.8], B: vec![vec![0.5]], nk: vec![1], own, g: g.to_vec(), d: 0.3 }
    }

    #[test]
    fn a_simulation_solves_its_equation() {
        let (m, u) = (model(&["positive(u(t-2))", "sign(y(t-1))"], &[0.4, -0.2]), white(100, 1));
        let y = m.simulate(&u, &[], Vec::new()).expect("bounded");
        for t in 2..100 {
            let exact =
                0.8 * y[t - 1] + 0.5 * u[t - 1] + 0.4 * u[t - 2].max(0.0) - 0.2 * y[t - 1].signum() + 0.3;
            assert!((y[t] - exact).abs() < 1e-13);
        }
    }

    #[test]
    fn predictions_run_on_from_what_was_measured() {
        let (m, u, e) = (model(&["u(t-1)*y(t-1)"], &[0.1]), white(60, 2), white(60, 3));
        let mut y = vec![0.0];
        for t in 1..60 {
            let next = m.simulate(&u[..=t], &[], y.clone()).expect("bounded")[t];
            y.push(next + e[t]);
        }
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let (rows, one) = m.over_record(&rec, &[], Some(1)).expect("bounded");
        assert_eq!(rows, (1..60).collect::<Vec<_>>());
        assert!(rows.iter().zip(&one).all(|(&t, p)| (y[t] - p - e[t]).abs() < 1e-12));
        let (_, three) = m.over_record(&rec, &[], Some(3)).expect("bounded");
        let by_hand = m.simulate(&u[..=40], &[], y[..38].to_vec()).expect("bounded")[40];
        assert!((three[39] - by_hand).abs() < 1e-13);
        let (_, all) = m.over_record(&rec, &[], Some(1000)).expect("bounded");
        assert_eq!(all, m.over_record(&rec, &[], None).expect("bounded").1);
    }

    #[test]
    fn a_run_that_leaves_all_bounds_is_refused() {
        let m = model(&["square(y(t-1))"], &[3.0]);
        assert_eq!(m.simulate(&[1.0; 50], &[], Vec::new()).expect_err("unbounded").code(), "N02");
    }
}
