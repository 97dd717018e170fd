//! The seed office against its converged map.

use crate::common::reference::compare;
use crate::common::{run, shipped};
use luxmap::scene::plan::Method;

#[test]
fn probe() {
    for method in [Method::Gather, Method::Split, Method::Photons] {
        for seed in 0..3 {
            let start = std::time::Instant::now();
            let results = run(&shipped("seed-office.toml"), method, 1_000_000, seed);
            for map in &results.maps {
                println!(
                    "{} {} passes {}: {:?} {:?}",
                    method.name(),
                    map.name,
                    results.run.passes,
                    compare(map),
                    start.elapsed()
                );
            }
        }
    }
}
