//! The 27 nonlinear problems of NIST StRD through the optimiser that serves PEM, from both starts.
//!
//! Each formula is written once and taken with dual numbers, so its slopes are those of calculus. Starts, data and
//! certified values are read from `nist_strd/nonlinear` in the folder that `PLANTUNE_DATA` names.

#![allow(clippy::panic, reason = "a test that cannot read its file has failed")]
#![allow(clippy::suspicious_arithmetic_impl, reason = "the slope of a product is a sum")]

use std::f64::consts::PI;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::path::PathBuf;

use plantune_core::linalg::{Block, Residuals, Triangle, dot, minimise};

const MOST: usize = 9; // parameters of ENSO

/// A value and its slopes by the parameters.
#[derive(Clone, Copy)]
struct Dual {
    x: f64,
    d: [f64; MOST],
}

impl Dual {
    fn parameter(x: f64, j: usize) -> Self {
        Dual { x, d: std::array::from_fn(|i| f64::from(u8::from(i == j))) }
    }

    /// `f` of it, whose value and slope are given.
    fn chain(self, x: f64, slope: f64) -> Self {
        Dual { x, d: self.d.map(|d| slope * d) }
    }

    fn exp(self) -> Self {
        let x = self.x.exp();
        self.chain(x, x)
    }

    /// Of a negative number there is none.
    fn ln(self) -> Self {
        self.chain(self.x.ln(), 1.0 / self.x)
    }

    fn sin(self) -> Self {
        self.chain(self.x.sin(), self.x.cos())
    }

    fn cos(self) -> Self {
        self.chain(self.x.cos(), -self.x.sin())
    }

    fn atan(self) -> Self {
        self.chain(self.x.atan(), 1.0 / (1.0 + self.x * self.x))
    }

    fn squared(self) -> Self {
        self * self
    }
}

impl From<f64> for Dual {
    fn from(x: f64) -> Self {
        Dual { x, d: [0.0; MOST] }
    }
}

impl<T: Into<Dual>> Add<T> for Dual {
    type Output = Dual;
    fn add(self, other: T) -> Dual {
        let other = other.into();
        Dual { x: self.x + other.x, d: std::array::from_fn(|i| self.d[i] + other.d[i]) }
    }
}

impl<T: Into<Dual>> Mul<T> for Dual {
    type Output = Dual;
    fn mul(self, other: T) -> Dual {
        let other = other.into();
        Dual { x: self.x * other.x, d: std::array::from_fn(|i| self.d[i] * other.x + self.x * other.d[i]) }
    }
}

impl<T: Into<Dual>> Sub<T> for Dual {
    type Output = Dual;
    fn sub(self, other: T) -> Dual {
        self + -other.into()
    }
}

impl<T: Into<Dual>> Div<T> for Dual {
    type Output = Dual;
    fn div(self, other: T) -> Dual {
        let other = other.into();
        self * other.chain(1.0 / other.x, -1.0 / (other.x * other.x))
    }
}

impl Neg for Dual {
    type Output = Dual;
    fn neg(self) -> Dual {
        self.chain(-self.x, -1.0)
    }
}

fn one() -> Dual {
    Dual::from(1.0)
}

fn power(base: Dual, exponent: Dual) -> Dual {
    (exponent * base.ln()).exp()
}

/// `c0 + c1 x + c2 x^2 + …`
fn polynomial(c: &[Dual], x: f64) -> Dual {
    c.iter().rev().fold(Dual::from(0.0), |sum, c| sum * x + *c)
}

fn ratio(above: &[Dual], below: &[Dual], x: f64) -> Dual {
    polynomial(above, x) / (polynomial(below, x) * x + 1.0)
}

fn bell(height: Dual, centre: Dual, width: Dual, x: f64) -> Dual {
    height * (-((centre - x) / width).squared()).exp()
}

/// A cosine and a sine of the same period.
fn wave(c: Dual, s: Dual, period: impl Into<Dual>, x: f64) -> Dual {
    let phase = Dual::from(2.0 * PI * x) / period;
    c * phase.cos() + s * phase.sin()
}

/// `f(b; x)`; `z` is the second predictor, which only Nelson has.
type Formula = fn(&[Dual], f64, f64) -> Dual;

