//! Cohen-Coon settings for first order plus dead time.
//!
//! ```text
//! r = L / T
//! PI:   Kp = (0.9 / r + 1/12) / K,  Ti = L (30 + 3 r) / (9 + 20 r)
//! PID:  Kp = (4/3 / r + 1/4) / K,   Ti = L (32 + 6 r) / (13 + 8 r)
//!       Td = 4 L / (11 + 2 r),      Tf = Td / 10
//! ```
//!
//! G. H. Cohen and G. A. Coon, Theoretical consideration of retarded control, Trans. ASME 75 (1953), in the
//! rounded fractions of the textbooks. Places the dominant poles so that a load decays by three quarters
//! each period. Several independent public copies have these fractions, one the range of `r` from 0.1 to 1
//! that the verb notes; others go up to 2 or 4. The filter is ours. A negative gain gives a negative `Kp`.

use super::{Terms, check_delayed, pid};
use crate::error::Result;
use crate::model::{Fopdt, Model, Pid};
use crate::tune::rule::{Found, Rule, Settings};

/// Settings; the plant must settle and have a dead time.
pub fn cohen_coon(model: &Model, terms: Terms) -> Result<Settings> {
    Rule::new("Cohen-Coon", &|plant| first(plant, terms)).on(model, None)
}

fn first(&Fopdt { K, T, L }: &Fopdt, terms: Terms) -> Found {
    check_delayed(L, "Cohen-Coon")?;
    let r = L / T;
    let settings = match terms {
        Terms::Pi => Pid::pi((0.9 / r + 1.0 / 12.0) / K, L * (30.0 + 3.0 * r) / (9.0 + 20.0 * r)),
        Terms::Pid => pid(
            (4.0 / 3.0 / r + 0.25) / K,
            L * (32.0 + 6.0 * r) / (13.0 + 8.0 * r),
            4.0 * L / (11.0 + 2.0 * r),
        ),
    };
    Ok((settings, f64::NAN))
}
