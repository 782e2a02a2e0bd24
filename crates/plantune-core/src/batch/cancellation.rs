//! Whether the orders of a fit are higher than the data show: factors that cancel inside their uncertainty (X10).
//!
//! A pole `p` of `F_i` cancels where `B_i(p) = 0`, a root of `D` where `C(p) = 0`, a pole of `A` where every
//! `B_i(p) = 0` and `C(p) = 0`: the factor leaves the model and nothing changes. With `g` these values, times
//! `p^k` so that a pole at zero is as good as any, and `J = dg/dtheta` through the coefficients and through `p`,
//!
//! ```text
//! g' (J P J')^-1 g / m  ~  F(m, N - n)          if the true value is zero
//! ```
//!
//! `B(p)` is tested and not the distance to a zero: where the first `b` is near zero, a zero may be anywhere and its
//! standard deviation says nothing. A pole and a zero of one input nearer than `limits.X10` are named as well.
//! ARX has no `C` to take the factor up: there the orders are too high where the last coefficients of `A` and of
//! every `B` may together be zero, which is a pole and a zero at the origin.
//!
//! Söderström and Stoica 1989, 11.5; Ljung 1999, 16.3.

use super::fit::Fit;
use super::orders::Orders;
use crate::limits::Limits;
use crate::linalg::{Complex, Triangle, solve};
use crate::model::derived::{Covariance, Root, roots_of};
use crate::model::{Model, PolyModel};
use crate::note::Note;
use crate::poly::roots;
use crate::stats::f_tail;

/// Least p-value at which a factor may cancel: two standard deviations of a single number.
const BY_CHANCE: f64 = 0.05;

/// X10 with the lower orders, where the orders of the fit are too high; `any_noise` where the errors may be of any
/// colour, and `A` and `B` alone share a factor (instruments).
pub(super) fn cancellation(fit: &Fit, orders: &Orders, any_noise: bool, limits: &Limits) -> Option<Note> {
    let Model::Poly(model) = &fit.model else { return None };
    let freedom = (fit.N - fit.theta.len()) as f64;
    let lower = Test { model, any_noise, P: Covariance(&fit.P), freedom, limits }.lower(orders);
    let poles = |orders: &Orders| orders.na + orders.nd + orders.nf.iter().sum::<usize>();
    let text = format!("poles and zeros cancel within their uncertainty: {lower} may do as well as {orders}");
    let note = Note::warning("X10", text).count(poles(orders) - poles(&lower));
    (lower != *orders).then_some(note.remedy(format!("ask for {lower}")))
}

/// A polynomial and where its free coefficients, from `first` on, stand in `theta`.
struct Factor<'p> {
    p: &'p [f64],
    first: usize,
    place: usize,
}

/// All of them.
struct Factors<'p> {
    a: Factor<'p>,
    b: Vec<Factor<'p>>,
    c: Factor<'p>,
    d: Factor<'p>,
    f: Vec<Factor<'p>>,
}

impl<'p> Factors<'p> {
    fn of(model: &'p PolyModel) -> Self {
        let mut next = 0;
        let mut take = |p: &'p Vec<f64>, first: usize| {
            let place = next;
            next += p.len() - first;
            Factor { p, first, place }
        };
        let a = take(&model.A, 1);
        let b = model.B.iter().map(|b| take(b, 0)).collect();
        let (c, d) = (take(&model.C, 1), take(&model.D, 1));
        Factors { a, b, c, d, f: model.F.iter().map(|f| take(f, 1)).collect() }
    }
}

struct Test<'f> {
    model: &'f PolyModel,
    any_noise: bool,
    P: Covariance<'f>,
    freedom: f64,
    limits: &'f Limits,
}

