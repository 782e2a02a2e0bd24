//! Regressors of one's own, by name: `u(t-1)*y(t-1)`, `positive(u(t-1))`, `sign(y(t-1) - y(t-2))`.
//!
//! ```text
//! sum      = product { ("+" | "-") product }
//! product  = factor { "*" factor }
//! factor   = "-" factor | atom [ "**" digit ]
//! atom     = number | "(" sum ")" | signal "(" "t" [ "-" lag ] ")" | function "(" sum [ "," sum ] ")"
//! function = positive | negative | sign | abs | square | max | min
//! ```
//!
//! `positive(x) = max(x, 0)` and `negative(x) = min(x, 0)`: a coefficient for each direction. A signal is `u` and `y`, with
//! several inputs `u1 u2 …`, or goes by its name in the record. Text is read, never executed.

use crate::error::{Error, Result};

/// Characters of a term, so that no text nests too deep to be read.
const LONGEST: usize = 400;

/// What a term may be made of.
const NEEDED: &str = "made of lagged signals such as u(t-1) and y(t-2), numbers, + - * **, and positive negative sign abs square max min";

/// One lagged signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lagged {
    /// `u_i(t - lag)`: input, lag.
    Input(usize, usize),
    /// `y(t - lag)`, the lag at least 1.
    Output(usize),
}

impl Lagged {
    /// Samples that it looks back.
    pub fn lag(self) -> usize {
        match self {
            Lagged::Input(_, lag) | Lagged::Output(lag) => lag,
        }
    }
}

/// A regressor as it was written, and what it says.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    text: String,
    says: Node,
    signals: Vec<Lagged>,
}

#[derive(Clone, Debug, PartialEq)]
enum Node {
    Number(f64),
    Signal(Lagged),
    Sum(Box<Node>, Box<Node>),
    Product(Box<Node>, Box<Node>),
    Power(Box<Node>, i32),
    Sign(Box<Node>),
    Abs(Box<Node>),
    Max(Box<Node>, Box<Node>),
    Min(Box<Node>, Box<Node>),
}

impl Term {
    /// Reads a term; `names` are those of the `nu` inputs, then of the output. U01 where it cannot be read.
    pub fn parse(text: &str, names: &[String]) -> Result<Term> {
        let mut reader = Reader { text, rest: text, names, signals: Vec::new() };
        if text.chars().count() > LONGEST {
            return Err(reader.refusal(&format!("has more than {LONGEST} characters")));
        }
        let says = reader.sum()?;
        if !reader.rest.is_empty() {
            let text = format!("cannot be read from `{}` on", reader.rest);
            return Err(reader.refusal(&text));
        }
        if reader.signals.is_empty() {
            return Err(reader.refusal("names no signal"));
        }
        let signals = reader.signals;
        Ok(Term { text: text.trim().to_owned(), says, signals })
    }

    /// As it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The lagged signals in it.
    pub fn signals(&self) -> &[Lagged] {
        &self.signals
    }

    /// Its value where the signals have those that `at` returns.
    pub fn value(&self, at: &impl Fn(Lagged) -> f64) -> f64 {
        self.says.value(at)
    }
}

impl Node {
    fn value(&self, at: &impl Fn(Lagged) -> f64) -> f64 {
        match self {
            Node::Number(x) => *x,
            Node::Signal(lagged) => at(*lagged),
            Node::Sum(a, b) => a.value(at) + b.value(at),
            Node::Product(a, b) => a.value(at) * b.value(at),
            Node::Power(a, n) => a.value(at).powi(*n),
            Node::Sign(a) => sign(a.value(at)),
            Node::Abs(a) => a.value(at).abs(),
            Node::Max(a, b) => a.value(at).max(b.value(at)),
            Node::Min(a, b) => a.value(at).min(b.value(at)),
        }
    }

    fn minus(self) -> Node {
        Node::Product(Box::new(Node::Number(-1.0)), Box::new(self))
    }
}

/// 1, 0 or -1; standing still is no direction.
fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        x
    }
}

/// What is left of a text to read.
struct Reader<'t> {
    text: &'t str,
    rest: &'t str,
    names: &'t [String],
    signals: Vec<Lagged>,
}

