//! Correlation of an output with an input, as it is and with the input made white.
//!
//! ```text
//! r(l) = sum y(t) u(t-l) / sqrt(sum y^2 sum u^2)          both without their means
//! raw           |r| < z sqrt((1 + 2 sum R_u(k) R_y(k)) / N)   where y has nothing to do with u (Bartlett)
//! pre-whitened  A(q) u = w by an autoregression (AIC),  r of A y and A u,  |r| < z / sqrt(N)
//! ```
//!
//! The raw correlation is the plant's response smeared by that of the input with itself: where the input is held for
//! `h` samples its peak is late by about `h - 1`. With white input it is the impulse response up to a factor, and
//! its first lag outside the band is the delay. At a lag below zero nothing may stand out, unless the input answers
//! the output.
//!
//! Source 001, (3.5-35); Box and Jenkins 1970, 11.2.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::excitation::check_input_motion;
use crate::limits::Limits;
use crate::linalg::dot;
use crate::note::{Note, Place};
use crate::record::Record;
use crate::signal::{autoregression, through};

/// Standard deviations of the bands: with 40 lags one in ten records has a lag outside by chance.
const BAND: f64 = 3.0;

/// Standard deviations from which a lag below the first delay speaks for feedback: it must not be said by chance.
const FEEDBACK: f64 = 4.0;

/// Largest order of the input's autoregression, and rows it needs per order.
const MOST_ORDER: usize = 30;
const ROWS: usize = 10;

/// Correlations at lags `-M ..= M`; at a positive lag y follows u.
#[derive(Clone, Debug)]
pub struct Correlation {
    /// `-M ..= M`.
    pub lags: Vec<i64>,
    /// Of the signals as they are.
    pub raw: Vec<f64>,
    /// Half width of its band.
    pub raw_band: f64,
    /// With the input made white.
    pub prewhitened: Vec<f64>,
    /// Half width of its band.
    pub band: f64,
    /// `A(q)`, by which both were filtered; monic.
    pub A: Vec<f64>,
    /// Lag `>= 0` of the largest raw correlation.
    pub peak: usize,
    /// First lag `>= 0` of the pre-whitened one outside its band.
    pub first: Option<usize>,
    /// Lag `< 0` where the pre-whitened one is largest, if it is beyond 4 standard deviations: the input answers the output.
    pub feedback: Option<i64>,
    /// Rows.
    pub N: usize,
    /// Doubts.
    pub notes: Vec<Note>,
}

/// Correlates output `output` with input `input` up to `most` lags.
pub fn xcorr(
    rec: &Record,
    (input, output): (usize, usize),
    most: usize,
    limits: &Limits,
) -> Result<Correlation> {
    check(rec, (input, output), most)?;
    check_input_motion(rec, limits)?;
    let (u, y) = (rec.input(input), rec.output_held(output));
    let plain: Vec<Range<usize>> = rec.segments().collect();
    let own = centred(&u, &plain);
    let N: usize = plain.iter().map(ExactSizeIterator::len).sum();
    let A = autoregression(&own, &plain, MOST_ORDER.min(N / ROWS));
    let past = A.len() - 1;
    let later = rec.segments().map(|s| (s.start + past).min(s.end)..s.end);
    let white: Vec<Range<usize>> = later.filter(|s| s.len() > 1).collect();
    let raw = correlations(&own, &centred(&y, &plain), &plain, most);
    let [w, v] = [&u, &y].map(|x| centred(&through(&A, x, rec.segments()), &white));
    let prewhitened = correlations(&w, &v, &white, most);
    let rows: usize = white.iter().map(ExactSizeIterator::len).sum();
    let band = BAND / (rows as f64).sqrt();
    let lags: Vec<i64> = (-(most as i64)..=most as i64).collect();
    let later = |r: &[f64]| r[most..].iter().map(|r| r.abs()).collect::<Vec<f64>>();
    let outside = |lag: &i64| prewhitened[(lag + most as i64) as usize].abs() > band;
    let mut found = Correlation {
        raw_band: BAND * (inflation(&own, &centred(&y, &plain), &plain, most) / N as f64).sqrt(),
        peak: largest(&later(&raw)),
        first: (0..=most as i64).find(outside).map(|lag| lag as usize),
        feedback: answers(&prewhitened[..most], band),
        lags,
        raw,
        prewhitened,
        band,
        A,
        N,
        notes: Vec::new(),
    };
    found.notes = notes(rec, input, &found);
    Ok(found)
}

