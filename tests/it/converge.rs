//! `luxmap converge` as a user meets it: references of every kind, a complete table, a page that needs nothing else.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::common::files::done;
use crate::common::files::refused;
use crate::common::room;
use luxmap::render::plan::Method;
use luxmap::scene::Scene;
use luxmap::study::convergence::Reference;
use luxmap::study::convergence::ladder;
use luxmap::study::convergence::reference;

use serde_json::Value;

const LAMP: &str =
    "[[luminaire]]\nname = \"L\"\nposition = [2, 1.5, 2.4]\nopening = { rectangle = [0.6, 0.6] }\nflux = 3000\n";
const PLANES: &str = "[[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [4, 3]\n\
                      [[plane]]\nname = \"desk\"\ncorner = [0, 0, 0.75]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [2, 2]\non = \"air\"\n";

/// A folder of one test with a small room in it, `scene.toml`.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str, reflectance: f64) -> Self {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("converge").join(test);
        let _ = fs::remove_dir_all(&folder); // of an earlier run
        fs::create_dir_all(&folder).expect("the target folder is writable");
        let folder = Self(folder);
        folder.write("room.obj", &room([0.0; 3], [4.0, 3.0, 2.5], ["wall"; 6]));
        let material = format!("[material.wall]\nreflectance = {reflectance}\n");
        folder.write("scene.toml", &format!("[[mesh]]\nfile = \"room.obj\"\n{material}{LAMP}{PLANES}"));
        folder
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.0.join(name), text).expect("the target folder is writable");
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn scene(&self) -> Scene {
        Scene::load(&self.0.join("scene.toml")).unwrap_or_else(|error| panic!("{error}"))
    }

    fn luxmap(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_luxmap"));
        command.current_dir(&self.0).args(arguments).output().expect("luxmap starts")
    }

    /// A small study into the folder `out`.
    fn converge(&self, more: &[&str]) -> Output {
        self.luxmap(
            &[&["converge", "scene.toml", "-o", "out", "--photons", "2000,500", "--repeats", "2"], more].concat(),
        )
    }
}

/// A header and lines of cells.
fn table(text: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    (lines.next().expect("a header"), lines.collect())
}

/// Two methods, two numbers of photons, two seeds, two planes: 16 lines, each of them whole and finite, stages that add up,
/// errors that depend on the seed only.
#[test]
fn the_table_is_complete_and_the_page_needs_nothing_else() {
    let folder = Folder::new("complete", 0.5);
    let truth = ["--photons", "100000", "--seed", "77", "--layers", "stderr"];
    done(&folder.luxmap(&[&["render", "scene.toml", "-o", "truth"], &truth[..]].concat()));
    let options = ["--methods", "photons,split,photons", "--reference", "truth"];
    let printed = done(&folder.converge(&options));
    assert!(
        printed.contains("reference: truth/floor.exr, own error ") && printed.contains("\nClaims of "),
        "{printed}"
    );

    let (header, rows) = table(&folder.read("out/convergence.csv"));
    assert_eq!((header.len(), rows.len()), (23, 16));
    let column = |name: &str| header.iter().position(|title| title == name).unwrap_or_else(|| panic!("{name}"));
    let number = |row: &[String], name: &str| -> f64 { row[column(name)].parse().expect("a number") };
    for row in &rows {
        assert_eq!(row.len(), header.len());
        assert!(row[3..].iter().all(|cell| cell.parse::<f64>().is_ok_and(f64::is_finite)), "{row:?}");
        let total = number(row, "seconds_total");
        let stages = ["trace", "build", "direct", "gather", "look_around", "other"];
        let sum: f64 = stages.iter().map(|stage| number(row, &format!("seconds_{stage}"))).sum();
        assert!(total > 0.0 && (sum / total - 1.0).abs() < 1e-5, "stages {sum} s, total {total} s");
        let (rmse, difference) = (number(row, "rmse_percent"), number(row, "difference_percent"));
        let own = number(row, "reference_error_percent");
        assert!(own > 0.0 && difference > 0.0);
        assert!((rmse.powi(2) - (difference.powi(2) - own.powi(2)).max(0.0)).abs() < 1e-4 * difference.powi(2));
    }
    let names: Vec<String> = rows.iter().map(|row| format!("{} {} {}", row[2], row[3], row[6])).collect();
    let expected = ["photons 500", "photons 2000", "split 500", "split 2000"];
    let expected: Vec<String> = (0..2)
        .flat_map(|seed| expected.map(|run| [format!("{run} {seed}"), format!("{run} {seed}")]))
        .flatten()
        .collect();
    assert_eq!(names, expected, "all settings take turns with one seed, then with the next");

    let page = folder.read("out/report.html");
    for alien in ["http:", "https:", "src=", "href=", "url(", "@import", "<script", "NaN"] {
        assert!(!page.contains(alien), "{alien}");
    }
    assert_eq!(page.matches("<svg viewBox=\"0 0 ").count(), 8, "four charts for each plane");

    let json = done(&folder.converge(&[&options[..], &["--json", "--threads", "1"]].concat()));
    let summary: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(summary["points"].as_array().map(Vec::len), Some(8));
    assert_eq!(summary["planes"][1]["race"][0]["method"], "photons");
    let again = table(&folder.read("out/convergence.csv")).1;
    let errors = column("cells");
    for (before, after) in rows.iter().zip(&again) {
        assert_eq!(before[errors..], after[errors..], "same seeds, other number of threads");
    }
}