impl<'t> Reader<'t> {
    fn sum(&mut self) -> Result<Node> {
        let mut sum = self.product()?;
        loop {
            let next = if self.takes("+") {
                self.product()?
            } else if self.takes("-") {
                self.product()?.minus()
            } else {
                return Ok(sum);
            };
            sum = Node::Sum(Box::new(sum), Box::new(next));
        }
    }

    fn product(&mut self) -> Result<Node> {
        let mut product = self.factor()?;
        while self.takes("*") {
            product = Node::Product(Box::new(product), Box::new(self.factor()?));
        }
        Ok(product)
    }

    fn factor(&mut self) -> Result<Node> {
        if self.takes("-") {
            return Ok(self.factor()?.minus());
        }
        let atom = self.atom()?;
        if !self.takes("**") {
            return Ok(atom);
        }
        match self.number() {
            Some(n) if (1.0..=9.0).contains(&n) && n.fract() == 0.0 => {
                Ok(Node::Power(Box::new(atom), n as i32))
            }
            _ => Err(self.refusal("needs a whole number from 1 to 9 behind **")),
        }
    }

    fn atom(&mut self) -> Result<Node> {
        if self.takes("(") {
            let inner = self.sum()?;
            self.needs(")")?;
            return Ok(inner);
        }
        if let Some(x) = self.number() {
            return Ok(Node::Number(x));
        }
        let name = self.name();
        if name.is_empty() {
            let rest = if self.rest.is_empty() { "its end" } else { self.rest };
            return Err(self.refusal(&format!("cannot be read from {rest} on")));
        }
        self.needs("(")?;
        match self.lag()? {
            Some(lag) => self.signal(name, lag),
            None => self.function(name),
        }
    }

    /// The lag if `t)` or `t - 3)` follows.
    fn lag(&mut self) -> Result<Option<usize>> {
        let before = self.rest;
        if self.name() != "t" {
            self.rest = before;
            return Ok(None);
        }
        let lag = if self.takes("-") { self.number().unwrap_or(f64::NAN) } else { 0.0 };
        if !(lag.fract() == 0.0 && (0.0..1e6).contains(&lag)) {
            return Err(self.refusal("has a lag that is no whole number of samples"));
        }
        self.needs(")")?;
        Ok(Some(lag as usize))
    }

    fn signal(&mut self, name: &str, lag: usize) -> Result<Node> {
        let nu = self.names.len() - 1;
        let given = self.names.iter().position(|n| n == name);
        let input = (0..nu).find(|i| name == format!("u{}", i + 1) || (nu == 1 && name == "u"));
        let lagged = match given.or(input).or((name == "y").then_some(nu)) {
            Some(i) if i < nu => Lagged::Input(i, lag),
            Some(_) if lag > 0 => Lagged::Output(lag),
            Some(_) => return Err(self.refusal(&format!("holds {name}(t), which is to be predicted"))),
            None => {
                let known = self.names.join(", ");
                return Err(self.refusal(&format!("names a signal `{name}`, the record has {known}")));
            }
        };
        if !self.signals.contains(&lagged) {
            self.signals.push(lagged);
        }
        Ok(Node::Signal(lagged))
    }

    fn function(&mut self, name: &str) -> Result<Node> {
        let zero = || Box::new(Node::Number(0.0));
        let first = Box::new(self.sum()?);
        let node = match name {
            "positive" => Node::Max(first, zero()),
            "negative" => Node::Min(first, zero()),
            "sign" => Node::Sign(first),
            "abs" => Node::Abs(first),
            "square" => Node::Power(first, 2),
            "max" | "min" => {
                self.needs(",")?;
                let second = Box::new(self.sum()?);
                if name == "max" { Node::Max(first, second) } else { Node::Min(first, second) }
            }
            _ => return Err(self.refusal(&format!("has a function `{name}` that is not known"))),
        };
        self.needs(")")?;
        Ok(node)
    }

    fn number(&mut self) -> Option<f64> {
        self.skip_space();
        let end = self.rest.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(self.rest.len());
        let x = self.rest[..end].parse().ok()?;
        self.rest = &self.rest[end..];
        Some(x)
    }

