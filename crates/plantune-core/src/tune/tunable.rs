//! Whether a fitted process model may be tuned on at all.

use crate::batch::sampling;
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::note::rounded;
use crate::stats::normal_quantile;

/// A parameter and its standard deviation.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Its value.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
}

/// Refuses a gain whose sign is open (X12), and a slowest time constant that lies below two sample times with
/// its whole 95 % interval (M09); the latter where there is one and a sample time is known.
pub fn check_tunable(K: Estimate, T: Option<Estimate>, Ts: Option<f64>, limits: &Limits) -> Result<()> {
    let least = limits.X12 * K.sd;
    if K.value.abs() < least {
        let text = format!("the sign of the gain is open: K = {} ± {}", rounded(K.value), rounded(K.sd));
        return Err(Error::new("X12", text)
            .measured(K.value.abs(), least)
            .remedy("record longer or with larger steps of the input"));
    }
    if let (Some(T), Some(Ts)) = (T, Ts) {
        sampling(T.value, T.value + normal_quantile(0.95) * T.sd, Ts, limits)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_sign_and_a_short_time_constant_are_refused() {
        let code = |K, T, Ts| {
            let of = |(value, sd)| Estimate { value, sd };
            check_tunable(of(K), Some(of(T)), Ts, &Limits::default()).err().map(|error| error.code())
        };
        assert_eq!(code((-1.9, 1.0), (5.0, 0.1), Some(1.0)), Some("X12"));
        assert_eq!(code((-2.1, 1.0), (5.0, 0.1), Some(1.0)), None);
        // The interval ends at 1 + 1.96 sd, the limit is at 2.
        assert_eq!(code((2.0, 0.1), (1.0, 0.5), Some(1.0)), Some("M09"));
        assert_eq!(code((2.0, 0.1), (1.0, 0.52), Some(1.0)), None);
        assert_eq!(code((2.0, 0.1), (1.0, 0.5), None), None);
    }
}
