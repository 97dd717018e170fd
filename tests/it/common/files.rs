//! The command in a folder of its own, and what it leaves there.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use serde_json::Value;

/// A folder of one test, empty at first.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(file: &str, test: &str) -> Self {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(file).join(test);
        let _ = fs::remove_dir_all(&folder); // of an earlier run
        fs::create_dir_all(&folder).expect("the target folder is writable");
        Self(folder)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("the target folder is writable");
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_luxmap"));
        command.current_dir(&self.0).args(arguments);
        command
    }

    pub fn luxmap(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("luxmap starts")
    }

    /// Runs luxmap, which succeeds without a word on stderr.
    pub fn succeed(&self, arguments: &[&str]) -> String {
        println!("{arguments:?}");
        done(&self.luxmap(arguments))
    }

    /// Runs luxmap, which refuses in one line with exit code 2; returns the line.
    pub fn refused(&self, arguments: &[&str]) -> String {
        println!("{arguments:?}");
        refused(&self.luxmap(arguments))
    }
}

/// Exit code 0 and nothing on stderr; returns what is on stdout.
#[track_caller]
pub fn done(output: &Output) -> String {
    assert_eq!((output.status.code(), stderr(output).as_str()), (Some(0), ""), "{}", stdout(output));
    stdout(output)
}

/// Exit code 2, nothing on stdout and one line on stderr, which is returned.
#[track_caller]
pub fn refused(output: &Output) -> String {
    let message = stderr(output);
    assert_eq!((output.status.code(), stdout(output).as_str()), (Some(2), ""), "{message}");
    assert!(message.starts_with("luxmap: ") && message.ends_with('\n') && message.lines().count() == 1, "{message:?}");
    message.trim_end().to_owned()
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("text")
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("text")
}

/// A summary without what differs from call to call: times, threads, memory; and the number of rays, as each call casts those
/// of direct light and of the surroundings anew.
pub fn lasting(mut summary: Value) -> Value {
    let fields = summary.as_object_mut().expect("a summary is an object");
    for name in ["stages", "total_s", "threads", "peak_memory_bytes", "bvh_memory_bytes"] {
        assert!(fields.remove(name).is_some(), "{name}");
    }
    summary
}

/// All numbers that a run has written into a folder, to the bit: pixels of EXR files, tables, the summary.
pub fn numbers(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.expect("a readable folder").path();
        let name = path.file_name().expect("a file").to_string_lossy().into_owned();
        let content = || fs::read(&path).expect("a readable file");
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("csv" | "ply") => drop(found.insert(name, content())),
            Some("json") if name == "summary.json" => {
                let summary = serde_json::from_slice(&content()).expect("JSON");
                found.insert(name, lasting(summary).to_string().into_bytes());
            }
            Some("exr") => {
                let image = read_all_flat_layers_from_file(&path).expect("an EXR file");
                for channel in image.layer_data.iter().flat_map(|layer| &layer.channel_data.list) {
                    let FlatSamples::F32(pixels) = &channel.sample_data else { panic!("single precision") };
                    let bits = pixels.iter().flat_map(|pixel| pixel.to_bits().to_le_bytes());
                    found.insert(format!("{name} {}", channel.name), bits.collect());
                }
            }
            _ => {}
        }
    }
    assert!(found.contains_key("summary.json"), "no results in {}", folder.display());
    found
}

/// Asserts that two folders hold the same numbers; says which differ.
pub fn assert_same(what: &str, found: &Path, expected: &Path) {
    let (found, expected) = (numbers(found), numbers(expected));
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>(), "{what}");
    let differ: Vec<_> = found.iter().filter(|(name, bits)| expected[*name] != **bits).map(|(name, _)| name).collect();
    assert!(differ.is_empty(), "{what}: {differ:?} differ");
}