const BENNETT5: Formula = |b, x, _| b[0] * power(b[1] + x, -one() / b[2]);
const BOX_BOD: Formula = |b, x, _| b[0] * (one() - (-b[1] * x).exp());
const CHWIRUT: Formula = |b, x, _| (-b[0] * x).exp() / (b[1] + b[2] * x);
const DAN_WOOD: Formula = |b, x, _| b[0] * (b[1] * x.ln()).exp();
const ECKERLE4: Formula = |b, x, _| b[0] / b[1] * (((b[2] - x) / b[1]).squared() * -0.5).exp();
const ENSO: Formula =
    |b, x, _| b[0] + wave(b[1], b[2], 12.0, x) + wave(b[4], b[5], b[3], x) + wave(b[7], b[8], b[6], x);
const GAUSS: Formula =
    |b, x, _| b[0] * (-b[1] * x).exp() + bell(b[2], b[3], b[4], x) + bell(b[5], b[6], b[7], x);
const KIRBY2: Formula = |b, x, _| ratio(&b[..3], &b[3..], x);
const CUBIC_RATIO: Formula = |b, x, _| ratio(&b[..4], &b[4..], x);
const LANCZOS: Formula =
    |b, x, _| b[0] * (-b[1] * x).exp() + b[2] * (-b[3] * x).exp() + b[4] * (-b[5] * x).exp();
const MGH09: Formula = |b, x, _| b[0] * (b[1] * x + x * x) / (b[2] * x + b[3] + x * x);
const MGH10: Formula = |b, x, _| b[0] * (b[1] / (b[2] + x)).exp();
const MGH17: Formula = |b, x, _| b[0] + b[1] * (-b[3] * x).exp() + b[2] * (-b[4] * x).exp();
const MISRA1B: Formula = |b, x, _| b[0] * (one() - one() / (b[1] * (x / 2.0) + 1.0).squared());
const MISRA1C: Formula = |b, x, _| b[0] * (one() - power(b[1] * (2.0 * x) + 1.0, Dual::from(-0.5)));
const MISRA1D: Formula = |b, x, _| b[0] * b[1] * x / (b[1] * x + 1.0);
const NELSON: Formula = |b, x, z| b[0] - b[1] * x * (-b[2] * z).exp(); // of log y
const RAT42: Formula = |b, x, _| b[0] / ((b[1] - b[2] * x).exp() + 1.0);
const RAT43: Formula = |b, x, _| b[0] / power((b[1] - b[2] * x).exp() + 1.0, one() / b[3]);
const ROSZMAN1: Formula = |b, x, _| b[0] - b[1] * x - (b[2] / (-b[3] + x)).atan() / PI;

const PROBLEMS: [(&str, Formula); 27] = [
    ("Bennett5", BENNETT5),
    ("BoxBOD", BOX_BOD),
    ("Chwirut1", CHWIRUT),
    ("Chwirut2", CHWIRUT),
    ("DanWood", DAN_WOOD),
    ("ENSO", ENSO),
    ("Eckerle4", ECKERLE4),
    ("Gauss1", GAUSS),
    ("Gauss2", GAUSS),
    ("Gauss3", GAUSS),
    ("Hahn1", CUBIC_RATIO),
    ("Kirby2", KIRBY2),
    ("Lanczos1", LANCZOS),
    ("Lanczos2", LANCZOS),
    ("Lanczos3", LANCZOS),
    ("MGH09", MGH09),
    ("MGH10", MGH10),
    ("MGH17", MGH17),
    ("Misra1a", BOX_BOD),
    ("Misra1b", MISRA1B),
    ("Misra1c", MISRA1C),
    ("Misra1d", MISRA1D),
    ("Nelson", NELSON),
    ("Rat42", RAT42),
    ("Rat43", RAT43),
    ("Roszman1", ROSZMAN1),
    ("Thurber", CUBIC_RATIO),
];

/// What a file says: data as rows `[y, x, …]`, both starts, the certified values.
struct Problem {
    f: Formula,
    rows: Vec<Vec<f64>>,
    starts: [Vec<f64>; 2],
    certified: Vec<f64>,
    most_steps: usize,
}

