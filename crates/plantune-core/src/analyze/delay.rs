//! Delay by a scan of ARX models, their order chosen as well.
//!
//! A first-order scan is a sample late on second-order plants, so every delay is tried with orders
//! `n = na = nb = 1 … 4`, the order judged by BIC. A delay that is too short loses nothing but a
//! coefficient; so the longest delay is chosen that costs neither the loss nor what the input explains
//! more than a share too small to matter; of a periodic input the longest below its period, since one that is a
//! period longer does the same. All candidates share their rows: one QR holds every lag, and
//! each candidate is a selection of its columns. Source 001, 3.5.4.

use super::period::period;
use crate::error::{Error, Result};
use crate::excitation::{LEAST_EXCITATION, check_input_motion, excitation_order, too_poor};
use crate::limits::Limits;
use crate::linalg::{Triangle, residual_norm2};
use crate::note::{Note, Place, rounded};
use crate::record::Record;
use crate::regress::{Column, Regression};
use crate::relation::{beyond, follows_later};
use crate::stats::f_tail;

/// Highest order tried.
const MOST_ORDER: usize = 4;

/// Share of what the input explains that a longer delay may lose.
const LOST: f64 = 0.02;

/// Share of the least loss by which a longer delay may raise it.
const RAISED: f64 = 0.05;

/// Lags of the regression that tells relation from chance, and rows per lag of each signal.
const LONG: usize = 10;
const ROWS: usize = 10;

/// Pivots below this share add nothing to a candidate.
const TOLERANCE: f64 = 1e-10;

