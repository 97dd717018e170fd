//! `luxmap trees` as a user meets it: complete tables, files that NumPy reads, mistakes in one line.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use crate::common::files::{done, stderr, stdout};
use crate::common::room;

/// A folder of one test with a small room in it, `scene.toml`.
struct Folder(PathBuf);

const SCENE: &str = "[[mesh]]\nfile = \"room.obj\"\n[material.wall]\nreflectance = 0.5\n\
                     [[luminaire]]\nname = \"L\"\nposition = [2, 1.5, 2.4]\nopening = { rectangle = [0.6, 0.6] }\nflux = 3000\n\
                     [[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [4, 3]\n";

impl Folder {
    fn new(test: &str) -> Self {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("trees").join(test);
        let _ = fs::remove_dir_all(&folder); // of an earlier run
        fs::create_dir_all(&folder).expect("the target folder is writable");
        fs::write(folder.join("room.obj"), room([0.0; 3], [4.0, 3.0, 2.5], ["wall"; 6])).expect("writable");
        fs::write(folder.join("scene.toml"), SCENE).expect("writable");
        Self(folder)
    }

    fn trees(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_luxmap"));
        command.current_dir(&self.0).arg("trees").args(arguments).output().expect("luxmap starts")
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// An array of single precision, read by its header: shape and numbers.
    fn npy(&self, name: &str) -> (Vec<usize>, Vec<f32>) {
        let bytes = fs::read(self.0.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00", "magic and version");
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!((10 + length) % 64, 0, "numbers begin at a multiple of 64 bytes");
        let header = std::str::from_utf8(&bytes[10..10 + length]).expect("text");
        assert!(header.ends_with('\n'), "{header:?}");
        let rest = header.strip_prefix("{'descr': '<f4', 'fortran_order': False, 'shape': (").expect("a header");
        let (shape, end) = rest.split_once(')').expect("a shape");
        assert_eq!(end.trim_end(), ", }");
        let shape: Vec<usize> =
            shape.split(',').map(str::trim).filter(|n| !n.is_empty()).map(|n| n.parse().expect("a number")).collect();
        let numbers: Vec<f32> =
            bytes[10 + length..].chunks(4).map(|b| f32::from_le_bytes(b.try_into().expect("whole numbers"))).collect();
        assert_eq!(shape.iter().product::<usize>(), numbers.len(), "{name}");
        (shape, numbers)
    }
}

#[test]
fn a_small_run_writes_a_complete_table_and_a_page_that_needs_nothing_else() {
    let folder = Folder::new("small");
    let out = done(&folder.trees(&[
        "scene.toml",
        "-o",
        "out",
        "--photons",
        "300,600",
        "--nearest",
        "4,20",
        "--radius",
        "0.3",
        "--sets",
        "scene,collinear",
        "--threads",
        "2",
    ]));
    let csv = folder.read("out/trees.csv");
    let mut lines = csv.lines();
    assert_eq!(
        lines.next(),
        Some("set,photons,queries,k,radius_m,threads,tree,build_ms,bytes_per_photon,ns_per_query,ratio_to_kiddo")
    );
    let found: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let mut expected = Vec::new();
    // A tenth of the diagonal of the room, and of that of the made-up sets.
    for (set, reach) in [("scene", "0.559017"), ("collinear", "0.975")] {
        for photons in ["300", "600"] {
            for threads in ["1", "2"] {
                for at in ["floor", "random"] {
                    for [suffix, k, radius] in
                        [["", "4", reach], ["", "20", reach], [" visit", "20", reach], ["", "", "0.3"]]
                    {
                        for tree in ["kd", "kiddo", "paper"] {
                            expected.push([set, photons, &format!("{at}{suffix}"), k, radius, threads, tree].join(","));
                        }
                    }
                }
            }
        }
    }
    assert_eq!(found.iter().map(|row| row[..7].join(",")).collect::<Vec<_>>(), expected);
    for lines in found.chunks(3) {
        let number = |row: usize, column: usize| lines[row][column].parse::<f64>().expect("a number");
        for row in 0..3 {
            assert!((7..11).all(|column| number(row, column) > 0.0), "{lines:?}");
            let ratio = number(row, 9) / number(1, 9);
            assert!((number(row, 10) / ratio - 1.0).abs() < 2e-5, "{lines:?}"); // six digits each
        }
    }
    let page = folder.read("out/trees.html");
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    for outside in ["http:", "https:", "src=", "<script", "<link", "@import", "url(", "NaN", "inf"] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(page.contains("prefers-color-scheme: dark"));
    assert_eq!(page.matches("<svg viewBox").count(), 2 * 3, "two sets: against k, against photons, build");
    assert!(out.contains("kd, ns") && out.contains("wrote out/trees.csv, out/trees.html"), "{out}");
    assert!(!folder.0.join("out/paper.csv").exists());
}

#[test]
fn without_kiddo_there_is_no_ratio() {
    let folder = Folder::new("without kiddo");
    done(&folder.trees(&["-o", "out", "--photons", "300", "--nearest", "4", "--sets", "plane", "--trees", "kd,kd"]));
    let csv = folder.read("out/trees.csv");
    assert!(csv.lines().skip(1).all(|line| line.contains(",kd,") && line.ends_with(',')), "{csv}");
}

#[test]
fn dumped_photons_are_numpy_files() {
    let folder = Folder::new("dump");
    let run = |name: &str| {
        let dump = format!("{name}.npy");
        let out = done(&folder.trees(&[
            "scene.toml",
            "-o",
            "out",
            "--photons",
            "400,200",
            "--nearest",
            "4",
            "--radius",
            "0.3",
            "--sets",
            "scene",
            "--threads",
            "1",
            "--seed",
            "3",
            "--dump-photons",
            &dump,
        ]));
        assert!(out.contains(&format!("{name}.npy, {name}.flux.npy, {name}.floor.npy, {name}.random.npy")), "{out}");
    };
    run("a");
    let (shape, positions) = folder.npy("a.npy");
    assert_eq!(shape, [400, 3], "the most photons");
    // The room is 4 × 3 × 2.5 m around the origin, and every photon lies on one of its six sides.
    let half = [2.0_f32, 1.5, 1.25];
    for at in positions.chunks(3) {
        let to_side = |axis: usize| half[axis] - at[axis].abs();
        assert!((0..3).all(|axis| to_side(axis) > -1e-3), "{at:?}");
        let lamp = to_side(2) < 0.11; // or on the lamp, 10 cm below the ceiling
        assert!(lamp || (0..3).any(|axis| to_side(axis) < 1e-3), "{at:?}");
    }
    let (shape, flux) = folder.npy("a.flux.npy");
    assert_eq!(shape, [400]);
    assert!(flux.iter().all(|&flux| flux > 0.0 && flux.is_finite()));
    let (shape, floor) = folder.npy("a.floor.npy");
    assert_eq!(shape, [12, 3]);
    for (cell, at) in floor.chunks(3).enumerate() {
        let expected = [(cell % 4) as f32 - 1.5, (cell / 4) as f32 - 1.0, -1.25];
        assert!((0..3).all(|axis| (at[axis] - expected[axis]).abs() < 1e-5), "{at:?}, expected {expected:?}");
    }
    let (shape, random) = folder.npy("a.random.npy");
    assert_eq!(shape[1], 3);
    let photons: Vec<&[f32]> = positions.chunks(3).collect();
    assert!(random.chunks(3).all(|at| photons.contains(&at)), "random points are places of photons");
    run("b");
    for what in ["npy", "flux.npy", "floor.npy", "random.npy"] {
        assert_eq!(folder.npy(&format!("a.{what}")), folder.npy(&format!("b.{what}")), "same seed, same bits: {what}");
    }
}

#[test]
fn mistakes_are_refused_in_one_line() {
    let folder = Folder::new("mistakes");
    fs::write(folder.0.join("dark.toml"), "[[luminaire]]\nname = \"L\"\nposition = [0, 0, 0]\nflux = 10\n[[sensor]]\nname = \"s\"\nposition = [0, 0, -1]\nnormal = [0, 0, 1]\n")
        .expect("writable");
    for (arguments, expected) in [
        (&["--photons", "0"][..], "invalid value '0' for '--photons"),
        (&["--nearest", "10,,5"], "invalid value '' for '--nearest"),
        (&["--radius", "-1"], "expected more than 0 m"),
        (&["--radius", "nan"], "expected more than 0 m"),
        (&["--radius", "1e9"], "expected 1e-6 to 1e6 m"),
        (&["--trees", "kd,brute"], "invalid value 'brute' for '--trees"),
        (&["--sets", "sphere"], "invalid value 'sphere' for '--sets"),
        (&["--threads", "0"], "invalid value '0' for '--threads"),
        (&["--dump-photons", "photons.csv"], "found photons.csv, expected a name that ends in .npy"),
        (&["nowhere.toml"], "nowhere.toml: found no scene"),
        (&["scene.toml", "--sets", "plane"], "--sets: found plane, expected scene among them"),
        (&["dark.toml", "--photons", "10"], "found 0 landings of 640 photons, expected 10"),
    ] {
        let output = folder.trees(arguments);
        let message = stderr(&output);
        assert_eq!((output.status.code(), stdout(&output).as_str()), (Some(2), ""), "{arguments:?}: {message}");
        assert!(message.starts_with("luxmap: ") && message.lines().count() == 1, "{message:?}");
        assert!(message.contains(expected), "{message:?}, expected {expected:?}");
    }
}
