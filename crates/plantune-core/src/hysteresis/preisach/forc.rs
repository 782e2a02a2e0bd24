//! First-order reversal curves (FORC), and the Everett function that they are.
//!
//! ```text
//! from negative saturation up to alpha, then down:   f_alpha at the turn, f_alpha,beta on the way down
//! E(alpha, beta) = (f_alpha - f_alpha,beta) / 2      mu = -d2 E / (d alpha d beta), cell by cell
//! O = f at negative saturation + E(L_n, L_0)
//! ```
//!
//! The turns are the levels of the model, and the lowest input the one below them. Curves that begin at positive
//! saturation are the same with both signs turned. Source 002, (2) to (4); Mayergoyz 2003, chapter 1.

use super::everett::mu_of_everett;
use crate::error::{Error, Result};

/// An input that turns by less than this share of its range does not turn.
const TURN: f64 = 1e-3;

/// Saturation is met by turns nearer to it than this share of the range.
const SATURATED: f64 = 0.02;

/// What the curves say.
#[derive(Clone, Debug)]
pub struct Forc {
    /// Lowest input, then the turns, ascending; (n + 1).
    pub levels: Vec<f64>,
    /// `E(L_a, L_b)`, (n + 1, n + 1) row-major, 0 where `a <= b`.
    pub everett: Vec<f64>,
    /// Weights of the cells, (n, n) row-major.
    pub mu: Vec<f64>,
    /// Output halfway between both saturations.
    pub offset: f64,
    /// Whether the curves rise, from turns below positive saturation.
    pub rising: bool,
    /// First row of each curve, its turn, and one past its last, by the turn ascending.
    pub curves: Vec<(usize, usize)>,
}

/// Cuts a record into curves and reads the Everett function off them.
pub fn forc(x: &[f64], y: &[f64]) -> Result<Forc> {
    if x.len() != y.len() {
        return Err(Error::argument("y", format!("of {} rows", y.len()), &format!("of {}, as `x`", x.len())));
    }
    let (low, high) = x.iter().fold((f64::INFINITY, -f64::INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let range = high - low;
    let turns = turns(x, TURN * range);
    let inner =
        |upper: bool| turns.iter().filter(move |t| t.upper == upper && t.row > 0 && t.row + 1 < x.len());
    let saturated = |upper: bool| {
        let end = if upper { high } else { low };
        inner(upper).all(|t| (x[t.row] - end).abs() <= SATURATED * range)
    };
    let curves = |upper: bool| -> Vec<(usize, usize)> {
        turns.windows(2).filter(|t| t[0].upper == upper).map(|t| (t[0].row, t[1].row + 1)).collect()
    };
    let falling = curves(true);
    if saturated(false) && distinct(x, &falling, range) > 1 {
        return Ok(falling_curves(x, y, falling));
    }
    let rising = curves(false);
    if saturated(true) && distinct(x, &rising, range) > 1 {
        let turned = |s: &[f64]| s.iter().map(|s| -s).collect::<Vec<_>>();
        return Ok(falling_curves(&turned(x), &turned(y), rising).turned());
    }
    let text = format!("{} turns of the input are no family of reversal curves", turns.len());
    Err(Error::new("X04", text).count(turns.len()).remedy(
        "drive it from one and the same saturation to a turn and back, two or more turns; or fit any record by `Preisach.identify`",
    ))
}

/// How many different turns the curves begin at.
fn distinct(x: &[f64], curves: &[(usize, usize)], range: f64) -> usize {
    let mut at: Vec<f64> = curves.iter().map(|c| x[c.0]).collect();
    at.sort_by(f64::total_cmp);
    at.dedup_by(|a, b| *a - *b <= TURN * range);
    at.len()
}

/// A row at which the input turns.
struct Turning {
    row: usize,
    upper: bool,
}

/// Maxima and minima by turns, both ends of the record among them.
fn turns(x: &[f64], least: f64) -> Vec<Turning> {
    let mut found: Vec<Turning> = Vec::new();
    // Rows of the largest and of the smallest input since the last turn.
    let (mut top, mut bottom) = (0, 0);
    let mut upper = None;
    for t in 1..x.len() {
        if x[t] > x[top] {
            top = t;
        }
        if x[t] < x[bottom] {
            bottom = t;
        }
        if upper != Some(true) && x[t] < x[top] - least {
            found.push(Turning { row: top, upper: true });
            (upper, bottom) = (Some(true), t);
        } else if upper != Some(false) && x[t] > x[bottom] + least {
            found.push(Turning { row: bottom, upper: false });
            (upper, top) = (Some(false), t);
        }
    }
    match upper {
        Some(true) => found.push(Turning { row: bottom, upper: false }),
        Some(false) => found.push(Turning { row: top, upper: true }),
        None => {}
    }
    found
}

/// Curves that fall from their turn, each from its row to that of its end.
fn falling_curves(x: &[f64], y: &[f64], mut curves: Vec<(usize, usize)>) -> Forc {
    let range =
        x.iter().fold(-f64::INFINITY, |h, x| h.max(*x)) - x.iter().fold(f64::INFINITY, |l, x| l.min(*x));
    curves.sort_by(|a, b| x[a.0].total_cmp(&x[b.0]));
    curves.dedup_by(|a, b| x[a.0] - x[b.0] <= TURN * range);
    // Where all curves still are.
    let low = curves.iter().map(|c| x[c.1 - 1]).fold(-f64::INFINITY, f64::max);
    curves.retain(|c| x[c.0] > low + TURN * range);
    let levels: Vec<f64> = [low].into_iter().chain(curves.iter().map(|c| x[c.0])).collect();
    let n = curves.len();
    let mut E = vec![0.0; (n + 1) * (n + 1)];
    let mut bottom = 0.0;
    for (k, &(from, to)) in curves.iter().enumerate() {
        for b in (0..=k).rev() {
            let f = crossing(&x[from..to], &y[from..to], levels[b]);
            E[(k + 1) * (n + 1) + b] = 0.5 * (y[from] - f);
            bottom += if b == 0 { f / n as f64 } else { 0.0 };
        }
    }
    let offset = bottom + E[n * (n + 1)];
    Forc { levels, mu: mu_of_everett(n, &E), everett: E, offset, rising: false, curves }
}

/// `y` where the falling `x` first comes to `level`.
fn crossing(x: &[f64], y: &[f64], level: f64) -> f64 {
    let Some(t) = x.iter().position(|x| *x <= level) else { return y[y.len() - 1] };
    if t == 0 || x[t] == level {
        return y[t];
    }
    y[t] + (level - x[t]) / (x[t - 1] - x[t]) * (y[t - 1] - y[t])
}

impl Forc {
    /// The same of `-x` and `-y`: `E(alpha, beta)` is that of `(-beta, -alpha)`.
    fn turned(mut self) -> Forc {
        let n = self.levels.len() - 1;
        let at = |a: usize, b: usize| self.everett[(n - b) * (n + 1) + n - a];
        self.everett = (0..(n + 1) * (n + 1)).map(|k| at(k / (n + 1), k % (n + 1))).collect();
        self.mu = mu_of_everett(n, &self.everett);
        self.levels = self.levels.iter().rev().map(|l| -l).collect();
        self.curves.reverse();
        Forc { offset: -self.offset, rising: true, ..self }
    }
}
