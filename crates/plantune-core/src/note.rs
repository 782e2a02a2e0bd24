//! What the data leave in doubt: a code, where, how many, measured against which limit, and what to do.
//!
//! The same evidence serves a warning inside a result ([`Note`]) and a refusal
//! ([`crate::error::Error`]); the codes are those of the bad-input catalogue (`D07`, `X02`, …).

/// How serious a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// Said for the record, nothing to do.
    Info,
    /// The result stands, with a doubt.
    Warning,
    /// No result.
    Error,
}

impl Severity {
    /// The word used in Python and in JSON.
    pub fn as_str(self) -> &'static str {
        match self {
            Severity::Info => "info",
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
}

/// Four significant digits, short in print.
pub fn rounded(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

/// `a, b and c`.
pub fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// The place in a record that a finding speaks of; `row` counts in the original file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Place {
    /// Column or argument name.
    pub column: String,
    /// First row concerned.
    pub row: Option<usize>,
    /// Its time in seconds.
    pub time: Option<f64>,
}

impl Place {
    /// A column or an argument as a whole.
    pub fn column(name: &str) -> Self {
        Place { column: name.to_owned(), ..Place::default() }
    }
}

/// One finding, with its evidence.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// Code of the catalogue, without a class letter in front.
    pub code: &'static str,
    /// How serious it is.
    pub severity: Severity,
    /// Where it was first seen.
    pub place: Option<Place>,
    /// How many rows, columns or values are concerned.
    pub count: Option<usize>,
    /// What was measured.
    pub measured: Option<f64>,
    /// What would have been allowed.
    pub limit: Option<f64>,
    /// One thing to do next.
    pub remedy: String,
    /// What was found, one line.
    pub text: String,
}

impl Note {
    /// A finding with its one-line text; the evidence follows by the builder calls below.
    pub fn new(code: &'static str, severity: Severity, text: impl Into<String>) -> Self {
        Note {
            code,
            severity,
            place: None,
            count: None,
            measured: None,
            limit: None,
            remedy: String::new(),
            text: text.into(),
        }
    }

    /// A doubt.
    pub fn warning(code: &'static str, text: impl Into<String>) -> Self {
        Note::new(code, Severity::Warning, text)
    }

    /// What forbids a result.
    pub fn error(code: &'static str, text: impl Into<String>) -> Self {
        Note::new(code, Severity::Error, text)
    }

    /// A remark.
    pub fn info(code: &'static str, text: impl Into<String>) -> Self {
        Note::new(code, Severity::Info, text)
    }

    /// Where.
    pub fn at(mut self, place: Place) -> Self {
        self.place = Some(place);
        self
    }

    /// How many.
    pub fn count(mut self, count: usize) -> Self {
        self.count = Some(count);
        self
    }

    /// Measured value against its limit.
    pub fn measured(mut self, measured: f64, limit: f64) -> Self {
        self.measured = Some(measured);
        self.limit = Some(limit);
        self
    }

    /// What to do next.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = remedy.into();
        self
    }
}
