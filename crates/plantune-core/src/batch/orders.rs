//! Orders of the polynomial family `A y = sum_i B_i/F_i u_i(t - nk_i) + d + C/D e`, checked against a record.

use crate::error::{Error, Result};
use crate::excitation::{check_input_motion, excitation_order, too_poor};
use crate::limits::Limits;
use crate::linalg::dot;
use crate::model::PolyModel;
use crate::note::Place;
use crate::record::Record;
use crate::stats::centred;

/// Rows per parameter below which excitation cannot be judged.
const FEW_ROWS: usize = 4;

/// Numbers of free coefficients, in the order of `theta`, and delays; `nb nf nk` one per input.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Orders {
    /// Of `A`.
    pub na: usize,
    /// Of each `B`.
    pub nb: Vec<usize>,
    /// Of `C`.
    pub nc: usize,
    /// Of `D`.
    pub nd: usize,
    /// Of each `F`.
    pub nf: Vec<usize>,
    /// Delays in samples.
    pub nk: Vec<usize>,
}

/// `na = 1, nb = 2`, and one number per input in brackets where there are several; no zeros.
impl std::fmt::Display for Orders {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let one = |n: usize| (n > 0).then(|| n.to_string());
        let each = |n: &[usize]| if n.len() == 1 { one(n[0]) } else { Some(format!("{n:?}")) };
        let all = [
            ("na", one(self.na)),
            ("nb", each(&self.nb)),
            ("nc", one(self.nc)),
            ("nd", one(self.nd)),
            ("nf", each(&self.nf)),
        ];
        let said = all.into_iter().filter_map(|(name, n)| Some(format!("{name} = {}", n?)));
        f.write_str(&said.collect::<Vec<String>>().join(", "))
    }
}

impl Orders {
    /// `A y = B u + d + e`.
    pub fn arx(na: usize, nb: Vec<usize>, nk: Vec<usize>) -> Self {
        let nf = vec![0; nb.len()];
        Orders { na, nb, nf, nk, ..Orders::default() }
    }

    /// `A y = B u + d + C e`.
    pub fn armax(na: usize, nb: Vec<usize>, nc: usize, nk: Vec<usize>) -> Self {
        Orders { nc, ..Orders::arx(na, nb, nk) }
    }

    /// `y = B/F u + d + e`.
    pub fn oe(nb: Vec<usize>, nf: Vec<usize>, nk: Vec<usize>) -> Self {
        Orders { nb, nf, nk, ..Orders::default() }
    }

    /// Whether the noise model is more than a moving average beside `A`.
    pub(super) fn has_many_minima(&self) -> bool {
        self.nd > 0 || self.nc > 0 && self.nf.iter().any(|&nf| nf > 0)
    }

    /// Those of a model.
    pub fn of(model: &PolyModel) -> Self {
        let each = |p: &[Vec<f64>], less: usize| p.iter().map(|p| p.len() - less).collect();
        Orders {
            na: model.A.len() - 1,
            nb: each(&model.B, 0),
            nc: model.C.len() - 1,
            nd: model.D.len() - 1,
            nf: each(&model.F, 1),
            nk: model.nk.clone(),
        }
    }

    /// Whether the one-step error is linear in the coefficients.
    pub fn is_arx(&self) -> bool {
        self.nc + self.nd + self.nf.iter().sum::<usize>() == 0
    }

    /// Number of coefficients.
    pub fn n(&self) -> usize {
        self.na + self.nb.iter().sum::<usize>() + self.nc + self.nd + self.nf.iter().sum::<usize>()
    }

    /// The same with all orders cut to less and less, down to 1; the delays stay.
    pub fn lower(&self) -> impl Iterator<Item = Orders> {
        let most = self.nb.iter().chain(&self.nf).chain([&self.na, &self.nc, &self.nd]).max().copied();
        let cut = |orders: &[usize], n: usize| orders.iter().map(|&k| k.min(n)).collect();
        (1..most.unwrap_or(0)).rev().map(move |n| Orders {
            na: self.na.min(n),
            nb: cut(&self.nb, n),
            nc: self.nc.min(n),
            nd: self.nd.min(n),
            nf: cut(&self.nf, n),
            nk: self.nk.clone(),
        })
    }

    /// Rows until every lag of `A` and `B` lies in the record.
    pub fn history(&self) -> usize {
        let inputs = self.nb.iter().zip(&self.nk).map(|(nb, nk)| nk + nb - 1);
        inputs.chain([self.na]).max().unwrap_or(0)
    }

    /// The model with coefficients `theta`.
    pub fn model(&self, theta: &[f64], Ts: f64) -> PolyModel {
        let ones = |n: &usize| [vec![1.0], vec![0.0; *n]].concat();
        let mut model = PolyModel {
            A: ones(&self.na),
            B: self.nb.iter().map(|&nb| vec![0.0; nb]).collect(),
            C: ones(&self.nc),
            D: ones(&self.nd),
            F: self.nf.iter().map(ones).collect(),
            nk: self.nk.clone(),
            Ts,
        };
        model.set_theta(theta);
        model
    }

