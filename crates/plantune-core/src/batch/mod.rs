//! Batch estimators: one method per file.

mod arx;
mod fit;
mod huber;
mod least_squares;
mod order_choice;
mod orders;
mod pem;
mod poly_fit;
mod process;
mod sampling;
mod step_modes;

pub use arx::arx;
pub use fit::{Fit, Status, criteria, standard_deviations, widened};
pub use huber::{Huber, huber, robust_arx, robust_pem};
pub use least_squares::{LinearFit, least_squares};
pub use order_choice::{OrderChoice, Tried as TriedOrders, choose_orders};
pub use orders::Orders;
pub use pem::{PemOptions, pem};
pub use process::{ProcessOptions, p1d};
pub use sampling::sampling;
pub use step_modes::{
    Kind, Mode, Parts, StepModes, StepModesOptions, Transformed, Tried, areas, band, idt_criterion,
    step_modes,
};
