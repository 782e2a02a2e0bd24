//! A look at the data before a model.

mod column;
mod delay;
mod density;
mod excitation;
mod exclude;
mod health;
mod noise;
mod period;
mod quantised;
mod reach;
mod response;
mod saturated;
mod sentinels;
mod spikes;
mod stuck;

pub use column::Column;
pub use delay::{DelayScan, delay_scan};
pub use density::{Density, DensityOptions, density, periodogram};
pub use excitation::{Excitation, excitation};
pub use exclude::{Actuators, Excluded, exclude};
pub use health::{Health, health};
pub use noise::{Colour, Comparison, Histogram, Moments, Noise, NoiseOptions, Part, noise};
pub use quantised::{Resolution, resolution, step_of_reading};
pub use reach::reach;
pub use response::{Coherence, Response, Way, coherence, response};
pub use saturated::{Ends, Saturated, guessed_ends, saturated};
pub use sentinels::{Sentinel, sentinels};
pub use spikes::{Spike, spikes, spikes_notes};
pub use stuck::{Stretch, stuck};
