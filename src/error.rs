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
    /// An option is set to what makes no sense here.
    #[error("{0}")]
    Option(#[from] OptionError),
    /// What is asked for makes no sense here.
    #[error("{0}")]
    Usage(String),
}

/// Why an option is refused. Its message begins with the option's name: `groups: found method seed, expected …`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionError {
    /// It doesn't take this value.
    #[error("{option}: found {found}, expected {expected}")]
    Value {
        /// Its name.
        option: &'static str,
        /// What was given.
        found: String,
        /// What it takes.
        expected: String,
    },
    /// There is no option of this name.
    #[error("found option {found:?}, expected one of {}", known.join(", "))]
    Unknown {
        /// The name.
        found: String,
        /// Those that there are.
        known: Vec<&'static str>,
    },
    /// The paper's estimator knows no light groups.
    #[error(
        "groups: found method seed, expected gather, split, path or photons; the paper's estimator knows no groups"
    )]
    GroupsOfSeed,
    /// Photons that are counted about bodies know no light groups.
    #[error(
        "groups: found sensor {sensor} ({measure}) where photons are counted, expected method gather or path and no \
         mirror or glass, or measure = \"plane\""
    )]
    GroupsOnBody {
        /// The sensor.
        sensor: String,
        /// What it measures.
        measure: &'static str,
    },
    /// Light groups would take too much memory.
    #[error(
        "groups: found {groups} light groups at {points} points, which take about {:.0} GB, expected at most {:.0} GB; \
         fewer cells do, or luminaires that share a group",
        (bytes / 1e9).ceil(),
        most / 1e9
    )]
    GroupsTooLarge {
        /// Number of groups.
        groups: usize,
        /// Points where they would be told apart.
        points: usize,
        /// Memory that takes, bytes.
        bytes: f64,
        /// Memory that it may take, bytes.
        most: f64,
    },
    /// The run needs more memory than it may take.
    #[error(
        "memory: found {:.3} GB, expected at least {:.3} GB for this scene",
        gigabytes(*found),
        gigabytes(*needed) + 0.001
    )]
    Memory {
        /// What it may take, bytes.
        found: u64,
        /// What it needs at least, bytes.
        needed: u64,
    },
    /// The scene has no such plane or surface.
    #[error("plane: found \"{found}\", expected one of {}", known.join(", "))]
    Plane {
        /// The name asked for.
        found: String,
        /// Those of the scene.
        known: Vec<String>,
    },
    /// The scene has no such camera.
    #[error("camera: found \"{found}\", expected {}", cameras(known))]
    Camera {
        /// The name asked for.
        found: String,
        /// Those of the scene.
        known: Vec<String>,
    },
    /// So many threads can't be started.
    #[error("threads: {why}")]
    Threads {
        /// What the system said.
        why: String,
    },
}

impl OptionError {
    /// The option's name, with which the message begins; none where there is no such option.
    pub fn option(&self) -> Option<&'static str> {
        match self {
            Self::Value { option, .. } => Some(option),
            Self::Unknown { .. } => None,
            Self::GroupsOfSeed | Self::GroupsOnBody { .. } | Self::GroupsTooLarge { .. } => Some("groups"),
            Self::Memory { .. } => Some("memory"),
            Self::Plane { .. } => Some("plane"),
            Self::Camera { .. } => Some("camera"),
            Self::Threads { .. } => Some("threads"),
        }
    }
}

fn gigabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e9
}

fn cameras(known: &[String]) -> String {
    if known.is_empty() { "a scene with a [[camera]]".into() } else { format!("one of {}", known.join(", ")) }
}

/// An error of content, not of the system.
pub(crate) fn invalid(message: String) -> std::io::Error {
    std::io::Error::new(std::io::ErrorKind::InvalidData, message)
}
