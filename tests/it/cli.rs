//! The command as a user meets it: exit codes, one line for each mistake, files that are whole or not there.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::common::files::{done, refused, stderr, stdout};
use crate::common::room;
use luxmap::options::{Command as Taker, TABLE, manual};
use serde_json::Value;

/// A folder of one test, empty at first, with a sound scene in it.
struct Folder(PathBuf);

const LAMP: &str =
    "[[luminaire]]\nname = \"L\"\nposition = [2, 1.5, 2.4]\nopening = { rectangle = [0.6, 0.6] }\nflux = 3000\n";
const PLANES: &str = "[[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [4, 3]\n\
                      [[plane]]\nname = \"desk\"\ncorner = [0, 0, 0.75]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [2, 2]\non = \"air\"\n";
const MATERIAL: &str = "[material.wall]\nreflectance = 0.5\n";

impl Folder {
    fn new(test: &str) -> Self {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("cli").join(test);
        let _ = fs::remove_dir_all(&folder); // of an earlier run
        fs::create_dir_all(&folder).expect("the target folder is writable");
        let folder = Self(folder);
        folder.write("room.obj", &room([0.0; 3], [4.0, 3.0, 2.5], ["wall"; 6]));
        folder.write("scene.toml", &sound());
        folder
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.0.join(name), text).expect("the target folder is writable");
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Runs luxmap in this folder.
    fn luxmap(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("luxmap starts")
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_luxmap"));
        command.current_dir(&self.0).args(arguments);
        command
    }

    /// Renders the scene with few photons into the folder `out`.
    fn render(&self, more: &[&str]) -> Output {
        self.luxmap(&[&["render", "scene.toml", "-o", "out", "--photons", "3000", "--passes", "1"], more].concat())
    }

