//! Many runs: none stops the others, none is done twice, and nothing that ends the command spoils one.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use crate::common::files::{Folder, assert_same, stderr, stdout};
use crate::common::{room, sensor};
use serde_json::Value;

/// What the scenes have in common: a room whose end is a mirror, so that there are caustics, a lamp, a plane.
const BASE: &str = "[[mesh]]\nfile = \"room.obj\"\n[material.wall]\nreflectance = 0.5\n[material.end]\nreflectance = 0.2\n\
                    specular = 0.6\n[[luminaire]]\nname = \"lamp\"\nposition = [3, 1.5, 2]\nopening = { disc = 0.3 }\n\
                    flux = 3000\n[[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\nalong = [4, 0, 0]\nacross = [0, 3, 0]\n\
                    cells = [8, 6]\n";

/// A folder with three sound scenes and a broken one.
fn rooms(test: &str) -> Folder {
    let folder = Folder::new("batch", test);
    fs::create_dir_all(folder.path("rooms")).expect("the target folder is writable");
    let mesh = room([0.0; 3], [4.0, 3.0, 2.5], ["wall", "wall", "wall", "end", "wall", "wall"]);
    folder.write("rooms/room.obj", &mesh);
    folder.write("rooms/a.toml", BASE);
    let second = "[[luminaire]]\nname = \"spot\"\nposition = [1, 1, 2]\nopening = \"point\"\nflux = 800\n";
    let desk = sensor("desk", [1.0, 1.0, 0.75], [0.0, 0.0, 1.0]);
    folder.write("rooms/b.toml", &format!("{BASE}{second}{desk}[render]\ngroups = true\n"));
    let camera =
        "[[camera]]\nname = \"view\"\neye = [0.3, 0.3, 1.6]\nlook_at = [4, 2, 0.8]\nfov = 60\npixels = [16, 12]\n";
    folder.write("rooms/c.toml", &format!("{BASE}{camera}"));
    folder
}

/// Coarse settings of all runs.
const COARSE: &str = "[defaults]\nphotons = 2e3\nrays = 1\npasses = 2\nthreads = 1\n";

/// The runs of `--json`, by name: status, and the rest.
fn runs(output: &Output) -> BTreeMap<String, Value> {
    let batch: Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", stderr(output)));
    let runs = batch["runs"].as_array().expect("a list of runs").iter();
    runs.map(|run| (run["name"].as_str().expect("a name").to_owned(), run.clone())).collect()
}

fn statuses(output: &Output) -> Vec<(String, String)> {
    let status = |run: &Value| run["status"].as_str().expect("a status").to_owned();
    runs(output).iter().map(|(name, run)| (name.clone(), status(run))).collect()
}

fn pairs(expected: &[(&str, &str)]) -> Vec<(String, String)> {
    expected.iter().map(|&(name, status)| (name.to_owned(), status.to_owned())).collect()
}

/// When each file below a folder was last written, by name.
fn times(folder: &Path) -> BTreeMap<String, SystemTime> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() {
            found.extend(times(&path));
        } else {
            let written = path.metadata().and_then(|data| data.modified()).expect("a time");
            found.insert(path.display().to_string(), written);
        }
    }
    found
}

/// When the newest checkpoint of a batch at work was written; files may come and go meanwhile.
fn newest_checkpoint(folder: &Path) -> Option<SystemTime> {
    let runs = fs::read_dir(folder).ok()?.filter_map(Result::ok);
    runs.filter_map(|run| run.path().join("checkpoint").metadata().and_then(|data| data.modified()).ok()).max()
}

const RUN: [&str; 5] = ["batch", "batch.toml", "-o", "out", "-q"];

fn batch(folder: &Folder) -> Output {
    folder.luxmap(&[&RUN[..], &["--json"]].concat())
}