/// What is wrong with a reference, and where the message points; nothing is computed first.
#[test]
fn a_bad_reference_is_one_line() {
    let folder = Folder::new("bad", 0.5);
    let rows = |count: usize| (0..count).map(|cell| format!("{cell},0,100,1\n")).collect::<String>();
    let head = "x_m,y_m,E_lx,standard_error_lx\n";
    let with = |row: &str| format!("{head}0,0,100,1\n{row}\n{}", rows(10));
    let not_finite = "expected a number of lux; NaN or nothing where there is no value";
    for (class, content, message) in [
        (
            "short",
            format!("{head}{}", rows(11)),
            "bad.csv: found 11 rows, expected 12 for the 4 × 3 cells of plane \"floor\"",
        ),
        ("long", format!("{head}{}", rows(13)), "bad.csv:14: found one more row, expected 12 for the 4 × 3 cells"),
        ("word", with("1,0,bright,1"), &format!("bad.csv:3: found \"bright\" in column E_lx, {not_finite}")),
        ("infinite", with("1,0,inf,1"), &format!("bad.csv:3: found \"inf\" in column E_lx, {not_finite}")),
        (
            "negative σ",
            with("1,0,100,-1"),
            "bad.csv:3: found a standard error of -1, expected a number of lux, at least 0",
        ),
        (
            "word for σ",
            with("1,0,100,x"),
            "bad.csv:3: found \"x\" in column standard_error_lx, expected a number of lux",
        ),
        ("ragged", with("1,0,100"), "bad.csv:3: found 3 columns, expected 4, as in the first line"),
        ("no E", rows(12), "bad.csv:1: found columns \"0\", \"0\", \"100\", \"1\", expected a column E_lx"),
        ("empty", String::new(), "bad.csv:1: found columns , expected a column E_lx"),
    ] {
        folder.write("bad.csv", &content);
        let found = refused(&folder.converge(&["--reference", "floor=bad.csv"]));
        assert!(found.starts_with(&format!("luxmap: {message}")), "{class}: {found}");
    }
    fs::write(folder.0.join("bad.csv"), b"E_lx\n\xff\xfe\n").expect("the target folder is writable");
    let found = refused(&folder.converge(&["--reference", "floor=bad.csv"]));
    assert!(found.starts_with("luxmap: bad.csv:2: found bytes that are no text, expected UTF-8"), "{found}");
    folder.write("bad.exr", "no image");
    fs::create_dir(folder.0.join("empty")).expect("the target folder is writable");
    folder.write("floor.csv", &format!("{head}{}", rows(12)));
    done(&folder.luxmap(&["render", "scene.toml", "-o", "maps", "--photons", "500"]));
    for (argument, message) in [
        ("floor=bad.exr", "bad.exr: found "),
        ("floor=no.csv", "no.csv: found no such file, expected a table of illuminances"),
        ("floor=bad.txt", "bad.txt: found the ending \"txt\", expected .exr or .csv"),
        ("desk=maps/floor.exr", "maps/floor.exr: found 4 × 3 cells, expected 4 for the 2 × 2 cells of plane \"desk\""),
        ("roof=bad.csv", "--reference: found \"roof=bad.csv\", expected PLANE=FILE with one of floor, desk"),
        ("bad.csv", "--reference: found \"bad.csv\", expected PLANE=FILE with one of floor, desk"),
        ("empty", "--reference: found \"empty\", expected a file in it, such as floor.exr or floor.csv"),
    ] {
        let found = refused(&folder.converge(&["--reference", argument]));
        assert!(found.starts_with(&format!("luxmap: {message}")), "{argument}: {found}");
    }
    let found = refused(&folder.converge(&["--reference", "floor.csv", "--reference", "floor=floor.csv"]));
    assert!(found.ends_with("found \"floor=floor.csv\" and floor.csv for plane \"floor\", expected one"), "{found}");
    folder.write("dark.csv", "E_lx\n0\n0\n0\n0\n");
    let found = refused(&folder.converge(&["--plane", "desk", "--reference", "dark.csv"]));
    assert!(found.contains("plane \"desk\": found no lit cell that both"), "{found}");
    assert!(!folder.0.join("out/convergence.csv").exists());
}

