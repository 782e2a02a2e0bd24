//! Estimators that learn one sample at a time.

mod bank;
mod cusum;
mod forgetting;
mod gate;
mod innovation;
mod rls;
mod room;
mod rpem;
mod ud;
mod window;

pub use bank::{Bank, BankSettings};
pub use cusum::{CLIP, Cusum, Sum};
pub use forgetting::{Forgetting, Scheme};
pub use gate::Gate;
pub use innovation::{Innovation, Judged};
pub use rls::Rls;
pub use room::Room;
pub use rpem::{Rpem, Settings, Structure, Trace};
pub use ud::Ud;
pub use window::{Estimate, Mode, Predictor, Window};
