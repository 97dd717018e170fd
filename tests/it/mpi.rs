//! Passes spread over MPI processes: the same bits as one process, and nothing lost when a process dies.
//!
//! Needs the feature `mpi` and mpirun; `make test` installs both where it may.
#![cfg(feature = "mpi")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const LUXMAP: &str = env!("CARGO_BIN_EXE_luxmap");

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)
}

/// A fresh folder for one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mpi").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the build folder can be written");
    folder
}

fn arguments(scene_name: &str, out: &Path, more: &[&str]) -> Vec<String> {
    let scene = scene(scene_name);
    let fixed = ["render", scene.to_str().expect("a plain path"), "--quiet", "--threads", "1", "-o"];
    let out = out.to_str().expect("a plain path");
    fixed.iter().copied().chain([out]).chain(more.iter().copied()).map(str::to_owned).collect()
}

fn alone(arguments: &[String]) -> Output {
    Command::new(LUXMAP).args(arguments).output().expect("luxmap starts")
}

fn mpirun(processes: u32, arguments: &[String]) -> Command {
    let mut command = Command::new("mpirun");
    // Containers run as root, and have fewer cores than processes are tried with.
    command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    command.args(["--oversubscribe", "--bind-to", "none", "-n", &processes.to_string(), LUXMAP]).args(arguments);
    command
}

fn succeeded(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Maps and sensors as text: every digit that is written is the same.
fn tables(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut tables: Vec<(String, Vec<u8>)> = fs::read_dir(folder)
        .expect("the folder is there")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|end| end == "csv"))
        .map(|path| {
            (path.display().to_string().replace(&folder.display().to_string(), ""), fs::read(&path).expect("a file"))
        })
        .collect();
    tables.sort();
    assert!(!tables.is_empty(), "{} holds no table", folder.display());
    tables
}

/// Caustics, light groups and sensors; passes in number, and as many as an error asks for.
#[test]
fn two_and_four_processes_find_the_bits_of_one() {
    let cases: [(&str, &[&str]); 3] = [
        ("caustic.toml", &["--photons", "20000", "--passes", "5"]),
        ("seed-office.toml", &["--groups", "--photons", "20000", "--passes", "3"]),
        ("seed-office.toml", &["--method", "split", "--photons", "60000", "--error", "4"]),
    ];
    for (number, (name, options)) in cases.into_iter().enumerate() {
        let folder = folder(&format!("bits-{number}"));
        let one = folder.join("1");
        succeeded(&alone(&arguments(name, &one, options)));
        for processes in [2, 4] {
            let many = folder.join(processes.to_string());
            succeeded(&mpirun(processes, &arguments(name, &many, options)).output().expect("mpirun starts"));
            assert!(tables(&one) == tables(&many), "{name}: {processes} processes find other bits than one");
        }
    }
}

/// Process numbers of the ranks of a run, but for the leader's.
fn followers(out: &Path) -> Vec<u32> {
    let is_follower = |process: &u32| {
        let read = |what: &str| fs::read(format!("/proc/{process}/{what}")).unwrap_or_default();
        let (command, environment) = (read("cmdline"), read("environ"));
        let holds = |text: &[u8], word: &[u8]| text.windows(word.len()).any(|window| window == word);
        command.starts_with(LUXMAP.as_bytes())
            && holds(&command, out.to_str().expect("a plain path").as_bytes())
            && holds(&environment, b"OMPI_COMM_WORLD_RANK=")
            && !holds(&environment, b"OMPI_COMM_WORLD_RANK=0\0")
    };
    let processes = fs::read_dir("/proc").expect("Linux").flatten();
    processes.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).filter(is_follower).collect()
}

fn wait_for(what: &str, mut done: impl FnMut() -> bool) {
    let started = Instant::now();
    while !done() {
        assert!(started.elapsed() < Duration::from_secs(120), "waited in vain for {what}");
        sleep(Duration::from_millis(10));
    }
}

fn wait(child: &mut Child) -> bool {
    let mut status = None;
    wait_for("the end of a job whose process died", || {
        status = child.try_wait().expect("the child is ours");
        status.is_some()
    });
    status.is_some_and(|status| status.success())
}

#[test]
fn a_process_that_dies_fails_the_job_and_the_checkpoint_goes_on() {
    let folder = folder("death");
    let (whole, broken, checkpoint) = (folder.join("whole"), folder.join("broken"), folder.join("state"));
    let options = ["--photons", "20000", "--passes", "12"];
    succeeded(&alone(&arguments("seed-office.toml", &whole, &options)));

    let checkpoint_text = checkpoint.to_str().expect("a plain path");
    let kept = [&options[..], &["--checkpoint", checkpoint_text]].concat();
    let arguments = arguments("seed-office.toml", &broken, &kept);
    let mut job = mpirun(3, &arguments).stderr(Stdio::null()).stdout(Stdio::null()).spawn().expect("mpirun starts");
    wait_for("the first checkpoint", || checkpoint.exists());
    let followers = followers(&broken);
    let victim = followers.first().expect("a process that follows").to_string();
    assert!(Command::new("kill").args(["-9", &victim]).status().expect("kill is there").success());
    assert!(!wait(&mut job), "the job ended well without one of its processes");
    assert!(!broken.join("summary.json").exists(), "results of a job that died");

    succeeded(&alone(&arguments));
    assert!(tables(&whole) == tables(&broken), "going on after a death changed the bits");
}

#[test]
fn what_ails_every_process_is_said_once() {
    let folder = folder("refused");
    let output = mpirun(3, &arguments("no-such.toml", &folder, &[])).output().expect("mpirun starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.matches("no-such.toml: found no scene").count(), 1, "{said}");
}
