//! Large maps in bounded memory: computed in bands, and as large as told before.

use std::fs;
use std::process::Command;

use crate::common::claim;
use crate::common::folder;
use crate::common::mean;
use crate::common::run_with;
use crate::common::shipped;
use luxmap::render::Keeping;
use luxmap::render::Settings;
use luxmap::render::Stop;
use luxmap::render::plan::Method;
use luxmap::render::plan::Plan;
use luxmap::render::render_in_bands;
use luxmap::results::Results;
use luxmap::scene::Scene;

/// The seed office with a floor of so many cells, sensors and nothing else.
fn office(cells: [usize; 2]) -> Scene {
    let mut scene = shipped("seed-office.toml");
    scene.planes.retain(|plane| plane.name == "floor");
    scene.planes[0].cells = cells;
    scene
}

fn in_bands(scene: &Scene, settings: &Settings, most_cells: usize) -> Results {
    let plan = Plan::new(scene, Method::Gather);
    let results = render_in_bands(scene, &plan, settings, &(), &Keeping::default(), most_cells);
    results.unwrap_or_else(|error| panic!("{error}")).expect("one process leads itself")
}

/// Bands are cut where they may be, and put together to the map of the whole: the same points, the same light within the
/// noise both claim. Their rays are others, so differences are as large as both claims together: √2 σ, and a third more.
#[test]
fn bands_make_the_map_of_the_whole() {
    let scene = office([40, 240]);
    let settings = Settings { photons: 100_000, stop: Stop::after(2), ..Settings::of(Method::Gather) };
    let whole = run_with(&scene, Method::Gather, &settings);
    let cut = in_bands(&scene, &settings, 40 * 110);
    let [whole_map, cut_map] = [&whole.maps[0], &cut.maps[0]];
    assert_eq!(cut.run.passes, 2);
    assert_eq!((cut_map.cells, cut_map.corner, cut_map.across), (whole_map.cells, whole_map.corner, whole_map.across));
    assert_eq!(cut_map.has_value, whole_map.has_value);
    assert_eq!(cut_map.outlines, whole_map.outlines);
    cut_map.illuminance.iter().zip(&whole_map.illuminance).for_each(|(a, b)| assert!(a.is_finite() && b.is_finite()));
    // Direct light is cut exactly in this scene, band or not, to the rounding of where a band's points lie.
    let (direct, expected) = (cut_map.direct.as_ref().expect("told"), whole_map.direct.as_ref().expect("told"));
    direct.iter().zip(expected).for_each(|(a, b)| assert!((a - b).abs() <= 2e-3 * b.max(1.0), "{a} lx, {b} lx"));
    let pairs = cut_map.illuminance.iter().zip(&whole_map.illuminance).zip(&whole_map.has_value);
    let (sum, count) = pairs
        .filter(|(_, has)| **has)
        .fold((0.0, 0.0), |(sum, count), ((a, b), _)| (sum + (a - b).powi(2), count + 1.0));
    let rms = f64::sqrt(sum / count);
    let bound = 1.33 * claim(whole_map).hypot(claim(cut_map));
    assert!(rms > 0.0 && rms < bound, "bands differ by {rms} lx rms, bound {bound} lx");
    assert!((mean(cut_map) / mean(whole_map) - 1.0).abs() < 0.005, "{} and {} lx", mean(cut_map), mean(whole_map));
}

/// The middle band says how many passes the error needs; the sensors' part runs by itself.
#[test]
fn an_error_is_reached_in_bands_too() {
    let scene = office([30, 300]);
    let settings = Settings { photons: 50_000, stop: Stop::at_error(1.5), ..Settings::of(Method::Gather) };
    let results = in_bands(&scene, &settings, 30 * 100);
    let map = &results.maps[0];
    assert!(claim(map) < 1.05 * 0.015 * mean(map) || !results.run.warnings.is_empty(), "claims {} lx", claim(map));
    assert_eq!(map.illuminance.len(), 9000);
    assert_eq!(results.sensors.len(), scene.sensors.len());
}

fn luxmap(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_luxmap")).args(arguments).output().expect("luxmap starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

/// Peak memory that `plan` tells, bytes.
fn told(scene: &str, more: &[&str]) -> f64 {
    let (code, out, err) = luxmap(&[&["plan", scene][..], more].concat());
    assert_eq!(code, 0, "{err}");
    let text = out.split("peak memory about ").nth(1).and_then(|text| text.split(':').next()).expect("told");
    let (number, unit) = text.split_once(' ').expect("a number and a unit");
    number.parse::<f64>().expect("a number") * if unit == "GB" { 1e9 } else { 1e6 }
}

/// What a run takes, as the system saw it, is within a fifth of what was told: whole, in bands, and in colour.
#[test]
#[cfg(target_os = "linux")]
fn memory_is_what_the_plan_told() {
    let folder = folder("bands_memory");
    let of = |name: &str, cells: &str| {
        let scenes = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
        let text = fs::read_to_string(format!("{scenes}/{name}.toml")).expect("it is shipped");
        let text = text.replace("file = \"", &format!("file = \"{scenes}/"));
        let lines = text.lines().map(|line| if line.starts_with("cells") { cells } else { line });
        let scene = folder.join(format!("{name}.toml"));
        fs::write(&scene, lines.collect::<Vec<_>>().join("\n")).expect("the target folder is writable");
        scene.display().to_string()
    };
    let include = ["--include", concat!(env!("CARGO_MANIFEST_DIR"), "/scenes")];
    let cases: [(String, &[&str]); 3] = [
        (of("seed-office", "cells = [300, 400]"), &include),
        (of("seed-office", "cells = [300, 400]"), &[include[0], include[1], "--memory", "0.07"]),
        (of("box", "cells = [400, 400]"), &include),
    ];
    for (scene, more) in cases {
        let expected = told(&scene, more);
        let out = folder.join("out").display().to_string();
        let fixed = ["render", &scene, "--quiet", "--json", "--passes", "1", "--photons", "100000", "-o", &out];
        let (code, json, err) = luxmap(&[&fixed[..], more].concat());
        assert_eq!(code, 0, "{err}");
        let found = json.split("\"peak_memory_bytes\": ").nth(1).and_then(|text| text.split(',').next());
        let found: f64 = found.expect("Linux tells").trim().parse().expect("a number");
        assert!((found / expected - 1.0).abs() < 0.2, "{scene} {more:?}: {found} bytes, told {expected}");
    }
}

#[test]
fn too_little_memory_is_refused() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/seed-office.toml");
    let out = folder("bands_refused").join("out").display().to_string();
    for (amount, expected) in [("0.01", "expected at least 0.0"), ("-1", "expected more than 0 GB"), ("x", "gigabytes")]
    {
        let (code, _, err) = luxmap(&["render", scene, "--memory", amount, "-o", &out]);
        assert_eq!((code, err.lines().count()), (2, 1), "{err}");
        assert!(err.contains("--memory") && err.contains(expected), "{err}");
    }
}
