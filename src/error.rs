//! What can go wrong, said in one line: where, what was found, what was expected, and what to do.

use std::fmt;
use std::path::{Path, PathBuf};

/// A place in a file a user wrote: `scenes/office.toml:41`, or the file alone where no line is to blame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// The file, as the user named it.
    pub file: PathBuf,
    /// Line number, counted from 1.
    pub line: Option<usize>,
}

impl Location {
    /// A line of a file, counted from 1.
    pub fn line(file: &Path, line: usize) -> Self {
        Self { file: file.to_owned(), line: Some(line) }
    }

    /// A file as a whole.
    pub fn file(file: &Path) -> Self {
        Self { file: file.to_owned(), line: None }
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A message is one line, whatever a file is called.
        for c in self.file.to_string_lossy().chars() {
            if c.is_control() { write!(f, "{}", c.escape_default())? } else { write!(f, "{c}")? }
        }
        self.line.map_or(Ok(()), |line| write!(f, ":{line}"))
    }
}

/// Why an input can't be used. Its message is one line: `file:line: found …, expected …; hint`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    /// Where the input says so.
    pub at: Location,
    /// What stands there.
    pub found: String,
    /// What could have stood there.
    pub expected: String,
    /// What to do about it, where that is known.
    pub hint: Option<String>,
}

impl InputError {
    /// An error without a hint.
    pub fn new(at: Location, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { at, found: found.into(), expected: expected.into(), hint: None }
    }

    /// The same error, with what to do about it.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: found {}, expected {}", self.at, self.found, self.expected)?;
        self.hint.as_ref().map_or(Ok(()), |hint| write!(f, "; {hint}"))
    }
}

impl std::error::Error for InputError {}

/// Why a command could not do its work.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene, or a file it names, can't be used.
    #[error("{0}")]
    Input(#[from] InputError),
    /// A result could not be written.
    #[error("{}: can't be written: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Embree is missing, of a release that luxmap does not know, or refused.
    #[error("Embree: {0}")]
    Embree(String),
    /// An option of the command makes no sense here.
    #[error("{0}")]
    Usage(String),
}
