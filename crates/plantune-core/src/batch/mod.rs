//! Batch estimators: one method per file.

mod arx;
mod bootstrap;
mod cancellation;
mod fit;
mod frequency;
mod huber;
mod iv4;
mod least_squares;
mod matrix_arx;
mod order_choice;
mod orders;
mod pem;
mod poly_fit;
mod process;
mod robust;
mod sampling;
mod sandwich;
mod scores;
mod settled;
mod sign_perturbed_arx;
mod sign_perturbed_sums;
mod srivc;
mod step_modes;
mod subspace;
mod term_arx;

pub use arx::arx;
pub use bootstrap::{Bootstrap, BootstrapOptions, bootstrap, spread};
pub use fit::{
    Fit, OffsetStep, Status, WIDTH, criteria, normal_interval, standard_deviations, stretched, widened,
};
pub use frequency::{Structure, frequency};
pub use huber::{Huber, huber};
pub use iv4::iv4;
pub use least_squares::{LinearFit, least_squares};
pub use matrix_arx::{MatrixFit, matrix_arx};
pub use order_choice::{OrderChoice, Tried as TriedOrders, choose_orders};
pub use orders::Orders;
pub use pem::{PemOptions, pem};
pub use process::{
    Code, Information, Known, OffsetOf, ProcessOptions, begins_as_step_test, information, p1d, process,
    process_bootstrap, process_sandwich, robust_process,
};
pub use robust::robust;
pub use sampling::sampling;
pub use sandwich::{Sandwich, sandwich};
pub use scores::{Scores, scores};
pub use sign_perturbed_arx::{arx_box, arx_contains};
pub use sign_perturbed_sums::{SignPerturbedSums, sign_perturbed_sums};
pub use srivc::{SrivcOptions, srivc};
pub use step_modes::{
    Kind, Mode, Parts, StepModes, StepModesOptions, Transformed, Tried, areas, band, idt_criterion,
    step_modes,
};
pub use subspace::{
    FrequencyFit, Method, PbsidOptions, SubspaceFit, SubspaceOptions, TriedOrder, Variant, pbsid, subspace,
    subspace_bands, subspace_frequency,
};
pub use term_arx::term_arx;
