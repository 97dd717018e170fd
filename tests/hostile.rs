//! Unbreakable by bad input: hostile files are refused in one line or give a right result, names lead nowhere else, and
//! nothing that is no file is read. `fuzz/` looks for more of the kind; what it found stands in `tests/hostile/`.

mod common;
#[path = "common/hostile.rs"]
mod hostile;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::files::Folder;
use hostile::Outcome;
use luxmap::photon::random::{Seed, Stream};
use luxmap::scene::Scene;

/// Every kind of input, the ending of its files, and what reads it.
const TARGETS: [(&str, &str, fn(&[u8]) -> Outcome); 7] = [
    ("scene", "toml", hostile::scene),
    ("obj", "obj", hostile::obj),
    ("mtl", "mtl", hostile::mtl),
    ("ies", "ies", hostile::ies),
    ("ldt", "ldt", hostile::ldt),
    ("reference", "", hostile::reference),
    ("checkpoint", "", hostile::checkpoint),
];

fn tests() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")
}

/// Files of a folder and those below it that end so, in order.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("a readable folder").path());
    let mut found: Vec<PathBuf> = entries
        .flat_map(|path| match path.is_dir() {
            true => files(&path, ending),
            false => Vec::from_iter(path.to_string_lossy().ends_with(ending).then_some(path)),
        })
        .collect();
    found.sort();
    found
}

/// Files in `tests/hostile/`, and what is said of them; nothing where they are sound.
const SAID: &[(&str, &str)] = &[
];

/// What each hostile file comes to, by the table above; none is left out of it.
#[test]
fn hostile_files_come_to_what_they_should() {
    let mut wrong = Vec::new();
    let mut met = BTreeSet::new();
    for (target, _, read) in TARGETS {
        for path in files(&tests().join("hostile").join(target), "") {
            let name = format!("{target}/{}", path.file_name().expect("a file").to_string_lossy());
            let outcome = read(&fs::read(&path).expect("a readable file"));
            let said = outcome.err().unwrap_or_default();
            let expected = SAID.iter().find(|(known, _)| *known == name);
            let right = expected.is_some_and(|(_, part)| if part.is_empty() { said.is_empty() } else { said.contains(part) });
            if !right {
                wrong.push(format!("    (\"{name}\", {said:?}),"));
            }
            met.insert(name);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(SAID.iter().all(|(name, _)| met.contains(*name)), "a file is missing");
}

/// Words that break readers: numbers at the limits, what looks like structure, bytes that are no text.
const NASTY: [&[u8]; 24] = [
    b"0", b"-1", b"1e999", b"-1e308", b"nan", b"inf", b"9223372036854775807", b"4294967296", b"1e-320", b"\0", b"\n",
    b"\r", b"\xff\xfe", b"\xef\xbb\xbf", b"\"", b"'", b"[", b"]", b"{", b"}", b"[[plane]]\n", b"\\\n", b"/", b"..",
];

fn pick(random: &mut Stream, count: usize) -> usize {
    ((f64::from(random.uniform()) * count as f64) as usize).min(count.max(1) - 1)
}

/// An input as it is hurt in the wild: cut off, bytes changed, parts left out, said twice, or put in from another.
fn hurt(input: &[u8], other: &[u8], random: &mut Stream) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..=pick(random, 4) {
        let (at, length) = (pick(random, bytes.len()), 1 + pick(random, 40));
        let end = (at + length).min(bytes.len());
        match pick(random, 7) {
            0 => bytes.truncate(at),
            1 if at < bytes.len() => bytes[at] ^= 1 << pick(random, 8),
            2 if at < bytes.len() => bytes[at] = pick(random, 256) as u8,
            3 => drop(bytes.drain(at..end)),
            4 => drop(bytes.splice(at..at, bytes[at..end].to_vec())),
            5 => drop(bytes.splice(at..end, NASTY[pick(random, NASTY.len())].iter().copied())),
            _ => {
                let from = pick(random, other.len());
                let part = &other[from..(from + length).min(other.len())];
                drop(bytes.splice(at..end, part.iter().copied()));
            }
        }
    }
    bytes
}

/// Whatever happens to an input, it is read as something that makes sense or refused in one line. The targets in `fuzz/` ask
/// the same of inputs that are looked for, not drawn.
#[test]
fn hurt_inputs_are_read_or_refused() {
    for (number, (target, ending, read)) in TARGETS.into_iter().enumerate() {
        let mut inputs = hostile::made_up(target);
        let folders = [tests().join("material"), tests().join("hostile").join(target), tests().join("../scenes")];
        let known = folders[usize::from(ending.is_empty())..].iter().filter(|_| !ending.is_empty() || target == "reference");
        let known = known.flat_map(|folder| files(folder, ending)).filter(|path| path.metadata().is_ok_and(|m| m.len() < 8000));
        inputs.extend(known.map(|path| fs::read(path).expect("a readable file")));
        // States are read in milliseconds, all else in much less.
        let cases = if target == "checkpoint" { 150 } else { 900 };
        let mut taken = 0;
        for case in 0..cases {
            let mut random = Seed(171 + number as u64).stream(case as u64);
            let other = &inputs[pick(&mut random, inputs.len())];
            let input = hurt(&inputs[case % inputs.len()], other, &mut random);
            taken += usize::from(read(&input).is_ok());
        }
        println!("{target}: {taken} of {cases} taken");
        assert!((1..cases).contains(&taken), "{target}: {taken} of {cases} taken: that tells nothing");
    }
}
