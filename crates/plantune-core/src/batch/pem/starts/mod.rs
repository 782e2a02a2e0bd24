//! Where the search begins: least squares on the data, on what a long ARX makes of them, and iterated.
//!
//! 1. ARX of the orders asked for; its `A` is the first `F`, and `C = 1`.
//! 2. A long ARX first: its simulated paths, free of noise, give `B_i/F_i` by least squares; its errors stand
//!    for `e(t-1), …` in the regression for `C` (Hannan and Rissanen 1982).
//! 3. Steiglitz and McBride 1965: ARX on data divided by the last `F`, for output errors.
//!
//! Where these are not enough, or noise has a `D`, there are more: plants without their noise, from the above,
//! from instruments ([`super::super::iv4`]) and from a search of their own, each with a noise model of what it
//! leaves ([`noise`]); weighted null-space fitting ([`wnsf`]); random ones ([`random`]).
//!
//! Source 000, (2.2-5); Ljung 1999, 10.5; METHODS 2.1.

mod noise;
mod random;
mod wnsf;

use self::noise::with_noise;
use self::random::random;
use self::wnsf::wnsf;
use super::super::arx::columns;
use super::super::iv4;
use super::super::orders::Orders;
use super::predictor::Predictor;
use super::search::global_minimum;
use crate::linalg::solve;
use crate::model::PolyModel;
use crate::poly::{at_one, divide, is_stable, reflected};
use crate::record::Record;
use crate::regress::Regression;

/// Pivots below this share: no start from this regression.
const RANK_TOLERANCE: f64 = 1e-9;

/// Order of the long ARX, as a multiple of the orders asked for.
const LONG: usize = 4;

/// Rows per coefficient of the long ARX.
const ROWS: usize = 10;

const ROUNDS: usize = 12;

/// Lags of the long ARX in weighted null-space fitting.
const LAGS: [usize; 2] = [15, 30];

const RANDOM: u64 = 3;

/// Gives `theta`, and the constant if there is one.
pub(super) type Method = fn(&Predictor) -> Option<Vec<f64>>;

/// The quick methods, in the order in which they are tried.
pub(super) const METHODS: [Method; 3] = [direct, long, iterated];

/// All others: `theta`, in which `A`, `B` and the constant are still to be found where `C D F` are as they say.
pub(super) fn others(predictor: &Predictor) -> Vec<Vec<f64>> {
    let orders = predictor.orders();
    let plants = if orders.has_many_minima() {
        plants(predictor)
    } else {
        by_instruments(predictor).into_iter().collect()
    };
    let lags = LAGS.iter().filter_map(|&n| wnsf(predictor, n));
    plants.into_iter().chain(lags).chain((1..=RANDOM).map(|seed| random(predictor, seed))).collect()
}

/// Plants, each with a model of the noise that it leaves.
fn plants(predictor: &Predictor) -> Vec<Vec<f64>> {
    let orders = predictor.orders();
    let own = Orders { nc: 0, nd: 0, ..orders.clone() };
    let plant = predictor.of(&own);
    let quick = METHODS.iter().filter_map(|method| method(&plant)).chain(by_instruments(&plant));
    let mut found: Vec<Vec<f64>> = quick.filter_map(|theta| with_noise(predictor, &theta, &own)).collect();
    for simpler in simpler(orders) {
        let minimum = global_minimum(&mut predictor.of(&simpler));
        let plant = minimum.map(|m| as_plant(&simpler, &m.theta, &own));
        found.extend(plant.and_then(|theta| with_noise(predictor, &theta, &own)));
    }
    found
}

/// The plant by instruments, for one output noise or another.
fn by_instruments(predictor: &Predictor) -> Option<Vec<f64>> {
    let orders = predictor.orders();
    let na = if orders.na > 0 { orders.na } else { orders.nf.iter().copied().max().unwrap_or(0) };
    let own = Orders::arx(na, orders.nb.clone(), orders.nk.clone());
    let model = iv4::start(&predictor.data(), &own, predictor.constant())?;
    let plant = theta(orders, |_| (reflected_if_needed(model.A.clone()), model.B.clone()));
    if orders.na == 0 || orders.nc == 0 {
        return Some(plant);
    }
    let known = Orders { nc: 0, ..orders.clone() };
    with_noise(predictor, &model.theta(), &known)
}

