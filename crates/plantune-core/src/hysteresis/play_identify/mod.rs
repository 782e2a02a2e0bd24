//! Stacks of plays from a record, on widths spread evenly over the input; rows not used choose their number.
//!
//! ```text
//! symmetric    min over w >= 0, O             sum (y - O - sum w_i z_i)^2               r_i = i max|x| / n
//! asymmetric   min over w >= 0, s >= 0, c     sum (sum s_k seg_k(y) - c - sum w_i z_i)^2     middle s is 1
//! even         min over w, v, O               sum (y - O - sum w_i z_i - sum v_j play(|x|; s_j))^2
//! ```
//!
//! The states `z_i` depend on x alone, so that any rows may be left out. The record is cut into thirty pieces, dealt
//! in turn to ten parts; each part is predicted by the fit to the nine others, and the fewest plays that come within
//! 5 % of the best are taken. What the columns cannot tell apart is refused; a fit that predicts half of the parts
//! worse than a constant is, too.

mod asymmetric;
mod doubts;
mod even;
mod symmetric;

use super::{Model, PlayStack};
use crate::error::{Error, Result};
use crate::linalg::{Block, NonNegative, Triangle, solve};
use crate::note::{Note, rounded};

/// Parts of the record, each predicted from the others.
const PARTS: usize = 10;

/// Pieces of which a part is made.
const PIECES: usize = 3;

/// Fewer plays are taken where the best are better by less than this.
const TIE: f64 = 1.05;

/// Pivots below this share of the largest do not count.
const TOLERANCE: f64 = 1e-10;

/// Rows that any fit needs.
const LEAST: usize = 20;

/// What is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// `H[x]`.
    Symmetric,
    /// `S(H[x])`, with so many segments of y.
    Asymmetric(usize),
    /// Plays on x and on |x|, each side chosen from so many.
    Even(usize),
}

/// How to fit.
#[derive(Clone, Debug)]
pub struct PlaySettings {
    /// What.
    pub form: Form,
    /// Numbers of plays, of which rows not used choose one.
    pub counts: Vec<usize>,
    /// Half widths in place of even ones, and of `counts`.
    pub r: Option<Vec<f64>>,
    /// Whether O is fitted.
    pub offset: bool,
    /// First rows that move the plays and are not fitted.
    pub skip: usize,
}

/// The fitted model and how far it is off.
#[derive(Clone, Debug)]
pub struct PlayFit {
    /// The model.
    pub model: Model,
    /// Names of its parameters.
    pub names: Vec<String>,
    /// Their standard deviations; 0 of what stands at 0.
    pub sd: Vec<f64>,
    /// Numbers of plays tried, and the rms error of each on rows not used.
    pub tried: Vec<(usize, f64)>,
    /// Errors over all rows that were fitted.
    pub errors: Vec<f64>,
    /// What is in doubt.
    pub notes: Vec<Note>,
}

/// Fits a stack to a record that begins in the virgin state.
pub fn identify_plays(x: &[f64], y: &[f64], settings: &PlaySettings) -> Result<PlayFit> {
    let most = check(x, y, settings)?;
    let given = settings.r.as_ref().map(|r| vec![r.len()]);
    let counts = given.as_ref().unwrap_or(&settings.counts);
    let mut found = Vec::new();
    let mut refusal = None;
    for &n in counts {
        match judged(x, y, settings.family(n, most, y).as_mut(), settings.skip) {
            Ok(fitted) => found.push((n, fitted)),
            Err(error) => refusal = refusal.or(Some(error)),
        }
    }
    let best = found.iter().fold(f64::INFINITY, |best, (_, f)| best.min(f.held_out.rms));
    let tried: Vec<(usize, f64)> = found.iter().map(|(n, f)| (*n, f.held_out.rms)).collect();
    let Some((_, judged)) = found.into_iter().find(|(_, f)| f.held_out.rms <= TIE * best) else {
        return Err(refusal.unwrap_or_else(|| Error::argument("n", "no number", "1 or more")));
    };
    doubts::refuse_what_predicts_nothing(x, &y[settings.skip..], &judged.held_out, settings.form)?;
    let Fitted { model, names, sd, merged } = judged.fitted;
    let errors = errors(&model, x, y)?.split_off(settings.skip);
    let mut notes = doubts::doubts(&model, x, y, merged);
    notes.extend((settings.skip == 0).then(|| doubts::not_virgin(x, &errors)).flatten());
    Ok(PlayFit { errors, model, names, sd, tried, notes })
}