/// The delays tried and what each of them leaves unexplained.
#[derive(Clone, Debug)]
pub struct DelayScan {
    /// Chosen delay, samples.
    pub nk: usize,
    /// Chosen order, `na = nb`.
    pub order: usize,
    /// Delays tried.
    pub candidates: Vec<usize>,
    /// Loss of each delay at its best order, squared units of y.
    pub loss: Vec<f64>,
    /// Order at which each delay does best.
    pub orders: Vec<usize>,
    /// The next best delay.
    pub runner_up: usize,
    /// Rows used.
    pub N: usize,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Scans delays `low ..= high` from `input` to the record's only output.
pub fn delay_scan(
    rec: &Record,
    input: usize,
    (low, high): (usize, usize),
    limits: &Limits,
) -> Result<DelayScan> {
    check(rec, input, low, high, limits)?;
    check_input_motion(rec, limits)?;
    let supported = excitation_order(rec, input, 2 * MOST_ORDER, limits.X02);
    if supported < LEAST_EXCITATION {
        return Err(too_poor(rec, input, supported, LEAST_EXCITATION, limits));
    }
    let most = (supported / 2).clamp(1, MOST_ORDER);
    let scan = Scan::new(rec, input, low, high, most)?;
    let mut best: Vec<Candidate> = (low..=high).map(|nk| scan.best_order(nk)).collect();
    let candidates: Vec<usize> = best.iter().map(|c| c.nk).collect();
    let loss = best.iter().map(|c| scan.loss(c.rss)).collect();
    let orders = best.iter().map(|c| c.order).collect();
    let period = period(rec, input, high);
    let winner = scan.longest_without_loss(&best, period);
    best.sort_by(|a, b| a.bic.total_cmp(&b.bic));
    let runner_up = best.iter().copied().find(|c| c.nk != winner.nk).unwrap_or(winner);
    let chance = scan.chance(&winner, candidates.len() * most);
    if chance > limits.X04
        && let Some(lag) = follows_later(rec, input, (limits.X05 * rec.N() as f64) as usize)
    {
        return Err(beyond(rec, input, lag, limits));
    }
    let mut notes = notes(&scan, &winner, &runner_up, chance, limits);
    let again = period.map(|p| winner.nk + p).filter(|&nk| nk <= high).map(|nk| scan.best_order(nk));
    match (period, again) {
        (Some(period), again) if again.is_some() || winner.nk >= period => {
            notes.retain(|note| note.code != "X06");
            notes.push(scan.periodic(&winner, again.as_ref(), period, limits));
        }
        _ => {}
    }
    Ok(DelayScan {
        nk: winner.nk,
        order: winner.order,
        candidates,
        loss,
        orders,
        runner_up: runner_up.nk,
        N: scan.N,
        notes,
    })
}

fn check(rec: &Record, input: usize, low: usize, high: usize, limits: &Limits) -> Result<()> {
    if input >= rec.nu {
        return Err(Error::argument("input", input, &format!("below the number of inputs, {}", rec.nu)));
    }
    if rec.ny != 1 {
        return Err(Error::argument(
            "rec",
            format!("a record with {} outputs", rec.ny),
            "one with a single output",
        ));
    }
    if high < low {
        return Err(Error::argument("nk", format!("({low}, {high})"), "an ascending pair of samples"));
    }
    let most = limits.X05 * rec.N() as f64;
    if high as f64 >= most {
        return Err(Error::new(
            "X05",
            format!("delays up to {high} samples are asked of a record of {} rows", rec.N()),
        )
        .at(Place::column(rec.input_name(input)))
        .measured(high as f64, most)
        .remedy(format!("scan up to {} or record longer", (most.ceil() as usize).saturating_sub(1))));
    }
    Ok(())
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    nk: usize,
    order: usize,
    rss: f64,
    bic: f64,
}

/// One triangle with the columns `[y(t-1) … y(t-n), 1, u(t-low) … u(t-high-n+1), y]`.
struct Scan<'r, 'a> {
    rec: &'r Record<'a>,
    input: usize,
    low: usize,
    most: usize,
    triangle: Triangle,
    N: usize,
    factor: f64,
    /// Losses below this are rounding.
    floor: f64,
}

impl<'r, 'a> Scan<'r, 'a> {
    fn new(rec: &'r Record<'a>, input: usize, low: usize, high: usize, most: usize) -> Result<Self> {
        let columns: Vec<Column> = (1..=most)
            .map(Column::MinusOutput)
            .chain([Column::One])
            .chain((low..high + most).map(|lag| Column::Input(input, lag)))
            .collect();
        let regression = Regression::new(rec, 0, columns);
        let (N, needed) = (regression.N(), 2 * most + 2);
        if N <= needed {
            return Err(Error::new("X03", format!("{N} usable rows for a scan of delays up to {high}"))
                .count(N)
                .measured(N as f64, needed as f64 + 1.0)
                .remedy("scan fewer delays or record longer"));
        }
        let triangle = regression.triangle();
        let rhs = triangle.n() - 1;
        let scan_one = residual_norm2(&triangle, &[most], rhs, TOLERANCE);
        Ok(Scan {
            rec,
            input,
            low,
            most,
            triangle,
            N,
            factor: regression.y.factor,
            floor: 1e-24 * scan_one / N as f64,
        })
    }

    fn columns(&self, nk: usize, order: usize) -> Vec<usize> {
        let first = self.most + 1 + nk - self.low;
        (0..order).chain([self.most]).chain(first..first + order).collect()
    }

    fn best_order(&self, nk: usize) -> Candidate {
        (1..=self.most)
            .map(|order| {
                let rss = self.rss(&self.columns(nk, order));
                let bic = self.N as f64 * (rss / self.N as f64).max(self.floor).max(f64::MIN_POSITIVE).ln()
                    + 2.0 * order as f64 * (self.N as f64).ln();
                Candidate { nk, order, rss, bic }
            })
            .min_by(|a, b| a.bic.total_cmp(&b.bic))
            .unwrap_or(Candidate { nk, order: 1, rss: f64::INFINITY, bic: f64::INFINITY })
    }

