//! Estimators that learn one sample at a time.

mod bank;
mod cusum;
mod forgetting;
mod gate;
mod innovation;
mod inverse_transform;
mod rls;
mod room;
mod rpem;
mod term_arx;
mod ud;
mod window;

/// The greater of two numbers; of one that is none, the second. One instruction, where `f64::max` takes five.
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

pub use bank::{Bank, BankSettings};
pub use cusum::{CLIP, Cusum, Sum};
pub use forgetting::{Forgetting, Scheme};
pub use gate::Gate;
pub use innovation::{Innovation, Judged};
pub use inverse_transform::InverseTransform;
pub use rls::Rls;
pub use room::Room;
pub use rpem::{Rpem, Settings, Structure, Trace};
pub use term_arx::TermArx;
pub use ud::Ud;
pub use window::{Estimate, Mode, Predictor, Window};
