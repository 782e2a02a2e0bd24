//! Levels that are held in turn.

use crate::error::{Error, Result};

/// Each level for `hold` rows.
pub fn staircase(levels: &[f64], hold: usize) -> Result<Vec<f64>> {
    if hold == 0 {
        return Err(Error::argument("hold", 0, "at least 1 row"));
    }
    if !levels.iter().all(|level| level.is_finite()) {
        return Err(Error::argument("levels", "not finite", "finite numbers"));
    }
    Ok(levels.iter().flat_map(|&level| std::iter::repeat_n(level, hold)).collect())
}
