//! How far a run has come, on stderr; silent when that is no terminal.

use std::sync::Mutex;

use indicatif::{ProgressBar, ProgressStyle};

use crate::render::Progress;

/// One bar, for the stage in hand.
pub(super) struct Bar {
    quiet: bool,
    bar: Mutex<ProgressBar>,
}

impl Bar {
    pub(super) fn new(quiet: bool) -> Self {
        Self { quiet, bar: Mutex::new(ProgressBar::hidden()) }
    }
}

impl Progress for Bar {
    fn stage(&self, name: &'static str, steps: u64) {
        let Ok(mut bar) = self.bar.lock() else { return };
        bar.finish_and_clear();
        if self.quiet {
            return;
        }
        let style = ProgressStyle::with_template("{msg:16} {wide_bar} {percent:>3} %  {per_sec}  {eta} left")
            .expect("the template is valid");
        *bar = ProgressBar::new(steps).with_style(style).with_message(name);
    }

    fn advance(&self, steps: u64) {
        if let Ok(bar) = self.bar.lock() {
            bar.inc(steps);
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Ok(bar) = self.bar.lock() {
            bar.finish_and_clear();
        }
    }
}
