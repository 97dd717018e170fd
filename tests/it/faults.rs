//! What the world does to a run: signals, full disks, readers that leave, a second run in the same folder. Each time there is
//! a right result or one clear line, and nothing is left half-written.
#![cfg(unix)]

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::files::{Folder, assert_same, numbers, stderr};
use crate::common::room;
use serde_json::Value;

const SCENE: &str = "[[mesh]]\nfile = \"room.obj\"\n[material.wall]\nreflectance = 0.5\n[[luminaire]]\nname = \"lamp\"\n\
                     position = [2, 1.5, 2]\nflux = 3000\n[[plane]]\nname = \"floor\"\ncorner = [0, 0, 0]\n\
                     along = [4, 0, 0]\nacross = [0, 3, 0]\ncells = [8, 6]\n";
const RENDER: [&str; 8] = ["render", "room.toml", "-o", "out", "-q", "--photons=2000", "--rays=1", "--threads=1"];

fn place(test: &str) -> Folder {
    let folder = Folder::new("faults", test);
    folder.write("room.obj", &room([0.0; 3], [4.0, 3.0, 2.5], ["wall"; 6]));
    folder.write("room.toml", SCENE);
    folder
}

/// A run of passes without end, and its end by signals once there is a first state.
fn ended_by(folder: &Folder, signals: &[&str]) -> Output {
    let arguments = [&RENDER[..], &["--passes=4000000", "--checkpoint=state"]].concat();
    let child =
        folder.command(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("luxmap starts");
    let started = Instant::now();
    while !folder.path("state").exists() {
        assert!(started.elapsed() < Duration::from_secs(60), "there is no checkpoint");
        sleep(Duration::from_millis(5));
    }
    for signal in signals {
        let sent = Command::new("kill").args([signal, child.id().to_string().as_str()]).status();
        assert!(sent.expect("a command that sends signals").success());
    }
    child.wait_with_output().expect("it ends")
}

fn passes(folder: &Path) -> u64 {
    let text = fs::read(folder.join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_slice(&text).expect("JSON");
    summary["passes"].as_u64().expect("a number of passes")
}

/// Names of temporary files in a folder.
fn temporaries(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("readable").file_name());
    names.map(|name| name.to_string_lossy().into_owned()).filter(|name| name.starts_with(".luxmap")).collect()
}

#[test]
fn a_signal_ends_the_run_with_the_passes_it_has() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        let folder = place(&format!("signal{signal}"));
        let output = ended_by(&folder, &[signal]);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(130), "{signal}: {said}");
        let passes = passes(&folder.path("out"));
        assert!(said.contains(&format!("warning: interrupted after pass {passes}")), "{said}");
        assert!(temporaries(&folder.path("out")).is_empty() && temporaries(&folder.0).is_empty());
        // They are those of a run that was asked for no more, but for the warning.
        let rest = ["-o", "asked", &format!("--passes={passes}")];
        folder.succeed(&[&RENDER[..2], &RENDER[4..], &rest].concat());
        let [mut found, mut asked] = ["out", "asked"].map(|name| numbers(&folder.path(name)));
        assert_ne!(found.remove("summary.json"), asked.remove("summary.json"), "the warning is missing");
        assert_eq!(found, asked, "{signal}");
    }
}

/// The state of the last pass remains, and what an earlier run has found.
#[test]
fn a_second_signal_ends_it_at_once() {
    let folder = place("twice");
    folder.succeed(&[&RENDER[..], &["--passes=1"]].concat());
    // The passes of this run begin anew; its results would be others.
    let output = ended_by(&folder, &["-INT", "-TERM"]);
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(temporaries(&folder.path("out")).is_empty() && temporaries(&folder.0).is_empty());
    let again = [&RENDER[..], &["--checkpoint=state", "--passes=1"]].concat();
    let kept = numbers(&folder.path("out"));
    if passes(&folder.path("out")) == 1 {
        let output = folder.luxmap(&[&RENDER[..2], &RENDER[4..], &["-o", "one", "--passes=1"]].concat());
        assert_eq!(output.status.code(), Some(0));
        assert_eq!(kept, numbers(&folder.path("one")));
    }
    assert_eq!(folder.luxmap(&again).status.code(), Some(0), "the checkpoint is sound");
}