#[test]
fn a_broken_scene_stops_no_other_and_nothing_is_done_twice() {
    let folder = rooms("statuses");
    folder.write("rooms/broken.toml", &BASE.replace("flux", "flvx"));
    folder.write("rooms/hole.toml", &BASE.replace("room.obj", "none.obj"));
    let more =
        "[[run]]\nscene = \"rooms/*.toml\"\n[[run]]\nscene = \"rooms/a.toml\"\nseed = [1, 2]\nmethod = \"split\"\n";
    folder.write("batch.toml", &format!("{COARSE}{more}"));
    let first = batch(&folder);
    assert_eq!((first.status.code(), stderr(&first)), (Some(1), String::new()));
    let of = |status: &'static str| {
        let sound = ["a", "a-seed-1", "a-seed-2", "b", "c"].map(|name| (name, status));
        let mut all = [&sound[..], &[("broken", "failed"), ("hole", "failed")]].concat();
        all.sort_unstable();
        pairs(&all)
    };
    assert_eq!(statuses(&first), of("done"));
    let runs = runs(&first);
    let message = |name: &str| runs[name]["message"].as_str().expect("a message").to_owned();
    assert!(message("broken").starts_with("rooms/broken.toml:12: found unknown key \"flvx\""), "{}", message("broken"));
    assert!(message("hole").contains("none.obj"), "{}", message("hole"));
    assert_eq!(runs["a-seed-2"]["figures"]["method"], "split");
    assert_eq!(runs["a-seed-2"]["figures"]["seed"], 2);

    // The summary has a line for each place, or for the run that has none.
    let csv = fs::read_to_string(folder.path("out/summary.csv")).expect("a summary");
    let expected = 1 + 5 + 2 + ["desk", "view"].len();
    assert_eq!(csv.lines().count(), expected, "{csv}");
    let page = fs::read_to_string(folder.path("out/report.html")).expect("a report");
    assert!(page.contains("<a href=\"a-seed-1/report.html\">") && !page.contains("broken/report.html"));

    // The same results as those of the command for one scene.
    let options = ["--photons", "2000", "--rays", "1", "--passes", "2", "--seed", "2", "--method", "split"];
    folder.succeed(&[&["render", "rooms/a.toml", "-o", "single", "-q"], &options[..]].concat());
    assert_same("a-seed-2", &folder.path("out/a-seed-2"), &folder.path("single"));

    // Again: nothing below the runs' folders is touched.
    let results = || {
        let mut times = times(&folder.path("out"));
        times.retain(|name, _| !name.ends_with("out/summary.csv") && !name.ends_with("out/report.html"));
        times
    };
    let before = results();
    assert!(before.keys().all(|name| !name.ends_with("/checkpoint") && !name.contains(".tmp")), "{before:?}");
    let second = batch(&folder);
    assert_eq!((second.status.code(), statuses(&second)), (Some(1), of("done-before")));
    assert_eq!(results(), before);

    // A scene that changes is done anew, and so is a run whose result is gone.
    folder.write("rooms/b.toml", BASE);
    fs::remove_file(folder.path("out/c/floor.csv")).expect("it was there");
    let third = runs_by_status(&batch(&folder));
    assert_eq!(third["done"], ["b", "c"]);
    assert_eq!(third["done-before"], ["a", "a-seed-1", "a-seed-2"]);
    assert!(folder.path("out/c/floor.csv").exists());

    // Mended, and without the hole: all is well.
    folder.write("rooms/broken.toml", BASE);
    fs::remove_file(folder.path("rooms/hole.toml")).expect("it was there");
    assert_eq!(batch(&folder).status.code(), Some(0));
}

fn runs_by_status(output: &Output) -> BTreeMap<String, Vec<String>> {
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    statuses(output).into_iter().for_each(|(name, status)| found.entry(status).or_default().push(name));
    found
}

