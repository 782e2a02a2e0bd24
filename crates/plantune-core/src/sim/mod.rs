//! Models at work: over a record, in a closed loop, and under a relay.

mod closed_loop;
mod over_record;
mod relay;

pub use closed_loop::{ClosedLoop, ClosedLoopSettings, closed_loop, default_horizon, load_horizon};
pub use over_record::{OverRecord, Start, over_record};
pub use relay::{RelaySettings, relay};
