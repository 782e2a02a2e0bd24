//! The least value of a function of one variable by golden sections.

/// Where `f` is least between `low` and `high`, and its value there, after `count` evaluations.
///
/// Of a function with one valley; the interval left is `0.618^(count - 1)` of the first.
///
/// ```
/// use plantune_core::linalg::golden;
///
/// let (x, _) = golden(|x| (x - 1.5) * (x - 1.5), 0.0, 4.0, 30);
/// assert!((x - 1.5).abs() < 1e-5);
/// ```
pub fn golden(mut f: impl FnMut(f64) -> f64, mut low: f64, mut high: f64, count: usize) -> (f64, f64) {
    let share = 0.5 * (5f64.sqrt() - 1.0);
    let inner = |low: f64, high: f64| (high - share * (high - low), low + share * (high - low));
    let (mut left, mut right) = inner(low, high);
    let (mut at_left, mut at_right) = (f(left), f(right));
    for _ in 2..count {
        if at_left <= at_right {
            high = right;
            (right, at_right) = (left, at_left);
            left = inner(low, high).0;
            at_left = f(left);
        } else {
            low = left;
            (left, at_left) = (right, at_right);
            right = inner(low, high).1;
            at_right = f(right);
        }
    }
    if at_left <= at_right { (left, at_left) } else { (right, at_right) }
}
