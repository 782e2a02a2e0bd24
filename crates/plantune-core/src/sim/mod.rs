//! Models at work: over a record, in a closed loop, and under a relay.

mod actuator;
mod arc;
mod closed_loop;
mod continuous;
mod controller;
mod forecast;
mod horizon;
mod indices;
mod irregular;
mod live;
mod matrix_over_record;
mod over_record;
mod plant;
mod ramped;
mod relay;
mod schedule;
mod settings;
mod state;
mod states_ahead;
mod varying;

pub use actuator::Actuator;
pub use closed_loop::{ClosedLoop, LoopPlant, LoopRun, closed_loop, closed_loop_into};
pub use controller::{AntiWindup, SampledPid};
pub use forecast::{Forecast, Forecaster};
pub use horizon::{default_horizon, load_horizon};
pub use indices::{Indices, Watch};
pub use live::{LiveLoop, LivePlant, LiveSettings, LiveState};
pub use matrix_over_record::matrix_over_record;
pub use over_record::{OverRecord, Start, over_record};
pub use plant::{Plant, SampledPlant};
pub use relay::{RelaySettings, relay};
pub use schedule::{Schedule, Table};
pub use settings::ClosedLoopSettings;
pub use varying::{Varying, VaryingPlant};