    fn name(&mut self) -> &'t str {
        self.skip_space();
        let end = self.rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        self.rest = rest;
        name
    }

    /// Whether this symbol is next, which is then passed; `*` is not the first half of `**`.
    fn takes(&mut self, symbol: &str) -> bool {
        self.skip_space();
        match self.rest.strip_prefix(symbol) {
            Some(rest) if symbol != "*" || !rest.starts_with('*') => {
                self.rest = rest;
                true
            }
            _ => false,
        }
    }

    fn needs(&mut self, symbol: &str) -> Result<()> {
        if self.takes(symbol) {
            return Ok(());
        }
        let rest = if self.rest.is_empty() { "its end" } else { self.rest };
        Err(self.refusal(&format!("needs `{symbol}` before {rest}")))
    }

    fn skip_space(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn refusal(&self, what: &str) -> Error {
        let text = format!("regressor `{}` {what}", self.text);
        Error::new("U01", text)
            .at(crate::note::Place::column("regressors"))
            .remedy(format!("write a regressor {NEEDED}"))
    }
}

/// A regressor of one's own: by name, or a column that the caller computed.
#[derive(Clone, Debug, PartialEq)]
pub enum Own {
    /// By name.
    Term(Term),
    /// Its name, and which of the given columns.
    Column(String, usize),
}

impl Own {
    /// What its coefficient is called.
    pub fn name(&self) -> &str {
        match self {
            Own::Term(term) => term.text(),
            Own::Column(name, _) => name,
        }
    }

    /// The lagged signals in it, as far as they are known.
    pub fn signals(&self) -> &[Lagged] {
        match self {
            Own::Term(term) => term.signals(),
            Own::Column(..) => &[],
        }
    }

    /// Its value, of lagged signals and of the given columns at this row.
    pub fn value(&self, at: &impl Fn(Lagged) -> f64, given: &[f64]) -> f64 {
        match self {
            Own::Term(term) => term.value(at),
            Own::Column(_, j) => given[*j],
        }
    }
}

/// Longest lag in any of them.
pub fn longest_lag(own: &[Own]) -> usize {
    own.iter().flat_map(Own::signals).map(|s| s.lag()).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(of: &[&str]) -> Vec<String> {
        of.iter().map(|n| (*n).to_owned()).collect()
    }

    /// `u_i(t - lag) = 10 i + lag + 0.5`, `y(t - lag) = -lag`.
    fn value(text: &str, of: &[&str]) -> f64 {
        let at = |s: Lagged| match s {
            Lagged::Input(i, lag) => 10.0 * i as f64 + lag as f64 + 0.5,
            Lagged::Output(lag) => -(lag as f64),
        };
        Term::parse(text, &names(of)).expect(text).value(&at)
    }

    #[test]
    fn a_term_has_the_value_that_it_says() {
        let (one, two) = (["volt", "speed"], ["u1", "heater", "temp"]);
        for (text, of, exact) in [
            ("u(t-1)*y(t-2)", &one[..], -3.0),
            ("volt( t - 1 ) * speed(t-2)", &one, -3.0),
            ("u2(t) - 2*heater(t-3)", &two, 10.5 - 27.0),
            ("max(y(t-1), -0.5) + min(u1(t), 0)", &two, -0.5),
            ("positive(u(t-1)) - negative(y(t-1))", &one, 2.5),
            ("sign(y(t-1) - y(t-2))", &one, 1.0),
            ("sign(y(t-3)) * abs(y(t-3))", &one, -3.0),
            ("square(u(t)) - u(t)**2", &one, 0.0),
            ("-(y(t-1) + 1)**3 - -y(t-2)", &one, -2.0),
            ("2*y(t-1)**2", &one, 2.0),
        ] {
            assert_eq!(value(text, of), exact, "{text}");
        }
    }

    #[test]
    fn what_cannot_be_read_is_refused() {
        let of = names(&["u", "y"]);
        for text in [
            "",
            "u",
            "u(t-1",
            "u(t+1)",
            "u(t-0.5)",
            "y(t)",
            "v(t-1)",
            "exp(u(t-1))",
            "u(t-1) u(t-2)",
            "3",
            "u(t-1)**0",
            "__import__('os')",
            "max(u(t-1))",
            "u(t-1)*",
            "u(t-1))",
        ] {
            let error = Term::parse(text, &of).expect_err(text);
            assert!(error.code() == "U01" && error.note().text.contains("regressor"), "{text}: {error}");
        }
        assert!(Term::parse(&"(".repeat(100_000), &of).is_err());
    }
}
