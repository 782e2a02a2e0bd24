//! What the caller or the data got wrong: one error type, carrying the evidence of a [`Note`].

use crate::note::{Note, Place, Severity};

/// Result of every core function that can refuse.
pub type Result<T> = std::result::Result<T, Error>;

/// A refusal. Its class follows from the first letter of its code:
/// `U` wrong argument, `D` data, `X` and `M` not identifiable, `N` numerics, `R` and `C` running service.
#[derive(Clone, Debug, PartialEq)]
pub struct Error(Box<Note>);

impl Error {
    /// A refusal with its one-line text; the evidence follows by the builder calls below.
    pub fn new(code: &'static str, text: impl Into<String>) -> Self {
        Error(Box::new(Note::new(code, Severity::Error, text)))
    }

    /// A wrong argument: which, what came, what is needed.
    pub fn argument(name: &str, came: impl std::fmt::Display, needed: &str) -> Self {
        Error::new("U01", format!("`{name}` is {came}, must be {needed}"))
            .at(Place::column(name))
            .remedy(format!("pass `{name}` as {needed}"))
    }

    /// Where.
    pub fn at(mut self, place: Place) -> Self {
        self.0.place = Some(place);
        self
    }

    /// How many.
    pub fn count(mut self, count: usize) -> Self {
        self.0.count = Some(count);
        self
    }

    /// Measured value against its limit.
    pub fn measured(mut self, measured: f64, limit: f64) -> Self {
        self.0.measured = Some(measured);
        self.0.limit = Some(limit);
        self
    }

    /// What to do next.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.0.remedy = remedy.into();
        self
    }

    /// The evidence.
    pub fn note(&self) -> &Note {
        &self.0
    }

    /// The code, for tests and dispatch.
    pub fn code(&self) -> &'static str {
        self.0.code
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.0.code, self.0.text)
    }
}

impl std::error::Error for Error {}