    fn longest_without_loss(&self, best: &[Candidate], period: Option<usize>) -> Candidate {
        let least = best.iter().map(|c| c.rss).fold(f64::INFINITY, f64::min);
        let own: Vec<usize> = (0..=self.most).collect();
        let immaterial = (LOST * (self.rss(&own) - least)).min(RAISED * least);
        let bound = least + immaterial + self.floor * self.N as f64;
        let good = || best.iter().copied().filter(|c| c.rss <= bound);
        let first = good().next().unwrap_or(best[0]);
        if period.is_none() {
            return good().max_by_key(|c| c.nk).unwrap_or(first);
        }
        // Delays too short do as well, by way of more coefficients: a run of good ones ends at the delay.
        let run = good().zip(first.nk..).take_while(|(c, nk)| c.nk == *nk);
        run.map(|(c, _)| c).last().unwrap_or(first)
    }

    /// X06 of an input that repeats itself.
    fn periodic(
        &self,
        winner: &Candidate,
        again: Option<&Candidate>,
        period: usize,
        limits: &Limits,
    ) -> Note {
        let name = self.rec.input_name(self.input);
        let loss = |c: &Candidate| rounded(self.loss(c.rss));
        let other = match again {
            Some(again) => format!("{} with {}", again.nk, loss(again)),
            None => format!("{} outside of the range", winner.nk - period),
        };
        let text = format!(
            "{name} repeats itself every {period} rows: a delay of {} samples, loss {}, is not told from {other}",
            winner.nk,
            loss(winner)
        );
        let apart =
            again.map_or(0.0, |again| (again.rss - winner.rss).abs() / winner.rss.max(f64::MIN_POSITIVE));
        Note::warning("X06", text)
            .at(Place::column(name))
            .count(period)
            .measured(apart, limits.X06)
            .remedy("record with an input that does not repeat itself, such as a PRBS")
    }

    fn rss(&self, columns: &[usize]) -> f64 {
        residual_norm2(&self.triangle, columns, self.triangle.n() - 1, TOLERANCE)
    }

    fn loss(&self, rss: f64) -> f64 {
        rss / self.N as f64 / self.factor.powi(2)
    }

    /// p-value of what the input explains at the chosen delay, times the number of candidates tried.
    ///
    /// The candidate's own lags have to explain something, lest a delay beyond the range speaks for one inside it;
    /// and more lags beside a long autoregression too, lest two slow signals that have nothing to do with
    /// each other pass for related, which they did in 3 of 100 records.
    fn chance(&self, winner: &Candidate, tried: usize) -> f64 {
        let own: Vec<usize> = (0..winner.order).chain([self.most]).collect();
        let freedom = (self.N - 2 * winner.order - 1) as f64;
        let short = by_chance(self.rss(&own), winner.rss, winner.order as f64, freedom);
        (tried as f64 * short.max(self.chance_beside_long(winner))).min(1.0)
    }