/// A folder where a result should be stands for any disk that takes no more. The passes are in the checkpoint.
#[test]
fn results_that_can_t_be_written_cost_no_pass() {
    let folder = rooms("full");
    folder.write("batch.toml", &format!("{COARSE}[[run]]\nscene = [\"rooms/a.toml\", \"rooms/c.toml\"]\n"));
    fs::create_dir_all(folder.path("out/a/floor.csv/in the way")).expect("the target folder is writable");
    let output = batch(&folder);
    assert_eq!((output.status.code(), statuses(&output)), (Some(1), pairs(&[("a", "failed"), ("c", "done")])));
    let message = runs(&output)["a"]["message"].to_string();
    assert!(message.contains("out/a/floor.csv: can't be written"), "{message}");

    let checkpoint = fs::read(folder.path("out/a/checkpoint")).expect("it is kept");
    fs::remove_dir_all(folder.path("out/a/floor.csv")).expect("it was there");
    let output = batch(&folder);
    assert_eq!((output.status.code(), statuses(&output)), (Some(0), pairs(&[("a", "resumed"), ("c", "done-before")])));
    let summary = fs::read_to_string(folder.path("out/a/summary.json")).expect("a summary");
    // Listed as of any run, though no pass was left to do.
    let parsed: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let stages = parsed["stages"].as_array().expect("stages");
    let tracing = stages.iter().find(|stage| stage["name"] == "trace photons").expect("the stage is listed");
    assert!(tracing["seconds"] == 0.0 && summary.contains("\"passes\": 2"), "{summary}");
    assert!(!folder.path("out/a/checkpoint").exists());
    let options = ["--photons", "2000", "--rays", "1", "--passes", "2"];
    folder.succeed(&[&["render", "rooms/a.toml", "-o", "single", "-q"], &options[..]].concat());
    assert_same("a", &folder.path("out/a"), &folder.path("single"));

    // Torn, the checkpoint is set aside, and the run begins anew.
    fs::remove_file(folder.path("out/a/done.json")).expect("it was there");
    fs::write(folder.path("out/a/checkpoint"), &checkpoint[..checkpoint.len() / 2]).expect("room for a file");
    fs::write(folder.path("out/a/.luxmap-4194304-7.tmp"), "").expect("room for a file"); // above the highest process id
    let output = batch(&folder);
    assert_eq!(statuses(&output), pairs(&[("a", "done"), ("c", "done-before")]));
    let warnings = runs(&output)["a"]["warnings"].to_string();
    assert!(warnings.contains("a checksum that does not fit") && warnings.contains("checkpoint-refused"), "{warnings}");
    assert!(folder.path("out/a/checkpoint-refused").exists() && !folder.path("out/a/checkpoint").exists());
    assert!(!Path::new("/proc/self").exists() || !folder.path("out/a/.luxmap-4194304-7.tmp").exists());
    assert_same("a", &folder.path("out/a"), &folder.path("single"));

    // Of other settings too: a checkpoint that was kept, and photons that are more now.
    folder.luxmap(&[&RUN[..], &["--keep-checkpoints", "--", "--seed=5"]].concat());
    assert!(folder.path("out/a/checkpoint").exists());
    let output = folder.luxmap(&[&RUN[..], &["--json", "--", "--seed=5", "--photons=2500"]].concat());
    assert_eq!(statuses(&output), pairs(&[("a", "done"), ("c", "done")]));
    assert!(runs(&output)["a"]["warnings"].to_string().contains("found a state of photons 2000, expected 2500"));
}

/// A 64-bit generator of Marsaglia's.
fn next(random: &mut u64) -> u64 {
    *random ^= *random << 13;
    *random ^= *random >> 7;
    *random ^= *random << 17;
    *random
}

/// The promise of the command: killed at any moment, it goes on to the same bits, and no file is torn. Each kill is proved to
/// have hit a run at work: a checkpoint was written since it was started, and it ended by the signal.
#[cfg(unix)]
#[test]
fn kill_9_changes_no_bit() {
    use std::os::unix::process::ExitStatusExt as _;
    let folder = rooms("killed");
    let more = "[[run]]\nscene = \"rooms/*.toml\"\nmethod = [\"gather\", \"photons\"]\n";
    folder.write("batch.toml", &format!("{}{more}", COARSE.replace("passes = 2", "passes = 24")));
    folder.succeed(&["batch", "batch.toml", "-o", "whole", "-q"]);
    let mut random = 20_250_607;
    let newest = || newest_checkpoint(&folder.path("out"));
    fs::create_dir_all(folder.path("out")).expect("room for a folder");
    for kill in 0..6 {
        let before = newest();
        let mut child =
            folder.command(&RUN).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("luxmap starts");
        let started = Instant::now();
        while newest().is_none() || newest() == before {
            assert!(started.elapsed() < Duration::from_secs(60), "kill {kill}: no pass is kept");
            assert!(child.try_wait().expect("it is ours").is_none(), "kill {kill} comes too late: the work is done");
            sleep(Duration::from_millis(1));
        }
        sleep(Duration::from_millis(next(&mut random) % 20));
        child.kill().expect("it is ours");
        assert_eq!(child.wait().expect("it ends").signal(), Some(9), "kill {kill} comes too late: the work is done");
    }
    let output = batch(&folder);
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()), "{}", stdout(&output));
    for name in ["a", "b", "c"].iter().flat_map(|scene| ["gather", "photons"].map(|m| format!("{scene}-method-{m}"))) {
        assert_same(&name, &folder.path("out").join(&name), &folder.path("whole").join(&name));
    }
    let names = |output: &str| {
        let prefix = folder.path(output).display().to_string();
        times(&folder.path(output)).into_keys().map(|name| name.replace(&prefix, "")).collect::<Vec<_>>()
    };
    assert_eq!(names("out"), names("whole"), "a file is left over, or missing");
}

