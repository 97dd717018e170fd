//! Convergence as it happens: a run that tells how far it has come, and one without an end that a program ends when it
//! likes.
//!
//! `cargo run --release --example 05_progress`

use std::sync::atomic::{AtomicU32, Ordering};

use luxmap::{Error, Job, Progress, Stop};

/// Prints the error whenever the run works it out.
struct Told;

impl Progress for Told {
    fn stage(&self, _name: &'static str, _steps: u64) {}

    fn advance(&self, _steps: u64) {}

    fn pass(&self, passes: u32, percent: f64) {
        println!("pass {passes}: ± {percent:.2} %");
    }
}

/// Is asked after each pass whether to end, and says so the third time.
#[derive(Default)]
struct Thrice(AtomicU32);

impl Progress for Thrice {
    fn stage(&self, _name: &'static str, _steps: u64) {}

    fn advance(&self, _steps: u64) {}

    fn interrupted(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed) + 1 >= 3
    }
}

fn main() -> Result<(), Error> {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/box.toml");
    let job = Job::load(scene)?.only(&["floor"], &[])?.photons(20_000).seed(7);

    let results = job.clone().stop(Stop::at_error(2.5).or_after(20)).progress(&Told).run()?;
    println!("{} passes until ± {:.2} %", results.run.passes, 100.0 * results.run.claim);

    let thrice = Thrice::default();
    let results = job.stop(Stop::when_interrupted()).progress(&thrice).run()?;
    println!("ended by the program after {} passes", results.run.passes);
    Ok(())
}