    fn chance_beside_long(&self, winner: &Candidate) -> f64 {
        let lags = LONG.min(self.N / ROWS).max(winner.order);
        let columns: Vec<Column> = (1..=lags)
            .map(Column::MinusOutput)
            .chain([Column::One])
            .chain((winner.nk..winner.nk + lags).map(|lag| Column::Input(self.input, lag)))
            .collect();
        let regression = Regression::new(self.rec, 0, columns);
        let (triangle, rhs) = (regression.triangle(), 2 * lags + 1);
        let (own, all): (Vec<usize>, Vec<usize>) = ((0..=lags).collect(), (0..rhs).collect());
        let without = residual_norm2(&triangle, &own, rhs, TOLERANCE);
        let with = residual_norm2(&triangle, &all, rhs, TOLERANCE);
        by_chance(without, with, lags as f64, regression.N().saturating_sub(rhs) as f64)
    }
}

fn notes(scan: &Scan, winner: &Candidate, runner_up: &Candidate, chance: f64, limits: &Limits) -> Vec<Note> {
    let mut notes = Vec::new();
    let name = scan.rec.input_name(scan.input);
    if chance > limits.X04 {
        notes.push(
            Note::warning(
                "X04",
                format!("no delay scanned lets {name} explain y one step ahead beyond chance"),
            )
            .at(Place::column(name))
            .count(scan.N)
            .measured(chance, limits.X04)
            .remedy("trust a process model's delay, or record with more changes of the input"),
        );
    }
    let high = scan.low + scan.triangle.n() - scan.most * 2 - 2;
    let at_end = winner.nk == high || (winner.nk == scan.low && scan.low > 0);
    if at_end {
        notes.push(
            Note::warning(
                "X05",
                format!("the best delay, {} samples, lies at the end of the range scanned", winner.nk),
            )
            .at(Place::column(name))
            .measured(winner.nk as f64, high as f64)
            .remedy("scan a wider range: nk=(low, high)"),
        );
    }
    let apart = (runner_up.rss - winner.rss) / winner.rss.max(f64::MIN_POSITIVE);
    if winner.nk != runner_up.nk
        && scan.loss(winner.rss) > scan.floor / scan.factor.powi(2)
        && apart.abs() < limits.X06
    {
        notes.push(
            Note::warning(
                "X06",
                format!(
                    "delays {} and {} explain y about equally well, loss {} and {}",
                    winner.nk,
                    runner_up.nk,
                    rounded(scan.loss(winner.rss)),
                    rounded(scan.loss(runner_up.rss))
                ),
            )
            .at(Place::column(name))
            .measured(apart.abs(), limits.X06)
            .remedy("keep both, or record with faster changes of the input"),
        );
    }
    notes
}

/// p-value of the fall from `without` to `with` by `more` columns.
fn by_chance(without: f64, with: f64, more: f64, freedom: f64) -> f64 {
    f_tail((without - with) / more / (with / freedom).max(f64::MIN_POSITIVE), more, freedom)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::model::PolyModel;
    use crate::signal::prbs;

    /// A second-order plant; the noise is about 1 % of its output.
    fn output(u: &[f64], nk: usize) -> Vec<f64> {
        let plant = PolyModel::arx(vec![1.0, -1.3, 0.42], vec![vec![0.5, 0.3]], vec![nk], 1.0);
        let noise = white(u.len(), 7);
        plant.simulate(u, 1).iter().zip(noise).map(|(y, e)| y + 0.01 * e).collect()
    }

    fn scan(u: &[f64], y: &[f64], range: (usize, usize)) -> Result<DelayScan> {
        let rec = Record::uniform(u, 1, y, 1, 1.0).expect("fine");
        delay_scan(&rec, 0, range, &Limits::default())
    }

    #[test]
    fn every_delay_is_found_on_a_second_order_plant() {
        let u = prbs(600, 3, 9, 1).expect("a sequence");
        for nk in [0, 1, 4, 13] {
            let found = scan(&u, &output(&u, nk), (0, 20)).expect("a scan");
            assert_eq!(found.nk, nk);
            assert_eq!((found.candidates.len(), found.loss.len()), (21, 21));
        }
    }

    #[test]
    fn the_end_of_the_range_is_doubtful() {
        let u = prbs(600, 3, 9, 1).expect("a sequence");
        let found = scan(&u, &output(&u, 6), (0, 6)).expect("a scan");
        assert_eq!(found.nk, 6);
        assert!(found.notes.iter().any(|note| note.code == "X05"));
    }

    #[test]
    fn the_loss_is_in_squared_units_of_y() {
        let u = prbs(600, 3, 9, 1).expect("a sequence");
        let y = output(&u, 4);
        let large: Vec<f64> = y.iter().map(|y| 50.0 + 8.0 * y).collect();
        let (small, large) =
            (scan(&u, &y, (0, 8)).expect("a scan"), scan(&u, &large, (0, 8)).expect("a scan"));
        for (a, b) in small.loss.iter().zip(&large.loss) {
            assert!((b / a / 64.0 - 1.0).abs() < 1e-6, "{a} {b}");
        }
    }

    #[test]
    fn a_range_beyond_a_third_of_the_record_is_refused() {
        let u = prbs(60, 3, 9, 1).expect("a sequence");
        assert_eq!(scan(&u, &output(&u, 1), (0, 40)).expect_err("too long").code(), "X05");
    }
}
