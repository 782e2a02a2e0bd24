//! Recursive least squares for any model that is linear in its parameters.
//!
//! ```text
//! eps   = y - phi' theta
//! gain  = P phi / (lambda + phi' P phi)
//! theta <- theta + gain eps
//! P     <- (P - gain phi' P) / lambda
//! ```
//!
//! or what another [`Scheme`] makes of it. From `theta0` and `P0` this is, at every `t`, exactly the minimum of
//!
//! ```text
//! sum_k lambda^(t-k) (y(k) - phi(k)' theta)^2 + lambda^t (theta - theta0)' P0^-1 (theta - theta0)
//! ```
//!
//! so with `P0 = alpha I` and without forgetting ridge regression of weight `1/alpha`; from a batch of the first
//! rows, least squares itself. Source 000, (2.2-15) and its two starts; source 001, (3.7-7) to (3.7-11).

use super::forgetting::{Forgetting, Scheme};
use super::innovation::{FIRST, Innovation};
use super::room::{Room, VECTORS, with_room};
use super::ud::Ud;
use crate::error::{Error, Result};
use crate::linalg::{Triangle, solve};

/// Least pivot of a batch to begin with, as a share of the largest: below it more rows are taken.
const SOUND: f64 = 1e-6;

/// Least pivot of all rows together.
const RANK_TOLERANCE: f64 = 1e-14;

/// How much more than in one solution rounding does along the way: measured on well-conditioned problems.
const ROUNDINGS: f64 = 8.0;

/// What is left of the start below this is nothing.
const FADED: f64 = 1e-200;

/// An estimator on its way along a record.
#[derive(Clone, Debug)]
pub struct Rls {
    theta: Vec<f64>, // (n)
    P: Ud,
    forgetting: Forgetting,
    innovation: Innovation,
    start: Option<(Vec<f64>, Ud)>, // theta0 and P0; none after a batch
    kept: f64,                     // what is left of the start
    rss: f64,                      // what is minimised, without the distance to the start
    travel: f64,                   // largest |y|
    room: Vec<f64>,
}

impl Rls {
    /// Parameters at zero, with the covariance `P0` in units of the noise variance.
    pub fn new(P0: Ud, scheme: Scheme) -> Result<Self> {
        let n = P0.n();
        if n == 0 {
            return Err(Error::argument("n", n, "at least 1"));
        }
        Ok(Rls {
            theta: vec![0.0; n],
            forgetting: Forgetting::new(scheme, n)?,
            innovation: Innovation::new(None, false, FIRST),
            start: Some((vec![0.0; n], P0.clone())),
            P: P0,
            kept: 1.0,
            rss: 0.0,
            travel: 0.0,
            room: vec![0.0; VECTORS * n],
        })
    }

    /// Starts from these parameters instead of zero.
    pub fn starting_at(mut self, theta0: &[f64]) -> Result<Self> {
        if theta0.len() != self.n() || theta0.iter().any(|x| !x.is_finite()) {
            return Err(Error::argument("theta0", format!("{theta0:?}"), &self.numbers_needed()));
        }
        self.theta.copy_from_slice(theta0);
        if let Some((start, _)) = &mut self.start {
            start.copy_from_slice(theta0);
        }
        Ok(self)
    }

    /// Cuts innovations at so many standard deviations.
    pub fn cutting(mut self, clip: f64) -> Result<Self> {
        if !(clip > 0.0) {
            return Err(Error::argument("clip", clip, "a positive number of standard deviations"));
        }
        self.innovation = Innovation::new(Some(clip), false, FIRST);
        Ok(self)
    }

    /// Bounds every entry of `D` of `P = U D U'`.
    pub fn bounded(mut self, most: f64) -> Result<Self> {
        if !(most > 0.0) {
            return Err(Error::argument("P_max", most, "positive"));
        }
        self.P.bound(most);
        Ok(self)
    }

