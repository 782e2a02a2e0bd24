//! From a model to controller settings, their margins, and how the loop behaves.

mod action;
mod bands;
mod border;
mod closed_loop;
mod cloud;
pub mod forms;
mod half_rule;
mod imc;
mod imc_costs;
mod loop_shape;
mod margins;
mod open_loop;
mod optimise;
mod posterior;
mod precontrol;
mod relay;
mod room;
mod rule;
mod rules;
mod stability;
mod tunable;

pub use action::Action;
pub use bands::{Bands, bode_band, margin_bands, phase_deg, step_band};
pub use border::{border, departures};
pub use closed_loop::{ClosedLoopTransfers, closed_loop_transfers};
pub use cloud::{Fitted, cloud};
pub use half_rule::{controllability_ratio, half_rule};
pub use imc::{Imc, classic_freqresp, imc};
pub use imc_costs::{Costs, ideal_costs, pi_costs, tracking_cost};
pub use loop_shape::loop_shape;
pub use margins::{Margins, Sensitivities, margins, sensitivities};
pub use optimise::{Answer, Optimum, Wish, iae, optimise};
pub use posterior::{Posterior, posterior, seconds};
pub use precontrol::precontrol;
pub use relay::{Known, RelayTest, relay};
pub use room::Robustness;
pub use rule::Settings;
pub use rules::{
    ImcTarget, Overshoot, Step, Terms, amigo, chien_hrones_reswick, cohen_coon, imc_pi, imc_pid, lambda,
    refined_ziegler_nichols, simc, simc_plus, tyreus_luyben, ziegler_nichols,
};
pub use stability::{Setting, Stability, stability};
pub use tunable::{Estimate, check_tunable};
