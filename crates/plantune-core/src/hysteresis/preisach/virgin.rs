//! The demagnetised state: relays of `alpha + beta < 0` are up, the others down, as after a decaying alternation.
//!
//! ```text
//! G(s)     = weight of the relays that are up with beta < -s
//!          = G(S) + integral from s to S of -dE(t, -t)/d beta dt        S = min(L_n, -L_0)
//! f(fall to -s)  = -T + 2 G(s)                    T = E(L_n, L_0)
//! f(rise to s)   = f(fall to -s) + 2 E(s, -s)
//! ```
//!
//! Between levels the integrand is a straight line, so that the middle of each stretch gives the integral exactly.
//! Where mu is the same for (alpha, beta) and (-beta, -alpha), as of plays, the first rise is `E(x, -x)`.

use super::everett::Everett;

/// The line `alpha = -beta` as far as the grid reaches.
#[derive(Clone, Debug)]
pub struct Virgin {
    s: Vec<f64>,
    G: Vec<f64>,
    total: f64,
}

impl Virgin {
    /// None where the range does not hold 0: all relays are then on one side.
    pub fn of(E: &Everett) -> Option<Self> {
        let (low, high) = E.ends();
        let reach = high.min(-low);
        if reach <= 0.0 {
            return None;
        }
        let mut s: Vec<f64> = E.levels().iter().map(|l| l.abs()).filter(|l| *l < reach).collect();
        s.extend([0.0, reach]);
        s.sort_by(f64::total_cmp);
        s.dedup();
        let total = E.between(E.locate(high), E.locate(low));
        let mut G = vec![total - E.between(E.locate(high), E.locate(-reach)); s.len()];
        for k in (0..s.len() - 1).rev() {
            G[k] = G[k + 1] + (s[k + 1] - s[k]) * beside(E, 0.5 * (s[k] + s[k + 1]));
        }
        Some(Virgin { s, G, total })
    }

    /// `S`.
    pub fn reach(&self) -> f64 {
        self.s[self.s.len() - 1]
    }

    /// f at the end of a fall to `-s`, of the first fall that goes so far.
    pub fn fallen(&self, E: &Everett, s: f64) -> f64 {
        let k = self.s.partition_point(|t| *t < s).min(self.s.len() - 1);
        -self.total + 2.0 * (self.G[k] + (self.s[k] - s) * beside(E, 0.5 * (self.s[k] + s)))
    }

    /// f at the end of a rise to `s`, of the first rise that goes so far.
    pub fn risen(&self, E: &Everett, s: f64) -> f64 {
        self.fallen(E, s) + 2.0 * E.between(E.locate(s), E.locate(-s))
    }

    /// The `s` at which the first rise, or fall, comes to `f`; None beyond its end.
    pub fn seek(&self, E: &Everett, f: f64, rising: bool) -> Option<f64> {
        let short = |s: f64| if rising { self.risen(E, s) < f } else { self.fallen(E, s) > f };
        if short(self.reach()) {
            return None;
        }
        let (mut below, mut above) = (0.0, self.reach());
        loop {
            let middle = 0.5 * (below + above);
            if middle <= below || middle >= above {
                return Some(above);
            }
            (below, above) = if short(middle) { (middle, above) } else { (below, middle) };
        }
    }
}

/// `-dE(s, -s)/d beta`.
fn beside(E: &Everett, s: f64) -> f64 {
    E.slope(E.locate(s), E.locate(-s))
}
