//! Batch estimators: one method per file.

mod arx;
mod fit;
mod iv4;
mod least_squares;
mod orders;
mod pem;
mod poly_fit;
mod process;
mod sampling;
mod step_modes;

pub use arx::arx;
pub use fit::{Fit, Status, criteria, standard_deviations, widened};
pub use iv4::iv4;
pub use least_squares::{LinearFit, least_squares};
pub use orders::Orders;
pub use pem::{PemOptions, pem};
pub use process::{ProcessOptions, p1d};
pub use sampling::sampling;
pub use step_modes::{
    Kind, Mode, Parts, StepModes, StepModesOptions, Transformed, Tried, areas, band, idt_criterion,
    step_modes,
};