    /// `a1 … b1 … c1 … d1 … f1 …`, with the input behind a b or f when there are several: `b1[power]`.
    pub fn names(&self, rec: &Record) -> Vec<String> {
        let one = |letter: &'static str, n: usize| (1..=n).map(move |k| format!("{letter}{k}"));
        let per_input = |letter: &'static str, orders: &[usize]| {
            let of = |(i, &n): (usize, &usize)| {
                let input = if rec.nu == 1 { String::new() } else { format!("[{}]", rec.input_name(i)) };
                (1..=n).map(move |k| format!("{letter}{k}{input}"))
            };
            orders.iter().enumerate().flat_map(of).collect::<Vec<String>>()
        };
        let (b, f) = (per_input("b", &self.nb), per_input("f", &self.nf));
        one("a", self.na).chain(b).chain(one("c", self.nc)).chain(one("d", self.nd)).chain(f).collect()
    }

    /// Refuses orders that do not fit the record (U01), rows fewer than parameters (X03), inputs that stand
    /// still (X01), delays beyond the allowed share (X05) and inputs too poor for the orders (X02).
    pub(super) fn check(&self, rec: &Record, constant: bool, limits: &Limits) -> Result<()> {
        if rec.ny != 1 {
            let came = format!("a record with {} outputs", rec.ny);
            return Err(Error::argument("rec", came, "one with a single output"));
        }
        self.check_inputs(rec, self.n() + usize::from(constant), limits)
    }

    /// The same for one of several outputs, of so many parameters.
    pub(super) fn check_inputs(&self, rec: &Record, parameters: usize, limits: &Limits) -> Result<()> {
        self.check_shape(rec)?;
        if rec.N() <= parameters {
            return Err(too_short(rec.N().saturating_sub(self.history()), parameters));
        }
        check_input_motion(rec, limits)?;
        if let Some(copied) = copied_input(rec) {
            return Err(copied);
        }
        self.check_delays(rec, limits)?;
        let usable = rec.segments().map(|s| s.len().saturating_sub(self.history())).sum();
        if usable <= parameters {
            return Err(too_short(usable, parameters));
        }
        self.check_excitation(rec, limits)
    }

    fn check_shape(&self, rec: &Record) -> Result<()> {
        for (name, given) in [("nb", &self.nb), ("nf", &self.nf), ("nk", &self.nk)] {
            if given.len() != rec.nu {
                let needed = format!("a number or a list of {}, one per input", rec.nu);
                return Err(Error::argument(name, format!("{given:?}"), &needed));
            }
        }
        if self.nb.contains(&0) {
            return Err(Error::argument("nb", format!("{:?}", self.nb), "at least 1"));
        }
        Ok(())
    }

    fn check_delays(&self, rec: &Record, limits: &Limits) -> Result<()> {
        for (i, &nk) in self.nk.iter().enumerate() {
            let share = nk as f64 / rec.N() as f64;
            if share >= limits.X05 {
                let of = if rec.nu > 1 { format!(" of {}", rec.input_name(i)) } else { String::new() };
                let text = format!("nk = {nk}{of} is {:.0} % of a record of {} rows", 100.0 * share, rec.N());
                return Err(Error::new("X05", text)
                    .at(Place::column(rec.input_name(i)))
                    .measured(nk as f64, limits.X05 * rec.N() as f64)
                    .remedy("record at least three times as long as the delay"));
            }
        }
        Ok(())
    }

    fn check_excitation(&self, rec: &Record, limits: &Limits) -> Result<()> {
        for (i, (nb, nf)) in self.nb.iter().zip(&self.nf).enumerate() {
            let wanted = self.na + nb + nf;
            if rec.N() < FEW_ROWS * wanted {
                continue; // The Hankel matrix would be hardly taller than wide; the regressor's rank decides.
            }
            let supported = excitation_order(rec, i, wanted, limits.X02);
            if supported < wanted {
                let poles = if self.na > 0 { "na" } else { "nf" };
                return Err(too_poor(rec, i, supported, wanted, limits).remedy(format!(
                    "ask for {poles} + nb <= {supported}, or record with a PRBS or several steps"
                )));
            }
        }
        Ok(())
    }
}

/// X03: fewer rows than parameters.
pub(super) fn too_short(rows: usize, parameters: usize) -> Error {
    Error::new("X03", format!("{rows} usable rows for {parameters} parameters"))
        .count(rows)
        .measured(rows as f64, parameters as f64 + 1.0)
        .remedy("record longer or ask for lower orders")
}

/// X11: two inputs whose centred columns agree but for a factor.
pub(super) fn copied_input(rec: &Record) -> Option<Error> {
    if rec.nu == 1 {
        return None;
    }
    let columns: Vec<Vec<f64>> = (0..rec.nu).map(|i| centred(rec.input(i).into_owned())).collect();
    let pairs = (0..rec.nu).flat_map(|i| (i + 1..rec.nu).map(move |j| (i, j)));
    let share = |(i, j): (usize, usize)| {
        let (a, b) = (&columns[i], &columns[j]);
        (i, j, 1.0 - dot(a, b).powi(2) / (dot(a, a) * dot(b, b)))
    };
    let (i, j, share) = pairs.map(share).find(|&(_, _, share)| share < 1e-10)?;
    let (a, b) = (rec.input_name(i), rec.input_name(j));
    let error = Error::new("X11", format!("inputs {a} and {b} copy each other"));
    let remedy = format!("leave {b} out, or move it on its own");
    Some(error.at(Place::column(b)).measured(share, 1e-10).remedy(remedy))
}