    /// Starts from least squares on the first rows of the row-major `phi (N, n)` instead of `P0`, then learns
    /// the others; returns how many rows the batch had.
    ///
    /// At least `rows`; where their rank is not full, or their condition poor, twice as many, until it is sound
    /// or all are in. X02 where the rank is not full then.
    pub fn begin(&mut self, phi: &[f64], y: &[f64], rows: usize) -> Result<usize> {
        let n = self.n();
        check_rows(phi, y, n)?;
        let (N, every) = (y.len(), (0..n).collect::<Vec<usize>>());
        let mut m = rows.max(n);
        loop {
            m = m.min(N);
            let triangle = triangle(&phi[..m * n], &y[..m], n);
            let last = m == N;
            match solve(&triangle, &every, n, if last { RANK_TOLERANCE } else { SOUND }) {
                Ok(solution) => {
                    self.theta.copy_from_slice(&solution.theta);
                    self.P = self.P.replaced(&triangle);
                    self.innovation.begin(solution.rss, (m - n) as f64);
                    self.forgetting.begin(m as f64);
                    self.travel = y[..m].iter().fold(0.0, |most, y| y.abs().max(most));
                    (self.start, self.rss) = (None, solution.rss);
                    self.run(&phi[m * n..], &y[m..])?;
                    return Ok(m);
                }
                Err(refusal) if last => {
                    let text = format!("the {N} rows of phi have rank {} of {n}", refusal.rank);
                    return Err(Error::new("X02", text)
                        .count(refusal.dependent.len())
                        .measured(refusal.ratio, RANK_TOLERANCE)
                        .remedy("start from P0, or give more rows with other values"));
                }
                Err(_) => m *= 2,
            }
        }
    }

    /// Learns one sample and returns the prior prediction error `eps = y - phi' theta`.
    ///
    /// Allocates nothing. On error the state is unchanged.
    pub fn update(&mut self, phi: &[f64], y: f64) -> Result<f64> {
        with_room!(self.theta.len(), self.room, |n, room| self.update_n(n, room, phi, y))
    }

    #[inline(always)]
    fn update_n(&mut self, n: usize, room: &mut Room<'_>, phi: &[f64], y: f64) -> Result<f64> {
        if phi.len() != n || phi.iter().any(|x| !x.is_finite()) {
            return Err(Error::argument("phi", format!("{phi:?}"), &self.numbers_needed()));
        }
        if !y.is_finite() {
            return Err(Error::argument("y", y, "a finite number"));
        }
        let theta = &self.theta[..n];
        let eps = y - phi.iter().zip(theta).map(|(x, theta)| x * theta).sum::<f64>();
        room.psi.copy_from_slice(phi);
        let q = self.P.weigh(n, room);
        if !(eps * eps + q).is_finite() {
            return Err(overflow());
        }
        self.travel = self.travel.max(y.abs());
        let judged = self.innovation.judge(eps, 1.0 + q * self.forgetting.spread(), self.travel);
        let lambda = self.forgetting.lambda();
        let scale = self.forgetting.learn(n, &mut self.P, room, q, judged);
        for (theta, b) in self.theta[..n].iter_mut().zip(&*room.b) {
            *theta += b * scale;
        }
        self.innovation.sum(judged);
        self.rss = lambda * (self.rss + eps * eps / (lambda + q));
        self.kept = if self.kept > FADED { self.kept * lambda } else { 0.0 };
        Ok(eps)
    }

    /// `update` for each row of `phi`, `(N, n)` row-major; returns every prior error. A row that is refused
    /// leaves those before it learnt.
    pub fn run(&mut self, phi: &[f64], y: &[f64]) -> Result<Vec<f64>> {
        let n = self.n();
        if phi.len() != n * y.len() {
            let came = format!("{} numbers for {} rows of y", phi.len(), y.len());
            return Err(Error::argument("phi", came, &format!("{n} a row")));
        }
        phi.chunks_exact(n).zip(y).map(|(phi, y)| self.update(phi, *y)).collect()
    }

    /// Number of parameters.
    pub fn n(&self) -> usize {
        self.theta.len()
    }

