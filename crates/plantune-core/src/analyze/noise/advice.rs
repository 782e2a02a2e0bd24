//! What follows from the noise for the choice of a model, in words.

use super::parts::FEWEST;
use super::{Noise, Part};
use crate::note::{Note, rounded};
use crate::record::Record;

/// p-value below which a difference or a correlation is believed.
const SURE: f64 = 0.01;

/// Steps of reading per standard deviation above which reading adds to the noise.
const COARSE: f64 = 1.0;

/// Doubts about the signal itself.
pub fn notes(of: &Noise, rec: &Record, column: usize, moving: bool) -> Vec<Note> {
    let place = || rec.place(column, 0);
    let name = &rec.names[column];
    let mut notes = Vec::new();
    if moving {
        notes.push(
            Note::info("X04", format!("the input moves: what `{name}` does is response and noise together"))
                .at(place())
                .remedy("analyse a stretch at rest, rec.between(...), or the residuals of a fit"),
        );
    }
    let different = |what: &str, p: Option<f64>| {
        let p = p.filter(|p| *p < SURE)?;
        let text = format!("the parts of `{name}` differ in their {what} (p = {})", rounded(p));
        let remedy = "estimate a noise model with the plant (ARMAX), or fit the parts apart";
        Some(Note::warning("M07", text).at(place()).measured(p, SURE).remedy(remedy))
    };
    if !moving {
        notes.extend(different("variance", of.comparison.p_var));
        notes.extend(different("mean", of.comparison.p_mean));
    }
    if let Some(part) = of.comparison.parts.iter().find(|p| p.N_mean.min(p.N_var) < FEWEST) {
        let rows = part.N_mean.min(part.N_var);
        notes.push(
            Note::info(
                "X03",
                format!("the parts of `{name}` hold {} independent rows: not compared", rounded(rows)),
            )
            .at(rec.place(column, part.rows.start))
            .measured(rows, FEWEST)
            .remedy("record longer at rest"),
        );
    }
    if let Some(q) = of.quantum.filter(|q| *q > COARSE * of.moments.var.sqrt()) {
        let sd = of.moments.var.sqrt();
        let text =
            format!("`{name}` is read in steps of {}, its standard deviation is {}", rounded(q), rounded(sd));
        notes.push(
            Note::warning("M04", text).at(place()).measured(q / sd, COARSE).remedy(
                "read the signal more finely: errors of reading follow the signal, they are no noise",
            ),
        );
    }
    notes
}

/// One sentence for each thing that follows.
pub fn advice(of: &Noise, moving: bool) -> Vec<String> {
    if moving {
        return vec![
            "look at the residuals of a fit for the noise: here the response is in the signal".to_owned(),
        ];
    }
    [Some(noise_model(of)), parts(of), reading(of), shape(of)].into_iter().flatten().collect()
}

fn noise_model(of: &Noise) -> String {
    if of.colour.white > SURE {
        return "white: an output-error or process model with white noise holds".to_owned();
    }
    let side = if of.colour.R[1] > 0.0 { "slow" } else { "fast" };
    format!(
        "coloured, {side} (R(1) = {:.2}, {} independent of {} rows): estimate the noise with the plant, ARMAX or BJ, \
         or process(noise=\"arma\")",
        of.colour.R[1],
        of.colour.N_mean.round(),
        of.moments.N
    )
}

fn parts(of: &Noise) -> Option<String> {
    let sd = |p: &Part| format!("{}", rounded(p.moments.var.sqrt()));
    let listed = of.comparison.parts.iter().map(sd).collect::<Vec<_>>().join(", ");
    match (of.comparison.p_var, of.comparison.p_mean) {
        (Some(p), _) if p < SURE => Some(format!(
            "the variance changes between the parts (sd {listed}): ARMAX, which is why source 001 chooses it"
        )),
        (_, Some(p)) if p < SURE => {
            Some("the level changes between the parts: give each its own offset".to_owned())
        }
        _ => None,
    }
}

fn reading(of: &Noise) -> Option<String> {
    let q = of.quantum?;
    let share = 100.0 * q * q / 12.0 / of.moments.var;
    (share > 5.0)
        .then(|| format!("steps of reading of {} make {} % of the variance", rounded(q), share.round()))
}

/// Beyond four standard errors of the kurtosis of normal noise.
fn shape(of: &Noise) -> Option<String> {
    let heavy = of.comparison.parts.iter().all(|p| p.kurtosis - 2.0 > 4.0 * (24.0 / p.N_var).sqrt());
    heavy.then(|| "heavier tails than a normal law: robust=True, or look for spikes".to_owned())
}
