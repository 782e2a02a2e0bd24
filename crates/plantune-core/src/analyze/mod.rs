//! A look at the data before a model.

mod column;
mod compression;
mod delay;
mod delay_evidence;
mod density;
mod excitation;
mod exclude;
mod experiment;
mod feedback;
mod health;
mod impulse;
mod informative;
mod noise;
mod oe_scan;
mod period;
mod quantised;
mod reach;
mod response;
mod saturated;
mod sentinels;
mod spikes;
mod stuck;
mod xcorr;

pub use column::Column;
pub use compression::{Compression, Refilled, compressed_outputs, compression};
pub use delay::{DelayScan, delay_scan};
pub use delay_evidence::{DelayEvidence, delay_evidence};
pub use density::{Density, DensityOptions, density, periodogram};
pub use excitation::{Excitation, excitation};
pub use exclude::{Actuators, Excluded, exclude};
pub use experiment::{
    Disturbance, Experiment, Plan, Predicted, Room, Shape, Trial, experiment, judged, near_zero,
};
pub use feedback::p_of_feedback;
pub use health::{Health, health};
pub use impulse::{ImpulseOptions, ImpulseResponse, Kernel, PathResponse, impulse};
pub use informative::{Informative, InformativeOptions, InformativeStretch, Window, informative};
pub use noise::{Colour, Comparison, Histogram, Moments, Noise, NoiseOptions, Part, noise};
pub use oe_scan::OeScan;
pub use quantised::{Resolution, resolution, step_of_reading};
pub use reach::reach;
pub use response::{Coherence, Response, Way, coherence, response};
pub use saturated::{Ends, Saturated, guessed_ends, saturated};
pub use sentinels::{Sentinel, sentinels};
pub use spikes::{Spike, spikes, spikes_notes};
pub use stuck::{Stretch, stuck};
pub use xcorr::{Correlation, xcorr};
