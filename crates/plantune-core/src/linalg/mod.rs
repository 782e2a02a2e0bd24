//! The only door to matrices: streaming QR, rank-revealing solution, eigenvalues, draws.

mod blocked;
mod congruence;
mod draws;
mod eigen;
mod forward;
mod golden;
mod gram;
mod hermitian;
mod kernel;
mod levenberg;
mod lines;
mod logarithm;
mod nnls;
mod qr;
mod recursion;
mod reflect;
mod riccati;
mod ridge;
mod schur;
mod segmented;
mod simplex;
mod solve;
mod square;
mod svd;

pub use blocked::triangle_of;
pub use congruence::congruence;
#[cfg(test)]
pub use draws::white;
pub use draws::{Random, normal_draws};
pub use eigen::{Singular, eigenvalues, exponential, right_singular_vectors, symmetric_eigenvalues};
pub use forward::forward;
pub use golden::golden;
pub use gram::Gram;
pub use hermitian::hermitian_inverse;
pub use kernel::{dot, extent, fetch, scale_into, sum, vectorised};
pub use levenberg::{MOST_STEPS, Minimum, Residuals, TIE, minimise};
pub use lines::Lines;
pub use logarithm::logarithm;
pub use nnls::{NonNegative, nnls};
pub use qr::{BLOCK, Block, Triangle};
pub use recursion::Recursion;
pub use riccati::{kalman_gain, lyapunov};
pub use ridge::Ridge;
pub use schur::stabilised;
pub use segmented::Segmented;
pub use simplex::simplex;
pub use solve::{RankDeficient, Solution, residual_norm2, solve, solve_damped};
pub use square::left_divide;
pub use svd::{
    Matrix, Svd, least_squares, left_singular, lower, over_triangle, pseudo_inverse, svd, symmetric_powers,
};

pub use nalgebra::Complex;