impl Problem {
    fn parsed(text: &str, name: &str, f: Formula) -> Self {
        let numbers =
            |line: &str| line.split_whitespace().map_while(|w| w.parse().ok()).collect::<Vec<f64>>();
        let is_parameter = |line: &&str| line.trim_start().starts_with('b') && line.contains(" =  ");
        let table: Vec<Vec<f64>> = text
            .lines()
            .filter(is_parameter)
            .filter_map(|line| line.split_once('=').map(|(_, rest)| numbers(rest)))
            .filter(|row| row.len() == 4)
            .collect();
        let column = |j: usize| table.iter().map(|row| row[j]).collect::<Vec<f64>>();
        let data = text.lines().skip_while(|line| !line.starts_with("Data:   ")).skip(1);
        let mut rows: Vec<Vec<f64>> = data.map(numbers).filter(|row| row.len() > 1).collect();
        if name == "Nelson" {
            rows.iter_mut().for_each(|row| row[0] = row[0].ln());
        }
        Problem { f, rows, starts: [column(0), column(1)], certified: column(2), most_steps: 2000 }
    }

    /// Correct digits of the worst parameter; 11 are certified.
    fn digits(&self, theta: &[f64]) -> f64 {
        let error = |(ours, truth): (&f64, &f64)| ((ours - truth) / truth).abs();
        let worst = theta.iter().zip(&self.certified).map(error).fold(1e-11, f64::max);
        -worst.log10()
    }
}

impl Residuals for Problem {
    fn linearise(&mut self, theta: &[f64]) -> Option<Triangle> {
        let b: Vec<Dual> = theta.iter().enumerate().map(|(j, &x)| Dual::parameter(x, j)).collect();
        let n = b.len();
        let (mut triangle, mut block) = (Triangle::new(n + 1), Block::new(n + 1));
        for row in &self.rows {
            let f = (self.f)(&b, row[1], row.get(2).copied().unwrap_or(0.0));
            let psi_eps = [&f.d[..n], &[row[0] - f.x]].concat();
            if !psi_eps.iter().all(|x| x.abs() < 1e100) {
                return None;
            }
            block.push(&psi_eps);
        }
        triangle.absorb(&mut block);
        Some(triangle)
    }

    fn project(&self, _theta: &mut [f64]) {}

    fn exact(&self) -> f64 {
        let y: Vec<f64> = self.rows.iter().map(|row| row[0]).collect();
        1e-26 * dot(&y, &y)
    }

    fn most_steps(&self) -> usize {
        self.most_steps
    }
}

/// The problems, or nothing where the files are not there.
fn problems() -> Vec<(&'static str, Problem)> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let data = std::env::var("PLANTUNE_DATA").unwrap_or_else(|_| "../shared/data".into());
    let folder = root.join(data).join("nist_strd/nonlinear");
    if !folder.is_dir() {
        println!("skipped: {} is not there; PLANTUNE_DATA names the folder of data", folder.display());
        return Vec::new();
    }
    let read = |&(name, f): &(&'static str, Formula)| {
        let path = folder.join(format!("{name}.dat"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        (name, Problem::parsed(&text, name, f))
    };
    PROBLEMS.iter().map(read).collect()
}

#[test]
fn every_problem_from_both_starts_gives_six_digits() {
    let mut failed = Vec::new();
    for (name, mut problem) in problems() {
        for start in problem.starts.clone() {
            let text = format!("{name} from {start:?}");
            let Some(end) = minimise(&mut problem, start) else {
                failed.push(format!("{text}: no model"));
                continue;
            };
            let digits = problem.digits(&end.theta);
            println!("{text}: {digits:.1} digits, slope {:.0e}", end.slope);
            if digits < 6.0 || !end.converged {
                failed.push(format!("{text}: {digits:.1} digits, converged: {}", end.converged));
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// N05: wherever a search is cut off, it says "converged" only at the minimum.
#[test]
fn a_search_cut_short_does_not_claim_its_end() {
    for (name, mut problem) in problems() {
        for start in problem.starts.clone() {
            for most_steps in [0, 1, 2, 5, 10, 20, 50] {
                problem.most_steps = most_steps;
                let end = minimise(&mut problem, start.clone()).expect("a model at the start");
                let digits = problem.digits(&end.theta);
                assert!(!end.converged || digits >= 6.0, "{name} {most_steps}: {digits}");
            }
        }
    }
}