/// Structures with few minima that hold the plant: output errors, and ARMAX.
fn simpler(orders: &Orders) -> Vec<Orders> {
    let nc = orders.nc.max(orders.nd);
    let nu = orders.nb.len();
    let na = if orders.na > 0 { orders.na } else { orders.nf.iter().copied().max().unwrap_or(0) };
    let armax = Orders { na, nc, nd: 0, nf: vec![0; nu], ..orders.clone() };
    let oe = Orders { nc: 0, nd: 0, ..orders.clone() };
    if orders.na > 0 { vec![armax] } else { vec![oe, armax] }
}

/// The plant of a simpler structure, whose `A` stands for every `F_i` where it has none.
fn as_plant(simpler: &Orders, found: &[f64], own: &Orders) -> Vec<f64> {
    let from = simpler.model(&found[..simpler.n()], 1.0);
    let poles = |i: usize| if own.na > 0 || simpler.nf[i] == 0 { &from.A } else { &from.F[i] };
    theta(own, |i| (reflected_if_needed(poles(i).clone()), from.B.clone()))
}

/// `theta` and the constant from ARX of the orders asked for.
fn direct(predictor: &Predictor) -> Option<Vec<f64>> {
    let orders = predictor.orders();
    let na = if orders.na > 0 { orders.na } else { orders.nf.iter().copied().max().unwrap_or(0) };
    let found = arx(predictor.record(), na, &orders.nb, &orders.nk, predictor.constant())?;
    let (model, d) = scaled(predictor, found);
    let theta = theta(orders, |_| (model.A.clone(), model.B.clone()));
    Some(with_constant(theta, predictor, &model, d))
}

/// The same by way of a long ARX.
fn long(predictor: &Predictor) -> Option<Vec<f64>> {
    let (orders, data) = (predictor.orders(), predictor.data());
    let most = orders.nb.iter().chain(&orders.nf).chain([&orders.na, &orders.nc]).max().copied().unwrap_or(1);
    let m = (LONG * most).min(data.N() / (ROWS * (1 + data.nu)));
    if m <= most {
        return None;
    }
    let (long, d) = arx(&data, m, &vec![m; data.nu], &orders.nk, predictor.constant())?;
    if orders.na > 0 {
        return hannan_rissanen(predictor, &data, &long);
    }
    let A = if is_stable(&long.A) { long.A.clone() } else { reflected(&long.A) };
    let path = |i: usize| {
        let mut u = vec![0.0; data.u.len()];
        u.iter_mut().zip(data.u).skip(i).step_by(data.nu).for_each(|(to, from)| *to = *from);
        let y = PolyModel { A: A.clone(), ..long.clone() }.simulate(&u, data.nu);
        let own: Vec<f64> = u.into_iter().skip(i).step_by(data.nu).collect();
        let rec = Record { u: &own, y: &y, nu: 1, valid: None, ..data.clone() };
        arx(&rec, orders.nf[i], &orders.nb[i..=i], &orders.nk[i..=i], false).map(|(path, _)| path)
    };
    let paths: Vec<PolyModel> = (0..data.nu).map(path).collect::<Option<_>>()?;
    let B: Vec<Vec<f64>> = paths.iter().map(|p| p.B[0].clone()).collect();
    let theta = theta(orders, |i| (paths[i].A.clone(), B.clone()));
    Some(with_constant(theta, predictor, &long, d))
}

/// `[a b c]` with the errors of the long ARX as one more input.
fn hannan_rissanen(predictor: &Predictor, data: &Record, long: &PolyModel) -> Option<Vec<f64>> {
    let orders = predictor.orders();
    let N = data.N();
    let mut both = vec![0.0; N * (data.nu + 1)];
    for s in data.segments() {
        let u = &data.u[s.start * data.nu..s.end * data.nu];
        let e = long.prediction_error(u, data.nu, &data.y[s.clone()]).forced;
        for (k, e) in (s.start + long.history().min(s.len())..s.end).zip(e) {
            both[k * (data.nu + 1) + data.nu] = e;
        }
        for k in s {
            both[k * (data.nu + 1)..][..data.nu].copy_from_slice(&data.u[k * data.nu..][..data.nu]);
        }
    }
    let rec = Record { u: &both, nu: data.nu + 1, ..data.clone() };
    let nb = [orders.nb.as_slice(), &[orders.nc]].concat();
    let nk = [orders.nk.as_slice(), &[1]].concat();
    let (model, d) = arx(&rec, orders.na, &nb, &nk, predictor.constant())?;
    let C = [&[1.0], model.B[data.nu].as_slice()].concat();
    let mut start = theta(orders, |_| (model.A.clone(), model.B[..data.nu].to_vec()));
    let before = orders.na + orders.nb.iter().sum::<usize>();
    start[before..before + orders.nc].copy_from_slice(&reflected_if_needed(C)[1..]);
    Some(with_constant(start, predictor, &model, d))
}