/// Ctrl-C ends the pass in hand, and no more.
#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_done() {
    let folder = rooms("interrupted");
    folder.write("batch.toml", &format!("{COARSE}[[run]]\nscene = [\"rooms/a.toml\", \"rooms/b.toml\"]\n"));
    // Passes without end.
    let arguments = [&RUN[..], &["--json", "--", "--passes=4000000"]].concat();
    let child =
        folder.command(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("luxmap starts");
    let started = Instant::now();
    while !folder.path("out/a/checkpoint").exists() {
        assert!(started.elapsed() < Duration::from_secs(60), "there is no checkpoint");
        sleep(Duration::from_millis(5));
    }
    let signal = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(signal.expect("a command that sends signals").success());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert_eq!(statuses(&output), pairs(&[("a", "interrupted"), ("b", "not-begun")]));
    let passes = runs(&output)["a"]["figures"]["passes"].as_u64().expect("a number of passes");
    assert!(folder.path("out/report.html").exists());
    // As many passes are asked for now as are there.
    let passes = format!("--passes={passes}");
    let output = folder.luxmap(&[&RUN[..], &["--json", "--", &passes]].concat());
    assert_eq!(statuses(&output)[0], ("a".to_owned(), "resumed".to_owned()));
    let options = ["--photons=2000", "--rays=1", passes.as_str()];
    folder.succeed(&[&["render", "rooms/a.toml", "-o", "single", "-q"], &options[..]].concat());
    assert_same("a", &folder.path("out/a"), &folder.path("single"));
}

#[test]
fn a_bad_batch_file_is_one_line() {
    let folder = rooms("refused");
    let run = "[[run]]\nscene = \"rooms/a.toml\"\n";
    for (text, message) in [
        (
            format!("{run}erorr = 1"),
            "batch.toml:3: found unknown key \"erorr\" in [[run]], expected one of scene, name, ",
        ),
        (format!("{run}output = \"x\""), "batch.toml:3: found unknown key \"output\" in [[run]], expected one of "),
        (
            format!("{run}method = [\"gather\", \"pth\"]"),
            "batch.toml:3: found method = [\"gather\", \"pth\"] in [[run]], expected one of gather, split, path, ",
        ),
        (format!("{run}error = 0"), "batch.toml:3: found error = 0 in [[run]], expected more than 0 %"),
        (
            format!("{run}photons = 2.5"),
            "batch.toml:3: found photons = 2.5 in [[run]], expected what --photons takes (",
        ),
        (format!("{run}layers = [\"sterr\"]"), "expected one of direct, indirect, stderr"),
        ("[[run]]\nscene = \"none/*.toml\"".to_owned(), "batch.toml:2: found scene = \"none/*.toml\""),
        ("[defaults]".to_owned(), "batch.toml: found no [[run]], expected at least one of them"),
    ] {
        folder.write("batch.toml", &text);
        let found = folder.refused(&RUN);
        assert!(found.contains(message), "{found}");
    }
    folder.write("batch.toml", run);
    for (arguments, message) in [
        (&["batch", "batch.toml", "rooms/a.toml"][..], "batch.toml: found a batch file and 1 more"),
        (&["batch", "none.toml"], "none.toml: found no such file"),
        (&["batch", "batch.toml", "--", "--output=x"], "found --output after --"),
        (&["batch", "batch.toml", "--", "--erorr=1"], "unexpected argument '--erorr' found"),
    ] {
        let found = folder.refused(arguments);
        assert!(found.contains(message), "{found}");
    }
    assert!(!folder.path("out").exists(), "something is written");
    // Two batches at once would overwrite each other's files.
    fs::create_dir_all(folder.path("out")).expect("the target folder is writable");
    let held = File::open(folder.path("out")).expect("a folder");
    if held.try_lock().is_ok() {
        assert!(folder.refused(&RUN).contains("out: found another luxmap at work"));
    }
}

/// A sensor that misses its target is an exit code for those who ask, also when the run is not repeated.
#[test]
fn check_is_asked_of_every_run() {
    let folder = rooms("check");
    let desk = sensor("desk", [1.0, 1.0, 0.75], [0.0, 0.0, 1.0]);
    folder.write("rooms/a.toml", &format!("{BASE}{desk}target = 1e6\n"));
    let call = |more: &[&str]| {
        let files = ["batch", "rooms/a.toml", "rooms/c.toml", "-o", "out", "-q", "--json", "--"];
        folder.luxmap(&[&files, &["--photons=2000", "--rays=1", "--passes=1"][..], more].concat())
    };
    for status in ["done", "done-before"] {
        let output = call(&["--check"]);
        assert_eq!((output.status.code(), statuses(&output)), (Some(1), pairs(&[("a", status), ("c", status)])));
        assert_eq!(runs(&output)["a"]["message"], "misses a target or requirement");
        assert_eq!(runs(&output)["c"]["message"], Value::Null);
    }
    assert_eq!(call(&[]).status.code(), Some(0));
}
