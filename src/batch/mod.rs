//! A list of runs: read from a [`mod@file`], each [`done`] once, whatever happens in between.
//!
//! A run has a folder of its own. While it runs its state is kept there after each pass; when its results are
//! written, a marker is, last of all, which names what was asked for and the checksum of each result. So whatever ends
//! a batch, the same command goes on where it was: a marker that holds is not repeated, a checkpoint is taken up again.

pub mod done;
pub mod file;
pub mod report;

use std::path::PathBuf;

/// One run of a batch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BatchRun {
    /// Its name, and that of its folder: unlike all others of the batch.
    pub name: String,
    /// Scene file.
    pub scene: PathBuf,
    /// Options as `luxmap render` takes them, such as `--error=0.5`.
    pub options: Vec<String>,
}

/// How often an option is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arity {
    /// By its name alone.
    Switch,
    /// Once, with a value: several are several runs.
    One,
    /// Any number of times, each with a value.
    List,
}

/// The options that a batch may give.
pub struct BatchOptions<'a> {
    /// Each by its long name.
    pub known: Vec<(String, Arity)>,
    /// Checks an argument such as `--error=0.5`; says what it should be instead.
    pub check: &'a dyn Fn(&str) -> Result<(), String>,
}

/// The result of `attempt`, or the message of its panic.
pub fn caught<R>(attempt: impl FnOnce() -> R) -> Result<R, String> {
    // What a run that panicked leaves behind is dropped with it; the next one begins anew.
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(attempt)).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("without a word");
        format!("luxmap stumbled ({text}), which is a mistake in luxmap")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Also from a thread of rayon, where the work is done.
    #[test]
    fn a_panic_is_a_message() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a thread pool");
        let index = std::hint::black_box(3);
        let said = caught(|| pool.install(|| [0, 1][index])).expect_err("there is no such item");
        assert!(said.contains("index out of bounds"), "{said}");
        assert_eq!(caught(|| 7), Ok(7));
    }
}