    /// Names in the folder `out`, sorted.
    fn results(&self) -> Vec<String> {
        let Ok(entries) = fs::read_dir(self.0.join("out")) else { return Vec::new() };
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("a readable folder").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

fn sound() -> String {
    format!("[[mesh]]\nfile = \"room.obj\"\n{MATERIAL}{LAMP}{PLANES}")
}

/// Each class of bad input of the issue: what is spoilt, and where the message points.
#[test]
fn bad_input_is_one_line_and_leaves_no_file() {
    let obj = room([0.0; 3], [4.0, 3.0, 2.5], ["wall"; 6]);
    let toml = sound();
    let in_toml = |old: &str, new: &str| ("scene.toml", toml.replacen(old, new, 1));
    let in_obj = |old: &str, new: &str| ("room.obj", obj.replacen(old, new, 1));
    let cases = [
        ("missing file", in_toml("room.obj", "roof.obj"), "scene.toml:2: "),
        ("unknown key", in_toml("flux =", "flvx ="), "scene.toml:9: "),
        ("unknown material", in_toml("material.wall", "material.wal"), "scene.toml:3: "),
        ("ρ > 1", in_toml("reflectance = 0.5", "reflectance = 1.01"), "scene.toml:4: "),
        ("zero flux", in_toml("flux = 3000", "flux = 0"), "scene.toml:9: "),
        ("plane of zero cells", in_toml("[4, 3]", "[4, 0]"), "scene.toml:15: "),
        ("NaN vertex", in_obj("v 4 0 0", "v nan 0 0"), "room.obj:2: "),
        ("face index 0", in_obj("f 1 2", "f 0 2"), "room.obj:10: "),
        ("face index out of range", in_obj("f 1 2 4 3", "f 1 2 4 9"), "room.obj:10: "),
        ("empty mesh", ("room.obj", String::new()), "room.obj: "),
        ("broken TOML", in_toml("[[plane]]", "[[plane]"), "scene.toml:10: "),
    ];
    for (class, (name, text), place) in cases {
        let folder = Folder::new("bad_input");
        done(&folder.render(&["--json"]));
        let before: Vec<_> =
            folder.results().iter().map(|name| fs::read(folder.0.join("out").join(name)).unwrap()).collect();
        assert_ne!(folder.read(name), text, "{class}: nothing is spoilt");
        folder.write(name, &text);
        let message = refused(&folder.render(&[]));
        assert!(message.starts_with(&format!("luxmap: {place}found ")), "{class}: {message}");
        assert!(message.contains(", expected "), "{class}: {message}");
        let after: Vec<_> =
            folder.results().iter().map(|name| fs::read(folder.0.join("out").join(name)).unwrap()).collect();
        assert!(before == after, "{class}: the older result has changed");
        fs::remove_dir_all(folder.0.join("out")).expect("it was there");
        refused(&folder.render(&[]));
        assert_eq!(folder.results(), [""; 0], "{class}");
    }
}

/// Permission bits don't bind root, a regular file in the way does. Nothing is computed first.
#[test]
fn an_output_that_can_t_be_written_is_refused() {
    let folder = Folder::new("unwritable");
    folder.write("file", "");
    for output in ["file", "file/below", "/dev/null/below"] {
        let message = refused(&folder.luxmap(&["render", "scene.toml", "-o", output, "--photons", "100"]));
        assert!(message.contains(&format!("{output}: can't be written: ")), "{message}");
    }
    assert_eq!(folder.read("file"), "");
    // A result whose name is taken by a folder: the others are whole, and no temporary file remains.
    fs::create_dir_all(folder.0.join("out/floor.exr")).unwrap();
    let message = refused(&folder.render(&[]));
    assert!(message.contains("floor.exr: can't be written: "), "{message}");
    let results = folder.results();
    assert!(results.iter().all(|name| !name.starts_with('.') && !name.ends_with(".tmp")), "{results:?}");
    assert!(!results.contains(&"floor.csv".into()), "the plane that failed has no further files: {results:?}");
}

/// A full disk under stdout is an error, a full disk under stderr no panic.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_an_error_and_no_panic() {
    let folder = Folder::new("full");
    let full = || Stdio::from(File::options().write(true).open("/dev/full").expect("Linux has /dev/full"));
    for arguments in [&["plan", "scene.toml"][..], &["render", "scene.toml", "-o", "out", "--photons", "100"]] {
        let output = folder.command(arguments).stdout(full()).stderr(Stdio::piped()).output().expect("luxmap starts");
        let message = refused(&output);
        assert!(message.starts_with("luxmap: standard output: can't be written: "), "{message}");
    }
    let status = folder.command(&["plan", "no.toml"]).stderr(full()).status().expect("luxmap starts");
    assert_eq!(status.code(), Some(2));
}

/// `luxmap … | head`: a reader that has gone is no error.
#[test]
fn a_reader_that_has_gone_is_no_error() {
    let folder = Folder::new("gone");
    for arguments in
        [&["plan", "scene.toml"][..], &["render", "scene.toml", "-o", "out", "--photons", "3000", "--json"]]
    {
        let mut child =
            folder.command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("luxmap starts");
        drop(child.stdout.take());
        done(&child.wait_with_output().expect("luxmap ends"));
    }
}

#[test]
fn options_out_of_range_are_refused() {
    let folder = Folder::new("options");
    for option in [
        "--photons 0",
        "--photons 1e3",
        "--nearest 1",
        "--radius 0",
        "--radius -1",
        "--radius nan",
        "--radius inf",
        "--threads 0",
        "--threads 65535",
        "--passes 0",
        "--method guess",
        "--tree oak",
        "--layers x",
        "--bogus",
    ] {
        let option: Vec<&str> = option.split(' ').collect();
        let message = refused(&folder.luxmap(&[&["render", "scene.toml", "-o", "out"], &option[..]].concat()));
        assert!(message.contains(option[0]), "{message}");
    }
    assert!(refused(&folder.luxmap(&["rendr"])).contains("render"));
    assert!(refused(&folder.luxmap(&["render"])).contains("<SCENE>"));
    assert_eq!(folder.luxmap(&[]).status.code(), Some(2));
    assert_eq!(folder.luxmap(&["--help"]).status.code(), Some(0));
    assert_eq!(folder.results(), [""; 0]);
}

/// A scene may name any tree that the command knows.
#[test]
fn the_scene_file_chooses_like_the_command_line() {
    let folder = Folder::new("defaults");
    for tree in ["kd", "kiddo", "paper", "brute"] {
        folder.write("scene.toml", &format!("{}[render]\nphotons = 2000\npasses = 1\ntree = \"{tree}\"\n", sound()));
        let output = folder.luxmap(&["render", "scene.toml", "-o", "out", "--json"]);
        done(&output);
        let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!((&summary["tree"], &summary["photons_emitted"]), (&tree.into(), &2000.into()));
    }
}

/// `[render]` is what the command line would be, to the bit.
#[test]
fn options_of_the_scene_file_count_as_those_of_the_command_line() {
    let folder = Folder::new("render-section");
    let floor = |render: &str, more: &[&str]| {
        folder.write("scene.toml", &format!("{}[render]\npasses = 1\n{render}", sound()));
        done(&folder.luxmap(&[&["render", "scene.toml", "-o", "out"], more].concat()));
        folder.read("out/floor.csv")
    };
    let keys = "method = \"path\"\nrays = 16\nsmooth = true\nseed = 7\n";
    let options = ["--method", "path", "--rays", "16", "--smooth", "on", "--seed", "7"];
    let found = floor(keys, &[]);
    assert_eq!(found, floor("", &options));
    assert_eq!(found, floor("method = \"seed\"\nrays = 9\nsmooth = false\nseed = 1\n", &options));
    for key in ["rays = 8", "smooth = false", "seed = 8"] {
        let changed = keys.lines().map(|line| if line[..4] == key[..4] { key } else { line });
        assert_ne!(found, floor(&changed.map(|line| format!("{line}\n")).collect::<String>(), &[]), "{key}");
    }
}

/// One pass of one ray leaves σ far above 2 %, so only what the scene file says ends a run after it.
#[test]
fn the_scene_file_says_when_a_run_stops() {
    let folder = Folder::new("stops");
    let passes = |limit: &str, more: &[&str]| {
        let options = "method = \"path\"\nrays = 1\nsmooth = false";
        folder.write("scene.toml", &format!("{}[render]\n{options}\n{limit}\n", sound()));
        let output = folder.luxmap(&[&["render", "scene.toml", "-o", "out", "--json"], more].concat());
        done(&output);
        let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        summary["passes"].as_u64().expect("a number")
    };
    assert!(passes("", &["--error", "2"]) > 1);
    assert_eq!(passes("error = 1e6", &[]), 1);
    assert_eq!(passes("time = 1e-6", &[]), 1);
    assert_eq!(passes("time = 1e-6", &["--time", "1e-6"]), 1);
    assert!(passes("error = 1e6", &["--error", "2"]) > 1, "the command line wins");
    folder.write("scene.toml", &format!("{}[render]\nmemory = 1e-6\n", sound()));
    let message = refused(&folder.luxmap(&["render", "scene.toml", "-o", "out"]));
    assert!(message.contains("expected at least"), "{message}");
}

#[test]
fn help_is_that_of_a_command_or_of_the_scene_file() {
    let folder = Folder::new("help");
    let told = |arguments: &[&str]| {
        let output = folder.luxmap(arguments);
        done(&output);
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    assert_eq!(told(&["help"]), told(&["--help"]));
    assert_eq!(told(&["help", "render"]), told(&["render", "--help"]));
    let scene = told(&["help", "scene"]);
    for said in ["[[luminaire]]", "maintenance_factor", "Unit: lm.", "counter-clockwise seen from above"] {
        assert!(scene.contains(said), "{said}");
    }
    let widest = scene.lines().map(|line| line.chars().count()).max();
    assert!(widest <= Some(110), "{widest:?}");
    let markdown = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/SCENE.md");
    assert_eq!(told(&["help", "scene", "--markdown"]), fs::read_to_string(markdown).expect("docs/SCENE.md"));
    assert!(refused(&folder.luxmap(&["help", "rendr"])).contains("render"));
    assert!(refused(&folder.luxmap(&["help", "render", "--markdown"])).contains("help scene --markdown"));
}

#[test]
fn check_asks_whether_the_targets_are_met() {
    let folder = Folder::new("check");
    for (target, code) in [(1.0, 0), (1e6, 1)] {
        let sensor = "[[sensor]]\nname = \"s\"\nposition = [2, 1.5, 0.75]\nnormal = [0, 0, 1]\n";
        folder.write("scene.toml", &format!("{}{sensor}target = {target}\n", sound()));
        assert_eq!(folder.render(&["--check"]).status.code(), Some(code), "target {target}");
        assert_eq!(folder.render(&[]).status.code(), Some(0), "without --check, target {target}");
    }
    assert!(folder.results().contains(&"sensors.csv".to_owned()));
}

/// An area that misses what is required of it counts as a sensor does, and its figures are in the table and the
/// summary.
#[test]
fn check_asks_whether_areas_get_what_they_require() {
    let folder = Folder::new("check_areas");
    for (mean, code, verdict) in [(1.0, 0, "met"), (1e6, 1, "missed")] {
        let plane = "[[plane]]\nname = \"areas\"\ncorner = [0, 0, 0.75]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\n\
                     cells = [20, 15]\non = \"air\"\nmargin = 0.5\n[[plane.task]]\nname = \"bench\"\ncorner = [1, 1]\n\
                     size = [1, 0.6]\n";
        folder.write("scene.toml", &format!("{}{plane}required = {{ mean = {mean} }}\n", sound()));
        let output = folder.render(&["--check"]);
        assert_eq!(output.status.code(), Some(code), "mean {mean}");
        let table = stdout(&output);
        let line = table.lines().find(|line| line.starts_with("bench, task")).expect("a line of the task");
        assert!(line.ends_with(verdict) && line.contains("15"), "{line}");
    }
    let summary = folder.read("out/summary.json");
    assert!(summary.contains("\"required_met\": false") && summary.contains("\"kind\": \"background\""));
}

#[test]
fn planes_are_chosen_by_name() {
    let folder = Folder::new("planes");
    done(&folder.render(&["--plane", "desk", "--quiet"]));
    assert_eq!(folder.results(), ["desk.csv", "desk.exr", "desk.png", "report.html", "summary.json"]);
    let message = refused(&folder.render(&["--plane", "roof"]));
    assert_eq!(message, "luxmap: --plane: found \"roof\", expected one of floor, desk");
}

/// The CSV file's rows, header left out.
fn rows(path: &Path) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(path).expect("a file");
    let number = |cell: &str| cell.parse().unwrap_or_else(|_| panic!("{cell:?} is no number"));
    text.lines().skip(1).map(|line| line.split(',').map(number).collect()).collect()
}

/// JSON is alone on stdout and in summary.json; CSV (six digits), EXR (single precision) and JSON tell the same E.
#[test]
fn the_files_agree_with_each_other() {
    let folder = Folder::new("files");
    let output = folder.render(&["--json", "--layers", "direct,indirect,stderr"]);
    done(&output);
    assert_eq!(
        folder.results(),
        ["desk.csv", "desk.exr", "desk.png", "floor.csv", "floor.exr", "floor.png", "report.html", "summary.json"]
    );
    let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(summary, serde_json::from_str::<Value>(&folder.read("out/summary.json")).expect("JSON"));
    for plane in summary["planes"].as_array().expect("a list") {
        let name = plane["name"].as_str().expect("a name");
        let path = |ending: &str| folder.0.join("out").join(format!("{name}.{ending}"));
        let rows = rows(&path("csv"));
        let image = luxmap::report::exr::read(&path("exr")).expect("an image");
        assert_eq!(image.illuminance.len(), rows.len());
        for (e, row) in image.illuminance.iter().zip(&rows) {
            assert!(*e > 0.0 && (e / row[3] - 1.0).abs() < 6e-6, "{name}: EXR {e} lx, CSV {} lx", row[3]);
        }
        let mean = image.illuminance.iter().sum::<f64>() / rows.len() as f64;
        assert!((mean / plane["mean_lx"].as_f64().expect("a number") - 1.0).abs() < 1e-6, "{name}");
        // Direct and indirect layers add up.
        let layer = |wanted: &str| {
            use exr::prelude::*;
            let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
            let image = image.all_attributes().from_file(path("exr")).expect("an image");
            let channels = image.layer_data.channel_data.list;
            let found = channels.iter().find(|channel| channel.name == *wanted).expect("the channel asked for");
            found.sample_data.values_as_f32().collect::<Vec<_>>()
        };
        for ((e, direct), indirect) in layer("Y").iter().zip(layer("direct.Y")).zip(layer("indirect.Y")) {
            assert!(direct > 0.0 && indirect > 0.0, "{name}: direct {direct} lx, indirect {indirect} lx");
            assert!(((direct + indirect) / e - 1.0).abs() < 1e-6, "{name}: {direct} + {indirect} ≠ {e}");
        }
    }
}

/// A strip a micrometre wide is a plane all the same, though no image has such pixels.
#[test]
fn a_strip_of_extreme_proportions_is_written() {
    let folder = Folder::new("strip");
    folder.write("scene.toml", &sound().replacen("along = [4, 0, 0]", "along = [1e-6, 0, 0]", 1));
    let output = folder.render(&["--plane", "floor"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("tenth of the smallest opening or cell"), "{}", stderr(&output));
    assert_eq!(rows(&folder.0.join("out/floor.csv")).len(), 12);
}

/// What `plan` uses and leaves out differs from scene to scene, each with its reason.
#[test]
fn plan_tells_what_a_scene_needs() {
    let folder = Folder::new("plan");
    let plan = |toml: &str| {
        folder.write("scene.toml", toml);
        let output = folder.luxmap(&["plan", "scene.toml"]);
        done(&output);
        stdout(&output)
    };
    let says = |plan: &str, start: &str, end: &str| {
        assert!(plan.lines().any(|line| line.starts_with(start) && line.ends_with(end)), "{start} … {end} in\n{plan}");
    };
    let grey = plan(&sound());
    says(&grey, "left out three channels", "no material and no luminaire is coloured: one does");
    says(&grey, "used     passes", "such as off wall");
    assert!(!grey.contains("--method path"), "{grey}");
    let corner = plan(
        &sound()
            .replace("along = [4, 0, 0]", "along = [0.2, 0, 0]")
            .replace("across = [0, 3, 0]", "across = [0, 0.2, 0]"),
    );
    says(&corner, "used     photons of the whole scene", "asks only for what they see");
    let coloured = plan(&sound().replace("= 0.5", "= [0.5, 0.1, 0.1]"));
    says(&coloured, "used     three channels", "material wall is coloured");
    let black = plan(&sound().replace("reflectance = 0.5", "reflectance = 0"));
    says(&black, "left out passes", "every surface is black: light bounces off nothing");
    let free = plan(&format!("{LAMP}{PLANES}"));
    says(&free, "left out passes", "light bounces off nothing");
    assert_eq!(folder.results(), [""; 0], "plan writes nothing");
}

/// Long options that a command's help lists.
fn listed_options(folder: &Folder, command: &str) -> Vec<String> {
    let help = stdout(&folder.luxmap(&[command, "--help"]));
    let mut names = Vec::new();
    for line in help.lines().map(str::trim_start).filter(|line| line.starts_with('-')) {
        let long = line.split([' ', ',', '=']).find_map(|word| word.strip_prefix("--"));
        names.extend(long.map(str::to_owned));
    }
    names
}

/// Each command lists those options of a run that mean something to it, and no others; the same words for the same
/// option.
#[test]
fn each_command_lists_the_options_that_mean_something_to_it() {
    let folder = Folder::new("options");
    for (name, command) in Taker::ALL.into_iter().filter(|(_, command)| *command != Taker::Converge) {
        let listed = listed_options(&folder, name);
        for option in &TABLE {
            let (takes, lists) = (option.commands.contains(&command), listed.iter().any(|name| name == option.name));
            assert_eq!(takes, lists, "luxmap {name} --{}", option.name);
        }
    }
    for command in ["dim", "influence"] {
        let listed = listed_options(&folder, command);
        for useless in ["groups", "first-pass", "checkpoint", "live", "check", "dimming"] {
            assert!(!listed.iter().any(|name| name == useless), "luxmap {command} --{useless}");
            refused(&folder.luxmap(&[command, "scene.toml", &format!("--{useless}=1")]));
        }
    }
}

/// The command line wins over the scene file, which wins over the defaults.
#[test]
fn options_are_layered() {
    let folder = Folder::new("layers");
    let seed = |more: &[&str]| {
        let output = folder.luxmap(&[&["render", "scene.toml", "-o", "out", "-q", "--json"], more].concat());
        done(&output);
        let summary: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
        summary["seed"].as_u64().unwrap_or_else(|| panic!("a seed in {summary}"))
    };
    let quick = "photons = 3000\npasses = 1\n";
    folder.write("scene.toml", &format!("{}[render]\n{quick}", sound()));
    assert_eq!((seed(&[]), seed(&["--seed", "7"])), (0, 7));
    folder.write("scene.toml", &format!("{}[render]\n{quick}seed = 3\n", sound()));
    assert_eq!((seed(&[]), seed(&["--seed", "7"])), (3, 7));
}

/// docs/OPTIONS.md is made from the table of options. With LUXMAP_WRITE_DOCS set, this test writes it.
#[test]
fn the_manual_lists_the_options() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/OPTIONS.md");
    if std::env::var_os("LUXMAP_WRITE_DOCS").is_some() {
        fs::write(&path, manual()).expect("docs is writable");
    }
    let text = fs::read_to_string(&path).expect("docs/OPTIONS.md is there");
    assert!(text == manual(), "docs/OPTIONS.md is out of date: LUXMAP_WRITE_DOCS=1 cargo test --test cli writes it");
}

/// A message of the library names options as programs do, one of the command as they are typed.
#[test]
fn options_are_named_as_they_are_typed() {
    let folder = Folder::new("named");
    for (option, value, start) in [
        ("--memory", "0.001", "luxmap: --memory: found 0.001 GB, expected at least "),
        ("--plane", "roof", "luxmap: --plane: found \"roof\", expected one of floor, desk"),
        ("--camera", "roof", "luxmap: --camera: found \"roof\", expected a scene with a [[camera]]"),
        ("--include", "none", "luxmap: --include: found none, expected a folder"),
    ] {
        let message = refused(&folder.render(&[option, value]));
        assert!(message.starts_with(start), "{message}");
    }
    let scene = luxmap::Scene::load(&folder.0.join("scene.toml")).expect("a sound scene");
    let error = luxmap::Job::new(scene.clone()).memory(0.001).run().expect_err("too little").to_string();
    assert!(error.starts_with("memory: found 0.001 GB"), "{error}");
    let error = luxmap::Job::new(scene).error(0.0).run().expect_err("no end").to_string();
    assert_eq!(error, "error: found 0, expected a number above 0, %");
}
