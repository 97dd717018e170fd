//! How far a run has come, on stderr; silent when that is no terminal.

use std::sync::Mutex;

use indicatif::{ProgressBar, ProgressStyle};

use super::signals::interrupted;
use crate::progress::Progress;

/// One bar, for the current stage.
pub(super) struct TerminalBar {
    quiet: bool,
    state: Mutex<State>,
}

struct State {
    bar: ProgressBar,
    /// The error after the passes so far.
    so_far: String,
}

impl TerminalBar {
    /// Nothing to see yet.
    pub(super) fn new(quiet: bool) -> Self {
        Self { quiet, state: Mutex::new(State { bar: ProgressBar::hidden(), so_far: String::new() }) }
    }
}

impl TerminalBar {
    /// Takes it off the terminal, so that something else can be said there.
    pub(super) fn clear(&self) {
        if let Ok(mut state) = self.state.lock() {
            state.bar.finish_and_clear();
            state.so_far.clear();
        }
    }
}

impl Progress for TerminalBar {
    fn stage(&self, name: &'static str, steps: u64) {
        let Ok(mut state) = self.state.lock() else { return };
        state.bar.finish_and_clear();
        if self.quiet {
            return;
        }
        let style = ProgressStyle::with_template("{msg:16} {wide_bar} {percent:>3} %  {per_sec}  {eta} left{prefix}")
            .expect("the template is valid");
        state.bar = ProgressBar::new(steps).with_style(style).with_message(name).with_prefix(state.so_far.clone());
    }

    fn advance(&self, steps: u64) {
        if let Ok(state) = self.state.lock() {
            state.bar.inc(steps);
        }
    }

    fn pass(&self, passes: u32, percent: f64) {
        if let Ok(mut state) = self.state.lock() {
            state.so_far = format!("  pass {passes}: ± {percent:.2} %");
        }
    }

    fn interrupted(&self) -> bool {
        interrupted()
    }
}

impl Drop for TerminalBar {
    fn drop(&mut self) {
        self.clear();
    }
}