    /// Parameters `(n)`.
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Covariance of the parameters in units of the noise variance.
    pub fn P(&self) -> &Ud {
        &self.P
    }

    /// How it forgets.
    pub fn forgetting(&self) -> &Forgetting {
        &self.forgetting
    }

    /// Standard deviations of the parameters `(n)`, `sqrt(s^2 P_ii S2/S1)`.
    pub fn sd(&self) -> Vec<f64> {
        let scale = self.innovation.s2() * self.forgetting.spread();
        (0..self.n()).map(|j| (scale * self.P.at(j, j)).sqrt()).collect()
    }

    /// Standard deviation of the noise.
    pub fn noise_sd(&self) -> f64 {
        self.innovation.s2().sqrt()
    }

    /// Decimal digits to which each parameter is that of least squares (weighted with what is forgotten).
    ///
    /// Two things come between: rounding, bounded entry by entry as in [`crate::batch::least_squares`] for the
    /// errors of all samples together, and what is left of the start, which draws `theta` to `theta0` by
    /// `delta = (P^-1 - Pi)^-1 Pi (theta - theta0)`, `Pi = lambda^t P0^-1`.
    pub fn expected_digits(&self) -> Vec<f64> {
        let drawn = self.drawn().unwrap_or_else(|| vec![f64::INFINITY; self.n()]);
        let digits = |(error, theta): (f64, &f64)| -(error / theta.abs().max(f64::MIN_POSITIVE)).log10();
        let errors = self.rounding().into_iter().zip(drawn).map(|(r, d)| r + d.abs());
        errors.zip(&self.theta).map(digits).map(|d| d.clamp(0.0, 15.9)).collect()
    }

    /// `delta`; nothing where the start alone tells some directions.
    fn drawn(&self) -> Option<Vec<f64>> {
        let n = self.n();
        let Some((theta0, P0)) = self.start.as_ref().filter(|_| self.kept > 0.0) else {
            return Some(vec![0.0; n]);
        };
        // (I - P Pi) delta = P Pi (theta - theta0), each column of P Pi by Pi's.
        let P = self.P.matrix();
        let times_P = |x: Vec<f64>| -> Vec<f64> {
            P.chunks(n).map(|row| row.iter().zip(&x).map(|(p, x)| p * x).sum::<f64>() * self.kept).collect()
        };
        let unit = |j: usize| (0..n).map(|i| if i == j { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        let columns: Vec<Vec<f64>> = (0..n).map(|j| times_P(P0.solve(&unit(j)))).collect();
        let gap: Vec<f64> = self.theta.iter().zip(theta0).map(|(a, b)| a - b).collect();
        let right = times_P(P0.solve(&gap));
        let row = |i: usize| -> Vec<f64> {
            let left = (0..n).map(|j| if i == j { 1.0 - columns[j][i] } else { -columns[j][i] });
            left.chain([right[i]]).collect()
        };
        let rows: Vec<Vec<f64>> = (0..n).map(row).collect();
        let every: Vec<usize> = (0..n).collect();
        let triangle = Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice));
        solve(&triangle, &every, n, RANK_TOLERANCE).ok().map(|solution| solution.theta)
    }

