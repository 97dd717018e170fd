//! Scenes for the tests: written as a user would write them, read as luxmap reads them.
#![allow(dead_code, unreachable_pub, unused_imports, reason = "each test file uses its own part")]

pub mod files;

use std::fs;
use std::path::PathBuf;

use luxmap::render::plan::{Method, Plan};
use luxmap::render::{Settings, render};
use luxmap::results::{IlluminanceMap, Results};
use luxmap::scene::Scene;
pub use luxmap::study::check::scenes::{room, sensor};

/// A folder of its own for a test.
pub fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test);
    fs::create_dir_all(&folder).expect("the target folder is writable");
    folder
}

/// Loads a scene from the text of its TOML and, unless empty, of its mesh `mesh.obj`.
pub fn scene(test: &str, toml: &str, obj: &str) -> Scene {
    let folder = folder(test);
    let mesh = if obj.is_empty() { "" } else { "[[mesh]]\nfile = \"mesh.obj\"\n" };
    fs::write(folder.join("mesh.obj"), obj).expect("the target folder is writable");
    fs::write(folder.join("scene.toml"), format!("{mesh}{toml}")).expect("the target folder is writable");
    Scene::load(&folder.join("scene.toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// One of the scenes the project ships.
pub fn shipped(name: &str) -> Scene {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    Scene::load(&file).unwrap_or_else(|error| panic!("{error}"))
}

/// Renders with a method's defaults but for the number of photons and the seed.
pub fn run(scene: &Scene, method: Method, photons: u64, seed: u64) -> Results {
    run_with(scene, method, &Settings { photons, seed, ..Settings::of(method) })
}

/// Renders with the settings given.
pub fn run_with(scene: &Scene, method: Method, settings: &Settings) -> Results {
    render(scene, &Plan::new(scene, method), settings, &()).unwrap_or_else(|error| panic!("{error}"))
}

/// Mean of the cells that have a value.
pub fn mean(map: &IlluminanceMap) -> f64 {
    let values: Vec<f64> =
        map.illuminance.iter().zip(&map.has_value).filter(|(_, has)| **has).map(|(value, _)| *value).collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// Asserts that `found` lies within `bound` (relative) of `expected`.
pub fn assert_close(what: &str, found: f64, expected: f64, bound: f64) {
    let off = found / expected - 1.0;
    println!(
        "{what}: found {found:.4}, expected {expected:.4}, off {:+.4} %, bound {:.4} %",
        100.0 * off,
        100.0 * bound
    );
    assert!(off.abs() <= bound, "{what}: found {found}, expected {expected} ± {:.3} %", 100.0 * bound);
}
