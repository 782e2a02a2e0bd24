//! Models at work: over a record, and in a closed loop.

mod closed_loop;
mod over_record;

pub use closed_loop::{ClosedLoop, ClosedLoopSettings, closed_loop, default_horizon, load_horizon};
pub use over_record::{OverRecord, Start, over_record};