impl Test<'_> {
    /// The orders without what cancels.
    fn lower(&self, orders: &Orders) -> Orders {
        let mut lower = orders.clone();
        let factors = Factors::of(self.model);
        for (i, (f, b)) in factors.f.iter().zip(&factors.b).enumerate() {
            let shared = self.count(f, &[b], &[i]).min(lower.nb[i] - 1);
            lower.nf[i] -= shared;
            lower.nb[i] -= shared;
        }
        let shared = self.count(&factors.d, &[&factors.c], &[]).min(lower.nc);
        lower.nd -= shared;
        lower.nc -= shared;
        let mut most = lower.nb.iter().min().map_or(0, |nb| nb - 1);
        if orders.nc > 0 {
            most = most.min(lower.nc);
        }
        let shared = self.of_a(&factors, orders).min(most);
        lower.na -= shared;
        lower.nb.iter_mut().for_each(|nb| *nb -= shared);
        lower.nc = lower.nc.saturating_sub(shared);
        lower
    }

    /// How many factors `A` shares with every `B`, and with `C` where there is one.
    fn of_a(&self, factors: &Factors, orders: &Orders) -> usize {
        let Factors { a, b, c, .. } = factors;
        let inputs: Vec<usize> = (0..b.len()).collect();
        let bs: Vec<&Factor> = b.iter().collect();
        match (orders.nc, orders.nd) {
            (0, 0) if self.any_noise => self.count(a, &bs, &inputs),
            (0, 0) => self.tail(a, b).max(self.near(a, &inputs)),
            (0, _) => self.near(a, &inputs), // the factor may be one of the noise
            _ => self.count(a, &[bs, vec![c]].concat(), &inputs),
        }
    }

    /// How many roots of one polynomial the others have as well, inside the uncertainty or near.
    fn count(&self, of: &Factor, others: &[&Factor], inputs: &[usize]) -> usize {
        if others.iter().any(|other| other.p.len() < 2) {
            return 0;
        }
        let all = roots_of(of.p, of.first, of.place, self.model.theta().len());
        let cancels = |root: &&Root| self.is_zero(root, others) || self.is_near(root.z, inputs);
        all.iter().filter(cancels).count()
    }

    /// How many poles have a zero of every input near them.
    fn near(&self, of: &Factor, inputs: &[usize]) -> usize {
        roots(of.p).iter().filter(|(re, im)| self.is_near(Complex::new(*re, *im), inputs)).count()
    }

    fn is_near(&self, z: Complex<f64>, inputs: &[usize]) -> bool {
        let beside = |i: &usize| {
            roots(&self.model.B[*i])
                .iter()
                .any(|&(re, im)| (Complex::new(re, im) - z).norm() < self.limits.X10)
        };
        !inputs.is_empty() && inputs.iter().all(beside)
    }

    /// Whether all polynomials may vanish at a root.
    fn is_zero(&self, root: &Root, polynomials: &[&Factor]) -> bool {
        let mut g = Vec::new();
        let mut rows = Vec::new();
        for p in polynomials {
            let (value, slope) = at(p, root);
            g.push(value.re);
            rows.push(slope.iter().map(|s| s.re).collect::<Vec<f64>>());
            if root.z.im != 0.0 {
                g.push(value.im);
                rows.push(slope.iter().map(|s| s.im).collect());
            }
        }
        self.may_vanish(&g, &rows)
    }

    /// How many last coefficients of `A` and of every `B` may all be zero.
    fn tail(&self, a: &Factor, bs: &[Factor]) -> usize {
        let n = self.model.theta().len();
        let unit = |j: usize| (0..n).map(|k| f64::from(u8::from(j == k))).collect::<Vec<f64>>();
        let theta = self.model.theta();
        let last = |k: usize| {
            let of_a = (0..k).map(|j| a.place + a.p.len() - 2 - j);
            let of_b = bs.iter().flat_map(move |b| (0..k).map(move |j| b.place + b.p.len() - 1 - j));
            of_a.chain(of_b).collect::<Vec<usize>>()
        };
        let vanish = |k: usize| {
            let which = last(k);
            let g: Vec<f64> = which.iter().map(|&j| theta[j]).collect();
            self.may_vanish(&g, &which.into_iter().map(unit).collect::<Vec<_>>())
        };
        let most = bs.iter().map(|b| b.p.len() - 1).chain([a.p.len().saturating_sub(2)]).min().unwrap_or(0);
        (1..=most).take_while(|&k| vanish(k)).last().unwrap_or(0)
    }

    /// Whether `g` differs from zero by chance only.
    fn may_vanish(&self, g: &[f64], rows: &[Vec<f64>]) -> bool {
        let m = g.len();
        let covariance = self.P.of(rows);
        let own = |i: usize| covariance[i * m + i].sqrt();
        if !(0..m).all(|i| own(i) > 0.0 && own(i).is_finite()) {
            return false;
        }
        // In their own standard deviations.
        let row = |i: usize| {
            let scaled = (0..m).map(|j| covariance[i * m + j] / own(i) / own(j));
            scaled.chain([g[i] / own(i)]).collect::<Vec<f64>>()
        };
        let all: Vec<Vec<f64>> = (0..m).map(row).collect();
        let every: Vec<usize> = (0..m).collect();
        let triangle = Triangle::of_rows(m + 1, all.iter().map(Vec::as_slice));
        let Ok(x) = solve(&triangle, &every, m, 1e-12) else { return false };
        let statistic: f64 = x.theta.iter().zip(&all).map(|(x, row)| x * row[m]).sum();
        f_tail(statistic / m as f64, m as f64, self.freedom) > BY_CHANCE
    }
}

