//! What Ctrl-C and the system's wish to end (SIGINT, SIGTERM, SIGHUP) do: no file is left half-written.

use std::sync::atomic::{AtomicBool, Ordering};

use super::complain;
use crate::files::write::remove_temporaries;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static PATIENT: AtomicBool = AtomicBool::new(false);

/// Whether a signal has come.
pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// From now on the first signal ends the run after the current pass, with the results so far; the second ends it at
/// once.
pub(super) fn end_after_pass() {
    PATIENT.store(true, Ordering::Relaxed);
}

/// A signal ends the command at once, with code 130, unless it has asked for patience.
pub(super) fn listen() {
    let heard = || {
        let first = !INTERRUPTED.swap(true, Ordering::Relaxed);
        if first && PATIENT.load(Ordering::Relaxed) {
            complain("luxmap: interrupted; ends after the pass in hand (once more: at once)");
            return;
        }
        remove_temporaries();
        std::process::exit(130);
    };
    // Where the system refuses, signals do what they always did.
    let _ = ctrlc::set_handler(heard);
}
