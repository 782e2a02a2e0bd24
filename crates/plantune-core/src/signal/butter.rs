//! Butterworth filters of any order, designed from their poles straight into second-order sections.
//!
//! Prototype `p_k = e^(j pi (2k + n - 1) / (2n))`, `k = 1 … n`; pre-warped cut-off `W = 2 tan(w Ts / 2)`;
//! bilinear map `s = 2 (z - 1) / (z + 1)`. Low-pass poles are `W p`, high-pass poles `W / p`, and each
//! prototype pole gives a band-pass two, the roots of `s^2 - (W2 - W1) p s + W1 W2`: order 5 gives 10.
//! No polynomial is ever expanded: four printed digits of the band-pass put a pole at 1.95.
//! Source 001, (3.5-20), (3.5-28), (3.5-31) without its `Ts`, and (3.7-6).

use std::f64::consts::PI;

use super::sos::{Section, Sos};
use crate::error::{Error, Result};
use crate::linalg::Complex;
use crate::note::Place;

/// Highest order of the prototype.
const MOST_ORDER: usize = 20;

/// Least cut-off and least width of a band, rad per sample: below it a section in double precision no
/// longer knows its poles to eight digits.
const LEAST: f64 = 1e-4;

/// What passes; cut-offs in rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Band {
    /// Up to `w`.
    Low(f64),
    /// From `w`.
    High(f64),
    /// From the first to the second.
    Pass(f64, f64),
}

/// The filter whose gain is `1/sqrt(2)` at each cut-off, and 1 at rest, at Nyquist, or at the band's centre.
pub fn butter(order: usize, band: Band, Ts: f64) -> Result<Sos> {
    check(order, band, Ts)?;
    let mut sections: Vec<Section> =
        shares(order, band, Ts).iter().map(|share| section(share, band, Ts)).collect();
    // The sharpest resonance comes last, when the others have cut what would excite it.
    sections.sort_by(|a, b| a.largest_pole().total_cmp(&b.largest_pole()));
    let dc_gain = if matches!(band, Band::Low(_)) { 1.0 } else { 0.0 };
    Ok(Sos { sections, dc_gain })
}

fn check(order: usize, band: Band, Ts: f64) -> Result<()> {
    if !(Ts > 0.0 && Ts.is_finite()) {
        return Err(Error::argument("Ts", Ts, "a positive number of seconds"));
    }
    if !(1..=MOST_ORDER).contains(&order) {
        return Err(Error::argument("order", order, &format!("from 1 to {MOST_ORDER}")));
    }
    let cutoffs = match band {
        Band::Low(w) | Band::High(w) => vec![w],
        Band::Pass(low, high) => vec![low, high],
    };
    for &w in &cutoffs {
        check_cutoff(w, Ts)?;
    }
    if let Band::Pass(low, high) = band
        && !((high - low) * Ts >= LEAST)
    {
        return Err(Error::argument(
            "w",
            format!("({low}, {high}) rad/s"),
            &format!("an ascending pair, at least {:.3e} rad/s apart", LEAST / Ts),
        ));
    }
    Ok(())
}

/// U01 where no filter has such a cut-off, M10 where only faster sampling could have it.
fn check_cutoff(w: f64, Ts: f64) -> Result<()> {
    if !(w > 0.0 && w.is_finite()) {
        return Err(Error::argument("w", w, "a positive number of rad/s"));
    }
    let nyquist = PI / Ts;
    if w * Ts > PI - LEAST {
        let text = format!(
            "a cut-off of {w} rad/s is at or above the Nyquist frequency, {nyquist:.6} rad/s at Ts {Ts} s"
        );
        return Err(Error::new("M10", text)
            .at(Place::column("w"))
            .measured(w, nyquist)
            .remedy(format!("choose a cut-off below {nyquist:.4} rad/s, or record with a shorter step")));
    }
    if w * Ts < LEAST {
        return Err(Error::argument("w", w, &format!("at least {:.3e} rad/s at Ts {Ts} s", LEAST / Ts))
            .remedy("resample to a longer step first"));
    }
    Ok(())
}

/// Poles of the prototype of cut-off 1 rad/s: source 001, (3.5-20).
pub fn prototype(order: usize) -> Vec<Complex<f64>> {
    let n = order as f64;
    (1..=order)
        .map(|k| {
            if 2 * k == order + 1 {
                return Complex::new(-1.0, 0.0);
            }
            let angle = PI * (2.0 * k as f64 + n - 1.0) / (2.0 * n);
            Complex::new(angle.cos(), angle.sin())
        })
        .collect()
}

/// Cut-off in the plane of the bilinear map: source 001, (3.5-28).
pub fn prewarped(w: f64, Ts: f64) -> f64 {
    2.0 * (w * Ts / 2.0).tan()
}

/// Poles in the pre-warped plane that share a section, a pair or one real pole, and where its zeros are.
struct Share {
    poles: (Complex<f64>, Option<Complex<f64>>),
    zeros: Zeros,
}

enum Zeros {
    Nyquist,
    Rest,
    Both,
}