fn check(rec: &Record, (input, output): (usize, usize), most: usize) -> Result<()> {
    if input >= rec.nu {
        return Err(Error::argument("input", input, &format!("below the number of inputs, {}", rec.nu)));
    }
    if output >= rec.ny {
        return Err(Error::argument("output", output, &format!("below the number of outputs, {}", rec.ny)));
    }
    let longest = rec.segments().map(|s| s.len()).max().unwrap_or(0);
    if most == 0 || 3 * most >= longest {
        return Err(Error::new("X03", format!("{most} lags are asked of {longest} rows in a row"))
            .at(Place::column("lags"))
            .measured(most as f64, (longest as f64 / 3.0).floor())
            .remedy(format!(
                "ask for {} lags at most, or record longer",
                (longest.saturating_sub(1) / 3).max(1)
            )));
    }
    Ok(())
}

/// `x` without its mean on the stretches, zero elsewhere.
fn centred(x: &[f64], stretches: &[Range<usize>]) -> Vec<f64> {
    let rows = || stretches.iter().flat_map(Clone::clone);
    let zero = x[stretches.first().map_or(0, |s| s.start)];
    let count = rows().count() as f64;
    let mean = rows().map(|t| x[t] - zero).sum::<f64>() / count;
    let mut out = vec![0.0; x.len()];
    rows().for_each(|t| out[t] = x[t] - zero - mean);
    out
}

/// `r(l)` for `l = -most ..= most`, within the stretches.
fn correlations(u: &[f64], y: &[f64], stretches: &[Range<usize>], most: usize) -> Vec<f64> {
    let size = (dot(u, u) * dot(y, y)).sqrt();
    let one_way = |early: &[f64], late: &[f64], l: usize| -> f64 {
        let long = stretches.iter().filter(|s| s.len() > l);
        long.map(|s| dot(&late[s.start + l..s.end], &early[s.start..s.end - l])).sum()
    };
    let before = (1..=most).rev().map(|l| one_way(y, u, l));
    let all = before.chain((0..=most).map(|l| one_way(u, y, l)));
    all.map(|r| if size > 0.0 { r / size } else { 0.0 }).collect()
}

/// `1 + 2 sum R_u(k) R_y(k)`, at least that of white signals.
fn inflation(u: &[f64], y: &[f64], stretches: &[Range<usize>], most: usize) -> f64 {
    let [of_u, of_y] = [u, y].map(|x| correlations(x, x, stretches, most));
    let shared: f64 = of_u[most + 1..].iter().zip(&of_y[most + 1..]).map(|(a, b)| a * b).sum();
    (1.0 + 2.0 * shared).max(1.0)
}

/// The lag below zero at which most stands out, where it is beyond chance.
fn answers(before: &[f64], band: f64) -> Option<i64> {
    let size: Vec<f64> = before.iter().map(|r| r.abs()).collect();
    let k = largest(&size);
    (size[k] > FEEDBACK / BAND * band).then_some(k as i64 - before.len() as i64)
}

fn largest(r: &[f64]) -> usize {
    r.iter().enumerate().fold(0, |best, (k, &x)| if x > r[best] { k } else { best })
}

/// X09: the input answers the output.
fn notes(rec: &Record, input: usize, found: &Correlation) -> Vec<Note> {
    let Some(lag) = found.feedback else { return Vec::new() };
    let name = rec.input_name(input);
    let r = found.prewhitened[(lag + found.lags.len() as i64 / 2) as usize];
    let text = format!("feedback: {name} follows y, the pre-whitened correlation stands out at lag {lag}");
    vec![
        Note::warning("X09", text)
            .at(Place::column(name))
            .measured(r.abs(), found.band)
            .remedy("trust models of the errors as well, not correlations"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;

    /// `y(t) = u(t-3)` beside noise, `u` slow.
    #[test]
    fn a_slow_input_shifts_the_peak_and_not_the_first_lag() {
        let steps = white(200, 1);
        let u: Vec<f64> = (0..1000).map(|t| steps[t / 5].signum()).collect();
        let e = white(1000, 2);
        let mut y = vec![0.0; 1000];
        for t in 1..1000 {
            y[t] = 0.9 * y[t - 1] + if t >= 3 { 0.1 * u[t - 3] } else { 0.0 };
        }
        let y: Vec<f64> = y.iter().zip(e).map(|(y, e)| 40.0 + y + 0.01 * e).collect();
        let rec = Record::uniform(&u, 1, &y, 1, 1.0).expect("fine");
        let found = xcorr(&rec, (0, 0), 20, &Limits::default()).expect("moves");
        assert_eq!(found.first, Some(3));
        assert!(found.peak > 4, "{}", found.peak);
        assert_eq!((found.feedback, found.notes.len()), (None, 0));
    }
}
