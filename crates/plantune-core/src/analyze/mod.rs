//! A look at the data before a model.

mod delay;
mod delay_evidence;
mod exclude;
mod feedback;
mod health;
mod impulse;
mod oe_scan;
mod period;
mod quantised;
mod saturated;
mod sentinels;
mod spikes;
mod stuck;
mod xcorr;

pub use delay::{DelayScan, delay_scan};
pub use delay_evidence::{DelayEvidence, delay_evidence};
pub use exclude::{Actuators, Excluded, exclude};
pub use feedback::p_of_feedback;
pub use health::{Health, health};
pub use impulse::{ImpulseOptions, ImpulseResponse, Kernel, Response, impulse};
pub use oe_scan::OeScan;
pub use quantised::{Resolution, resolution};
pub use saturated::{Ends, Saturated, guessed_ends, saturated};
pub use sentinels::{Sentinel, sentinels};
pub use spikes::{Spike, spikes, spikes_notes};
pub use stuck::{Stretch, stuck};
pub use xcorr::{Correlation, xcorr};
