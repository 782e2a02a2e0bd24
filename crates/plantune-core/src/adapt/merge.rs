//! Accepted estimates merged into what is known of the plant.
//!
//! ```text
//! K_a <- K_a (1 - C) + K_mean C          (3.7-14), T and L alike: (3.7-15), (3.7-16)
//! K_e  = K_n (1 - C) + K_a C             (3.7-17), T and L alike: (3.7-18), (3.7-19)
//! K_e  = K_a                             without nominal parameters
//! ```
//!
//! `C`, the rate C_AR of the source, lies in (0, 1]. The first estimate is the first `K_a`, as table 3.7-2
//! begins. With nominal parameters the result keeps the share `1 - C` of them for good. Source 001, 3.7.4 f.

use crate::error::{Error, Result};
use crate::model::{Fopdt, check_fopdt};

/// The accumulated parameters.
///
/// ```
/// use plantune_core::adapt::Merge;
/// use plantune_core::model::Fopdt;
///
/// let mut merge = Merge::new(0.5, None)?;
/// merge.step(&Fopdt { K: 2.0, T: 1.0, L: 0.0 });
/// assert_eq!(merge.step(&Fopdt { K: 4.0, T: 1.0, L: 0.2 }), Fopdt { K: 3.0, T: 1.0, L: 0.1 });
/// # Ok::<(), plantune_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Merge {
    rate: f64,
    nominal: Option<Fopdt>,
    accumulated: Option<Fopdt>,
}

impl Merge {
    /// With the rate `C` in (0, 1], and nominal parameters if there are any.
    pub fn new(rate: f64, nominal: Option<Fopdt>) -> Result<Self> {
        if !(rate > 0.0 && rate <= 1.0) {
            return Err(Error::argument("merge rate", rate, "in (0, 1]"));
        }
        nominal.as_ref().map_or(Ok(()), check_fopdt)?;
        Ok(Merge { rate, nominal, accumulated: None })
    }

    /// Takes an accepted estimate and returns the merged parameters.
    pub fn step(&mut self, mean: &Fopdt) -> Fopdt {
        let accumulated = self.accumulated.map_or(*mean, |a| mixed(&a, mean, self.rate));
        self.accumulated = Some(accumulated);
        self.nominal.map_or(accumulated, |n| mixed(&n, &accumulated, self.rate))
    }

    /// Forgets the estimates, as at a new operating point; the nominal parameters stay.
    pub fn reset(&mut self) {
        self.accumulated = None;
    }
}

/// `old (1 - C) + new C`.
fn mixed(old: &Fopdt, new: &Fopdt, C: f64) -> Fopdt {
    let mix = |old: f64, new: f64| old * (1.0 - C) + new * C;
    Fopdt { K: mix(old.K, new.K), T: mix(old.T, new.T), L: mix(old.L, new.L) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Fopdt = Fopdt { K: -6.0, T: 0.15, L: 0.1 };
    const B: Fopdt = Fopdt { K: -5.0, T: 0.25, L: 0.2 };

    fn near(a: &Fopdt, K: f64, T: f64, L: f64) -> bool {
        [(a.K, K), (a.T, T), (a.L, L)].iter().all(|(a, b)| (a - b).abs() < 1e-14)
    }

    #[test]
    fn without_nominal_parameters_it_is_a_moving_average_that_starts_at_the_first() {
        let mut merge = Merge::new(0.2, None).expect("sound");
        assert_eq!(merge.step(&A), A);
        assert!(near(&merge.step(&B), -5.8, 0.17, 0.12));
        assert!(near(&merge.step(&B), -5.64, 0.186, 0.136));
        merge.reset();
        assert_eq!(merge.step(&B), B);
    }

    #[test]
    fn nominal_parameters_keep_their_share() {
        let mut merge = Merge::new(0.2, Some(A)).expect("sound");
        for _ in 0..200 {
            merge.step(&B);
        }
        assert!(near(&merge.step(&B), -5.8, 0.17, 0.12));
        assert_eq!(Merge::new(1.0, Some(A)).expect("sound").step(&B), B);
    }

    #[test]
    fn rates_and_plants_that_are_none_are_refused() {
        for rate in [0.0, 1.1, f64::NAN] {
            assert_eq!(Merge::new(rate, None).expect_err("refused").code(), "U01");
        }
        assert_eq!(Merge::new(0.5, Some(Fopdt { T: -1.0, ..A })).expect_err("T < 0").code(), "M12");
    }
}
