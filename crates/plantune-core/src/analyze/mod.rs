//! A look at the data before a model.

mod delay;
mod health;
mod sentinels;
mod spikes;
mod stuck;

pub use delay::{DelayScan, delay_scan};
pub use health::{Health, health};
pub use sentinels::{Sentinel, sentinels};
pub use spikes::{Spike, spikes, spikes_notes};
pub use stuck::{Stretch, stuck};