/// Steiglitz and McBride's rounds, where all inputs share one `F`.
fn iterated(predictor: &Predictor) -> Option<Vec<f64>> {
    let (orders, data) = (predictor.orders(), predictor.data());
    let nf = *orders.nf.first()?;
    if orders.na > 0 || nf == 0 || orders.nf.iter().any(|&n| n != nf) {
        return None;
    }
    let mut F = vec![1.0];
    let mut model = None;
    for _ in 0..ROUNDS {
        let through = |x: &[f64], width: usize| {
            let mut out = x.to_vec();
            for s in data.segments() {
                for i in 0..width {
                    let mut column: Vec<f64> = s.clone().map(|k| x[k * width + i]).collect();
                    divide(&F, &mut column);
                    s.clone().zip(column).for_each(|(k, v)| out[k * width + i] = v);
                }
            }
            out
        };
        let (u, y) = (through(data.u, data.nu), through(data.y, 1));
        let rec = Record { u: &u, y: &y, ..data.clone() };
        let next = arx(&rec, nf, &orders.nb, &orders.nk, predictor.constant())?;
        F = reflected_if_needed(next.0.A.clone());
        model = Some(next);
    }
    let (model, d) = model?;
    let theta = theta(orders, |_| (F.clone(), model.B.clone()));
    // The data were divided by the F before the last, which a constant passes with its static gain.
    Some(with_constant(theta, predictor, &model, d))
}

/// An ARX and its constant, from the record's units to those of the predictor.
fn scaled(predictor: &Predictor, (mut model, mut d): (PolyModel, f64)) -> (PolyModel, f64) {
    let y = predictor.scale_y;
    d -= at_one(&model.A) * y.zero;
    for (b, u) in model.B.iter_mut().zip(&predictor.scale_u) {
        d += at_one(b) * u.zero;
        b.iter_mut().for_each(|b| *b *= y.factor / u.factor);
    }
    (model, d * y.factor)
}

/// ARX and its constant, in the units of the record.
fn arx(rec: &Record, na: usize, nb: &[usize], nk: &[usize], constant: bool) -> Option<(PolyModel, f64)> {
    let orders = Orders::arx(na, nb.to_vec(), nk.to_vec());
    let regression = Regression::new(rec, 0, columns(&orders, constant));
    let all = orders.n() + usize::from(constant);
    if regression.N() <= all {
        return None;
    }
    let every: Vec<usize> = (0..all).collect();
    let mut theta = solve(&regression.triangle(), &every, all, RANK_TOLERANCE).ok()?.theta;
    let mut next = na;
    for (i, &nb) in nb.iter().enumerate() {
        let unit = regression.u[i].factor / regression.y.factor;
        theta[next..next + nb].iter_mut().for_each(|b| *b *= unit);
        next += nb;
    }
    let model = orders.model(&theta[..orders.n()], rec.Ts);
    let levels = model.B.iter().zip(&regression.u).map(|(b, u)| at_one(b) * u.zero).sum::<f64>();
    let own = theta.get(orders.n()).map_or(0.0, |d| d / regression.y.factor);
    let d = own + at_one(&model.A) * regression.y.zero - levels;
    Some((model, d))
}

/// `theta` with the constant `d` of an ARX behind it, which output errors see through `1/A`.
fn with_constant(mut theta: Vec<f64>, predictor: &Predictor, model: &PolyModel, d: f64) -> Vec<f64> {
    let through_A = predictor.orders().na == 0;
    let d = if through_A { d / at_one(&model.A) } else { d };
    theta.extend(predictor.constant().then_some(if d.is_finite() { d } else { 0.0 }));
    theta
}

/// `theta` from `(poles, [B])` of each input: the poles are `A` where there is one, else `F_i`.
fn theta(orders: &Orders, of: impl Fn(usize) -> (Vec<f64>, Vec<Vec<f64>>)) -> Vec<f64> {
    let mut model = orders.model(&vec![0.0; orders.n()], 1.0);
    let fill = |p: &mut [f64], from: &[f64]| p.iter_mut().zip(from).for_each(|(p, c)| *p = *c);
    for i in 0..orders.nb.len() {
        let (poles, B) = of(i);
        fill(&mut model.B[i], &B[i]);
        if orders.na > 0 { fill(&mut model.A, &poles) } else { fill(&mut model.F[i], &poles) }
    }
    model.theta()
}

fn reflected_if_needed(p: Vec<f64>) -> Vec<f64> {
    if is_stable(&p) { p } else { reflected(&p) }
}