/// What plays must be narrower than to be moved.
fn check(x: &[f64], y: &[f64], settings: &PlaySettings) -> Result<f64> {
    if x.len() != y.len() {
        let text = format!("x has {} rows, y has {}", x.len(), y.len());
        return Err(Error::new("D09", text).remedy("give one y per x"));
    }
    if settings.counts.contains(&0) {
        return Err(Error::argument("n", 0, "1 or more"));
    }
    let used = x.len().saturating_sub(settings.skip);
    if used < LEAST {
        let text = format!("{used} rows to fit");
        return Err(Error::new("X03", text).measured(used as f64, LEAST as f64).remedy("record more rows"));
    }
    if let Some(r) = &settings.r {
        PlayStack::virgin(r.clone(), r.clone(), 0.0).check()?;
    }
    if let Form::Asymmetric(0 | 1) | Form::Even(0) = settings.form {
        return Err(Error::argument("segments", "too few", "2 or more"));
    }
    let (low, high) = x.iter().fold((f64::INFINITY, -f64::INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    if low == high {
        return Err(Error::new("X01", format!("`x` is {low} throughout"))
            .remedy("record the output over a moving input"));
    }
    // From the virgin state the first rise moves plays as wide as max|x|, later only those of half the range move.
    Ok(if settings.skip == 0 { high.max(-low) } else { 0.5 * (high - low) })
}

/// A kind of model, linear in what is unknown of it.
trait Family {
    /// Columns, y and all.
    fn width(&self) -> usize;

    /// The next row of them.
    fn row(&mut self, x: f64, y: f64, row: &mut [f64]);

    /// Refuses columns that cannot be told apart.
    fn check(&self, triangle: &Triangle) -> Result<()>;

    /// The best model on rows of which this is the triangle, N of them.
    fn fit(&self, triangle: &Triangle, N: usize) -> Result<Fitted>;
}

/// A model on some of the rows.
struct Fitted {
    model: Model,
    names: Vec<String>,
    sd: Vec<f64>,
    merged: usize, // segments
}

impl PlaySettings {
    fn family(&self, n: usize, most: f64, y: &[f64]) -> Box<dyn Family> {
        let evenly = |n: usize| -> Vec<f64> { (0..n).map(|i| i as f64 * most / n as f64).collect() };
        let r = self.r.clone().unwrap_or_else(|| match self.form {
            Form::Even(grid) => evenly(grid.max(n)),
            _ => evenly(n),
        });
        match self.form {
            Form::Symmetric => Box::new(symmetric::Symmetric::new(r, self.offset)),
            Form::Asymmetric(segments) => Box::new(asymmetric::Asymmetric::new(r, y, segments, self.offset)),
            Form::Even(_) => Box::new(even::Even::new(r, n, self.offset)),
        }
    }
}

/// The fit to all rows, and how rows not used are predicted.
struct Judged {
    fitted: Fitted,
    held_out: HeldOut,
}

/// Errors of parts predicted from the others.
struct HeldOut {
    rms: f64,
    /// Parts that a constant predicts better.
    lost: usize,
}

fn judged(x: &[f64], y: &[f64], family: &mut dyn Family, skip: usize) -> Result<Judged> {
    let used = x.len() - skip;
    if used <= family.width() {
        let text = format!("{used} rows for {} unknowns", family.width() - 1);
        return Err(Error::new("X03", text).remedy("record more rows, or ask for fewer plays"));
    }
    let parts = triangles(x, y, family, skip);
    let all = joined(&parts, PARTS);
    family.check(&all)?;
    let mean = y[skip..].iter().sum::<f64>() / used as f64;
    let (mut sum, mut lost) = (0.0, 0);
    for part in 0..PARTS {
        let fitted = family.fit(&joined(&parts, part), used - used / PARTS)?;
        let e = errors(&fitted.model, x, y)?;
        let rows = (0..used).filter(|k| part_of(*k, used) == part).map(|k| k + skip);
        let [ours, constant] =
            rows.fold([0.0, 0.0], |[a, b], t| [a + e[t] * e[t], b + (y[t] - mean).powi(2)]);
        sum += ours;
        lost += usize::from(ours >= constant);
    }
    let held_out = HeldOut { rms: (sum / used as f64).sqrt(), lost };
    Ok(Judged { fitted: family.fit(&all, used)?, held_out })
}

/// Part of row k of N.
fn part_of(k: usize, N: usize) -> usize {
    k * PARTS * PIECES / N % PARTS
}

/// One per part.
fn triangles(x: &[f64], y: &[f64], family: &mut dyn Family, skip: usize) -> Vec<Triangle> {
    let (width, used) = (family.width(), x.len() - skip);
    let mut row = vec![0.0; width];
    let mut triangles = vec![Triangle::new(width); PARTS];
    let mut block = Block::new(width);
    let mut part = 0;
    for t in 0..x.len() {
        family.row(x[t], y[t], &mut row);
        if t >= skip {
            let now = part_of(t - skip, used);
            if now != part {
                triangles[part].absorb(&mut block);
                part = now;
            }
            block.push(&row);
        }
    }
    triangles[part].absorb(&mut block);
    triangles
}

/// The rows of all parts but one.
fn joined(parts: &[Triangle], without: usize) -> Triangle {
    let width = parts[0].n();
    let others = parts.iter().enumerate().filter(|(part, _)| *part != without);
    Triangle::of_rows(width, others.flat_map(|(_, rows)| (0..width).map(|i| rows.row(i))))
}

fn errors(model: &Model, x: &[f64], y: &[f64]) -> Result<Vec<f64>> {
    Ok(model.simulate(x)?.iter().zip(y).map(|(f, y)| y - f).collect())
}

/// Refuses if some of the columns depend on the others.
fn told_apart(triangle: &Triangle, columns: &[usize], plays: usize) -> Result<()> {
    match solve(triangle, columns, triangle.n() - 1, TOLERANCE) {
        Ok(_) => Ok(()),
        Err(refusal) => {
            let lost = refusal.dependent.len();
            let text =
                format!("x moves too little to tell {plays} plays apart: {lost} of them, or the offset");
            Err(Error::new("X02", text)
                .count(lost)
                .measured(rounded(refusal.ratio), TOLERANCE)
                .remedy("fewer plays, other `r`, or a record with more turning points of different size"))
        }
    }
}

/// Standard deviations of the unknowns at a minimum: of least squares on those that are not held at zero.
fn deviations(triangle: &Triangle, columns: &[usize], found: &NonNegative, N: usize) -> Vec<f64> {
    let mut sd = vec![0.0; columns.len()];
    let inside: Vec<usize> = found.inside.iter().map(|&j| columns[j]).collect();
    if let Ok(solution) = solve(triangle, &inside, triangle.n() - 1, TOLERANCE) {
        let k = inside.len();
        let variance = found.rss / N.saturating_sub(k).max(1) as f64;
        for (p, &j) in found.inside.iter().enumerate() {
            sd[j] = (variance * solution.inverse_gram[p * k + p]).sqrt();
        }
    }
    sd
}

/// `w0 w1 ... ` of so many.
fn numbered(letter: &str, n: usize) -> impl Iterator<Item = String> + use<'_> {
    (0..n).map(move |i| format!("{letter}{i}"))
}
