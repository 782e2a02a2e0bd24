//! `y = S(H[x])` by one convex fit, which finds `S'` over segments of y: columns z, seg, 1.
//!
//! ```text
//! seg_k(y) = clip(y, kappa_k, kappa_(k+1)) - clip(0, kappa_k, kappa_(k+1))      outermost segments without end
//! sum w_i z_i + c - sum_(k != middle) s_k seg_k(y) = seg_middle(y)              w >= 0, s >= 0
//! ```
//!
//! METHODS 4. A segment whose slope comes out as zero, or a hundred times below the others', would make S jump: it takes the slope of its neighbour towards
//! the middle, and the fit is made again.

use std::ops::Range;

use super::{Family, Fitted, deviations, numbered, told_apart};
use crate::error::Result;
use crate::hysteresis::play_states::States;
use crate::hysteresis::{AsymmetricStack, DeadZones, Model, PlayStack};
use crate::linalg::{Triangle, nnls};

/// Slope of `S'`, as a share of the median, from which on a segment stands by itself.
const FLAT: f64 = 0.01;

pub(super) struct Asymmetric {
    states: States,
    kappa: Vec<f64>, // inner bounds of the segments
    skipped: usize,  // segments that y skips
    offset: bool,
}

impl Asymmetric {
    pub(super) fn new(r: Vec<f64>, y: &[f64], segments: usize, offset: bool) -> Self {
        let (low, high) = y.iter().fold((f64::INFINITY, -f64::INFINITY), |(l, h), y| (l.min(*y), h.max(*y)));
        let bound = |k: usize| low + (high - low) * k as f64 / segments as f64;
        let mut kappa: Vec<f64> = Vec::new();
        for bound in (1..segments).map(bound) {
            // A segment that y skips has no slope of its own.
            let from = kappa.last().copied().unwrap_or(-f64::INFINITY);
            if y.iter().any(|y| (from..bound).contains(y)) {
                kappa.push(bound);
            }
        }
        Asymmetric { states: States::new(r), skipped: segments - 1 - kappa.len(), kappa, offset }
    }

    fn n(&self) -> usize {
        self.states.r.len()
    }

    fn segments(&self) -> usize {
        self.kappa.len() + 1
    }

    /// Segments as they come, each by itself.
    fn apart(&self) -> Vec<Range<usize>> {
        (0..self.segments()).map(|k| k..k + 1).collect()
    }

    fn middle(&self, groups: &[Range<usize>]) -> usize {
        groups.iter().position(|g| g.contains(&(self.segments() / 2))).unwrap_or(0)
    }

    /// Columns z, minus each group of segments but the middle one, 1, the middle one.
    fn grouped(&self, triangle: &Triangle, groups: &[Range<usize>]) -> Triangle {
        let (n, middle, last) = (self.n(), self.middle(groups), triangle.n() - 1);
        let width = n + groups.len() + 1;
        let mut rows = Vec::with_capacity(triangle.n() * width);
        for i in 0..triangle.n() {
            let row = triangle.row(i);
            let sum = |g: &Range<usize>| row[n + g.start..n + g.end].iter().sum::<f64>();
            rows.extend_from_slice(&row[..n]);
            rows.extend(groups.iter().enumerate().filter(|(k, _)| *k != middle).map(|(_, g)| -sum(g)));
            rows.extend([row[last], sum(&groups[middle])]);
        }
        Triangle::of_rows(width, rows.chunks_exact(width))
    }

    fn columns(&self, groups: usize) -> Vec<usize> {
        (0..self.n() + groups - 1 + usize::from(self.offset)).collect()
    }
}

impl Family for Asymmetric {
    fn width(&self) -> usize {
        self.n() + self.segments() + 1
    }

    fn row(&mut self, x: f64, y: f64, row: &mut [f64]) {
        let (n, m) = (self.n(), self.segments());
        row[..n].copy_from_slice(self.states.step(x));
        for (k, seg) in row[n..n + m].iter_mut().enumerate() {
            let low = if k == 0 { -f64::INFINITY } else { self.kappa[k - 1] };
            let high = self.kappa.get(k).copied().unwrap_or(f64::INFINITY);
            *seg = y.clamp(low, high) - 0.0_f64.clamp(low, high);
        }
        row[n + m] = 1.0;
    }

    fn check(&self, triangle: &Triangle) -> Result<()> {
        let groups = self.apart();
        told_apart(&self.grouped(triangle, &groups), &self.columns(groups.len()), self.n())
    }

    fn fit(&self, triangle: &Triangle, N: usize) -> Result<Fitted> {
        let n = self.n();
        let mut groups = self.apart();
        loop {
            let (m, middle) = (groups.len(), self.middle(&groups));
            let (grouped, columns) = (self.grouped(triangle, &groups), self.columns(m));
            let free: Vec<bool> = columns.iter().map(|j| *j == n + m - 1).collect();
            let found = nnls(&grouped, &columns, &free, n + m, &[]);
            let mut s = found.x[n..n + m - 1].to_vec();
            s.insert(middle, 1.0);
            if let Some(flat) = flattest(&s, middle) {
                let into = if flat < middle { flat + 1 } else { flat - 1 };
                groups[into] =
                    groups[flat].start.min(groups[into].start)..groups[flat].end.max(groups[into].end);
                groups.remove(flat);
                continue;
            }
            let knots = groups[1..].iter().map(|g| self.kappa[g.start - 1]).collect();
            let c = found.x.get(n + m - 1).copied().unwrap_or(0.0);
            let zones = DeadZones { knots, slopes: s.clone(), offset: -c }.inverse();
            let all = deviations(&grouped, &columns, &found, N);
            let sd = deviations_of_slopes(&all, &s, middle, n, &zones);
            let plays = PlayStack::virgin(self.states.r.clone(), found.x[..n].to_vec(), 0.0);
            let names = numbered("w", n).chain(numbered("slope", m)).chain(["offset".to_owned()]).collect();
            let merged = self.skipped + self.segments() - m;
            return Ok(Fitted {
                model: Model::Asymmetric(AsymmetricStack { plays, zones }),
                names,
                sd,
                merged,
            });
        }
    }
}

/// The segment that would make S jump, if there is one.
fn flattest(s: &[f64], middle: usize) -> Option<usize> {
    let mut sorted = s.to_vec();
    sorted.sort_by(f64::total_cmp);
    let least = FLAT * sorted[s.len() / 2];
    let others = (0..s.len()).filter(|k| *k != middle);
    others.min_by(|a, b| s[*a].total_cmp(&s[*b])).filter(|k| s[*k] <= least)
}

/// From those of w, of the slopes of `S'` without the middle one, and of c: those of w, of the slopes of S, of `S(0)`.
fn deviations_of_slopes(all: &[f64], s: &[f64], middle: usize, n: usize, zones: &DeadZones) -> Vec<f64> {
    let m = s.len();
    let mut sd = all[..n + m - 1].to_vec();
    sd.insert(n + middle, 0.0);
    sd[n..].iter_mut().zip(s).for_each(|(sd, s)| *sd /= s * s);
    let at_zero = zones.slopes[zones.knots.partition_point(|d| *d < 0.0)];
    sd.push(all.get(n + m - 1).copied().unwrap_or(0.0) * at_zero);
    sd
}