    fn rounding(&self) -> Vec<f64> {
        let n = self.n();
        let unit = |j: usize| (0..n).map(|i| if i == j { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        let lengths: Vec<f64> = (0..n).map(|j| self.P.solve(&unit(j))[j].max(0.0).sqrt()).collect();
        let product: f64 = self.theta.iter().zip(&lengths).map(|(theta, l)| theta.abs() * l).sum();
        let each = |i: usize| {
            let cross: f64 = lengths.iter().enumerate().map(|(j, l)| self.P.at(i, j).abs() * l).sum();
            ROUNDINGS * f64::EPSILON * (self.P.at(i, i).sqrt() * product + cross * self.rss.sqrt())
        };
        (0..n).map(each).collect()
    }

    /// Every number of the state; the settings are not among them.
    pub fn state(&self) -> Vec<f64> {
        numbers_of(self, Rls::numbers)
    }

    /// Goes on from where another with the same settings stood.
    pub fn resume(&mut self, state: &[f64]) -> Result<()> {
        *self = resumed(self, state, Rls::numbers)?;
        Ok(())
    }

    fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        self.theta.iter_mut().for_each(&mut *visit);
        self.P.numbers(visit);
        self.forgetting.numbers(visit);
        self.innovation.numbers(visit);
        let mut begun = if self.start.is_some() { 1.0 } else { 0.0 };
        visit(&mut begun);
        if begun == 0.0 {
            self.start = None;
        }
        if let Some((theta0, P0)) = &mut self.start {
            theta0.iter_mut().for_each(&mut *visit);
            P0.numbers(visit);
        }
        [&mut self.kept, &mut self.rss, &mut self.travel].into_iter().for_each(visit);
    }

    fn numbers_needed(&self) -> String {
        format!("{} finite numbers", self.n())
    }
}

/// N02.
pub(super) fn overflow() -> Error {
    Error::new("N02", "the numbers of this sample overflow when squared")
        .remedy("scale the signals to a range near 1")
}

/// Visits every number of an estimator.
type Walk<E> = fn(&mut E, &mut dyn FnMut(&mut f64));

/// Every number of an estimator, in the order in which `walk` visits them.
pub(super) fn numbers_of<E: Clone>(estimator: &E, walk: Walk<E>) -> Vec<f64> {
    let mut all = Vec::new();
    walk(&mut estimator.clone(), &mut |x| all.push(*x));
    all
}

/// An estimator of the same settings with these numbers; refuses another count of them.
pub(super) fn resumed<E: Clone>(estimator: &E, state: &[f64], walk: Walk<E>) -> Result<E> {
    let (mut next, mut missing, mut other) = (state.iter(), false, estimator.clone());
    walk(&mut other, &mut |x| match next.next() {
        Some(value) => *x = *value,
        None => missing = true,
    });
    if missing || next.next().is_some() {
        return Err(Error::argument("state", format!("{} numbers", state.len()), "that of this estimator"));
    }
    Ok(other)
}

/// Refuses rows that are too few (X03), not finite (D07) or of another size (D09).
fn check_rows(phi: &[f64], y: &[f64], n: usize) -> Result<()> {
    if phi.len() != n * y.len() {
        let text = format!("phi has {} values, y has {} rows and theta {n} entries", phi.len(), y.len());
        return Err(Error::new("D09", text).remedy("give phi one row per value of y"));
    }
    if !phi.iter().chain(y).all(|x| x.is_finite()) {
        return Err(Error::new("D07", "phi or y holds a number that is not finite").remedy("remove that row"));
    }
    if y.len() < n {
        return Err(Error::new("X03", format!("{} usable rows for {n} parameters", y.len()))
            .count(y.len())
            .measured(y.len() as f64, n as f64)
            .remedy("give more rows, or start from P0"));
    }
    Ok(())
}

/// Triangle of `[phi | y]`.
fn triangle(phi: &[f64], y: &[f64], n: usize) -> Triangle {
    let rows: Vec<Vec<f64>> =
        phi.chunks_exact(n).zip(y).map(|(phi, y)| [phi, std::slice::from_ref(y)].concat()).collect();
    Triangle::of_rows(n + 1, rows.iter().map(Vec::as_slice))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    /// `n` parameters, each row of `phi` and the output it gives with some noise.
    fn record(n: usize, rows: usize) -> (Vec<f64>, Vec<f64>) {
        let (phi, e) = (white(n * rows, 7), white(rows, 8));
        let y = phi.chunks(n).zip(&e).map(|(p, e)| p.iter().sum::<f64>() + 0.1 * e).collect();
        (phi, y)
    }

    fn rls(n: usize, lambda: f64, P0: f64) -> Rls {
        Ud::identity(n, P0).and_then(|P0| Rls::new(P0, Scheme::constant(lambda))).expect("a sound start")
    }

    /// The textbook recursion on the whole matrix, fine for a few samples.
    fn textbook(phi: &[f64], y: &[f64], lambda: f64, theta: &mut [f64], P: &mut [f64]) {
        let n = theta.len();
        for (phi, y) in phi.chunks(n).zip(y) {
            let Pphi: Vec<f64> =
                P.chunks(n).map(|row| row.iter().zip(phi).map(|(p, x)| p * x).sum()).collect();
            let alpha = lambda + Pphi.iter().zip(phi).map(|(p, x)| p * x).sum::<f64>();
            let eps = y - theta.iter().zip(phi).map(|(t, x)| t * x).sum::<f64>();
            (0..n).for_each(|i| theta[i] += Pphi[i] / alpha * eps);
            (0..n * n).for_each(|k| P[k] = (P[k] - Pphi[k / n] * Pphi[k % n] / alpha) / lambda);
        }
    }

    #[test]
    fn the_factors_follow_the_textbook() {
        let (n, P0) = (3, [2.0, 0.5, -0.2, 0.5, 1.0, 0.1, -0.2, 0.1, 4.0]);
        let (phi, y) = record(n, 40);
        let (mut theta, mut P) = (vec![0.3, -1.0, 2.0], P0.to_vec());
        let start = Ud::of_matrix(n, &P0).and_then(|P0| Rls::new(P0, Scheme::constant(0.97)));
        let mut rls = start.and_then(|rls| rls.starting_at(&theta)).expect("a sound start");
        rls.run(&phi, &y).expect("sound rows");
        textbook(&phi, &y, 0.97, &mut theta, &mut P);
        let ours = [rls.theta().to_vec(), rls.P().matrix()].concat();
        for (ours, theirs) in ours.iter().zip([theta, P].concat()) {
            assert!((ours - theirs).abs() < 1e-12, "{ours} {theirs}");
        }
    }

    /// One direction never moves: forgetting lifts its variance to the bound, and no further.
    #[test]
    fn what_is_never_seen_stays_bounded() {
        let mut rls = rls(2, 0.9, 1.0);
        for _ in 0..20_000 {
            rls.update(&[1.0, 1.0], 3.0).expect("a sound row");
        }
        let P = rls.P().matrix();
        assert!(P.iter().all(|p| p.is_finite()) && P[0] <= 2.0 * rls.P().most()[0]);
        assert!((rls.theta()[0] + rls.theta()[1] - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_refused_sample_changes_nothing() {
        let (phi, y) = record(2, 10);
        let mut rls = rls(2, 0.99, 1e6);
        rls.run(&phi, &y).expect("sound rows");
        let before = rls.state();
        for (phi, y) in
            [(&[1.0][..], 0.0), (&[1.0, f64::NAN], 0.0), (&[1.0, 2.0], f64::INFINITY), (&[1e200, 0.0], 0.0)]
        {
            assert!(rls.update(phi, y).is_err());
        }
        assert_eq!(before, rls.state());
        assert!(rls.resume(&before[1..]).is_err());
    }

    #[test]
    fn a_batch_takes_rows_until_it_is_sound() {
        let mut phi = [1.0, 1.0].repeat(5);
        phi.extend(white(60, 1));
        let y: Vec<f64> = phi.chunks(2).map(|p| 3.0 * p[0] - p[1]).collect();
        let mut rls = rls(2, 1.0, 1.0);
        let rows = rls.begin(&phi, &y, 2).expect("a sound batch");
        assert_eq!(rows, 8);
        assert!((rls.theta()[0] - 3.0).abs() < 1e-13 && (rls.theta()[1] + 1.0).abs() < 1e-13);
        assert_eq!(rls.begin(&phi[..10], &y[..5], 2).expect_err("one direction").code(), "X02");
        assert_eq!(rls.begin(&phi[..2], &y[..1], 2).expect_err("one row").code(), "X03");
    }
}