#[test]
fn options_that_make_no_sense_are_refused() {
    let folder = Folder::new("options", 0.5);
    for option in ["--photons 0", "--nearest 1", "--passes 0", "--repeats 0", "--methods split,guess", "--plane roof"] {
        let option: Vec<&str> = option.split(' ').collect();
        let message = refused(&folder.luxmap(&[&["converge", "scene.toml"], &option[..]].concat()));
        assert!(message.contains(option[0]), "{message}");
    }
    folder.write("scene.toml", &format!("{LAMP}[[sensor]]\nname = \"s\"\nposition = [2, 1, 0]\nnormal = [0, 0, 1]\n"));
    let message = refused(&folder.converge(&[]));
    assert!(message.contains("found no measuring plane"), "{message}");
}

/// luxmap's own table (three coordinates), the shorter one without σ, spaces, a byte-order mark, and both ways to write no
/// value: the same truth.
#[test]
fn csv_references_of_either_kind_agree() {
    let folder = Folder::new("kinds", 0.5);
    let desk = &folder.scene().planes[1];
    folder.write("own.csv", "x_m,y_m,z_m,E_lx,standard_error_lx\n1,1,0,100,2\n3,1,0,,\n1,2,0,300,0.5\n3,2,0,0.001,0\n");
    folder.write("short.csv", "\u{feff}E_lx, x_m\n100,1\nNaN, 3\n 300, 1\n1e-3,3\n");
    let own = Reference::read(&folder.0.join("own.csv"), desk).expect("a reference");
    let short = Reference::read(&folder.0.join("short.csv"), desk).expect("a reference");
    assert_eq!(own.illuminance, [100.0, 0.0, 300.0, 0.001]);
    assert_eq!(own.has_value, [true, false, true, true]);
    assert_eq!(own.standard_error, [2.0, 0.0, 0.5, 0.0]);
    assert_eq!((&short.illuminance, &short.has_value), (&own.illuminance, &own.has_value));
    assert_eq!(short.standard_error, [0.0; 4]);
}

/// A run compared with its own files: EXR agrees to single precision and CSV to six digits, both know σ, and rows are in the
/// same order.
#[test]
fn a_run_s_own_files_are_its_reference() {
    let folder = Folder::new("own", 0.5);
    done(&folder.luxmap(&["render", "scene.toml", "-o", "maps", "--photons", "5000", "--layers", "stderr"]));
    for plane in &folder.scene().planes {
        let read = |ending: &str| {
            let path = folder.0.join("maps").join(format!("{}.{ending}", plane.name));
            Reference::read(Path::new(&path), plane).expect("a reference")
        };
        let (exr, csv) = (read("exr"), read("csv"));
        assert_eq!(exr.has_value, csv.has_value);
        let pairs = exr.illuminance.iter().zip(&csv.illuminance);
        for (a, b) in pairs.chain(exr.standard_error.iter().zip(&csv.standard_error)) {
            assert!(*a > 0.0 && (a / b - 1.0).abs() < 6e-6, "{}: {a}, {b}", plane.name);
        }
    }
}

/// Whence the reference of the floor where none is given, all other planes left out.
fn source(folder: &Folder) -> Reference {
    let mut scene = folder.scene();
    scene.planes.truncate(1);
    reference::complete(vec![None], &scene, 1, &()).expect("a reference").remove(0)
}

/// A black room with nothing in it has a closed form, whose error is none; a shelf in the middle, or a second lamp that
/// hangs lower, may throw shadows. Split, which is that closed form, needs one rung there, photons need all.
#[test]
fn a_black_empty_room_has_a_closed_form() {
    let folder = Folder::new("closed", 0.0);
    let exact = source(&folder);
    assert_eq!(exact.source, "closed form of direct light");
    assert!(exact.standard_error.iter().all(|sigma| *sigma == 0.0) && exact.illuminance.iter().all(|e| *e > 0.0));
    let methods = [Method::Split, Method::Photons];
    assert_eq!(ladder(&folder.scene(), &methods, &[1, 2, 3], &[], &[1]).len(), 1 + 3);

    let printed = done(&folder.converge(&["--methods", "split,photons"]));
    assert!(printed.contains("floor: split is exact, as far as the reference tells, after "), "{printed}");
    assert!(printed.contains("reference: closed form of direct light, taken as exact"), "{printed}");

    let scene = folder.read("scene.toml");
    let lower = LAMP.replace("\"L\"", "\"M\"").replace("[2, 1.5, 2.4]", "[3, 1.5, 2.0]");
    folder.write("scene.toml", &format!("{scene}{lower}"));
    assert_eq!(source(&folder).source, "direct light: nothing bounces");
    let beside = lower.replace("2.0]", "2.4]");
    folder.write("scene.toml", &format!("{scene}{beside}"));
    assert_eq!(source(&folder).source, "closed form of direct light");
    let shelf = "v 1 1 1\nv 2 1 1\nv 2 2 1\nusemtl wall\nf 9 10 11\n";
    folder.write("room.obj", &(folder.read("room.obj") + shelf));
    folder.write("scene.toml", &scene);
    assert_eq!(source(&folder).source, "direct light: nothing bounces");
}