/// `z^k p` at a root that moves with `theta`, `k` the degree of `p`, and its derivatives.
fn at(p: &Factor, root: &Root) -> (Complex<f64>, Vec<Complex<f64>>) {
    let (z, k) = (root.z, p.p.len() - 1);
    let power = |j: usize| z.powu(j as u32);
    let value = p.p.iter().enumerate().map(|(j, c)| power(k - j) * *c).sum();
    let by_z: Complex<f64> =
        p.p[..k].iter().enumerate().map(|(j, c)| power(k - j - 1) * (c * (k - j) as f64)).sum();
    let mut slope: Vec<Complex<f64>> = root.slope.iter().map(|s| s * by_z).collect();
    (p.first..p.p.len()).for_each(|j| slope[p.place + j - p.first] += power(k - j));
    (value, slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::{PemOptions, arx, iv4, pem};
    use crate::linalg::white;
    use crate::poly::{divide, multiply};
    use crate::record::Record;
    use crate::sim::Start;

    const FIRST: [&[f64]; 2] = [&[0.5], &[1.0, -0.8]];
    const SECOND: [&[f64]; 2] = [&[0.5, 0.2], &[1.0, -1.5, 0.7]];

    /// The remedy of X10 in a fit of `orders` to `y = B/F u(t-1) + noise e`, `e` of a tenth.
    fn remedy([B, F]: [&[f64]; 2], noise: impl Fn(Vec<f64>) -> Vec<f64>, orders: &Orders) -> Option<String> {
        let N = 600;
        let (u, e) = (white(N, 1), white(N, 2));
        let plant =
            PolyModel { F: vec![F.to_vec()], ..PolyModel::arx(vec![1.0], vec![B.to_vec()], vec![1], 1.0) };
        let y: Vec<f64> =
            plant.simulate(&u, 1).iter().zip(noise(e)).map(|(y, e)| 7.0 + y + 0.1 * e).collect();
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let limits = Limits::default();
        let options = PemOptions { offset: true, start: Start::Estimate };
        let fit = if orders.is_arx() {
            arx(&rec, orders, true, &limits)
        } else {
            pem(&rec, orders, options, &limits)
        };
        said(&fit.expect("a fit"))
    }

    fn said(fit: &Fit) -> Option<String> {
        fit.notes.iter().find(|note| note.code == "X10").map(|note| note.remedy.clone())
    }

    fn as_it_is(e: Vec<f64>) -> Vec<f64> {
        e
    }

    fn over(p: &'static [f64]) -> impl Fn(Vec<f64>) -> Vec<f64> {
        move |mut e| {
            divide(p, &mut e);
            e
        }
    }

    fn box_jenkins(nb: usize, nc: usize, nd: usize, nf: usize) -> Orders {
        Orders { nc, nd, ..Orders::oe(vec![nb], vec![nf], vec![1]) }
    }

    #[test]
    fn one_pole_too_many_is_found_in_every_structure() {
        let ask = |orders: &str| Some(format!("ask for {orders}"));
        let oe = Orders::oe(vec![2], vec![2], vec![1]);
        assert_eq!(remedy(FIRST, as_it_is, &oe), ask("nb = 1, nf = 1"));
        let armax = Orders::armax(2, vec![2], 2, vec![1]);
        assert_eq!(
            remedy(FIRST, |e| multiply(&[1.0, 0.5], &over(FIRST[1])(e)), &armax),
            ask("na = 1, nb = 1, nc = 1")
        );
        let arx = Orders::arx(3, vec![3], vec![1]);
        assert_eq!(remedy(SECOND, over(SECOND[1]), &arx), ask("na = 2, nb = 2"));
        assert_eq!(
            remedy(FIRST, over(&[1.0, -0.5]), &box_jenkins(2, 0, 1, 2)),
            ask("nb = 1, nd = 1, nf = 1")
        );
    }

    #[test]
    fn orders_of_the_plant_are_left_alone() {
        assert_eq!(remedy(SECOND, as_it_is, &Orders::oe(vec![2], vec![2], vec![1])), None);
        assert_eq!(remedy(SECOND, over(SECOND[1]), &Orders::arx(2, vec![2], vec![1])), None);
        assert_eq!(
            remedy(
                SECOND,
                |e| multiply(&[1.0, 0.5], &over(SECOND[1])(e)),
                &Orders::armax(2, vec![2], 1, vec![1])
            ),
            None
        );
        assert_eq!(
            remedy(SECOND, |e| multiply(&[1.0, 0.6], &over(&[1.0, -0.5])(e)), &box_jenkins(2, 1, 1, 2)),
            None
        );
    }

    /// Where everything may be zero, poles beyond the zeros stay, and each `B` keeps a coefficient.
    #[test]
    fn no_order_falls_below_its_least() {
        let lower = |orders: Orders| {
            let theta: Vec<f64> = (0..orders.n()).map(|k| 0.4 - 0.1 * k as f64).collect();
            let n = theta.len();
            let P: Vec<f64> = (0..n * n).map(|ij| if ij % (n + 1) == 0 { 1e4 } else { 0.0 }).collect();
            let (model, limits) = (&orders.model(&theta, 1.0), &Limits::default());
            Test { model, any_noise: false, P: Covariance(&P), freedom: 1e3, limits }.lower(&orders)
        };
        assert_eq!(lower(box_jenkins(2, 1, 3, 3)), box_jenkins(1, 0, 2, 2));
        assert_eq!(
            lower(Orders { na: 2, nc: 1, ..box_jenkins(3, 1, 1, 2) }),
            Orders { na: 2, ..box_jenkins(1, 0, 0, 0) }
        );
    }

    /// Instruments: noise of any colour, so that the factor need not be zero.
    #[test]
    fn instruments_leave_a_factor_of_a_and_b_to_chance() {
        let (u, e) = (white(2000, 1), over(&[1.0, -0.9])(white(2000, 2)));
        let plant = PolyModel::arx(FIRST[1].to_vec(), vec![FIRST[0].to_vec()], vec![1], 1.0);
        let y: Vec<f64> = plant.simulate(&u, 1).iter().zip(&e).map(|(y, e)| y + 0.1 * e).collect();
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let of = |n: usize| {
            iv4(&rec, &Orders::arx(n, vec![n], vec![1]), true, 1, &Limits::default()).expect("a fit")
        };
        assert_eq!(said(&of(2)), Some("ask for na = 1, nb = 1".into()));
        assert_eq!(said(&of(1)), None);
    }

    /// However exactly they are known: a pole at 0.8 and a zero at 0.795.
    #[test]
    fn a_near_pair_is_named_whatever_its_uncertainty() {
        let (near, far): ([&[f64]; 2], [&[f64]; 2]) =
            ([&[0.5, -0.3975], &[1.0, -1.4, 0.48]], [&[0.5, -0.38], &[1.0, -1.4, 0.48]]);
        let nothing = |e: Vec<f64>| e.iter().map(|e| 1e-4 * e).collect();
        let oe = Orders::oe(vec![2], vec![2], vec![1]);
        assert_eq!(remedy(near, nothing, &oe), Some("ask for nb = 1, nf = 1".into()));
        assert_eq!(remedy(far, nothing, &oe), None);
    }

    /// Through the coefficients and through the root, against differences; of a pair and of a real root.
    #[test]
    fn values_at_a_root_move_as_they_say() {
        let theta = [0.5, 0.2, -0.3, -1.5, 0.7, 0.4];
        let value = |theta: &[f64], k: usize| {
            let f = [&[1.0], &theta[3..]].concat();
            let root = roots_of(&f, 1, 3, 6).swap_remove(k);
            at(&Factor { p: &theta[..3], first: 0, place: 0 }, &root)
        };
        for k in 0..3 {
            for j in 0..6 {
                let moved = |h: f64| {
                    let mut theta = theta;
                    theta[j] += h;
                    value(&theta, k).0
                };
                let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                assert!((slope - value(&theta, k).1[j]).norm() < 1e-8, "{k} {j}");
            }
        }
    }
}
