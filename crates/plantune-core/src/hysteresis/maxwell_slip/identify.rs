//! Maxwell slip from a record: non-negative least squares on x and the stops.
//!
//! ```text
//! min over spring >= 0, k >= 0, O:   sum (y - O - spring x - sum k_i (x - z_i))^2
//! r_i evenly spaced below max|x|; evenly spaced in log r, from a seventh of the smallest turning point on, where
//! that is below a tenth of the largest
//! ```
//!
//! How many elements the record supports is judged on rows not used, every other tenth of the record: the fewest
//! that come within 5 % of the best. Elements that end at zero are left out.

use super::MaxwellSlip;
use super::direction::loop_direction;
use crate::error::{Error, Result};
use crate::hysteresis::Operator;
use crate::hysteresis::cycles::turning_points;
use crate::hysteresis::misfit::rms;
use crate::linalg::{Block, NonNegative, Triangle, extent, nnls, solve};

/// Numbers of elements tried.
const TRIED: [usize; 7] = [1, 2, 3, 5, 8, 13, 20];

/// Fewer elements are taken where the best are better by less than this.
const TIE: f64 = 1.05;

/// Stretches of the record, every other one not used.
const STRETCHES: usize = 10;

/// Share of the range that a turn must have to count.
const BAND: f64 = 0.01;

/// Share of the largest turning point below which the smallest asks for thresholds evenly spaced in log r.
const SMALL: f64 = 0.1;

/// The smallest threshold under the smallest turning point, and the largest under the largest.
const ENDS: (f64, f64) = (1.0 / 7.0, 0.95);

/// Pivots below this share of the largest do not count.
const TOLERANCE: f64 = 1e-12;

/// How to fit.
#[derive(Clone, Debug)]
pub struct MaxwellSettings {
    /// Number of elements, or none, and then as many as the record supports.
    pub n: Option<usize>,
    /// Thresholds r, or none.
    pub r: Option<Vec<f64>>,
    /// Whether O is fitted.
    pub offset: bool,
}

/// The fitted model and how far it is off.
#[derive(Clone, Debug)]
pub struct MaxwellFit {
    /// The model.
    pub model: MaxwellSlip,
    /// Standard deviations: `k`, spring, offset; 0 of what stands at 0.
    pub sd: Vec<f64>,
    /// Numbers of elements tried, and the rms error of each on rows not used.
    pub tried: Vec<(usize, f64)>,
    /// Errors over all rows.
    pub errors: Vec<f64>,
}

/// Fits the model to a record that begins at rest at 0.
pub fn identify_maxwell(x: &[f64], y: &[f64], settings: &MaxwellSettings) -> Result<MaxwellFit> {
    check(x, y, settings)?;
    let mut tried = Vec::new();
    let r = match (&settings.r, settings.n) {
        (Some(r), _) => r.clone(),
        (None, Some(n)) => thresholds(x, n),
        (None, None) => {
            for n in TRIED.into_iter().filter(|n| 2 * (n + 2) < x.len() / 2) {
                tried.push((n, on_rows_not_used(x, y, &thresholds(x, n), settings.offset)));
            }
            let best = tried.iter().fold(f64::INFINITY, |best, t| best.min(t.1));
            thresholds(x, tried.iter().find(|t| t.1 <= TIE * best).map_or(1, |t| t.0))
        }
    };
    let triangle = triangle(x, y, &r, |_| true);
    let found = solved(&triangle, r.len(), settings.offset);
    let sd = deviations(&triangle, &found, r.len(), x.len());
    let (model, sd) = model(&r, &found, &sd, settings.offset);
    let errors = errors(&model, x, y);
    Ok(MaxwellFit { model, sd, tried, errors })
}

fn check(x: &[f64], y: &[f64], settings: &MaxwellSettings) -> Result<()> {
    if settings.n == Some(0) {
        return Err(Error::argument("n", 0, "1 or more"));
    }
    if let Some(r) = &settings.r {
        let ascending = r.windows(2).all(|r| r[0] < r[1]) && r.first().is_some_and(|r| *r > 0.0);
        if !ascending || r.iter().any(|r| !r.is_finite()) {
            return Err(Error::argument("r", format!("{r:?}"), "finite, positive, ascending"));
        }
    }
    let turning = loop_direction(x, y)?;
    let needed = 2 * settings.r.as_ref().map_or(settings.n.unwrap_or(1), Vec::len) + 4;
    if x.len() < needed.max(20) {
        return Err(Error::new("X03", format!("{} rows", x.len()))
            .measured(x.len() as f64, needed.max(20) as f64)
            .remedy("record more rows, or ask for fewer elements"));
    }
    if turning.direction == "counter-clockwise" || turning.direction == "butterfly" {
        let remedy = if turning.direction == "butterfly" {
            "PlayStack.identify(x, y, even=True) has plays on |x| too"
        } else {
            "PlayStack.identify has the loops that lag"
        };
        return Err(Error::new("M06", format!("the loop is {}: no stops make it", turning.direction))
            .measured(turning.width, 0.0)
            .remedy(remedy));
    }
    Ok(())
}

