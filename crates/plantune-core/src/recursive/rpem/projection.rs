//! Keeps the roots of a polynomial that an estimator divides by within a circle.
//!
//! Of order 1, `1 + p1 q^-1`: `|p1| <= r`. Of order 2 the triangle in which both roots are, `|p2| <= r^2` and
//! `|p1| <= r + p2/r`. These two are cut to that; of a higher order the whole step of the parameters is halved
//! until the roots, scaled by `1/r`, pass Schur and Cohn's recursion.
//! Ljung and Söderström 1983, 6.6.

/// Cuts `1 + p1 q^-1`; whether that was needed.
#[inline(always)]
pub fn one(p1: &mut f64, radius: f64) -> bool {
    cut(p1, radius)
}

/// Cuts `1 + p1 q^-1 + p2 q^-2`; whether that was needed.
#[inline(always)]
pub fn two(p1: &mut f64, p2: &mut f64, radius: f64) -> bool {
    let second = cut(p2, radius * radius);
    cut(p1, radius + *p2 / radius) | second
}

#[inline(always)]
fn cut(p: &mut f64, most: f64) -> bool {
    let outside = p.abs() > most;
    if outside {
        *p = most.copysign(*p);
    }
    outside
}

/// Whether all roots of `1 + p1 q^-1 + …` lie inside the circle.
pub fn inside(p: &[f64], radius: f64, room: &mut Vec<f64>) -> bool {
    let mut scale = 1.0;
    room.clear();
    room.push(1.0);
    room.extend(p.iter().map(|p| {
        scale /= radius;
        p * scale
    }));
    let half = |n: usize| n.div_ceil(2);
    while room.len() > 1 {
        let n = room.len() - 1;
        let k = room[n];
        if !(k.abs() < 1.0) {
            return false;
        }
        let per = 1.0 / (1.0 - k * k);
        for i in 0..half(n) {
            let (a, b) = (room[i], room[n - i]);
            // Entries i and n - i of the next polynomial need only each other's.
            room[i] = (a - k * b) * per;
            if i > 0 {
                room[n - i] = (b - k * a) * per;
            }
        }
        if n.is_multiple_of(2) {
            room[n / 2] *= (1.0 - k) * per;
        }
        room.truncate(n);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::white;
    use crate::poly::roots;

    fn largest_root(p: &[f64]) -> f64 {
        roots(&[&[1.0], p].concat()).iter().map(|(re, im)| re.hypot(*im)).fold(0.0, f64::max)
    }

    #[test]
    fn what_is_cut_is_inside_and_what_was_inside_is_left() {
        for seed in 0..300 {
            for n in 1..3 {
                let before: Vec<f64> = white(n, seed).iter().map(|x| 1.2 * x).collect();
                let mut p = before.clone();
                let changed = match &mut p[..] {
                    [p1, p2] => two(p1, p2, 0.98),
                    p => one(&mut p[0], 0.98),
                };
                assert!(largest_root(&p) <= 0.98 + 1e-7 && changed == (p != before));
                assert_eq!(changed, largest_root(&before) > 0.98, "{before:?}");
            }
        }
    }

    #[test]
    fn a_higher_order_is_judged_by_its_roots() {
        let (mut room, mut kinds) = (Vec::with_capacity(8), [0, 0]);
        for seed in 0..400 {
            let n = 3 + seed as usize % 4;
            let p: Vec<f64> = white(n, seed).iter().map(|x| 0.45 * x).collect();
            let size = largest_root(&p);
            if (size - 0.9).abs() > 1e-6 {
                assert_eq!(inside(&p, 0.9, &mut room), size < 0.9, "{p:?} {size}");
                kinds[usize::from(size < 0.9)] += 1;
            }
        }
        assert!(kinds[0] > 50 && kinds[1] > 50, "{kinds:?}");
    }
}
