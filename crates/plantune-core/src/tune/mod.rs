//! From a model to controller settings, their margins, and how the loop behaves.

mod bands;
mod half_rule;
mod imc;
mod imc_costs;
mod indices;
mod margins;
mod open_loop;
mod precontrol;
mod rule;
mod rules;
mod tunable;

pub use bands::{Bands, bode_band, margin_bands, phase_deg, step_band};
pub use half_rule::{controllability_ratio, half_rule};
pub use imc::{Delay, Imc, classic_freqresp, imc};
pub use imc_costs::{Costs, ideal_costs, pi_costs};
pub use indices::{Indices, indices};
pub use margins::{Margins, Sensitivities, margins, sensitivities};
pub use precontrol::precontrol;
pub use rule::Settings;
pub use rules::{
    ImcTarget, Overshoot, Step, Terms, amigo, chien_hrones_reswick, cohen_coon, imc_pi, imc_pid, lambda,
    refined_ziegler_nichols, simc, simc_plus, tyreus_luyben, ziegler_nichols,
};
pub use tunable::{Estimate, check_tunable};
