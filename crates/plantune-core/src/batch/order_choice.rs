//! Which orders: every candidate on the same rows, by criteria and by its loss on fresh rows.
//!
//! ```text
//! FPE = V (1 + d/N)/(1 - d/N),   AIC = N ln V + 2 d,   BIC = N ln V + d ln N,   V = |eps|^2 / N
//! fresh = mean squared one-step error on rows that no candidate has seen, offset and all
//! ```
//!
//! A criterion compares models of one set of rows only, so all begin where the longest history of any of them
//! ends. ARX candidates are selections of columns of one triangle that holds every lag; their errors on fresh
//! rows come from a second triangle in the same units. Others are fitted one by one, with the earlier rows
//! marked as not counting.
//!
//! Source 001, 3.5.5; Akaike 1974, Schwarz 1978; Ljung 1999, 16.4.

use super::fit::{Status, criteria};
use super::orders::Orders;
use super::pem::{PemOptions, pem};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::linalg::{Triangle, solve};
use crate::model::Model;
use crate::note::{Note, listed};
use crate::record::Record;
use crate::regress::{Column, Regression};
use crate::sim::{Start, over_record};

/// Difference of BIC that is "not worth more than a bare mention" (Kass and Raftery 1995).
const BARE: f64 = 2.0;

/// Orders named in a note.
const NAMED: usize = 4;

/// One candidate and what it leaves.
#[derive(Clone, Debug)]
pub struct Tried {
    /// Its orders and delays.
    pub orders: Orders,
    /// Number of coefficients.
    pub d: usize,
    /// Mean squared one-step error on the rows of the fit.
    pub loss: f64,
    /// Akaike's final prediction error.
    pub fpe: f64,
    /// Akaike's criterion.
    pub aic: f64,
    /// Schwarz's criterion.
    pub bic: f64,
    /// Mean squared one-step error on fresh rows.
    pub fresh: Option<f64>,
    /// Whether the search ended at a minimum.
    pub converged: bool,
}

/// All candidates that the record supports, and the choice among them.
#[derive(Clone, Debug)]
pub struct OrderChoice {
    /// In the order given.
    pub rows: Vec<Tried>,
    /// Which of them is chosen.
    pub best: usize,
    /// The next best, where there is another.
    pub runner_up: Option<usize>,
    /// Candidates that the record does not support.
    pub refused: usize,
    /// Rows on which all were fitted.
    pub N: usize,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Tries all candidates on `rec`, and on `fresh` if there is one.
///
/// With fresh rows the smallest model wins whose loss there is within the share X06 of the least; without,
/// the least BIC.
pub fn choose_orders(
    rec: &Record,
    candidates: &[Orders],
    fresh: Option<&Record>,
    offset: bool,
    limits: &Limits,
) -> Result<OrderChoice> {
    let mut supported = Vec::new();
    let mut refusal = None;
    for orders in candidates {
        match orders.check(rec, offset, limits) {
            Ok(()) => supported.push(orders),
            Err(error) => refusal = refusal.or(Some(error)),
        }
    }
    let is_arx = supported.iter().all(|o| o.nc + o.nd + o.nf.iter().sum::<usize>() == 0);
    let (N, rows) = match (supported.is_empty(), is_arx) {
        (true, _) => (0, Vec::new()),
        (_, true) => by_one_triangle(rec, &supported, fresh, offset, limits)?,
        (_, false) => one_by_one(rec, &supported, fresh, offset, limits, &mut refusal)?,
    };
    if rows.is_empty() {
        let none = || Error::argument("candidates", "none", "at least one set of orders");
        return Err(refusal.unwrap_or_else(none));
    }
    let (best, runner_up) = choice(&rows, limits);
    let refused = candidates.len() - rows.len();
    let notes = notes(&rows, best, refused, limits);
    Ok(OrderChoice { rows, best, runner_up, refused, N, notes })
}

/// ARX: one triangle holds every lag of every candidate.
fn by_one_triangle(
    rec: &Record,
    candidates: &[&Orders],
    fresh: Option<&Record>,
    offset: bool,
    limits: &Limits,
) -> Result<(usize, Vec<Tried>)> {
    let lags = Lags::of(candidates, offset);
    let regression = Regression::new(rec, 0, lags.columns());
    let (N, triangle) = (regression.N(), regression.triangle());
    let later = fresh.map(|fresh| {
        let mut same = Regression::new(fresh, 0, lags.columns());
        (same.u, same.y) = (regression.u.clone(), regression.y);
        (same.N(), same.triangle())
    });
    let unit = regression.y.factor.powi(2);
    let tried = |orders: &&Orders| {
        let columns = lags.of_candidate(orders);
        if N <= columns.len() {
            return None;
        }
        let solution = solve(&triangle, &columns, triangle.n() - 1, limits.X08).ok()?;
        let fresh = later
            .as_ref()
            .filter(|(N, _)| *N > 0)
            .map(|(N, triangle)| rest(triangle, &columns, &solution.theta) / unit / *N as f64);
        Some(Tried::new(orders, solution.rss / unit / N as f64, N, fresh, true))
    };
    Ok((N, candidates.iter().filter_map(tried).collect()))
}

/// Which lags the triangle of all ARX candidates holds.
struct Lags {
    na: usize,
    /// Lowest and highest lag of each input.
    u: Vec<(usize, usize)>,
    offset: bool,
}

impl Lags {
    fn of(candidates: &[&Orders], offset: bool) -> Self {
        let na = candidates.iter().map(|o| o.na).max().unwrap_or(0);
        let input = |i: usize| {
            let low = candidates.iter().map(|o| o.nk[i]).min().unwrap_or(0);
            let high = candidates.iter().map(|o| o.nk[i] + o.nb[i] - 1).max().unwrap_or(0);
            (low, high)
        };
        Lags { na, u: (0..candidates[0].nb.len()).map(input).collect(), offset }
    }

