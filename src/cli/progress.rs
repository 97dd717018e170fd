//! How far a run has come, on stderr; silent when that is no terminal. Ctrl-C ends the run after the pass in hand.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressStyle};

use crate::render::Progress;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Whether Ctrl-C was heard.
pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// One bar, for the stage in hand.
pub(super) struct Bar {
    quiet: bool,
    state: Mutex<State>,
}

struct State {
    bar: ProgressBar,
    /// What the passes so far came to.
    so_far: String,
}

impl Bar {
    /// Takes over Ctrl-C: the first ends the run with what it has, the second ends it at once.
    pub(super) fn new(quiet: bool) -> Self {
        let heard = || {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        };
        // A second handler in one process is refused; the first does the same.
        let _ = ctrlc::set_handler(heard);
        Self { quiet, state: Mutex::new(State { bar: ProgressBar::hidden(), so_far: String::new() }) }
    }
}

impl Progress for Bar {
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

impl Drop for Bar {
    fn drop(&mut self) {
        if let Ok(state) = self.state.lock() {
            state.bar.finish_and_clear();
        }
    }
}