#[test]
fn nobody_has_to_listen() {
    let folder = place("deaf");
    let quick = [&RENDER[..], &["--passes=1"]].concat();
    folder.succeed(&quick);
    let expected = numbers(&folder.path("out"));
    for arguments in [&quick[..], &[&quick[..], &["--json"]].concat()] {
        fs::remove_dir_all(folder.path("out")).expect("it was there");
        let mut child =
            folder.command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().expect("it ends").code(), Some(0), "{arguments:?}");
        assert_eq!(numbers(&folder.path("out")), expected);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_said() {
    let folder = place("full-output");
    let full = File::options().write(true).open("/dev/full").expect("a device of Linux");
    let output = folder.command(&[&RENDER[..], &["--passes=1"]].concat()).stdout(full).output().expect("starts");
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(stderr(&output).lines().count(), 1);
    assert!(stderr(&output).starts_with("luxmap: standard output: can't be written"), "{}", stderr(&output));
    numbers(&folder.path("out"));
}

#[test]
fn one_folder_takes_one_run() {
    let folder = place("busy");
    fs::create_dir_all(folder.path("out")).expect("the target folder is writable");
    let held = File::open(folder.path("out")).expect("a folder");
    if held.try_lock().is_err() {
        println!("not tested: this file system locks no folders");
        return;
    }
    let quick = [&RENDER[..], &["--passes=1"]].concat();
    let refused = folder.refused(&quick);
    assert!(refused.starts_with("luxmap: out: found another luxmap at work, expected a folder at rest"), "{refused}");
    drop(held);
    folder.succeed(&quick);
    // Two at once: each ends well or is refused, and what is there is of one run.
    let other = [&quick[..], &["--seed=1"]].concat();
    let run = |arguments: &[&str]| {
        folder.command(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("luxmap starts")
    };
    let codes = [run(&quick), run(&other)].map(|mut child| child.wait().expect("it ends").code());
    assert!(codes.iter().all(|code| matches!(code, Some(0 | 2))) && codes.contains(&Some(0)), "{codes:?}");
    let found = numbers(&folder.path("out"));
    let seeds = [&quick, &other].map(|arguments| {
        folder.succeed(&[&arguments[..2], &["-o", "alone"], &arguments[4..]].concat());
        numbers(&folder.path("alone"))
    });
    assert!(seeds.contains(&found), "the results are a mixture");
}

#[test]
fn where_nothing_can_be_written_nothing_is_computed() {
    let folder = place("no-place");
    folder.write("file", "");
    for place in ["file", "file/below", "/proc/luxmap"] {
        let message = folder.refused(&["render", "room.toml", "-o", place]);
        assert!(message.starts_with(&format!("luxmap: {place}: can't be written")), "{message}");
    }
}

/// In a namespace of its own, a file system of 60 kB over the folder of the results. A run that fits, then one that doesn't.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_what_was_there() {
    let folder = place("full");
    folder.write("large.toml", &SCENE.replace("cells = [8, 6]", "cells = [80, 60]"));
    fs::create_dir_all(folder.path("out")).expect("the target folder is writable");
    let script = "mount -t tmpfs -o size=1500k none out || exit 77; cd .; \"$0\" render room.toml -o out -q --passes=1 || exit 3; \
                  rm -rf before; cp -r out before; dd if=/dev/zero of=out/filler bs=1k 2> /dev/null; \
                  dd if=/dev/null of=out/filler bs=1k seek=$(($(stat -c %s out/filler) / 1024 - 40)) 2> /dev/null; \
                  \"$0\" render large.toml -o out -q --passes=1; code=$?; rm out/filler; ls -A out > names; \
                  cp -r out after; exit $code";
    let output = Command::new("unshare")
        .args(["--user", "--map-root-user", "--mount", "sh", "-c", script, env!("CARGO_BIN_EXE_luxmap")])
        .current_dir(&folder.0)
        .output();
    let output = match output {
        Ok(output) if output.status.code() != Some(77) && folder.path("before").exists() => output,
        _ => {
            println!("not tested: this system mounts nothing for us");
            return;
        }
    };
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.starts_with("luxmap: out/") && said.lines().count() == 1, "{said}");
    assert!(said.contains("can't be written") && said.contains("No space left on device"), "{said}");
    assert_same("after", &folder.path("after"), &folder.path("before"));
    let names = fs::read_to_string(folder.path("names")).expect("a list");
    assert!(!names.contains(".luxmap"), "{names}");
}
