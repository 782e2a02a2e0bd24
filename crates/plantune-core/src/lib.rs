//! All arithmetic of plantune.
//!
//! | letter | meaning |
//! |---|---|
//! | `u y e N` | input, output, white noise, samples |
//! | `theta phi P` | parameters, regressor, covariance |
//! | `A B C D F nk` | polynomials in `q^-1` and the delay in samples |
//! | `K T L` | process model `K e^(-L s) / (T s + 1)` |
//! | `Kp Ti Td Tf` | PID, standard form |
//!
//! Modules, each importing only from those before it: `error note limits` · `linalg poly stats` ·
//! `record excitation relation regress signal` · `model` · `sim` · `batch recursive hysteresis` · `analyze` · `validate` · `tune` ·
//! `adapt`.

#![deny(unsafe_code)]
// The field's letters keep their case: N, K, T, L, Ts, A(q).
#![allow(non_snake_case)]

pub mod adapt;
pub mod analyze;
pub mod batch;
pub mod error;
pub mod excitation;
pub mod hysteresis;
pub mod limits;
pub mod linalg;
pub mod model;
pub mod note;
pub mod poly;
pub mod record;
pub mod recursive;
pub mod regress;
pub mod relation;
pub mod signal;
pub mod sim;
pub mod stats;
pub mod tune;
pub mod validate;

pub use error::{Error, Result};
pub use limits::Limits;
pub use note::{Note, Place, Severity};
pub use record::Record;