/// `n` thresholds below the largest `|x|`.
fn thresholds(x: &[f64], n: usize) -> Vec<f64> {
    let most = x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let (low, high) = extent(x);
    let turns = turning_points(x, BAND * (high - low));
    let halves = turns.windows(2).map(|t| 0.5 * (x[t[1]] - x[t[0]]).abs()).filter(|a| *a > 0.0);
    let least = halves.fold(most, f64::min);
    let part = |i: usize| if n == 1 { 0.5 } else { i as f64 / (n - 1) as f64 };
    if least < SMALL * most {
        let (from, to) = (ENDS.0 * least, ENDS.1 * most);
        return (0..n).map(|i| from * (to / from).powf(part(i))).collect();
    }
    (1..=n).map(|i| i as f64 * most / (n + 1) as f64).collect()
}

fn on_rows_not_used(x: &[f64], y: &[f64], r: &[f64], offset: bool) -> f64 {
    let used = |t: usize| (t * STRETCHES / x.len()).is_multiple_of(2);
    let found = solved(&triangle(x, y, r, used), r.len(), offset);
    let (model, _) = model(r, &found, &vec![0.0; r.len() + 2], offset);
    let errors = errors(&model, x, y);
    let left: Vec<f64> = errors.iter().enumerate().filter(|(t, _)| !used(*t)).map(|(_, e)| *e).collect();
    rms(&left)
}

/// Columns: stops (n), x, 1, y; of the rows that count.
fn triangle(x: &[f64], y: &[f64], r: &[f64], counts: impl Fn(usize) -> bool) -> Triangle {
    let n = r.len();
    let (mut triangle, mut block) = (Triangle::new(n + 3), Block::new(n + 3));
    let mut row = vec![0.0; n + 3];
    let mut z = vec![0.0; n];
    for (t, (&x, &y)) in x.iter().zip(y).enumerate() {
        for ((z, r), stop) in z.iter_mut().zip(r).zip(&mut row) {
            *z = (x - r).max((x + r).min(*z));
            *stop = x - *z;
        }
        if counts(t) {
            row[n..].copy_from_slice(&[x, 1.0, y]);
            block.push(&row);
        }
    }
    triangle.absorb(&mut block);
    triangle
}

fn solved(triangle: &Triangle, n: usize, offset: bool) -> NonNegative {
    let columns: Vec<usize> = (0..n + 1 + usize::from(offset)).collect();
    let free: Vec<bool> = columns.iter().map(|c| *c == n + 1).collect();
    nnls(triangle, &columns, &free, n + 2, &[])
}

/// Of stops, spring and offset.
fn deviations(triangle: &Triangle, found: &NonNegative, n: usize, N: usize) -> Vec<f64> {
    let mut sd = vec![0.0; n + 2];
    if let Ok(inside) = solve(triangle, &found.inside, n + 2, TOLERANCE) {
        let k = found.inside.len();
        let variance = found.rss / N.saturating_sub(k).max(1) as f64;
        for (p, &j) in found.inside.iter().enumerate() {
            sd[j] = (variance * inside.inverse_gram[p * k + p]).sqrt();
        }
    }
    sd
}

/// The elements that are not zero, and their standard deviations.
fn model(r: &[f64], found: &NonNegative, sd: &[f64], offset: bool) -> (MaxwellSlip, Vec<f64>) {
    let n = r.len();
    let kept: Vec<usize> = (0..n).filter(|&i| found.x[i] > 0.0).collect();
    let model = MaxwellSlip {
        k: kept.iter().map(|&i| found.x[i]).collect(),
        f: kept.iter().map(|&i| found.x[i] * r[i]).collect(),
        spring: found.x[n],
        offset: if offset { found.x[n + 1] } else { 0.0 },
    };
    (model, kept.iter().copied().chain([n, n + 1]).map(|i| sd[i]).collect())
}

fn errors(model: &MaxwellSlip, x: &[f64], y: &[f64]) -> Vec<f64> {
    model.plays().start().run(x).iter().zip(y).map(|(f, y)| y - f).collect()
}