fn shares(order: usize, band: Band, Ts: f64) -> Vec<Share> {
    // The middle one of an odd order is real; the others have their conjugates in the second half.
    let half = prototype(order).into_iter().take(order.div_ceil(2));
    let mut shares = Vec::new();
    for p in half {
        let real = p.im == 0.0;
        let mut with_conjugate =
            |s: Complex<f64>, zeros| shares.push(Share { poles: (s, (!real).then(|| s.conj())), zeros });
        match band {
            Band::Low(w) => with_conjugate(p * prewarped(w, Ts), Zeros::Nyquist),
            Band::High(w) => with_conjugate(p.inv() * prewarped(w, Ts), Zeros::Rest),
            Band::Pass(low, high) => {
                let (low, high) = (prewarped(low, Ts), prewarped(high, Ts));
                let (upper, lower) = band_poles(p, high - low, low * high);
                if real {
                    shares.push(Share { poles: (upper, Some(lower)), zeros: Zeros::Both });
                } else {
                    // Each section flat inside the band: with zeros at both ends in each, those of the
                    // upper edge would rise and those of the lower fall, by many decades in a wide band.
                    with_conjugate(upper, Zeros::Nyquist);
                    with_conjugate(lower, Zeros::Rest);
                }
            }
        }
    }
    shares
}

/// Roots of `s^2 - p width s + centre2`, the larger first, the smaller from it without cancellation.
fn band_poles(p: Complex<f64>, width: f64, centre2: f64) -> (Complex<f64>, Complex<f64>) {
    let half = p * (width / 2.0);
    let root = (half * half - centre2).sqrt();
    let larger = if (half + root).norm_sqr() >= (half - root).norm_sqr() { half + root } else { half - root };
    (larger, larger.inv() * centre2)
}

/// The bilinear map: `z = (2 + s) / (2 - s)`.
fn to_z(s: Complex<f64>) -> Complex<f64> {
    (s + 2.0) / (-s + 2.0)
}

/// The section of these poles and zeros, its gain 1 where the band's is.
fn section(share: &Share, band: Band, Ts: f64) -> Section {
    let p = to_z(share.poles.0);
    let (a, b) = match (share.poles.1.map(to_z), &share.zeros) {
        (None, Zeros::Rest) => ([-p.re, 0.0], [1.0, -1.0, 0.0]),
        (None, _) => ([-p.re, 0.0], [1.0, 1.0, 0.0]),
        (Some(q), zeros) => {
            let a = [-(p + q).re, (p * q).re];
            match zeros {
                Zeros::Nyquist => (a, [1.0, 2.0, 1.0]),
                Zeros::Rest => (a, [1.0, -2.0, 1.0]),
                Zeros::Both => (a, [1.0, 0.0, -1.0]),
            }
        }
    };
    let gain = match band {
        // Summed in this order both are exact: so is the gain at z = 1 or -1.
        Band::Low(_) => ((1.0 + a[0]) + a[1]) / ((b[0] + b[2]) + b[1]),
        Band::High(_) => ((1.0 - a[0]) + a[1]) / ((b[0] + b[2]) - b[1]),
        Band::Pass(low, high) => {
            let centre = 2.0 * ((prewarped(low, Ts) * prewarped(high, Ts)).sqrt() / 2.0).atan();
            1.0 / Section { b, a }.at(Complex::from_polar(1.0, centre)).norm()
        }
    };
    Section { b: b.map(|b| b * gain), a }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TS: f64 = 0.02;

    fn gain(sos: &Sos, w: f64) -> f64 {
        sos.at(w * TS).norm()
    }

    #[test]
    fn every_order_has_half_power_at_its_cutoffs_and_one_where_it_passes() {
        for order in 1..=MOST_ORDER {
            let low = butter(order, Band::Low(20.0), TS).expect("a filter");
            let high = butter(order, Band::High(20.0), TS).expect("a filter");
            let pass = butter(order, Band::Pass(1.0, 120.0), TS).expect("a filter");
            let half = 0.5f64.sqrt();
            for g in [gain(&low, 20.0), gain(&high, 20.0), gain(&pass, 1.0), gain(&pass, 120.0)] {
                assert!((g - half).abs() < 1e-9, "order {order}: {g}");
            }
            for g in [gain(&low, 0.0), gain(&high, PI / TS)] {
                assert!((g - 1.0).abs() < 1e-14, "order {order}: {g}");
            }
        }
    }

    #[test]
    fn the_gain_at_rest_is_exact() {
        for order in 1..=MOST_ORDER {
            for band in [Band::Low(20.0), Band::High(3.0), Band::Pass(1.0, 20.0)] {
                let sos = butter(order, band, TS).expect("a filter");
                let gains = sos.sections.iter().map(|s| {
                    let [b0, b1, b2] = s.b;
                    ((b0 + b2) + b1) / ((1.0 + s.a[0]) + s.a[1])
                });
                assert_eq!(gains.product::<f64>(), sos.dc_gain, "order {order}, {band:?}");
            }
        }
    }

    #[test]
    fn what_no_filter_can_be_is_refused() {
        let code = |order, band, Ts| butter(order, band, Ts).expect_err("no filter").code();
        assert_eq!(code(0, Band::Low(1.0), TS), "U01");
        assert_eq!(code(21, Band::Low(1.0), TS), "U01");
        assert_eq!(code(2, Band::Low(f64::NAN), TS), "U01");
        assert_eq!(code(2, Band::High(-1.0), TS), "U01");
        assert_eq!(code(2, Band::Pass(3.0, 3.0), TS), "U01");
        assert_eq!(code(2, Band::Low(1.0), 0.0), "U01");
        assert_eq!(code(2, Band::Low(PI / TS), TS), "M10");
        assert_eq!(code(2, Band::Pass(1.0, 200.0), TS), "M10");
    }
}
