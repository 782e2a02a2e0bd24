//! A look at the data before a model.

mod delay;
mod exclude;
mod experiment;
mod health;
mod impulse;
mod informative;
mod period;
mod quantised;
mod saturated;
mod sentinels;
mod spikes;
mod stuck;

pub use delay::{DelayScan, delay_scan};
pub use exclude::{Actuators, Excluded, exclude};
pub use experiment::{
    Disturbance, Experiment, Plan, Predicted, Room, Shape, Trial, experiment, judged, near_zero,
};
pub use health::{Health, health};
pub use impulse::{ImpulseOptions, ImpulseResponse, Kernel, Response, impulse};
pub use informative::{Informative, InformativeOptions, InformativeStretch, Window, informative};
pub use quantised::{Resolution, resolution};
pub use saturated::{Ends, Saturated, guessed_ends, saturated};
pub use sentinels::{Sentinel, sentinels};
pub use spikes::{Spike, spikes, spikes_notes};
pub use stuck::{Stretch, stuck};
