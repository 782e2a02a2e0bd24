//! Square systems `A X = B` of a few unknowns, real or complex.

use nalgebra::{ComplexField, DMatrix};

/// `A^-1 B` for `A (n, n)` and `B (n, m)`, row-major; nothing where `A` is singular to rounding.
pub fn left_divide<T: ComplexField<RealField = f64> + Copy>(a: &[T], b: &[T], n: usize) -> Option<Vec<T>> {
    let m = b.len() / n;
    let lu = DMatrix::from_row_slice(n, n, a).lu();
    let pivots: Vec<f64> = lu.u().diagonal().iter().map(|p| p.modulus()).collect();
    let most = pivots.iter().fold(0.0f64, |most, p| most.max(*p));
    if !(pivots.iter().all(|p| *p > SINGULAR * most)) {
        return None;
    }
    let x = lu.solve(&DMatrix::from_row_slice(n, m, b))?;
    Some((0..n * m).map(|ij| x[(ij / m, ij % m)]).collect())
}

/// Share of the largest pivot below which a pivot is rounding.
const SINGULAR: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quotient_times_its_divisor_is_the_dividend() {
        let (a, b) = ([2.0, 1.0, 1.0, 3.0], [3.0, -1.0, 0.0, 5.0, 2.0, 1.0]);
        let x = left_divide(&a, &b, 2).expect("regular");
        for (ij, b) in b.iter().enumerate() {
            let (i, j) = (ij / 3, ij % 3);
            let product: f64 = (0..2).map(|k| a[2 * i + k] * x[3 * k + j]).sum();
            assert!((product - b).abs() < 1e-14);
        }
        assert!(left_divide(&[1.0, 2.0, 2.0, 4.0], &[1.0, 1.0], 2).is_none());
    }
}
