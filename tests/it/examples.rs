//! The programs of `examples/` run and say what they promise; the README shows the crate's first program.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Once;

/// A program of `examples/`. All are built first: `cargo test --test examples` alone builds none, and does nothing
/// where `cargo test` has built them.
fn example(name: &str) -> PathBuf {
    static BUILT: Once = Once::new();
    let folder = Path::new(env!("CARGO_BIN_EXE_luxmap")).parent().expect("a folder");
    BUILT.call_once(|| {
        let mut build = Command::new(env!("CARGO"));
        build.args(["build", "--quiet", "--examples", "--target-dir"]).arg(folder.parent().expect("the target folder"));
        // With the features of this test, so that nothing is compiled anew.
        if cfg!(feature = "mpi") {
            build.args(["--features", "mpi"]);
        }
        if folder.ends_with("release") {
            build.arg("--release");
        }
        let status = build.current_dir(env!("CARGO_MANIFEST_DIR")).status();
        assert!(status.expect("cargo starts").success(), "the examples can be built");
    });
    folder.join("examples").join(name)
}

/// Runs an example in a folder of its own; returns what it prints.
fn run(name: &str) -> (PathBuf, Vec<String>) {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("examples").join(name);
    let _ = std::fs::remove_dir_all(&folder); // of an earlier run
    std::fs::create_dir_all(&folder).expect("the target folder is writable");
    let output = Command::new(example(name)).arg("results").current_dir(&folder).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{name}: {said}{}", String::from_utf8_lossy(&output.stderr));
    (folder, said.lines().map(str::to_owned).collect())
}

/// The first number of a line after `words`.
fn number_after(line: &str, words: &str) -> f64 {
    let rest = line.split(words).nth(1).unwrap_or_else(|| panic!("no {words:?} in {line:?}"));
    let number: String = rest.trim_start().chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
    number.parse().unwrap_or_else(|_| panic!("no number after {words:?} in {line:?}"))
}

#[test]
fn three_lines_write_all_results() {
    let (folder, said) = run("01_three_lines");
    let count = std::fs::read_dir(folder.join("results")).expect("results").count();
    assert!(said[0].ends_with(&format!("; {count} files in results")), "{said:?}");
    assert!(folder.join("results/floor.exr").is_file());
}

#[test]
fn brighter_walls_give_more_light() {
    let (_, said) = run("02_scene_in_memory");
    let lux: Vec<f64> = said.iter().map(|line| number_after(line, ": ")).collect();
    assert!(lux.len() == 3 && lux.is_sorted_by(|dim, bright| dim < bright), "{said:?}");
    // Direct light alone, as of a point: 3000 lm / π in all directions, cos² / d² at (1, 0.5, 1.74) m from the lamp.
    let square = 1.0 + 0.25 + 1.74_f64.powi(2);
    let direct = 3000.0 / std::f64::consts::PI * 1.74_f64.powi(2) / (square * square);
    assert!(lux[0] > direct * 0.95, "{lux:?}, direct {direct}");
}

#[test]
fn groups_add_up_and_levels_reach_the_target() {
    let (_, said) = run("03_light_groups_and_dimming");
    let whole = number_after(&format!(": {}", said[0]), ": ");
    let parts = number_after(&said[1], ": ") + number_after(&said[2], ": ");
    assert!((whole - parts).abs() <= 1.5, "rounded to 1 lx each: {said:?}");
    assert!(said[3].ends_with(" W, 0 targets missed:"), "{said:?}");
    assert!(said.last().is_some_and(|line| line.starts_with("verified by ")), "{said:?}");
    // The lamp over the desk is brighter there, so it is the one that shines.
    let (east, west) = (number_after(&said[4], "east: "), number_after(&said[5], "west: "));
    assert!(west > east, "{said:?}");
}

#[test]
fn the_tree_finds_the_nearest_points() {
    let (_, said) = run("04_photon_tree_alone");
    // 100 lm on a disc of 1 m, evenly.
    let density = number_after(&said[0], " lm, ");
    assert!((density / (100.0 / std::f64::consts::PI) - 1.0).abs() < 0.05, "{said:?}");
    // 100,000 points on π m²: ten within 1 cm, as evenly as a spiral lays them.
    let near = number_after(&format!(": {}", said[1]), ": ");
    assert!((7.0..=13.0).contains(&near), "{said:?}");
}

#[test]
fn runs_tell_how_far_they_are_and_end_when_asked() {
    let (_, said) = run("05_progress");
    let [told @ .., summary, ended] = said.as_slice() else { panic!("{said:?}") };
    let passes = number_after(&format!(": {summary}"), ": ");
    let last = told.last().expect("the error is worked out at least once");
    assert_eq!(number_after(last, "pass "), passes, "the last word is that of the end: {said:?}");
    assert!(number_after(last, "± ") <= 2.5 || passes == 20.0, "{said:?}");
    assert_eq!(ended, "ended by the program after 3 passes");
}

/// The README's program is the first of the crate's documentation, which is a test itself.
#[test]
fn the_readme_shows_the_documented_program() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |name: &str| std::fs::read_to_string(root.join(name)).expect("it is there");
    let (documented, readme) = (read("src/lib.rs"), read("README.md"));
    let lines = documented.lines().skip_while(|line| *line != "//! ```").skip(1).take_while(|line| *line != "//! ```");
    let program: Vec<&str> =
        lines.filter_map(|line| line.strip_prefix("//! ")).filter(|line| !line.starts_with("# ")).collect();
    assert!(program.len() == 3, "{program:?}");
    assert!(readme.contains(&format!("```rust\n{}\n```", program.join("\n"))), "README.md lacks {program:?}");
}