    fn columns(&self) -> Vec<Column> {
        let inputs = self.u.iter().enumerate();
        let inputs = inputs.flat_map(|(i, &(low, high))| (low..=high).map(move |lag| Column::Input(i, lag)));
        let outputs = (1..=self.na).map(Column::MinusOutput);
        outputs.chain(inputs).chain(self.offset.then_some(Column::One)).collect()
    }

    /// Places of one candidate's columns.
    fn of_candidate(&self, orders: &Orders) -> Vec<usize> {
        let mut columns: Vec<usize> = (0..orders.na).collect();
        let mut first = self.na;
        for (i, &(low, high)) in self.u.iter().enumerate() {
            let from = first + orders.nk[i] - low;
            columns.extend(from..from + orders.nb[i]);
            first += high + 1 - low;
        }
        columns.extend(self.offset.then_some(first));
        columns
    }
}

/// `|R[:, columns] theta - R[:, last]|^2`.
fn rest(triangle: &Triangle, columns: &[usize], theta: &[f64]) -> f64 {
    let last = triangle.n() - 1;
    let at = |i: usize, j: usize| if i <= j { triangle.at(i, j) } else { 0.0 };
    let error = |i: usize| at(i, last) - columns.iter().zip(theta).map(|(&j, t)| at(i, j) * t).sum::<f64>();
    (0..=last).map(|i| error(i).powi(2)).sum()
}

/// Prediction errors: each candidate on the rows after the longest history of all.
fn one_by_one(
    rec: &Record,
    candidates: &[&Orders],
    fresh: Option<&Record>,
    offset: bool,
    limits: &Limits,
    refusal: &mut Option<Error>,
) -> Result<(usize, Vec<Tried>)> {
    let history = candidates.iter().map(|o| o.history()).max().unwrap_or(0);
    let options = PemOptions { offset, start: Start::Estimate };
    let mut N = 0;
    let mut rows = Vec::new();
    for &orders in candidates {
        let valid = counting(rec, orders, history);
        let same = Record { valid: Some(&valid), ..rec.clone() };
        match pem(&same, orders, options, limits) {
            Ok(fit) => {
                N = fit.N;
                let fresh = fresh.map(|f| fresh_loss(&fit.model, f, fit.offset, history)).transpose()?;
                rows.push(Tried::new(orders, fit.loss, fit.N, fresh, fit.status == Status::Converged));
            }
            Err(error) => *refusal = refusal.take().or(Some(error)),
        }
    }
    Ok((N, rows))
}

/// Which outputs count if residuals shall begin after `history` rows, whatever the orders.
fn counting(rec: &Record, orders: &Orders, history: usize) -> Vec<bool> {
    let mut valid: Vec<bool> = (0..rec.N()).map(|k| rec.is_valid(k, 0)).collect();
    let remembers_y = orders.na + orders.nc + orders.nd > 0;
    // A search that needs past outputs begins its own history at the first that counts.
    let (stretches, skip): (Vec<_>, usize) = if remembers_y {
        (rec.runs(0, 0, 0), history - orders.history())
    } else {
        (rec.segments().collect(), history)
    };
    for s in stretches {
        valid[s.start..s.end.min(s.start + skip)].fill(false);
    }
    valid
}

/// Mean squared one-step error on the rows of `fresh` after `history` rows of each segment.
fn fresh_loss(model: &Model, fresh: &Record, offset: f64, history: usize) -> Result<f64> {
    let run = over_record(model, fresh, Some(1), Start::Estimate, Some(offset))?;
    let mut late = vec![false; fresh.N()];
    for s in fresh.segments() {
        late[s.end.min(s.start + history)..s.end].fill(true);
    }
    let counts = |k: &usize| late[*k] && fresh.is_valid(*k, 0);
    let errors: Vec<f64> = (run.rows.iter().zip(&run.yhat))
        .filter(|(k, _)| counts(k))
        .map(|(&k, yhat)| fresh.y_at(k, 0) - yhat)
        .collect();
    Ok(errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64)
}

impl Tried {
    fn new(orders: &Orders, loss: f64, N: usize, fresh: Option<f64>, converged: bool) -> Self {
        let d = orders.n();
        let (fpe, aic, bic) = criteria(loss, N, d);
        Tried { orders: orders.clone(), d, loss, fpe, aic, bic, fresh, converged }
    }

