//! Scenes for the tests: written as a user would write them, read as luxmap reads them.
#![allow(unreachable_pub, reason = "public within the tests")]

pub mod browser;
pub mod eulumdat;
pub mod files;
pub mod hostile;
pub mod reference;

use std::fs;
use std::panic::Location;
use std::path::{Path, PathBuf};

use luxmap::render::plan::{Method, Plan};
use luxmap::render::{Settings, Stop, render};
use luxmap::results::{IlluminanceMap, Results};
use luxmap::scene::Scene;
pub use luxmap::study::check::scenes::{room, sensor};

/// A folder of its own for a test: the name need be new within its module only.
#[track_caller]
pub fn folder(test: &str) -> PathBuf {
    let module = Path::new(Location::caller().file()).file_stem().expect("a source file has a name");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(module).join(test);
    fs::create_dir_all(&folder).expect("the target folder is writable");
    folder
}

/// Loads a scene from the text of its TOML and, unless empty, of its mesh `mesh.obj`.
#[track_caller]
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

/// Renders so many passes with the defaults of the scene's plan, noise smoothed.
pub fn passes(scene: &Scene, method: Method, passes: u32, seed: u64) -> Results {
    let settings = Settings::for_plan(&Plan::new(scene, method));
    run_with(scene, method, &Settings { stop: Stop::after(passes), smooth: true, seed, ..settings })
}

/// What a map claims to err by: the root of its cells' mean σ², lx.
pub fn claim(map: &IlluminanceMap) -> f64 {
    let errors = map.standard_error.iter().zip(&map.has_value).filter(|(_, has)| **has);
    let (sum, count) = errors.fold((0.0, 0.0), |(sum, count), (sigma, _)| (sum + sigma * sigma, count + 1.0));
    f64::sqrt(sum / count)
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
