//! From a model to controller settings, their margins, and how the loop behaves.

mod bands;
mod indices;
mod margins;
mod relay;
mod rules;
mod tunable;

pub use bands::{Bands, bode_band, margin_bands, phase_deg, step_band};
pub use indices::{Indices, indices};
pub use margins::{Margins, Sensitivities, margins, sensitivities};
pub use relay::{Known, RelayTest, relay};
pub use rules::{
    ImcTarget, Overshoot, Step, Terms, amigo, chien_hrones_reswick, cohen_coon, imc_pi, lambda,
    refined_ziegler_nichols, simc, simc_plus, tyreus_luyben, ziegler_nichols,
};
pub use tunable::{Estimate, check_tunable};