    /// Whether it does about as well as `best` by what decides.
    fn ties(&self, best: &Tried, limits: &Limits) -> bool {
        match (self.fresh, best.fresh) {
            (Some(own), Some(least)) => own <= least * (1.0 + limits.X06),
            _ => self.bic - best.bic < BARE,
        }
    }

    fn decides(&self) -> f64 {
        self.fresh.unwrap_or(self.bic)
    }
}

/// The chosen candidate and the next.
fn choice(rows: &[Tried], limits: &Limits) -> (usize, Option<usize>) {
    let sound = |k: &usize| rows[*k].converged || rows.iter().all(|row| !row.converged);
    let by = |a: &usize, b: &usize| rows[*a].decides().total_cmp(&rows[*b].decides());
    let least = (0..rows.len()).filter(sound).min_by(by).unwrap_or(0);
    let smallest = |a: &usize, b: &usize| rows[*a].d.cmp(&rows[*b].d).then(by(a, b));
    let near = (0..rows.len()).filter(sound).filter(|&k| rows[k].ties(&rows[least], limits));
    let best = if rows[least].fresh.is_some() { near.min_by(smallest).unwrap_or(least) } else { least };
    (best, (0..rows.len()).filter(|&k| k != best).filter(sound).min_by(by))
}

fn notes(rows: &[Tried], best: usize, refused: usize, limits: &Limits) -> Vec<Note> {
    let chosen = &rows[best];
    let mut notes: Vec<Note> = near_ties(rows, best, limits).into_iter().collect();
    let all = |n: Count| rows.iter().map(move |row| n(&row.orders));
    let counts: [(&str, Count); 5] = [
        ("na", |o| o.na),
        ("nb", |o| o.nb.iter().copied().max().unwrap_or(0)),
        ("nc", |o| o.nc),
        ("nd", |o| o.nd),
        ("nf", |o| o.nf.iter().copied().max().unwrap_or(0)),
    ];
    let at_end = counts.into_iter().filter(|(_, n)| {
        let most = all(*n).max().unwrap_or(0);
        n(&chosen.orders) == most && all(*n).min() < Some(most)
    });
    let at_end: Vec<&str> = at_end.map(|(name, _)| name).collect();
    if !at_end.is_empty() {
        let (verb, end) = if at_end.len() > 1 { ("lie", "ends") } else { ("lies", "end") };
        let names: Vec<String> = at_end.iter().map(|name| (*name).to_owned()).collect();
        let text = format!("the best {} {verb} at the {end} of the orders tried", listed(&names));
        notes.push(Note::warning("V14", text).remedy("try higher orders"));
    }
    if refused > 0 {
        let (candidates, them) =
            if refused > 1 { ("candidates are", "them") } else { ("candidate is", "it") };
        let text = format!("{refused} {candidates} left out: the record does not support {them}");
        notes.push(Note::info("V14", text).count(refused));
    }
    notes
}

/// How many coefficients of a kind.
type Count = fn(&Orders) -> usize;

/// V14: others do about as well as the chosen one; X06 where they have another delay.
fn near_ties(rows: &[Tried], best: usize, limits: &Limits) -> Option<Note> {
    let chosen = &rows[best];
    let near = |k: &usize| *k != best && rows[*k].ties(chosen, limits);
    let mut others: Vec<&Tried> = (0..rows.len()).filter(near).map(|k| &rows[k]).collect();
    others.sort_by(|a, b| a.decides().total_cmp(&b.decides()));
    let closest = others.first()?;
    let say = |row: &&Tried| format!("({}, nk = {:?})", row.orders, row.orders.nk);
    let named: Vec<String> = others.iter().take(NAMED).map(say).collect();
    let more = if others.len() > NAMED { ", …" } else { "" };
    let other_delay = others.iter().any(|row| row.orders.nk != chosen.orders.nk);
    let text = format!("other orders do about as well: {}{more}", named.join(", "));
    let (measured, limit) = match (closest.fresh, chosen.fresh) {
        (Some(own), Some(least)) => (own / least - 1.0, limits.X06),
        _ => (closest.bic - chosen.bic, BARE),
    };
    let note = Note::warning(if other_delay { "X06" } else { "V14" }, text);
    Some(
        note.count(others.len())
            .measured(measured, limit)
            .remedy("take the smallest that simulates well, or record more to tell them apart"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::arx;
    use crate::linalg::white;
    use crate::model::PolyModel;

    fn data(N: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let (u, e) = (white(N, seed), white(N, seed + 1));
        let plant = PolyModel::arx(vec![1.0, -1.3, 0.42], vec![vec![0.5, 0.3]], vec![2], 1.0);
        let noise = PolyModel::arx(vec![1.0, -1.3, 0.42], vec![vec![0.3]], vec![0], 1.0).simulate(&e, 1);
        let y = plant.simulate(&u, 1).iter().zip(noise).map(|(y, v)| 40.0 + y + v).collect();
        (u, y)
    }

    fn grid() -> Vec<Orders> {
        let mut all = Vec::new();
        for na in 1..=4 {
            for nb in 1..=3 {
                all.extend((1..=3).map(|nk| Orders::arx(na, vec![nb], vec![nk])));
            }
        }
        all
    }

    /// Selections from one triangle against fits one by one on the same rows, and on fresh ones.
    #[test]
    fn one_triangle_is_as_many_fits() {
        let ((u, y), (uf, yf)) = (data(400, 1), data(300, 7));
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let fresh = Record::uniform(&uf, 1, &yf, 1, 1.0).expect("fine");
        let limits = Limits::default();
        let found = choose_orders(&rec, &grid(), Some(&fresh), true, &limits).expect("a choice");
        assert_eq!((found.rows.len(), found.N), (36, 395));
        for row in &found.rows {
            // The longest history is nk + nb - 1 = 5 rows; leave out those that this one does not need.
            let skip = 5 - row.orders.history();
            let late = Record::uniform(&u[skip..], 1, &y[skip..], 1, 1.0).expect("fine");
            let fit = arx(&late, &row.orders, true, &limits).expect("a fit");
            assert_eq!(fit.N, 395);
            assert!((fit.loss / row.loss - 1.0).abs() < 1e-9, "{:?}", row.orders);
            let loss = fresh_loss(&fit.model, &fresh, fit.offset, 5).expect("a loss");
            assert!((loss / row.fresh.expect("fresh") - 1.0).abs() < 1e-9, "{:?}", row.orders);
        }
        let best = &found.rows[found.best].orders;
        assert_eq!((best.na, best.nk[0]), (2, 2));
    }

    /// Candidates by prediction errors count the same rows, holes included.
    #[test]
    fn prediction_errors_are_compared_on_the_same_rows() {
        let (u, y) = data(400, 3);
        let valid: Vec<bool> = (0..400).map(|k| k != 200).collect();
        let mut rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        rec.valid = Some(&valid);
        let limits = Limits::default();
        for armax in [false, true] {
            let orders: Vec<Orders> = (1..=3)
                .map(|n| {
                    if armax {
                        Orders::armax(n, vec![n], 1, vec![2])
                    } else {
                        Orders::oe(vec![n], vec![n], vec![2])
                    }
                })
                .collect();
            let rows: Vec<usize> = orders
                .iter()
                .map(|o| {
                    let counts = counting(&rec, o, 4);
                    let same = Record { valid: Some(&counts), ..rec.clone() };
                    let options = PemOptions { offset: true, start: Start::Estimate };
                    pem(&same, o, options, &limits).expect("a fit").N
                })
                .collect();
            assert!(rows.iter().all(|N| *N == rows[0]), "{rows:?}");
        }
    }
}
